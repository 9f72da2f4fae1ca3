//! A wiring file from its first text to the sources, and everything that it is refused for.

use sinew_wiring::{
    Board, Signal, Signals, Wiring, board, check, picture, propose, sources, table,
};

fn nucleo() -> &'static Board {
    board("stm32f446").unwrap()
}

fn signal(name: &str, unit: &str, range: Option<[f64; 2]>) -> Signal {
    Signal {
        name: name.into(),
        unit: unit.into(),
        range,
    }
}

/// A cart: an encoder and a potentiometer, a motor with a half bridge.
fn cart() -> Signals {
    Signals {
        sensors: vec![signal("q_m", "m", None), signal("phi_rad", "rad", None)],
        actuators: vec![signal("u_V", "V", Some([-12.0, 12.0]))],
        rate_hz: 500.0,
    }
}

const CART: &str = r#"format = "sinew-wiring/1"
board = "stm32f446"

[[sensor]]
column = "q_m"
by = "encoder"
pins = ["PA6", "PA7"]
counts_per_unit = -20000.0
at_start = 0.1

[[sensor]]
column = "phi_rad"
by = "adc"
pin = "PA0"
at_zero = -1.5
at_full = 1.5

[[actuator]]
input = "u_V"
by = "signed"
pin = "PA9"
direction = "PB10"
at_zero = -12.0
at_full = 12.0
"#;

/// Faults of a text that reads, as lines.
fn faults(text: &str, signals: &Signals) -> Vec<String> {
    let wiring = Wiring::parse(text).expect("the wiring is TOML");
    let faults = check(&wiring, signals, nucleo()).faults;
    faults.iter().map(ToString::to_string).collect()
}

/// The one fault of the cart's text with a change.
fn fault(from: &str, to: &str) -> String {
    assert!(CART.contains(from), "{from} is not there");
    let found = faults(&CART.replacen(from, to, 1), &cart());
    assert_eq!(found.len(), 1, "{found:#?}");
    found[0].clone()
}

#[test]
fn a_first_wiring_lacks_nothing_but_the_scales_of_its_sensors() {
    let text = propose(&cart(), nucleo()).unwrap();
    let found = faults(&text, &cart());
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(
        found[0].contains("the scale of `q_m` is not given"),
        "{found:#?}"
    );
    let filled = text
        .replace("at_zero = nan", "at_zero = -1.0")
        .replace("at_full = nan", "at_full = 1.0");
    assert_eq!(faults(&filled, &cart()), [""; 0]);
}

#[test]
fn a_first_wiring_leaves_the_pins_of_encoders_free() {
    let signals = Signals {
        sensors: (0..12)
            .map(|k| signal(&format!("fibre_{k}"), "V", None))
            .collect(),
        ..cart()
    };
    let text = propose(&signals, nucleo()).unwrap();
    assert!(!text.contains("PA6") && !text.contains("PA7"), "{text}");
    let many = Signals {
        sensors: (0..15)
            .map(|k| signal(&format!("fibre_{k}"), "V", None))
            .collect(),
        ..cart()
    };
    let refused = propose(&many, nucleo()).unwrap_err().to_string();
    assert!(
        refused.contains("15 sensors and 14 analogue inputs"),
        "{refused}"
    );
}

