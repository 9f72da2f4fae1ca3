//! What can be known without a board.

use probe_rs::probe::DebugProbeError;

use crate::attach::{choose, sorted};
use crate::{Options, Trouble};

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
