//! A browser without a window, told by its debugging pipe what to open and asked what it sees.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

/// Programs that are tried, after the one that `SINEW_BROWSER` names.
const NAMES: [&str; 4] = [
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
];
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running browser with one page.
pub struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    asked: u64,
    session: Option<String>,
    _profile: TempDir,
}

impl Browser {
    /// Starts one; `None`, and a loud line, where there is none.
    pub fn start() -> Option<Self> {
        let own = std::env::var("SINEW_BROWSER").ok();
        let mut names = own.iter().map(String::as_str).chain(NAMES);
        let there = |name: &&str| {
            let asked = Command::new(name)
                .arg("--version")
                .stderr(Stdio::null())
                .output();
            asked.is_ok_and(|said| said.status.success())
        };
        let Some(name) = names.find(there) else {
            // Past the harness, which keeps what a passing test prints.
            let reason = format!(
                "no browser ({}): pages were not looked at",
                NAMES.join(", ")
            );
            let _ = writeln!(std::io::stdout(), "SKIPPED: {reason}");
            return None;
        };
        let profile = tempfile::tempdir().expect("a temporary folder can be made");
        // The browser listens on descriptor 3 and answers on 4.
        let mut child = Command::new("sh")
            .args([
                "-c",
                "exec \"$0\" \"$@\" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null",
            ])
            .arg(name)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
            ])
            .args([
                "--no-first-run",
                "--disable-extensions",
                "--remote-debugging-pipe",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell starts");
        let to = child.stdin.take().expect("it is piped");
        let mut answers = BufReader::new(child.stdout.take().expect("it is piped"));
        let (sender, from) = channel();
        std::thread::spawn(move || {
            let mut answer = Vec::new();
            while answers
                .read_until(0, &mut answer)
                .is_ok_and(|read| read > 0)
            {
                answer.pop();
                let Ok(value) = serde_json::from_slice(&answer) else {
                    break;
                };
                if sender.send(value).is_err() {
                    break;
                }
                answer.clear();
            }
        });
        let mut browser = Self {
            child,
            to,
            from,
            asked: 0,
            session: None,
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        let session = browser.call("Target.attachToTarget", target);
        browser.session = session["sessionId"].as_str().map(str::to_owned);
        browser.call("Page.enable", json!({}));
        Some(browser)
    }

    /// Sends a command and gives its result.
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.asked += 1;
        let mut message = json!({ "id": self.asked, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.to.write_all(&bytes).expect("the browser listens");
        loop {
            let answer = self.from.recv_timeout(PATIENCE);
            let answer = answer.unwrap_or_else(|error| panic!("{method}: no answer: {error}"));
            if answer["id"] == json!(self.asked) {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
        }
    }

    /// Opens a file at a width, in the light or the dark scheme, and waits until it is there.
    pub fn open(&mut self, page: &Path, width: u32, dark: bool) {
        let metrics =
            json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let value = if dark { "dark" } else { "light" };
        let scheme = json!([{ "name": "prefers-color-scheme", "value": value }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": scheme }));
        let url = format!("file://{}", page.display());
        let navigated = self.call("Page.navigate", json!({ "url": url }));
        assert!(navigated["errorText"].is_null(), "{url}: {navigated}");
        let ready = "new Promise((done) => document.readyState === 'complete' \
                     ? done(location.protocol) : addEventListener('load', () => done(location.protocol)))";
        assert_eq!(self.evaluate(ready), json!("file:"));
    }

    /// Value of an expression in the page; a promise is waited for.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let parameters =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let found = self.call("Runtime.evaluate", parameters);
        let thrown = &found["exceptionDetails"];
        assert!(thrown.is_null(), "{thrown}");
        found["result"]["value"].clone()
    }

    /// Moves, presses (`mousePressed`) or lifts (`mouseReleased`) the pointer.
    pub fn pointer(&mut self, kind: &str, x: f64, y: f64) {
        let button = if kind == "mouseMoved" { "none" } else { "left" };
        let parameters = json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", parameters);
    }

    /// The page's picture up to a height, as a PNG in base64.
    pub fn picture(&mut self, width: u32, height: u32) -> String {
        let clip = json!({ "x": 0, "y": 0, "width": width, "height": height, "scale": 1 });
        let parameters = json!({ "format": "png", "captureBeyondViewport": true, "clip": clip });
        let found = self.call("Page.captureScreenshot", parameters);
        found["data"].as_str().expect("a picture").to_owned()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
