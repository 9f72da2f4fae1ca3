//! Motion in, force out: bodies whose motion a column imposes, against closed forms.

use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, Trajectory};

const HEAD: &str = "format = \"sinew-rig/1\"\nname = \"stand\"\n";

const ROD: &str = "[[body]]\nname = \"rod\"\nmotion = \"slide\"\ninertia = 2.0\n\
                   motion_from = \"q_m\"\n";

const CELL: &str = "[[sensor]]\nname = \"cell\"\nreads = \"rod.effort\"\nsignal = \"f_N\"\n";

fn plant(tables: &str) -> Plant {
    let text = format!("{HEAD}{tables}");
    Plant::new(&Rig::parse(&text, "stand.toml").unwrap()).unwrap()
}

fn effect(kind: &str, component: &str, parameters: &str) -> String {
    format!("[[effect]]\nkind = \"{kind}\"\ncomponent = \"{component}\"\n{parameters}\n")
}

fn times(rows: usize, dt: f64) -> Vec<f64> {
    (0..rows).map(|row| dt * row as f64).collect()
}

/// The plant moved along a column.
fn run(plant: &Plant, t: &[f64], q: &[f64]) -> Trajectory<f64> {
    let columns: Vec<&[f64]> = plant.inputs().iter().map(|_| q).collect();
    let signals = vec![f64::NAN; t.len()];
    let signals: Vec<&[f64]> = plant.sensors().iter().map(|_| &signals[..]).collect();
    plant
        .simulate_recording(t, &columns, &signals)
        .unwrap()
        .trajectory
}

