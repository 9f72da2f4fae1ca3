//! The reference closed loop: the reference plant, and a device that holds model S.

use sinew::device::Device;
use sinew_device::protocol::{Identity, Summary, ToDevice, ToHost};
use sinew_ident::error::{Error, Result};

use crate::reference::{OUTPUTS, Plant, Reference, STEPS};

/// One control step as the device answered it.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Command, to the bit.
    pub u: Vec<f32>,
    /// Counter ticks of the step.
    pub ticks: u32,
}

/// A run from rest to Stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Identity of the device that answered.
    pub identity: Identity,
    /// Every step.
    pub steps: Vec<Record>,
    /// Counts of the device.
    pub summary: Summary,
    /// Root of the mean squared tracking error, all outputs pooled, scaled units.
    pub tracking_rms: f64,
}

impl Run {
    /// FNV-1a over the bits of every command, in order.
    pub fn command_hash(&self) -> u64 {
        let commands = self.steps.iter().flat_map(|step| &step.u);
        hash(commands.map(|u| u.to_bits()))
    }
}

/// FNV-1a over words, low bytes first.
pub fn hash(words: impl Iterator<Item = u32>) -> u64 {
    words
        .flat_map(u32::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        })
}

/// Samples of the reference problem.
pub fn sample(seq: usize, y: [f64; OUTPUTS], reference: &Reference, horizon: usize) -> ToDevice {
    let rows = reference.preview(seq, horizon);
    ToDevice::Sample {
        seq: seq as u32,
        y: y.iter().map(|y| *y as f32).collect(),
        s: heapless::Vec::new(),
        reference: rows.iter().flatten().copied().collect(),
    }
}

/// Closes the loop for the whole reference run and stops the device.
///
/// # Errors
/// The device answers out of turn or not at all.
pub fn run(device: &mut Device) -> Result<Run> {
    let reference = Reference::load().map_err(Error::failed)?;
    let identity = device.hello(None)?;
    device.arm()?;
    let mut plant = Plant::default();
    let mut steps = Vec::with_capacity(STEPS);
    let mut squares = 0.0;
    for k in 0..STEPS {
        let y = plant.outputs();
        for (y, r) in y.iter().zip(reference.at(k)) {
            squares += (y - f64::from(r)).powi(2);
        }
        let question = sample(k, y, &reference, usize::from(identity.horizon));
        let (u, ticks) = match device.ask(&question)? {
            ToHost::Command { seq, u, ticks, .. } if seq == k as u32 => (u, ticks),
            other => return Err(answered(&format!("sample {k}"), &other)),
        };
        let &[u1, u2] = u.as_slice() else {
            return Err(Error::failed(format!(
                "step {k}: {} commands instead of 2",
                u.len()
            )));
        };
        plant.advance([f64::from(u1), f64::from(u2)]);
        steps.push(Record {
            u: u.to_vec(),
            ticks,
        });
    }
    let summary = match device.ask(&ToDevice::Stop)? {
        ToHost::Done(summary) => summary,
        other => return Err(answered("Stop", &other)),
    };
    Ok(Run {
        identity,
        steps,
        summary,
        tracking_rms: (squares / (STEPS * OUTPUTS) as f64).sqrt(),
    })
}

fn answered(question: &str, answer: &ToHost) -> Error {
    Error::failed(format!("{question} was answered by {answer:?}"))
}
