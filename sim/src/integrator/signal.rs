//! Columns that parameters depend on, as the rig follows them (docs/explanation/plant.md, eq. 26).

use crate::input_history::InputHistory;
use crate::plant::topology::{SignalSlots, Topology};
use crate::scalar::Scalar;

/// One signal between two rows.
#[derive(Clone, Copy, Debug)]
struct Followed<S> {
    /// The column since it was taken.
    column: S,
    /// Value that the rig has reached on its way there.
    now: S,
    /// When the column was taken; `None` before the first time, from which the rig begins settled.
    since: Option<f64>,
}

/// Signals as the rig follows them: at once, or with a time constant.
#[derive(Clone, Debug)]
pub(crate) struct Signals<S> {
    all: Vec<Followed<S>>,
    /// The same as one slice.
    now: Vec<S>,
}

impl<S: Scalar> Signals<S> {
    pub(super) fn new(topology: &Topology) -> Self {
        let zero = Followed {
            column: S::ZERO,
            now: S::ZERO,
            since: None,
        };
        Self {
            all: vec![zero; topology.signals.len()],
            now: vec![S::ZERO; topology.signals.len()],
        }
    }

    /// Value of each that the rig has reached.
    pub(super) fn now(&self) -> &[S] {
        &self.now
    }

    /// Takes a column's value at a time; until then the rig followed the value before.
    pub(super) fn take(
        &mut self,
        index: usize,
        slots: &SignalSlots,
        values: &[S],
        (time, value): (f64, S),
    ) {
        let followed = &mut self.all[index];
        followed.now = match (slots.lag, followed.since) {
            (Some(lag), Some(since)) if values[lag].value() > 0.0 => {
                let left = (-(S::constant(time - since) / values[lag])).exp();
                followed.column + (followed.now - followed.column) * left
            }
            _ => value,
        };
        followed.column = value;
        followed.since = Some(time);
        self.now[index] = followed.now;
    }

    /// Follows the rows before the first; `first` is the input of the first signal.
    pub(super) fn replay(
        &mut self,
        topology: &Topology,
        values: &[S],
        past: &InputHistory,
        first: usize,
    ) {
        for (index, slots) in topology.signals.iter().enumerate() {
            if slots.lag.is_none() {
                continue;
            }
            let column = past.columns.get(first + index).into_iter().flatten();
            for (&time, &value) in past.times.iter().zip(column) {
                self.take(index, slots, values, (time, S::constant(value)));
            }
        }
    }

    /// Numbers that one row hands to the next.
    pub(super) fn kept(&self) -> impl Iterator<Item = S> + '_ {
        self.all
            .iter()
            .flat_map(|followed| [followed.column, followed.now])
    }

    /// The same in other numbers.
    pub(super) fn lifted<T: Scalar>(&self, kept: &[T]) -> Signals<T> {
        let all = self.all.iter().zip(kept.chunks_exact(2));
        let all: Vec<Followed<T>> = all
            .map(|(followed, pair)| Followed {
                column: pair[0],
                now: pair[1],
                since: followed.since,
            })
            .collect();
        Signals {
            now: all.iter().map(|followed| followed.now).collect(),
            all,
        }
    }

    /// Numbers in [`Signals::kept`].
    pub(super) fn kept_len(topology: &Topology) -> usize {
        2 * topology.signals.len()
    }
}
