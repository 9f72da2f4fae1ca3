//! Findings beyond the JSON: what its text and its plots are made of.

use serde::Serialize;

/// Findings that the text and the plots say beyond the JSON.
#[derive(Clone, Debug, Default)]
pub struct Details {
    /// Parts of the recordings that were set aside to check by, where no recording was given for
    /// that.
    pub set_aside: Option<String>,
    /// The force that the refitted rig lacks, recovered from the recordings; `None` where nothing
    /// is wrong.
    pub recovered: Option<Recovered>,
}

/// One explanation that was fitted to all recordings of the fit.
#[derive(Clone, Debug, Serialize)]
pub struct Finalist {
    /// Terms that it adds to the rig, as `kind at component`, joined by ` + `; `nothing` for the
    /// rig itself.
    pub name: String,
    /// Fitted parameters, the rig's own included.
    pub parameters: usize,
    /// Root mean square error on the fit recordings as a part of what the refitted rig leaves
    /// there, the rig fitted to the check recordings as well; the geometric mean over sensors: 1
    /// gains nothing.
    pub fit_error: f64,
    /// The same on the check recordings.
    pub check_error: f64,
    /// Share of the baseline's mismatch on the check recordings that it leaves.
    pub remainder: f64,
    /// Probability among the finalists.
    pub probability: f64,
    /// Reason for which it is not what is believed; empty for what is.
    #[serde(rename = "refused")]
    pub lost: String,
}

/// A force at one place of the rig, as the recordings show it.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The component at which it acts.
    pub component: String,
    /// `N` or `N m`; the unit of the reading or of the input where the mismatch sits at a sensor or
    /// an actuator.
    pub unit: String,
    /// Unit of the place's position: `m` or `rad`.
    pub position_unit: String,
    /// One entry a recording.
    pub traces: Vec<ForceTrace>,
}

/// A recovered force over one recording; all columns have one entry a row.
#[derive(Clone, Debug)]
pub struct ForceTrace {
    /// Name of the recording's file.
    pub recording: String,
    /// s.
    pub t: Vec<f64>,
    /// Position there, SI.
    pub position: Vec<f64>,
    /// Velocity there, SI.
    pub velocity: Vec<f64>,
    /// The force that the refitted rig lacks, SI.
    pub force: Vec<f64>,
    /// Force that the named effects give instead, SI; empty where nothing is named.
    pub law: Vec<f64>,
}
