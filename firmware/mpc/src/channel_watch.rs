//! Channels watched against one another: one that dies, freezes or drifts is found and left out
//! (docs/explanation/controller.md, section 11).
//!
//! A body has fewer ways to move than it has sensors, so the others say what a channel should read.

/// A channel further than this from the middle of its calibration, in half ranges of it, is no
/// reading: a polynomial says nothing true so far outside.
pub const REACH: f32 = 2.0;
/// Square of a deviation, in spreads, beyond which a reading is replaced at once.
pub const GATE: f32 = 36.0;
/// Evidence above which a channel is left out: a running mean of squares, in spreads.
pub const FAULTY: f32 = 8.0;
/// Most that one reading adds to the evidence: the least fault takes 17 samples.
const MOST_A_SAMPLE: f32 = 18.0;
/// Share of the newest square in the evidence.
const RATE: f32 = 1.0 / 32.0;
/// Square of a deviation within which a reading agrees.
const AGREES: f32 = 16.0;
/// Samples in a row that have to agree before a channel comes back.
pub const RETURN_SAMPLES: u16 = 256;
/// Motion that such a run has to see, in spreads: at rest a frozen channel agrees too.
const MOTION: f32 = 8.0;
/// Square that stands for a reading that is none.
const LARGEST: f32 = 1.0e6;

/// Calibrated relation of each channel to all others, model units
/// (docs/explanation/controller.md, eq. 25): `z_i = b_i + sum_j w_ij z_j`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistency<const NS: usize> {
    /// b.
    pub bias: [f32; NS],
    /// W, a row a channel; its diagonal is zero.
    pub weights: [[f32; NS]; NS],
    /// Spread of each channel about what the others say.
    pub spread: [f32; NS],
}

impl<const NS: usize> Consistency<NS> {
    /// Most channels that are replaced at a time; with one more the sample is missing.
    pub const MOST: usize = NS / 4;
}

/// `b + w z`.
#[inline(always)]
fn predicted<const NS: usize>(bias: f32, weights: &[f32; NS], z: &[f32; NS]) -> f32 {
    let mut sum = bias;
    for (w, z) in weights.iter().zip(z) {
        sum += w * z;
    }
    sum
}

/// Judgement of channels before a soft sensor takes them.
pub trait Watch<const NS: usize> {
    /// Channels are judged at all.
    const WATCHES: bool;

    /// Takes the channels of one sample, model units, and puts what the others say in the place of
    /// those that are not to be believed. All are NaN where that are too many.
    fn judge(&mut self, z: &mut [f32; NS]);

    /// Channels that are left out.
    fn left_out(&self) -> LeftOut;

    /// Believes every channel again.
    fn reset(&mut self);
}

/// Channels that are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Bit i: channel i, of the first 32.
    pub channels: u32,
    /// Number of times that one was left out since the reset.
    pub times: u32,
}

/// Every channel is believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unwatched;

impl<const NS: usize> Watch<NS> for Unwatched {
    const WATCHES: bool = false;

    #[inline(always)]
    fn judge(&mut self, _z: &mut [f32; NS]) {}

    #[inline(always)]
    fn left_out(&self) -> LeftOut {
        LeftOut::default()
    }

    #[inline(always)]
    fn reset(&mut self) {}
}

/// State of one channel.
#[derive(Clone, Copy, Debug)]
struct Channel {
    /// Value that was used last.
    used: f32,
    /// Running mean of the squared deviation, in spreads; of a channel that is not the worst of its
    /// sample no square counts more than 1.
    evidence: f32,
    /// Value that the others said when the run of agreement began.
    from: f32,
    /// Samples in a row that agree.
    agreed: u16,
    left_out: bool,
    /// The run of agreement has seen motion.
    moved: bool,
}

/// Watch over the channels of a soft sensor. Its work is at most `NS + 2 (NS / 4) + 1`
/// rows of [`Consistency`] a sample.
///
/// ```
/// use sinew_mpc::channel_watch::{ChannelWatch, Consistency, Watch};
///
/// // Four fibres of a body that bends in one way.
/// static ALIKE: Consistency<4> = Consistency {
///     bias: [0.0; 4],
///     weights: [
///         [0.0, 0.4, 0.3, 0.3],
///         [0.4, 0.0, 0.3, 0.3],
///         [0.3, 0.3, 0.0, 0.4],
///         [0.3, 0.3, 0.4, 0.0],
///     ],
///     spread: [0.02; 4],
/// };
/// let mut watch = ChannelWatch::new(&ALIKE);
/// for _ in 0..50 {
///     // The third one is dead.
///     let mut z = [0.5, 0.5, -1.0, 0.5];
///     watch.judge(&mut z);
///     assert!((z[2] - 0.5).abs() < 0.01, "from the first sample on");
/// }
/// assert_eq!(watch.left_out().channels, 0b0100);
/// ```
#[derive(Clone, Debug)]
pub struct ChannelWatch<const NS: usize> {
    relation: &'static Consistency<NS>,
    channels: [Channel; NS],
    times: u32,
}

impl<const NS: usize> ChannelWatch<NS> {
    /// A watch that believes every channel.
    pub const fn new(relation: &'static Consistency<NS>) -> Self {
        const { assert!(NS >= 4, "with fewer none can be left out") };
        let channel = Channel {
            used: 0.0,
            evidence: 0.0,
            from: 0.0,
            agreed: 0,
            left_out: false,
            moved: false,
        };
        Self {
            relation,
            channels: [channel; NS],
            times: 0,
        }
    }

