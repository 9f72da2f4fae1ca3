//! Slots of the parameter vector, and the units of what stands in them.

use super::topology::{Depending, SignalSlots};
use super::{Meaning, Parameter};
use crate::effects::Sign;
use crate::rig::{Actuator, Dependence, HaselReading, Place, Reads, Rig, Signal, Site, Value};
use crate::unit::{self, Motion, Quantity};

/// The slots as they are handed out.
#[derive(Default)]
pub(super) struct Slots<'a> {
    pub(super) entries: Vec<(Parameter, Place)>,
    /// Slots of parameters that depend on a column, with how; their slopes have no slot yet.
    depending: Vec<(usize, Box<Dependence>)>,
    /// Names of the chains and of the plates, whose numbers their bodies share.
    owners: [Vec<&'a str>; 2],
}

impl<'a> Slots<'a> {
    pub(super) fn new(rig: &'a Rig) -> Self {
        let chains = rig.geometry.chains.iter().map(|chain| chain.name.as_str());
        let plates = rig.geometry.plates.iter().map(|plate| plate.name.as_str());
        Self {
            entries: Vec::new(),
            depending: Vec::new(),
            owners: [chains.collect(), plates.collect()],
        }
    }

    /// Slots so far.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// A parameter of any sign, its name in parts.
    pub(super) fn add_as(&mut self, name: &[&str], unit: &str, value: &Value) -> usize {
        self.add(name.join("."), unit, Sign::Any, value)
    }

    /// A parameter, its name in parts.
    pub(super) fn add_signed(
        &mut self,
        name: &[&str],
        unit: &str,
        sign: Sign,
        value: &Value,
    ) -> usize {
        self.add(name.join("."), unit, sign, value)
    }

    /// The name of a number that stands at a chain or a plate: theirs, whichever body or spring of
    /// theirs takes it (`spine.inertia`, `spine.inertia.2`).
    fn shared(&self, place: &Place) -> Option<String> {
        let owner = match place.table {
            "chain" => self.owners[0][place.index],
            "plate" => self.owners[1][place.index],
            _ => return None,
        };
        Some(match place.within {
            Some((_, segment)) => format!("{owner}.{}.{}", place.key, segment + 1),
            None => format!("{owner}.{}", place.key),
        })
    }

    /// A slot for a number of the file; one number has one slot, however many take it.
    pub(super) fn add(
        &mut self,
        name: String,
        unit: impl Into<String>,
        sign: Sign,
        value: &Value,
    ) -> usize {
        let same = |(_, place): &(Parameter, Place)| *place == value.place;
        if let Some(slot) = self.entries.iter().position(same) {
            return slot;
        }
        let name = self.shared(&value.place).unwrap_or(name);
        if let Some(with) = &value.with {
            self.depending.push((self.entries.len(), with.clone()));
        }
        self.entries.push((
            Parameter {
                name,
                meaning: Meaning::of(&value.place),
                unit: unit.into(),
                value: value.value,
                min: value.min,
                max: value.max,
                free: value.free,
                non_negative: matches!(sign, Sign::NonNegative | Sign::Positive),
                per_recording: value.per_recording,
            },
            value.place.clone(),
        ));
        self.entries.len() - 1
    }

    /// Slots of the signals' lags and of the slopes by them, after all others, so that laws keep
    /// their parameters in neighbouring slots.
    pub(super) fn add_dependences(
        &mut self,
        signals: &[Signal],
        rig: &Rig,
    ) -> (Vec<SignalSlots>, Vec<Depending>) {
        let lags = signals.iter().map(|signal| SignalSlots {
            lag: signal.lag.as_ref().map(|lag| {
                let name = format!("{}.lag", signal.name);
                self.add(name, "s", Sign::NonNegative, lag)
            }),
        });
        let lags = lags.collect();
        let depending = std::mem::take(&mut self.depending).into_iter();
        let slopes = depending.filter_map(|(slot, with)| {
            let signal = rig.signal_index(signals, &with.signal)?;
            let of = &self.entries[slot].0;
            let per = signal_unit(&signals[signal]);
            let (name, unit) = (format!("{}.slope", of.name), unit::ratio(&of.unit, per));
            Some(Depending {
                slot,
                slope: self.add(name, unit, Sign::Any, &with.slope),
                signal,
            })
        });
        (lags, slopes.collect())
    }

