//! Faults of one channel of a soft sensor, in a closed loop, and what the controller says of them.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use sinew_device::protocol::Health;

use crate::closed_loop::mpc::MpcController;
use crate::closed_loop::reference::Reference;
use crate::closed_loop::scenario::Controller;
use sinew_ident::error::Result;
use sinew_ident::noise::gaussian;

/// A drift takes so long to its end, seconds.
const DRIFT_S: f64 = 5.0;
/// Its end, as a part of the channel's range.
const DRIFT: f64 = 0.2;
/// Gain of a channel that has become weak.
const WEAK: f64 = 0.7;
/// Noise of a noisy channel, in noises of a sound one.
const NOISY: f64 = 10.0;

/// A way in which a channel fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// Zero.
    Dead,
    /// Its last value.
    Frozen,
    /// An offset that grows to a fifth of its range in five seconds.
    Drifting,
    /// Three tenths of its gain lost.
    Weak,
    /// Ten times its noise.
    Noisy,
}

impl FaultKind {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Dead,
        Self::Frozen,
        Self::Drifting,
        Self::Weak,
        Self::Noisy,
    ];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dead => "dead",
            Self::Frozen => "frozen",
            Self::Drifting => "drifting",
            Self::Weak => "weak",
            Self::Noisy => "noisy",
        }
    }
}

/// One fault of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelFault {
    /// Its kind.
    pub kind: FaultKind,
    /// The channel.
    pub channel: usize,
    /// The first step that has it.
    pub from: usize,
    /// Control period, seconds.
    pub period_s: f64,
    /// Range of the channel in the calibration.
    pub range: f64,
    /// Standard deviation of its noise.
    pub noise: f64,
}

impl ChannelFault {
    /// A reading with the fault, `steps` after it began; `held` is the last one before.
    fn reading(&self, read: f64, held: f64, steps: usize, random: &mut ChaCha8Rng) -> f64 {
        match self.kind {
            FaultKind::Dead => 0.0,
            FaultKind::Frozen => held,
            FaultKind::Drifting => {
                let share = (steps as f64 * self.period_s / DRIFT_S).min(1.0);
                read + DRIFT * self.range * share
            }
            FaultKind::Weak => WEAK * read,
            FaultKind::Noisy => {
                // What is there already is a part of it.
                let added = (NOISY * NOISY - 1.0).sqrt() * self.noise;
                read + added * gaussian(random)
            }
        }
    }
}

/// A controller one of whose channels fails.
pub struct WithFault<'a, 'b> {
    controller: &'a mut MpcController<'b>,
    fault: Option<ChannelFault>,
    held: f64,
    random: ChaCha8Rng,
    /// The controller judges its channels, and is asked after every step.
    watched: bool,
    /// Answers to that, one a step.
    pub seen: Vec<Health>,
}

impl<'a, 'b> WithFault<'a, 'b> {
    /// `controller`, with a fault or without.
    pub fn new(
        controller: &'a mut MpcController<'b>,
        fault: Option<ChannelFault>,
        watched: bool,
        seed: u64,
    ) -> Self {
        Self {
            controller,
            fault,
            held: f64::NAN,
            random: ChaCha8Rng::seed_from_u64(seed),
            watched,
            seen: Vec::new(),
        }
    }
}

impl Controller for WithFault<'_, '_> {
    fn command(
        &mut self,
        k: usize,
        y: &[f64],
        s: &[f64],
        reference: &Reference,
    ) -> Result<Vec<f64>> {
        let mut s = s.to_vec();
        if let Some(fault) = &self.fault {
            let read = &mut s[fault.channel];
            match k.checked_sub(fault.from) {
                None => self.held = *read,
                Some(steps) => *read = fault.reading(*read, self.held, steps, &mut self.random),
            }
        }
        let u = self.controller.command(k, y, &s, reference)?;
        if self.watched {
            self.seen.push(self.controller.health()?);
        }
        Ok(u)
    }
}

