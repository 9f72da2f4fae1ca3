//! Frames between host and firmware: postcard, CRC-32, COBS, a zero at the end
//! (docs/reference/protocol.md). The same frames on every transport; both ends use this module.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};
use heapless::Vec;
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

use crate::mode::{Drive, State};
use sinew_mpc::status::Status;

/// Version of this protocol; a host refuses a device that says another.
pub const PROTOCOL: u16 = 2;

/// Most inputs, most outputs.
pub const MAX_SIGNALS: usize = 8;
/// Most sensor channels.
pub const MAX_CHANNELS: usize = 32;
/// Most values in a reference preview, N rows of n_y.
pub const MAX_PREVIEW: usize = 128;
/// Longest flattened regressor.
pub const MAX_REGRESSOR: usize = 128;
/// Most derivatives in a [`ToHost::Prediction`].
pub const MAX_JACOBIAN: usize = 256;
/// Longest frame, overheads and terminator included.
pub const MAX_FRAME: usize = 1088;

/// The bitwise CRC: no table in flash; a frame is short and the link is slower.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
const CRC_BYTES: usize = 4;

/// Message from the host. Each frame is answered by exactly one of [`ToHost`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the large one in"
)]
pub enum ToDevice {
    /// Request for the device's identity. Answer: [`ToHost::Hello`].
    Hello,
    /// One step of control, physical units. Answer: [`ToHost::Command`].
    Sample {
        /// Comes back in the answer.
        seq: u32,
        /// Measured outputs; NaN: missing.
        y: Vec<f32, MAX_SIGNALS>,
        /// Sensor channels.
        s: Vec<f32, MAX_CHANNELS>,
        /// r(k+1), r(k+2), ..., each whole. One row at least; the last row holds to the horizon.
        reference: Vec<f32, MAX_PREVIEW>,
    },
    /// Replaces the weights. Answer: [`ToHost::Tuned`].
    Tune {
        /// Q.
        tracking_weight: Vec<f32, MAX_SIGNALS>,
        /// Lambda.
        move_suppression: Vec<f32, MAX_SIGNALS>,
        /// 0 to 1.
        disturbance_gain: f32,
        /// Newton iterations.
        iterations: u8,
    },
    /// Asks the bare network, model units. Answer: [`ToHost::Prediction`].
    Probe {
        /// u(k) .. u(k-nd+1), y(k) .. y(k-dd+1), channels; each vector whole.
        x: Vec<f32, MAX_REGRESSOR>,
    },
    /// Forgets history, plan and disturbance, not the command applied last. Answer:
    /// [`ToHost::Tuned`].
    Reset,
    /// The run is over. Answer: [`ToHost::Done`].
    Stop,
    /// Lets commands be given; from disarmed only. Answer: [`ToHost::State`].
    Arm {
        /// Source of commands.
        drive: Drive,
        /// Steps over which the reference moves from where the rig is to what is asked; 0: at once.
        blend_steps: u16,
    },
    /// Ends control: to the safe command within the rate. Acknowledges an emergency stop. Answer:
    /// [`ToHost::State`].
    Disarm,
    /// The safe command at once and outputs off, until Disarm. Answer: [`ToHost::State`].
    EmergencyStop,
    /// Narrows the limits, physical units; never beyond those of the model. Answer:
    /// [`ToHost::Tuned`].
    Limit {
        /// Smallest commands.
        lower: Vec<f32, MAX_SIGNALS>,
        /// Largest commands.
        upper: Vec<f32, MAX_SIGNALS>,
        /// Largest changes in one step.
        rate: Vec<f32, MAX_SIGNALS>,
    },
    /// Reference of the board's own rig, physical units: rows from the next tick on, the last
    /// one holds. Answer: [`ToHost::Tuned`].
    Follow {
        /// As in [`ToDevice::Sample`].
        reference: Vec<f32, MAX_PREVIEW>,
    },
    /// One row of an excitation, for [`Drive::Excitation`]: one a tick. May be sent before arming.
    /// Answer: [`ToHost::Queued`], also for a row that was taken before.
    Excite {
        /// From 0 at each disarming, in order; comes back when the row is applied.
        row: u32,
        /// Command, physical units; held inside the limits.
        u: Vec<f32, MAX_SIGNALS>,
    },
    /// Period of [`ToHost::Telemetry`]: every so many ticks; 0: never. Answer:
    /// [`ToHost::State`].
    Stream {
        /// Ticks.
        every: u16,
    },
    /// Asks which channels the device believes. Answer: [`ToHost::Health`]; [`ToHost::Refused`] of
    /// a controller that judges none.
    Health,
    /// Asks what the device has learned of itself. Answer: [`ToHost::Parameters`];
    /// [`ToHost::Refused`] of a controller that estimates no parameter.
    Parameters,
}