#[test]
fn a_finger_of_eleven_fibres_and_two_servos_is_wired() {
    let analogue = [
        "PA0", "PA1", "PA4", "PB0", "PC1", "PC0", "PC2", "PC3", "PB1", "PC4", "PC5",
    ];
    let signals = Signals {
        sensors: (0..11)
            .map(|k| signal(&format!("fibre_{k}"), "V", None))
            .collect(),
        actuators: vec![
            signal("left_rad", "rad", Some([0.0, 1.5])),
            signal("right_rad", "rad", Some([0.0, 1.5])),
        ],
        rate_hz: 120.0,
    };
    let mut text = String::from("format = \"sinew-wiring/1\"\nboard = \"stm32f446\"\n");
    for (k, pin) in analogue.iter().enumerate() {
        text += &format!(
            "[[sensor]]\ncolumn = \"fibre_{k}\"\nby = \"adc\"\npin = \"{pin}\"\nat_zero = 0.0\n\
             at_full = 3.3\n"
        );
    }
    for (input, pin) in [("left_rad", "PC6"), ("right_rad", "PC7")] {
        text += &format!(
            "[[actuator]]\ninput = \"{input}\"\nby = \"servo\"\npin = \"{pin}\"\nat_zero = -0.1\n\
             at_full = 1.6\n"
        );
    }
    let wiring = Wiring::parse(&text).unwrap();
    let checked = check(&wiring, &signals, nucleo());
    assert_eq!(checked.faults, []);
    assert_eq!(checked.remarks.len(), 2, "{:?}", checked.remarks);
    assert!(checked.remarks[0].contains("a servo takes a position 50 times a second"));
    let [_, pins] = sources(&wiring, &signals, nucleo());
    assert!(
        pins.text.contains("SENSORS_WIRED: usize = 11"),
        "{}",
        pins.text
    );
    for part in ["tim8: $crate::drivers::pulses(", "SERVO_HZ", "tim1: None"] {
        assert!(pins.text.contains(part), "{part}: {}", pins.text);
    }
}

/// A platform of one sensor and as many power stages.
fn stages(count: usize) -> Signals {
    Signals {
        sensors: vec![signal("z_m", "m", None)],
        actuators: (0..count)
            .map(|k| signal(&format!("u{k}_V"), "V", Some([0.0, 8000.0])))
            .collect(),
        rate_hz: 125.0,
    }
}

/// The first wiring of a controller, its sensors' scales filled in.
fn filled(signals: &Signals, board: &Board) -> String {
    let text = propose(signals, board).expect("pins enough");
    let text = text.replace("at_zero = nan", "at_zero = -1.0");
    text.replace("at_full = nan", "at_full = 1.0")
}

