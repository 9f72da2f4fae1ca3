//! Chains, plates and what reads them, held against closed forms.

use crate::mechanisms::{plant, run};
use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, Stepper};

/// A chain with an antagonistic pair about y, and what reads it.
fn chain(segments: usize, more: &str) -> String {
    format!(
        "[[chain]]\nname = \"spine\"\nsegments = {segments}\nlength = {{ value = 0.1 }}\n\
         stiffness = {{ value = {k} }}\ndamping = {{ value = {c} }}\ninertia = {{ value = {j} }}\n\
         [[tendon]]\nname = \"east\"\npath = [{{ chain = \"spine\", radius = {{ value = 0.01 }} }}]\n\
         stiffness = {{ value = 5000.0 }}\npretension = 6.0\n\
         [[tendon]]\nname = \"west\"\npath = [{{ chain = \"spine\", radius = 0.01, angle = {pi} }}]\n\
         stiffness = 5000.0\npretension = 6.0\n\
         [[actuator]]\nname = \"in\"\ndrives = \"east\"\ninput = \"u_mm\"\nunit = \"mm\"\ngain = -1.0\n\
         [[actuator]]\nname = \"out\"\ndrives = \"west\"\ninput = \"u_mm\"\nunit = \"mm\"\ngain = 1.0\n\
         [[sensor]]\nname = \"x\"\nreads = \"spine.tip.x\"\nsignal = \"x_m\"\n\
         [[sensor]]\nname = \"y\"\nreads = \"spine.tip.y\"\nsignal = \"y_m\"\n\
         [[sensor]]\nname = \"z\"\nreads = \"spine.tip.z\"\nsignal = \"z_m\"\n{more}",
        k = 0.1 * segments as f64,
        c = 2e-3 * segments as f64,
        j = 7e-5,
        pi = std::f64::consts::PI,
    )
}

/// Steady state under a constant input, SI.
fn settled(plant: &Plant, input: f64) -> Vec<f64> {
    let times: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
    let column = vec![input; times.len()];
    let columns: Vec<&[f64]> = plant.inputs().iter().map(|_| &column[..]).collect();
    let trajectory = run(plant, &times, &columns);
    (0..plant.sensors().len())
        .map(|sensor| trajectory.signal(times.len() - 1, sensor))
        .collect()
}

/// Both tendons taut: `theta = p / r * 2 k r^2 / (K + 2 k r^2)`, and the tip of a circular arc.
/// However many segments bend, equal ones bend equally.
#[test]
fn a_pulled_chain_is_the_arc_that_statics_says() {
    let p = 0.006;
    let theta = p / 0.01 * (2.0 * 5000.0 * 1e-4) / (0.1 + 2.0 * 5000.0 * 1e-4);
    let expected = [
        0.1 * (1.0 - theta.cos()) / theta,
        0.0,
        0.1 * theta.sin() / theta,
    ];
    assert!(expected[0] > 0.02, "it hardly bends: this tests nothing");
    for segments in [1, 2, 5] {
        let found = settled(&plant(&chain(segments, "")), p);
        for axis in 0..3 {
            let error = (found[axis] - expected[axis]).abs();
            assert!(
                error < 1e-8,
                "{segments} segments: {found:?} and not {expected:?}"
            );
        }
    }
}

/// A fibre on the side towards which it bends is shortened by `r theta`, along a part of it by that
/// part.
#[test]
fn a_fibre_sees_the_strain_of_its_place() {
    let fibre = |name: &str, more: &str| {
        format!(
            "[[waveguide]]\nname = \"{name}\"\nchain = \"spine\"\nradius = 0.009\nloss = 4.0\n{more}\n\
             [[sensor]]\nname = \"light {name}\"\nreads = \"{name}.light\"\nsignal = \"{name}_1\"\n"
        )
    };
    let more = fibre("inside", "") + &fibre("outside", "angle = 3.141592653589793");
    let more = more + &fibre("beside", "angle = 1.5707963267948966\nspan = [0.2, 0.9]");
    let more = more + &fibre("part", "span = [0.1, 0.7]");
    let found = settled(&plant(&chain(3, &more)), 0.006);
    let theta = 0.006 / 0.01 * 1.0 / 1.1;
    let strain = 0.009 * theta / 0.1;
    let expected = [4.0 * strain, -4.0 * strain, 0.0, 4.0 * strain].map(f64::exp);
    assert!(expected[0] > 1.2, "no light is lost: this tests nothing");
    for (k, expected) in expected.iter().enumerate() {
        assert!((found[3 + k] - expected).abs() < 1e-7, "{k}: {found:?}");
    }
}