    /// A parameter of a component whose quantity follows from the motion.
    pub(super) fn of(
        &mut self,
        component: &str,
        key: &str,
        quantity: (Quantity, Motion),
        sign: Sign,
        value: &Value,
    ) -> usize {
        let unit = quantity.0.unit(quantity.1);
        self.add(format!("{component}.{key}"), unit, sign, value)
    }
}

/// Unit of what an actuator's gain multiplies: SI where a `unit` key converts the column.
pub(super) fn input_unit(actuator: &Actuator) -> &str {
    if actuator.column_factor == 1.0 {
        unit::of_column(&actuator.input)
    } else {
        ""
    }
}

/// Unit of a signal that parameters depend on: SI where a `unit` key converts the column.
pub(super) fn signal_unit(signal: &Signal) -> &str {
    let written = unit::of_column(&signal.column);
    if signal.column_factor == 1.0 {
        written
    } else {
        unit::si(written)
    }
}

pub(super) fn reading_unit(rig: &Rig, reads: Reads) -> &'static str {
    match reads {
        Reads::Position(body) => Quantity::Coordinate.unit(rig.bodies[body].motion),
        Reads::Velocity(body) => Quantity::Velocity.unit(rig.bodies[body].motion),
        Reads::Effort(body) => Quantity::Force.unit(rig.bodies[body].motion),
        Reads::ActuatorEffort(actuator) => {
            Quantity::Force.unit(rig.site_motion(Site::Actuator(actuator)))
        }
        Reads::Tension(_) => "N",
        Reads::Shape(shape) => shape.unit(),
        Reads::Hasel(_, HaselReading::Voltage) => "V",
        Reads::Hasel(_, HaselReading::Stroke) => "m",
    }
}

#[cfg(test)]
mod tests {
    use crate::{Meaning, Plant, Rig};

    #[test]
    fn the_meaning_of_a_number_follows_from_its_place_and_not_from_its_name() {
        let text = "format = 'sinew-rig/1'\nname = 'x'\n\
             [[body]]\nname = 'damping'\nmotion = 'slide'\ninertia = 1.0\nstart = 0.1\n\
             start_velocity = 0.0\n\
             [[spring]]\nname = 'coil'\nfrom = 'ground'\nto = 'damping'\nstiffness = 40.0\n\
             [[damper]]\nname = 'd'\nfrom = 'ground'\nto = 'damping'\ndamping = 1.0\n\
             [[effect]]\nkind = 'end_stop'\ncomponent = 'damping'\nposition = 0.5\n\
             stiffness = 1e4\ndamping = 3.0\nside = 1.0\n\
             [[sensor]]\nname = 's'\nreads = 'damping.position'\nsignal = 'q_m'\n";
        let plant = Plant::new(&Rig::parse(text, "x.toml").expect("a rig")).expect("a plant");
        let of = |name: &str| {
            let mut all = plant.parameters().iter();
            all.find(|it| it.name == name).map(|it| it.meaning)
        };
        for (name, meaning) in [
            ("damping.start", Meaning::Start),
            ("damping.start_velocity", Meaning::Start),
            ("damping.inertia", Meaning::Other),
            ("coil.rest", Meaning::Zero),
            ("coil.stiffness", Meaning::Other),
            ("d.damping", Meaning::Damping),
            ("damping.end_stop.damping", Meaning::Effect),
            ("s.offset", Meaning::Zero),
        ] {
            assert_eq!(of(name), Some(meaning), "{name}");
        }
        let velocities = &plant.state_names()[plant.velocities()];
        assert_eq!(velocities, ["damping.velocity"]);
    }
}