/// A pair of channel and fault, and what became of the loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Name of the channel.
    pub channel: String,
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Root mean square error from the fault on: sound, with the fault and the watch, with the
    /// fault and no watch.
    pub rms: [f64; 3],
    /// Seconds until the channel was left out.
    pub found_s: Option<f64>,
    /// Another channel was left out.
    pub blamed_another: bool,
}

impl Pair {
    /// Judges what a controller said in a run with `fault`.
    pub fn of(channel: &str, fault: &ChannelFault, seen: &[Health], rms: [f64; 3]) -> Self {
        let bit = 1_u32.checked_shl(fault.channel as u32).unwrap_or(0);
        let after = seen.iter().skip(fault.from);
        let found = after.clone().position(|h| h.left_out & bit != 0);
        Self {
            channel: channel.into(),
            kind: fault.kind,
            rms,
            found_s: found.map(|steps| (steps + 1) as f64 * fault.period_s),
            blamed_another: seen.iter().any(|h| h.left_out & !bit != 0),
        }
    }

    /// The fault would add at least `least` to the error if nobody watched. A loop that ended, or
    /// ran away, is no number and matters.
    pub fn matters(&self, least: f64) -> bool {
        let added = self.rms[2] - self.rms[0];
        added.is_nan() || added >= least
    }

    /// Error with the fault in errors without.
    pub fn ratio(&self) -> f64 {
        self.rms[1] / self.rms[0]
    }

    /// As JSON.
    pub fn value(&self) -> Value {
        json!({
            "channel": self.channel,
            "fault": self.kind.name(),
            "rms_sound": self.rms[0],
            "rms_watched": self.rms[1],
            "rms_unwatched": self.rms[2],
            "found_s": self.found_s,
            "blamed_another": self.blamed_another,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(kind: FaultKind) -> ChannelFault {
        ChannelFault {
            kind,
            channel: 1,
            from: 2,
            period_s: 0.5,
            range: 10.0,
            noise: 0.1,
        }
    }

    #[test]
    fn each_fault_is_what_its_name_says() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut read = |kind, steps| fault(kind).reading(4.0, 3.0, steps, &mut random);
        assert_eq!(read(FaultKind::Dead, 0), 0.0);
        assert_eq!(read(FaultKind::Frozen, 7), 3.0);
        let drift = [0, 5, 10, 99].map(|steps| read(FaultKind::Drifting, steps));
        assert_eq!(drift, [4.0, 5.0, 6.0, 6.0]);
        assert_eq!(read(FaultKind::Weak, 1), 0.7 * 4.0);
        let rough: Vec<f64> = (0..4000).map(|_| read(FaultKind::Noisy, 0) - 4.0).collect();
        let square = rough.iter().map(|r| r * r).sum::<f64>() / 4000.0;
        // With the noise that is there, ten times it.
        assert!(((square + 0.01).sqrt() - 1.0).abs() < 0.05, "{square}");
    }

    #[test]
    fn a_pair_knows_who_was_blamed_and_when() {
        let seen = |bits: &[u32]| -> Vec<Health> {
            let health = |left_out: &u32| Health {
                left_out: *left_out,
                ..Health::default()
            };
            bits.iter().map(health).collect()
        };
        let fault = fault(FaultKind::Dead);
        let of = |bits: &[u32]| Pair::of("light", &fault, &seen(bits), [1.0, 1.2, 3.0]);
        let found = of(&[0, 0, 0, 2, 2]);
        assert_eq!((found.found_s, found.blamed_another), (Some(1.0), false));
        assert!(found.matters(2.0) && !found.matters(2.1));
        assert_eq!(of(&[0, 0, 4, 4]).found_s, None);
        assert!(of(&[0, 0, 4, 6]).blamed_another);
        let lost = Pair {
            rms: [1.0, 1.0, f64::NAN],
            ..found
        };
        assert!(lost.matters(1e9));
    }
}
