//! Signs and scales from the motion of one actuator: which single fault of the wiring explains what
//! was seen, if the rig's prediction does not.

use super::journal::Cause;

/// Part of the predicted motion in units of the threshold from which a sensor has to move.
const CLEAR: f64 = 4.0;
/// Correlation of measured and predicted motion from which one is the shape of the other.
const ALIKE: f64 = 0.7;
/// Factors of units and counters that are confused, with their names.
const CONFUSED: [(f64, &str); 7] = [
    (180.0 / std::f64::consts::PI, "degrees in place of radians"),
    (1000.0, "milli in place of the plain unit"),
    (1e6, "micro in place of the plain unit"),
    (25.4, "inches in place of millimetres"),
    (16.0, "12 bits in place of 16"),
    (4.0, "edges of an encoder counted four times"),
    (2.0, "a factor of two"),
];
/// Largest deviation of a factor from one of [`CONFUSED`], relative.
const NEAR: f64 = 0.1;

/// One sensor during the motion of one actuator.
#[derive(Clone, Debug)]
pub struct Seen<'a> {
    /// Column.
    pub name: &'a str,
    /// Change of the reading since rest, a sample a tick, NaN where missing.
    pub dy: &'a [f64],
    /// Change that noise alone does not make.
    pub threshold: f64,
    /// Sign and scale are known from an actuator before.
    pub confirmed: bool,
}

/// Judgement of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// As predicted: measured over predicted motion of each sensor that had to move.
    Confirmed(Vec<(usize, f64)>),
    /// Less than predicted: perhaps friction; a larger motion tells.
    Weak(Vec<Cause>),
    /// Something else: every explanation by a single fault; empty where there is none.
    Fault(Vec<Cause>),
}

/// Comparison of one sensor's motion with a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Match {
    /// It need not move, and moves no more than it may.
    Quiet,
    /// It moves and should not.
    Unexpected,
    /// Sign and scale are right; measured over predicted.
    Right(f64),
    /// The scale is right with the other sign.
    Reversed,
    /// Another scale, perhaps with the other sign; measured over predicted.
    Scaled(f64),
    /// It does not move.
    Still,
    /// It moves in another way.
    Other,
}

/// Root mean square of the means of blocks.
pub fn size(values: &[f64]) -> f64 {
    let blocks = values.chunks(super::rest::BLOCK).filter_map(|block| {
        let valid: Vec<f64> = block.iter().copied().filter(|v| v.is_finite()).collect();
        (!valid.is_empty()).then(|| super::rest::mean(&valid))
    });
    let (mut sum, mut n) = (0.0, 0_usize);
    for block in blocks {
        sum += block * block;
        n += 1;
    }
    (sum / n.max(1) as f64).sqrt()
}

fn compare(seen: &Seen, predicted: &[f64], tolerance: f64) -> Match {
    let (measured, expected) = (size(seen.dy), size(predicted));
    let (mut product, mut square, mut own) = (0.0, 0.0, 0.0);
    for (y, p) in (seen.dy.iter().zip(predicted)).filter(|(y, _)| y.is_finite()) {
        product += y * p;
        square += p * p;
        own += y * y;
    }
    let correlation = product / (square * own).sqrt();
    let ratio = product / square;
    // False as well where one of the two is zero.
    let is_alike = correlation.abs() >= ALIKE;
    if expected < CLEAR * seen.threshold {
        let may = (tolerance * expected).max(seen.threshold);
        return match measured > 2.0 * may {
            true if is_alike => Match::Scaled(ratio),
            true => Match::Unexpected,
            false => Match::Quiet,
        };
    }
    if measured <= seen.threshold {
        Match::Still
    } else if !is_alike {
        Match::Other
    } else if ratio.abs() > tolerance || ratio.abs() < 1.0 / tolerance {
        Match::Scaled(ratio)
    } else if ratio < 0.0 {
        Match::Reversed
    } else {
        Match::Right(ratio)
    }
}

