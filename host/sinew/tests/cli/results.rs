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
    crate::compare::reference_model(&desk, "model");
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
    let line =
        format!("pil rig.toml model --fit recording.csv --board host {flags} --report pil.html");
    let found = result(&desk, &line, "pil", 0);
    crate::pages::a_loop_can_be_read(&desk, "pil.html");
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
    let line = "calibrate rig.toml plain --fit camera.csv --watch --out model";
    let said = desk.succeed(line);
    assert!(
        said.contains("channels watched: the others say each"),
        "{said}"
    );
    let found = result(&desk, &format!("{line} --json -"), "calibration", 0);
    let spread = |k: usize| found["channels"][k]["spread_part"].as_f64();
    assert!((0..5).all(|k| spread(k) < Some(0.05)), "{found}");
    assert_eq!(
        (&found["watched"], &found["outputs"][0]["signal"]),
        (&true.into(), &"q_m".into())
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

/// A Python whose framework multiplies input k by `factor` k, in four of them.
fn framework(desk: &Desk, factor: f64) -> String {
    use std::os::unix::fs::PermissionsExt;
    let script = format!(
        "#!/bin/sh\nsed 's/[][ ]//g' | awk -F, '{{ printf \"[\"; for (i = 1; i <= NF; i += 4) \
         printf \"%s[0, %.9g, %.9g, %.9g]\", (i > 1 ? \", \" : \"\"), {factor} * $(i + 1), \
         {factor} * 2 * $(i + 2), {factor} * 3 * $(i + 3); print \"]\" }}'\n"
    );
    desk.write("python.sh", &script);
    let path = desk.path("python.sh");
    let mode = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(&path, mode).expect("the script is ours");
    path.display().to_string()
}

#[test]
fn a_networks_layers_its_framework_and_its_size_are_documents() {
    let desk = Desk::new();
    desk.bring("codegen/nn/tests/cases/52-odd/range.onnx");
    let layers = result(&desk, "import range.onnx --json -", "import", 0);
    assert_eq!(
        (&layers["inputs"], &layers["outputs"]),
        (&4.into(), &4.into())
    );
    assert_eq!(layers["layers"][0]["kind"], "input", "{layers}");
    assert!(layers["rounding"].is_null() && layers["model"].is_null());

    let line = |python: &str| format!("verify range.onnx --python {python} --json -");
    let same = result(&desk, &line(&framework(&desk, 1.0)), "verify", 0);
    assert!(
        same["agrees"] == true && same["difference"].as_f64() < Some(1e-6),
        "{same}"
    );
    assert!(same["crate"].is_null() && same["cut_off"] == 0, "{same}");
    let other = result(&desk, &line(&framework(&desk, 1.5)), "verify", 1);
    assert!(
        other["agrees"] == false && other["difference"].as_f64() > Some(0.1),
        "{other}"
    );

    // Every input is cut off by integers of a fixed scale, at every size.
    desk.bring("codegen/nn/tests/frameworks/models/tflite-int8.tflite");
    framework(&desk, 1.0);
    let rows = vec!["null"; 16 * 8].join(", ");
    desk.write(
        "python.sh",
        &format!("#!/bin/sh\ncat > input\necho '[{rows}]'\n"),
    );
    let python = desk.path("python.sh");
    let line = format!("verify tflite-int8.tflite --python {}", python.display());
    let refused = desk.refusal(&line);
    assert!(
        refused.contains("its integers cut off every input"),
        "{refused}"
    );
    assert!(refused.contains("exit status 1"), "{refused}");

    let line = "emit range.onnx --out crate --weights int8 --json -";
    let emitted = result(&desk, line, "emit", 0);
    assert_eq!(emitted["network"]["outputs"], 4, "{emitted}");
    assert!(
        emitted["network"]["loss"]["max"].as_f64() < Some(0.05),
        "{emitted}"
    );
    assert!(emitted["controller"].is_null() && desk.path("crate/Cargo.toml").is_file());
    let model = crate::desk::checkout().join("models/reference-s");
    let line = format!("emit {} --out project --json -", model.display());
    let emitted = result(&desk, &line, "emit", 0);
    assert!(
        emitted["controller"]["period_s"].as_f64() > Some(0.0),
        "{emitted}"
    );

    let cache = crate::desk::images();
    let size = format!(
        "size range.onnx --board stm32f446 --weights int8 --build-dir {} --quiet --json -",
        cache.join("sized").display()
    );
    let size = result(&desk, &size, "size", 0);
    let network = &size["network"];
    let (flash, weights) = (&network["predict"]["flash_bytes"], &network["weight_bytes"]);
    assert!(
        flash.as_u64() > weights.as_u64() && weights.as_u64() > Some(0),
        "{size}"
    );
    assert_eq!(
        (&size["weights"], &size["controller"]),
        (&"int8".into(), &Value::Null)
    );
    assert_eq!(network["boards"][0]["board"], "stm32f446", "{size}");
    let layers = network["layers"].as_array().expect("a list");
    let sum: u64 = layers
        .iter()
        .filter_map(|layer| layer["weight_bytes"].as_u64())
        .sum();
    assert_eq!(Some(sum), weights.as_u64(), "{size}");

    // Without a board all of them; a network that one chip cannot hold is said not to fit it.
    let large = large_network(&desk);
    let line = format!(
        "size {large} --build-dir {} --quiet",
        cache.join("sized").display()
    );
    let document = result(&desk, &format!("{line} --json -"), "size", 0);
    assert!(document["network"]["board"].is_null(), "{document}");
    let fits: Vec<(String, bool)> = (document["network"]["boards"].as_array().into_iter())
        .flatten()
        .map(|board| {
            let fits = board["predict_fits"] == true;
            (board["board"].as_str().unwrap_or_default().into(), fits)
        })
        .collect();
    let wanted = [("stm32f446", false), ("nrf52840", true), ("qemu", true)];
    assert_eq!(fits, wanted.map(|(name, fits)| (name.to_owned(), fits)));
    let text = desk.succeed(&line.replace(" --quiet", ""));
    let verdict = "stm32f446  predict        does not fit: ";
    assert!(text.contains(verdict), "{text}");
    assert!(
        text.contains("B of flash, the board has 524,288 B"),
        "{text}"
    );
}

#[test]
fn a_new_rig_its_simulation_and_its_wiring_are_documents() {
    let desk = desk();
    let line = "new mass-spring-damper.fit.csv --yes --spring yes --out new.toml --json -";
    let new = result(&desk, line, "new", 0);
    let guesses = new["guesses"].as_array().map_or(0, Vec::len);
    assert!(guesses > 0 && new["rig"] == "new.toml", "{new}");

    let line = format!("simulate {RIG} --input mass-spring-damper.fit.csv --out sim.csv --json -");
    let simulated = result(&desk, &line, "simulation", 0);
    let rows = desk
        .read("sim.csv")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .count()
        - 1;
    assert_eq!(simulated["rows"], rows, "{simulated}");
    let signal = &simulated["signals"][0];
    let end = |k: usize| signal["range"][k].as_f64();
    assert!(signal["signal"] == "q_m" && end(0) < end(1), "{simulated}");
    assert_eq!(simulated["held_samples"]["u_N"], 0, "{simulated}");

    desk.bring("rigs/demo.toml");
    let wired = result(
        &desk,
        "wire demo.toml --board stm32f446 --json -",
        "wire",
        0,
    );
    assert_eq!(wired["pins"][0]["signal"], "q_m", "{wired}");
    let text = desk.read("demo.wiring.toml");
    let text = text.replace("at_zero = nan", "at_zero = -0.4");
    let text = text.replace("at_full = nan", "at_full = 0.4");
    desk.write("demo.wiring.toml", &text);
    let line = "wire demo.toml --check demo.wiring.toml --json -";
    let checked = result(&desk, line, "wire", 0);
    assert_eq!(checked["pins"], wired["pins"], "{checked}");
}

/// A folder with a network of one dense layer that has 560 kB of weights.
fn large_network(desk: &Desk) -> &'static str {
    use sinew_nn::{Dense, Network, Op, store};
    let mut network = Network::new("large", "x", vec![140]);
    let layer = Dense {
        weights: (0..140_000).map(|k| (k % 17) as f32 * 0.01).collect(),
        bias: vec![0.5; 1000],
    };
    network
        .push("dense", Op::Dense(layer), vec![0])
        .expect("it fits the input");
    store::save(&desk.path("large"), &network).expect("the desk is writable");
    "large"
}

