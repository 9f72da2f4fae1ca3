//! Faults of recordings: cases that went wrong elsewhere, and faults that are put into sound ones.

mod beside;
mod between_rows;
mod cases;
mod copies;
mod properties;
mod scale;
mod seeded;
mod shifted;
mod siblings;
mod silent;
