//! HASEL actuators as slots: contraction, charge, pull (docs/explanation/geometry.md, eq. 9).

use super::forces::{Point, State};
use super::slots::Slots;
use super::topology::{Hasel, Topology};
use crate::effects::Sign;
use crate::geometry::zip::{self, EPSILON_0, Pouch};
use crate::rig::{HaselReading, Rig, Value};
use crate::scalar::Scalar;

/// Contraction, voltage and force of an actuator in a state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pull<S> {
    /// Shortening since it was stretched out, m.
    pub(crate) stroke: S,
    /// V.
    pub(crate) voltage: S,
    /// Along its path, N.
    pub(crate) force: S,
    /// Slope of the capacitance over the stroke, F/m.
    pub(crate) slope: S,
    /// Slope of that, F/m^2.
    pub(crate) bend: S,
    /// F.
    pub(crate) capacitance: S,
}

/// Every HASEL actuator of the rig, its path still to be found (`shapes::add`). Their charges come
/// before all states of effects.
pub(super) fn add(rig: &Rig, slots: &mut Slots, topology: &mut Topology) {
    for hasel in &rig.geometry.hasels {
        let name = hasel.name.as_str();
        let mut add =
            |key, unit, sign, value: &Value| slots.add_signed(&[name, key], unit, sign, value);
        let built = Hasel {
            path: Vec::new(),
            lines: Vec::new(),
            charge: topology.internal.len(),
            pouches: hasel.pouches as f64,
            slack: add("slack", "m", Sign::Any, &hasel.slack),
            pouch_length: add("pouch_length", "m", Sign::Positive, &hasel.pouch_length),
            width: add("width", "m", Sign::Positive, &hasel.width),
            film_thickness: add("film_thickness", "m", Sign::Positive, &hasel.film_thickness),
            permittivity: add("permittivity", "1", Sign::Positive, &hasel.permittivity),
            fill_angle: add("fill_angle", "rad", Sign::Positive, &hasel.fill_angle),
            pouch: 0,
            capacitance: add("capacitance", "F", Sign::Positive, &hasel.capacitance),
            resistance: add("resistance", "ohm", Sign::Positive, &hasel.resistance),
            film_stiffness: add(
                "film_stiffness",
                "N/m",
                Sign::NonNegative,
                &hasel.film_stiffness,
            ),
        };
        topology.internal.push(format!("{name}.charge"));
        topology.hasels.push(built);
        topology.rates_vary = true;
    }
}

impl Hasel {
    /// Reading of a sensor.
    pub(crate) fn read<S: Scalar>(&self, reading: HaselReading, at: &Point<S>) -> S {
        let pull = self.pull(at.values, &at.state.q, at.state.z[self.charge]);
        match reading {
            HaselReading::Voltage => pull.voltage,
            HaselReading::Stroke => pull.stroke,
        }
    }

    /// Contraction, voltage and force (eq. 9).
    pub(crate) fn pull<S: Scalar>(&self, values: &[S], q: &[S], charge: S) -> Pull<S> {
        let mut stroke = values[self.slack];
        for &(body, arm) in &self.path {
            stroke -= values[arm] * q[body];
        }
        let length = values[self.pouch_length];
        let share = stroke / (length * self.pouches);
        let kept = &values[self.pouch..self.pouch + zip::NUMBERS];
        let zip = Pouch::kept(values[self.fill_angle], kept).contracted(share);
        // Farad per metre of zipped film, of one pouch: two films between the electrodes.
        let density = values[self.permittivity] * values[self.width] * EPSILON_0
            / (values[self.film_thickness] * 2.0);
        let electrodes = density * length * zip.zipped * self.pouches;
        // Stretched film would take the capacitance below zero in the end; a part of the rest
        // stays.
        let capacitance =
            (values[self.capacitance] + electrodes).max(values[self.capacitance] * 0.1);
        let voltage = charge / capacitance;
        let slope = density * zip.slope;
        let mut force = voltage * voltage * slope * 0.5;
        if stroke.value() < 0.0 {
            force -= values[self.film_stiffness] * stroke;
        }
        Pull {
            stroke,
            voltage,
            force,
            slope,
            bend: density * zip.bend / (length * self.pouches),
            capacitance,
        }
    }

    /// Adds its pull to the bodies and gives the rate of its charge, A.
    pub(crate) fn act<S: Scalar>(&self, topology: &Topology, at: &Point<S>, force: &mut [S]) -> S {
        let pull = self.pull(at.values, &at.state.q, at.state.z[self.charge]);
        for &(body, arm) in &self.path {
            force[body] -= at.values[arm] * pull.force;
        }
        let mut supply = S::ZERO;
        for &line in &self.lines {
            supply += topology.through(line, at);
        }
        (supply - pull.voltage) / at.values[self.resistance]
    }

    /// Bounds on what it adds to a rig near a state: stiffness along its path, N/m, and the rate of
    /// its charge, 1/s.
    pub(crate) fn rates(&self, values: &[f64], q: &[f64], charge: f64) -> (f64, f64) {
        let pull = self.pull(values, q, charge);
        let square = pull.voltage * pull.voltage;
        // At held charge the voltage falls as the capacitance rises, which is stiffer than held
        // voltage.
        let electric =
            0.5 * square * pull.bend.abs() + square * pull.slope * pull.slope / pull.capacitance;
        (electric, 1.0 / (values[self.resistance] * pull.capacitance))
    }

    /// True where its film may be stretched within the next `ahead` seconds.
    pub(crate) fn stretches(&self, values: &[f64], state: &State<f64>, ahead: f64) -> bool {
        let (mut stroke, mut speed) = (values[self.slack], 0.0);
        for &(body, arm) in &self.path {
            stroke -= values[arm] * state.q[body];
            speed += (values[arm] * state.v[body]).abs();
        }
        stroke < 2.0 * speed * ahead
    }
}
