//! Derivatives backwards: a number that remembers on a tape what it was made of.

use crate::math;
use crate::scalar::Scalar;
use std::cell::RefCell;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// One operation: the numbers that went in, and the partial derivatives by them. Entry 0 of a tape
/// is what depends on nothing.
#[derive(Clone, Copy)]
struct Node {
    from: [u32; 2],
    partial: [f64; 2],
}

const NOTHING: Node = Node {
    from: [0; 2],
    partial: [0.0; 2],
};

thread_local! {
    static TAPE: RefCell<Vec<Node>> = const { RefCell::new(Vec::new()) };
}

/// A number on this thread's tape. Constants are not on it and cost nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reverse {
    value: f64,
    node: u32,
}

/// Begins a new tape on this thread.
pub(crate) fn begin() {
    TAPE.with_borrow_mut(|tape| {
        tape.clear();
        tape.push(NOTHING);
    });
}

/// Derivatives of `sum seed_i output_i` by everything on the tape, found by walking it backwards
/// once; ask it with [`Adjoints::of`].
pub(crate) fn adjoints(seeds: &[(Reverse, f64)]) -> Adjoints {
    TAPE.with_borrow(|tape| {
        let mut adjoint = vec![0.0; tape.len()];
        for (output, seed) in seeds {
            adjoint[output.node as usize] += seed;
        }
        for index in (1..tape.len()).rev() {
            let here = adjoint[index];
            if here != 0.0 {
                let node = tape[index];
                adjoint[node.from[0] as usize] += here * node.partial[0];
                adjoint[node.from[1] as usize] += here * node.partial[1];
            }
        }
        Adjoints(adjoint)
    })
}

pub(crate) struct Adjoints(Vec<f64>);

impl Adjoints {
    /// The derivative by a variable.
    pub(crate) fn of(&self, variable: Reverse) -> f64 {
        if variable.node == 0 {
            0.0
        } else {
            self.0[variable.node as usize]
        }
    }
}

impl Reverse {
    /// A number that derivatives are wanted by.
    pub(crate) fn variable(value: f64) -> Self {
        let node = TAPE.with_borrow_mut(|tape| {
            tape.push(NOTHING);
            tape.len() - 1
        });
        Self {
            value,
            node: node as u32,
        }
    }

    fn one(self, value: f64, slope: f64) -> Self {
        self.two(value, slope, Self::ZERO, 0.0)
    }

    fn two(self, value: f64, slope: f64, other: Self, other_slope: f64) -> Self {
        if self.node == 0 && other.node == 0 {
            return Self { value, node: 0 };
        }
        let node = TAPE.with_borrow_mut(|tape| {
            tape.push(Node {
                from: [self.node, other.node],
                partial: [slope, other_slope],
            });
            tape.len() - 1
        });
        Self {
            value,
            node: node as u32,
        }
    }
}

impl Scalar for Reverse {
    const ZERO: Self = Self {
        value: 0.0,
        node: 0,
    };

    fn constant(value: f64) -> Self {
        Self { value, node: 0 }
    }

    fn value(self) -> f64 {
        self.value
    }

    fn is_constant(self) -> bool {
        self.node == 0
    }

    fn sin(self) -> Self {
        self.one(math::sin(self.value), math::cos(self.value))
    }

    fn cos(self) -> Self {
        self.one(math::cos(self.value), -math::sin(self.value))
    }

    fn exp(self) -> Self {
        let value = math::exp(self.value);
        self.one(value, value)
    }

    fn ln(self) -> Self {
        self.one(math::ln(self.value), 1.0 / self.value)
    }

    fn tanh(self) -> Self {
        let value = math::tanh(self.value);
        self.one(value, 1.0 - value * value)
    }

    fn sqrt(self) -> Self {
        let value = math::sqrt(self.value);
        self.one(value, 0.5 / value)
    }
}

impl Neg for Reverse {
    type Output = Self;
    fn neg(self) -> Self {
        self.one(-self.value, -1.0)
    }
}

impl Add for Reverse {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.two(self.value + other.value, 1.0, other, 1.0)
    }
}

impl Sub for Reverse {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.two(self.value - other.value, 1.0, other, -1.0)
    }
}

impl Mul for Reverse {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.two(self.value * other.value, other.value, other, self.value)
    }
}

impl Div for Reverse {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        self.two(value, 1.0 / other.value, other, -value / other.value)
    }
}

impl Add<f64> for Reverse {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        Self {
            value: self.value + other,
            ..self
        }
    }
}

impl Sub<f64> for Reverse {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        Self {
            value: self.value - other,
            ..self
        }
    }
}

impl Mul<f64> for Reverse {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self.one(self.value * other, other)
    }
}

impl Div<f64> for Reverse {
    type Output = Self;
    fn div(self, other: f64) -> Self {
        self.one(self.value / other, 1.0 / other)
    }
}

impl AddAssign for Reverse {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Reverse {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
