//! MuJoCo judges the rests: `tests/foreign/mujoco_rests.py` held the inputs of four of its devices
//! until nothing moved.

use super::recording::text;
use sinew_sim::{Plant, Rig};

/// Largest difference, m or rad: what MuJoCo had still to move, and the digits of the file.
const TOLERANCE: f64 = 1e-12;

#[test]
fn rests_are_those_of_mujoco() {
    let table = text("trajectories/rests.csv");
    let mut worst = 0.0f64;
    let mut slack = 0;
    for line in table.lines().filter(|line| !line.starts_with('#')) {
        let mut fields = line.split(',');
        let device = fields.next().expect("a device");
        let mut numbers = fields.map(|field| field.parse::<f64>().expect("a number"));
        let input = numbers.next().expect("an input");
        let file = format!("trajectories/{device}.toml");
        let rig = Rig::parse(&text(&file), &file).expect("a rig file");
        let plant = Plant::new(&rig).expect("a sound rig");
        let start = vec![0.0; plant.state_len()];
        let rest = plant.rest(&plant.values(), &[input], &start).expect(device);
        slack += rest.slack.len();
        let positions: Vec<f64> = numbers.collect();
        assert_eq!(positions.len(), rest.signals.len(), "{device}");
        for (found, exact) in rest.signals.iter().zip(positions) {
            let error = (found - exact).abs();
            assert!(error < TOLERANCE, "{device} at {input}: {found} {exact}");
            worst = worst.max(error);
        }
    }
    println!("largest difference: {worst:.1e}; {slack} slack tendons");
    assert!(slack > 0, "no tendon went slack");
}
