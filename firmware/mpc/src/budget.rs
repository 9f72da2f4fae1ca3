//! Budget of an optimisation, by which it may end at any instant (docs/explanation/controller.md,
//! section 5).
//!
//! An optimisation asks its budget before every part of its work. Whatever the answers, the plan is
//! inside the limits. [`Unlimited`] compiles to nothing, [`Until`] is a timer or an interrupt, and
//! [`Meter`] counts work, so that every machine stops at the same place.

/// Part of an optimisation that comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A linearisation, which is of use only with a factorisation after it.
    Derivative,
    /// A factorisation of the subproblem.
    Factorisation,
    /// An evaluation of J.
    Rollout,
    /// An evaluation of J beside the plan, with the one that ends a restart after it.
    Perturbation,
}

/// Rule that ends an optimisation.
pub trait Interrupt {
    /// False where it never ends one.
    const LIMITED: bool = true;
    /// A step that it leaves no time to evaluate is taken as it is.
    const UNEVALUATED: bool = false;

    /// The optimisation has to end before `next`. Otherwise `next` is made, and is counted.
    fn ends(&mut self, next: Part) -> bool;

    /// The optimisation has been, or would now be, cut short; counts nothing.
    fn ended(&mut self) -> bool;
}

/// No budget: the iterations alone end an optimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unlimited;

impl Interrupt for Unlimited {
    const LIMITED: bool = false;

    #[inline(always)]
    fn ends(&mut self, _: Part) -> bool {
        false
    }

    #[inline(always)]
    fn ended(&mut self) -> bool {
        false
    }
}

/// A timer, or a flag that an interrupt sets: the optimisation ends when the function says so. It
/// has to stay true.
///
/// ```
/// use sinew_mpc::budget::{Interrupt, Part, Until};
/// use std::time::{Duration, Instant};
///
/// let deadline = Instant::now() + Duration::from_secs(60);
/// let mut budget = Until(|| Instant::now() > deadline);
/// assert!(!budget.ends(Part::Rollout), "a minute is left");
/// assert!(Until(|| true).ends(Part::Rollout));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Until<F>(pub F);

impl<F: FnMut() -> bool> Interrupt for Until<F> {
    #[inline(always)]
    fn ends(&mut self, _: Part) -> bool {
        (self.0)()
    }

    #[inline(always)]
    fn ended(&mut self) -> bool {
        (self.0)()
    }
}

/// Cost of the parts, in ticks of a board's counter: the largest of those measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// One evaluation of J.
    pub rollout: u32,
    /// One gradient with Hessian, the products with it that decide about the step, and the start of
    /// the active-set method.
    pub derivative: u32,
    /// One factorisation with all that an iteration of that method does around it, and its end.
    pub factorisation: u32,
}

/// Budget in ticks, with the ticks that each part is counted as. Ticks are of any unit; printed
/// models count instructions.
///
/// ```
/// use sinew_mpc::budget::{Budget, Meter, Parts};
///
/// let parts = Parts { rollout: 1_000, derivative: 3_000, factorisation: 500 };
/// let budget = Budget { ticks: 20_000, parts };
/// assert_eq!(Meter::new(budget).left(), 19_000); // the first evaluation of J is made in any case
/// // On a board where a gradient takes a third longer than it is counted as:
/// let slower = Parts { derivative: 4_000, ..parts };
/// assert_eq!(budget.bound(&slower), 26_719);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Most ticks of one optimisation.
    pub ticks: u32,
    /// Ticks of the parts.
    pub parts: Parts,
}

impl Budget {
    /// Most ticks of an optimisation, where its parts take `measured` and not what they are counted
    /// as: the budget times the largest ratio of the two. The first evaluation of J is made in any
    /// case.
    pub const fn bound(&self, measured: &Parts) -> u32 {
        let counted = &self.parts;
        // In 256ths, rounded up; a part that is counted as nothing may come at any number.
        const fn ratio(measured: u32, counted: u32) -> u64 {
            if counted == 0 {
                return if measured == 0 { 0 } else { u32::MAX as u64 };
            }
            (measured as u64 * 256).div_ceil(counted as u64)
        }
        let mut most = ratio(measured.rollout, counted.rollout);
        let others = [
            ratio(measured.derivative, counted.derivative),
            ratio(measured.factorisation, counted.factorisation),
        ];
        if others[0] > most {
            most = others[0];
        }
        if others[1] > most {
            most = others[1];
        }
        let bound = (most.saturating_mul(self.ticks as u64)).div_ceil(256);
        let first = measured.rollout as u64;
        let bound = if bound > first { bound } else { first };
        if bound > u32::MAX as u64 {
            u32::MAX
        } else {
            bound as u32
        }
    }
}

/// Count of the work of one optimisation against its [`Budget`]. A part is made only where it fits,
/// together with the parts that make it useful. Factorisations go before the evaluation of J: a
/// step that nothing is left to evaluate is taken as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Meter {
    left: u32,
    parts: Parts,
    cut: bool,
}

impl Meter {
    /// Before the optimisation, with its first evaluation of J counted already.
    pub const fn new(budget: Budget) -> Self {
        Self {
            left: budget.ticks.saturating_sub(budget.parts.rollout),
            parts: budget.parts,
            cut: false,
        }
    }

    /// Ticks that are left.
    pub const fn left(&self) -> u32 {
        self.left
    }
}

impl Interrupt for Meter {
    const UNEVALUATED: bool = true;

    #[inline(never)]
    fn ends(&mut self, next: Part) -> bool {
        let Parts {
            rollout,
            derivative,
            factorisation,
        } = self.parts;
        let (part, after) = match next {
            Part::Derivative => (derivative, factorisation),
            Part::Factorisation => (factorisation, 0),
            Part::Rollout => (rollout, 0),
            Part::Perturbation => (rollout, rollout),
        };
        if part.saturating_add(after) > self.left {
            self.cut = true;
            return true;
        }
        self.left -= part;
        false
    }

    #[inline(always)]
    fn ended(&mut self) -> bool {
        self.cut
    }
}
