//! A state-space model of a mass with dry friction, trained over a population of masses, springs,
//! dampers and frictions.

use sinew_sim::{Plant, Rig, Stepper};
use sinew_train::dataset::{RolloutConfig, sampled_states};
use sinew_train::state::{Population, StateEpisode, StateModel, StateOptions, draw, train};

const PERIOD_S: f64 = 1.0 / 120.0;
const PARAMETERS: [&str; 4] = [
    "mass.inertia",
    "coil.stiffness",
    "dashpot.damping",
    "mass.coulomb_friction.level",
];

fn plant() -> Plant {
    let rig = include_str!("../../../rigs/mass-spring-damper.toml");
    let friction = "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\n\
                    level = { value = 0.58, min = 0.0, max = 10.0 }\n";
    let rig = Rig::parse(&format!("{rig}{friction}"), "rig.toml").expect("the text is a rig");
    Plant::new(&rig).expect("a plant")
}

fn population(plant: &Plant) -> Population {
    Population {
        slots: PARAMETERS
            .iter()
            .map(|name| plant.slot(name).expect("a parameter of the rig"))
            .collect(),
        spread: 0.15,
        reach: 2.0,
        fleet: None,
    }
}

fn episodes(plant: &Plant, seed: u64, count: usize) -> Vec<StateEpisode> {
    let usual = plant.values();
    // A swing from end to end, to start from.
    let times: Vec<f64> = (0..1200).map(|k| f64::from(k) * PERIOD_S).collect();
    let push: Vec<f64> = times.iter().map(|t| 14.0 * (2.3 * t).sin()).collect();
    let start = plant.initial_state(&usual, &[None]).expect("a start");
    let from = sampled_states(plant, &usual, &start, &times, &[&push], 200).expect("a motion");
    let config = RolloutConfig {
        period_s: PERIOD_S,
        steps: 40,
        outputs: vec![0],
        noise: vec![0.0],
        channels: vec![],
        channel_noise: vec![],
        seed,
    };
    draw(plant, &usual, &population(plant), &from, &config, count).expect("episodes")
}

fn trained(plant: &Plant, options: &StateOptions) -> (StateModel, f64) {
    let sets = [(1, 1500), (2, 200), (3, 200)].map(|(seed, count)| episodes(plant, seed, count));
    let mut last = f64::INFINITY;
    let model = train(
        (1, 1),
        [&sets[0], &sets[1], &sets[2]],
        options,
        |pass, passes, losses| {
            if pass % 10 == 0 {
                println!("{pass} of {passes}: {losses:?}");
            }
            last = last.min(losses.validation);
        },
    );
    (model.expect("a model"), last)
}

/// Velocity after a period from here, of a device.
fn simulated(plant: &Plant, x: &[f64; 2], u: f64, theta: &[f64]) -> f64 {
    let values = population(plant).values(&plant.values(), theta);
    let mut stepper = Stepper::new(plant, &values, x).expect("a state of the plant");
    stepper.advance(PERIOD_S, &[u]).expect("a period");
    stepper.state()[1]
}

fn predicted(model: &StateModel, x: &[f64; 2], u: f64, theta: &[f64]) -> f64 {
    let mut z = vec![
        model.states[0].scaled(x[0]),
        model.states[1].scaled(x[1]),
        model.inputs[0].scaled(u),
    ];
    z.extend_from_slice(theta);
    model.next(&z)[1] * model.states[1].span + model.states[1].offset
}

#[test]
fn the_network_knows_what_a_linear_model_does_not() {
    let plant = plant();
    let options = StateOptions {
        epochs: 30,
        ..StateOptions::default()
    };
    let (model, loss) = trained(&plant, &options);
    println!(
        "loss {loss:.3} of the linear model's; one step {:?}, measurement {:?}",
        model.one_step_error, model.measurement_error
    );
    assert!(loss < 0.2, "{loss}");
    // Dry friction changes the velocity by 5 mm/s in a period.
    assert!(model.one_step_error[1] * model.states[1].span < 8e-3);
    // The encoder reads a state.
    assert!(model.measurement_error[0] < 1e-6);
    // A moving mass that is pushed: the effect of each parameter alone, on this plant.
    let (x, u) = ([0.2, 0.4], 12.0);
    let effect = |velocity: &dyn Fn(&[f64]) -> f64| -> [f64; 4] {
        std::array::from_fn(|i| {
            let mut theta = [0.0; 4];
            theta[i] = 1.5;
            let above = velocity(&theta);
            theta[i] = -1.5;
            above - velocity(&theta)
        })
    };
    let exact = effect(&|theta| simulated(&plant, &x, u, theta));
    let learned = effect(&|theta| predicted(&model, &x, u, theta));
    println!("effects {exact:?}, learned {learned:?}");
    let largest = exact.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    for (a, b) in exact.iter().zip(&learned) {
        assert!((a - b).abs() < 0.15 * largest, "{exact:?} {learned:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_weights_and_another_does_not() {
    let plant = plant();
    let set = episodes(&plant, 1, 40);
    let of_seed = |seed: u64| {
        let options = StateOptions {
            epochs: 1,
            batches: 3,
            seed,
            ..StateOptions::default()
        };
        train((1, 1), [&set, &set, &set], &options, |_, _, _| {}).expect("a model")
    };
    assert_eq!(of_seed(1), of_seed(1));
    assert_ne!(of_seed(1).hidden, of_seed(2).hidden);
}

#[test]
fn parameters_of_a_device_are_found_back_from_its_values() {
    let plant = plant();
    let population = population(&plant);
    let theta = [0.5, -1.0, 0.0, 2.0];
    let values = population.values(&plant.values(), &theta);
    let mass = plant.slot("mass.inertia").expect("a parameter");
    assert!((values[mass] - 1.075).abs() < 1e-12, "{}", values[mass]);
    for (a, b) in population
        .theta(&plant.values(), &values)
        .iter()
        .zip(&theta)
    {
        assert!((a - b).abs() < 1e-12);
    }
}

#[test]
fn sets_without_a_rollout_are_refused() {
    let plant = plant();
    let set = episodes(&plant, 1, 2);
    let refusal = |sets: [&[StateEpisode]; 3], rollout: usize| {
        let options = StateOptions {
            rollout,
            ..StateOptions::default()
        };
        let refused = train((1, 1), sets, &options, |_, _, _| {});
        refused.expect_err("refused").to_string()
    };
    assert!(refusal([&[], &set, &set], 10).contains("no episode"));
    assert!(refusal([&set, &[], &set], 10).contains("rollout"));
    assert!(refusal([&set, &set, &set], 41).contains("40 periods"));
}