/// The largest error but at the first and last rows, where a spline knows less.
fn error(found: &[f64], exact: impl Fn(usize) -> f64) -> f64 {
    let rows = 30..found.len() - 30;
    rows.map(|row| (found[row] - exact(row)).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_effort_is_inertia_spring_and_damper_along_the_motion() {
    let plant = plant(&format!(
        "{ROD}[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"rod\"\nstiffness = 40.0\n\
         rest = 0.1\n[[damper]]\nname = \"oil\"\nfrom = \"ground\"\nto = \"rod\"\ndamping = 3.0\n\
         {CELL}offset = 0.5\n"
    ));
    let t = times(1001, 0.005);
    let q: Vec<f64> = t.iter().map(|t| 0.2 * (4.0 * t).sin()).collect();
    let run = run(&plant, &t, &q);
    let exact = |row: usize| {
        let (sin, cos) = (4.0 * t[row]).sin_cos();
        -2.0 * 3.2 * sin + 40.0 * (0.2 * sin - 0.1) + 3.0 * 0.8 * cos + 0.5
    };
    let error = error(&run.column(0), exact);
    assert!(error < 1e-3, "{error:e}");
    // Nothing is integrated: one look a row.
    assert_eq!(run.report.substeps, t.len() - 1);
    assert_eq!(run.report.rate, 0.0);
}

#[test]
fn a_rod_without_mass_rubs_and_an_actuator_is_asked_for_the_rest() {
    let rod = ROD.replace("inertia = 2.0", "inertia = 0.0");
    let plant = plant(&format!(
        "{rod}[[actuator]]\nname = \"motor\"\ndrives = \"rod\"\ninput = \"u_A\"\ngain = 10.0\n\
         [[actuator]]\nname = \"push\"\ndrives = \"rod\"\ninput = \"p_N\"\ngain = 1.0\n\
         {CELL}[[sensor]]\nname = \"torque\"\nreads = \"motor.effort\"\nsignal = \"tau_N\"\n{}",
        effect("coulomb_friction", "rod", "level = 1.5")
    ));
    let t = times(2001, 0.002);
    let q: Vec<f64> = t.iter().map(|t| 0.1 * (3.0 * t).cos()).collect();
    let mut columns = vec![vec![0.7; t.len()], vec![2.0; t.len()]];
    columns.extend(vec![q; 4]);
    plant.derive_motions(&t, &mut columns).unwrap();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, t.len(), &columns).unwrap();
    let start = vec![0.0; plant.state_len()];
    let run = plant.simulate(&plant.values(), &start, &drive, &t).unwrap();
    let friction = |row: usize| -1.5 * (3.0 * t[row]).sin().signum();
    let moving = |row: usize| (3.0 * t[row]).sin().abs() > 1e-3;
    for row in (5..t.len() - 5).filter(|&row| moving(row)) {
        assert!((run.signal(row, 0) - (friction(row) - 9.0)).abs() < 1e-9);
        assert!((run.signal(row, 1) - (friction(row) - 2.0)).abs() < 1e-9);
    }
}

/// Samples of noise 1e-4 on a rod that rests: its direction is unknown, and so no friction is
/// foretold, where the sign of a difference would call it now forward and now backward.
#[test]
fn friction_does_not_chatter_with_the_noise_of_a_rod_at_rest() {
    let friction = effect("coulomb_friction", "rod", "level = 1.5");
    let plant = plant(&format!("{}{CELL}{friction}", ROD.replace("2.0", "0.0")));
    let t = times(3000, 0.002);
    let q: Vec<f64> = (t.iter().enumerate())
        .map(|(row, t)| {
            let noise = 1e-4 * ((row * 7919) % 101) as f64 / 101.0;
            noise + 0.1 * (t - 2.0).clamp(0.0, 2.0)
        })
        .collect();
    let found = run(&plant, &t, &q).column(0);
    let rms = |rows: std::ops::Range<usize>, level: f64| {
        let count = rows.len() as f64;
        (rows.map(|row| (found[row] - level).powi(2)).sum::<f64>() / count).sqrt()
    };
    assert!(rms(100..900, 0.0) < 1.2, "{}", rms(100..900, 0.0));
    assert!(rms(1100..1900, 1.5) < 0.05, "{}", rms(1100..1900, 1.5));
}

/// Bouc-Wen with an exponent of 1 along a motion that never turns:
/// z = (1 - exp(-(beta + gamma) x)) / (beta + gamma), whatever the speed; and back again.
#[test]
fn a_hysteresis_remembers_the_imposed_motion() {
    let spring = "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"rod\"\nstiffness = 5.0\n";
    let memory = effect(
        "hysteresis",
        "coil",
        "alpha = 30.0\nbeta = 6.0\ngamma = 2.0\nexponent = 1.0",
    );
    let rod = ROD.replace("inertia = 2.0", "inertia = 0.0");
    let plant = plant(&format!("{rod}{spring}{CELL}{memory}"));
    let t = times(1501, 0.002);
    // There and back: 0 to 0.4 to 0.
    let q: Vec<f64> = t.iter().map(|t| 0.2 - 0.2 * (2.0 * t).cos()).collect();
    let run = run(&plant, &t, &q);
    let turned = std::f64::consts::FRAC_PI_2;
    let top = (1.0 - (-8.0f64 * 0.4).exp()) / 8.0;
    let exact = |row: usize| {
        let x = 0.2 - 0.2 * (2.0 * t[row]).cos();
        let z = if t[row] < turned {
            (1.0 - (-8.0 * x).exp()) / 8.0
        } else {
            // On the way back dz/ds = -1 - (beta - gamma) z in s = 0.4 - x while z > 0.
            (top + 0.25) * (-4.0 * (0.4 - x)).exp() - 0.25
        };
        5.0 * x + 30.0 * z
    };
    // z is zero again after s = ln((top + 0.25) / 0.25) / 4.
    let zero = ((top + 0.25) / 0.25).ln() / 4.0;
    let back = |row: usize| t[row] < turned || 0.4 - q[row] < zero;
    let before = (5..t.len() - 5).take_while(|&row| back(row));
    let worst = before
        .map(|row| (run.signal(row, 0) - exact(row)).abs())
        .fold(0.0, f64::max);
    assert!(worst < 1e-4, "{worst:e}");
}

/// Dahl's friction depends on the way alone: w = s + (w0 - s) exp(-way / distance) in the direction
/// s since the last reversal, however fast.
#[test]
fn presliding_friction_remembers_the_way_and_no_speed() {
    let memory = effect("presliding_friction", "rod", "level = 2.5\ndistance = 0.03");
    let rod = ROD.replace("inertia = 2.0", "inertia = 0.0");
    let plant = plant(&format!("{rod}{CELL}{memory}"));
    let t = times(1501, 0.002);
    let q: Vec<f64> = t.iter().map(|t| 0.05 - 0.05 * (2.0 * t).cos()).collect();
    let run = run(&plant, &t, &q);
    let turned = std::f64::consts::FRAC_PI_2;
    let top = 1.0 - (-0.1f64 / 0.03).exp();
    let exact = |row: usize| {
        let x = 0.05 - 0.05 * (2.0 * t[row]).cos();
        let share = if t[row] < turned {
            1.0 - (-x / 0.03).exp()
        } else {
            -1.0 + (top + 1.0) * (-(0.1 - x) / 0.03).exp()
        };
        2.5 * share
    };
    let worst = (5..t.len() - 5)
        .map(|row| (run.signal(row, 0) - exact(row)).abs())
        .fold(0.0, f64::max);
    assert!(worst < 1e-4 * 2.5, "{worst:e}");
}

/// The friction of a rod that is moved back and forth falls with its temperature, exactly:
/// theta' = (|v|/velocity - theta) / time_constant for v = a w sin(w t).
#[test]
fn the_effort_of_a_moved_rod_falls_as_its_friction_warms() {
    let warming = effect(
        "warm_up_friction",
        "rod",
        "level = 2.5\nvelocity = 0.2\ntime_constant = 0.6",
    );
    let rod = ROD.replace("inertia = 2.0", "inertia = 0.0");
    let plant = plant(&format!("{rod}{CELL}{warming}"));
    let t = times(701, 0.002);
    let q: Vec<f64> = t.iter().map(|t| 0.05 - 0.05 * (2.0 * t).cos()).collect();
    let run = run(&plant, &t, &q);
    // Up to the reversal, |v| = 0.1 sin(2 t): the particular solution and the decay.
    let (tau, omega) = (0.6f64, 2.0f64);
    let amplitude = 0.1 / 0.2 / (1.0 + (tau * omega).powi(2));
    let exact = |t: f64| {
        let theta = amplitude
            * ((omega * t).sin() - tau * omega * (omega * t).cos()
                + tau * omega * (-t / tau).exp());
        2.5 * (-theta).exp()
    };
    let worst = (5..t.len())
        .map(|row| (run.signal(row, 0) - exact(t[row])).abs())
        .fold(0.0, f64::max);
    assert!(exact(t[700]) < 0.8 * 2.5, "it warms: {}", exact(t[700]));
    assert!(worst < 1e-4 * 2.5, "{worst:e}");
}

/// A mass on a spring and damper whose base moves: the steady state is the transfer function, and
/// the effort at the base is the force in the spring and damper.
#[test]
fn a_free_body_follows_an_imposed_one() {
    let (m, c, k, w) = (0.5, 4.0, 60.0, 9.0);
    let base = ROD.replace("2.0", "0.0");
    let plant = plant(&format!(
        "{base}[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = {m:?}\n\
         [[spring]]\nname = \"coil\"\nfrom = \"rod\"\nto = \"mass\"\nstiffness = {k:?}\n\
         [[damper]]\nname = \"oil\"\nfrom = \"rod\"\nto = \"mass\"\ndamping = {c:?}\n{CELL}\
         [[sensor]]\nname = \"encoder\"\nreads = \"mass.position\"\nsignal = \"x_m\"\n"
    ));
    let t = times(4001, 0.002);
    let q: Vec<f64> = t.iter().map(|t| 0.1 * (w * t).sin()).collect();
    let run = run(&plant, &t, &q);
    // x = Im(H 0.1 e^{iwt}) with H = (k + i c w) / (k - m w^2 + i c w); the base feels m x''.
    let (a, b) = (k - m * w * w, c * w);
    let (re, im) = (
        (k * a + b * b) / (a * a + b * b),
        (b * a - k * b) / (a * a + b * b),
    );
    let exact = |row: usize| {
        let (sin, cos) = (w * t[row]).sin_cos();
        0.1 * (re * sin + im * cos)
    };
    for row in 2500..3990 {
        assert!((run.signal(row, 1) - exact(row)).abs() < 1e-6);
        assert!((run.signal(row, 0) + m * w * w * exact(row)).abs() < 1e-4);
    }
}

#[test]
fn derivatives_of_an_effort_are_exact() {
    let plant = plant(&format!(
        "{ROD}[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"rod\"\nstiffness = 40.0\n{CELL}"
    ));
    let t = times(301, 0.01);
    let q: Vec<f64> = t.iter().map(|t| 0.2 * (4.0 * t).sin()).collect();
    let mut columns = vec![q.clone(); 4];
    plant.derive_motions(&t, &mut columns).unwrap();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, t.len(), &columns).unwrap();
    let mut values: Vec<Dual<4>> = (plant.values().iter())
        .map(|&value| Dual::constant(value))
        .collect();
    let slots = [
        plant.slot("rod.inertia").unwrap(),
        plant.slot("coil.stiffness").unwrap(),
    ];
    for (index, slot) in slots.into_iter().enumerate() {
        values[slot].derivative[index] = 1.0;
    }
    let start = vec![Dual::constant(0.0); 2];
    let run = plant.simulate(&values, &start, &drive, &t).unwrap();
    let last = |run: &Trajectory<f64>| {
        let mut cotangent = vec![0.0; t.len()];
        cotangent[150] = 1.0;
        (run.signal(150, 0), cotangent)
    };
    let gradient = plant
        .gradient(&plant.values(), &[0.0, 0.0], &drive, &t, last)
        .unwrap();
    for (row, column) in q.iter().enumerate().take(290).skip(10) {
        let [by_inertia, by_stiffness, ..] = run.signal(row, 0).derivative;
        assert!((by_inertia + 16.0 * column).abs() < 1e-3);
        assert!((by_stiffness - column).abs() < 1e-6);
    }
    let [by_inertia, by_stiffness, ..] = run.signal(150, 0).derivative;
    assert_eq!(gradient.parameters[slots[0]], by_inertia);
    assert_eq!(gradient.parameters[slots[1]], by_stiffness);
}

#[test]
fn a_motion_that_is_not_there_is_refused() {
    let plant = plant(&format!("{ROD}{CELL}"));
    let gap = [f64::NAN; 20];
    let refused = plant.simulate_recording(&times(20, 0.1), &[&gap[..]; 4], &[&gap[..]]);
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("`q_m`"), "{message}");
    assert!(message.contains("six valid samples"), "{message}");
}
