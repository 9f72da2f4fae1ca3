//! Checks without a board.

use probe_rs::integration::FakeProbe;
use probe_rs::probe::DebugProbeError;

use crate::attach::{choose, session, sorted};
use crate::{Chip, Options, Trouble};

#[test]
fn no_probe_no_chip_and_a_locked_one_are_told_apart() {
    let options = Options::default();
    assert_eq!(choose(Vec::new(), &options).err(), Some(Trouble::NoProbe));
    let locked = probe_rs::Error::MissingPermissions("erase_all".into());
    assert_eq!(sorted(&locked), Trouble::Locked);
    let nothing = probe_rs::Error::Probe(DebugProbeError::TargetNotFound);
    assert_eq!(sorted(&nothing), Trouble::NoChip);
}

#[test]
fn each_trouble_is_one_line_and_one_remedy() {
    let two = || vec!["ST-Link (066A)".to_string(), "J-Link (683)".to_string()];
    let all = [
        Trouble::NoProbe,
        Trouble::NotAllowed {
            probe: "ST-Link (066A)".into(),
        },
        Trouble::Several { probes: two() },
        Trouble::NotThere {
            chosen: "1".into(),
            probes: two(),
        },
        Trouble::NoChip,
        Trouble::OtherChip {
            expected: "STM32F446RETx",
            found: 0x413,
        },
        Trouble::Locked,
        Trouble::NoChannel { channel: "RTT" },
        Trouble::Other("the flash could not be erased".into()),
    ];
    let lines = all.iter().map(|trouble| {
        let (message, help) = trouble.told();
        assert!(!message.contains('\n') && !help.contains('\n'), "{message}");
        format!("{message}\n  help: {help}\n")
    });
    insta::assert_snapshot!(lines.collect::<String>());
}

/// Attaches by a probe that does not exist, to a core with `image` in its memory and zeros
/// elsewhere.
fn by_fake_probe(image: &std::path::Path, chip: &Chip) -> Result<(), Trouble> {
    let probe = FakeProbe::with_mocked_core_and_binary(image).into_probe();
    session(probe, chip, &Options::default()).map(|_| ())
}

#[test]
fn a_session_begins_with_the_right_chip_and_no_other() {
    let Some(folder) = std::env::var_os("SINEW_BOARD_IMAGES") else {
        println!("SKIPPED: no images (SINEW_BOARD_IMAGES names their folder; cargo xtask boards)");
        return;
    };
    let image = std::path::Path::new(&folder).join("sinew-board-stm32f446");
    // The fake core has no registers, but flash: its first word is the image's first stack pointer,
    // the top of RAM.
    let is = |value: u32| Chip {
        name: "STM32F446RETx",
        address: 0x0800_0000,
        mask: 0xFFFF_FFFF,
        value,
    };
    assert_eq!(by_fake_probe(&image, &is(0x2002_0000)), Ok(()));
    let other = Trouble::OtherChip {
        expected: "STM32F446RETx",
        found: 0x2002_0000,
    };
    assert_eq!(by_fake_probe(&image, &is(0x421)), Err(other));
}

#[test]
fn without_a_probe_there_is_no_line() {
    let probes = crate::list();
    if !probes.is_empty() {
        println!("SKIPPED: connected are {probes:?}");
        return;
    }
    let chip = Chip {
        name: "nRF52840_xxAA",
        address: 0x1000_0100,
        mask: 0xFFFF_FFFF,
        value: 0x0005_2840,
    };
    let line = crate::line(&chip, &Options::default());
    assert_eq!(line.err(), Some(Trouble::NoProbe));
}
