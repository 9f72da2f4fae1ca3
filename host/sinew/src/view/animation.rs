//! The shape of a rig over time as a piece of a page: drawings that a small script moves, nothing
//! loaded.

use serde_json::{Value, json};
use sinew_sim::{Outline, Plant, Role, SimulationError};

/// Most pictures of one animation; a longer run leaves rows out, evenly.
const PICTURES: usize = 400;
/// Grid of the coordinates that are written, m.
const GRID: f64 = 1e-4;

const SCRIPT: &str = include_str!("animation.js");
const STYLE: &str = include_str!("animation.css");

/// Outlines of a rig at some rows of a simulation.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    every: usize,
    times: Vec<f64>,
    pictures: Vec<Vec<Outline>>,
}

impl Animation {
    /// Room for a run of so many rows.
    pub fn new(rows: usize) -> Self {
        Self {
            every: rows.div_ceil(PICTURES).max(1),
            ..Self::default()
        }
    }

    /// Looks at a row, in order.
    ///
    /// # Errors
    /// The state or the values have the wrong length.
    pub fn take(
        &mut self,
        row: usize,
        time: f64,
        plant: &Plant,
        values: &[f64],
        state: &[f64],
    ) -> Result<(), SimulationError> {
        if row.is_multiple_of(self.every) {
            self.times.push(time);
            self.pictures.push(plant.outlines(values, state)?);
        }
        Ok(())
    }

    /// True if the rig has no shape.
    pub fn is_empty(&self) -> bool {
        self.pictures.iter().all(Vec::is_empty)
    }

    /// The piece of a page: style, controls, data and script.
    pub fn to_html(&self) -> String {
        // `</` inside a script could end it; JSON may write the slash with a backslash.
        let data = self.data().to_string().replace("</", "<\\/");
        format!(
            "<style>\n{STYLE}</style>\n<div class=\"animation\">\n<div class=\"views\"></div>\n\
             <p class=\"controls\"><button type=\"button\">Pause</button>\
             <input type=\"range\" min=\"0\" max=\"{}\" value=\"0\" aria-label=\"time\">\
             <output></output></p>\n</div>\n\
             <script>\nconst shape = {data};\n{SCRIPT}</script>\n",
            self.times.len().saturating_sub(1)
        )
    }

    /// Times in s; of each outline its name, role and points a picture; of each picture its points
    /// x, y, z in units of the grid, outline after outline.
    pub(super) fn data(&self) -> Value {
        let first = self.pictures.first().map_or(&[][..], Vec::as_slice);
        let outlines = (first.iter())
            .map(|o| json!({ "name": o.name, "role": role(o.role), "points": o.points.len() }));
        let flat = |picture: &Vec<Outline>| -> Vec<i64> {
            (picture
                .iter()
                .flat_map(|outline| outline.points.iter().flatten()))
            .map(|x| (x / GRID).round() as i64)
            .collect()
        };
        json!({
            "grid": GRID,
            "times": self.times,
            "outlines": outlines.collect::<Vec<_>>(),
            "pictures": self.pictures.iter().map(flat).collect::<Vec<_>>(),
        })
    }
}

fn role(role: Role) -> &'static str {
    match role {
        Role::Chain => "chain",
        Role::Waveguide => "waveguide",
        Role::Plate => "plate",
        Role::Tip => "tip",
        Role::Tendon => "tendon",
        Role::Hasel => "hasel",
        Role::Magnet => "magnet",
        Role::Magnetometer => "magnetometer",
    }
}
