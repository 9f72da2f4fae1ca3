//! `loop.csv`.

use crate::closed_loop::scenario::Run;
use crate::pipeline::build::Outcome;

/// The loop as a recording: time, reference, output and command of the MPC and of the PID tuned on
/// the plant.
pub(super) fn loop_csv(outcome: &Outcome) -> String {
    let mut text = String::from("t");
    for name in &outcome.outputs {
        text += &format!(",ref_{name},mpc_{name},pid_{name}");
    }
    for name in &outcome.inputs {
        text += &format!(",mpc_{name},pid_{name}");
    }
    text.push('\n');
    let mpc = &outcome.mpc.run;
    let pid = outcome.pid.as_ref().ok();
    let of_pid = |of: fn(&Run) -> &Vec<Vec<f64>>, k: usize, i: usize| {
        pid.and_then(|p| of(&p.run).get(k))
            .map_or(String::new(), |row| row[i].to_string())
    };
    for k in 0..mpc.t.len() {
        text += &mpc.t[k].to_string();
        for i in 0..outcome.outputs.len() {
            text += &format!(
                ",{},{},{}",
                mpc.reference[k][i],
                mpc.y[k][i],
                of_pid(|r| &r.y, k, i)
            );
        }
        for i in 0..outcome.inputs.len() {
            text += &format!(",{},{}", mpc.u[k][i], of_pid(|r| &r.u, k, i));
        }
        text.push('\n');
    }
    text
}