/// Verbs whose documents take minutes or a board: what they write is held to the schemas below.
const LONG: &[&str] = &["build", "train", "flash", "record", "monitor"];

fn keeps(name: &str, document: &Value) {
    assert_eq!(violations(&schema(name), document), [""; 0], "{document}");
}

#[test]
fn what_the_verbs_of_a_board_write_keeps_its_schema() {
    use std::path::Path;

    use sinew::live::monitor::{Event, Watched};
    use sinew::live::record::Recorded;
    use sinew::live::serve::Served;
    use sinew::live::topics::Level;
    use sinew_device::mode::{Cause, Mode, State};
    use sinew_ident::recording::Recording;

    let state = State {
        mode: Mode::Tripped,
        cause: Cause::Stuck,
    };
    let recording = Recording::parse(b"t,u_V,q_m\n0,1,2\n0.1,1,2\n", "run.csv");
    let mut recorded = Recorded {
        recording: recording.expect("two rows"),
        lost_ticks: 1,
        missing_samples: 2,
        held_ticks: 3,
        limited_rows: 4,
        ended: None,
    };
    keeps("record", &recorded.document(Path::new("run.csv"), 2));
    recorded.ended = Some(state);
    let document = recorded.document(Path::new("run.csv"), 9);
    keeps("record", &document);
    assert_eq!(
        (&document["ended"]["cause"], &document["columns"][1]),
        (&"Stuck".into(), &"q_m".into())
    );

    let mut watched = Watched::default();
    keeps("monitor", &watched.document(None, None));
    watched.state = Some(state);
    for level in [Level::Info, Level::Warn, Level::Error] {
        watched.events.push(Event {
            board_s: 0.5,
            level,
            text: "disarmed: Stuck".into(),
        });
    }
    let served = Served {
        clients: 1,
        missed: 0,
    };
    let served = Some(("127.0.0.1:8765".parse().expect("an address"), served));
    let document = watched.document(Some(Path::new("run.mcap")), served);
    keeps("monitor", &document);
    assert_eq!(document["events"][2]["level"], "fault");
    assert_eq!(document["state"]["mode"], "tripped");

    let board = sinew::project::Board::Stm32f446;
    let chip = sinew::flash::chip(board).expect("a board with a flash");
    let sizes = sinew::project::Sizes {
        flash_bytes: 9,
        ram_bytes: 8,
        heap_bytes: 0,
    };
    keeps(
        "flash",
        &sinew::flash::document(board, chip, Path::new("lockstep.elf"), sizes),
    );
    keeps("flash", &sinew::flash::listed(&["a probe".into()]));
}

