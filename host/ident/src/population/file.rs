//! The file of a fleet: `fleet.toml`, format `sinew-fleet/1`, described in
//! docs/reference/fleet.md. Equations are those of docs/explanation/identification.md.

use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use sinew_sim::Plant;
use toml::Spanned;

use super::draw::Draws;
use super::student;
use crate::error::{Error, Result};

/// The only format.
const FORMAT: &str = "sinew-fleet/1";

/// Page of the format.
const PAGE: &str = "the keys of docs/reference/fleet.md";

/// Fewest degrees of freedom whose draws have a finite variance.
const LEAST_FREEDOM: usize = 3;

/// Largest asymmetry and smallest eigenvalue of a covariance, as a part of its largest entry.
const ROUNDING: f64 = 1e-9;

/// Scale on which a parameter is distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Its logarithm: a parameter that keeps its sign.
    Log,
    /// Itself.
    Linear,
}

impl Scale {
    fn name(self) -> &'static str {
        match self {
            Self::Log => "log",
            Self::Linear => "linear",
        }
    }
}

/// One parameter of a fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// `mass.inertia`.
    pub name: String,
    /// Its unit, SI.
    pub unit: String,
    /// Its scale.
    pub scale: Scale,
    /// Mean, SI; with logarithms the geometric one, whose sign all devices have.
    pub mean: f64,
}

impl Axis {
    /// Coordinate of a value: infinite for a value of the wrong sign on the scale of logarithms.
    pub fn coordinate(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log if value * self.mean > 0.0 => value.abs().ln(),
            Scale::Log => f64::NEG_INFINITY,
        }
    }

    /// Value of a coordinate, SI.
    pub fn value(&self, coordinate: f64) -> f64 {
        match self.scale {
            Scale::Linear => coordinate,
            Scale::Log => coordinate.exp().copysign(self.mean),
        }
    }

    /// Change of the coordinate a change of the value.
    pub fn slope(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => 1.0,
            Scale::Log => value.recip(),
        }
    }
}

/// One device of a fleet.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Names of its recordings.
    pub recordings: Vec<String>,
    /// Parameter by which it is not of the fleet.
    pub outlier: Option<String>,
    /// Fitted parameters that its recordings determine, SI.
    pub values: Vec<(String, f64)>,
}

/// Distribution of the devices of a fleet, and who was in it.
///
/// ```
/// use sinew_ident::population::{Fleet, Scale};
///
/// let text = r#"
/// format = "sinew-fleet/1"
/// rig = "cart"
/// widening = 1.5
/// freedom = 6
/// covariance = [[0.01]]
/// covariance_of_mean = [[0.002]]
/// [[parameter]]
/// name = "cart.inertia"
/// unit = "kg"
/// scale = "log"
/// mean = 5.0
/// "#;
/// let fleet = Fleet::parse(text, "fleet.toml".as_ref())?;
/// assert_eq!((fleet.axes[0].name.as_str(), fleet.axes[0].scale), ("cart.inertia", Scale::Log));
/// let error = Fleet::parse(&text.replace("0.01", "-0.01"), "fleet.toml".as_ref()).unwrap_err();
/// assert!(error.to_string().starts_with("fleet.toml:6:1: `covariance` has the eigenvalue"));
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Fleet {
    /// Name of the file, for errors.
    pub file: PathBuf,
    /// Name of the rig that was fitted to each device.
    pub rig: String,
    /// Parameters, in the order of the matrices.
    pub axes: Vec<Axis>,
    /// Covariance of the coordinates of the devices.
    pub covariance: DMatrix<f64>,
    /// Covariance of the error of their mean.
    pub of_mean: DMatrix<f64>,
    /// Factor of the covariance of a new device for few devices.
    pub widening: f64,
    /// Degrees of freedom of the tails of a new device's distribution.
    pub freedom: usize,
    /// Devices.
    pub members: Vec<Member>,
}

