//! Checks of our boards without one: probe-rs knows the chips, and its loader takes the
//! images.

use object::{Object, ObjectSegment};
use probe_rs::config::{MemoryRegion, Registry};
use probe_rs::flashing::FlashError;

#[path = "../../../codegen/nn/src/footprint/chip.rs"]
#[allow(dead_code, reason = "currents and clocks are of no interest here")]
mod chip;
use chip::{Chip, NRF52840, STM32F446};

fn target(chip: &Chip) -> probe_rs::Target {
    let known = Registry::from_builtin_families().get_target_by_name(chip.name);
    known.unwrap_or_else(|e| panic!("{}: {e}", chip.name))
}

#[test]
fn the_chips_are_known_and_their_memories_are_those_of_the_table() {
    for chip in &[STM32F446, NRF52840] {
        let map = target(chip).memory_map;
        let range = |origin: u32, bytes: u32| {
            let origin = u64::from(origin);
            origin..origin + u64::from(bytes)
        };
        let flash = range(chip.flash_origin, chip.flash_bytes);
        let ram = range(chip.ram_origin, chip.ram_bytes);
        let is_flash =
            |region: &MemoryRegion| matches!(region, MemoryRegion::Nvm(nvm) if nvm.range == flash);
        let holds_ram = |region: &MemoryRegion| matches!(region, MemoryRegion::Ram(area) if area.range.start <= ram.start && ram.end <= area.range.end);
        assert!(map.iter().any(is_flash), "{}: {map:?}", chip.name);
        assert!(map.iter().any(holds_ram), "{}: {map:?}", chip.name);
    }
}

/// The bytes that the loader would write.
fn accepts(chip: &Chip, image: &[u8]) -> Result<u64, FlashError> {
    let mut loader = target(chip).flash_loader();
    let file = object::File::parse(image).expect("an ELF file");
    let mut bytes = 0;
    for segment in file.segments() {
        let data = segment.data().expect("in the file");
        let object::SegmentFlags::Elf { .. } = segment.flags() else {
            continue;
        };
        if !data.is_empty() {
            loader.add_data(segment.address(), data)?;
            bytes += data.len() as u64;
        }
    }
    Ok(bytes)
}

#[test]
fn the_loader_takes_the_boards_images_and_no_other() {
    // Linked by `cargo xtask boards`, which runs this afterwards.
    let built = std::env::var_os("SINEW_BOARD_IMAGES").map(std::path::PathBuf::from);
    let Some(folder) = built else {
        println!("SKIPPED: no images (SINEW_BOARD_IMAGES names their folder; cargo xtask boards)");
        return;
    };
    let image = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    };
    let images = ["sinew-board-stm32f446", "sinew-board-nrf52840"].map(image);
    let chips = [&STM32F446, &NRF52840];
    for (image, chip) in images.iter().zip(chips) {
        let bytes = accepts(chip, image).unwrap_or_else(|e| panic!("{}: {e}", chip.name));
        assert!(bytes > 10_000, "{}: only {bytes} bytes", chip.name);
    }
    // The flash of an STM32 is no memory of an nRF52840.
    assert!(accepts(chips[1], &images[0]).is_err());
}
