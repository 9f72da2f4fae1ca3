//! `sinew wire`, and a wiring on its way into the firmware's sources.

use crate::desk::{Desk, checkout};

#[test]
fn a_first_wiring_is_filled_in_checked_and_drawn() {
    let desk = Desk::new();
    desk.bring("rigs/demo.toml");
    let said = desk.succeed("wire demo.toml --board stm32f446");
    assert_eq!(
        said,
        "demo.wiring.toml\n\
         next: fill in what is nan, then sinew wire demo.toml --check demo.wiring.toml\n"
    );
    let again = desk.refusal("wire demo.toml --board stm32f446");
    assert!(
        again.contains("demo.wiring.toml is there already"),
        "{again}"
    );
    let unfilled = desk.refusal("wire demo.toml --check demo.wiring.toml");
    insta::assert_snapshot!(unfilled);

    let text = desk.read("demo.wiring.toml");
    let text = text.replace("at_zero = nan", "at_zero = -0.4");
    desk.write(
        "demo.wiring.toml",
        &text.replace("at_full = nan", "at_full = 0.4"),
    );
    let said = desk.succeed("wire demo.toml --check demo.wiring.toml --picture wiring.svg");
    assert_eq!(
        said,
        "q_m  PA0    A0\n\
         u_N  PA8    D7\n\
         wiring.svg\n\
         next: sinew flash --board stm32f446 --model DIR --wiring demo.wiring.toml\n"
    );
    assert!(desk.read("wiring.svg").contains("q_m, 0 to 3.3 V"));
}

#[test]
fn all_faults_of_a_wiring_are_said_at_once() {
    let desk = Desk::new();
    desk.bring("rigs/demo.toml")
        .bring("docs/reference/demo.wiring.toml");
    let text = desk.read("demo.wiring.toml");
    let text = text.replace("q_m", "q_mm").replace("PB10", "PB5");
    desk.write("demo.wiring.toml", &text);
    insta::assert_snapshot!(desk.refusal("wire demo.toml --check demo.wiring.toml"));
    let other = desk.refusal("wire demo.toml --board host");
    assert!(
        other.contains("`host` cannot be wired: there are stm32f446, nrf52840"),
        "{other}"
    );
}

/// Six high-voltage channels take two timers of the one chip and two units of the other.
#[test]
fn the_hasel_platform_is_wired_to_both_boards() {
    let desk = Desk::new();
    desk.bring("rigs/hasel.toml");
    for (board, last) in [
        ("stm32f446", "u6_kV  PC7    D9"),
        ("nrf52840", "u6_kV  P1.15  D13"),
    ] {
        let file = format!("{board}.wiring.toml");
        desk.succeed(&format!("wire hasel.toml --board {board} --out {file}"));
        let text = desk.read(&file).replace("at_zero = nan", "at_zero = -0.02");
        desk.write(&file, &text.replace("at_full = nan", "at_full = 0.02"));
        let said = desk.succeed(&format!("wire hasel.toml --check {file}"));
        assert!(said.contains(last), "{said}");
    }
}

#[test]
fn emit_puts_a_wiring_into_the_sources_of_its_board() {
    let desk = Desk::new();
    desk.bring("docs/reference/demo.wiring.toml");
    let model = checkout().join("models/demo-state");
    let model = model.display();
    desk.succeed(&format!("emit {model} --out plain"));
    desk.succeed(&format!(
        "emit {model} --out wired --wiring demo.wiring.toml"
    ));
    let scales = desk.read("wired/boards/runtime/src/scales.rs");
    assert!(scales.contains("unit_per_count: 2.5e-5"), "{scales}");
    let pins = desk.read("wired/boards/stm32f446/src/pins.rs");
    assert!(pins.contains("encoder3($p.TIM3, $p.PA6, $p.PA7)"), "{pins}");
    // Only those two differ, and a plain emit later takes them back.
    for file in [
        "boards/stm32f446/src/drivers.rs",
        "boards/runtime/src/wiring.rs",
    ] {
        assert_eq!(
            desk.read(&format!("plain/{file}")),
            desk.read(&format!("wired/{file}"))
        );
    }
    desk.succeed(&format!("emit {model} --out wired"));
    let file = "boards/stm32f446/src/pins.rs";
    assert_eq!(
        desk.read(&format!("plain/{file}")),
        desk.read(&format!("wired/{file}"))
    );

    let text = desk.read("demo.wiring.toml").replace("u_N", "u_V");
    desk.write("demo.wiring.toml", &text);
    let refused = desk.refusal(&format!(
        "emit {model} --out none --wiring demo.wiring.toml"
    ));
    assert!(refused.contains("`u_N` is not wired"), "{refused}");
    assert!(!desk.path("none").exists());
}

#[test]
fn emit_puts_a_wiring_into_the_pins_of_the_board_that_it_names() {
    let desk = Desk::new();
    desk.bring("docs/reference/demo.wiring.toml");
    let text = desk.read("demo.wiring.toml");
    let text = text
        .replace("stm32f446", "nrf52840")
        .replace("PA6", "P1.01")
        .replace("PA7", "P1.02")
        .replace("PA8", "P1.10")
        .replace("PB10", "P1.11");
    desk.write("demo.wiring.toml", &text);
    let model = checkout().join("models/demo-state");
    let model = model.display();
    desk.succeed(&format!("emit {model} --out plain"));
    desk.succeed(&format!(
        "emit {model} --out wired --wiring demo.wiring.toml"
    ));
    let pins = desk.read("wired/boards/nrf52840/src/pins.rs");
    assert!(
        pins.contains("decoder($p.QDEC, $p.P1_01, $p.P1_02)"),
        "{pins}"
    );
    let other = "boards/stm32f446/src/pins.rs";
    assert_eq!(
        desk.read(&format!("plain/{other}")),
        desk.read(&format!("wired/{other}"))
    );
}