#[test]
fn a_name_with_quotes_or_lines_stays_one_name() {
    let name = "u\"1\"\n} mod x {";
    let signals = Signals {
        sensors: vec![signal(name, "V", None)],
        actuators: vec![signal("\u{fc} 'V'", "V", Some([0.0, 1.0]))],
        rate_hz: 100.0,
    };
    for board in [nucleo(), kit()] {
        let text = filled(&signals, board);
        let wiring = Wiring::parse(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
        assert_eq!(check(&wiring, &signals, board).faults, []);
        for file in sources(&wiring, &signals, board) {
            let lines = file.text.lines().filter(|line| line.contains("mod x"));
            for line in lines {
                assert!(line.trim().starts_with("// "), "{line}");
            }
            assert!(file.text.contains("mod x"), "{}", file.text);
        }
    }
}

#[test]
fn six_power_stages_take_two_timers() {
    let signals = stages(6);
    let text = filled(&signals, nucleo());
    let wiring = Wiring::parse(&text).unwrap();
    assert_eq!(check(&wiring, &signals, nucleo()), Default::default());
    let [scales, pins] = sources(&wiring, &signals, nucleo());
    // Nothing is imported that is not used.
    assert!(!scales.text.contains("Encoder"), "{}", scales.text);
    for part in [
        "ACTUATORS_WIRED: usize = 6",
        "Actuator::Pwm($crate::drivers::Timer::Tim1, 3)",
        "Actuator::Pwm($crate::drivers::Timer::Tim8, 0)",
        "Actuator::Pwm($crate::drivers::Timer::Tim8, 1)",
        "$p.TIM8,\n                    $crate::drivers::output($p.PC6),",
        "tim3: None",
    ] {
        assert!(pins.text.contains(part), "{part} is not in\n{}", pins.text);
    }
}

#[test]
fn a_first_wiring_uses_every_timer_and_no_pin_twice() {
    // One of the sixteen stands at an analogue input, which the sensor has not.
    let signals = stages(16);
    let text = filled(&signals, nucleo());
    let wiring = Wiring::parse(&text).unwrap();
    assert_eq!(check(&wiring, &signals, nucleo()).faults, []);
    let many = propose(&stages(17), nucleo()).unwrap_err().to_string();
    assert!(many.contains("17 actuators and 16 PWM outputs"), "{many}");
}

/// Twelve sensors take two analogue inputs that could make pulses.
#[test]
fn a_first_wiring_gives_no_actuator_the_pin_of_a_sensor() {
    let signals = |actuators| Signals {
        sensors: (0..12)
            .map(|k| signal(&format!("fibre_{k}"), "V", None))
            .collect(),
        ..stages(actuators)
    };
    let wiring = Wiring::parse(&filled(&signals(14), nucleo())).unwrap();
    let used = wiring.sensors.iter().flat_map(|wire| wire.pins());
    assert_eq!(used.filter(|pin| ["PB0", "PB1"].contains(pin)).count(), 2);
    assert_eq!(check(&wiring, &signals(14), nucleo()).faults, []);
    let many = propose(&signals(15), nucleo()).unwrap_err().to_string();
    assert!(many.contains("15 actuators and 14 PWM outputs"), "{many}");
}

#[test]
fn a_timer_of_two_rates_or_with_an_encoder_is_refused() {
    let servo = |name: &str, pin: &str| {
        format!(
            "[[actuator]]\ninput = \"{name}\"\nby = \"servo\"\npin = \"{pin}\"\nat_zero = 0.0\n\
             at_full = 1.5\n"
        )
    };
    let mut signals = cart();
    signals
        .actuators
        .push(signal("left_rad", "rad", Some([0.0, 1.5])));
    // The motor's pulses and a servo's on timer 1.
    let found = faults(&format!("{CART}\n{}", servo("left_rad", "PA11")), &signals);
    assert_eq!(found.len(), 1, "{found:#?}");
    insta::assert_snapshot!(found[0], @"line 26: timer 1 makes 20000 pulses a second for `u_V`, and not what `left_rad` needs; expected a pin of another timer: PB6, PB7, PC6, PC7, PC8, PC9, PB8, PB9");
    // A servo beside the encoder of timer 3; on timer 8 it may be.
    let found = faults(&format!("{CART}\n{}", servo("left_rad", "PB1")), &signals);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0].contains("timer 3 counts an encoder for `q_m`"),
        "{found:#?}"
    );
    let found = faults(&format!("{CART}\n{}", servo("left_rad", "PC9")), &signals);
    assert_eq!(found, [""; 0]);
}

