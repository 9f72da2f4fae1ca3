//! Between the reading and the recorded signal (docs/explanation/plant.md, eq. 17).

use super::{
    Description, Effect, Energy, Explanation, Family, Port, Quantity, Scales, Sign, parameter,
    strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Sensor,
    ports: &[Port::Sensor],
    energy: Energy::Outside,
    law: "",
    equation: "17",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// `time_constant y' = r - y`, after the curvature (eq. 17b).
pub(super) struct Lag;

impl Effect for Lag {
    const DESCRIPTION: Description = Description {
        kind: "sensor_lag",
        law: "time_constant y' = r - y",
        equation: "17b",
        parameters: &[parameter(
            "time_constant",
            Quantity::Time,
            Sign::NonNegative,
        )],
        confusable: &["actuator_lag", "input_delay"],
        excited_by: "fast motion that another sensor sees as well, or a start at rest",
        sentence: "The sensor {component} follows its reading with a lag of {time_constant} that \
                   the model does not have.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A filter in the sensor or its driver: a moving average, an anti-aliasing filter, a \
                thermal mass.",
        parameters: &[(
            "time_constant",
            "time in which the reading reaches 63 % of a step",
        )],
        next: "Measure the motion with a second sensor, or start from rest. Turn off filters of \
               the driver, or state the lag in the rig.",
    };

    /// A lag that does not end is a slow drift under another name.
    fn plausible(p: &[f64], duration: f64) -> bool {
        p[0] < duration
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![2.0 * scales.interval], vec![0.2 * scales.time]]
    }
}

/// `y = r + quadratic r^2 + cubic r^3` (eq. 17a).
pub(super) struct Curvature;

impl Effect for Curvature {
    const DESCRIPTION: Description = Description {
        kind: "sensor_curvature",
        law: "y = r + quadratic r^2 + cubic r^3",
        equation: "17a",
        parameters: &[
            strength("quadratic", Quantity::PerReading, Sign::Any),
            strength("cubic", Quantity::PerReadingSquared, Sign::Any),
        ],
        confusable: &["cubic_stiffness", "quadratic_stiffness"],
        excited_by: "small and large readings of both signs",
        sentence: "The sensor {component} is not linear: {quadratic} and {cubic} are missing from \
                   the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A sensor that is not linear: a Hall or stretch sensor, a potentiometer under load, \
                a lever arm.",
        parameters: &[
            ("quadratic", "quadratic part, over the unit of the reading"),
            ("cubic", "cubic part, over its square"),
        ],
        next: "Calibrate the sensor at five static positions. A spring that is not linear changes \
               the motion, a sensor only its reading.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let one = 0.1 / scales.reading;
        let two = one / scales.reading;
        vec![vec![one, 0.0], vec![-one, 0.0], vec![0.0, two]]
    }
}

/// The curve (eq. 17a).
#[inline]
pub(crate) fn curve<S: Scalar>(p: &[S], reading: S) -> S {
    reading + reading * reading * (p[0] + p[1] * reading)
}