    /// Puts the last value in the place of channels that are left out or no reading, and marks
    /// them; the number of those.
    #[inline(always)]
    fn hold(&self, z: &mut [f32; NS], missing: &mut [bool; NS]) -> usize {
        let mut count = 0;
        for ((missing, channel), z) in missing.iter_mut().zip(&self.channels).zip(z.iter_mut()) {
            *missing = channel.left_out || !plausible(*z);
            if *missing {
                *z = channel.used;
                count += 1;
            }
        }
        count
    }

    /// Puts what the others say in the place of the marked channels, one after another.
    #[inline(always)]
    fn replace(&self, z: &mut [f32; NS], missing: &[bool; NS]) {
        let rows = self.relation.bias.iter().zip(&self.relation.weights);
        for (i, (missing, (bias, weights))) in missing.iter().zip(rows).enumerate() {
            if *missing {
                let said = predicted(*bias, weights, z);
                if let Some(place) = z.get_mut(i) {
                    *place = said;
                }
            }
        }
    }
}

/// A reading that the calibration has seen the like of; a NaN is none.
#[inline(always)]
fn plausible(z: f32) -> bool {
    z.abs() <= REACH
}

impl<const NS: usize> Watch<NS> for ChannelWatch<NS> {
    const WATCHES: bool = true;

    fn judge(&mut self, z: &mut [f32; NS]) {
        let read = *z;
        let mut missing = [false; NS];
        let mut replaced = self.hold(z, &mut missing);
        if replaced > Consistency::<NS>::MOST {
            *z = [f32::NAN; NS];
            return;
        }
        if replaced > 0 {
            self.replace(z, &missing);
        }
        // What the others say of each, and how far its reading is from that, in spreads, squared.
        let mut said = *z;
        let mut squares = [0.0; NS];
        let (mut worst, mut largest) = (0, -1.0);
        let rows = self.relation.bias.iter().zip(&self.relation.weights);
        let places = said.iter_mut().zip(&mut squares);
        let each = places.zip(rows).zip(read.iter().zip(&self.relation.spread));
        for (i, (((said, square), (bias, weights)), (read, spread))) in each.enumerate() {
            *said = predicted(*bias, weights, z);
            let deviation = (read - *said) / spread;
            let squared = deviation * deviation;
            // A NaN is not less.
            *square = if plausible(*read) && squared < LARGEST {
                squared
            } else {
                LARGEST
            };
            let believed = self.channels.get(i).is_some_and(|c| !c.left_out);
            if believed && *square > largest {
                (worst, largest) = (i, *square);
            }
        }
        let believed = self.channels.iter().filter(|c| !c.left_out).count();
        let may_leave = NS - believed < Consistency::<NS>::MOST;
        let mut found = false;
        let each = self.channels.iter_mut().zip(said.iter().zip(&squares));
        for ((i, (channel, (said, square))), spread) in each.enumerate().zip(&self.relation.spread)
        {
            if channel.left_out {
                channel.agree(*said, *square, *spread);
                continue;
            }
            // A fault is in what the others say of the rest too: only the worst is blamed.
            let most = if i == worst { MOST_A_SAMPLE } else { 1.0 };
            channel.evidence += RATE * (square.min(most) - channel.evidence);
            if i == worst && channel.evidence > FAULTY && may_leave {
                channel.left_out = true;
                channel.agreed = 0;
                self.times = self.times.wrapping_add(1);
                found = true;
            }
        }
        if found {
            self.channels.iter_mut().for_each(|c| c.evidence = 0.0);
        }
        let known = read.get(worst).is_some_and(|read| plausible(*read));
        if largest > GATE && known {
            replaced += 1;
            let places = z.get_mut(worst).zip(missing.get_mut(worst));
            if let (Some((place, missing)), Some(said)) = (places, said.get(worst)) {
                (*place, *missing) = (*said, true);
            }
            if replaced > 1 {
                // It was in what stands for the others that are missing.
                self.replace(z, &missing);
            }
        }
        for (channel, z) in self.channels.iter_mut().zip(z.iter()) {
            channel.used = *z;
        }
        if replaced > Consistency::<NS>::MOST {
            *z = [f32::NAN; NS];
        }
    }

    fn left_out(&self) -> LeftOut {
        let mut channels = 0;
        for (i, channel) in self.channels.iter().enumerate().take(32) {
            channels |= u32::from(channel.left_out) << i;
        }
        LeftOut {
            channels,
            times: self.times,
        }
    }

    fn reset(&mut self) {
        *self = Self::new(self.relation);
    }
}

impl Channel {
    /// Lets a channel that is left out come back once it has agreed for long, in motion.
    #[inline(always)]
    fn agree(&mut self, said: f32, square: f32, spread: f32) {
        if square >= AGREES {
            self.agreed = 0;
            return;
        }
        if self.agreed == 0 {
            (self.from, self.moved) = (said, false);
        }
        self.moved |= (said - self.from).abs() > MOTION * spread;
        self.agreed = self.agreed.saturating_add(1);
        if self.agreed >= RETURN_SAMPLES && self.moved {
            (self.left_out, self.evidence) = (false, 0.0);
        }
    }
}
