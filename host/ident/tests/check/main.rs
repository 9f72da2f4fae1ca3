//! Faults of recordings: cases that went wrong elsewhere, and faults that are put into sound ones.

mod cases;
mod copies;
mod scale;
mod seeded;
mod shifted;
mod siblings;
mod silent;
