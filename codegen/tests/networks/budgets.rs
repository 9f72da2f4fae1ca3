//! What the networks of the reference problem may cost, at most, on a Cortex-M4F: numbers that a person chose.
//! The best peer takes 1,343, 15,351 and 1,494 instructions forward.

use sinew_codegen::network::emit::Options;
use sinew_codegen::network::from_model;
use sinew_codegen::reference;

use super::bench::Case;
use super::judge::Errors;
use super::random;

/// Name, instructions of `predict`, and of `predict_with_jacobian` relative to these. The goal of the latter is
/// 2.5, which P misses by 0.18: its derivatives are 624 multiply-adds where the prediction is 232.
const BUDGETS: [(&str, u64, f64); 3] = [
    ("reference-s", 700, 2.5),
    ("reference-l", 6_500, 2.5),
    ("reference-p", 750, 2.7),
];

/// The networks of models/reference.
pub fn cases() -> Vec<Case> {
    ["S", "L", "P"]
        .map(|name| {
            let read = |file: &str| {
                let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/reference/");
                std::fs::read_to_string(format!("{folder}{file}.json")).expect("it is committed")
            };
            let spec =
                reference::import(&read(name), &read("problem"), 10, &[]).expect("it is valid");
            let network = from_model::network(&spec).expect("it is valid");
            random::case(network, Options::default())
        })
        .into()
}

/// Holds what QEMU counted against the budgets; nothing where there is no QEMU.
pub fn judge(errors: &[Errors]) {
    for (name, most, ratio) in BUDGETS {
        let one = errors
            .iter()
            .find(|one| one.name == name)
            .expect("it is among the cases");
        let (Some((predict, _)), Some((jacobian, _))) =
            (one.said.cost.get("predict"), one.said.cost.get("jacobian"))
        else {
            continue;
        };
        println!("{name}: {predict} instructions, {jacobian} with derivatives");
        assert!(
            *predict <= most,
            "{name}: {predict} instructions, the budget is {most}"
        );
        let found = *jacobian as f64 / *predict as f64;
        assert!(
            found <= ratio,
            "{name}: derivatives take {found:.2} times a prediction, the budget is {ratio}"
        );
    }
}
