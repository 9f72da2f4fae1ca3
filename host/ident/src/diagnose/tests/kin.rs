//! Laws of the best one's family begin where it ended.

use crate::diagnose::candidate::Trial;
use crate::diagnose::data::Data;
use crate::diagnose::search::family::same_family;
use crate::diagnose::search::start::begin;
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::term;
use sinew_sim::SimulationSettings;

use super::{compiled, recordings, rig};

const DRY: &str = "coulomb_friction";

#[test]
fn laws_of_the_best_ones_family_begin_where_it_ended_unless_they_are_near() {
    let rig = rig();
    let data = Data::new(&rig, &compiled(&rig), &recordings().fit);
    let data = data.expect("the recordings have the columns of the rig");
    let subset = Subset {
        written: &rig,
        data: &data,
        intervals: vec![(0, 0..600)],
        settings: SimulationSettings::default(),
    };
    let parent = subset.first(&rig, &compiled(&rig).values(), 15);
    let parent = parent
        .expect("the rig is sound")
        .expect("the rig can be simulated");
    let dry = begin(&subset, &parent, &term(&rig, DRY, &["mass"]), &[0.3]);
    let dry = dry.expect("the component bears this effect");
    let dry = subset.improved(dry.terms, dry.model, dry.from, 15);
    let dry = dry.expect("the rig can be simulated");
    let of = |trial: &Trial, name: &str| {
        let slot = trial.model.plant.slot(name);
        trial.point.values[slot.expect("the plant has this parameter")]
    };

    let kind = |kind: &str| term(&rig, kind, &["mass"]);
    let all = [
        kind(DRY),
        kind("stribeck_friction"),
        kind("direction_dependent_friction"),
        kind("viscous_damping"),
    ];
    let known = [parent.clone(), dry.clone()];
    let kin = same_family(&subset, &parent, &known, &all).expect("the rig is sound");
    let begun: Vec<&str> = kin.iter().map(|one| one[0].terms[0].kind()).collect();
    assert_eq!(begun, ["stribeck_friction", "direction_dependent_friction"]);

    let level = of(&dry, "mass.coulomb_friction.level");
    for start in &kin[0] {
        let plant = &start.model.plant;
        let value =
            |name: &str| start.from.values[plant.slot(name).expect("the plant has this parameter")];
        for (name, wanted) in [
            ("mass.inertia", of(&dry, "mass.inertia")),
            ("coil.stiffness", of(&dry, "coil.stiffness")),
        ] {
            assert_eq!(value(name), wanted, "{name}");
            assert!(of(&parent, name) != wanted, "{name} moved");
        }
        let forces =
            ["level", "static_level"].map(|of| value(&format!("mass.stribeck_friction.{of}")));
        let mean = 0.5 * (forces[0] + forces[1]);
        assert!((mean / level - 1.0).abs() < 1e-9, "{mean} and {level}");
    }

    let start = kin
        .into_iter()
        .next()
        .and_then(|starts| starts.into_iter().next());
    let start = start.expect("there is one");
    let near = subset.improved(start.terms, start.model, start.from, 15);
    let known = [parent.clone(), dry, near.expect("the rig can be simulated")];
    let kin = same_family(&subset, &parent, &known, &all).expect("the rig is sound");
    let begun: Vec<&str> = kin.iter().map(|one| one[0].terms[0].kind()).collect();
    assert_eq!(begun, ["direction_dependent_friction"]);
}
