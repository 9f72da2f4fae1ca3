//! probe-rs: finding, checking, flashing, listening.

use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use defmt_decoder::{DecodeError, Table};
use probe_rs::architecture::arm::ArmError;
use probe_rs::flashing::{
    DownloadOptions, ElfLoader, FlashError, FlashProgress, download_file_with_options,
};
use probe_rs::probe::DebugProbeError;
use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::rtt::Rtt;
use probe_rs::{MemoryInterface, Permissions, Session};

use super::{Options, Trouble};
use crate::error::{Error, Result};
use crate::progress::Stage;
use crate::project::Chip;

/// How long a board may take to set up its log.
const LOG_PATIENCE: Duration = Duration::from_secs(3);

pub(super) fn list() -> Vec<String> {
    Lister::new()
        .list_all_with_access()
        .iter()
        .map(named)
        .collect()
}

fn named(item: &ProbeListItem) -> String {
    let serial = item
        .info
        .serial_number
        .as_deref()
        .unwrap_or("no serial number");
    format!("{} ({serial})", item.info.identifier)
}

pub(super) fn flash(chip: &Chip, image: &Path, options: &Options) -> Result<()> {
    let stage = Stage::begin(format!("flash {}", chip.name), false);
    let probe = choose(Lister::new().list_all_with_access(), options)?;
    let probe = probe.info.open().map_err(|e| sorted(&e.into()))?;
    let permissions = match options.unlock {
        true => Permissions::new().allow_erase_all(),
        false => Permissions::new(),
    };
    let mut session = probe
        .attach(chip.name, permissions)
        .map_err(|e| sorted(&e))?;
    identify(&mut session, chip)?;
    let mut download = DownloadOptions::new();
    download.progress = FlashProgress::empty();
    download.verify = true;
    download_file_with_options(&mut session, image, ElfLoader::default(), download)
        .map_err(|e| Trouble::Other(chain(&e)))?;
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    core.reset().map_err(|e| sorted(&e))?;
    drop(core);
    stage.end("flashed and verified");
    if options.no_log {
        return Ok(());
    }
    listen(&mut session, image)
}

