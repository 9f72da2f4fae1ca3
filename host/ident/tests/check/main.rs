//! Faults of recordings: cases that went wrong elsewhere, with the truth that wrote them.

mod cases;
