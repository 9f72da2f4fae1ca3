//! Actuator input chain, from recorded columns to actuator inputs: delay, play, dead zone,
//! curvature, saturation and lag (docs/explanation/plant.md, eq. 14). Time is cut into pieces on
//! which each is one formula.

use crate::input_trajectory::InputTrajectory;
use crate::plant::forces::not_below_zero;
use crate::plant::input_signal::{InputSignal, Shape};
use crate::plant::topology::{Line, Topology};
use crate::scalar::Scalar;
use std::collections::VecDeque;

/// Pieces that a sample interval before the first row is cut into at most.
const MOST_PIECES: usize = 1000;

/// A column from the time of a sample on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<S> {
    /// Seconds since the start.
    time: f64,
    value: S,
    /// Per second, until the next sample.
    slope: S,
}

/// The columns as they came, and the memory of each actuator's chain.
#[derive(Clone, Debug)]
pub(crate) struct InputChain<S> {
    /// Samples of each column that may still be wanted, the present one last.
    columns: Vec<VecDeque<Sample<S>>>,
    lines: Vec<ChainMemory<S>>,
}

/// Memory of one actuator's chain.
#[derive(Clone, Copy, Debug)]
struct ChainMemory<S> {
    /// Output of its play, once there was an input.
    play: Option<S>,
    /// Output of its lag, once there was an input.
    lag: Option<S>,
    /// Index of the present sample of its column, from the oldest kept.
    sample: usize,
}

/// Parameter values of a chain, for one piece.
struct ChainValues<S> {
    /// Output of the play, and half its gap.
    play: Option<(S, S)>,
    dead_zone: Option<S>,
    curvature: Option<S>,
    saturation: Option<S>,
}

/// A straight line: `at + slope tau`.
#[derive(Clone, Copy)]
struct StraightLine<S> {
    at: S,
    slope: S,
}

impl<S: Scalar> StraightLine<S> {
    fn value(&self, tau: S) -> S {
        self.at + self.slope * tau
    }

    /// When it takes a value.
    fn reaches(&self, value: S) -> S {
        (value - self.at) / self.slope
    }
}

impl<S: Scalar> InputChain<S> {
    pub(crate) fn new(topology: &Topology) -> Self {
        let kept = ChainMemory {
            play: None,
            lag: None,
            sample: 0,
        };
        Self {
            columns: vec![VecDeque::new(); topology.inputs],
            lines: vec![kept; topology.lines.len()],
        }
    }

    /// The same in other numbers: `kept` as [`InputChain::kept`] gives it, samples by their column
    /// and time.
    pub(crate) fn lifted<T: Scalar>(
        &self,
        kept: &[T],
        mut sample: impl FnMut(usize, f64) -> (T, T),
    ) -> InputChain<T> {
        let mut kept = kept.iter().copied();
        let columns = self.columns.iter().enumerate().map(|(index, column)| {
            let lift = |old: &Sample<S>| {
                let (value, slope) = sample(index, old.time);
                Sample {
                    time: old.time,
                    value,
                    slope: if old.time == f64::NEG_INFINITY {
                        T::ZERO
                    } else {
                        slope
                    },
                }
            };
            column.iter().map(lift).collect()
        });
        InputChain {
            columns: columns.collect(),
            lines: (self.lines.iter())
                .map(|line| ChainMemory {
                    play: line.play.and_then(|_| kept.next()),
                    lag: line.lag.and_then(|_| kept.next()),
                    sample: line.sample,
                })
                .collect(),
        }
    }

    /// Memory of the chains: plays and lags in the order of the actuators.
    pub(crate) fn kept(&self) -> impl Iterator<Item = S> {
        (self.lines.iter()).flat_map(|kept| [kept.play, kept.lag].into_iter().flatten())
    }

    /// Notes a column's value from `time` on.
    pub(crate) fn take(&mut self, input: usize, time: f64, value: S, slope: S) {
        let column = &mut self.columns[input];
        // A sample that is given again (a step that is repeated, or the end of a recording)
        // replaces.
        if column.back().is_some_and(|last| last.time >= time) {
            column.pop_back();
        }
        if column.is_empty() {
            // Before the first sample the input had its value.
            column.push_back(Sample {
                time: f64::NEG_INFINITY,
                value,
                slope: S::ZERO,
            });
        }
        column.push_back(Sample { time, value, slope });
    }

