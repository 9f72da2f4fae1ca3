//! Results for programs: JSON by its schema on standard output, and exit statuses.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

const RIG: &str = "mass-spring-damper.toml";
const ROLES: &str = "--fit mass-spring-damper.fit.csv --test mass-spring-damper.test.csv";

fn desk() -> Desk {
    let desk = Desk::new();
    for file in ["toml", "fit.csv", "test.csv"] {
        desk.bring(&format!("rigs/mass-spring-damper.{file}"));
    }
    desk
}

/// Runs a verb whose result is on standard output, and checks it by its schema.
fn result(desk: &Desk, line: &str, name: &str, status: i32) -> Value {
    let output = desk.sinew(line);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "sinew {line}\n{errors}");
    let document = serde_json::from_slice(&output.stdout);
    let document = document.unwrap_or_else(|e| panic!("sinew {line}: no JSON alone: {e}"));
    assert_eq!(
        violations(&schema(name), &document),
        [""; 0],
        "sinew {line}"
    );
    document
}

#[test]
fn an_unexplained_signal_is_status_4_and_an_undetermined_parameter_3() {
    let desk = desk();
    let sound = desk.read(RIG);
    let stiff = "stiffness = { value = 40.0, min = 1.0, max = 400.0 }";
    let gain = "gain = 1.0 ";
    assert!(sound.contains(stiff) && sound.contains(gain));
    desk.write("stiff.toml", &sound.replace(stiff, "stiffness = 300.0"));
    desk.write("gain.toml", &sound.replace(gain, "gain = { value = 1.0 } "));
    let explained = |rig: &str, flag: &str, status| {
        let line = format!("fit {rig} {ROLES} --json - --quiet {flag}");
        let found = result(&desk, &line, "fit", status);
        let signal = &found["signals"]["q_m"];
        let error = |key: &str| signal["test"][key].as_f64();
        assert!(error("as_written_rms") > error("fitted_rms"), "{signal}");
        signal["explained"] == true
    };
    assert!(explained(RIG, "--exit-code", 0));
    assert!(explained("gain.toml", "--exit-code", 3));
    assert!(!explained("stiff.toml", "--exit-code", 4));
    assert!(!explained("stiff.toml", "", 0));
}

/// A loop that needs no training, and the flags of its build outputs.
fn loop_desk() -> (Desk, String) {
    let desk = crate::interrupt::reference_desk();
    crate::verbs::reference_model(&desk, "model");
    let cache = crate::desk::images();
    let flags = format!("--out out --build-dir {} --quiet --json -", cache.display());
    (desk, flags)
}

#[test]
fn a_comparison_ends_with_the_status_of_its_own_errors() {
    let (desk, flags) = loop_desk();
    let line = format!("compare rig.toml model --fit recording.csv --evaluations 20 {flags}");
    let found = result(&desk, &line, "comparison", 0);
    let controllers = found["controllers"].as_array().expect("a list");
    let error = |controller: &Value| controller["loops"][0]["rms"][0].as_f64();
    let outside = |controller: &Value| controller["loops"][0]["outside_limits"] != 0;
    assert!(!controllers.iter().any(outside), "{found}");
    assert_eq!(controllers.len(), 3);
    let leads = controllers[1..]
        .iter()
        .all(|other| error(&controllers[0]) <= error(other));
    let status = if leads { 0 } else { 3 };
    result(&desk, &format!("{line} --exit-code"), "comparison", status);
}

#[test]
fn a_loop_on_a_board_is_a_document() {
    let (desk, flags) = loop_desk();
    let line = format!("pil rig.toml model --fit recording.csv --board host {flags}");
    let found = result(&desk, &line, "pil", 0);
    assert!(found["steps"].as_u64() > Some(100), "{found}");
    assert_eq!(found["outputs"].as_array().map(Vec::len), Some(3));
    assert!(
        found["host_equals_device"].is_null(),
        "the host is the board"
    );
}