/// Answer of the firmware.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to put the large one in"
)]
pub enum ToHost {
    /// Identity of the device.
    Hello(Identity),
    /// A control step's result.
    Command {
        /// That of the sample.
        seq: u32,
        /// Command, physical units, inside the limits.
        u: Vec<f32, MAX_SIGNALS>,
        /// Status of the control step.
        #[serde(with = "StatusOnWire")]
        status: Status,
        /// Newton iterations.
        iterations: u8,
        /// J of the plan that is followed, model units.
        cost: f32,
        /// Ticks of the board's [`crate::clock::Clock`] spent in the step.
        ticks: u32,
        /// At least one output was missing and was predicted.
        predicted: bool,
    },
    /// The network's answer to a probe, model units.
    Prediction {
        /// y(k+1).
        y: Vec<f32, MAX_SIGNALS>,
        /// n_y rows of n_u nd + n_y dd derivatives in the probe's order, channels left out. Empty
        /// where they do not fit.
        jacobian: Vec<f32, MAX_JACOBIAN>,
    },
    /// Done as asked.
    Tuned,
    /// Nothing was changed.
    Refused {
        /// Why.
        reason: Reason,
    },
    /// The run in numbers.
    Done(Summary),
    /// Operating mode, and its reason.
    State(State),
    /// A row was taken.
    Queued {
        /// Its number.
        row: u32,
        /// Rows for which there is room.
        room: u16,
    },
    /// One tick of the board's own rig. Unasked, as often as [`ToDevice::Stream`] said.
    Telemetry(Telemetry),
    /// Channels that the controller leaves out.
    Health(Health),
    /// Parameters that the controller estimates.
    Parameters(Parameters),
}

/// Parameters that a controller estimates while it runs, in the order of its model and in model
/// units: 0 is the usual device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Estimates.
    pub theta: Vec<f32, MAX_SIGNALS>,
    /// Their variances.
    pub variance: Vec<f32, MAX_SIGNALS>,
}

/// Channels that a controller leaves out, because the others contradict them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Bit i: channel i.
    pub left_out: u32,
    /// Number of times that one was left out since the last reset.
    pub times: u32,
}

/// One tick of the board's own rig, physical units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Ticks since start, modulo 2^32: a gap is a frame that was lost.
    pub tick: u32,
    /// The board's clock when the sensors were read, microseconds since start.
    pub at_us: u64,
    /// Operating mode.
    pub state: State,
    /// Row of the excitation that `u` came from; `None`: none did, the last command was held.
    pub row: Option<u32>,
    /// Measured outputs; NaN: missing.
    pub y: Vec<f32, MAX_SIGNALS>,
    /// Sensor channels.
    pub s: Vec<f32, MAX_CHANNELS>,
    /// Command as applied.
    pub u: Vec<f32, MAX_SIGNALS>,
    /// r(k+1).
    pub reference: Vec<f32, MAX_SIGNALS>,
    /// The estimator's newest output: the measurement, or its prediction where that was missing.
    pub estimate: Vec<f32, MAX_SIGNALS>,
    /// The estimator's disturbance, model units.
    pub disturbance: Vec<f32, MAX_SIGNALS>,
    /// Status of the control step.
    #[serde(with = "StatusOnWire")]
    pub status: Status,
    /// Newton iterations.
    pub iterations: u8,
    /// Ticks of the board's [`crate::clock::Clock`] spent in the step.
    pub ticks: u32,
    /// Steps that ended after their period, since start.
    pub deadline_misses: u32,
    /// Telemetry frames that the link had no room for, since start.
    pub dropped: u32,
}

/// [`Status`] as serde and a log see it: its variants are numbered on the wire in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(remote = "Status")]
#[allow(missing_docs, reason = "each variant is that of `Status`")]
pub enum StatusOnWire {
    Converged,
    IterationLimit,
    NoDecrease,
    BadReference,
    BadSettings,
    NotFinite,
    SignalLost,
    Disarmed,
    OpenLoop,
    CutShort,
}

