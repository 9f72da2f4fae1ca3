//! The roles of signals.

use std::fmt;

/// Role of a signal in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A command, u.
    Input,
    /// A predicted and measured output, y.
    Output,
    /// A sensor channel, s.
    Channel,
}

impl Role {
    /// Every role, in the order in which a model lists them.
    pub const ALL: [Self; 3] = [Self::Input, Self::Output, Self::Channel];

    /// The role's table in `model.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Output => "output",
            Self::Channel => "channel",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