    /// Forgets samples that no delay reaches any more and finds where each line is, at the
    /// beginning of a sample interval.
    pub(crate) fn begin(&mut self, topology: &Topology, values: &[S], now: f64) {
        for input in 0..self.columns.len() {
            let longest = (topology.lines.iter())
                .filter(|line| line.input == input)
                .map(|line| delay(line, values).map_or(0.0, S::value))
                .fold(0.0, f64::max);
            let column = &mut self.columns[input];
            // One sample before the oldest that acts is what the first instant belongs to.
            while column.len() > 2 && column[2].time + longest < now {
                column.pop_front();
            }
        }
        for (kept, line) in self.lines.iter_mut().zip(&topology.lines) {
            let column = &self.columns[line.input];
            let last = column.len().saturating_sub(1);
            kept.sample = match delay(line, values) {
                None => last,
                // What came before now acts at the first instant, so that a delay of nothing has a
                // derivative.
                Some(delay) => (column.iter())
                    .rposition(|sample| sample.time + delay.value() < now)
                    .unwrap_or(0),
            };
        }
    }

    /// Makes the input signals from `cursor` on, `now` being the time of the sample, and returns
    /// where the first of them ends if that is before `end` seconds into the interval.
    pub(crate) fn next_piece(
        &mut self,
        topology: &Topology,
        values: &[S],
        now: f64,
        cursor: S,
        end: f64,
        input_signals: &mut [InputSignal<S>],
    ) -> Option<S> {
        let mut first: Option<S> = None;
        for (index, line) in topology.lines.iter().enumerate() {
            let (raw, until) = self.raw(index, line, values, now);
            let until = until.filter(|until| until.value() < end);
            let settings =
                ChainValues::new(line, values, &mut self.lines[index], raw.value(cursor));
            let within = until.map_or(end, S::value);
            for cut in [until, settings.cut(raw, cursor.value(), within)] {
                if let Some(cut) = cut
                    && first.is_none_or(|first| cut.value() < first.value())
                {
                    first = Some(cut);
                }
            }
        }
        let stop = first.map_or(end, S::value);
        for (index, line) in topology.lines.iter().enumerate() {
            let (raw, _) = self.raw(index, line, values, now);
            let kept = &mut self.lines[index];
            let settings = ChainValues::new(line, values, kept, raw.value(cursor));
            // By the time's value: the cut may carry derivatives, the choice of a formula does not.
            let middle = 0.5 * (cursor.value() + stop);
            let parabola = settings.through(raw, cursor, middle);
            input_signals[index] = input_signal(line, values, kept, cursor, parabola);
        }
        first
    }

    /// Goes through what the inputs of a drive did before its first row, as far as stages remember
    /// it.
    pub(crate) fn replay_history(
        &mut self,
        topology: &Topology,
        values: &[S],
        drive: &InputTrajectory,
        input_signals: &mut [InputSignal<S>],
    ) {
        let past = drive.past();
        for (kept, line) in self.lines.iter_mut().zip(&topology.lines) {
            let Some(slot) = line.chain.play else {
                continue;
            };
            let extremes = past.extremes.get(line.input).into_iter().flatten();
            for &value in extremes {
                let value = S::constant(value);
                kept.play = Some(begun(kept.play, value, values[slot]));
            }
        }
        for (row, &now) in past.times.iter().enumerate() {
            for input in 0..topology.inputs {
                let (value, slope) = past.at(row, input, drive.at(0, input));
                self.take(input, now, S::constant(value), S::constant(slope));
            }
            self.begin(topology, values, now);
            let until = past.times.get(row + 1).copied().unwrap_or(0.0);
            let mut cursor = S::ZERO;
            for _ in 0..MOST_PIECES {
                let cut =
                    self.next_piece(topology, values, now, cursor, until - now, input_signals);
                let end = cut.unwrap_or(S::constant(until - now));
                self.arrive(topology, values, now, end, input_signals);
                if cut.is_none() {
                    break;
                }
                cursor = end;
            }
        }
    }