impl From<Status> for StatusOnWire {
    fn from(status: Status) -> Self {
        match status {
            Status::Converged => Self::Converged,
            Status::IterationLimit => Self::IterationLimit,
            Status::NoDecrease => Self::NoDecrease,
            Status::BadReference => Self::BadReference,
            Status::BadSettings => Self::BadSettings,
            Status::NotFinite => Self::NotFinite,
            Status::SignalLost => Self::SignalLost,
            Status::Disarmed => Self::Disarmed,
            Status::OpenLoop => Self::OpenLoop,
            Status::CutShort => Self::CutShort,
        }
    }
}

/// Why a frame was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reason {
    /// CRC, COBS or content are wrong, or the frame is too long.
    Damaged,
    /// A vector's length does not fit this controller.
    Shape,
    /// A setting is out of its range.
    Settings,
    /// The session was stopped.
    Stopped,
    /// Not in this mode: arm, disarm or acknowledge first.
    Mode,
    /// No room for another row; send it again.
    Full,
    /// A row before it is missing.
    Order,
    /// Limits that are wider than the model's, or outside which the last command lies.
    Limits,
    /// This controller judges no channel.
    Judges,
    /// This controller estimates no parameter.
    Parameters,
}

/// Identity of a device. The host compares `protocol` and `model` before it sends a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// [`PROTOCOL`].
    pub protocol: u16,
    /// Hash of the model and its control problem.
    pub model: u32,
    /// Inputs.
    pub n_u: u8,
    /// Outputs.
    pub n_y: u8,
    /// Sensor channels; what a network remembers is none.
    pub n_s: u8,
    /// Inputs in the regressor, nd.
    pub past_inputs: u8,
    /// Outputs in the regressor, dd.
    pub past_outputs: u8,
    /// N.
    pub horizon: u8,
    /// NC.
    pub control_horizon: u8,
    /// Steps per 1000 seconds.
    pub rate_mhz: u32,
}

/// A run in numbers, counted since the start of the session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Summary {
    /// Samples answered by a command.
    pub steps: u32,
    /// Steps that ended after their period, as the board counted them.
    pub deadline_misses: u32,
    /// Samples with at least one output missing.
    pub missed_samples: u32,
    /// Deepest stack, as the board measured it; 0: not measured.
    pub stack_high_water_bytes: u32,
    /// Damaged frames.
    pub frames_rejected: u32,
}

/// Why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// Not COBS, or shorter than a checksum.
    Framing,
    /// The checksum disagrees.
    Checksum,
    /// The checksum agrees, the content is not of this protocol.
    Content,
}

/// Writes `message` as one frame, terminator included, to the front of `buffer`.
///
/// `None`: the buffer is too short ([`MAX_FRAME`] never is).
#[inline(never)]
pub fn encode<'a, T: Serialize>(message: &T, buffer: &'a mut [u8]) -> Option<&'a [u8]> {
    postcard::serialize_with_flavor(message, FrameWriter::new(buffer))
        .ok()
        .flatten()
}

/// Reads one frame, its terminator taken off; the bytes are overwritten.
///
/// ```
/// use sinew_device::protocol::{FrameError, MAX_FRAME, ToDevice, decode, encode};
///
/// let mut buffer = [0; MAX_FRAME];
/// let length = encode(&ToDevice::Hello, &mut buffer).map_or(0, <[u8]>::len);
/// // One bit is flipped on the way.
/// buffer[1] ^= 0x40;
/// let received = decode::<ToDevice>(&mut buffer[..length - 1]);
/// assert!(matches!(received, Err(FrameError::Framing | FrameError::Checksum)));
/// ```
///
/// # Errors
/// [`FrameError`]; nothing is accepted whose checksum disagrees or that has bytes left over.
#[inline(never)]
pub fn decode<T: for<'de> Deserialize<'de>>(frame: &mut [u8]) -> Result<T, FrameError> {
    let length = unstuff(frame).ok_or(FrameError::Framing)?;
    let content = frame.get(..length).ok_or(FrameError::Framing)?;
    let (content, checksum) = content
        .split_last_chunk::<CRC_BYTES>()
        .ok_or(FrameError::Framing)?;
    if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
        return Err(FrameError::Checksum);
    }
    match postcard::take_from_bytes(content) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Content),
    }
}

