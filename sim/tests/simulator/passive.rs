//! No passive effect creates energy: random pairs of them at random places of a rig without inputs,
//! the energy written down here.

use crate::mechanisms::{effect, plant, times};
use proptest::prelude::*;
use sinew_sim::{InputTrajectory, Plant};

const BODIES: &str = r#"
[[body]]
name = "a"
motion = "slide"
inertia = 1.3
start = 0.2
start_velocity = VELOCITY
[[body]]
name = "b"
motion = "slide"
inertia = 0.6
start = -0.1
start_velocity = -0.5
[[spring]]
name = "coil"
from = "ground"
to = "a"
stiffness = 60.0
[[spring]]
name = "anchor"
from = "ground"
to = "b"
stiffness = 35.0
[[tendon]]
name = "line"
path = [{ body = "a", arm = 0.6 }, { body = "b", arm = -0.9 }]
stiffness = 40.0
damping = 0.1
pretension = 1.0
unilateral = false
"#;

/// An effect, by number, with strength and detail between 0 and 1.
fn passive(which: u8, strength: f64, detail: f64) -> String {
    let more = |kind, component, parameters: &[(&str, f64)]| effect(kind, component, parameters);
    match which {
        0 => more(
            "load_dependent_friction",
            "line",
            &[("coefficient", 0.6 * strength)],
        ),
        1 => more(
            "load_dependent_friction",
            "a",
            &[("coefficient", 0.6 * strength)],
        ),
        2 => {
            more(
                "end_stop",
                "a",
                &[
                    ("position", 0.2 * detail - 0.05),
                    ("stiffness", 2000.0 * strength),
                    ("damping", 30.0 * detail),
                ],
            ) + "side = 1.0\n"
        }
        3 => more("backlash", "coil", &[("gap", 0.2 * strength)]),
        4 => more("backlash", "line", &[("gap", 0.1 * strength)]),
        5 => more("tendon_slack", "line", &[("slack", 0.05 * strength)]),
        6 => {
            let beta = 40.0 * detail + 1.0;
            let gamma = beta * (2.0 * strength - 1.0);
            more(
                "hysteresis",
                "coil",
                &[
                    ("alpha", 50.0 * strength),
                    ("beta", beta),
                    ("gamma", gamma),
                    ("exponent", 1.0 + detail),
                ],
            )
        }
        7 => more(
            "viscoelastic_creep",
            "anchor",
            &[
                ("stiffness", 60.0 * strength + 1.0),
                ("time_constant", detail + 0.02),
            ],
        ),
        8 => more(
            "hidden_mode",
            "b",
            &[
                ("inertia", 0.1 + strength),
                ("stiffness", 80.0 * detail),
                ("damping", 0.3 * strength),
            ],
        ),
        9 => more("cross_coupling", "a+b", &[("stiffness", 50.0 * strength)]),
        10 => more("coulomb_friction", "b", &[("level", 4.0 * strength)]),
        11 => more("quadratic_drag", "a", &[("coefficient", 3.0 * strength)]),
        12 => more(
            "presliding_friction",
            "a",
            &[("level", 4.0 * strength), ("distance", 0.2 * detail + 0.01)],
        ),
        13 => more(
            "plastic_set",
            "coil",
            &[
                ("stiffness", 60.0 * strength),
                ("yield_extension", 0.2 * detail + 0.01),
            ],
        ),
        14 => more(
            "warm_up_friction",
            "b",
            &[
                ("level", 4.0 * strength),
                ("velocity", 0.5),
                ("time_constant", detail + 0.1),
            ],
        ),
        _ => more(
            "cubic_stiffness",
            "coil",
            &[("coefficient", 900.0 * strength)],
        ),
    }
}

fn dead_band(x: f64, gap: f64) -> f64 {
    x.signum() * (x.abs() - 0.5 * gap).max(0.0)
}

/// Kinetic energy and every store of the rig; parameters by name, absent ones 0.
fn energy(plant: &Plant, state: &[f64]) -> f64 {
    let values = plant.values();
    let get = |name: &str| plant.slot(name).map_or(0.0, |slot| values[slot]);
    let names = plant.state_names();
    let at = |name: &str| {
        names
            .iter()
            .position(|n| n == name)
            .map_or(0.0, |i| state[i])
    };
    let (a, b, hidden) = (
        at("a.position"),
        at("b.position"),
        at("b.hidden_mode.position"),
    );
    let mut energy = 0.5 * 1.3 * at("a.velocity").powi(2) + 0.5 * 0.6 * at("b.velocity").powi(2);
    energy += 0.5 * get("b.hidden_mode.inertia") * at("b.hidden_mode.velocity").powi(2);
    energy += 0.5 * get("b.hidden_mode.stiffness") * (hidden - b).powi(2);
    let coil = dead_band(a, get("coil.backlash.gap"));
    energy +=
        0.5 * 60.0 * coil * coil + 0.25 * get("coil.cubic_stiffness.coefficient") * coil.powi(4);
    energy += 0.5 * 35.0 * b * b + 0.5 * get("a+b.cross_coupling.stiffness") * (b - a).powi(2);
    let slack = plant.slot("line.tendon_slack.slack").is_some();
    let free = 1.0 + 40.0 * (0.6 * a - 0.9 * b - get("line.tendon_slack.slack"));
    let mut tension = dead_band(free, 40.0 * get("line.backlash.gap"));
    if slack {
        tension = tension.max(0.0);
    }
    energy += 0.5 * tension * tension / 40.0;
    energy += 0.5 * get("coil.hysteresis.alpha") * at("coil.hysteresis.z").powi(2);
    energy += 0.5 * get("coil.plastic_set.stiffness") * at("coil.plastic_set.z").powi(2);
    // A spring of the stiffness level over distance, whose extension is the share of the distance.
    energy += 0.5
        * get("a.presliding_friction.level")
        * get("a.presliding_friction.distance")
        * at("a.presliding_friction.share").powi(2);
    if let Some(slot) = plant.slot("anchor.viscoelastic_creep.stiffness") {
        energy += 0.5 * at("anchor.viscoelastic_creep.force").powi(2) / values[slot];
    }
    let depth = (a - get("a.end_stop.position")).max(0.0);
    energy + 0.5 * get("a.end_stop.stiffness") * depth * depth
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_passive_effect_creates_energy(
        first in (0..16u8, 0.0..1.0f64, 0.0..1.0f64),
        second in (0..16u8, 0.0..1.0f64, 0.0..1.0f64),
        velocity in -2.0..2.0f64,
    ) {
        prop_assume!(first.0 != second.0);
        let text = BODIES.replace("VELOCITY", &format!("{velocity:?}"))
            + &passive(first.0, first.1, first.2)
            + &passive(second.0, second.1, second.2);
        let plant = plant(&text);
        let times = times(300, 0.01);
        let drive = InputTrajectory::new(&plant, times.len(), &[]).unwrap();
        let values = plant.values();
        let start = plant.initial_state(&values, &[]).unwrap();
        let mut energies = Vec::new();
        let end = plant
            .simulate_with(&values, &start, &drive, &times, |_, at| {
                energies.push(energy(&plant, &at.state()));
            })
            .unwrap();
        prop_assert_eq!(end.report().fallbacks, 0);
        let scale = energies[0] + 1e-3;
        let mut lowest = energies[0];
        for (row, energy) in energies.iter().enumerate() {
            prop_assert!(
                energy - lowest <= 2e-5 * scale,
                "{text}: energy grew by {:e} of {scale} by row {row}", energy - lowest
            );
            lowest = lowest.min(*energy);
        }
    }
}
