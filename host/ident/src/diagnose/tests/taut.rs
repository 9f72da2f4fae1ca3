//! Tendons that pull against each other stay taut in a fit
//! (docs/lab/0063-initial-states-before-parameters.md).

use crate::diagnose::data::Data;
use crate::diagnose::search::subset::Subset;
use sinew_sim::{Rig, SimulationSettings};

use super::{compiled, recorded};

/// The shipped tendon platform without its fibres: of six bodies the tip is all that is seen.
fn platform(stiffness: &str, effect: &str) -> Rig {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/tendon.toml");
    let text = std::fs::read_to_string(file).expect("the file ships with the project");
    let (bare, _) = text
        .split_once("[[waveguide]]")
        .expect("the rig has fibres");
    let text = bare.replace("value = 0.293", stiffness) + effect;
    Rig::parse(&text, "tendon.toml").expect("the rig is sound")
}

#[test]
fn start_states_that_are_far_off_do_not_let_tendons_hang() {
    let rubs = "\n[[effect]]\nkind = \"load_dependent_friction\"\ncomponent = \"north\"\ncoefficient = 0.1\n";
    let (own, real) = (
        platform("value = 0.293", ""),
        platform("value = 0.310", rubs),
    );
    let recording = recorded([&own, &real], (10.0, 120.0), 5e-4, 1);
    let plant = compiled(&own);
    let data =
        Data::new(&own, &plant, &[recording]).expect("the recordings have the columns of the rig");
    let subset = Subset {
        written: &own,
        data: &data,
        intervals: (0..8).map(|k| (0, 150 * k..150 * k + 62)).collect(),
        settings: SimulationSettings::default(),
    };
    let fitted = subset.first(&own, &plant.values(), 15);
    let fitted = fitted
        .expect("the rig is sound")
        .expect("the rig can be simulated");
    for tendon in &own.tendons {
        let slot = plant.slot(&format!("{}.pretension", tendon.name));
        let found = fitted.point.values[slot.expect("the plant has this parameter")];
        assert!(found > 3.0, "{} of 6 N: {found} N", tendon.name);
    }
}
