//! Episodes of the devices of a fleet, in place of one plant or of a box.

use std::path::Path;

use sinew_ident::population::Fleet;
use sinew_sim::{Plant, Rig, Stepper};
use sinew_train::dataset::{Episode, RolloutConfig, SampledState, draw, sampled_states};
use sinew_train::state;

const PERIOD_S: f64 = 1.0 / 120.0;

/// A fifth more mass and 15 % more stiffness than the rig has.
const FLEET: &str = r#"
format = "sinew-fleet/1"
rig = "mass-spring-damper"
widening = 1.5
freedom = 9
covariance = [[0.001, 0.0, 0.0], [0.0, 0.002, 0.0], [0.0, 0.0, 0.004]]
covariance_of_mean = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
[[parameter]]
name = "mass.inertia"
unit = "kg"
scale = "log"
mean = 1.2
[[parameter]]
name = "coil.stiffness"
unit = "N/m"
scale = "log"
mean = 46.0
[[parameter]]
name = "dashpot.damping"
unit = "N s/m"
scale = "log"
mean = 1.2
"#;

fn plant() -> Plant {
    let rig = include_str!("../../../rigs/mass-spring-damper.toml");
    let rig = Rig::parse(rig, "rig.toml").expect("the text is a rig");
    Plant::new(&rig).expect("a plant")
}

fn config() -> RolloutConfig {
    RolloutConfig {
        period_s: PERIOD_S,
        steps: 40,
        outputs: vec![0],
        noise: vec![0.0],
        channels: vec![],
        channel_noise: vec![],
        seed: 3,
    }
}

fn starts(plant: &Plant) -> Vec<SampledState> {
    let usual = plant.values();
    let times: Vec<f64> = (0..600).map(|k| f64::from(k) * PERIOD_S).collect();
    let push: Vec<f64> = times.iter().map(|t| 8.0 * (2.3 * t).sin()).collect();
    let start = plant.initial_state(&usual, &[None]).expect("a start");
    sampled_states(plant, &usual, &start, &times, &[&push], 100).expect("a motion")
}

/// Largest difference between an episode and a simulation with these parameters.
fn off(plant: &Plant, values: &[f64], episode: &Episode) -> f64 {
    let mut stepper = Stepper::new(plant, values, &episode.start).expect("a state of the plant");
    let mut largest = 0.0_f64;
    for (u, y) in episode.u.iter().zip(&episode.y[1..]) {
        stepper.advance(PERIOD_S, &[*u]).expect("a period");
        largest = largest.max((stepper.signal(0) - y).abs());
    }
    largest
}

#[test]
fn episodes_are_of_the_plants_in_turn() {
    let plant = plant();
    let first = plant.values();
    let mut second = first.clone();
    second[plant.slot("coil.stiffness").expect("a spring")] *= 2.0;
    let episodes = draw(&plant, &[&first, &second], &starts(&plant), &config(), 6);
    for (number, episode) in episodes.expect("episodes").iter().enumerate() {
        let plants = [&first, &second];
        let (own, other) = (plants[number % 2], plants[1 - number % 2]);
        assert!(off(&plant, own, episode) < 1e-9, "{number}");
        assert!(off(&plant, other, episode) > 1e-5, "{number}");
    }
}

#[test]
fn a_state_model_sees_the_devices_of_its_fleet() {
    let plant = plant();
    let fleet = Fleet::parse(FLEET, Path::new("fleet.toml")).expect("a fleet");
    let names = ["mass.inertia", "coil.stiffness", "dashpot.damping"];
    let slots = names.map(|name| plant.slot(name).expect("a parameter"));
    let of = |fleet: Option<Fleet>| {
        let population = state::Population {
            slots: slots.to_vec(),
            spread: 0.15,
            reach: 2.0,
            fleet,
        };
        let usual = plant.values();
        let episodes = state::draw(&plant, &usual, &population, &starts(&plant), &config(), 200);
        let episodes = episodes.expect("episodes");
        [0, 1, 2].map(|j| {
            let theta = episodes.iter().map(|it| it.theta[j]);
            assert!(theta.clone().all(|it| it.abs() <= 2.0));
            theta.sum::<f64>() / 200.0
        })
    };
    let (of_box, of_fleet) = (of(None), of(Some(fleet)));
    // 20 and 15 % above the rig's, in units of 15 %.
    for (mean, wanted) in of_fleet.iter().zip([1.33, 1.0, 0.0]) {
        assert!((mean - wanted).abs() < 0.15, "{of_fleet:?}");
    }
    assert!(of_box.iter().all(|mean| mean.abs() < 0.3), "{of_box:?}");
}
