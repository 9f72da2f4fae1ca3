//! Roles of the columns of a recording, from their names.

use sinew_sim::unit;

use super::Motion;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;

/// Quantity of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Position(Motion),
    Velocity(Motion),
    Force(Motion),
    /// Volts, amperes, a plain number: what an amplifier or a program is told.
    Drive,
    Unknown,
}

/// The columns by the part they play.
#[derive(Debug)]
pub(super) struct Columns {
    /// Columns that drive the device.
    pub inputs: Vec<String>,
    /// Positions; each becomes a body.
    pub positions: Vec<String>,
    /// Velocities, each of the body at the same place in `positions`.
    pub velocities: Vec<Option<String>>,
    /// The reference that each position was to follow, where one was recorded.
    pub references: Vec<Option<String>>,
    /// As the units of the positions tell.
    pub motion: Option<Motion>,
}

fn quantity(column: &str) -> Quantity {
    match unit::of_column(column) {
        "m" | "mm" | "cm" | "um" | "km" => Quantity::Position(Motion::Slide),
        "rad" | "mrad" | "deg" | "rev" => Quantity::Position(Motion::Hinge),
        "m/s" | "mm/s" => Quantity::Velocity(Motion::Slide),
        "rad/s" | "deg/s" | "rpm" => Quantity::Velocity(Motion::Hinge),
        "N" | "kN" | "mN" => Quantity::Force(Motion::Slide),
        "N m" | "N mm" | "mN m" => Quantity::Force(Motion::Hinge),
        "V" | "kV" | "mV" | "A" | "mA" | "1" | "%" => Quantity::Drive,
        _ => Quantity::Unknown,
    }
}

/// Steps of an encoder, whose size only the device's owner knows: `enc_counts`, `q_ticks`.
pub(super) fn is_counts(column: &str) -> bool {
    let name = column.to_lowercase();
    ["_counts", "_count", "_ticks", "_tick", "_cts", "_lsb"]
        .iter()
        .any(|unit| name.ends_with(unit))
}

/// The input is a force or torque already.
pub(super) fn is_force(column: &str) -> bool {
    matches!(quantity(column), Quantity::Force(_))
}

/// Looks like what a position was meant to be rather than what it was.
fn is_reference(column: &str) -> bool {
    let name = column.to_lowercase();
    ["ref", "target", "setpoint", "desired", "goal"]
        .iter()
        .any(|word| name.contains(word))
}

/// A duty cycle, whatever its unit: `Motor1_PWM`, `duty_pct`.
fn is_duty(column: &str) -> bool {
    let name = column.to_lowercase();
    ["pwm", "duty"].iter().any(|word| name.contains(word))
}

/// A current, which is more often measured than commanded.
fn is_current(column: &str) -> bool {
    matches!(unit::of_column(column), "A" | "mA")
}

/// Looks like what somebody commanded: `u_V`, `u1_N`, `cmd_A`, `input_V`, `Motor1_PWM`.
fn is_command(column: &str) -> bool {
    let name = column.to_lowercase();
    if is_duty(column) {
        return true;
    }
    let after_u = name
        .strip_prefix('u')
        .map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
    after_u.is_some_and(|rest| rest.starts_with('_'))
        || ["cmd", "command", "input", "control"]
            .iter()
            .any(|word| name.starts_with(word))
}

/// The name without its unit, fit for a component: `load` of `load_rad`.
pub(super) fn stem(column: &str) -> &str {
    let symbol = unit::of_column(column);
    let cut = column
        .char_indices()
        .filter(|(_, c)| *c == '_')
        .map(|(at, _)| at)
        .find(|&at| {
            // The same question that found the unit: is the rest, as a whole, this unit?
            unit::of_column(&column[at..]) == symbol
                && !column[..at].is_empty()
                && !symbol.is_empty()
        });
    cut.map_or(column, |at| &column[..at])
}

