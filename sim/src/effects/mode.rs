//! Coordinates that the rig does not have (docs/explanation/plant.md, eq. 16).

use super::{
    Description, Effect, Energy, Explanation, Family, ParameterSpec, Port, Quantity, Scales, Sign,
    strength,
};

/// An unmodelled mass on a spring and a damper (eq. 16). The plant makes it a body of its own,
/// which starts with its host.
pub(super) struct HiddenMode;

impl Effect for HiddenMode {
    const DESCRIPTION: Description = Description {
        kind: "hidden_mode",
        family: Family::Mode,
        ports: &[Port::Body],
        energy: Energy::Dissipates,
        law: "inertia x'' = F = stiffness (q - x) + damping (v - x'), -F on the body",
        equation: "16",
        parameters: &[
            // Without its inertia a mode pushes nothing, whatever holds and damps it.
            ParameterSpec {
                zero_means_absent: true,
                ..strength("inertia", Quantity::Inertia, Sign::Positive)
            },
            ParameterSpec {
                zero_means_absent: false,
                ..strength("stiffness", Quantity::Stiffness, Sign::NonNegative)
            },
            ParameterSpec {
                zero_means_absent: false,
                ..strength("damping", Quantity::Damping, Sign::NonNegative)
            },
        ],
        confusable: &["viscoelastic_creep", "cross_coupling", "sensor_lag"],
        excited_by: "fast steps and chirps through its resonance",
        sentence: "{component} carries a mass of {inertia} on a spring of {stiffness} and a damper \
                   of {damping} that the model does not have.",
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A mass on a spring that the rig does not have: a payload that swings, a shaft, a \
                sensor bracket, a flexible link.",
        parameters: &[
            ("inertia", "inertia that is carried"),
            (
                "stiffness",
                "stiffness of its spring; with the inertia it gives the resonance",
            ),
            ("damping", "damping between it and the body"),
        ],
        next: "Record a chirp through the resonance. If the frequency is that of a known part, \
               model the part as a body and a spring.",
    };

    /// A mode that does not swing once is a slow drift under another name.
    fn plausible(p: &[f64], duration: f64) -> bool {
        std::f64::consts::TAU * (p[0] / p[1]).sqrt() < duration
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let start = |share: f64, periods: f64| {
            let inertia = share * scales.inertia;
            let omega = std::f64::consts::TAU / (periods * scales.time);
            let damping = 0.1 * inertia * omega;
            vec![inertia, inertia * omega * omega, damping]
        };
        vec![
            start(0.2, 0.3),
            start(0.2, 1.0),
            start(0.2, 3.0),
            start(0.5, 1.0),
        ]
    }
}
