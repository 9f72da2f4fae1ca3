//! Coordinates that the rig does not have (docs/explanation/plant.md, eq. 16).

use super::{Description, Effect, Energy, Family, Port, Quantity, Scales, Sign, parameter};

/// An unmodelled mass on a spring and a damper (eq. 16). The plant makes it a body of its own, which
/// starts with its host.
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
            parameter("inertia", Quantity::Inertia, Sign::Positive),
            parameter("stiffness", Quantity::Stiffness, Sign::NonNegative),
            parameter("damping", Quantity::Damping, Sign::NonNegative),
        ],
        confusable: &["viscoelastic_creep", "cross_coupling", "sensor_lag"],
        excited_by: "fast steps and chirps through its resonance",
        sentence: "{component} carries a mass of {inertia} on a spring of {stiffness} and a damper \
                   of {damping} that the model does not have.",
    };

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
