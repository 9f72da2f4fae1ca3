//! From "there may be a probe" to a session with the right chip.

use std::time::{Duration, Instant};

use probe_rs::architecture::arm::ArmError;
use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeError, Probe};
use probe_rs::rtt::Rtt;
use probe_rs::{Core, MemoryInterface, Permissions, Session};

use crate::{Chip, Options, Trouble};

/// Longest time that a board may take to set up its channels after a reset.
const PATIENCE: Duration = Duration::from_secs(3);

/// The probes that are connected, a line each.
pub fn list() -> Vec<String> {
    let all = Lister::new().list_all_with_access();
    all.iter().map(named).collect()
}

fn named(item: &ProbeListItem) -> String {
    let serial = item.info.serial_number.as_deref();
    let serial = serial.unwrap_or("no serial number");
    format!("{} ({serial})", item.info.identifier)
}

/// A session with `chip`, and no other.
pub(crate) fn attach(chip: &Chip, options: &Options) -> Result<Session, Trouble> {
    let probe = choose(Lister::new().list_all_with_access(), options)?;
    let probe = probe.info.open().map_err(|e| sorted(&e.into()))?;
    session(probe, chip, options)
}

/// The same by a probe that is open.
pub(crate) fn session(probe: Probe, chip: &Chip, options: &Options) -> Result<Session, Trouble> {
    let permissions = if options.unlock {
        Permissions::new().allow_erase_all()
    } else {
        Permissions::new()
    };
    let mut session = probe
        .attach(chip.name, permissions)
        .map_err(|e| sorted(&e))?;
    identify(&mut session, chip)?;
    Ok(session)
}

/// The probe that was asked for, or the only one.
pub(crate) fn choose(
    mut probes: Vec<ProbeListItem>,
    options: &Options,
) -> Result<ProbeListItem, Trouble> {
    let names: Vec<String> = probes.iter().map(named).collect();
    let index = match &options.select {
        _ if probes.is_empty() => return Err(Trouble::NoProbe),
        None if probes.len() > 1 => return Err(Trouble::Several { probes: names }),
        None => 0,
        Some(chosen) => {
            let is_it = |item: &ProbeListItem| item.info.serial_number.as_ref() == Some(chosen);
            let index = probes.iter().position(is_it);
            index.ok_or_else(|| Trouble::NotThere {
                chosen: chosen.clone(),
                probes: names,
            })?
        }
    };
    let probe = probes.swap_remove(index);
    match probe.accessibility {
        Accessibility::Accessible => Ok(probe),
        Accessibility::PermissionDenied => Err(Trouble::NotAllowed {
            probe: named(&probe),
        }),
    }
}

/// The part number that the chip itself says.
fn identify(session: &mut Session, chip: &Chip) -> Result<(), Trouble> {
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let found = core.read_word_32(chip.address).map_err(|e| sorted(&e))?;
    if found & chip.mask == chip.value {
        Ok(())
    } else {
        Err(Trouble::OtherChip {
            expected: chip.name,
            found,
        })
    }
}

/// The firmware's channels in RAM; waited for, since a board that was just reset has none yet.
pub(crate) fn channels(core: &mut Core<'_>) -> Result<Rtt, Trouble> {
    let until = Instant::now() + PATIENCE;
    loop {
        match Rtt::attach(core) {
            Ok(rtt) => return Ok(rtt),
            Err(_) if Instant::now() < until => std::thread::sleep(Duration::from_millis(50)),
            Err(probe_rs::rtt::Error::ControlBlockNotFound) => {
                return Err(Trouble::NoChannel { channel: "RTT" });
            }
            Err(error) => return Err(Trouble::Other(chain(&error))),
        }
    }
}

/// probe-rs's error as one of ours.
pub(crate) fn sorted(error: &probe_rs::Error) -> Trouble {
    use probe_rs::Error as E;
    match error {
        E::MissingPermissions(_) | E::Arm(ArmError::MissingPermissions(_)) => Trouble::Locked,
        E::Probe(DebugProbeError::TargetNotFound)
        | E::Arm(ArmError::Probe(DebugProbeError::TargetNotFound)) => Trouble::NoChip,
        other => Trouble::Other(chain(other)),
    }
}

/// An error with its causes, in one line.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut words = error.to_string();
    let mut next = error.source();
    while let Some(source) = next {
        words = format!("{words}: {source}");
        next = source.source();
    }
    words.replace('\n', " ")
}
