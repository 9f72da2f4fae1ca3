//! Orders that are typed while a run is watched.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, channel};

use sinew_device::mode::Drive;
use sinew_device::protocol::{Identity, ToDevice};
use sinew_ident::error::{Error, Result};

/// Message to the board for a typed line; `None`: disarm, save, end. `arm` reaches the reference in
/// a second.
///
/// # Errors
/// The fault in one line.
pub fn order(line: &str, identity: &Identity) -> Result<Option<ToDevice>> {
    let mut words = line.split_whitespace();
    let verb = words.next().unwrap_or_default();
    let numbers = words
        .map(|word| {
            let number = word.parse::<f32>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| Error::arguments(format!("`{word}` is not a number")))
        })
        .collect::<Result<Vec<f32>>>()?;
    let count = |wanted: usize, what: &str| match numbers.len() {
        n if n == wanted => Ok(()),
        n => Err(Error::arguments(format!(
            "{what} takes {wanted} numbers, not {n}"
        ))),
    };
    let (n_u, n_y) = (usize::from(identity.n_u), usize::from(identity.n_y));
    let said = match verb {
        "arm" => {
            count(0, "arm")?;
            ToDevice::Arm {
                drive: Drive::Rig,
                blend_steps: u16::try_from(identity.rate_mhz.div_ceil(1000)).unwrap_or(u16::MAX),
            }
        }
        "disarm" => ToDevice::Disarm,
        "stop" | "" => ToDevice::EmergencyStop,
        "r" => {
            count(n_y, "r (a reference for each output)")?;
            let reference = numbers.iter().copied().collect();
            ToDevice::Follow { reference }
        }
        "limit" => {
            count(
                3 * n_u,
                "limit (lower, upper, rate a step, of each command)",
            )?;
            let part = |i: usize| numbers.chunks(3).map(|three| three[i]).collect();
            ToDevice::Limit {
                lower: part(0),
                upper: part(1),
                rate: part(2),
            }
        }
        "quit" => return Ok(None),
        other => {
            return Err(Error::arguments(format!(
                "there is no `{other}`; arm, disarm, stop (or an empty line), r, limit, quit"
            )));
        }
    };
    Ok(Some(said))
}

/// Limits of an order to limit, of each command.
pub(super) fn ranges(message: &ToDevice) -> Option<Vec<[f64; 2]>> {
    let ToDevice::Limit { lower, upper, .. } = message else {
        return None;
    };
    let pairs = lower.iter().zip(upper);
    Some(
        pairs
            .map(|(low, high)| [*low, *high].map(f64::from))
            .collect(),
    )
}

/// Lines of standard input, as they come.
pub fn lines() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(|line| line.ok()) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity {
            protocol: 2,
            model: 0,
            n_u: 2,
            n_y: 3,
            n_s: 0,
            past_inputs: 1,
            past_outputs: 1,
            horizon: 5,
            control_horizon: 5,
            rate_mhz: 120_000,
        }
    }

    #[test]
    fn orders_are_understood_or_refused_with_the_reason() {
        let say = |line: &str| order(line, &identity()).map_err(|error| error.to_string());
        fn fixed<const L: usize>(values: &[f32]) -> heapless::Vec<f32, L> {
            values.iter().copied().collect()
        }
        assert_eq!(
            say("arm"),
            Ok(Some(ToDevice::Arm {
                drive: Drive::Rig,
                blend_steps: 120
            }))
        );
        // Whoever hits Return in a hurry means it.
        assert_eq!(say(""), Ok(Some(ToDevice::EmergencyStop)));
        assert_eq!(
            say(" r 0.1 -2e-3  0"),
            Ok(Some(ToDevice::Follow {
                reference: fixed(&[0.1, -2e-3, 0.0])
            }))
        );
        assert_eq!(
            say("limit -1 1 0.1 -2 2 0.2"),
            Ok(Some(ToDevice::Limit {
                lower: fixed(&[-1.0, -2.0]),
                upper: fixed(&[1.0, 2.0]),
                rate: fixed(&[0.1, 0.2]),
            }))
        );
        for (line, reason) in [
            (
                "r 0.1",
                "r (a reference for each output) takes 3 numbers, not 1",
            ),
            ("r 0.1 x 3", "`x` is not a number"),
            ("r 0.1 nan 3", "`nan` is not a number"),
            (
                "go",
                "there is no `go`; arm, disarm, stop (or an empty line), r, limit, quit",
            ),
        ] {
            assert_eq!(say(line), Err(reason.to_string()));
        }
    }
}
