//! `summary.json` of an outcome.

use crate::closed_loop::setup::PidRun;
use crate::pipeline::build::{Fitted, Outcome};
use crate::pipeline::summary::{FitError, Found, NetworkError, Summary, Tracking, instructions};
use crate::project::Board;
use sinew_ident::error::Result;
use sinew_ident::fit::pool;

/// `summary.json` of an outcome.
pub fn summary(outcome: &Outcome) -> Summary {
    let of = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
    let pid = |pid: &Result<PidRun>| match pid {
        Ok(PidRun { score, .. }) => (of(&score.rms), of(&score.max), score.outside_limits),
        Err(_) => (f64::NAN, f64::NAN, 0),
    };
    let (pid_rms, pid_max, pid_outside) = pid(&outcome.pid);
    let (informed_pid_rms, informed_pid_max, informed_pid_outside) = pid(&outcome.informed_pid);
    let on_chip = outcome.board != Board::Host;
    Summary {
        format: "sinew-demo/1",
        rig: outcome.name.clone(),
        board: outcome.board.name().into(),
        rate_hz: 1.0 / outcome.task.period_s,
        steps: outcome.mpc.run.t.len(),
        deadline_misses: outcome.mpc.summary.deadline_misses,
        tracking: Tracking {
            model_rig: outcome.model_rig,
            unit: outcome.units.first().cloned().unwrap_or_default(),
            mpc_rms: of(&outcome.mpc.score.rms),
            pid_rms,
            informed_pid_rms,
            mpc_max: of(&outcome.mpc.score.max),
            pid_max,
            informed_pid_max,
        },
        instructions_per_step: on_chip.then(|| instructions(&outcome.mpc.answers)),
        flash_bytes: outcome.sizes.map(|s| s.flash_bytes),
        ram_bytes: outcome.sizes.map(|s| s.ram_bytes),
        stack_bytes: on_chip.then_some(outcome.mpc.summary.stack_high_water_bytes),
        heap_bytes: outcome.sizes.map(|s| s.heap_bytes),
        host_equals_device: outcome.host_equals_device,
        commands_outside_limits: outcome.mpc.score.outside_limits
            + pid_outside
            + informed_pid_outside,
        fit: fit_errors(&outcome.free_runs),
        network: NetworkError {
            parameters: outcome.record.parameters,
            one_step_rms: of(&outcome.record.one_step_rms),
            horizon_rms: of(&outcome.record.horizon_rms),
        },
        diagnosis: found(outcome),
        seconds: outcome.seconds,
    }
}

fn found(outcome: &Outcome) -> Option<Found> {
    let diagnosis = outcome.diagnosis.as_ref()?;
    let fit = diagnosis.fit.get(outcome.outputs.first()?)?;
    let errors = fit.test.unwrap_or(fit.check);
    let kinds: Vec<&str> = (diagnosis.effects.iter())
        .map(|effect| effect.kind.as_str())
        .collect();
    Some(Found {
        hidden: outcome.hidden.clone(),
        found: match kinds[..] {
            [] => diagnosis.verdict.name().to_owned(),
            _ => kinds.join("+"),
        },
        unit: fit.unit.clone(),
        before_rms: errors.before_rms,
        after_rms: errors.after_rms,
    })
}

fn fit_errors(runs: &[Fitted]) -> Vec<FitError> {
    let mut errors = Vec::new();
    for role in ["fit", "test"] {
        let of_role = || runs.iter().filter(|run| run.role == role);
        let before = pool(&of_role().map(|r| r.before.clone()).collect::<Vec<_>>());
        let after = pool(&of_role().map(|r| r.after.clone()).collect::<Vec<_>>());
        for (before, after) in before.into_iter().zip(after) {
            errors.push(FitError {
                signal: before.signal,
                role,
                unit: before.unit,
                as_written_rms: before.rms,
                fitted_rms: after.rms,
            });
        }
    }
    errors
}
