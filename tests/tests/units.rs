//! `sinew diagnose` knows no absolute sizes: a device that is a thousand times as long, as heavy or
//! as slow has what the device has, in numbers as much larger.

use std::fs;
use std::path::PathBuf;

use sinew_ident::diagnose::{self, DiagnoseOptions, Diagnosis, Estimate, Recordings};
use sinew_ident::recording::{Column, Recording};
use sinew_sim::Rig;
use toml::{Table, Value};

/// New units of a metre, a kilogram and a second.
#[derive(Clone, Copy)]
struct Scale {
    length: f64,
    mass: f64,
    time: f64,
}

impl Scale {
    fn force(self) -> f64 {
        self.mass * self.length / self.time.powi(2)
    }

    /// By how much numbers of this unit grow: `N s/m`, `N/m^3`.
    fn of(self, unit: &str) -> f64 {
        let mut factor = 1.0;
        for (place, part) in unit.split('/').enumerate() {
            for power in part.split(' ') {
                let (name, power) = power.split_once('^').unwrap_or((power, "1"));
                let power: i32 = power.parse().expect("a whole power");
                let base = match name {
                    "m" => self.length,
                    "kg" => self.mass,
                    "s" => self.time,
                    "N" => self.force(),
                    "1" | "V" | "" => 1.0,
                    other => panic!("a unit that this test does not know: {other}"),
                };
                factor *= base.powi(if place == 0 { power } else { -power });
            }
        }
        factor
    }

    /// A rig's text with every number that has a size grown.
    fn rig(self, text: &str) -> String {
        let mut rig: Table = text.parse().expect("a rig");
        for (_, blocks) in &mut rig {
            for block in blocks.as_array_mut().into_iter().flatten() {
                for (key, value) in block.as_table_mut().expect("a block") {
                    let factor = match key.as_str() {
                        "inertia" => self.mass,
                        "stiffness" => self.force() / self.length,
                        "damping" => self.force() * self.time / self.length,
                        "gain" => self.force(),
                        "rest" => self.length,
                        _ => continue,
                    };
                    grow(value, factor);
                }
            }
        }
        rig.to_string()
    }

    fn recording(self, found: &Recording) -> Recording {
        let t = found.t().iter().map(|t| t * self.time).collect();
        let columns = found.columns().iter().map(|column| {
            let factor = self.of(column.name.rsplit('_').next().expect("a suffix"));
            let values = column.values.iter().map(|value| value * factor).collect();
            Column {
                name: column.name.clone(),
                values,
            }
        });
        Recording::new(found.path(), t, columns.collect()).expect("as well formed as it was")
    }
}

/// A number, or the numbers of `{ value, min, max }`.
fn grow(value: &mut Value, factor: f64) {
    match value {
        Value::Float(number) => *number *= factor,
        Value::Table(range) => range.iter_mut().for_each(|(_, bound)| grow(bound, factor)),
        other => panic!("no number: {other}"),
    }
}

fn diagnosed(case: usize, scale: Scale) -> Diagnosis {
    let cases = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("foreign/cases");
    let folder = cases.join(format!("case-{case:02}"));
    let text = fs::read_to_string(folder.join("rig.toml")).expect("the case has a rig");
    let rig = Rig::parse(&scale.rig(&text), "rig.toml").unwrap_or_else(|error| panic!("{error}"));
    let read = |name: &str| {
        let found = Recording::read(folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
        scale.recording(&found)
    };
    let recordings = Recordings {
        fit: vec![read("fit-a.csv"), read("fit-b.csv")],
        check: vec![read("check.csv")],
        test: vec![read("test.csv")],
    };
    diagnose::diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

fn assert_grown(of: &str, scale: Scale, own: &Estimate, grown: &Estimate) {
    assert_eq!(own.unit, grown.unit, "{of}");
    let wanted = own.value * scale.of(&own.unit);
    assert!(
        (grown.value - wanted).abs() <= 1e-3 * wanted.abs(),
        "{of}: {} in the place of {wanted}",
        grown.value
    );
}

#[test]
fn a_device_of_another_size_has_what_the_device_has() {
    let own = Scale {
        length: 1.0,
        mass: 1.0,
        time: 1.0,
    };
    // Millimetres, tonnes and milliseconds; a bridge; a device of micrometres.
    let scales = [(1e3, 1e-3, 1e3), (40.0, 1e6, 10.0), (1e-6, 1e-9, 1e-4)];
    // A stop, nothing under heavy noise, friction by load on a free axis.
    for case in [5, 10, 14] {
        let device = diagnosed(case, own);
        for (length, mass, time) in scales {
            let scale = Scale { length, mass, time };
            let other = diagnosed(case, scale);
            assert_eq!(device.verdict.name(), other.verdict.name(), "case {case}");
            assert_eq!(device.effects.len(), other.effects.len(), "case {case}");
            for (own, grown) in device.effects.iter().zip(&other.effects) {
                assert_eq!(
                    (&own.kind, &own.component),
                    (&grown.kind, &grown.component),
                    "case {case}"
                );
                assert!(
                    (own.confidence - grown.confidence).abs() < 0.01,
                    "{}: {} in the place of {}",
                    own.kind,
                    grown.confidence,
                    own.confidence
                );
                for ((name, own), grown) in own.parameters.iter().zip(grown.parameters.values()) {
                    assert_grown(name, scale, own, grown);
                }
            }
        }
    }
}
