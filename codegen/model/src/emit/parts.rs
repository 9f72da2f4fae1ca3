//! Parts of the emitted controller that the kinds of models do not share.

use sinew_nn::literal;

use crate::spec::ModelSpec;
use crate::work;

/// Text that differs between a model on past readings and one with a state.
pub(super) struct Parts {
    /// Imports beside those of every model.
    pub uses: String,
    /// Settings of the controller.
    pub settings: String,
    /// Types of controller and session, and their constructors.
    pub types: String,
}

/// A list of f32.
pub(super) fn narrow(values: &[f64]) -> String {
    literal::list(values.iter().map(|&x| literal::float(x as f32)))
}

/// The budget of the optimisation, where there is one: an associated constant.
pub(super) fn budget(spec: &ModelSpec) -> Option<String> {
    let ticks = spec.control.budget?;
    let parts = work::parts(spec);
    Some(format!(
        "    const BUDGET: Option<sinew_mpc::Budget> = Some(sinew_mpc::Budget {{
        ticks: {ticks},
        parts: sinew_mpc::Parts {{
            rollout: {},
            derivative: {},
            factorisation: {},
        }},
    }});
",
        parts.rollout, parts.derivative, parts.factorisation
    ))
}