impl Fleet {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or as [`Fleet::parse`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::read(path, source))?;
        Self::parse(&text, path)
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// `File` with its line for a key that is unknown, missing or of another kind, for a matrix
    /// that is no covariance of these parameters, and for a number out of its range.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let source = Source { text, path };
        let read: Document = toml::from_str(text).map_err(|error| {
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            source.fault(error.span(), message, PAGE)
        })?;
        if read.format.get_ref() != FORMAT {
            return Err(source.fault(
                Some(read.format.span()),
                format!("the format is `{}`", read.format.get_ref()),
                format!("format = \"{FORMAT}\""),
            ));
        }
        let axes = source.axes(&read.parameter)?;
        let covariance = source.covariance("covariance", &read.covariance, axes.len())?;
        let of_mean = &read.covariance_of_mean;
        let of_mean = source.covariance("covariance_of_mean", of_mean, axes.len())?;
        let widening = *read.widening.get_ref();
        if !(1.0..1e6).contains(&widening) {
            return Err(source.fault(
                Some(read.widening.span()),
                format!("`widening` is {widening}"),
                "1 or more",
            ));
        }
        let freedom = *read.freedom.get_ref();
        if !(LEAST_FREEDOM..=1_000_000).contains(&freedom) {
            return Err(source.fault(
                Some(read.freedom.span()),
                format!("`freedom` is {freedom}"),
                format!("{LEAST_FREEDOM} or more degrees of freedom"),
            ));
        }
        let members = source.members(read.device, &axes)?;
        Ok(Self {
            file: path.to_path_buf(),
            rig: read.rig,
            axes,
            covariance,
            of_mean,
            widening,
            freedom,
            members,
        })
    }

    /// Text of the file.
    pub fn to_toml(&self) -> String {
        let mut text = String::from(
            "# Distribution of the devices of a fleet; written by `sinew fleet`.\n\
             # Keys: docs/reference/fleet.md.\n",
        );
        let quoted = |word: &str| toml::Value::from(word).to_string();
        let rows = |matrix: &DMatrix<f64>| {
            let rows = matrix.row_iter().map(|row| {
                let numbers: Vec<String> = row.iter().map(|it| format!("{it:e}")).collect();
                format!("    [{}],\n", numbers.join(", "))
            });
            format!("[\n{}]", rows.collect::<String>())
        };
        // Writing to a String cannot fail, here and below.
        let _ = write!(
            text,
            "format = \"{FORMAT}\"\nrig = {}\nwidening = {:?}\nfreedom = {}\n\
             covariance = {}\ncovariance_of_mean = {}\n",
            quoted(&self.rig),
            self.widening,
            self.freedom,
            rows(&self.covariance),
            rows(&self.of_mean)
        );
        for axis in &self.axes {
            let _ = write!(
                text,
                "\n[[parameter]]\nname = {}\nunit = {}\nscale = \"{}\"\nmean = {:?}\n",
                quoted(&axis.name),
                quoted(&axis.unit),
                axis.scale.name(),
                axis.mean
            );
        }
        for member in &self.members {
            let recordings: Vec<String> = member.recordings.iter().map(|it| quoted(it)).collect();
            let values = member.values.iter();
            let values: Vec<String> = values
                .map(|(name, value)| format!("{} = {value:?}", quoted(name)))
                .collect();
            let outlier = member.outlier.as_ref();
            let outlier = outlier.map(|name| format!("outlier = {}\n", quoted(name)));
            let _ = write!(
                text,
                "\n[[device]]\nname = {}\nrecordings = [{}]\n{}values = {{ {} }}\n",
                quoted(&member.name),
                recordings.join(", "),
                outlier.unwrap_or_default(),
                values.join(", ")
            );
        }
        text
    }

    /// Refuses a rig whose parameters are not those of the fleet; `names` are the rig's.
    ///
    /// # Errors
    /// `File` that names the parameters that one of the two has and the other has not.
    pub fn is_of(&self, rig: &str, names: &[&str]) -> Result<()> {
        let own: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
        let lacking = |of: &[&str], in_these: &[&str]| {
            let lacking = of.iter().filter(|name| !in_these.contains(name));
            let quoted: Vec<String> = lacking.map(|name| format!("`{name}`")).collect();
            quoted.join(", ")
        };
        let (missing, foreign) = (lacking(names, &own), lacking(&own, names));
        let message = match (missing.is_empty(), foreign.is_empty()) {
            (true, true) => return Ok(()),
            (false, true) => format!("the fleet has no {missing}, which {rig} leaves free"),
            (true, false) => format!("the fleet has {foreign}, which {rig} does not leave free"),
            (false, false) => {
                format!("the fleet has {foreign} in place of {missing}, which {rig} leaves free")
            }
        };
        let axis = |name: &str| self.axes.iter().any(|axis| axis.name == name);
        let free: Vec<String> = names
            .iter()
            .map(|name| {
                let new = if axis(name) { "" } else { " (new)" };
                format!("{name}{new}")
            })
            .collect();
        Err(Error::file(&self.file, message)
            .expected(format!("the rig's free parameters: {}", free.join(", ")))
            .help("fit the fleet once more with this rig: sinew fleet"))
    }

    /// Means in coordinates.
    pub fn mean(&self) -> DVector<f64> {
        DVector::from_iterator(
            self.axes.len(),
            self.axes.iter().map(|axis| axis.coordinate(axis.mean)),
        )
    }

    /// Covariance of the coordinates of a new device (docs/explanation/identification.md, eq. 22).
    pub fn of_a_new_device(&self) -> DMatrix<f64> {
        (&self.covariance + &self.of_mean) * self.widening
    }

    /// Value that a share of all devices does not exceed, SI: quantile of one parameter of a new
    /// device (docs/explanation/identification.md, eq. 22).
    pub fn quantile(&self, axis: usize, share: f64) -> f64 {
        let tail = self.freedom as f64;
        let scale = self.of_a_new_device()[(axis, axis)] * (tail - 2.0) / tail;
        let parameter = &self.axes[axis];
        // A negative parameter falls as its logarithm rises.
        let rises = parameter.scale == Scale::Linear || parameter.mean > 0.0;
        let share = if rises { share } else { 1.0 - share };
        let at = student::quantile(share, self.freedom) * scale.sqrt();
        parameter.value(parameter.coordinate(parameter.mean) + at)
    }

    /// Parameters of a new device that is drawn, SI, in the order of the axes.
    pub fn draw(&self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let draws = Draws::new(self.mean(), self.of_a_new_device(), self.freedom);
        let drawn = draws.draw(random);
        let pairs = self.axes.iter().zip(&drawn);
        pairs.map(|(axis, at)| axis.value(*at)).collect()
    }

    /// Values of a plant with the parameters of a new device that is drawn. Bounds of the plant
    /// are kept, and so are parameters of the plant that the fleet does not have.
    pub fn draw_plant(&self, plant: &Plant, random: &mut ChaCha8Rng) -> Vec<f64> {
        let mut values = plant.values();
        for (axis, value) in self.axes.iter().zip(self.draw(random)) {
            if let Some(slot) = plant.slot(&axis.name) {
                let parameter = &plant.parameters()[slot];
                values[slot] = value
                    .max(parameter.min.unwrap_or(f64::NEG_INFINITY))
                    .min(parameter.max.unwrap_or(f64::INFINITY));
            }
        }
        values
    }
}

