//! The first power-up of a rig, rehearsed in QEMU: the verb, the image, the link.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use crate::desk::{Desk, images};
use crate::schema::{schema, violations};

/// Short motions: the emulator runs in real time.
const LINE: &str = "commission mass-spring-damper.toml --out trial --rehearse --sweep-seconds 4 \
                    --seconds 6";

fn rehearsal(desk: &Desk, more: &str) -> Command {
    let mut command = desk.command(&format!("{LINE} {more}"));
    command.env("SINEW_BUILD_DIR", images());
    command
}

fn journal(desk: &Desk) -> Value {
    let journal = desk.read("trial/commission.json");
    let journal = serde_json::from_str(&journal).expect("it is JSON");
    let broken = violations(&schema("commission"), &journal);
    assert_eq!(broken, [""; 0], "{journal}");
    journal
}

/// Names of the finished steps.
fn done(desk: &Desk) -> Vec<String> {
    let journal = journal(desk);
    let done = journal["done"].as_object().expect("a table");
    done.keys().cloned().collect()
}

#[test]
fn a_rehearsal_goes_from_the_emergency_stop_to_a_diagnosis_and_is_resumed_after_a_ctrl_c() {
    if Command::new("qemu-system-arm")
        .arg("--version")
        .output()
        .is_err()
    {
        // Written, not printed: the test harness would swallow it.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no qemu-system-arm (cargo xtask setup)"
        );
        return;
    }
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");

    // Stopped while the mass moves.
    let mut child = rehearsal(&desk, "--until excite")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let at_rest = lines.find(|line| line.as_ref().is_ok_and(|line| line.contains("at rest")));
    let mut words = String::new();
    if at_rest.is_some() {
        std::thread::sleep(Duration::from_millis(1500));
        let id = Pid::from_raw(i32::try_from(child.id()).expect("a process number fits"));
        kill(id, Signal::SIGINT).expect("the program runs");
    }
    let _ = child
        .stderr
        .take()
        .expect("a pipe")
        .read_to_string(&mut words);
    let status = child.wait().expect("the program is a child of the test");
    assert_eq!(status.code(), Some(130), "{words}");
    assert!(words.contains("emergency stop"), "{words}");
    let rest: Vec<String> = lines.map_while(|line| line.ok()).collect();
    assert_eq!(rest, ["stopped; the same command goes on where it was"]);
    assert_eq!(done(&desk), ["rest", "stop"]);

    let output = rehearsal(&desk, "--until excite")
        .output()
        .expect("the program starts");
    let (said, words) = (
        String::from_utf8_lossy(&output.stdout).into_owned(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    );
    assert_eq!(output.status.code(), Some(0), "{said}\n{words}");
    assert!(
        !said.contains("noise"),
        "a finished step was taken again: {said}"
    );
    assert!(
        said.contains("emergency stop: confirmed by telemetry"),
        "{said}"
    );
    assert_eq!(done(&desk), ["ends", "excite", "move", "rest", "stop"]);
    let moved = &journal(&desk)["actuators"][0];
    let ratio = moved["ratios"]["q_m"].as_f64().expect("a number");
    assert!((ratio - 1.0).abs() < 0.1, "{moved}");
    assert_eq!(moved["ends"][1]["saturated"], false, "{moved}");
    for name in ["trial/fit.csv", "trial/test.csv"] {
        let rows = desk.read(name).lines().count();
        assert!(rows > 600, "{name}: {rows}");
    }

    // Steps without a board.
    let output = rehearsal(&desk, "--until diagnose")
        .output()
        .expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}");
    let finding: Value = serde_json::from_str(&desk.read("trial/diagnosis.json")).expect("JSON");
    assert_eq!(finding["effects"], serde_json::json!([]), "{finding}");
    let fit: Value = serde_json::from_str(&desk.read("trial/fit.json")).expect("JSON");
    assert_eq!(fit["format"], "sinew-fit/1");
    assert!(Path::new(&desk.path("trial/fitted.toml")).exists());

    // A sensor that counts the other way.
    let right = desk.read("mass-spring-damper.toml");
    let wrong = right.replace("signal = \"q_m\"", "signal = \"q_m\"\ngain = -1.0");
    assert_ne!(wrong, right);
    desk.write("wrong.toml", &wrong);
    let output = rehearsal(&desk, "--again move --plant wrong.toml --until excite").output();
    let output = output.expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("`q_m` counts the other way"), "{words}");
    assert!(words.contains("`u_N` drives the other way"), "{words}");
    let kinds = journal(&desk)["fault"]["causes"].clone();
    assert_eq!(kinds.as_array().map(Vec::len), Some(2), "{kinds}");
    assert_eq!(done(&desk), ["rest", "stop"]);
}

