//! Inputs of a plant: holds, uneven time, missing samples, tendons that cannot push, and where a
//! simulation starts.

use std::ops::ControlFlow;

use crate::mechanisms::{RAMP, distance, effect, plant, run, slide, times};
use sinew_sim::{InputTrajectory, SimulationError, Stepper};

const HELD: &str =
    "[[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\ngain = 2.0\n";

/// A fit ends the simulation of what has lost: no row after, and up to there the same bits.
#[test]
fn a_simulation_that_is_broken_off_has_seen_the_same_rows_up_to_there() {
    let plant = slide(0.2, -0.3, HELD);
    let times = times(50, 0.01);
    let drive = InputTrajectory::new(&plant, times.len(), &[&vec![1.5; 50]]).unwrap();
    let values = plant.values();
    let start = [0.2, -0.3];
    let whole = plant.simulate(&values, &start, &drive, &times).unwrap();
    let mut seen = Vec::new();
    let end = plant
        .simulate_until(&values, &start, &drive, &times, |row, at| {
            seen.push(at.signal(0).to_bits());
            if row == 20 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .unwrap();
    let same: Vec<u64> = (0..=20).map(|row| whole.signal(row, 0).to_bits()).collect();
    assert_eq!(seen, same);
    assert!(end.report().substeps < whole.report.substeps);
}

/// On a free mass of 1 kg a force that is held gives pieces of parabolas, a force that goes
/// linearly pieces of cubics; both exact at uneven times.
#[test]
fn holds_are_exact_for_a_free_mass_at_uneven_times() {
    let times = [0.0, 0.1, 0.15, 0.4, 0.41, 1.0];
    let force = [1.0, -2.0, 4.0, 0.5, 3.0, 7.0];
    for linear in [false, true] {
        let actuator = if linear {
            RAMP.replace("{ value = 1.0 }", "2.0")
        } else {
            HELD.to_owned()
        };
        let run = run(&slide(0.2, -0.3, &actuator), &times, &[&force]);
        let (mut q, mut v) = (0.2, -0.3);
        for row in 1..times.len() {
            let h = times[row] - times[row - 1];
            let a = 2.0 * force[row - 1];
            let jerk = if linear {
                2.0 * (force[row] - force[row - 1]) / h
            } else {
                0.0
            };
            q += v * h + a * h * h / 2.0 + jerk * h * h * h / 6.0;
            v += a * h + jerk * h * h / 2.0;
            assert!(
                (run.signal(row, 0) - q).abs() < 1e-14,
                "row {row}, linear {linear}"
            );
            assert!(
                (run.signal(row, 1) - v).abs() < 1e-14,
                "row {row}, linear {linear}"
            );
        }
    }
}

#[test]
fn a_missing_input_holds_its_last_value_and_is_counted() {
    let plant = slide(0.0, 0.0, HELD);
    let times = times(6, 0.1);
    let holes = [f64::NAN, 1.0, f64::NAN, f64::NAN, -2.0, f64::NAN];
    let drive = InputTrajectory::new(&plant, 6, &[&holes]).unwrap();
    assert_eq!(drive.held(), [4]);
    let with_holes = run(&plant, &times, &[&holes]);
    let filled = run(&plant, &times, &[&[1.0, 1.0, 1.0, 1.0, -2.0, -2.0]]);
    assert_eq!(with_holes.signals, filled.signals);
    assert!(filled.signal(5, 0).abs() > 0.1);
    let nothing = InputTrajectory::new(&plant, 6, &[&[f64::NAN; 6]]).unwrap_err();
    assert_eq!(
        nothing.to_string(),
        "input column `u_N` has no valid sample to hold"
    );
}

/// A mass between the ground and a tendon: it swings as if on a spring while the tendon is taut and
/// flies freely while it is slack; a bilateral tendon pushes.
#[test]
fn a_unilateral_tendon_pulls_and_never_pushes() {
    let tendon = |more: &str| {
        format!(
            "[[tendon]]\nname = \"line\"\npath = [{{ body = \"mass\", arm = 1.0 }}]\n\
             stiffness = 100.0\n{more}\
             [[sensor]]\nname = \"gauge\"\nreads = \"line.tension\"\nsignal = \"t_N\"\n"
        )
    };
    let times = times(401, 0.001);
    let pulls = run(&slide(0.1, 0.0, &tendon("")), &times, &[]);
    let pushes = run(
        &slide(0.1, 0.0, &tendon("unilateral = false\n")),
        &times,
        &[],
    );
    let quarter = std::f64::consts::PI / 20.0;
    let exact = |t: &f64| {
        if *t < quarter {
            0.1 * (10.0 * t).cos()
        } else {
            -(t - quarter)
        }
    };
    let error = distance(&pulls.column(0), times.iter().map(exact));
    assert!(error < 2e-7, "{error:e}");
    let error = distance(
        &pushes.column(0),
        times.iter().map(|t| 0.1 * (10.0 * t).cos()),
    );
    assert!(error < 1e-8, "{error:e}");
    assert!(pulls.column(2).iter().all(|t| *t >= 0.0) && pulls.signal(0, 2) == 10.0);
    assert_eq!(pulls.signal(400, 2), 0.0);
    assert!(pushes.column(2).iter().any(|t| *t < -9.0));
}

/// T = pretension + stiffness (sum arm q - gain u) + damping sum arm v, and -arm T on each body.
#[test]
fn a_tendon_over_two_bodies_is_the_contract_s() {
    let plant = plant(
        "[[body]]\nname = \"a\"\nmotion = \"hinge\"\ninertia = 0.5\n\
         [[body]]\nname = \"b\"\nmotion = \"slide\"\ninertia = 2.0\n\
         [[tendon]]\nname = \"line\"\npath = [{ body = \"a\", arm = 0.02 }, { body = \"b\", arm = -1.0 }]\n\
         stiffness = 300.0\ndamping = 4.0\npretension = 5.0\n\
         [[actuator]]\nname = \"winch\"\ndrives = \"line\"\ninput = \"u_V\"\ngain = -0.01\n\
         [[sensor]]\nname = \"gauge\"\nreads = \"line.tension\"\nsignal = \"t_N\"\n\
         gain = 2.0\noffset = 1.0\n",
    );
    let state = [0.7, -0.1, 1.5, 0.2];
    let mut stepper = Stepper::new(&plant, &plant.values(), &state).unwrap();
    let h = 1e-7;
    stepper.advance(h, &[3.0]).unwrap();
    let tension = 5.0 + 300.0 * (0.02 * 0.7 + 0.1 + 0.01 * 3.0) + 4.0 * (0.02 * 1.5 - 0.2);
    let end = stepper.state();
    let (a, b) = ((end[2] - 1.5) / h, (end[3] - 0.2) / h);
    assert!((a - (-0.02 * tension / 0.5)).abs() < 1e-4, "{a}");
    assert!((b - (1.0 * tension / 2.0)).abs() < 1e-3, "{b}");
    assert!((stepper.signal(0) - (2.0 * tension + 1.0)).abs() < 1e-3);
}

#[test]
fn a_simulation_starts_where_the_recording_or_the_rig_says() {
    let plant = plant(
        "[[body]]\nname = \"a\"\nmotion = \"slide\"\ninertia = 1.0\n\
         [[body]]\nname = \"b\"\nmotion = \"slide\"\ninertia = 1.0\nstart = 0.5\nstart_velocity = 2.0\n\
         [[body]]\nname = \"c\"\nmotion = \"slide\"\ninertia = 1.0\n\
         [[sensor]]\nname = \"qa\"\nreads = \"a.position\"\nsignal = \"a_mm\"\nunit = \"mm\"\n\
         gain = -2.0\noffset = 0.25\n\
         [[sensor]]\nname = \"qb\"\nreads = \"b.position\"\nsignal = \"b_m\"\n",
    );
    assert_eq!(plant.sensors()[0].column_factor, 1e-3);
    let nan = f64::NAN;
    let recording = [vec![nan, 1.25, 9.0], vec![7.0, 7.0, 7.0]];
    let signals: Vec<&[f64]> = recording.iter().map(Vec::as_slice).collect();
    let run = plant
        .simulate_recording(&[5.0, 5.1, 5.2], &[], &signals)
        .unwrap();
    assert_eq!(run.start, [-0.5, 0.5, 0.0, 0.0, 2.0, 0.0]);
    assert_eq!(run.trajectory.signal(0, 0), 1.25);
    assert!((run.trajectory.signal(2, 1) - 0.9).abs() < 1e-12);
    let names = plant.state_names();
    assert_eq!(
        (names[1].as_str(), names[4].as_str()),
        ("b.position", "b.velocity")
    );
}

#[test]
fn a_stepper_and_a_simulation_are_the_same_to_the_bit() {
    let friction = effect("coulomb_friction", "mass", &[("level", 0.4)]);
    let plant = slide(
        0.1,
        0.0,
        &format!("{}{HELD}{friction}", crate::mechanisms::SPRING),
    );
    let times = times(200, 0.01);
    let force: Vec<f64> = times.iter().map(|t| (7.0 * t).sin()).collect();
    let run = run(&plant, &times, &[&force]);
    assert!(run.report.events > 1);
    let mut stepper = Stepper::new(&plant, &plant.values(), &[0.1, 0.0]).unwrap();
    for row in 1..times.len() {
        let dt = times[row] - times[row - 1];
        stepper.advance(dt, &[force[row - 1]]).unwrap();
        assert_eq!(stepper.signals(), [run.signal(row, 0), run.signal(row, 1)]);
    }
}

/// Sub-steps follow from the stiffness; a rig beyond reason is refused with the body's name. A stop
/// that is never met: without one the rig is linear, and there are no sub-steps.
#[test]
fn substeps_follow_the_fastest_rate_and_a_rig_too_stiff_is_refused() {
    let place = [("position", 1.0), ("stiffness", 1.0), ("damping", 0.0)];
    let far = effect("end_stop", "mass", &place) + "side = 1.0\n";
    let stiff = |stiffness: f64| {
        slide(
            0.001,
            0.0,
            &format!(
                "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\n\
                 stiffness = {stiffness:?}\n{far}"
            ),
        )
    };
    let times = times(121, 1.0 / 120.0);
    let run = run(&stiff(1e8), &times, &[]);
    assert!((run.report.rate - 1e4).abs() < 1e-6);
    // 1e4 / 120 / 0.1 = 833, hence 1024.
    assert_eq!(run.report.most_substeps, 1024);
    let exact = times.iter().map(|t| 0.001 * (1e4 * t).cos());
    let error = distance(&run.column(0), exact);
    assert!(error < 0.001 * 0.1, "{error:e}");
    let plant = stiff(1e14);
    let drive = InputTrajectory::new(&plant, 121, &[]).unwrap();
    let refused = plant
        .simulate(&plant.values(), &[0.001, 0.0], &drive, &times)
        .unwrap_err();
    assert!(matches!(&refused, SimulationError::TooStiff { at, .. } if at.body == "mass"));
    assert!(refused.to_string().contains("1.000e7 1/s"), "{refused}");
}

/// A stiffening spring is watched along the way: the rate at its rest is not the rate at its end.
#[test]
fn a_stiffening_spring_gets_more_substeps_where_it_is_stiff() {
    let cubic = effect("cubic_stiffness", "coil", &[("coefficient", 1e6)]);
    let plant = slide(0.0, 3.0, &format!("{}{cubic}", crate::mechanisms::SPRING));
    let times = times(200, 0.01);
    let run = run(&plant, &times, &[]);
    assert!(run.report.most_substeps > 8, "{:?}", run.report);
    let energy = |row: usize| {
        let (q, v) = (run.signal(row, 0), run.signal(row, 1));
        0.5 * v * v + 20.0 * q * q + 0.25e6 * q.powi(4)
    };
    for row in 0..200 {
        assert!((energy(row) / energy(0) - 1.0).abs() < 1e-4, "row {row}");
    }
}

#[test]
fn what_cannot_be_simulated_is_refused_with_the_reason() {
    let plant = slide(0.0, 0.0, HELD);
    let times = times(3, 0.1);
    let drive = InputTrajectory::new(&plant, 3, &[&[1.0; 3]]).unwrap();
    let values = plant.values();
    let refuse = |values: &[f64], start: &[f64], times: &[f64]| {
        let refused = plant.simulate(values, start, &drive, times).unwrap_err();
        refused.to_string()
    };
    let mut massless = values.clone();
    massless[plant.slot("mass.inertia").unwrap()] = 0.0;
    let mut nan = values.clone();
    nan[plant.slot("push.gain").unwrap()] = f64::NAN;
    let still = [0.0, 0.0];
    let report = [
        refuse(&massless, &still, &times),
        refuse(&nan, &still, &times),
        refuse(&values, &[0.0], &times),
        refuse(&values, &[0.0, f64::INFINITY], &times),
        refuse(&values, &still, &[0.0, 0.1, 0.1]),
        refuse(&values[1..], &still, &times),
        InputTrajectory::new(&plant, 3, &[])
            .unwrap_err()
            .to_string(),
        InputTrajectory::new(&plant, 3, &[&[1.0; 2]])
            .unwrap_err()
            .to_string(),
        {
            let mut unstable = values.clone();
            unstable[plant.slot("push.gain").unwrap()] = 1e308;
            refuse(&unstable, &[0.0, 1.75e308], &times)
        },
    ];
    insta::assert_snapshot!(report.join("\n"));
}