/// The derivatives of a whole trajectory with respect to numbers that chains share, and to a radius
/// from which arms are derived.
#[test]
fn derivatives_reach_shared_and_derived_numbers() {
    let plant = plant(&chain(2, ""));
    let names = ["spine.stiffness", "spine.length", "east.radius.spine"];
    let slots = names.map(|name| plant.slot(name).unwrap_or_else(|| panic!("no {name}")));
    let times: Vec<f64> = (0..40).map(|k| 0.01 * f64::from(k)).collect();
    let input: Vec<f64> = times.iter().map(|t| 0.004 * (9.0 * t).sin()).collect();
    let drive = InputTrajectory::new(&plant, times.len(), &[&input]).expect("one column");
    let start = vec![Dual::<3>::ZERO; plant.state_len()];
    let mut values: Vec<Dual<3>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    let exact = plant
        .simulate(&values, &start, &drive, &times)
        .expect("the run ends");
    let start = vec![0.0; plant.state_len()];
    for (seed, &slot) in slots.iter().enumerate() {
        let beside = |factor: f64| {
            let mut values = plant.values();
            values[slot] *= factor;
            plant
                .simulate(&values, &start, &drive, &times)
                .expect("the run ends")
                .signal(times.len() - 1, 0)
        };
        let h = 1e-5;
        let slope = (beside(1.0 + h) - beside(1.0 - h)) / (2.0 * h * plant.values()[slot]);
        let found = exact.signal(times.len() - 1, 0).derivative[seed];
        assert!(slope.abs() > 1e-4, "{}: no slope, no test", names[seed]);
        assert!(
            (found / slope - 1.0).abs() < 1e-6,
            "{}: {found} {slope}",
            names[seed]
        );
    }
}

/// Let go bent, with its tendons held: the energy, written down here, only falls.
#[test]
fn a_chain_let_go_never_gains_energy() {
    let mut more = String::new();
    for k in 1..=3 {
        for axis in ["x", "y"] {
            for (short, long) in [("q", "position"), ("v", "velocity")] {
                more += &format!(
                    "[[sensor]]\nname = \"{short}{axis}{k}\"\nreads = \"spine.{axis}{k}.{long}\"\n\
                     signal = \"{short}{axis}{k}\"\n"
                );
            }
        }
    }
    let plant = plant(&chain(3, &more));
    let times: Vec<f64> = (0..400).map(|k| 0.002 * f64::from(k)).collect();
    let still = vec![0.0; times.len()];
    let drive = InputTrajectory::new(&plant, times.len(), &[&still]).expect("one column");
    let mut start = vec![0.0; plant.state_len()];
    start[..6].copy_from_slice(&[0.3, -0.4, 0.1, 0.5, -0.2, 0.35]);
    let run = plant
        .simulate(&plant.values(), &start, &drive, &times)
        .expect("the run ends");
    let mut last = f64::INFINITY;
    let mut first = None;
    for (row, time) in times.iter().enumerate() {
        let (mut energy, mut bend) = (0.0, 0.0);
        for k in 0..6 {
            let (q, v) = (run.signal(row, 3 + 2 * k), run.signal(row, 4 + 2 * k));
            energy += 0.5 * 0.3 * q * q + 0.5 * 7e-5 * v * v;
            bend += if k % 2 == 1 { q } else { 0.0 };
        }
        for side in [-1.0, 1.0] {
            let tension = (6.0 + 5000.0 * side * 0.01 * bend).max(0.0);
            energy += 0.5 * tension * tension / 5000.0;
        }
        assert!(
            energy <= last * (1.0 + 1e-7),
            "at {time}: {energy} > {last}"
        );
        first.get_or_insert(energy);
        last = energy;
    }
    // What is left is what the pretension holds.
    assert!(
        last < 0.5 * first.unwrap_or(0.0),
        "it lost nothing: this tests nothing"
    );
}