#[test]
fn every_channel_broken_in_every_way_is_a_document() {
    let desk = desk();
    desk.bring("rigs/experiments/mass-spring-damper.tflite");
    // Five draw wires, each with a gain of its own, in the place of the position's encoder.
    let wires: String = (1..=5)
        .map(|k| {
            format!(
                "[[sensor]]\nname = \"wire_{k}\"\nreads = \"mass.position\"\n\
                 signal = \"wire{k}_V\"\ngain = {}\noffset = 0.5\n\n",
                0.6 + 0.2 * f64::from(k)
            )
        })
        .collect();
    let names = "\"wire_1\", \"wire_2\", \"wire_3\", \"wire_4\", \"wire_5\"";
    let control = format!("{wires}[control]\nsensed_by = [{names}]\n");
    let rig = desk.read(RIG).replace("[control]\n", &control);
    desk.write("rig.toml", &(rig + "form = \"increment\"\n"));
    desk.succeed(
        "simulate rig.toml --input mass-spring-damper.fit.csv --out camera.csv --with-inputs \
         --noise 0.005 --quiet",
    );
    desk.succeed("import mass-spring-damper.tflite --rig rig.toml --fit camera.csv --out plain");
    let said = desk.succeed("calibrate rig.toml plain --fit camera.csv --watch --out model");
    assert!(
        said.contains("channels watched: the others say each"),
        "{said}"
    );
    let cache = crate::desk::images();
    let line = format!(
        "faults rig.toml model --fit camera.csv --out out --build-dir {} --quiet --json -",
        cache.display()
    );
    let found = result(&desk, &line, "faults", 0);
    assert_eq!(found["false_alarms"], 0, "{found}");
    assert!(found["cost"].is_null(), "no board was asked for");
    let pairs = found["pairs"].as_array().expect("a list");
    assert_eq!(pairs.len(), 25);
    for pair in pairs.iter().filter(|pair| pair["fault"] == "dead") {
        assert!(pair["found_s"].as_f64() < Some(1.0), "{pair}");
        assert_eq!(pair["blamed_another"], false, "{pair}");
    }
}

#[test]
fn an_experiment_says_what_it_would_reveal() {
    let desk = desk();
    let line = format!("excite {RIG} --out exc.csv --seconds 8 --quiet --json -");
    let found = result(&desk, &line, "excite", 0);
    assert_eq!(
        (&found["rows"], &found["inputs"]),
        (&961.into(), &serde_json::json!(["u_N"]))
    );
    let effects = found["revelation"]["effects"]
        .as_array()
        .expect("the result was measured");
    let named = |kind: &str| effects.iter().find(|effect| effect["kind"] == kind);
    let friction = named("coulomb_friction").expect("a mass may rub");
    assert_eq!(friction["verdict"], "determined", "{friction}");
    let inputs_only = result(&desk, &format!("{line} --no-table"), "excite", 0);
    assert!(inputs_only["revelation"].is_null());
}

#[test]
fn a_searched_experiment_stands_beside_every_kind() {
    let desk = desk();
    let line = format!("excite {RIG} --out exc.csv --seconds 4 --rate 60 --quiet --json -");
    let searched = format!("{line} --design --evaluations 4");
    let found = result(&desk, &searched, "excite", 0);
    let design = &found["design"];
    assert_eq!(design["families"].as_array().map(Vec::len), Some(5));
    let mean = |of: &Value| of["mean_distance"].as_f64().expect("a number");
    let best = design["families"].as_array().expect("a list");
    let best = best.iter().map(mean).fold(0.0, f64::max);
    assert!(mean(&design["chosen"]) > 0.5 * best, "{design}");
    let drawn = result(&desk, &line, "excite", 0);
    assert!(drawn["design"].is_null());
    let refused = desk.refusal(&format!("{line} --design --kind steps"));
    assert!(refused.contains("cannot be used with"), "{refused}");
}

#[test]
fn likely_faults_are_status_3_and_none_is_status_0() {
    let desk = desk();
    let sound = format!("check mass-spring-damper.fit.csv --rig {RIG} --json - --exit-code");
    let found = result(&desk, &sound, "check", 0);
    assert!(found["determined"].is_object());
    let text = desk.read("mass-spring-damper.fit.csv");
    let rows: Vec<&str> = text.lines().collect();
    let cut = [&rows[..rows.len() / 3], &rows[rows.len() / 2..]].concat();
    desk.write("cut.csv", &(cut.join("\n") + "\n"));
    let found = result(&desk, "check cut.csv --json -", "check", 0);
    assert_eq!(found["checks"][0]["kind"], "gap", "{found}");
    result(&desk, "check cut.csv --json - --exit-code", "check", 3);
}

#[test]
fn explanations_are_documents_and_an_unknown_name_is_refused() {
    let desk = Desk::new();
    let list: Value =
        serde_json::from_str(&desk.succeed("explain --json -")).expect("a list is JSON");
    let names = list.as_array().expect("the value is a list");
    assert!(names.len() > 60);
    for document in names {
        assert_eq!(violations(&schema("explanation"), document), [""; 0]);
    }
    let one = result(&desk, "explain hysteresis --json -", "explanation", 0);
    assert!(
        one["law"]["text"]
            .as_str()
            .is_some_and(|law| law.contains("alpha"))
    );
    assert!(desk.succeed("explain LinkLost").contains("silent"));
    let refused = desk.refusal("explain columb_friction");
    assert!(
        refused.contains("did you mean `coulomb_friction`"),
        "{refused}"
    );
    assert!(refused.contains("exit status 2"), "{refused}");
}
