//! A first wiring: pins in the board's order, scales where the rig says them.

use std::fmt::Write;

use crate::board::{Board, Pin, Units, Use};
use crate::file::Fault;
use crate::signals::{Signal, Signals};

/// Text of a first `wiring.toml`. Sensors are analogue inputs whose scales are for the owner to
/// fill in (`nan`, which [`check`](crate::check) refuses); actuators are PWM over their limits.
///
/// # Errors
/// More sensors or actuators than the board has pins for, with both numbers.
pub fn propose(signals: &Signals, board: &Board) -> Result<String, Fault> {
    let analogue = pins(board, |of| of == Use::Analogue);
    let used: Vec<_> = analogue.iter().take(signals.sensors.len()).collect();
    let mut pwm = pins(board, Use::is_pulses);
    pwm.retain(|pin| !used.contains(&pin));
    if let Units::Routed {
        units, channels, ..
    } = board.units
    {
        pwm.truncate(units * channels);
    }
    enough(
        "sensors",
        signals.sensors.len(),
        "analogue inputs",
        analogue.len(),
        board,
    )?;
    enough(
        "actuators",
        signals.actuators.len(),
        "PWM outputs",
        pwm.len(),
        board,
    )?;
    let mut text = format!(
        "# Wiring of the controller to a {}. Keys and pins: docs/reference/wiring.md.\n\
         # `sinew wire RIG --check FILE` says what cannot be.\n\
         format = \"sinew-wiring/1\"\n\
         board = \"{}\"\n",
        board.title, board.name
    );
    for (signal, pin) in signals.sensors.iter().zip(analogue) {
        sensor(&mut text, signal, pin, board);
    }
    for (signal, pin) in signals.actuators.iter().zip(pwm) {
        actuator(&mut text, signal, pin);
    }
    Ok(text)
}

/// Names of the pins that can be this, those last that an encoder may need, and of the others those
/// first that can be nothing else.
fn pins(board: &Board, able: impl Fn(Use) -> bool) -> Vec<(&'static str, &'static str)> {
    let is_able = |pin: &&Pin| pin.uses.iter().any(|of| able(*of));
    let mut pins: Vec<_> = board.pins.iter().filter(is_able).collect();
    let is_encoder = |of: &Use| matches!(of, Use::Encoder { .. });
    let is_analogue = |of: &Use| *of == Use::Analogue;
    let others = |pin: &Pin| {
        let is_input = pin.uses.iter().any(is_analogue);
        // An analogue input is taken in the board's order, whatever else it can be.
        if is_input && able(Use::Analogue) {
            0
        } else {
            pin.uses.len()
        }
    };
    pins.sort_by_key(|pin| (pin.uses.iter().any(is_encoder), others(pin)));
    pins.into_iter().map(|pin| (pin.name, pin.place)).collect()
}

fn enough(
    signals: &str,
    wanted: usize,
    pins: &str,
    there: usize,
    board: &Board,
) -> Result<(), Fault> {
    if wanted <= there {
        return Ok(());
    }
    Err(Fault::new(
        None,
        format!("{wanted} {signals} and {there} {pins} on {}", board.title),
        "fewer signals, or a wiring of encoders and servos written by hand",
    ))
}

/// A name as TOML writes it.
fn text_of(name: &str) -> String {
    toml::Value::from(name).to_string()
}

// Writing to a String cannot fail.
fn sensor(text: &mut String, signal: &Signal, (pin, place): (&str, &str), board: &Board) {
    let Signal { name, unit, .. } = signal;
    let _ = write!(
        text,
        "\n[[sensor]]\n\
         column = {}\n\
         by = \"adc\"          # or \"encoder\" with pins, counts_per_unit and at_start\n\
         pin = \"{pin}\"         # {place}\n\
         at_zero = nan       # {unit} at 0 V: yours to fill in\n\
         at_full = nan       # {unit} at {} V\n",
        text_of(name),
        board.full_scale_v
    );
}

fn actuator(text: &mut String, signal: &Signal, (pin, place): (&str, &str)) {
    let Signal { name, unit, range } = signal;
    let [low, high] = range.unwrap_or([f64::NAN; 2]);
    let number = |value: f64| {
        if value.is_nan() {
            "nan".into()
        } else {
            format!("{value:?}")
        }
    };
    let _ = write!(
        text,
        "\n[[actuator]]\n\
         input = {}\n\
         by = \"pwm\"          # or \"signed\" with direction, or \"servo\"\n\
         pin = \"{pin}\"         # {place}\n\
         at_zero = {:<9} # {unit} at no pulse\n\
         at_full = {:<9} # {unit} at a pulse as long as the period\n",
        text_of(name),
        number(low),
        number(high)
    );
}
