//! `sinew prefer`: answers in, weights out, and a file that goes on where it stopped.

use std::io::Write;
use std::process::Stdio;

use serde_json::Value;

use crate::desk::{Desk, checkout, images};
use crate::schema::{schema, violations};

fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    desk.bring("rigs/mass-spring-damper.fit.csv");
    desk
}

/// `sinew prefer` with answers typed: its status, what it printed, and its errors.
fn prefer(desk: &Desk, flags: &str, typed: &str) -> (Option<i32>, String, String) {
    let line = format!(
        "prefer mass-spring-damper.toml {} --fit mass-spring-damper.fit.csv --answers \
         answers.json --candidates 12 --build-dir {} --out liked.toml {flags}",
        checkout().join("models/demo-state").display(),
        images().display()
    );
    let mut child = desk
        .command(&line)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // A program that refuses does not read.
    let _ = child
        .stdin
        .take()
        .expect("a pipe")
        .write_all(typed.as_bytes());
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

fn document(desk: &Desk, name: &str) -> Value {
    serde_json::from_str(&desk.read(name)).expect("JSON")
}

#[test]
fn answers_are_kept_and_continued_and_lead_to_weights_of_the_rig() {
    let desk = desk();
    let (status, said, errors) = prefer(&desk, "--questions 3 --page pair.html", "a\nb\n=\n");
    assert_eq!(status, Some(0), "{errors}");
    assert!(said.contains("question 3 of at most 3"), "{said}");
    let first = document(&desk, "answers.json");
    let kept = first["answers"].as_array().expect("a list").len();
    assert!((1..=3).contains(&kept), "{said}");
    assert_eq!(first["answers"][0]["answer"], "a");
    let page = desk.read("pair.html");
    assert!(page.contains("settling") && page.contains("<svg"));

    let flags = "--questions 2 --json - --model-out liked";
    let (status, said, errors) = prefer(&desk, flags, "a\nq\n");
    assert_eq!(status, Some(0), "{errors}");
    let found: Value = serde_json::from_str(&said).expect("standard output is JSON alone");
    assert_eq!(violations(&schema("preferred"), &found), [""; 0]);
    let later = document(&desk, "answers.json");
    assert_eq!(later["answers"][0], first["answers"][0]);
    assert_eq!(found["answers"], later["answers"].as_array().unwrap().len());
    let liked = desk.read("liked.toml");
    let lambda = found["control"]["move_suppression"][0].as_f64().unwrap();
    assert!(liked.contains("move_suppression"), "{liked}");
    let written: toml_edit::DocumentMut = liked.parse().expect("the rig is TOML");
    let written = written["control"]["move_suppression"][0].as_float();
    assert_eq!(written, Some(lambda));
    assert!(desk.read("liked/model.toml").contains("[control]"));
}

#[test]
fn answers_of_another_model_and_broken_ones_are_refused() {
    let desk = desk();
    let (status, _, errors) = prefer(&desk, "--questions 0", "");
    assert_eq!(status, Some(0), "{errors}");
    let sound = desk.read("answers.json");
    let refused = |text: String, words: &str| {
        desk.write("answers.json", &text);
        let (status, said, errors) = prefer(&desk, "--questions 1", "a\n");
        assert_eq!((status, said.as_str()), (Some(2), ""), "{errors}");
        assert!(errors.contains(words), "{errors}");
        assert_eq!(desk.read("answers.json"), text, "it was changed");
    };
    let given = |answer: &str| {
        let one = format!("\"answers\": [{{\"who\": \"me\", {answer}}}]");
        sound.replace("\"answers\": []", &one)
    };
    refused(
        given("\"a\": 0, \"b\": 99, \"answer\": \"a\""),
        "expected two different ones of",
    );
    refused(
        given("\"a\": 0, \"b\": 1, \"answer\": \"left\""),
        "expected a, b or alike, found \"left\"",
    );
    refused(String::from("{}"), "no sinew-preferences/1");
    let model = document(&desk, "answers.json");
    assert_eq!(model, Value::Object(serde_json::Map::new()));
    let other = sound.replace("\"model\": \"", "\"model\": \"0");
    refused(other, "its answers are about another model");
    let other = sound.replacen("\"features\": [\n        ", "\"features\": [\n        9", 1);
    assert_ne!(other, sound);
    refused(other, "its answers are about other loops");
}
