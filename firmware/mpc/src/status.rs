//! Status of a control step.

/// Outcome of a step. Whatever it is, the command is inside the limits.
///
/// ```
/// use sinew_mpc::Status;
///
/// assert!(Status::IterationLimit.is_controlled());
/// assert!(!Status::SignalLost.is_controlled());
/// ```
#[must_use]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// The plan is optimal as far as f32 can tell.
    Converged,
    /// The plan improved until the iterations were used up: the usual case.
    IterationLimit,
    /// A step was found that should lower the cost and did not; the better plan is kept.
    NoDecrease,
    /// The reference holds a NaN or infinity; the earlier plan is followed.
    BadReference,
    /// The settings are not valid ([`Settings::is_valid`](crate::controller::Settings::is_valid));
    /// the earlier plan is followed.
    BadSettings,
    /// The prediction is not finite; the earlier plan is followed.
    NotFinite,
    /// No sample yet, or too many missing in a row; going to the safe command.
    SignalLost,
    /// Nothing is armed; going to the safe command.
    Disarmed,
    /// The command is one that was asked for, inside the limits; nothing was optimised.
    OpenLoop,
    /// The plan improved until a budget or an interrupt ended the optimisation
    /// ([`budget`](crate::budget)).
    CutShort,
}

impl Status {
    /// The command comes from an optimisation of this step.
    pub const fn is_controlled(self) -> bool {
        matches!(
            self,
            Status::Converged | Status::IterationLimit | Status::NoDecrease | Status::CutShort
        )
    }
}
