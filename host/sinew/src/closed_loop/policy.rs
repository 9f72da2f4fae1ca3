//! A policy of `sinew imitate` in a closed loop, run like any other controller.

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_model::policy::{POLICY_FILE, PolicySpec, Runner, load};
use sinew_sim::Plant;

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::reference::Reference;
use crate::closed_loop::scenario::Controller;

/// A policy that controls.
pub struct PolicyController<'a>(Runner<'a>);

impl<'a> PolicyController<'a> {
    /// A policy that has seen nothing, at the safe command.
    pub fn new(spec: &'a PolicySpec) -> Self {
        Self(Runner::new(spec))
    }
}

impl Controller for PolicyController<'_> {
    fn command(
        &mut self,
        k: usize,
        y: &[f64],
        _: &[f64],
        reference: &Reference,
    ) -> Result<Vec<f64>> {
        Ok(self.0.step(y, |j| reference.row(k + j)))
    }
}

/// Reads the policy of a folder, which has to be of this rig's signals, limits and rate.
///
/// # Errors
/// A bad file, or a policy of another rig.
pub fn read(folder: &Path, plant: &Plant, task: &ControlProblem) -> Result<PolicySpec> {
    let spec = load(folder).map_err(Error::refused)?;
    let refuse = |what: &str, found: String, expected: String| {
        Err(Error::file(
            folder.join(POLICY_FILE),
            format!("the policy's {what}: {found}"),
        )
        .expected(format!("as the rig has it, {expected}"))
        .help("teach a policy for this rig: sinew imitate"))
    };
    let list = |names: &[&str]| names.join(", ");
    let found: Vec<&str> = spec.outputs.iter().map(|it| it.name.as_str()).collect();
    let sensors = task.outputs.iter().map(|s| &plant.sensors()[*s]);
    let expected: Vec<&str> = sensors.map(|s| s.column.as_str()).collect();
    if found != expected {
        return refuse("outputs", list(&found), list(&expected));
    }
    let found: Vec<&str> = spec.inputs.iter().map(|it| it.name.as_str()).collect();
    let expected: Vec<&str> = plant.inputs().iter().map(|it| it.column.as_str()).collect();
    if found != expected {
        return refuse("commands", list(&found), list(&expected));
    }
    if (spec.period_s - task.period_s).abs() > 1e-9 {
        let seconds = |s: f64| format!("{s} s");
        return refuse("period", seconds(spec.period_s), seconds(task.period_s));
    }
    for (input, (lower, upper, rate)) in spec.inputs.iter().zip(&task.limits) {
        let own = [input.lower, input.upper, input.rate].map(f64::from);
        if own[0] < *lower || own[1] > *upper || own[2] > *rate {
            let text = |of: [f64; 3]| format!("{} to {}, {} a period", of[0], of[1], of[2]);
            return refuse(
                &format!("limits of `{}`", input.name),
                text(own),
                text([*lower, *upper, *rate]),
            );
        }
    }
    Ok(spec)
}