impl Columns {
    /// Sorts the columns; those that flags name come first and exclude guesses of their kind.
    ///
    /// # Errors
    /// As [`super::rig_text`].
    pub fn of(recording: &Recording, inputs: &[String], outputs: &[String]) -> Result<Self> {
        for column in inputs {
            recording.require(column, "`--input`")?;
        }
        for column in outputs {
            recording.require(column, "`--output`")?;
        }
        let names = || recording.columns().iter().map(|column| column.name.clone());
        let shown = |name: &String| {
            if outputs.is_empty() {
                !is_reference(name)
            } else {
                outputs.contains(name)
            }
        };
        let positions: Vec<String> = names()
            .filter(|name| !inputs.contains(name) && shown(name))
            .filter(|name| match quantity(name) {
                Quantity::Position(_) => true,
                // Asked for by name: taken for a position whatever its unit is.
                Quantity::Unknown => !outputs.is_empty(),
                _ => false,
            })
            .collect();
        let counted = |name: &String| !inputs.contains(name) && shown(name) && is_counts(name);
        let positions = if positions.is_empty() {
            names().filter(counted).collect()
        } else {
            positions
        };
        let inputs = if inputs.is_empty() {
            guess_inputs(recording, outputs)
        } else {
            inputs.to_vec()
        };
        let listed = names()
            .map(|name| format!("`{name}`"))
            .collect::<Vec<_>>()
            .join(", ");
        if inputs.is_empty() {
            return Err(Error::file(
                recording.path(),
                format!("no column looks like an input among {listed}"),
            )
            .expected("a unit such as `_V`, `_A`, `_N`, `_Nm` or `_1` at the end of its name")
            .help("say which one drives the device: --input COLUMN"));
        }
        if positions.is_empty() {
            return Err(Error::file(
                recording.path(),
                format!("no column looks like a position among {listed}"),
            )
            .expected("a unit such as `_m`, `_mm`, `_rad` or `_deg` at the end of its name")
            .help("say which one shows where the device is: --output COLUMN"));
        }
        let motions: Vec<Motion> = positions
            .iter()
            .filter_map(|name| match quantity(name) {
                Quantity::Position(motion) => Some(motion),
                _ => None,
            })
            .collect();
        let velocities = pair(
            &positions,
            names().filter(|name| {
                matches!(quantity(name), Quantity::Velocity(_))
                    && !is_reference(name)
                    && shown(name)
            }),
        );
        let references = pair(
            &positions,
            names().filter(|name| {
                matches!(quantity(name), Quantity::Position(_))
                    && is_reference(name)
                    && !outputs.contains(name)
            }),
        );
        Ok(Self {
            motion: motions.first().copied().or_else(|| of_forces(&inputs)),
            inputs,
            velocities,
            references,
            positions,
        })
    }

    /// Body that spring and damper connect this one with. `None`: the ground.
    pub fn neighbour(&self, index: usize) -> Option<usize> {
        let before = index.checked_sub(1)?;
        (self.inputs.len() < self.positions.len()).then_some(before)
    }

    /// The guess that several positions and fewer inputs make.
    pub fn chain_sentence(&self) -> Option<String> {
        self.neighbour(1).filter(|_| self.positions.len() > 1)?;
        let drives = match self.inputs.len() {
            1 => "one input drives".to_owned(),
            count => format!("{count} inputs drive"),
        };
        Some(format!(
            "{drives} {} bodies in a chain, each joined to the one before by a spring and a \
             damper, in the order of the columns (change `from` and `to` in the rig)",
            self.positions.len()
        ))
    }

    /// The guess that columns in counts make.
    pub fn counts_sentence(&self) -> Option<String> {
        let names = self.positions.iter().filter(|name| is_counts(name));
        let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
        (!names.is_empty()).then(|| {
            format!(
                "an encoder's resolution for {} (`gain` of its sensor, in counts per rad or per \
                 m; a recording does not show it)",
                names.join(", ")
            )
        })
    }

    /// Columns of the recording that have no part.
    pub fn unused(&self, recording: &Recording) -> Vec<String> {
        let velocities = self.velocities.iter().flatten();
        let references = self.references.iter().flatten();
        let used: Vec<&String> = self
            .inputs
            .iter()
            .chain(&self.positions)
            .chain(velocities)
            .chain(references)
            .collect();
        let names = recording.columns().iter().map(|column| column.name.clone());
        names.filter(|name| !used.contains(&name)).collect()
    }
}

/// Motion by the unit of the inputs: a torque turns.
fn of_forces(inputs: &[String]) -> Option<Motion> {
    inputs.iter().find_map(|name| match quantity(name) {
        Quantity::Force(motion) => Some(motion),
        _ => None,
    })
}

/// Columns called a command or a duty cycle, or else the first voltage and the like, or else the
/// first current, or else the first force.
fn guess_inputs(recording: &Recording, outputs: &[String]) -> Vec<String> {
    let drives = |name: &String| {
        let drive = matches!(quantity(name), Quantity::Drive | Quantity::Force(_));
        !outputs.contains(name) && !is_reference(name) && (drive || is_duty(name))
    };
    let names: Vec<String> = recording
        .columns()
        .iter()
        .map(|column| column.name.clone())
        .filter(drives)
        .collect();
    let commands: Vec<String> = names
        .iter()
        .filter(|name| is_command(name))
        .cloned()
        .collect();
    if !commands.is_empty() {
        return commands;
    }
    let mut drives = names
        .iter()
        .filter(|name| quantity(name) == Quantity::Drive);
    let first = drives
        .clone()
        .find(|name| !is_current(name))
        .or_else(|| drives.next())
        .or_else(|| names.first());
    first.cloned().into_iter().collect()
}

/// Lays companions beside positions: the one whose name begins alike, or the next that is free
/// where there are as many of them as positions.
fn pair(positions: &[String], companions: impl Iterator<Item = String>) -> Vec<Option<String>> {
    let companions: Vec<String> = companions.collect();
    positions
        .iter()
        .enumerate()
        .map(|(index, position)| {
            let alike = companions
                .iter()
                .find(|companion| companion.starts_with(stem(position)));
            let same_place = companions
                .get(index)
                .filter(|_| companions.len() == positions.len());
            // One companion belongs to one position.
            alike
                .filter(|_| positions.len() == 1 || companions.len() > 1)
                .or(same_place)
                .cloned()
        })
        .collect()
}
