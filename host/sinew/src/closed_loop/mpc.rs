//! The predictive controller on a device, run like any other.

use heapless::Vec as FixedVec;
use sinew_device::protocol::{Health, Identity, Parameters, ToDevice, ToHost};
use sinew_model::spec::ControlSpec;
use sinew_mpc::status::Status;

use crate::closed_loop::reference::Reference;
use crate::closed_loop::scenario::Controller;
use crate::device::Device;
use sinew_ident::error::{Error, Result};

/// Answer of the device to one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Bits of the commands.
    pub bits: Vec<u32>,
    /// Status of the solver.
    pub status: Status,
    /// Newton iterations.
    pub iterations: u8,
    /// Cost of the plan.
    pub cost: f32,
    /// Ticks of the device's counter spent in the step.
    pub ticks: u32,
}

/// A device that controls.
pub struct MpcController<'a> {
    device: &'a mut Device,
    identity: Identity,
    sensed: bool,
    /// Steps between two questions what the device has learned; `None`: it is not asked.
    learned_every: Option<usize>,
    /// Parameters that the device estimates, each with the step after which it told them.
    pub learned: Vec<(usize, Parameters)>,
    /// One entry a step.
    pub answers: Vec<Answer>,
    /// Ticks of a board that paces itself for which the sample came too late.
    pub late: usize,
}

/// Weights that a session may change while it runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// Q, one an output.
    pub tracking_weight: Vec<f64>,
    /// Lambda, one an input.
    pub move_suppression: Vec<f64>,
    /// Gain of the disturbance estimate.
    pub disturbance_gain: f64,
    /// Newton iterations a step.
    pub iterations: u8,
}

impl Weights {
    /// Those of a model.
    pub fn of(control: &ControlSpec) -> Self {
        Self {
            tracking_weight: control.tracking_weight.clone(),
            move_suppression: control.move_suppression.clone(),
            disturbance_gain: control.disturbance_gain,
            iterations: control.iterations,
        }
    }
}

fn fixed<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    what: &str,
) -> Result<FixedVec<f32, N>> {
    let mut fixed = FixedVec::new();
    for value in values {
        fixed
            .push(value as f32)
            .map_err(|_| Error::failed(format!("more than {N} {what} in one frame")))?;
    }
    Ok(fixed)
}

impl<'a> MpcController<'a> {
    /// Takes over a device that has just started; refuses one that does not carry `model`.
    ///
    /// # Errors
    /// The device does not answer, or is not the one.
    pub fn new(device: &'a mut Device, model: u32) -> Result<Self> {
        let identity = device.hello(Some(model))?;
        device.arm()?;
        Ok(Self {
            device,
            identity,
            sensed: false,
            learned_every: None,
            learned: Vec::new(),
            answers: Vec::new(),
            late: 0,
        })
    }

    /// The device gets no reading of an output if `sensed`: a soft sensor says them.
    #[must_use]
    pub const fn sensed(mut self, sensed: bool) -> Self {
        self.sensed = sensed;
        self
    }

    /// Asks every so many steps what the device has learned. For a model that estimates parameters.
    #[must_use]
    pub fn learning(mut self, every: usize) -> Self {
        self.learned_every = Some(every.max(1));
        self
    }

    /// Asks what the device has learned after step `k`. One that refuses, as firmware of an earlier
    /// version does, is not asked again.
    fn learn(&mut self, k: usize) -> Result<()> {
        self.device.send(&ToDevice::Parameters)?;
        loop {
            match self.device.receive()? {
                ToHost::Parameters(known) => {
                    self.learned.push((k, known));
                    return Ok(());
                }
                ToHost::Refused { .. } => {
                    self.learned_every = None;
                    return Ok(());
                }
                // A board that paces itself: a tick that came while it was asked.
                ToHost::Command { .. } => self.late += 1,
                other => {
                    return Err(Error::failed(format!(
                        "Parameters was answered by {other:?}"
                    )));
                }
            }
        }
    }

    /// Channels that the device leaves out.
    ///
    /// # Errors
    /// The device judges none, or cannot be reached.
    pub fn health(&mut self) -> Result<Health> {
        match self.device.ask(&ToDevice::Health)? {
            ToHost::Health(health) => Ok(health),
            other => Err(Error::failed(format!("Health was answered by {other:?}"))),
        }
    }

    /// Replaces the weights.
    ///
    /// # Errors
    /// The device refuses them.
    pub fn tune(&mut self, weights: &Weights) -> Result<()> {
        self.device.ask(&ToDevice::Tune {
            tracking_weight: fixed(weights.tracking_weight.iter().copied(), "outputs")?,
            move_suppression: fixed(weights.move_suppression.iter().copied(), "inputs")?,
            disturbance_gain: weights.disturbance_gain as f32,
            iterations: weights.iterations,
        })?;
        Ok(())
    }
}

impl Controller for MpcController<'_> {
    fn command(
        &mut self,
        k: usize,
        y: &[f64],
        s: &[f64],
        reference: &Reference,
    ) -> Result<Vec<f64>> {
        let horizon = usize::from(self.identity.horizon);
        let y = y.iter().map(|y| if self.sensed { f64::NAN } else { *y });
        let preview = (1..=horizon).flat_map(|j| reference.row(k + j).iter().copied());
        let sample = ToDevice::Sample {
            seq: k as u32,
            y: fixed(y, "outputs")?,
            s: fixed(s.iter().copied(), "channels")?,
            reference: fixed(preview, "values of the reference")?,
        };
        self.device.send(&sample)?;
        let (u, status, iterations, cost, ticks) = loop {
            match self.device.receive()? {
                ToHost::Command {
                    seq,
                    u,
                    status,
                    iterations,
                    cost,
                    ticks,
                    ..
                } if seq == k as u32 => break (u, status, iterations, cost, ticks),
                // A board that paces itself: a tick for which this sample came too late.
                ToHost::Command { seq, .. } if seq.wrapping_add(1) == k as u32 => self.late += 1,
                other => {
                    return Err(Error::failed(format!(
                        "sample {k} was answered by {other:?}"
                    )));
                }
            }
        };
        let bits = u.iter().map(|v| v.to_bits()).collect();
        self.answers.push(Answer {
            bits,
            status,
            iterations,
            cost,
            ticks,
        });
        if self
            .learned_every
            .is_some_and(|every| (k + 1).is_multiple_of(every))
        {
            self.learn(k)?;
        }
        Ok(u.iter().map(|v| f64::from(*v)).collect())
    }
}
