//! List of the terms that may be missing from a rig.

use sinew_sim::effects::Kind;
use sinew_sim::{Meaning, Plant, Rig};

use crate::diagnose::by_signal::BySignal;
use crate::diagnose::identical;
use crate::diagnose::term::Term;

/// Every term that may be missing from a rig: these effects at each component, at each group of
/// identical ones, and the rig's bare numbers.
pub(crate) fn terms(rig: &Rig, plant: &Plant, effects: &[Kind]) -> Vec<Term> {
    let mut all = Vec::new();
    for &kind in effects {
        let sites = kind.sites(rig).into_iter();
        all.extend(sites.map(|site| Term::at(rig, kind, &[site])));
    }
    for &kind in effects {
        let groups = identical::groups(rig, kind).into_iter();
        all.extend(groups.map(|sites| Term::at(rig, kind, &sites)));
    }
    // A number that is not zero has a size to be wrong by; a zero (an offset, a rest) is left to
    // the loads.
    for parameter in plant.parameters() {
        let starts = parameter.meaning == Meaning::Start;
        if !parameter.free && !starts && parameter.value != 0.0 {
            all.push(Term::Number {
                name: parameter.name.clone(),
            });
        }
    }
    all
}

/// Effects at each component whose strengths depend on one of these signals.
pub(crate) fn depending_terms(rig: &Rig, effects: &[Kind], signals: &[BySignal]) -> Vec<Term> {
    let kinds = effects.iter().filter(|kind| kind.follows_signals());
    let at = |&kind: &Kind| {
        let sites = kind.sites(rig).into_iter();
        sites.flat_map(move |site| {
            let plain = Term::at(rig, kind, &[site]);
            signals
                .iter()
                .map(move |signal| plain.clone().depending(signal))
        })
    };
    kinds.flat_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::term::term;

    /// A shipped rig, and the terms that put an effect at several places of it.
    fn alike(name: &str) -> (Rig, Vec<Term>) {
        let rig = Rig::load(format!("{}/../../rigs/{name}", env!("CARGO_MANIFEST_DIR")));
        let rig = rig.expect("the rig ships with the project");
        let plant = Plant::new(&rig).expect("the rig is sound");
        let all = terms(&rig, &plant, Kind::ALL).into_iter();
        let together = all.filter(Term::is_group);
        let together = together.collect();
        (rig, together)
    }

    #[test]
    fn what_one_tendon_spring_winch_or_camera_does_all_alike_are_suspected_of() {
        let (rig, together) = alike("tendon.toml");
        let of = |components: &str| -> Vec<&str> {
            let them = together.iter().filter(|one| one.component() == components);
            them.map(Term::kind).collect()
        };
        let tendons = of("east+west+north+south");
        assert_eq!(
            tendons,
            ["load_dependent_friction", "backlash", "tendon_slack"]
        );
        let joints = [1, 2, 3].map(|k| format!("spine.flex_x{k}+spine.flex_y{k}"));
        assert!(of(&joints.join("+")).contains(&"viscoelastic_creep"));
        assert!(of("pull_east+pay_out_west+pull_north+pay_out_south").contains(&"input_dead_zone"));
        assert_eq!(of("tip_x+tip_y+tip_z"), ["sensor_lag", "sensor_curvature"]);
        let tendons = ["east", "west", "north", "south"];
        let rub = term(&rig, "load_dependent_friction", &tendons);
        let with = rub
            .apply(&rig, &[0.1, 0.2, 0.3, 0.4])
            .expect("tendons bear friction");
        assert_eq!(with.effects.len(), 4);
        assert_eq!(
            rub.sizes().len(),
            4,
            "each of them has to show that it is there"
        );
        let plant = Plant::new(&with).expect("the rig is sound");
        assert_eq!(rub.tried(&plant).len(), 4);
        let slot =
            |name: &String| plant.values()[plant.slot(name).expect("the plant has this parameter")];
        let values: Vec<f64> = rub.parameters().iter().map(slot).collect();
        assert_eq!(values, [0.1, 0.2, 0.3, 0.4]);
    }

    #[test]
    fn springs_of_one_plate_are_alike_and_those_of_several_bodies_are_not() {
        let (_, together) = alike("hasel.toml");
        let foam = "column_rise+column_roll+column_pitch";
        assert!(together.iter().any(|one| one.component() == foam));
        let field = "field_1x+field_1y+field_1z";
        assert!(together.iter().any(|one| one.component() == field));
        for rig in [
            "mass-spring-damper.toml",
            "two-mass-drive.toml",
            "three-mass.toml",
        ] {
            assert!(alike(rig).1.is_empty(), "{rig}");
        }
    }

    #[test]
    fn joints_of_one_chain_rub_alike_and_no_load_hangs_at_all_of_them() {
        let (_, together) = alike("tendon.toml");
        let joints = "spine.x1+spine.y1+spine.x2+spine.y2+spine.x3+spine.y3";
        let at_joints = together.iter().filter(|one| one.component() == joints);
        let kinds: Vec<&str> = at_joints.map(Term::kind).collect();
        for kind in ["coulomb_friction", "viscous_damping", "end_stop"] {
            assert!(kinds.contains(&kind), "{kind}");
        }
        for kind in ["constant_load", "position_ripple", "hidden_mode"] {
            assert!(!kinds.contains(&kind), "{kind}");
        }
    }
}