/// Judges the motion of actuator `driven`. `inputs`: columns of all actuators; `known`: those whose
/// motion was confirmed before; `predicted`: for each actuator that could have moved in its place
/// the changes of every sensor; `tolerance`: factor by which a scale may be off.
pub fn judge(
    (driven, inputs): (usize, &[&str]),
    known: &[bool],
    seen: &[Seen],
    predicted: &[Vec<Vec<f64>>],
    tolerance: f64,
) -> Verdict {
    let against = |k: usize| -> Vec<Match> {
        let each = seen.iter().zip(&predicted[k]);
        each.map(|(seen, p)| compare(seen, p, tolerance)).collect()
    };
    let own = against(driven);
    if fits(&own) {
        let ratios = own.iter().enumerate().filter_map(|(i, m)| match m {
            Match::Right(ratio) => Some((i, *ratio)),
            _ => None,
        });
        return Verdict::Confirmed(ratios.collect());
    }
    let mut causes = Vec::new();
    let u = inputs[driven];
    for (k, other) in inputs.iter().enumerate() {
        if k != driven && !known[k] && fits(&against(k)) {
            causes.push(crossed_actuators(u, other));
        }
    }
    let is_to_move = |m: &Match| !matches!(m, Match::Quiet | Match::Unexpected);
    let to_move = || own.iter().filter(|m| is_to_move(m));
    let unexpected = own.contains(&Match::Unexpected);
    if !unexpected && to_move().next().is_some() {
        if to_move().all(|m| *m == Match::Reversed) {
            causes.push(reversed_actuator(u));
        }
        if to_move().all(|m| *m == Match::Still) {
            causes.push(dead_actuator(u));
        }
        let ratios: Vec<f64> = to_move()
            .map(|m| match m {
                Match::Scaled(ratio) => *ratio,
                _ => f64::NAN,
            })
            .collect();
        let first = ratios[0];
        if ratios
            .iter()
            .all(|ratio| (1.0 / NEAR_ALL..=NEAR_ALL).contains(&(ratio / first)))
        {
            causes.push(scaled_actuator(u, first));
        }
    }
    causes.extend(faults_of_sensors(&own, seen));
    causes.extend(swapped_sensors(seen, &predicted[driven], tolerance));
    let less = |m: &Match| match m {
        Match::Scaled(ratio) => *ratio > 0.0 && *ratio < 1.0,
        m => is_right(m) || *m == Match::Still,
    };
    let nothing_to_see = own.iter().all(|m| *m == Match::Quiet);
    // A sensor that stands still while others move is not held by friction at the actuator.
    let one_is_dead = own.contains(&Match::Still)
        && own
            .iter()
            .any(|m| *m != Match::Still && !matches!(m, Match::Quiet));
    if nothing_to_see || (own.iter().all(less) && !one_is_dead) {
        return Verdict::Weak(causes);
    }
    Verdict::Fault(causes)
}

/// Sensors that are the only ones not to fit.
fn faults_of_sensors(own: &[Match], seen: &[Seen]) -> Vec<Cause> {
    let mut causes = Vec::new();
    for (i, sensor) in seen.iter().enumerate() {
        let others = own.iter().enumerate().filter(|(other, _)| *other != i);
        let others_fit = others.clone().all(|(_, m)| is_right(m));
        // A sensor that is known already has not changed its sign or scale since.
        let cause = match own[i] {
            Match::Reversed if !sensor.confirmed => reversed_sensor(sensor.name),
            Match::Scaled(ratio) if !sensor.confirmed => scaled_sensor(sensor.name, ratio),
            Match::Still => dead_sensor(sensor.name),
            _ => continue,
        };
        if others_fit {
            causes.push(cause);
        }
    }
    causes
}