/// The probe that was asked for, or the only one.
fn choose(
    mut probes: Vec<ProbeListItem>,
    options: &Options,
) -> std::result::Result<ProbeListItem, Trouble> {
    let names: Vec<String> = probes.iter().map(named).collect();
    let index = match &options.select {
        _ if probes.is_empty() => return Err(Trouble::NoProbe),
        None if probes.len() > 1 => return Err(Trouble::Several { probes: names }),
        None => 0,
        Some(chosen) => {
            let is_it = |item: &ProbeListItem| item.info.serial_number.as_ref() == Some(chosen);
            match probes.iter().position(is_it) {
                Some(index) => index,
                None => {
                    let chosen = chosen.clone();
                    return Err(Trouble::NotThere {
                        chosen,
                        probes: names,
                    });
                }
            }
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
fn identify(session: &mut Session, chip: &Chip) -> Result<()> {
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let id = chip.identification;
    let found = core.read_word_32(id.address).map_err(|e| sorted(&e))?;
    if found & id.mask != id.value {
        let expected = chip.name;
        return Err(Trouble::OtherChip { expected, found }.into());
    }
    Ok(())
}

/// probe-rs's error as one of ours.
fn sorted(error: &probe_rs::Error) -> Trouble {
    use probe_rs::Error as E;
    match error {
        E::MissingPermissions(_) | E::Arm(ArmError::MissingPermissions(_)) => Trouble::Locked,
        E::Probe(DebugProbeError::TargetNotFound)
        | E::Arm(ArmError::Probe(DebugProbeError::TargetNotFound)) => Trouble::NoChip,
        other => Trouble::Other(chain(other)),
    }
}

/// An error with its causes, in one line.
fn chain(error: &dyn std::error::Error) -> String {
    let mut words = error.to_string();
    let mut next = error.source();
    while let Some(source) = next {
        words = format!("{words}: {source}");
        next = source.source();
    }
    words.replace('\n', " ")
}

/// The log over RTT, until Ctrl-C ends the program.
fn listen(session: &mut Session, image: &Path) -> Result<()> {
    let data = std::fs::read(image).map_err(|e| Error::read(image, e))?;
    let table = Table::parse(&data)
        .map_err(|e| Error::file(image, format!("its log strings cannot be read: {e}")))?
        .ok_or_else(|| Error::file(image, "no log strings"))?;
    let mut decoder = table.new_stream_decoder();
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let until = Instant::now() + LOG_PATIENCE;
    let mut rtt = loop {
        match Rtt::attach(&mut core) {
            Ok(rtt) => break rtt,
            Err(_) if Instant::now() < until => std::thread::sleep(Duration::from_millis(50)),
            Err(error) => return Err(Trouble::Other(chain(&error)).into()),
        }
    };
    let mut buffer = [0; 1024];
    loop {
        let Some(channel) = rtt.up_channel(0) else {
            return Err(Trouble::Other("the firmware has no log channel".into()).into());
        };
        let n = channel
            .read(&mut core, &mut buffer)
            .map_err(|e| Trouble::Other(chain(&e)))?;
        decoder.received(&buffer[..n]);
        loop {
            match decoder.decode() {
                Ok(frame) => println!("{}", frame.display(true)),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) if table.encoding().can_recover() => {}
                Err(DecodeError::Malformed) => {
                    return Err(Trouble::Other("the log is damaged".into()).into());
                }
            }
        }
        let _ = std::io::stdout().flush();
        if n == 0 {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// What can be known without a board: that the loader takes the image for this chip.
///
/// # Errors
/// probe-rs does not know the chip, or the image does not fit its memories.
#[cfg(test)]
fn accepts(chip: &Chip, image: &[u8]) -> std::result::Result<u64, FlashError> {
    use object::{Object, ObjectSegment};
    use probe_rs::config::Registry;
    let target = Registry::from_builtin_families()
        .get_target_by_name(chip.name)
        .unwrap_or_else(|e| panic!("{}: {e}", chip.name));
    let mut loader = target.flash_loader();
    let file = object::File::parse(image).expect("an ELF file");
    let mut bytes = 0;
    for segment in file.segments() {
        let object::SegmentFlags::Elf { .. } = segment.flags() else {
            continue;
        };
        let data = segment.data().expect("in the file");
        if !data.is_empty() {
            loader.add_data(segment.address(), data)?;
            bytes += data.len() as u64;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Board;
    use probe_rs::config::{MemoryRegion, Registry};

    #[test]
    fn the_chips_are_known_and_their_memories_are_those_of_the_table() {
        for board in Board::ALL {
            let Some(chip) = board.chip() else { continue };
            let target = Registry::from_builtin_families()
                .get_target_by_name(chip.name)
                .unwrap_or_else(|e| panic!("{}: {e}", chip.name));
            let inside = |origin: u32, bytes: u32, ram: bool| {
                let range = u64::from(origin)..u64::from(origin) + u64::from(bytes);
                target.memory_map.iter().any(|region| match region {
                    MemoryRegion::Nvm(nvm) if !ram => nvm.range == range,
                    MemoryRegion::Ram(area) if ram => {
                        area.range.start <= range.start && range.end <= area.range.end
                    }
                    _ => false,
                })
            };
            assert!(
                inside(chip.flash_origin, chip.flash_bytes, false),
                "{}: flash {:?}",
                chip.name,
                target.memory_map
            );
            assert!(
                inside(chip.ram_origin, chip.ram_bytes, true),
                "{}: RAM {:?}",
                chip.name,
                target.memory_map
            );
        }
    }

    #[test]
    fn the_loader_takes_the_boards_images_and_no_other() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let built = |board: Board| {
            let cache = root.join("target/boards");
            let built =
                crate::project::compile(&root, board, &cache).unwrap_or_else(|e| panic!("{e}"));
            std::fs::read(built.lockstep).expect("built")
        };
        let images = [built(Board::Stm32f446), built(Board::Nrf52840)];
        let chips = [Board::Stm32f446, Board::Nrf52840].map(|board| board.chip().expect("a chip"));
        for (image, chip) in images.iter().zip(chips) {
            let bytes = accepts(chip, image).unwrap_or_else(|e| panic!("{}: {e}", chip.name));
            assert!(bytes > 10_000, "{}: only {bytes} bytes", chip.name);
        }
        // The flash of an STM32 is no memory of an nRF52840.
        assert!(accepts(chips[1], &images[0]).is_err());
    }

    #[test]
    fn no_probe_and_too_many_are_told_apart() {
        let options = Options::default();
        assert_eq!(choose(Vec::new(), &options).err(), Some(Trouble::NoProbe));
        let locked = probe_rs::Error::MissingPermissions("erase_all".into());
        assert_eq!(sorted(&locked), Trouble::Locked);
        let nothing = probe_rs::Error::Probe(DebugProbeError::TargetNotFound);
        assert_eq!(sorted(&nothing), Trouble::NoChip);
    }
}
