//! HASEL actuators: the published static force, the charge, and energy that nobody makes.

use crate::mechanisms::{plant, run, times};
use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, SimulationSettings, Stepper};

const EPSILON_0: f64 = 8.854_187_818_8e-12;
const LENGTH: f64 = 0.02;
const WIDTH: f64 = 0.025;
const FILM: f64 = 15e-6;
const PERMITTIVITY: f64 = 2.2;
const REST: f64 = 0.7;
const POUCHES: f64 = 3.0;
const SPRING: f64 = 300.0;
/// Height of the tip in the middle of the swirl, m.
const MIDDLE: f64 = 0.145;

/// A slide on a spring that an actuator pulls down, with what reads it; `slack` m of the stroke are
/// used up where the slide is at 0.
fn device(slack: f64, more: &str) -> Plant {
    plant(&format!(
        "[[body]]\nname = \"m\"\nmotion = \"slide\"\ninertia = 0.05\n{more}\n\
         [[spring]]\nname = \"s\"\nfrom = \"ground\"\nto = \"m\"\nstiffness = {SPRING:?}\n\
         [[damper]]\nname = \"d\"\nfrom = \"ground\"\nto = \"m\"\ndamping = {{ value = 3.0 }}\n\
         [[hasel]]\nname = \"muscle\"\npath = [{{ body = \"m\", arm = 1.0 }}]\nslack = {slack:?}\n\
         pouches = 3\npouch_length = {LENGTH:?}\nwidth = {{ value = {WIDTH:?} }}\nfilm_thickness = {FILM:?}\n\
         permittivity = {PERMITTIVITY:?}\nfill_angle = {{ value = {REST:?} }}\ncapacitance = 3e-10\n\
         resistance = {{ value = 5e6 }}\nfilm_stiffness = 5000.0\n\
         [[actuator]]\nname = \"supply\"\ndrives = \"muscle\"\ninput = \"u_kV\"\nunit = \"kV\"\ngain = 1.0\n\
         [[sensor]]\nname = \"q\"\nreads = \"m.position\"\nsignal = \"q_m\"\n\
         [[sensor]]\nname = \"v\"\nreads = \"m.velocity\"\nsignal = \"v_m_s\"\n\
         [[sensor]]\nname = \"volts\"\nreads = \"muscle.voltage\"\nsignal = \"muscle_V\"\n\
         [[sensor]]\nname = \"stroke\"\nreads = \"muscle.stroke\"\nsignal = \"stroke_m\"\n"
    ))
}

/// Stroke and zipped film of one pouch at an angle, m: from the geometry alone.
fn pouch(a: f64) -> (f64, f64) {
    let lens = |a: f64| 2.0 * a - (2.0 * a).sin();
    let r = LENGTH / (2.0 * REST) * (lens(REST) / lens(a)).sqrt();
    let rest = LENGTH / REST * (REST - REST.sin());
    (2.0 * r * (a - a.sin()) - rest, LENGTH - 2.0 * a * r)
}

/// Balance of spring and published force (Kellaris et al. 2019, eq. for the static pull),
/// found by bisection over the angle.
fn balance(slack: f64, volts: f64) -> f64 {
    let pull = |a: f64| {
        let unit = WIDTH * EPSILON_0 * PERMITTIVITY / (4.0 * FILM);
        unit * volts * volts * a.cos() / (1.0 - a.cos())
    };
    let (mut low, mut high) = (REST, std::f64::consts::FRAC_PI_2);
    for _ in 0..80 {
        let a = 0.5 * (low + high);
        if pull(a) > SPRING * (POUCHES * pouch(a).0 - slack) {
            low = a;
        } else {
            high = a;
        }
    }
    POUCHES * pouch(low).0 - slack
}

#[test]
fn it_settles_where_the_published_force_balances_a_spring() {
    let plant = device(0.001, "");
    let times = times(400, 0.005);
    for volts in [2000.0, 5000.0, 8000.0] {
        let end = run(&plant, &times, &[&vec![volts; times.len()]]);
        let expected = balance(0.001, volts);
        assert!(expected > 1e-4, "it does not move: this tests nothing");
        let found = -end.signal(times.len() - 1, 0);
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{volts} V: {found} and not {expected}"
        );
        assert!((end.signal(times.len() - 1, 2) / volts - 1.0).abs() < 1e-6);
    }
}