/// Pairs of sensors that would fit if each were the other.
fn swapped_sensors(seen: &[Seen], predicted: &[Vec<f64>], tolerance: f64) -> Vec<Cause> {
    let mut causes = Vec::new();
    for i in 0..seen.len() {
        for k in i + 1..seen.len() {
            let swapped = seen.iter().enumerate().map(|(place, sensor)| {
                let other = match place {
                    place if place == i => k,
                    place if place == k => i,
                    place => place,
                };
                compare(sensor, &predicted[other], tolerance)
            });
            let swapped: Vec<Match> = swapped.collect();
            let both = !seen[i].confirmed && !seen[k].confirmed;
            if both && fits(&swapped) {
                causes.push(crossed_sensors(seen[i].name, seen[k].name));
            }
        }
    }
    causes
}

/// Largest ratio of two scales that count as one.
const NEAR_ALL: f64 = 1.5;

fn is_right(m: &Match) -> bool {
    matches!(m, Match::Right(_) | Match::Quiet)
}

/// Every sensor as predicted, and at least one had to move.
fn fits(matches: &[Match]) -> bool {
    matches.iter().all(is_right) && matches.iter().any(|m| matches!(m, Match::Right(_)))
}

fn cause(kind: &str, signals: &[&str], sentence: String, remedy: String) -> Cause {
    Cause {
        kind: kind.into(),
        signals: signals.iter().map(|name| (*name).into()).collect(),
        sentence,
        remedy,
    }
}

fn crossed_actuators(u: &str, other: &str) -> Cause {
    cause(
        "crossed_actuators",
        &[u, other],
        format!("`{u}` moved what `{other}` should: the two are crossed"),
        format!("exchange the wires, or the pins in the wiring, of `{u}` and `{other}`"),
    )
}

fn crossed_sensors(a: &str, b: &str) -> Cause {
    cause(
        "crossed_sensors",
        &[a, b],
        format!("`{a}` shows what `{b}` should: the two are crossed"),
        format!("exchange the wires, or the pins in the wiring, of `{a}` and `{b}`"),
    )
}

fn reversed_actuator(u: &str) -> Cause {
    cause(
        "reversed_actuator",
        &[u],
        format!("`{u}` drives the other way"),
        format!(
            "exchange its two wires, or at_zero and at_full of `{u}` in the wiring, or change the \
             sign of its `gain` in the rig"
        ),
    )
}

fn reversed_sensor(y: &str) -> Cause {
    cause(
        "reversed_sensor",
        &[y],
        format!("`{y}` counts the other way"),
        format!(
            "exchange at_zero and at_full (an encoder: the sign of counts_per_unit) of `{y}` in \
             the wiring, or change the sign of its `gain` in the rig"
        ),
    )
}

fn scaled_sensor(y: &str, ratio: f64) -> Cause {
    cause(
        "scaled_sensor",
        &[y],
        format!(
            "`{y}` shows {} the predicted motion{}",
            times(ratio),
            known_factor(ratio)
        ),
        format!(
            "correct the scale of `{y}` in the wiring, or its `gain` or `unit` in the rig; \
             --tolerance where the rig's own numbers are that uncertain"
        ),
    )
}

fn scaled_actuator(u: &str, ratio: f64) -> Cause {
    cause(
        "scaled_actuator",
        &[u],
        format!(
            "`{u}` moves everything {} as far as predicted",
            times(ratio)
        ),
        format!(
            "correct the scale of `{u}` in the wiring, or its `gain`, or the stiffness behind it, \
             in the rig; --tolerance where those are that uncertain"
        ),
    )
}

fn dead_sensor(y: &str) -> Cause {
    cause(
        "dead_sensor",
        &[y],
        format!("`{y}` does not move although it should"),
        format!("look at the wires and the supply of `{y}`, and at what holds it"),
    )
}

fn dead_actuator(u: &str) -> Cause {
    cause(
        "dead_actuator",
        &[u],
        format!("`{u}` moves nothing"),
        format!(
            "look at the power stage, its ENABLE and the wires of `{u}`; --amplitude for a larger \
             motion where friction holds it"
        ),
    )
}