#[test]
fn what_segments_share_is_written_back_once() {
    let text = format!(
        "{}{}",
        crate::mechanisms::HEADER,
        chain(2, "").replace(
            "inertia = { value = 0.00007 }",
            "segment = [{ inertia = 7e-5 }, { inertia = { value = 3e-5 } }] # two",
        )
    );
    let rig = Rig::parse(&text, "chain.toml").unwrap_or_else(|error| panic!("{error}"));
    let plant = Plant::new(&rig).expect("the rig is sound");
    let free: Vec<&str> = (plant.free_slots().into_iter())
        .map(|slot| plant.parameters()[slot].name.as_str())
        .collect();
    let expected = [
        "spine.inertia.2",
        "spine.stiffness",
        "spine.damping",
        "east.stiffness",
        "spine.length",
        "east.radius.spine",
    ];
    assert_eq!(free, expected);
    let moved = rig
        .with_values(&[
            ("spine.inertia.2", 2e-5),
            ("east.radius.spine", 0.011),
            ("spine.rest_x", 0.02),
        ])
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(
        moved
            .to_toml()
            .contains("{ inertia = { value = 0.00002 } }] # two")
    );
    let moved = Plant::new(&moved).expect("the rig is sound");
    let value = |name| moved.values()[moved.slot(name).expect("the plant has this parameter")];
    assert_eq!(value("spine.inertia.1"), 7e-5);
    assert_eq!(value("east.radius.spine"), 0.011);
    assert_eq!(value("spine.rest_x"), 0.02);
}

#[test]
fn a_plate_leans_its_tip_and_its_magnets() {
    let plant = plant(
        "[[plate]]\nname = \"plate\"\nmass = 0.05\ninertia = 2e-5\nheight = 0.03\ntip = 0.05\n\
         [[spring]]\nname = \"column\"\nfrom = \"ground\"\nto = \"plate.z\"\nstiffness = 500.0\n\
         [[spring]]\nname = \"lean\"\nfrom = \"ground\"\nto = \"plate.pitch\"\nstiffness = 0.4\n\
         [[damper]]\nname = \"loss\"\nfrom = \"ground\"\nto = \"plate.pitch\"\ndamping = 0.004\n\
         [[actuator]]\nname = \"turn\"\ndrives = \"plate.pitch\"\ninput = \"u_Nm\"\ngain = 1.0\n\
         [[magnet]]\nname = \"north\"\nplate = \"plate\"\nat = [0.0, 0.0, 0.0]\nmoment = 0.1\n\
         [[magnetometer]]\nname = \"hall\"\nat = [0.0, 0.0, 0.0]\n\
         [[sensor]]\nname = \"x\"\nreads = \"plate.tip.x\"\nsignal = \"x_m\"\n\
         [[sensor]]\nname = \"z\"\nreads = \"plate.tip.z\"\nsignal = \"z_m\"\n\
         [[sensor]]\nname = \"bx\"\nreads = \"hall.x\"\nsignal = \"bx_T\"\n\
         [[sensor]]\nname = \"bz\"\nreads = \"hall.z\"\nsignal = \"bz_T\"\n",
    );
    let found = settled(&plant, 0.08);
    let pitch = 0.08 / 0.4f64;
    let near = |found: f64, expected: f64| (found - expected).abs() < 1e-6 * expected.abs();
    assert!(near(found[0], 0.05 * pitch.sin()), "{found:?}");
    assert!(near(found[1], 0.03 + 0.05 * pitch.cos()), "{found:?}");
    // Right below a dipole: 2 k m cos / r^3 along the line to it, -k m sin / r^3 across.
    let unit = 1e-7 * 0.1 / 0.03f64.powi(3);
    assert!(near(found[2], -unit * pitch.sin()), "{found:?}");
    assert!(near(found[3], 2.0 * unit * pitch.cos()), "{found:?}");
}

/// A tip is found once for its three sensors, a field for its own; each must see what it would see
/// alone.
#[test]
fn signals_read_at_once_are_those_read_one_by_one() {
    for name in ["tendon", "hasel"] {
        let file = format!("{}/../rigs/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let plant = Plant::new(&Rig::load(file).unwrap()).unwrap();
        let start: Vec<f64> = (0..plant.state_len())
            .map(|k| 1e-3 * (k + 1) as f64)
            .collect();
        let stepper = Stepper::new(&plant, &plant.values(), &start).unwrap();
        let at_once = stepper.signals();
        assert!(at_once.len() > 5 && at_once.windows(2).all(|pair| pair[0] != pair[1]));
        for (sensor, signal) in at_once.iter().enumerate() {
            assert_eq!(signal.to_bits(), stepper.signal(sensor).to_bits(), "{name}");
        }
    }
}