/// Held still the electrodes charge as any capacitor does, with the capacitance of what has zipped.
#[test]
fn it_charges_with_the_time_constant_of_its_capacitance() {
    let slack = 0.004;
    let still = device(slack, "")
        .slot("m.inertia")
        .expect("the plant has this parameter");
    let plant = device(slack, "");
    let mut values = plant.values();
    values[still] = 1e9;
    let times = times(60, 2e-4);
    let drive = InputTrajectory::new(&plant, times.len(), &[&vec![1000.0; times.len()]])
        .expect("one column");
    let start = vec![0.0; plant.state_len()];
    let run = plant
        .simulate(&values, &start, &drive, &times)
        .expect("the run ends");
    let (mut low, mut high) = (REST, std::f64::consts::FRAC_PI_2);
    for _ in 0..80 {
        let a = 0.5 * (low + high);
        if POUCHES * pouch(a).0 < slack {
            low = a
        } else {
            high = a
        }
    }
    let per_metre = PERMITTIVITY * EPSILON_0 * WIDTH / (2.0 * FILM);
    let capacitance = 3e-10 + POUCHES * per_metre * pouch(low).1;
    assert!(
        capacitance > 4e-10,
        "nothing has zipped: this tests nothing"
    );
    for (row, t) in times.iter().enumerate() {
        let expected = 1000.0 * (1.0 - (-t / (5e6 * capacitance)).exp());
        assert!(
            (run.signal(row, 2) - expected).abs() < 1e-3,
            "{t}: {} {expected}",
            run.signal(row, 2)
        );
    }
}

/// Energy of the supply, less what resistance and damper take, is in the spring, the mass, the
/// field.
#[test]
fn energy_in_is_energy_kept_and_lost() {
    let plant = device(0.001, "");
    let times = times(8001, 2.5e-5);
    let input: Vec<f64> = times
        .iter()
        .map(|t| 4000.0 + 3900.0 * (40.0 * t).sin())
        .collect();
    let drive = InputTrajectory::new(&plant, times.len(), &[&input]).expect("one column");
    let mut rows = Vec::new();
    let start = vec![0.0; plant.state_len()];
    let charge = plant
        .state_names()
        .iter()
        .position(|name| name == "muscle.charge");
    let charge = charge.expect("the plant has this parameter");
    plant
        .simulate_with(&plant.values(), &start, &drive, &times, |_, at| {
            let state = at.state();
            rows.push([state[0], state[1], state[charge], at.signal(2)]);
        })
        .expect("the run ends");
    let kept = |row: &[f64; 4]| {
        0.5 * SPRING * row[0] * row[0] + 0.5 * 0.05 * row[1] * row[1] + 0.5 * row[2] * row[3]
    };
    let (mut supplied, mut lost) = (0.0, 0.0);
    for (row, pair) in rows.windows(2).enumerate() {
        // The input is held over the interval; what flows is the trapezoid of both ends.
        let dt = times[row + 1] - times[row];
        let mean = |f: &dyn Fn(&[f64; 4]) -> f64| 0.5 * (f(&pair[0]) + f(&pair[1])) * dt;
        let u = input[row];
        supplied += u * (pair[1][2] - pair[0][2]);
        lost += mean(&|r| (u - r[3]).powi(2) / 5e6 + 3.0 * r[1] * r[1]);
    }
    let change = kept(&rows[rows.len() - 1]) - kept(&rows[0]);
    let largest = rows.iter().map(kept).fold(0.0, f64::max);
    assert!(lost > 0.3 * largest, "nothing is lost: this tests nothing");
    assert!(
        (supplied - lost - change).abs() < 2e-5 * supplied,
        "{supplied} {lost} {change}"
    );
}

/// Charged, cut off (an ohmic infinity) and let swing: the whole energy only falls.
#[test]
fn cut_off_it_never_gains_energy() {
    let plant = device(0.004, "start = -0.002");
    let mut values = plant.values();
    values[plant
        .slot("muscle.resistance")
        .expect("the plant has this parameter")] = 1e18;
    let times = times(4000, 1e-4);
    let drive =
        InputTrajectory::new(&plant, times.len(), &[&vec![0.0; times.len()]]).expect("one column");
    let mut start = plant
        .initial_state(&values, &[None; 4])
        .expect("four sensors");
    start[2] = 1e-6;
    let (mut last, mut first) = (f64::INFINITY, None);
    plant
        .simulate_with(&values, &start, &drive, &times, |_, at| {
            let s = at.state();
            let kept =
                0.5 * SPRING * s[0] * s[0] + 0.5 * 0.05 * s[1] * s[1] + 0.5 * s[2] * at.signal(2);
            assert!(kept <= last * (1.0 + 1e-8), "{kept} > {last}");
            first.get_or_insert(kept);
            last = kept;
        })
        .expect("the run ends");
    assert!(
        last < 0.9 * first.unwrap_or(0.0),
        "it lost nothing: this tests nothing"
    );
}

