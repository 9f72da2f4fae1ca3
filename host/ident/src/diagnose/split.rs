//! Roles of recordings.

use crate::diagnose::config::CONFIG;
use sinew_sim::{Plant, Rig};

use crate::diagnose::data::Data;
use crate::error::{Error, Result};
use crate::recording::Recording;

/// Recordings by role, as a diagnosis uses them.
pub(crate) struct Roles {
    /// These estimate parameters.
    pub fit: Vec<Recording>,
    /// These decide what is believed.
    pub check: Vec<Recording>,
    /// These are only scored.
    pub test: Vec<Recording>,
    /// Parts that were set aside where no check recording was given.
    pub set_aside: Option<String>,
    /// Some recording was too short to be cut and checks itself.
    pub by_itself: bool,
}

impl Roles {
    /// The recordings of the fit, of the check and of both, laid against the rig.
    ///
    /// # Errors
    /// As [`Data::new`].
    pub fn data(&self, rig: &Rig, plant: &Plant) -> Result<[Data; 3]> {
        let mut fit = Data::new(rig, plant, &self.fit)?;
        let mut check = Data::new(rig, plant, &self.check)?;
        let all: Vec<Recording> = self.fit.iter().chain(&self.check).cloned().collect();
        let both = Data::new(rig, plant, &all)?;
        fit.learn_steps(&both);
        check.learn_steps(&both);
        Ok([fit, check, both])
    }

    /// Part of a confidence that these recordings leave: 1 where others check.
    pub fn trust(&self) -> f64 {
        if self.by_itself {
            CONFIG.split.trust_by_itself
        } else {
            1.0
        }
    }

    /// Splits the fit recordings where there are none to check by.
    ///
    /// # Errors
    /// `Arguments` without a recording to fit, `File` for one too short to split.
    pub fn new(fit: &[Recording], check: &[Recording], test: &[Recording]) -> Result<Self> {
        if fit.is_empty() {
            return Err(Error::arguments("a diagnosis needs at least one recording"));
        }
        let mut roles = Self {
            fit: fit.to_vec(),
            check: check.to_vec(),
            test: test.to_vec(),
            set_aside: None,
            by_itself: false,
        };
        if !check.is_empty() {
            return Ok(roles);
        }
        if fit.len() >= 3
            && let Some(last) = roles.fit.pop()
        {
            roles.set_aside = Some(format!("{}, whole", last.name()));
            roles.check.push(last);
            return Ok(roles);
        }
        let mut said = Vec::new();
        roles.fit.clear();
        for recording in fit {
            let rows = recording.len();
            if rows < CONFIG.split.shortest {
                // Cut in two it would determine nothing: it checks itself, and that is said.
                roles.fit.push(recording.clone());
                roles.check.push(recording.clone());
                roles.by_itself = true;
                said.push(format!(
                    "{} itself, which is too short to be cut",
                    recording.name()
                ));
                continue;
            }
            let cut = rows - (CONFIG.split.aside * rows as f64) as usize;
            roles.fit.push(recording.rows(0..cut)?);
            roles.check.push(recording.rows(cut..rows)?);
            said.push(format!(
                "the last {:.0} s of {}",
                recording.t()[rows - 1] - recording.t()[cut.min(rows - 1)],
                recording.name()
            ));
        }
        roles.set_aside = Some(said.join(", "));
        Ok(roles)
    }
}
