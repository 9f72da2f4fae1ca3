#![doc = include_str!("../README.md")]

mod answer;
mod belief;
mod candidates;
mod error;
mod people;
mod question;
mod sampling;

pub use answer::{Answer, Choice};
pub use belief::{Belief, Winner};
pub use candidates::Candidates;
pub use error::Error;
pub use people::{Evidence, predicted, two_people};
pub use question::{Question, next, random};