/// A factor in words that read well.
fn times(ratio: f64) -> String {
    sinew_ident::report::significant(ratio, 2) + " times"
}

/// Remark about a factor that units make.
fn known_factor(ratio: f64) -> String {
    let ratio = ratio.abs();
    let of = CONFUSED.iter().find_map(|(factor, name)| {
        let is_near = |x: f64| (x / factor - 1.0).abs() < NEAR;
        (is_near(ratio) || is_near(1.0 / ratio)).then_some(name)
    });
    of.map_or(String::new(), |name| format!(" ({name}, or the reverse?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 2] = ["q1", "q2"];
    const INPUTS: [&str; 2] = ["u1", "u2"];

    /// Changes of both sensors, as multiples of one motion.
    fn changes(factors: [f64; 2]) -> Vec<Vec<f64>> {
        let motion = |k: usize| (0.02 * k as f64).sin();
        let each = factors.iter();
        each.map(|f| (0..314).map(|k| f * motion(k)).collect())
            .collect()
    }

    /// Kinds that explain factors of both sensors, where `u1` should give 1 and 0.5 and `u2` 0.3
    /// and -1.
    fn kinds(factors: [f64; 2], confirmed: [bool; 2]) -> Vec<String> {
        let dy = changes(factors);
        let seen: Vec<Seen> = (0..2)
            .map(|i| Seen {
                name: NAMES[i],
                dy: &dy[i],
                threshold: 0.01,
                confirmed: confirmed[i],
            })
            .collect();
        let predicted = [changes([1.0, 0.5]), changes([0.3, -1.0])];
        match judge((0, &INPUTS), &[false; 2], &seen, &predicted, 2.0) {
            Verdict::Confirmed(ratios) => {
                let of = |(i, ratio): (usize, f64)| format!("{} {ratio:.2}", NAMES[i]);
                ratios.into_iter().map(of).collect()
            }
            Verdict::Weak(causes) | Verdict::Fault(causes) => {
                causes.into_iter().map(|cause| cause.kind).collect()
            }
        }
    }

    #[test]
    fn one_fault_explains_what_was_seen_or_several_do_and_all_are_named() {
        let new = [false; 2];
        assert_eq!(kinds([0.8, 0.5], new), ["q1 0.80", "q2 1.00"]);
        assert_eq!(kinds([-1.0, -0.5], new), ["reversed_actuator"]);
        assert_eq!(kinds([0.9, -0.5], new), ["reversed_sensor"]);
        assert_eq!(kinds([0.3, -1.0], new), ["crossed_actuators"]);
        assert_eq!(kinds([4.0, 0.5], new), ["scaled_sensor"]);
        assert_eq!(kinds([-4.0, 0.5], new), ["scaled_sensor"]);
        assert_eq!(kinds([0.1, 0.05], new), ["scaled_actuator"]);
        assert_eq!(kinds([1.0, 0.0], new), ["dead_sensor"]);
        assert_eq!(kinds([0.0, 0.0], new), ["dead_actuator"]);
        // Two faults at once: none that is single.
        assert_eq!(kinds([-4.0, 4.0], new), [""; 0]);
    }

    #[test]
    fn a_sensor_that_is_known_already_is_not_suspected_of_its_sign_or_scale() {
        let known = [false, true];
        assert_eq!(kinds([0.9, -0.5], known), [""; 0]);
        assert_eq!(kinds([-1.0, 0.5], known), ["reversed_sensor"]);
        assert_eq!(kinds([1.0, 0.0], known), ["dead_sensor"]);
    }

    #[test]
    fn crossed_sensors_are_told_from_others() {
        assert_eq!(kinds([0.45, 1.1], [false; 2]), ["crossed_sensors"]);
    }

    #[test]
    fn factors_of_units_are_recognised() {
        assert!(known_factor(57.0).contains("degrees"));
        assert!(known_factor(-0.0175).contains("degrees"));
        assert!(known_factor(1e-3).contains("milli"));
        assert_eq!(known_factor(7.0), "");
    }
}
