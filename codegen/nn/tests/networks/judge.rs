//! Outputs of the programs against double precision.

use std::process::Command;

use sinew_nn::target::{self, TARGET};
use sinew_nn::{Network, evaluate};

use super::bench::{Case, Said, Workspace, weight};

/// Largest errors of one network, relative to the range or to the largest.
#[derive(Debug)]
pub struct Errors {
    pub name: String,
    pub output: f64,
    pub jacobian: f64,
    pub curvature: f64,
    pub said: Said,
}

/// Runs the cases on the host and, where this machine can, those that ask for it in QEMU, where the
/// bits are to be the same.
pub fn judge(workspace: &Workspace, cases: &[Case]) -> Vec<Errors> {
    let qemu = Command::new("qemu-system-arm")
        .arg("--version")
        .output()
        .is_ok();
    let qemu = qemu && target::is_installed();
    // Each is one compiler for most of its time.
    let (mut said, qemu) = std::thread::scope(|scope| {
        let qemu = qemu.then(|| scope.spawn(|| workspace.qemu()));
        let said = workspace.host();
        let join = |thread: std::thread::ScopedJoinHandle<'_, _>| {
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        (said, qemu.map(join))
    });
    if let Some(mut qemu) = qemu {
        assert_eq!(qemu.len(), cases.iter().filter(|case| case.in_qemu).count());
        for case in cases.iter().filter(|case| case.in_qemu) {
            let name = &case.network.name;
            let (host, qemu) = (
                &said[name],
                qemu.get_mut(name).expect("the image ran to its end"),
            );
            let cost = std::mem::take(&mut qemu.cost);
            let same = |a: &[Vec<f32>], b: &[Vec<f32>]| {
                a.len() == b.len()
                    && a.iter()
                        .flatten()
                        .zip(b.iter().flatten())
                        .all(|(a, b)| a.to_bits() == b.to_bits())
            };
            assert!(
                same(&host.y, &qemu.y),
                "{name}: outputs differ in their bits"
            );
            assert!(
                same(&host.jacobian, &qemu.jacobian),
                "{name}: derivatives differ in their bits"
            );
            said.get_mut(name)
                .expect("every network has an answer")
                .cost = cost;
        }
    } else {
        use std::io::Write as _;
        // Not eprintln!, which the test harness swallows.
        let text = format!("\nSKIPPED: QEMU, or cargo for {TARGET}, is not here\n");
        std::io::stderr()
            .write_all(text.as_bytes())
            .expect("standard error");
    }
    cases
        .iter()
        .map(|case| errors(case, &said[&case.network.name]))
        .collect()
}

fn errors(case: &Case, said: &Said) -> Errors {
    let network = &case.network;
    let name = &network.name;
    let last: Vec<(Vec<f64>, Vec<f64>)> =
        case.inputs.iter().map(|x| last_call(network, x)).collect();
    let expected: Vec<Vec<f64>> = last
        .iter()
        .map(|(x, state)| evaluate::call(network, x, state).y)
        .collect();
    let range = range(&expected);
    assert!(range > 1e-3, "{name}: the output stands still");
    let mut output = 0.0_f64;
    for (found, expected) in said.y.iter().flatten().zip(expected.iter().flatten()) {
        output = worst(output, (f64::from(*found) - expected) / range);
    }
    let mut jacobian = 0.0_f64;
    for ((x, state), found) in last.iter().zip(&said.jacobian) {
        let exact = evaluate::jacobian(network, x, state);
        let largest = exact.iter().flatten().fold(0.0_f64, |m, d| m.max(d.abs()));
        assert!(
            largest > 1e-4,
            "{name}: gradient vanished: this point tests nothing"
        );
        // Variable by variable, result by result.
        let by_variable = (0..exact[0].len()).flat_map(|v| exact.iter().map(move |row| row[v]));
        for (found, expected) in found.iter().zip(by_variable) {
            jacobian = worst(jacobian, (f64::from(*found) - expected) / largest);
        }
    }
    let mut curvature = 0.0;
    if case.curvature {
        let first = network.inputs();
        let x: Vec<f64> = case.inputs[0][..first].iter().map(|&x| x.into()).collect();
        let weights: Vec<f64> = (0..network.outputs() + network.state())
            .map(|r| weight(r).into())
            .collect();
        let exact = evaluate::curvature(network, &x, &vec![0.0; network.state()], &weights);
        let largest = exact.iter().flatten().fold(1e-2_f64, |m, d| m.max(d.abs()));
        assert_eq!(said.curvature.len(), exact.len() * exact.len(), "{name}");
        for (found, expected) in said.curvature.iter().zip(exact.iter().flatten()) {
            curvature = worst(curvature, (f64::from(*found) - expected) / largest);
        }
    }
    Errors {
        name: name.clone(),
        output,
        jacobian,
        curvature,
        said: said.clone(),
    }
}

/// The last of the calls, and the state before it.
fn last_call(network: &Network, x: &[f32]) -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = x.iter().copied().map(f64::from).collect();
    let mut calls: Vec<&[f64]> = x.chunks(network.inputs()).collect();
    let last = calls.pop().expect("an input has a call");
    let mut state = vec![0.0; network.state()];
    for x in calls {
        state = evaluate::call(network, x, &state).state;
    }
    (last.to_vec(), state)
}

/// From the smallest to the largest of all outputs.
pub fn range(outputs: &[Vec<f64>]) -> f64 {
    let fold = |start, f: fn(f64, f64) -> f64| outputs.iter().flatten().copied().fold(start, f);
    fold(f64::NEG_INFINITY, f64::max) - fold(f64::INFINITY, f64::min)
}

/// The larger error; a NaN is the largest.
pub fn worst(before: f64, error: f64) -> f64 {
    if error.abs() <= before {
        before
    } else {
        error.abs()
    }
}