#[test]
fn derivatives_reach_through_the_pouch() {
    let plant = device(0.001, "");
    let names = ["muscle.fill_angle", "muscle.width", "muscle.resistance"];
    let slots = names.map(|name| plant.slot(name).unwrap_or_else(|| panic!("no {name}")));
    let times = times(40, 0.004);
    let drive = InputTrajectory::new(&plant, times.len(), &[&vec![6000.0; times.len()]])
        .expect("one column");
    let mut values: Vec<Dual<3>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    let row = 6;
    let start = vec![Dual::ZERO; plant.state_len()];
    let exact = plant
        .simulate(&values, &start, &drive, &times)
        .expect("the run ends")
        .signal(row, 0);
    let start = vec![0.0; plant.state_len()];
    for (seed, &slot) in slots.iter().enumerate() {
        let beside = |factor: f64| {
            let mut values = plant.values();
            values[slot] *= factor;
            plant
                .simulate(&values, &start, &drive, &times)
                .expect("the run ends")
                .signal(row, 0)
        };
        let h = 1e-5;
        let slope = (beside(1.0 + h) - beside(1.0 - h)) / (2.0 * h);
        let found = exact.derivative[seed] * plant.values()[slot];
        assert!(slope.abs() > 1e-6, "{}: no slope, no test", names[seed]);
        assert!(
            (found / slope - 1.0).abs() < 1e-4,
            "{}: {found} {slope}",
            names[seed]
        );
    }
}

/// The shipped platform's tip follows the published swirl, 7 mm each way in x and y and 4 mm in z
/// on one path, inside the voltages that its actuators may have. An integral controller finds them:
/// on squared voltages, which is what pulls, and slow beside the motion.
#[test]
fn the_shipped_platform_reaches_the_published_swirl() {
    let rig = Rig::load(concat!(env!("CARGO_MANIFEST_DIR"), "/../rigs/hasel.toml"));
    let settings = SimulationSettings {
        rate_step: 0.4,
        ..SimulationSettings::default()
    };
    let plant =
        Plant::new(&rig.expect("the rig ships with the project")).expect("the rig is sound");
    let plant = plant.with_settings(settings);
    let limits: Vec<[f64; 2]> = (plant.inputs().iter())
        .map(|input| input.limit.expect("an actuator has a limit").into())
        .collect();
    let dt = 0.008;
    let sensor = |name: &str| plant.sensors().iter().position(|s| s.name == name);
    let tip = ["tip_x", "tip_y", "tip_z"].map(|name| sensor(name).expect("the tip is read"));
    let mut stepper = Stepper::new(&plant, &plant.values(), &vec![0.0; plant.state_len()])
        .expect("the rig is sound");
    // Squared volts: both ways and all together.
    let (mut x, mut y, mut all) = (0.0, 0.0, 1e7);
    let (settle, turn, turns) = (3.0, 30.0, 2.0);
    let rows = ((settle + turn * turns) / dt) as usize;
    let (mut squares, mut count, mut reach) = (0.0, 0, [[f64::INFINITY, f64::NEG_INFINITY]; 3]);
    let mut used = [f64::INFINITY, 0.0];
    for row in 0..rows {
        let volts: Vec<f64> = (limits.iter().enumerate())
            .map(|(k, [low, high])| {
                let angle = std::f64::consts::FRAC_PI_3 * k as f64;
                let square: f64 = all + x * angle.cos() + y * angle.sin();
                square.max(0.0).sqrt().clamp(*low, *high)
            })
            .collect();
        for volts in &volts {
            used = [f64::min(used[0], *volts), f64::max(used[1], *volts)];
        }
        stepper.advance(dt, &volts).expect("the run ends");
        let at = tip.map(|sensor| stepper.signal(sensor));
        let time = row as f64 * dt - settle;
        let phase = std::f64::consts::TAU * time.max(0.0) / turn;
        let wanted = [
            0.007 * phase.cos(),
            0.007 * phase.sin(),
            MIDDLE + 0.002 * (phase / turns).cos(),
        ];
        let off: [f64; 3] = std::array::from_fn(|k| wanted[k] - at[k]);
        x += 1.45e7 * off[0];
        y += 1.45e7 * off[1];
        all -= 1.1e8 * off[2];
        if time > 0.0 {
            squares += off.iter().map(|o| o * o).sum::<f64>();
            count += 1;
            for (reach, at) in reach.iter_mut().zip(at) {
                *reach = [reach[0].min(at), reach[1].max(at)];
            }
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!(
        "RMS {rms:.2e} m, reach {reach:?}, {used:?} V, {:?}",
        stepper.report()
    );
    assert!(rms < 1e-3, "{rms} m from the path; reach {reach:?}");
    let [lowest, highest] = [limits[0][0], limits[0][1]];
    assert!(
        used[0] > lowest && used[1] < 0.9 * highest,
        "{used:?} V leave no room"
    );
    let span = reach.map(|[low, high]| high - low);
    assert!(
        span[0] > 0.0138 && span[1] > 0.0138 && span[2] > 0.0038,
        "{span:?}"
    );
}