/// Undoes COBS in place; the length of the content, `None` where the bytes are not COBS. Written
/// out here, as is its inverse below, because the library's indexing leaves panics in the linked
/// image.
fn unstuff(bytes: &mut [u8]) -> Option<usize> {
    let (mut read, mut write) = (0, 0);
    while let Some(&code) = bytes.get(read) {
        read += 1;
        for _ in 1..code {
            let byte = *bytes.get(read).filter(|byte| **byte != 0)?;
            *bytes.get_mut(write)? = byte;
            read += 1;
            write += 1;
        }
        if code == 0 {
            return None;
        }
        // A full group stands for no zero, nor does the last one.
        if code < GROUP_FULL && read < bytes.len() {
            *bytes.get_mut(write)? = 0;
            write += 1;
        }
    }
    Some(write)
}

/// Code of a COBS group of 254 bytes without a zero.
const GROUP_FULL: u8 = 0xff;

/// Postcard's output: checksum and COBS on the fly.
struct FrameWriter<'a> {
    buffer: &'a mut [u8],
    length: usize,
    /// Position of the open group's code, and the code so far.
    group: usize,
    code: u8,
    digest: Digest<'static, u32, NoTable>,
}

impl<'a> FrameWriter<'a> {
    fn new(buffer: &'a mut [u8]) -> Self {
        Self {
            buffer,
            length: 1,
            group: 0,
            code: 1,
            digest: CRC.digest(),
        }
    }

    /// One byte of content, stuffed. A full group is closed when more comes, not before.
    #[inline(never)]
    fn stuff(&mut self, byte: u8) -> Option<()> {
        if self.code == GROUP_FULL {
            self.next_group()?;
        }
        if byte == 0 {
            return self.next_group();
        }
        *self.buffer.get_mut(self.length)? = byte;
        self.length += 1;
        self.code += 1;
        Some(())
    }

    fn next_group(&mut self) -> Option<()> {
        self.close_group()?;
        self.group = self.length;
        self.length += 1;
        self.code = 1;
        Some(())
    }

    fn close_group(&mut self) -> Option<()> {
        *self.buffer.get_mut(self.group)? = self.code;
        Some(())
    }

    fn finish(mut self) -> Option<&'a [u8]> {
        let checksum = self.digest.clone().finalize();
        for byte in checksum.to_le_bytes() {
            self.stuff(byte)?;
        }
        self.close_group()?;
        *self.buffer.get_mut(self.length)? = 0;
        self.buffer.get(..=self.length)
    }
}

impl<'a> Flavor for FrameWriter<'a> {
    type Output = Option<&'a [u8]>;

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.digest.update(&[byte]);
        self.stuff(byte).ok_or(postcard::Error::SerializeBufferFull)
    }

    fn finalize(self) -> postcard::Result<Self::Output> {
        Ok(self.finish())
    }
}

/// Collects bytes until a frame is whole. Finds its feet again at the next zero after anything.
#[derive(Clone, Debug)]
pub struct Accumulator<const L: usize = MAX_FRAME> {
    buffer: [u8; L],
    length: usize,
    overflowed: bool,
}

/// Effect of one received byte.
#[derive(Debug, PartialEq)]
pub enum Fed<'a> {
    /// Nothing yet.
    Nothing,
    /// A whole frame without its terminator, for [`decode`].
    Frame(&'a mut [u8]),
    /// The end of a frame that was too long to be one.
    TooLong,
}

impl<const L: usize> Accumulator<L> {
    /// Empty.
    pub const fn new() -> Self {
        Self {
            buffer: [0; L],
            length: 0,
            overflowed: false,
        }
    }

    /// Takes one byte. Zeros between frames are nothing.
    pub fn feed(&mut self, byte: u8) -> Fed<'_> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.overflowed = true,
            }
            return Fed::Nothing;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.overflowed) {
            return Fed::TooLong;
        }
        match self.buffer.get_mut(..length) {
            Some(frame) if length > 0 => Fed::Frame(frame),
            _ => Fed::Nothing,
        }
    }

    /// The buffer, for an answer; between frames only: what was collected is dropped.
    pub fn scratch(&mut self) -> &mut [u8; L] {
        self.length = 0;
        self.overflowed = false;
        &mut self.buffer
    }
}

impl<const L: usize> Default for Accumulator<L> {
    fn default() -> Self {
        Self::new()
    }
}