#[test]
fn a_log_and_a_rig_for_mujoco_are_documents() {
    let desk = desk();
    desk.bring("tests/foreign/logs/logsout.mat");
    let listed = result(&desk, "convert logsout.mat --list --json -", "convert", 0);
    assert!(listed["recording"].is_null(), "{listed}");
    let names = |of: &Value| of["bases"][0]["signals"][0]["names"].clone();
    assert_eq!(names(&listed), serde_json::json!(["angle_rad"]), "{listed}");
    let line = "convert logsout.mat --join last --out rec.csv --json -";
    let made = result(&desk, line, "convert", 0);
    assert_eq!(made["recording"]["rows"], 24, "{made}");
    assert_eq!(made["kind"], "MATLAB v5");
    let notes = made["notes"].as_array().map_or(0, Vec::len);
    assert!(notes > 0, "a joined signal has its rule: {made}");

    desk.bring("tests/foreign/mechanism/pendulum.xml");
    desk.succeed("new --mjcf pendulum.xml --out arm.toml");
    let plain = result(&desk, "mjcf arm.toml --out out.xml --json -", "mjcf", 0);
    assert!(plain["changes"].is_null(), "{plain}");
    let text = desk.read("arm.toml");
    desk.write("arm.toml", &text.replace("{ value = 0.004 }", "0.006"));
    let line = "mjcf arm.toml --out out.xml --changes pendulum.xml --json -";
    let changed = result(&desk, line, "mjcf", 0);
    assert_eq!(changed["changes"]["list"], "out.changes.csv", "{changed}");
    let change = &changed["changes"]["attributes"][0];
    assert_eq!(
        (&change["old"], &change["new"]),
        (&"0.004".into(), &"0.006".into())
    );
}

