//! `sinew import` and `tune`: a predictor of another tool as a model, and its weights.

use crate::desk::{Desk, images};
use crate::schema::{schema, violations};

/// Trained in Keras by tests/foreign/keras_predictor.py, from recordings alone and in their units.
#[test]
fn a_network_of_another_tool_becomes_a_model_of_a_rig() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/mass-spring-damper.test.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml");
    desk.write("rig.toml", &(own + "form = \"increment\"\n"));
    let said = desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --test mass-spring-damper.test.csv \
         --out model",
    );
    assert!(said.contains("dense_1/BiasAdd"), "{said}");
    let spec = sinew_model::store::load(&desk.path("model")).expect("the folder holds a model");
    assert_eq!((spec.past_inputs, spec.past_outputs), (4, 8));
    assert_eq!(spec.outputs[0].name, "q_m");
    // It has seen another mass than that of these recordings, and still foresees most of a step.
    let error = said
        .split("q_m: ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let error: f64 = error
        .and_then(|word| word.parse().ok())
        .expect("millimetres");
    assert!(
        said.contains(" mm off after one step") && error < 10.0,
        "{said}"
    );
}

#[test]
fn a_cost_to_go_of_the_rig_is_in_its_model_its_crate_and_the_tuned_rig() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml") + "form = \"increment\"\n";
    let asked = "horizon = 2\nterminal = \"value\"\nvalue_ahead = 6\n";
    let own = own.replace("horizon = 12\n", asked);
    desk.write(
        "rig.toml",
        &own.replace("control_horizon = 4", "control_horizon = 1"),
    );
    desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --out model",
    );
    let control = |folder: &str| {
        let spec = sinew_model::store::load(&desk.path(folder));
        spec.expect("the folder holds a model").control
    };
    let model = control("model");
    let value = model.value.as_ref().expect("the rig asks for one");
    assert_eq!((value.rows, value.ahead, value.points.len()), (1, 6, 5));
    assert_eq!((model.horizon, model.preview()), (2, 8));
    desk.succeed("emit model --out project");
    assert!(desk.path("project/model/src/value.rs").exists());

    let cache = images();
    desk.succeed(&format!(
        "tune rig.toml model --fit mass-spring-damper.fit.csv --out tuned.toml --model-out tuned --mpc-only \
         --evaluations 20 --horizons 1 --control-horizons 1 --build-dir {} --quiet --json tuned.json \
         --report tuned.html",
        cache.display()
    ));
    crate::pages::a_tuning_can_be_read(&desk, "tuned.html");
    let tuned = control("tuned");
    assert_eq!((tuned.horizon, tuned.value), (1, model.value));
    let rig = desk.read("tuned.toml");
    assert!(
        rig.contains("horizon = 1\nterminal = \"value\"\nvalue_ahead = 6"),
        "{rig}"
    );
    let scores: serde_json::Value =
        serde_json::from_str(&desk.read("tuned.json")).expect("the text is JSON");
    let line = &scores["objectives"][0];
    let evaluations = line["evaluations"].as_u64().expect("a number");
    assert!((11..=20).contains(&evaluations), "{line}");
    let training = |when: &str| line["training"][when].as_f64().expect("a number");
    assert!(training("after") < training("before"), "{line}");
}

#[test]
fn a_search_by_gradients_says_how_it_went_and_lowers_the_firmwares_own_objective() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml") + "form = \"increment\"\n";
    desk.write("rig.toml", &own);
    desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --out model",
    );
    let said = desk.succeed(&format!(
        "tune rig.toml model --fit mass-spring-damper.fit.csv --out tuned.toml --model-out tuned --mpc-only \
         --by gradient --evaluations 25 --plants 2 --horizons 12 --control-horizons 4 --build-dir {} \
         --json tuned.json",
        images().display()
    ));
    assert!(said.contains("objective: tracking, of 2 plants"), "{said}");
    assert!(said.contains("MPC, 12 and 4 steps: "), "{said}");
    assert!(said.contains(" with derivatives; "), "{said}");
    let scores: serde_json::Value =
        serde_json::from_str(&desk.read("tuned.json")).expect("the text is JSON");
    let line = &scores["objectives"][0];
    let evaluations = line["evaluations"].as_u64().expect("a number");
    assert!((4..=26).contains(&evaluations), "{line}");
    let training = |when: &str| line["training"][when].as_f64().expect("a number");
    assert!(training("after") < training("before"), "{line}");
    let course = &line["gradients"][0];
    let broken = violations(&schema("tuning"), &scores);
    assert_eq!(broken, [""; 0]);
    assert_eq!(course["derivatives"], "exact", "{course}");
    // The loop in double precision told the search what the firmware does.
    let expected = course["objective"].as_f64().expect("a number");
    assert!((training("after") / expected - 1.0).abs() < 0.02, "{line}");
}
