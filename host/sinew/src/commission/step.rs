//! Steps of a commissioning, in their order.

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// The emergency stop is proven. Nothing moves.
    Stop,
    /// Noise, drift and dead sensors. Nothing moves.
    Rest,
    /// Each actuator alone, a little.
    Move,
    /// End positions, slowly, each actuator alone.
    Ends,
    /// An experiment within the soft limits.
    Excite,
    /// Faults of the recordings.
    Check,
    /// Parameters.
    Fit,
    /// Missing physics.
    Diagnose,
    /// Controller.
    Build,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Stop,
        Self::Rest,
        Self::Move,
        Self::Ends,
        Self::Excite,
        Self::Check,
        Self::Fit,
        Self::Diagnose,
        Self::Build,
    ];

    /// Name on the command line and in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Rest => "rest",
            Self::Move => "move",
            Self::Ends => "ends",
            Self::Excite => "excite",
            Self::Check => "check",
            Self::Fit => "fit",
            Self::Diagnose => "diagnose",
            Self::Build => "build",
        }
    }

    /// The step of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|step| step.name() == name)
    }

    /// True where the board is needed.
    pub fn is_on_board(self) -> bool {
        self <= Self::Excite
    }

    /// True where something moves.
    pub fn moves(self) -> bool {
        matches!(self, Self::Move | Self::Ends | Self::Excite)
    }

    /// True where the numbers of the rig decide the result.
    pub fn depends_on_rig(self) -> bool {
        self >= Self::Move
    }

    /// The step after it.
    pub fn next(self) -> Option<Self> {
        Self::ALL.into_iter().find(|step| *step > self)
    }
}
