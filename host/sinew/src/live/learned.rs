//! Parameters that a board estimates while it runs.

use sinew_device::protocol::Parameters;

use super::Names;

/// Parameters that the board estimates, as it told them last.
pub(super) struct Learned {
    /// Refusals in a row that end the asking; one may be a frame that the line has damaged.
    patience: u8,
    latest: Option<Vec<f64>>,
    /// It stands in no row yet.
    fresh: bool,
}

impl Learned {
    const PATIENCE: u8 = 3;

    pub(super) fn new(names: &Names) -> Self {
        Self {
            patience: if names.learned.is_empty() {
                0
            } else {
                Self::PATIENCE
            },
            latest: None,
            fresh: false,
        }
    }

    /// The board is to be asked.
    pub(super) const fn ask(&self) -> bool {
        self.patience > 0
    }

    /// It was asked and has not told anything: a refusal may be the answer.
    pub(super) const fn is_unanswered(&self) -> bool {
        self.patience > 0 && self.latest.is_none()
    }

    pub(super) const fn refused(&mut self) {
        self.patience = self.patience.saturating_sub(1);
    }

    pub(super) fn told(&mut self, known: &Parameters, names: &Names) {
        let Some(values) = names.learned.values(known) else {
            return self.refused();
        };
        self.latest = Some(values);
        self.fresh = true;
    }

    /// Values for the next row of the file; each stands in one.
    pub(super) fn take(&mut self) -> Option<Vec<f64>> {
        let fresh = std::mem::take(&mut self.fresh);
        self.latest.clone().filter(|_| fresh)
    }

    pub(super) fn latest(&self) -> Option<&[f64]> {
        self.latest.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::monitor::tests::tick;
    use crate::live::saved::Saved;

    #[test]
    fn what_the_board_has_learned_stands_in_the_row_after_its_answer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let mut names = Names::for_test(vec!["u_N".into()], vec!["q_m".into()]);
        names.learned = crate::adopt::examples::two();
        let mut learned = Learned::new(&names);
        let mut tick = tick(1);
        let mut saved = Saved::create(&path, &names).expect("a file");
        for k in 0..3 {
            if k == 1 {
                let known = crate::adopt::examples::known(&[1.0, 2.0], &[0.25, 0.0]);
                learned.told(&known, &names);
            }
            (tick.tick, tick.at_us) = (k, 8000 * u64::from(k));
            saved.row(&tick, learned.take().as_deref()).expect("a row");
        }
        saved.flush().expect("the rows");
        let text = std::fs::read_to_string(&path).expect("the file");
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(
            lines,
            [
                "# model 00ab12cd",
                "t,u_N,q_m,reference_q_m,estimate_q_m,disturbance_q_m,armed_1,status_1,\
                 iterations_1,step_ticks_1,late_1,tick_1,learned_mass.inertia,\
                 deviation_mass.inertia,learned_load.level,deviation_load.level",
                "0,1,0.5,,0.5,0,0,7,0,7,0,0,,,,",
                "0.008,1,0.5,,0.5,0,0,7,0,7,0,1,2.3,0.15,-0.65,0",
                "0.016,1,0.5,,0.5,0,0,7,0,7,0,2,,,,",
            ]
        );
        // From here on a refusal is that of something else.
        assert!(learned.ask() && !learned.is_unanswered());
        // A board that has never told is asked three times and not again.
        let mut silent = Learned::new(&names);
        for _ in 0..3 {
            assert!(silent.ask() && silent.is_unanswered());
            silent.refused();
        }
        assert!(!silent.ask());
    }
}