#[test]
fn each_kind_of_fault_names_its_line_and_the_remedy() {
    for (from, to, said) in [
        (
            "\"PA0\"",
            "\"PZ9\"",
            "line 11: Nucleo-F446RE has no pin `PZ9` to wire",
        ),
        (
            "\"PA0\"",
            "\"PB5\"",
            "line 11: PB5 is taken by ENABLE of the power stages",
        ),
        (
            "\"PA0\"",
            "\"PA2\"",
            "line 11: PA2 is taken by the serial line",
        ),
        (
            "\"PA0\"",
            "\"PC6\"",
            "line 11: PC6 is no analogue input of Nucleo-F446RE",
        ),
        ("\"PA0\"", "\"PA6\"", "PA6 is wired to `q_m` already"),
        (
            "[\"PA6\", \"PA7\"]",
            "[\"PA7\", \"PA6\"]",
            "line 4: PA7 and PA6 are not A and B of one timer; expected one of [\"PA6\", \"PA7\"]",
        ),
        (
            "\"PA7\"]",
            "\"PB7\"]",
            "line 4: PA6 and PB7 are not A and B of one timer",
        ),
        ("-20000.0", "0.0", "line 4: the scale of `q_m` is not given"),
        (
            "at_full = 1.5",
            "at_full = -1.5",
            "line 11: at_zero and at_full of `phi_rad` are both",
        ),
        (
            "at_full = 1.5",
            "at_full = inf",
            "line 11: the scale of `phi_rad` is not given",
        ),
        (
            "at_full = 1.5",
            "at_full = 1e300",
            "line 11: the scale of `phi_rad` has 1e300, which no f32 holds",
        ),
        (
            "at_full = 1.5",
            "at_full = -1.5000000001",
            "line 11: at_zero and at_full of `phi_rad` are both -1.5",
        ),
        (
            "-20000.0",
            "1e300",
            "line 4: the scale of `q_m` has 1e-300, which no f32 holds",
        ),
        ("\"PA9\"", "\"PB12\"", "line 18: PB12 is no PWM output"),
        ("\"PB10\"", "\"PA8\"", "line 18: PA8 is no output of a bit"),
        (
            "at_full = 12.0",
            "at_full = 13.0",
            "line 18: the sign of `u_V` would change at 0.5",
        ),
    ] {
        let found = fault(from, to);
        assert!(found.contains(said), "{from} -> {to}: {found}");
    }
}

#[test]
fn a_wire_shorter_than_the_limits_is_refused() {
    let text = CART.replace("-12.0", "-10.0").replace("= 12.0", "= 10.0");
    let found = faults(&text, &cart());
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0].contains("goes from -12 to 12 V, its wire from -10 to 10"),
        "{found:#?}"
    );
}

#[test]
fn a_signal_has_one_wire_and_a_wire_a_signal() {
    let found = faults(&CART.replace("phi_rad", "phi_deg"), &cart());
    assert_eq!(found.len(), 2, "{found:#?}");
    assert!(
        found[0].contains("`phi_deg`") || found[0].contains("\"phi_deg\""),
        "{found:#?}"
    );
    assert!(found[1].contains("`phi_rad` is not wired"), "{found:#?}");
    let again = CART.replace("\"phi_rad\"", "\"q_m\"");
    let found = faults(&again, &cart());
    assert!(
        found[0].contains("line 11: `q_m` is wired on line 4 already"),
        "{found:#?}"
    );
}

#[test]
fn a_converter_slower_than_the_loop_is_refused_and_a_slow_one_said() {
    let at = |rate_hz| {
        let wiring = Wiring::parse(CART).unwrap();
        check(&wiring, &Signals { rate_hz, ..cart() }, nucleo())
    };
    assert_eq!((at(1e4).faults.len(), at(1e4).remarks.len()), (0, 0));
    assert_eq!((at(5e4).faults.len(), at(5e4).remarks.len()), (0, 1));
    assert_eq!(at(2e5).faults.len(), 1);
}

#[test]
fn a_file_that_does_not_read_names_its_line() {
    for (from, to, line, said) in [
        (
            "sinew-wiring/1",
            "sinew-wiring/2",
            1,
            "format = \"sinew-wiring/1\"",
        ),
        ("at_start", "at_strat", 4, "at_strat"),
        ("by = \"adc\"", "by = \"i2c\"", 11, "adc or encoder"),
        (
            "by = \"signed\"",
            "by = \"pwm\"",
            18,
            "`direction` means nothing",
        ),
        (
            "by = \"encoder\"",
            "by = \"adc\"",
            4,
            "`pins` means nothing",
        ),
        ("at_full = 1.5\n", "", 11, "`at_full` is missing"),
        ("pin = \"PA0\"", "pin = 3", 14, "invalid type"),
    ] {
        let found = Wiring::parse(&CART.replacen(from, to, 1)).unwrap_err();
        assert!(found.to_string().contains(said), "{from}: {found}");
        let lines = line..line + 7;
        assert!(lines.contains(&found.line.unwrap()), "{from}: {found}");
    }
    for text in [
        "",
        "x",
        "format = 1",
        "\u{0}",
        "format = \"sinew-wiring/1\"",
    ] {
        assert!(Wiring::parse(text).is_err(), "{text:?}");
    }
}