    /// The delayed column as a straight line in tau, and where it ends.
    fn raw(
        &self,
        index: usize,
        line: &Line,
        values: &[S],
        now: f64,
    ) -> (StraightLine<S>, Option<S>) {
        let column = &self.columns[line.input];
        let Some(&sample) = column.get(self.lines[index].sample) else {
            let zero = S::ZERO;
            return (
                StraightLine {
                    at: zero,
                    slope: zero,
                },
                None,
            );
        };
        let slope = if line.linear { sample.slope } else { S::ZERO };
        let Some(delay) = delay(line, values) else {
            return (
                StraightLine {
                    at: sample.value,
                    slope,
                },
                None,
            );
        };
        let next = column.get(self.lines[index].sample + 1);
        let until = next.map(|next| delay + (next.time - now));
        if sample.time == f64::NEG_INFINITY {
            let held = StraightLine {
                at: sample.value,
                slope: S::ZERO,
            };
            return (held, until);
        }
        let begins = delay + (sample.time - now);
        let at = sample.value - slope * begins;
        (StraightLine { at, slope }, until)
    }

    /// Moves on to `cursor`, where a stretch ended.
    pub(crate) fn arrive(
        &mut self,
        topology: &Topology,
        values: &[S],
        now: f64,
        cursor: S,
        input_signals: &[InputSignal<S>],
    ) {
        for (index, line) in topology.lines.iter().enumerate() {
            let (raw, until) = self.raw(index, line, values, now);
            let kept = &mut self.lines[index];
            if let (Some(slot), Some(play)) = (line.chain.play, kept.play) {
                kept.play = Some(played(play, raw.value(cursor), values[slot]));
            }
            if kept.lag.is_some() {
                kept.lag = Some(input_signals[index].at(cursor));
            }
            let length = self.columns[line.input].len();
            if until.is_some_and(|until| until.value() <= cursor.value())
                && kept.sample + 1 < length
            {
                kept.sample += 1;
            }
        }
    }

    /// The shortest time constant of a lag that has not settled, s.
    pub(crate) fn unsettled(input_signals: &[InputSignal<S>]) -> Option<S> {
        (input_signals.iter())
            .filter(|input_signal| {
                input_signal.shape == Shape::Lagged && input_signal.decay.value() != 0.0
            })
            .map(|input_signal| S::constant(1.0) / input_signal.rate)
            .reduce(S::min)
    }
}

/// Delay of a line: its own and, where its lag has no time constant, what the lag adds in first
/// order.
fn delay<S: Scalar>(line: &Line, values: &[S]) -> Option<S> {
    let own = line.chain.delay.map(|slot| not_below_zero(values[slot]));
    let lag = line.chain.lag.map(|slot| values[slot]);
    match (own, lag.filter(|lag| lag.value() <= 0.0)) {
        (own, None) => own,
        (None, Some(lag)) => Some(not_below_zero(lag)),
        (Some(own), Some(lag)) => Some(own + not_below_zero(lag)),
    }
}

/// The play operator: the output is dragged along half a gap behind (eq. 14f).
fn played<S: Scalar>(output: S, input: S, gap: S) -> S {
    let half = not_below_zero(gap) * 0.5;
    output.max(input - half).min(input + half)
}

/// The same where there may have been no input yet: the first one came from nothing.
fn begun<S: Scalar>(output: Option<S>, input: S, gap: S) -> S {
    played(output.unwrap_or(S::constant(0.0)), input, gap)
}

/// Input signal of an actuator whose elements before the lag give a parabola from `cursor` on.
fn input_signal<S: Scalar>(
    line: &Line,
    values: &[S],
    kept: &mut ChainMemory<S>,
    cursor: S,
    c: [S; 3],
) -> InputSignal<S> {
    let straight = InputSignal {
        shape: if line.linear {
            Shape::Parabola
        } else {
            Shape::Held
        },
        c,
        decay: S::ZERO,
        rate: S::ZERO,
        origin: cursor,
    };
    let Some(slot) = line.chain.lag else {
        return straight;
    };
    let lag = *kept.lag.get_or_insert(c[0]);
    let time = values[slot];
    if time.value() <= 0.0 {
        kept.lag = Some(c[0]);
        return straight;
    }
    // y' T + y = c: a parabola that trails, and what decays.
    let c2 = c[2];
    let c1 = c[1] - time * c2 * 2.0;
    let c0 = c[0] - time * c1;
    InputSignal {
        shape: Shape::Lagged,
        c: [c0, c1, c2],
        decay: lag - c0,
        rate: S::constant(1.0) / time,
        origin: cursor,
    }
}

