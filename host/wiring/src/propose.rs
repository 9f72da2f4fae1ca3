//! A first wiring: pins in the board's order, scales where the rig says them.

use std::fmt::Write;

use crate::board::{Board, Use};
use crate::file::Fault;
use crate::signals::{Signal, Signals};

/// Text of a first `wiring.toml`. Sensors are analogue inputs whose scales are for the owner to
/// fill in (`nan`, which [`check`](crate::check) refuses); actuators are PWM over their limits.
///
/// # Errors
/// More sensors or actuators than the board has pins for, with both numbers.
pub fn propose(signals: &Signals, board: &Board) -> Result<String, Fault> {
    let analogue = pins(board, |of| of == Use::Analogue);
    let pwm = pins(board, |of| matches!(of, Use::Pwm { .. }));
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

/// Names of the pins that can be this, those first that can be nothing else: the others stay free
/// for what they alone can be.
fn pins(board: &Board, able: impl Fn(Use) -> bool) -> Vec<(&'static str, &'static str)> {
    let mut pins: Vec<_> = board
        .pins
        .iter()
        .filter(|pin| pin.uses.iter().any(|of| able(*of)))
        .collect();
    pins.sort_by_key(|pin| pin.uses.len());
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

// Writing to a String cannot fail.
fn sensor(text: &mut String, signal: &Signal, (pin, place): (&str, &str), board: &Board) {
    let Signal { name, unit, .. } = signal;
    let _ = write!(
        text,
        "\n[[sensor]]\n\
         column = \"{name}\"\n\
         by = \"adc\"          # or \"encoder\" with pins, counts_per_unit and at_start\n\
         pin = \"{pin}\"         # {place}\n\
         at_zero = nan       # {unit} at 0 V: yours to fill in\n\
         at_full = nan       # {unit} at {} V\n",
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
         input = \"{name}\"\n\
         by = \"pwm\"          # or \"signed\" with direction, or \"servo\"\n\
         pin = \"{pin}\"         # {place}\n\
         at_zero = {:<9} # {unit} at no pulse\n\
         at_full = {:<9} # {unit} at a pulse as long as the period\n",
        number(low),
        number(high)
    );
}
