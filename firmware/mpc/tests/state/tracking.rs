//! Tracking error on plants 10 to 20 % off the model, beside a PID tuned on each of them.

use crate::common::Random;
use crate::mass::{FILTER, FilterSettings, controller};
use crate::plant::{Figures, Plant, moves, noise, preview, run};
use crate::tuned_pid::TunedPid;

/// To 20, 40 and 80 % of the workspace, as the host program's comparison.
const PLACES: [f64; 3] = [-0.21, -0.07, 0.21];
fn predictive(plant: Plant, filter: FilterSettings, reference: &[f64], seed: u64) -> Figures {
    let mut controller = controller(filter);
    run(plant, reference, seed, |reading, k| {
        let ahead =
            core::array::from_fn(|j| [reference[(k + j + 1).min(reference.len() - 1)] as f32]);
        let step = controller.step(&[reading as f32], &ahead);
        assert!(step.status.is_controlled(), "{step:?}");
        f64::from(step.u[0])
    })
}

#[test]
fn three_quarters_of_the_error_of_a_pid_tuned_on_the_very_plant() {
    let reference = moves(&PLACES);
    let mut mean = 0.0;
    println!("      MPC: rms, largest mm, change N   PID: the same   MPC, parameters kept");
    for seed in 1..=6 {
        let plant = Plant::drawn(seed);
        let mpc = predictive(plant, FILTER, &reference, 9);
        let kept = FilterSettings {
            adapt: false,
            ..FILTER
        };
        let kept = predictive(plant, kept, &reference, 9);
        // The PID knows the plant and the moves; only the noise is another.
        let pid = TunedPid::on(plant, &reference).figures(plant, &reference, 9);
        println!("plant {seed}: {mpc}   {pid}   {kept}");
        assert!(mpc.rms < 0.75 * pid.rms, "plant {seed}: {mpc}, {pid}");
        assert!(mpc.change < pid.change, "plant {seed}: {mpc}, {pid}");
        assert!(
            mpc.rms < 0.75 * kept.rms,
            "plant {seed}: nothing was learned"
        );
        mean += mpc.rms / 6.0;
    }
    println!("mean {:.3} mm", 1e3 * mean);
    assert!(mean < 0.2e-3, "{mean}");
}

/// Masses, springs and frictions change by 30 % while the loop runs: two seconds later the error is
/// that of a loop that was on such a plant from the start.
#[test]
fn a_changed_plant_is_as_good_as_a_new_one_after_two_seconds() {
    let places = [0.2, -0.2, 0.1, -0.15, 0.2, -0.05, 0.15];
    let reference = moves(&places);
    let (change, judged) = (333 * 3, 333 * 3 + 240);
    for parameter in 0..4 {
        let mut changed = Plant::drawn(1);
        changed.theta[parameter] *= if parameter < 2 { 1.3 } else { 0.7 };
        let error = |before: Plant| {
            let mut controller = controller(FILTER);
            let (mut plant, mut random) = (before, Random(9));
            let mut squares = 0.0;
            for (k, r) in reference.iter().enumerate() {
                if k == change {
                    plant.theta = changed.theta;
                }
                if k >= judged {
                    squares += (plant.q - r) * (plant.q - r);
                }
                let ahead = preview(&reference, k);
                let reading = plant.q + noise(&mut random);
                let step = controller.step(&[reading as f32], &ahead);
                plant.advance(f64::from(step.u[0]));
            }
            (squares / (reference.len() - judged) as f64).sqrt()
        };
        let (moved, own) = (error(Plant::drawn(1)), error(changed));
        println!(
            "parameter {parameter}: {:.3} mm, from the start {:.3} mm",
            1e3 * moved,
            1e3 * own
        );
        assert!(moved < 1.1 * own, "parameter {parameter}: {moved} {own}");
    }
}
