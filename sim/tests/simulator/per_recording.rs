//! Parameters of which each recording has a value of its own: what the rig file says of them.

use sinew_sim::{Plant, Rig};

const HEAD: &str = "format = \"sinew-rig/1\"\nname = \"press\"\n";

/// A rig whose body has this inertia and start, and whose cell this offset.
fn text(inertia: &str, start: &str, offset: &str) -> String {
    format!(
        "{HEAD}[[body]]\nname = \"m\"\nmotion = \"slide\"\ninertia = {inertia}\nstart = {start}\n\
         [[sensor]]\nname = \"cell\"\nreads = \"m.position\"\nsignal = \"q_m\"\noffset = {offset}\n"
    )
}

fn refused(inertia: &str, start: &str, offset: &str) -> String {
    let rig = Rig::parse(&text(inertia, start, offset), "press.toml");
    rig.unwrap_err().to_string()
}

#[test]
fn a_rig_that_is_written_back_still_says_that_recordings_differ() {
    let offset = "{ value = 0.1, min = -1.0, per = \"recording\" }";
    let rig = Rig::parse(
        &text("{ value = 2.0, per = \"recording\" }", "0.0", offset),
        "p.toml",
    );
    let rig = rig.unwrap();
    let differs = |rig: &Rig, name: &str| {
        let plant = Plant::new(rig).unwrap();
        plant.parameters()[plant.slot(name).unwrap()].per_recording
    };
    assert!(differs(&rig, "m.inertia") && differs(&rig, "cell.offset"));
    assert!(!differs(&rig, "cell.gain"));
    let written = rig.with_values(&[("cell.offset", 0.25)]).unwrap();
    let line = "offset = { value = 0.25, min = -1.0, per = \"recording\" }";
    assert!(written.to_toml().contains(line), "{}", written.to_toml());
    assert!(differs(&written, "cell.offset"));
}

#[test]
fn what_cannot_differ_by_recording_is_refused_with_its_line() {
    let start = refused("2.0", "{ value = 0.0, per = \"recording\" }", "0.0");
    assert!(start.starts_with("press.toml:7:"), "{start}");
    assert!(start.contains("a start always does"), "{start}");
    let massless = refused("{ value = 0.0, per = \"recording\" }", "0.0", "0.0");
    assert!(massless.contains("`inertia` of body `m`"), "{massless}");
    let word = refused("2.0", "0.0", "{ value = 0.0, per = \"recordings\" }");
    assert!(word.contains("unknown word `recordings`"), "{word}");
    assert!(word.contains("recording"), "{word}");
}
