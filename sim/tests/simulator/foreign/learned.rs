//! Learned laws against motions that a foreign integrator wrote for named laws which they contain
//! exactly: a cubic spring is straight over the square, quadratic drag over the speed.

use sinew_sim::{InputTrajectory, Plant, Rig};

use super::recording::{Columns, range, text};

/// Largest difference from the recording over the range of the motion.
fn error(device: &str, rig: &str) -> f64 {
    let plant = Plant::new(&Rig::parse(rig, "rig.toml").unwrap_or_else(|error| panic!("{error}")));
    let plant = plant.unwrap_or_else(|error| panic!("{error}"));
    let recording = Columns::read(&format!("laws/{device}.csv"));
    let t = recording.get("t");
    let inputs: Vec<&[f64]> = (plant.inputs().iter())
        .map(|input| recording.get(&input.column))
        .collect();
    let drive = InputTrajectory::new(&plant, t.len(), &inputs).unwrap();
    let values = plant.values();
    let start = plant.initial_state(&values, &[Some(0.0)]).unwrap();
    let run = plant.simulate(&values, &start, &drive, t).unwrap();
    let theirs = recording.get(&plant.sensors()[0].column);
    let pairs = run.column(0).into_iter().zip(theirs);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / range(theirs)
}

/// The number behind a key of a rig that an integrator wrote, and the rig without its effect.
fn number(text: &str, key: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix(key));
    line.and_then(|rest| rest.trim_start_matches([' ', '=']).parse().ok())
        .unwrap_or_else(|| panic!("{key}"))
}

fn list(places: impl Iterator<Item = f64>) -> String {
    let texts: Vec<String> = places.map(|value| format!("{value:?}")).collect();
    format!("[{}]", texts.join(", "))
}

#[test]
fn a_law_that_contains_a_cubic_spring_moves_as_the_foreign_integrator_says() {
    let text = text("laws/cubic_stiffness.toml");
    let (k, cubic) = (number(&text, "stiffness"), number(&text, "coefficient"));
    let (head, _) = text.split_once("[[effect]]").unwrap();
    for reach in [0.05, 0.5] {
        let places = (0..9).map(|i| reach * f64::from(i) / 8.0);
        let law = list(places.map(|x| k + 3.0 * cubic * x * x));
        let rig = head.replacen(&format!("stiffness = {k}\n"), "law = \"curve\"\n", 1)
            + &format!(
                "[[law]]\nname = \"curve\"\nmotion = \"hinge\"\nreach = {reach:?}\nstiffness = {law}\n"
            );
        let error = error("cubic_stiffness", &rig);
        assert!(error < 1e-5, "{reach}: {error:.1e}");
        // The same without what stiffens it is another motion.
        let linear = rig.replace(&law, &list((0..9).map(|_| k)));
        assert!(super::learned::error("cubic_stiffness", &linear) > 1e-2);
    }
}

#[test]
fn a_law_that_contains_quadratic_drag_moves_as_the_foreign_integrator_says() {
    let text = text("laws/quadratic_drag.toml");
    let (c, drag) = (number(&text, "damping"), number(&text, "coefficient"));
    let (head, _) = text.split_once("[[effect]]").unwrap();
    for reach in [0.2, 2.0] {
        let places = (0..9).map(|i| reach * f64::from(i) / 8.0);
        let law = list(places.map(|v| c + 2.0 * drag * v));
        let rig = head.replacen(&format!("damping = {c}\n"), "law = \"curve\"\n", 1)
            + &format!("[[law]]\nname = \"curve\"\nreach = {reach:?}\ndamping = {law}\n");
        let error = error("quadratic_drag", &rig);
        assert!(error < 1e-5, "{reach}: {error:.1e}");
        let linear = rig.replace(&law, &list((0..9).map(|_| c)));
        assert!(super::learned::error("quadratic_drag", &linear) > 1e-2);
    }
}