#[test]
fn sources_follow_the_signals_and_not_the_file() {
    let wiring = Wiring::parse(CART).unwrap();
    let mut signals = cart();
    signals.sensors.reverse();
    let [scales, pins] = sources(&wiring, &signals, nucleo());
    assert_eq!(scales.path, "boards/runtime/src/scales.rs");
    assert_eq!(pins.path, "boards/stm32f446/src/pins.rs");
    insta::assert_snapshot!("scales", scales.text);
    insta::assert_snapshot!("pins", pins.text);
}

#[test]
fn the_table_and_the_picture_show_every_pin() {
    let wiring = Wiring::parse(CART).unwrap();
    insta::assert_snapshot!(table(&wiring, nucleo()), @r"
    q_m      PA6    D12
    q_m      PA7    D11
    phi_rad  PA0    A0
    u_V      PA9    D8
    u_V      PB10   D6
    ");
    let svg = picture(&wiring, nucleo());
    for words in [
        "q_m, encoder A",
        "phi_rad, 0 to 3.3 V",
        "u_V, direction",
        "PB5",
        "</svg>",
    ] {
        assert!(svg.contains(words), "{words} is not in\n{svg}");
    }
}

/// The cart on a board that routes its pins.
fn routed() -> String {
    CART.replace("stm32f446", "nrf52840")
        .replace("\"PA6\"", "\"P1.01\"")
        .replace("\"PA7\"", "\"P1.02\"")
        .replace("\"PA0\"", "\"P0.28\"")
        .replace("\"PA9\"", "\"P1.10\"")
        .replace("\"PB10\"", "\"P0.31\"")
}

fn kit() -> &'static Board {
    board("nrf52840").unwrap()
}

#[test]
fn pins_of_a_board_that_routes_them_are_free_to_choose() {
    let wiring = Wiring::parse(&routed()).unwrap();
    let checked = check(&wiring, &cart(), kit());
    assert_eq!(checked.faults, []);
    assert_eq!(
        checked.remarks,
        ["`q_m`: the decoder sees 7812 edges a second at most, a speed of 3.906e-1 m/s"]
    );
    let [_, pins] = sources(&wiring, &cart(), kit());
    assert_eq!(pins.path, "boards/nrf52840/src/pins.rs");
    insta::assert_snapshot!("routed", pins.text);
    let svg = picture(&wiring, kit());
    for words in ["q_m, encoder B", "D0  P1.01", "P1.05", "nRF52840 DK"] {
        assert!(svg.contains(words), "{words} is not in\n{svg}");
    }
}

#[test]
fn faults_of_a_board_that_routes_its_pins_name_the_remedy() {
    let again = "\n[[sensor]]\ncolumn = \"x_m\"\nby = \"encoder\"\npins = [\"P1.03\", \"P1.04\"]\n\
                 counts_per_unit = 1.0\nat_start = 0.0\n";
    let mut two = cart();
    two.sensors.push(signal("x_m", "m", None));
    let slow = Signals {
        rate_hz: 5.0,
        ..cart()
    };
    for (text, signals, said) in [
        (
            routed().replace("\"P0.28\"", "\"P1.08\""),
            cart(),
            "P1.08 is no analogue input of nRF52840 DK; expected one of P0.03, P0.04, P0.28",
        ),
        (
            routed().replace("\"P1.10\"", "\"P1.05\""),
            cart(),
            "P1.05 is taken by ENABLE of the power stages",
        ),
        (
            routed().replace("\"P1.10\"", "\"PA8\""),
            cart(),
            "nRF52840 DK has no pin `PA8` to wire; expected one of P0.03",
        ),
        (
            routed().replace("\"P1.02\"", "\"P1.01\""),
            cart(),
            "line 4: P1.01 is wired to `q_m` already",
        ),
        (
            routed() + again,
            two,
            "line 26: the one decoder of nRF52840 DK counts `q_m` already; expected by = \"adc\"",
        ),
        (
            routed(),
            slow,
            "line 4: the decoder holds 1023 edges, which may come in 131 ms of a period of 200 ms",
        ),
    ] {
        let wiring = Wiring::parse(&text).unwrap();
        let found = check(&wiring, &signals, kit()).faults;
        assert_eq!(found.len(), 1, "{said}: {found:#?}");
        assert!(found[0].to_string().contains(said), "{said}: {}", found[0]);
    }
}

