//! Activations, element by element.

mod clip;
mod elu;
mod exponential;
mod gelu;
mod hard_sigmoid;
mod leaky_relu;
mod linear;
mod logarithm;
mod reciprocal;
mod relu;
mod root;
mod sigmoid;
mod softplus;
mod softsign;
mod swish;
mod tanh;

pub use clip::Clip;
pub use elu::Elu;
pub use exponential::Exponential;
pub use gelu::{Gelu, GeluTanh};
pub use hard_sigmoid::HardSigmoid;
pub use leaky_relu::LeakyRelu;
pub use linear::Linear;
pub use logarithm::Logarithm;
pub use reciprocal::Reciprocal;
pub use relu::Relu;
pub use root::Root;
pub use sigmoid::Sigmoid;
pub use softplus::Softplus;
pub use softsign::Softsign;
pub use swish::Swish;
pub use tanh::Tanh;
