//! The plant that the controller does not know: the fitted rig with its parameters moved.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_ident::population::Fleet;
use sinew_sim::Plant;

/// A parameter that was moved, for the report.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PerturbedParameter {
    /// `carriage.inertia`.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// Value of the controller's model.
    pub fitted: f64,
    /// Value of the plant.
    pub plant: f64,
}

/// Moves every free parameter by a factor 1 - `most` to 1 - `least` or 1 + `least` to 1 + `most`,
/// seeded; bounds of the rig are kept, and so are the values of `calibrated`, parameters that each
/// device has its own calibration for.
pub fn perturbed(
    plant: &Plant,
    calibrated: &[String],
    (least, most): (f64, f64),
    seed: u64,
) -> (Vec<f64>, Vec<PerturbedParameter>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut values = plant.values();
    let mut list = Vec::new();
    for slot in plant.free_slots() {
        let parameter = &plant.parameters()[slot];
        let share = random.random_range(least..=most);
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        // Drawn all the same: the others are then those of the same seed without a calibration.
        if calibrated.contains(&parameter.name) {
            continue;
        }
        let wished = values[slot] * (1.0 + sign * share);
        values[slot] = wished
            .max(parameter.min.unwrap_or(f64::NEG_INFINITY))
            .min(parameter.max.unwrap_or(f64::INFINITY));
        list.push(PerturbedParameter {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            fitted: parameter.value,
            plant: values[slot],
        });
    }
    (values, list)
}

/// Draws a new device of a fleet, seeded; bounds of the rig are kept, and so are the values of
/// `calibrated`, as in [`perturbed`].
pub fn of_fleet(
    plant: &Plant,
    calibrated: &[String],
    fleet: &Fleet,
    seed: u64,
) -> (Vec<f64>, Vec<PerturbedParameter>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let drawn = fleet.draw_plant(plant, &mut random);
    let mut values = plant.values();
    let mut list = Vec::new();
    for axis in &fleet.axes {
        let Some(slot) = plant.slot(&axis.name) else {
            continue;
        };
        if calibrated.contains(&axis.name) {
            continue;
        }
        values[slot] = drawn[slot];
        list.push(PerturbedParameter {
            name: axis.name.clone(),
            unit: axis.unit.clone(),
            fitted: plant.parameters()[slot].value,
            plant: values[slot],
        });
    }
    (values, list)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_sim::Rig;

    #[test]
    fn a_device_of_a_fleet_keeps_what_is_calibrated_and_the_bounds_of_the_rig() {
        let rig = Rig::parse(
            "format = \"sinew-rig/1\"\nname = \"r\"\n\
             [[body]]\nname = \"m\"\nmotion = \"slide\"\n\
             inertia = { value = 1.0, max = 1.5 }\n\
             [[sensor]]\nname = \"s\"\nreads = \"m.position\"\nsignal = \"s_m\"\n\
             gain = { value = 2.0 }\n",
            "rig.toml",
        );
        let plant = Plant::new(&rig.expect("a rig")).expect("a plant");
        let parameter = |name: &str, mean: f64| {
            format!(
                "[[parameter]]\nname = \"{name}\"\nunit = \"\"\nscale = \"log\"\nmean = {mean:?}\n"
            )
        };
        let text = format!(
            "format = \"sinew-fleet/1\"\nrig = \"r\"\nwidening = 1.5\nfreedom = 5\n\
             covariance = [[0.04, 0.0], [0.0, 0.04]]\n\
             covariance_of_mean = [[0.0, 0.0], [0.0, 0.0]]\n{}{}",
            parameter("m.inertia", 3.0),
            parameter("s.gain", 4.0)
        );
        let fleet = Fleet::parse(&text, std::path::Path::new("fleet.toml")).expect("a fleet");
        let (values, moved) = of_fleet(&plant, &["s.gain".into()], &fleet, 3);
        let value = |name: &str| values[plant.slot(name).expect("a parameter")];
        assert_eq!((value("m.inertia"), value("s.gain")), (1.5, 2.0));
        assert_eq!(moved.len(), 1);
        let (values, _) = of_fleet(&plant, &[], &fleet, 3);
        let gain = values[plant.slot("s.gain").expect("a parameter")];
        assert!((2.0..8.0).contains(&gain) && gain != 4.0, "{gain}");
        assert_eq!(values, of_fleet(&plant, &[], &fleet, 3).0);
    }

    #[test]
    fn calibrated_parameters_stay_and_the_others_move_as_without_them() {
        let rig = Rig::parse(
            "format = \"sinew-rig/1\"\nname = \"r\"\n\
             [[body]]\nname = \"m\"\nmotion = \"slide\"\ninertia = { value = 1.0 }\n\
             [[sensor]]\nname = \"s\"\nreads = \"m.position\"\nsignal = \"s_m\"\n\
             gain = { value = 2.0 }\n\
             [[spring]]\nname = \"k\"\nfrom = \"ground\"\nto = \"m\"\n\
             stiffness = { value = 3.0 }\n",
            "rig.toml",
        );
        let plant = Plant::new(&rig.expect("a rig")).expect("a plant");
        let place = |name: &str| {
            let names = plant.parameters().iter();
            names.map(|p| &p.name).position(|other| other == name)
        };
        let gain = place("s.gain").expect("a parameter");
        let (all, moved) = perturbed(&plant, &[], (0.1, 0.2), 7);
        let (kept, fewer) = perturbed(&plant, &["s.gain".into()], (0.1, 0.2), 7);
        assert_eq!((moved.len(), fewer.len()), (3, 2));
        for (slot, (all, kept)) in all.iter().zip(&kept).enumerate() {
            if slot == gain {
                assert!(*kept == 2.0 && (all - 2.0).abs() > 0.1);
            } else {
                assert_eq!(all, kept);
            }
        }
    }
}