#[test]
fn what_train_and_build_write_keeps_its_schema() {
    use sinew::pipeline::learn::Record;
    use sinew::pipeline::summary::{
        FitError, Found, ModelRig, NetworkError, Spread, Summary, Tracking,
    };
    let epoch = sinew_train::train::Epoch {
        training: 0.3,
        validation: 0.4,
    };
    let record = Record {
        history: vec![epoch],
        kept: 0,
        parameters: 12,
        one_step_rms: vec![1e-4],
        horizon_rms: vec![1e-3],
        horizon: 12,
    };
    let mut training = serde_json::to_value(record).expect("a record is JSON");
    training["format"] = "sinew-training/1".into();
    assert_eq!(violations(&schema("training"), &training), [""; 0]);
    let mut summary = Summary {
        format: "sinew-demo/1",
        rig: "rig".into(),
        board: "host".into(),
        rate_hz: 120.0,
        steps: 100,
        deadline_misses: 0,
        tracking: Tracking {
            model_rig: ModelRig::Fitted,
            unit: "m".into(),
            mpc_rms: 1e-3,
            pid_rms: f64::NAN,
            informed_pid_rms: 2e-3,
            mpc_max: 1e-2,
            pid_max: f64::NAN,
            informed_pid_max: 2e-2,
        },
        instructions_per_step: None,
        flash_bytes: None,
        ram_bytes: None,
        stack_bytes: None,
        heap_bytes: None,
        host_equals_device: None,
        commands_outside_limits: 0,
        fit: vec![FitError {
            signal: "q_m".into(),
            role: "fit",
            unit: "m".into(),
            as_written_rms: 1e-3,
            fitted_rms: 1e-4,
        }],
        network: NetworkError {
            parameters: 12,
            one_step_rms: 1e-4,
            horizon_rms: 1e-3,
        },
        diagnosis: None,
        seconds: 1.0,
    };
    let keeps = |summary: &Summary| {
        let document = serde_json::to_value(summary).expect("a summary is JSON");
        assert_eq!(violations(&schema("demo"), &document), [""; 0]);
    };
    keeps(&summary);
    summary.instructions_per_step = Some(Spread { mean: 1.5, max: 2 });
    summary.diagnosis = Some(Found {
        hidden: None,
        found: "coulomb_friction".into(),
        unit: "m".into(),
        before_rms: 1e-3,
        after_rms: Some(1e-4),
    });
    summary.tracking.model_rig = ModelRig::Corrected;
    keeps(&summary);
}

/// Each verb that takes `--json` has its line in the schemas' README, a schema of its name, and a
/// test here that holds real output to it.
#[test]
fn every_verb_with_json_has_a_schema_that_its_output_is_held_to() {
    let cli = include_str!("../../../../docs/reference/cli.md");
    let list = include_str!("../../../../docs/reference/schemas/README.md");
    let tests = [
        include_str!("results.rs"),
        include_str!("identify.rs"),
        include_str!("import.rs"),
        include_str!("settle.rs"),
        include_str!("plan.rs"),
        include_str!("prefer.rs"),
        include_str!("fit_static.rs"),
        include_str!("learn.rs"),
        include_str!("fleet.rs"),
        include_str!("adopt.rs"),
        include_str!("commission.rs"),
        include_str!("share.rs"),
        include_str!("imitate.rs"),
    ]
    .concat();
    let (mut verb, mut seen) = ("", 0);
    for line in cli.lines() {
        if let Some(name) = line.strip_prefix("### `sinew ") {
            verb = name.trim_end_matches('`');
        }
        if !line.trim_start().starts_with("--json <") {
            continue;
        }
        seen += 1;
        let row = |row: &&str| {
            row.contains(&format!("| `sinew {verb}`")) || row.contains(&format!("| `sinew {verb} "))
        };
        let row = list.lines().find(row);
        let row = row.unwrap_or_else(|| panic!("no schema of {verb} in the list"));
        let name = row
            .split(['[', ']'])
            .nth(1)
            .expect("a row links its schema");
        let format = schema(name)["properties"]["format"]["const"].clone();
        let format = format.as_str().map_or_else(String::new, str::to_owned);
        assert!(row.contains(&format!("`{format}`")), "{row}: {format}");
        let held = tests.contains(&format!("\"{name}\", "))
            || tests.contains(&format!("schema(\"{name}\")"));
        assert!(
            held || LONG.contains(&verb),
            "no test holds {verb} to {name}"
        );
    }
    assert!(seen >= 20, "{seen} verbs");
}
