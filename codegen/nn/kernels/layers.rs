//! One kind of layer a file.

pub mod activation;
pub mod along;
pub mod arithmetic;
pub mod convolution;
pub mod dense;
pub mod elementwise;
pub mod extreme;
pub mod gate;
pub mod gru;
pub mod log_softmax;
pub mod lstm;
pub mod normalisation;
pub mod pooling;
pub mod rectified;
pub mod rnn;
pub mod rows;
pub mod selection;
pub mod softmax;
pub mod window;
