//! Between the recorded input and the force (docs/explanation/plant.md, eq. 14).

use super::{
    Description, Effect, Energy, Explanation, Family, Port, Quantity, Scales, Sign, parameter,
    strength,
};

const BASE: Description = Description {
    kind: "",
    family: Family::Actuator,
    ports: &[Port::Actuator],
    energy: Energy::Outside,
    law: "",
    equation: "14",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// `y = u(t - delay)` (eq. 14a).
pub(super) struct Delay;

impl Effect for Delay {
    const DESCRIPTION: Description = Description {
        kind: "input_delay",
        law: "y = u(t - delay)",
        equation: "14a",
        parameters: &[parameter("delay", Quantity::Time, Sign::NonNegative)],
        confusable: &["actuator_lag", "sensor_lag"],
        excited_by: "steps and fast changes of the input",
        sentence: "The input of {component} acts {delay} later than the model says.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Dead time between the recorded command and its action: a bus, a sample-and-hold, a \
                driver, fluid in a line.",
        parameters: &[("delay", "dead time")],
        next: "Compare the time stamps of command and measurement with sinew check. Record steps \
               at a sampling interval below the delay; a lag bends the onset, a delay shifts it.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![1.5 * scales.interval], vec![0.1 * scales.time]]
    }
}

/// `time_constant y' = u - y` (eq. 14e).
pub(super) struct Lag;

impl Effect for Lag {
    const DESCRIPTION: Description = Description {
        kind: "actuator_lag",
        law: "time_constant y' = u - y",
        equation: "14e",
        parameters: &[parameter(
            "time_constant",
            Quantity::Time,
            Sign::NonNegative,
        )],
        confusable: &["input_delay", "sensor_lag"],
        excited_by: "steps and fast changes of the input",
        sentence: "The actuator {component} follows its input with a lag of {time_constant} that \
                   the model does not have.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Dynamics between command and force: inductance, a current loop, a valve, heating.",
        parameters: &[(
            "time_constant",
            "time in which the force reaches 63 % of a step",
        )],
        next: "Record steps of the input with a sampling interval below the time constant. A \
               sensor lag delays the reading of every motion, an actuator lag only forced \
               motion.",
    };

    /// A lag that does not end is a slow drift under another name.
    fn plausible(p: &[f64], duration: f64) -> bool {
        p[0] < duration
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![2.0 * scales.interval], vec![0.2 * scales.time]]
    }
}

/// `y = sign(u) max(0, |u| - width)` (eq. 14b).
pub(super) struct DeadZone;

impl Effect for DeadZone {
    const DESCRIPTION: Description = Description {
        kind: "input_dead_zone",
        law: "y = sign(u) max(0, |u| - width)",
        equation: "14b",
        parameters: &[strength("width", Quantity::Input, Sign::NonNegative)],
        confusable: &["coulomb_friction", "backlash", "input_curvature"],
        excited_by: "small inputs of both signs as well as large ones",
        sentence: "The actuator {component} does nothing below {width} of its input.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A valve with overlap, a stage with crossover, a PWM that is too short to switch. \
                Small commands have no force.",
        parameters: &[(
            "width",
            "largest input without force, in the unit of the input",
        )],
        next: "Sweep the input slowly through zero while the body moves. Dry friction stops a \
               moving body as well, a dead zone does not.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.05 * scales.input], vec![0.3 * scales.input]]
    }
}

/// `y = u + coefficient u |u|` (eq. 14c).
pub(super) struct Curvature;

impl Effect for Curvature {
    const DESCRIPTION: Description = Description {
        kind: "input_curvature",
        law: "y = u + coefficient u |u|",
        equation: "14c",
        parameters: &[strength("coefficient", Quantity::PerInput, Sign::Any)],
        confusable: &["input_saturation", "input_dead_zone"],
        excited_by: "small and large inputs of both signs",
        sentence: "The force of {component} is not proportional to its input: a curvature of \
                   {coefficient} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Force that is not proportional to the command: magnetic saturation, a supply that \
                sags, an electrostatic drive, a valve characteristic.",
        parameters: &[(
            "coefficient",
            "change of the gain per unit of the input; negative where the gain falls",
        )],
        next: "Record steps of several sizes and both signs. A gain that falls only at the largest \
               inputs is saturation.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.2 / scales.input], vec![-0.2 / scales.input]]
    }
}

/// `y = min(limit, max(-limit, u))` (eq. 14d).
pub(super) struct Saturation;

impl Effect for Saturation {
    const DESCRIPTION: Description = Description {
        kind: "input_saturation",
        law: "y = min(limit, max(-limit, u))",
        equation: "14d",
        parameters: &[parameter("limit", Quantity::Input, Sign::NonNegative)],
        confusable: &["input_curvature", "end_stop"],
        excited_by: "inputs up to the largest that is allowed",
        sentence: "The actuator {component} saturates at {limit} of its input.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A limit of the driver, supply or valve below the one that the command has. Larger \
                commands change nothing.",
        parameters: &[("limit", "largest input that acts, in the unit of the input")],
        next: "Read the limit of the driver. Then set the limits of the actuator in the rig, so \
               that a controller does not rely on more.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.8 * scales.input], vec![0.4 * scales.input]]
    }
}