fn names(axes: &[Axis]) -> String {
    let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
    names.join(", ")
}

/// Text of a file, for the places of its faults.
struct Source<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Source<'_> {
    fn fault(
        &self,
        span: Option<Range<usize>>,
        message: String,
        expected: impl Into<String>,
    ) -> Error {
        let error = Error::file(self.path, message).expected(expected);
        let error = match span {
            Some(span) => {
                let before = &self.text[..span.start.min(self.text.len())];
                error.at(1 + before.matches('\n').count(), 1)
            }
            None => error,
        };
        error.help("`sinew fleet` writes the file from recordings of each device")
    }

    fn axes(&self, tables: &[Spanned<ParameterTable>]) -> Result<Vec<Axis>> {
        let mut axes: Vec<Axis> = Vec::new();
        for table in tables {
            let span = Some(table.span());
            let table = table.get_ref();
            let scale = match table.scale.as_str() {
                "log" => Scale::Log,
                "linear" => Scale::Linear,
                other => {
                    let message = format!("the scale of `{}` is `{other}`", table.name);
                    return Err(self.fault(span, message, "\"log\" or \"linear\""));
                }
            };
            if axes.iter().any(|axis| axis.name == table.name) {
                let message = format!("`{}` is here twice", table.name);
                return Err(self.fault(span, message, "one table a parameter"));
            }
            if !table.mean.is_finite() || scale == Scale::Log && table.mean == 0.0 {
                let message = format!("the mean of `{}` is {}", table.name, table.mean);
                let expected = "a finite number; other than zero on the scale of logarithms";
                return Err(self.fault(span, message, expected));
            }
            axes.push(Axis {
                name: table.name.clone(),
                unit: table.unit.clone(),
                scale,
                mean: table.mean,
            });
        }
        if axes.is_empty() {
            let expected = "a table [[parameter]] for each parameter";
            return Err(self.fault(None, "no parameter".into(), expected));
        }
        Ok(axes)
    }

    /// The matrix of these rows, under their key.
    fn covariance(
        &self,
        key: &str,
        rows: &Spanned<Vec<Vec<f64>>>,
        size: usize,
    ) -> Result<DMatrix<f64>> {
        let refused = |fault: String| {
            let expected =
                format!("{size} rows of {size} numbers, symmetric, without a negative eigenvalue");
            Err(self.fault(Some(rows.span()), format!("`{key}` {fault}"), expected))
        };
        let rows = rows.get_ref();
        if rows.len() != size {
            return refused(format!("has {} rows", rows.len()));
        }
        if let Some(row) = rows.iter().find(|row| row.len() != size) {
            return refused(format!("has a row of {} numbers", row.len()));
        }
        if rows.iter().flatten().any(|number| !number.is_finite()) {
            return refused("has a number that is not finite".into());
        }
        let matrix = DMatrix::from_fn(size, size, |row, column| rows[row][column]);
        let largest = matrix.amax();
        if (&matrix - matrix.transpose()).amax() > ROUNDING * largest {
            return refused("is not symmetric".into());
        }
        let smallest = matrix.clone().symmetric_eigen().eigenvalues.min();
        if smallest < -ROUNDING * largest {
            return refused(format!("has the eigenvalue {smallest:.3e}"));
        }
        Ok(matrix)
    }

    fn members(&self, tables: Vec<Spanned<DeviceTable>>, axes: &[Axis]) -> Result<Vec<Member>> {
        let known = |name: &str| axes.iter().any(|axis| axis.name == name);
        let member = |table: Spanned<DeviceTable>| {
            let span = table.span();
            let table = table.into_inner();
            let mut named = table.outlier.iter().chain(table.values.keys());
            if let Some(name) = named.find(|name| !known(name)) {
                let message = format!("device `{}` has `{name}`", table.name);
                let expected = format!("parameters of the fleet: {}", names(axes));
                return Err(self.fault(Some(span), message, expected));
            }
            Ok(Member {
                name: table.name,
                recordings: table.recordings,
                outlier: table.outlier,
                values: table.values.into_iter().collect(),
            })
        };
        tables.into_iter().map(member).collect()
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: Spanned<String>,
    rig: String,
    widening: Spanned<f64>,
    freedom: Spanned<usize>,
    covariance: Spanned<Vec<Vec<f64>>>,
    covariance_of_mean: Spanned<Vec<Vec<f64>>>,
    #[serde(default)]
    parameter: Vec<Spanned<ParameterTable>>,
    #[serde(default)]
    device: Vec<Spanned<DeviceTable>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    name: String,
    unit: String,
    scale: String,
    mean: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DeviceTable {
    name: String,
    recordings: Vec<String>,
    outlier: Option<String>,
    #[serde(default)]
    values: std::collections::BTreeMap<String, f64>,
}
