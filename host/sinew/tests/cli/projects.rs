//! Projects that verbs write and build.

use crate::desk::{Desk, checkout, images};
use sinew::device::Device;
use sinew::project::{self, Board, Optimise};

#[test]
fn emit_writes_a_project_that_builds_and_answers() {
    let desk = Desk::new();
    let model = checkout().join("models/reference-s");
    desk.succeed(&format!("emit {} --out project", model.display()));
    let built = project::build(&desk.path("project"), Board::Host, Some(&images()));
    let built = built.unwrap_or_else(|error| panic!("{error}"));
    let mut device = Device::host(&built.lockstep).expect("the program starts");
    let identity = device.hello(None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((identity.n_u, identity.n_y, identity.horizon), (2, 3, 10));
}

#[test]
fn a_controller_can_be_made_for_size_and_a_network_alone_cannot() {
    let desk = Desk::new();
    let model = checkout().join("models/reference-s");
    let emit = format!("emit {} --optimise size --out out", model.display());
    let network = checkout().join("rigs/experiments/mass-spring-damper.tflite");
    let alone = format!("emit {} --optimise size --out out", network.display());
    let said = desk.refusal(&format!("{alone} --c-abi"));
    assert!(said.contains("--optimise is for a controller"), "{said}");
    assert!(!desk.path("out").exists(), "a refusal writes nothing");
    let size = format!("size {} --board qemu --optimise size", network.display());
    let said = desk.refusal(&size);
    assert!(said.contains("--optimise is for a controller"), "{said}");
    desk.succeed(&emit);
    for board in ["qemu", "stm32f446", "nrf52840"] {
        let manifest = desk.read(&format!("out/boards/{board}/Cargo.toml"));
        let lines = [
            "opt-level = \"s\"",
            "[profile.release.package.sinew-model-reference-s]\nopt-level = 2",
        ];
        for line in lines {
            assert!(manifest.contains(line), "{board}: {manifest}");
        }
    }
}

#[test]
fn projects_that_share_build_outputs_keep_their_own_programs() {
    let desk = Desk::new();
    let cache = images();
    let models = ["reference-s", "reference-s-n5"].map(|model| {
        let spec = sinew_model::store::load(&checkout().join("models").join(model));
        let spec = spec.expect("the file ships with the project");
        project::write(&desk.path(model), &spec, Optimise::Speed).expect("the folder is writable");
        (model, sinew_model::fingerprint(&spec))
    });
    let built = |(model, hash): (&str, u32)| {
        for round in 0..8 {
            let built = project::build(&desk.path(model), Board::Host, Some(&cache));
            let built = built.unwrap_or_else(|error| panic!("{error}"));
            let mut device = Device::host(&built.lockstep).expect("the program starts");
            let identity = device.hello(Some(hash));
            assert!(identity.is_ok(), "{model}, round {round}: {identity:?}");
        }
    };
    std::thread::scope(|both| {
        for model in models {
            both.spawn(move || built(model));
        }
    });
}
