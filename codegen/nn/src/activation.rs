//! Activations, element by element.

use super::NetworkError;

/// The names that importers know, for messages: some are several layers.
const NAMES: [&str; 27] = [
    "linear",
    "relu",
    "leaky_relu",
    "elu",
    "selu",
    "gelu",
    "softplus",
    "softsign",
    "swish",
    "silu",
    "hard_sigmoid",
    "sigmoid",
    "tanh",
    "exponential",
    "softmax",
    "log_softmax",
    "relu6",
    "hard_swish",
    "hard_tanh",
    "mish",
    "celu",
    "log_sigmoid",
    "tanh_shrink",
    "soft_shrink",
    "squareplus",
    "sparse_plus",
    "sparse_sigmoid",
];

/// SELU's constants (Klambauer et al., 2017).
const SELU_ALPHA: f32 = 1.673_263_2;
const SELU_SCALE: f32 = 1.050_701;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// `z`.
    Linear,
    /// `max(0, z)`.
    Relu,
    /// `z` where positive, else `alpha z`.
    LeakyRelu {
        /// Slope on the negative side.
        alpha: f32,
    },
    /// `scale z` where positive, else `scale alpha (exp(z) - 1)`.
    Elu {
        /// Minus the limit on the negative side, before the scale.
        alpha: f32,
        /// Slope on the positive side.
        scale: f32,
    },
    /// `z Phi(z)`.
    Gelu,
    /// `z / 2 (1 + tanh(sqrt(2 / pi) (z + 0.044715 z^3)))`.
    GeluTanh,
    /// `ln(1 + exp(z))`.
    Softplus,
    /// `z / (1 + |z|)`.
    Softsign,
    /// `z sigmoid(z)`.
    Swish,
    /// `alpha z + beta`, held between 0 and 1.
    HardSigmoid {
        /// Slope.
        alpha: f32,
        /// Value at 0.
        beta: f32,
    },
    /// `min(max(z, low), high)`.
    Clip {
        /// Smallest value; minus infinity if there is none.
        low: f32,
        /// Largest value; infinity if there is none.
        high: f32,
    },
    /// `1 / (1 + exp(-z))`.
    Sigmoid,
    /// `tanh z`.
    Tanh,
    /// `exp(z)`.
    Exponential,
    /// `ln(z)`.
    Logarithm,
    /// `sqrt(z)`.
    Root,
    /// `1 / z`.
    Reciprocal,
}

impl Activation {
    /// SELU.
    pub const SELU: Self = Self::Elu {
        alpha: SELU_ALPHA,
        scale: SELU_SCALE,
    };

    /// The activation that Keras calls so, with its default parameters; `softmax` is a layer of its
    /// own.
    ///
    /// ```
    /// use sinew_nn::Activation;
    ///
    /// assert_eq!(Activation::named("dense_1", "relu"), Ok(Activation::Relu));
    /// let error = Activation::named("dense_1", "rellu").unwrap_err().to_string();
    /// assert!(error.contains("relu"), "{error}");
    /// ```
    ///
    /// # Errors
    /// [`NetworkError::Unsupported`], naming `layer` and the nearest name.
    pub fn named(layer: &str, name: &str) -> Result<Self, NetworkError> {
        Ok(match name {
            "linear" => Self::Linear,
            "relu" => Self::Relu,
            "leaky_relu" => Self::LeakyRelu { alpha: 0.2 },
            "elu" => Self::Elu {
                alpha: 1.0,
                scale: 1.0,
            },
            "selu" => Self::SELU,
            "gelu" => Self::Gelu,
            "softplus" => Self::Softplus,
            "softsign" => Self::Softsign,
            "swish" | "silu" => Self::Swish,
            "hard_sigmoid" => Self::HardSigmoid {
                alpha: 1.0 / 6.0,
                beta: 0.5,
            },
            "sigmoid" => Self::Sigmoid,
            "tanh" => Self::Tanh,
            "exponential" | "exp" => Self::Exponential,
            other => {
                let nearest = match other {
                    "relu6" | "hard_swish" | "hard_silu" => "relu",
                    "mish" => "swish",
                    "hard_tanh" => "tanh",
                    "celu" => "elu",
                    "log_sigmoid" => "softplus",
                    _ => {
                        return Err(NetworkError::unsupported(
                            layer,
                            format!("the activation {other:?}"),
                            format!("use one of {}", NAMES.join(", ")),
                        ));
                    }
                };
                return Err(NetworkError::unsupported(
                    layer,
                    format!("the activation {other:?}"),
                    format!("the nearest is {nearest:?}"),
                ));
            }
        })
    }

    /// Returns true if the slope is a function of the value alone; otherwise the emitted code keeps
    /// both.
    #[must_use]
    pub fn slope_from_value(self) -> bool {
        match self {
            Self::Gelu | Self::GeluTanh | Self::Swish | Self::Softplus | Self::Logarithm => false,
            // The sign of the value is that of `z` with these alone.
            Self::LeakyRelu { alpha } => alpha >= 0.0,
            Self::Elu { alpha, scale } => alpha >= 0.0 && scale > 0.0,
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Otherwise the emitted code would take the sign of `z` from a value that has another.
    #[test]
    fn the_value_says_the_sign_only_where_no_parameter_is_negative() {
        let leaky = |alpha| Activation::LeakyRelu { alpha }.slope_from_value();
        assert!(leaky(0.2) && leaky(0.0) && !leaky(-0.1) && !leaky(f32::NAN));
        let elu = |alpha, scale| Activation::Elu { alpha, scale }.slope_from_value();
        assert!(elu(1.0, 1.0) && !elu(-1.0, 1.0) && !elu(1.0, -1.0));
    }
}