impl<S: Scalar> ChainValues<S> {
    /// The stages as they stand where the input is `input`; what is remembered begins with the
    /// first.
    fn new(line: &Line, values: &[S], kept: &mut ChainMemory<S>, input: S) -> Self {
        let stages = &line.chain;
        let size = |slot: usize| not_below_zero(values[slot]);
        let play = stages.play.map(|slot| {
            let output = begun(kept.play, input, values[slot]);
            kept.play = Some(output);
            (output, size(slot) * 0.5)
        });
        Self {
            play,
            dead_zone: stages.dead_zone.map(size),
            curvature: stages.curvature.map(|slot| values[slot]),
            saturation: stages.saturation.map(size),
        }
    }

    /// The first time after `cursor` and before `end` at which a stage changes its formula.
    fn cut(&self, raw: StraightLine<S>, cursor: f64, end: f64) -> Option<S> {
        if raw.slope.value() == 0.0 {
            return None;
        }
        let ahead = |cut: &S| cut.value() > cursor + 1e-12 * end && cut.value() < end;
        let play = self.play.map(|(output, half)| {
            let edge = if raw.slope.value() > 0.0 {
                output + half
            } else {
                output - half
            };
            raw.reaches(edge)
        });
        let play = play.filter(ahead);
        let middle = 0.5 * (cursor + play.map_or(end, S::value));
        let line = self.behind_play(raw, middle);
        let cuts = (self.thresholds().into_iter())
            .filter(|_| line.slope.value() != 0.0)
            .map(|threshold| line.reaches(threshold))
            .filter(ahead);
        cuts.chain(play).reduce(S::min)
    }

    /// Output of the play for a straight line, by the side it is on at `middle`.
    fn behind_play(&self, raw: StraightLine<S>, middle: f64) -> StraightLine<S> {
        let Some((output, half)) = self.play else {
            return raw;
        };
        let away = raw.at.value() + raw.slope.value() * middle - output.value();
        if away > half.value() {
            StraightLine {
                at: raw.at - half,
                ..raw
            }
        } else if away < -half.value() {
            StraightLine {
                at: raw.at + half,
                ..raw
            }
        } else {
            StraightLine {
                at: output,
                slope: S::ZERO,
            }
        }
    }

    /// Inputs at which dead zone, curvature and saturation change their formula.
    fn thresholds(&self) -> Vec<S> {
        let width = self.dead_zone.unwrap_or(S::ZERO);
        let bend = self.curvature.filter(|bend| bend.value() != 0.0);
        let mut above = Vec::new();
        if self.dead_zone.is_some() || bend.is_some() {
            above.push(width);
        }
        if let Some(bend) = bend.filter(|bend| bend.value() < 0.0) {
            above.push(width - S::constant(0.5) / bend);
        }
        if let Some(limit) = self.saturation {
            match bend {
                None => above.push(width + limit),
                Some(bend) => {
                    let inside = bend * limit * 4.0 + 1.0;
                    if inside.value() > 1e-12 {
                        let root = inside.sqrt();
                        above.push(width + limit * 2.0 / (root + 1.0));
                        if bend.value() < 0.0 {
                            above.push(width + limit * 2.0 / (-root + 1.0));
                        }
                    }
                }
            }
        }
        above.iter().flat_map(|&x| [x, -x]).collect()
    }

    /// The parabola in `tau - cursor` that comes out of the stages, by the formulas that hold at
    /// `middle` (eq. 14b to 14d).
    fn through(&self, raw: StraightLine<S>, cursor: S, middle: f64) -> [S; 3] {
        let line = self.behind_play(raw, middle);
        let s = middle - cursor.value();
        let mut c = [line.value(cursor), line.slope, S::ZERO];
        let at = |c: &[S; 3]| c[0].value() + s * (c[1].value() + s * c[2].value());
        if let Some(width) = self.dead_zone {
            match at(&c) {
                x if x > width.value() => c[0] -= width,
                x if x < -width.value() => c[0] += width,
                _ => c = [S::ZERO; 3],
            }
        }
        if let Some(bend) = self.curvature {
            let bend = if at(&c) < 0.0 { -bend } else { bend };
            c = [
                c[0] + bend * c[0] * c[0],
                c[1] + bend * c[0] * c[1] * 2.0,
                bend * c[1] * c[1],
            ];
        }
        if let Some(limit) = self.saturation {
            match at(&c) {
                x if x > limit.value() => c = [limit, S::ZERO, S::ZERO],
                x if x < -limit.value() => c = [-limit, S::ZERO, S::ZERO],
                _ => {}
            }
        }
        c
    }
}
