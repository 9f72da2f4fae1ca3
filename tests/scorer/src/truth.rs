//! Truth of a case, as `hardlaw.cases` wrote it. Read only after every answer is in.

use std::collections::BTreeMap;

use serde::Deserialize;

/// One case.
#[derive(Clone, Debug, Deserialize)]
pub struct Truth {
    /// Category of the case.
    pub category: Category,
    /// The family of rigs.
    pub rig: String,
    /// None for controls.
    pub strength: Option<Strength>,
    /// Measurement noise over the standard deviation of the signal.
    pub noise: f64,
    /// Residual of a refit without the effect, over the noise; one or two numbers an effect.
    pub visible: Vec<f64>,
    /// Concealed effects.
    pub effects: Vec<Concealed>,
    /// True values of the rig's free parameters, SI.
    pub parameters: BTreeMap<String, f64>,
    /// Free-run error of the true model on the test recording: the noise as it was drawn.
    pub true_model_test_rms: BTreeMap<String, f64>,
}

/// Sorts of cases.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "snake_case")]
pub enum Category {
    /// One effect.
    One,
    /// Two effects.
    Two,
    /// Nothing hidden, the rig as it is.
    Exact,
    /// Nothing hidden, free parameters far off.
    #[serde(rename = "wrong parameters")]
    WrongParameters,
    /// An unmeasured force.
    Disturbance,
    /// Heavy noise or coarse quantisation.
    Noise,
    /// Something that no kind of the vocabulary is.
    Outside,
}

impl Category {
    /// True if nothing may be named.
    pub fn is_control(self) -> bool {
        !matches!(self, Self::One | Self::Two | Self::Outside)
    }

    /// As it stands in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one effect",
            Self::Two => "two effects",
            Self::Exact => "exact",
            Self::WrongParameters => "wrong parameters",
            Self::Disturbance => "disturbance",
            Self::Noise => "heavy noise or quantisation",
            Self::Outside => "outside the vocabulary",
        }
    }
}

/// Visibility of an effect above the noise.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Strength {
    /// A refit without it leaves as much as the noise, or more.
    Strong,
    /// It leaves less.
    Weak,
}

/// One concealed effect.
#[derive(Clone, Debug, Deserialize)]
pub struct Concealed {
    /// A name of the vocabulary, or of what is outside.
    pub kind: String,
    /// Component that it acts on.
    pub component: String,
    /// The kind's family.
    pub family: String,
    /// SI.
    pub parameters: BTreeMap<String, f64>,
    /// Other names of exactly the same thing: kind and component.
    pub same_as: Vec<(String, String)>,
}

impl Concealed {
    /// True if this is what is meant by a kind at a component.
    pub fn is(&self, kind: &str, component: &str) -> bool {
        let pair = |a: &str, b: &str| same_place(a, component) && b == kind;
        pair(&self.component, &self.kind)
            || (self.same_as.iter()).any(|(kind, component)| pair(component, kind))
    }
}

/// A pair of bodies has no order.
fn same_place(a: &str, b: &str) -> bool {
    match (a.split_once('+'), b.split_once('+')) {
        (Some((a1, a2)), Some((b1, b2))) => (a1, a2) == (b1, b2) || (a1, a2) == (b2, b1),
        _ => a == b,
    }
}