#[test]
fn units_of_pulses_have_one_rate_each() {
    // Nine power stages take three units, four servos the fourth; a fifth servo has none.
    let signals = |servos: usize| {
        let mut signals = stages(9);
        let servo = |k| signal(&format!("s{k}_rad"), "rad", Some([0.0, 1.5]));
        signals.actuators.extend((0..servos).map(servo));
        signals
    };
    let wired = |servos| {
        let text = filled(&signals(servos), kit());
        let head = text.find("\n[[actuator]]\ninput = \"s0_rad\"").unwrap();
        let (power, servo) = text.split_at(head);
        let text = power.to_string() + &servo.replace("by = \"pwm\"", "by = \"servo\"");
        Wiring::parse(&text).unwrap()
    };
    assert_eq!(check(&wired(4), &signals(4), kit()).faults, []);
    let [_, pins] = sources(&wired(4), &signals(4), kit());
    for part in [
        "Actuator::Pwm(2, 0)",
        "Actuator::Servo(3, 3)",
        "servos(\n                    $p.PWM3",
    ] {
        assert!(pins.text.contains(part), "{part} is not in\n{}", pins.text);
    }
    let found = check(&wired(5), &signals(5), kit()).faults;
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(
        found[0]
            .to_string()
            .contains("9 power stages and 5 servos do not fit 4 units of 4 outputs"),
        "{}",
        found[0]
    );
}

#[test]
fn a_first_wiring_of_a_board_that_routes_its_pins_passes_once_filled_in() {
    let signals = Signals {
        sensors: (0..8)
            .map(|k| signal(&format!("s{k}"), "V", None))
            .collect(),
        ..stages(15)
    };
    let wiring = Wiring::parse(&filled(&signals, kit())).unwrap();
    assert_eq!(check(&wiring, &signals, kit()).faults, []);
    let many = propose(&stages(17), kit()).unwrap_err().to_string();
    assert!(many.contains("17 actuators and 16 PWM outputs"), "{many}");
}

#[test]
fn a_damaged_file_gives_an_error_or_a_wiring_and_never_a_panic() {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let words = [
        "nan",
        "-inf",
        "1e999",
        "\"\"",
        "PA6",
        "[[sensor]]",
        "= ",
        "\u{e9}",
        "\n",
        "0",
    ];
    for _ in 0..5_000 {
        let mut text = String::from(CART);
        for _ in 0..1 + next(3) {
            let mut ends = [next(text.len() + 1), next(text.len() + 1)];
            ends.sort_unstable();
            let [from, mut to] = ends;
            to = to.min(from + next(30));
            if text.is_char_boundary(from) && text.is_char_boundary(to) {
                text.replace_range(from..to, words[next(words.len())]);
            }
        }
        if let Ok(wiring) = Wiring::parse(&text) {
            let _ = check(&wiring, &cart(), nucleo());
            let _ = sources(&wiring, &cart(), nucleo());
            let _ = (picture(&wiring, nucleo()), table(&wiring, nucleo()));
            let _ = check(&wiring, &cart(), kit());
            let _ = sources(&wiring, &cart(), kit());
        }
    }
}
