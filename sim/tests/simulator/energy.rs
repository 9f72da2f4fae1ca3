//! A rig without inputs never gains energy: random rigs of springs, dampers, unilateral tendons and
//! every friction, with the energy written down here and not by the plant.

use crate::mechanisms::{effect, plant, run, times};
use proptest::prelude::*;

/// A chain of slides, in numbers.
#[derive(Clone, Debug)]
struct Chain {
    masses: Vec<f64>,
    starts: Vec<f64>,
    speeds: Vec<f64>,
    /// Spring `i` joins body `i` to the one before it, or to the ground.
    stiffness: Vec<f64>,
    cubic: Vec<f64>,
    damping: Vec<f64>,
    /// Friction of each body, and its strength.
    friction: Vec<(u8, f64)>,
    /// (first arm, last arm, stiffness, damping, pretension) of a tendon over the chain.
    tendon: (f64, f64, f64, f64, f64),
    load: f64,
}

fn chain() -> impl Strategy<Value = Chain> {
    let bodies = 1..4usize;
    bodies.prop_flat_map(|n| {
        let each = |range: std::ops::Range<f64>| prop::collection::vec(range, n);
        (
            (each(0.05..5.0), each(-0.3..0.3), each(-2.0..2.0)),
            (each(1.0..400.0), each(0.0..2000.0), each(0.0..3.0)),
            prop::collection::vec((0..6u8, 0.0..3.0), n),
            (-1.0..-0.2, 0.2..1.0, 0.0..500.0, 0.0..10.0, -3.0..3.0),
            -5.0..5.0,
        )
            .prop_map(|(motion, springs, friction, tendon, load)| Chain {
                masses: motion.0,
                starts: motion.1,
                speeds: motion.2,
                stiffness: springs.0,
                cubic: springs.1,
                damping: springs.2,
                friction,
                tendon,
                load,
            })
    })
}

fn friction(component: &str, (kind, strength): (u8, f64)) -> String {
    match kind {
        0 => effect("coulomb_friction", component, &[("level", strength)]),
        1 => {
            let more = [
                ("level", strength),
                ("static_level", 1.5 * strength),
                ("velocity", 0.1),
            ];
            effect("stribeck_friction", component, &more)
        }
        2 => {
            let more = [
                ("level_pos", strength),
                ("level_neg", 0.4 * strength),
                ("damping_pos", 0.2),
                ("damping_neg", 0.5),
            ];
            effect("direction_dependent_friction", component, &more)
        }
        3 => effect("quadratic_drag", component, &[("coefficient", strength)]),
        4 => effect("viscous_damping", component, &[("damping", strength)]),
        _ => String::new(),
    }
}

impl Chain {
    fn tables(&self) -> String {
        let mut text = String::new();
        for i in 0..self.masses.len() {
            text += &format!(
                "[[body]]\nname = \"b{i}\"\nmotion = \"slide\"\ninertia = {:?}\nstart = {:?}\n\
                 start_velocity = {:?}\n",
                self.masses[i], self.starts[i], self.speeds[i]
            );
        }
        for i in 0..self.masses.len() {
            let from = if i == 0 {
                "ground".to_owned()
            } else {
                format!("b{}", i - 1)
            };
            text += &format!(
                "[[spring]]\nname = \"s{i}\"\nfrom = \"{from}\"\nto = \"b{i}\"\nstiffness = {:?}\n\
                 [[damper]]\nname = \"d{i}\"\nfrom = \"{from}\"\nto = \"b{i}\"\ndamping = {:?}\n\
                 [[sensor]]\nname = \"q{i}\"\nreads = \"b{i}.position\"\nsignal = \"q{i}_m\"\n\
                 [[sensor]]\nname = \"v{i}\"\nreads = \"b{i}.velocity\"\nsignal = \"v{i}_m_s\"\n",
                self.stiffness[i], self.damping[i]
            );
            text += &effect(
                "cubic_stiffness",
                &format!("s{i}"),
                &[("coefficient", self.cubic[i])],
            );
            text += &friction(&format!("b{i}"), self.friction[i]);
        }
        let (first, last, stiffness, damping, pretension) = self.tendon;
        let last_body = self.masses.len() - 1;
        let more = if last_body == 0 {
            String::new()
        } else {
            format!(", {{ body = \"b{last_body}\", arm = {last:?} }}")
        };
        text += &format!(
            "[[tendon]]\nname = \"line\"\npath = [{{ body = \"b0\", arm = {first:?} }}{more}]\n\
             stiffness = {stiffness:?}\ndamping = {damping:?}\npretension = {pretension:?}\n"
        );
        text + &effect("constant_load", "b0", &[("level", self.load)])
    }

    /// Kinetic energy and every potential: springs, their cubic parts, the tendon where it is taut
    /// (measured from where its spring part would be slack), the load.
    fn energy(&self, row: &[f64]) -> f64 {
        let q = |i: usize| row[2 * i];
        let v = |i: usize| row[2 * i + 1];
        let mut energy = -self.load * q(0);
        for i in 0..self.masses.len() {
            let x = q(i) - if i == 0 { 0.0 } else { q(i - 1) };
            energy += 0.5 * self.masses[i] * v(i) * v(i);
            energy += 0.5 * self.stiffness[i] * x * x + 0.25 * self.cubic[i] * x * x * x * x;
        }
        let (first, last, stiffness, _, pretension) = self.tendon;
        let last_body = self.masses.len() - 1;
        let stretch = first * q(0)
            + if last_body == 0 {
                0.0
            } else {
                last * q(last_body)
            };
        let taut = (stiffness * stretch + pretension).max(0.0);
        energy + 0.5 * taut * taut / stiffness.max(1e-9)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn energy_never_grows(chain in chain()) {
        let plant = plant(&chain.tables());
        let times = times(400, 0.005);
        let run = run(&plant, &times, &[]);
        let width = run.sensors;
        let energies: Vec<f64> = run.signals.chunks(width).map(|row| chain.energy(row)).collect();
        // What the energy is measured against: all that moves at the start.
        let scale = energies[0].abs() + 1.0;
        let mut lowest = energies[0];
        for (row, energy) in energies.iter().enumerate() {
            prop_assert!(
                energy - lowest <= 1e-6 * scale,
                "energy grew by {:e} of {scale} by row {row}", energy - lowest
            );
            lowest = lowest.min(*energy);
        }
    }
}

/// The energy above is worth something: without dissipation it stays, with it falls.
#[test]
fn energy_stays_without_dissipation_and_falls_with_it() {
    let chain = Chain {
        masses: vec![1.0, 0.5],
        starts: vec![0.1, -0.2],
        speeds: vec![0.5, 0.0],
        stiffness: vec![40.0, 90.0],
        cubic: vec![500.0, 0.0],
        damping: vec![0.0, 0.0],
        friction: vec![(9, 0.0), (9, 0.0)],
        tendon: (-0.5, 0.8, 200.0, 0.0, 1.0),
        load: 2.0,
    };
    let spread = |chain: &Chain| {
        let run = run(&plant(&chain.tables()), &times(800, 0.005), &[]);
        let width = run.sensors;
        let energies: Vec<f64> = run
            .signals
            .chunks(width)
            .map(|row| chain.energy(row))
            .collect();
        energies[0] - energies[799]
    };
    assert!(spread(&chain).abs() < 1e-5, "{:e}", spread(&chain));
    let rubbing = Chain {
        friction: vec![(0, 0.3), (9, 0.0)],
        ..chain
    };
    assert!(spread(&rubbing) > 0.1, "{}", spread(&rubbing));
}
