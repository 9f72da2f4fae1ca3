//! Soft sensors from the command line: a model that reads no output, its calibration for another
//! device, and what is refused.

use std::fmt::Write as _;

use serde_json::Value;
use sinew_model::spec::ModelSpec;
use sinew_model::store;

use crate::desk::Desk;

const DRAW: &str = "[[sensor]]\nname = \"draw\"\nreads = \"mass.position\"\nsignal = \"draw_V\"\noffset = 0.8\n\n[control]\n";
const IMPORT: &str = "import mass-spring-damper.tflite --rig rig.toml --fit camera.csv --out model";

/// A rig whose position is said by a draw wire of strange scale, and recordings of it.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    desk.bring("rigs/mass-spring-damper.fit.csv");
    desk.bring("rigs/experiments/mass-spring-damper.tflite");
    let own = desk.read("mass-spring-damper.toml");
    let own = own.replace("[control]\n", DRAW) + "form = \"increment\"\n";
    desk.write("plain.toml", &own);
    let sensed = own.replace("[control]\n", "[control]\nsensed_by = [\"draw\"]\n");
    desk.write("rig.toml", &sensed);
    desk.write("camera.csv", &recorded(&desk, 1.0));
    desk.write("other.csv", &recorded(&desk, 1.7));
    desk
}

/// The fit recording with a column `draw_V`, a bent function of the position.
fn recorded(desk: &Desk, gain: f64) -> String {
    let text = desk.read("mass-spring-damper.fit.csv");
    let mut out = String::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let position = line.rsplit(',').next().and_then(|q| q.parse::<f64>().ok());
        match position {
            Some(q) => writeln!(out, "{line},{}", gain * (0.8 + q)),
            None => writeln!(out, "{line},draw_V"),
        }
        .expect("text");
    }
    out
}

fn model(desk: &Desk, folder: &str) -> ModelSpec {
    store::load(&desk.path(folder)).expect("the folder holds a model")
}

#[test]
fn another_device_has_another_soft_sensor_and_the_same_network() {
    let desk = desk();
    let said = desk.succeed(IMPORT);
    assert!(
        said.contains("soft sensor of 1 channel: off by q_m"),
        "{said}"
    );
    let said = desk.succeed("calibrate rig.toml model --fit other.csv --out model-7");
    assert!(said.contains("next: sinew emit model-7"), "{said}");
    let (one, other) = (model(&desk, "model"), model(&desk, "model-7"));
    assert_eq!(one.layers, other.layers);
    assert_eq!(one.control, other.control);
    let span = |spec: &ModelSpec| spec.channels[0].span;
    assert!((span(&other) / span(&one) - 1.7).abs() < 1e-9);
    for spec in [&one, &other] {
        let sensor = spec
            .soft_sensor
            .as_ref()
            .expect("the model has a soft sensor");
        assert!(sensor.error[0] < 1e-6, "{sensor:?}");
    }
    // The channel is in the frames and not in the network.
    assert_eq!(one.regressor_len(), one.layers[0].inputs());
    assert_eq!(one.channels.len(), 1);
}

#[test]
fn what_has_no_soft_sensor_is_refused() {
    let desk = desk();
    desk.succeed(IMPORT);
    desk.succeed(
        &IMPORT
            .replace("rig.toml", "plain.toml")
            .replace("model", "unsensed"),
    );
    let head: Vec<String> = desk
        .read("camera.csv")
        .lines()
        .take(9)
        .map(String::from)
        .collect();
    desk.write("short.csv", &(head.join("\n") + "\n"));
    let rig = desk.read("rig.toml");
    let sensed = "sensed_by = [\"draw\"]";
    desk.write(
        "output.toml",
        &rig.replace(sensed, "sensed_by = [\"encoder\"]"),
    );
    desk.write(
        "missing.toml",
        &rig.replace(sensed, "sensed_by = [\"drawer\"]"),
    );
    desk.write("both.toml", &(rig.clone() + "channels = [\"draw\"]\n"));
    let lines = rig.lines().filter(|line| !line.starts_with("past_"));
    let state = lines.collect::<Vec<_>>().join(
        "
",
    );
    let state = state.replace("form = \"increment\"", "form = \"state\"");
    desk.write("state.toml", &state);
    let gru = rig.replace("hidden = [12]", "hidden = [4]\nfirst_layer = \"gru\"");
    desk.write("gru.toml", &gru);
    for (line, expected) in [
        (
            "calibrate plain.toml model --fit camera.csv --out m",
            "the rig has no soft sensor",
        ),
        (
            "calibrate rig.toml unsensed --fit camera.csv --out m",
            "with a soft sensor",
        ),
        (
            "calibrate rig.toml model --fit short.csv --out m",
            "8 rows to calibrate",
        ),
        (
            "calibrate rig.toml model --fit mass-spring-damper.fit.csv --out m",
            "draw_V",
        ),
        (
            "calibrate rig.toml model --fit camera.csv --out model",
            "--out",
        ),
        (
            "faults rig.toml model --fit camera.csv --out m",
            "the model watches no channels",
        ),
        (
            "faults rig.toml model --fit camera.csv --out m --matters nan",
            "--matters",
        ),
        (
            "compare rig.toml unsensed --fit camera.csv --out m",
            "channels do not fit the rig",
        ),
        (
            "compare plain.toml model --fit camera.csv --out m",
            "channels do not fit the rig",
        ),
        (
            "train output.toml --fit camera.csv --out m",
            "`sensed_by` names an output",
        ),
        ("train missing.toml --fit camera.csv --out m", "drawer"),
        (
            "train both.toml --fit camera.csv --out m",
            "beside `sensed_by`",
        ),
        (
            "train state.toml --fit camera.csv --out m",
            "not for a model with a state",
        ),
        (
            "train gru.toml --fit camera.csv --out m",
            "not for a network that remembers",
        ),
        (
            "train rig.toml --fit short.csv --out m",
            "8 rows to calibrate",
        ),
    ] {
        let refusal = desk.refusal(line);
        assert!(refusal.contains(expected), "{line}\n{refusal}");
        assert!(!desk.path("m/model.toml").exists(), "{line}");
    }
}

#[test]
fn a_loop_behind_a_soft_sensor_sees_its_channels_alone() {
    let desk = desk();
    desk.succeed(IMPORT);
    // The same controller with a map that says one place, whatever the channel.
    let mut blind = model(&desk, "model");
    let sensor = blind
        .soft_sensor
        .as_mut()
        .expect("the model has a soft sensor");
    sensor.linear.fill(0.0);
    sensor.quadratic.fill(0.0);
    store::save(&desk.path("blind"), &blind).expect("the folder is writable");
    let cache = crate::desk::images();
    desk.succeed(
        &IMPORT
            .replace("rig.toml", "plain.toml")
            .replace("model", "unsensed"),
    );
    let error = |rig: &str, model: &str| {
        let line = format!(
            "pil {rig} {model} --fit camera.csv --board host --out out-{model} --build-dir {} \
             --quiet --json {model}.json",
            cache.display()
        );
        desk.succeed(&line);
        let found: Value =
            serde_json::from_str(&desk.read(&format!("{model}.json"))).expect("JSON");
        found["outputs"][0]["rms"].as_f64().expect("a number")
    };
    let sees = error("rig.toml", "model");
    let measures = error("plain.toml", "unsensed");
    // Nobody has tuned either; the wire is as good as the encoder.
    assert!(
        (sees / measures - 1.0).abs() < 0.15,
        "{sees} beside {measures}"
    );
    let blind = error("rig.toml", "blind");
    assert!(blind > 5.0 * sees, "{sees} beside {blind}");
}