#[test]
fn a_first_run_writes_the_bare_model_and_says_what_comes_next() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    let said = desk.succeed("commission mass-spring-damper.toml --out first");
    assert!(
        said.contains("sinew flash --board BOARD --model first/bare"),
        "{said}"
    );
    let output = desk.sinew("commission mass-spring-damper.toml --out first --json -");
    assert_eq!(output.status.code(), Some(0));
    let document: Value = serde_json::from_slice(&output.stdout).expect("a document alone");
    assert_eq!(violations(&schema("commission"), &document), [""; 0]);
    assert_eq!(document["rehearsal"], false, "{document}");
    let aside = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(aside.contains("next: sinew wire"), "{aside}");
    let model = desk.read("first/bare/model.toml");
    assert!(
        model.contains("lower = [-20.0]") && model.contains("name = \"q_m\""),
        "{model}"
    );
    // Without a person there is no consent.
    let line = "commission mass-spring-damper.toml --out first --port /dev/null";
    let output = desk.command(line).stdin(Stdio::null()).output();
    let output = output.expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(
        words.contains("nothing may move without consent"),
        "{words}"
    );
}

#[test]
fn what_cannot_be_commissioned_is_refused_before_any_work() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/damper-stand.toml");
    let rig = "mass-spring-damper.toml";
    for (line, why) in [
        (
            format!("{rig} --out o --range u_N=1"),
            "`--range` must be NAME=LOWER:UPPER",
        ),
        (
            format!("{rig} --out o --range x=0:1"),
            "the rig's inputs: u_N",
        ),
        (
            format!("{rig} --out o --range u_N=-30:1"),
            "within the limit of `u_N`",
        ),
        (
            format!("{rig} --out o --amplitude 0.9"),
            "`--amplitude` must be",
        ),
        (
            format!("{rig} --out o --amplitude nan"),
            "`--amplitude` must be",
        ),
        (
            format!("{rig} --out o --tolerance 1"),
            "`--tolerance` must be",
        ),
        (format!("{rig} --out o --seconds 0"), "`--seconds` must be"),
        (
            format!("{rig} --out o --step rests"),
            "did you mean `rest`?",
        ),
        (
            format!("{rig} --out o --step fit"),
            "`fit` comes after `stop`",
        ),
        (
            format!("{rig} --out o --again ends"),
            "`ends` comes after `stop`",
        ),
        (format!("{rig} --out o --plant {rig}"), "--rehearse"),
        (format!("{rig} --out {rig}"), "--out"),
        (
            "damper-stand.toml --out o".to_string(),
            "only a recording can drive this rig",
        ),
        ("missing.toml --out o".to_string(), "missing.toml"),
    ] {
        let output = desk.sinew(&format!("commission {line}"));
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {words}");
        assert!(words.contains(why), "{line}: {words}");
    }
    std::fs::create_dir_all(desk.path("o")).expect("the folder can be made");
    desk.write("o/commission.json", "{}");
    let output = desk.sinew(&format!("commission {rig} --out o"));
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words}");
    assert!(words.contains("o/commission.json"), "{words}");
}
