//! Reports: one self-contained HTML file with plots, readable offline, in light and in dark.
//!
//! A [`Report`] is data; [`Report::to_html`] is a pure function of it. Style sheet and plots are
//! inside the file, which loads nothing. Its one script (`interact.js`) reads values under the
//! pointer and zooms; without it the page is the same, at rest. The plots are drawn
//! here rather than by a plotting library so that their colours can follow the reader's light or
//! dark setting, which needs classes instead of fixed colours in the SVG
//! (docs/decisions/0009-plots-without-a-library.md).
//!
//! ```
//! use sinew_ident::report::{Block, Plot, Report, Section, Series, Stroke};
//! let plot = Plot::over_time("Position").y("position", "m").with(Series::new(
//!     "measured", Stroke::Solid, vec![0.0, 0.1, 0.2], vec![0.0, 0.012, f64::NAN],
//! ));
//! let report = Report::new("Fit").section(Section::new("Recording").with(Block::Plot(plot)));
//! assert!(report.to_html().contains("position (mm)"));
//! ```

mod axis;
mod decimate;
mod escape;
mod html;
mod own_values;
mod plot;
mod provenance;
mod quantity;
mod sheet;
mod warnings;

use std::path::Path;

pub use own_values::{own_interval, own_value, shared_values};
pub use provenance::Provenance;
pub use quantity::{count, exact, quantity, significant};
pub use sheet::sheet;
pub use warnings::{beyond_bounds, runs_away, unexplained, unseen, warnings};

use crate::error::Result;

/// One page.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Its heading.
    pub title: String,
    /// One sentence below it: what was found.
    pub lead: String,
    /// The step that comes next, below the lead: a sentence or a command line. May be empty.
    pub next: String,
    /// The numbers that matter, as cards below the lead.
    pub facts: Vec<Fact>,
    /// The chapters.
    pub sections: Vec<Section>,
    /// The last line: [`Provenance`].
    pub footer: String,
}

/// One number that matters.
#[derive(Debug, Clone)]
pub struct Fact {
    /// Its label: `Tracking error, MPC`.
    pub label: String,
    /// Its value with unit: `11.2 mm`.
    pub value: String,
    /// Value to compare with: `PID 24.0 mm`; may be empty.
    pub note: String,
}

/// One chapter.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// Its contents.
    pub blocks: Vec<Block>,
}

/// A piece of a chapter.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph; blank lines separate paragraphs.
    Text(String),
    /// Something the reader must not miss, such as missing samples.
    Notice(String),
    /// Text as a terminal shows it.
    Code(String),
    /// A table.
    Table(Table),
    /// A plot.
    Plot(Plot),
    /// Numbers as cards.
    Facts(Vec<Fact>),
    /// HTML as it stands, of this program's own making: an animation.
    Html(String),
}

/// A table of text; numbers are formatted by [`significant`] or [`quantity`].
///
/// ```
/// use sinew_ident::report::{Block, Report, Section, Table, TableColumn};
///
/// let column = |title: &str, numeric| TableColumn { title: title.into(), numeric };
/// let table = Table {
///     caption: "Fitted parameters".into(),
///     columns: vec![column("parameter", false), column("value", true)],
///     rows: vec![vec!["cart.inertia".into(), "5.02 kg".into()]],
/// };
/// let page = Report::new("Fit").section(Section::new("Parameters").with(Block::Table(table)));
/// assert!(page.to_html().contains("5.02 kg"));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Its caption; may be empty.
    pub caption: String,
    /// Titles of the columns.
    pub columns: Vec<TableColumn>,
    /// Rows; a short one is filled with empty cells.
    pub rows: Vec<Vec<String>>,
}

/// One column of a [`Table`].
#[derive(Debug, Clone)]
pub struct TableColumn {
    /// Its title.
    pub title: String,
    /// Numbers stand to the right, one below the other.
    pub numeric: bool,
}

/// A plot of one or more series over a common axis.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Its title.
    pub title: String,
    /// The axis below.
    pub x: Axis,
    /// The axis at the left.
    pub y: Axis,
    /// Drawn in order, the last on top.
    pub series: Vec<Series>,
    /// Shaded stretches of the x axis, `[from, to]`: where a mismatch sits, say.
    pub bands: Vec<[f64; 2]>,
    /// Height of the drawing in pixels of a 960 pixel wide page.
    pub height: u32,
}

/// One axis.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Measured quantity: `position`.
    pub label: String,
    /// Its SI unit: `m`; small ranges are shown in `mm` or `µm`. May be empty.
    pub unit: String,
    /// Fixed ends; otherwise the data's.
    pub range: Option<[f64; 2]>,
    /// Equal ratios have equal lengths; values are above zero. Of the axis below only.
    pub logarithmic: bool,
}

/// One line or cloud.
#[derive(Debug, Clone)]
pub struct Series {
    /// For the legend; without one the line belongs to the series before.
    pub name: String,
    /// Its stroke.
    pub stroke: Stroke,
    /// Its colour.
    pub tone: Tone,
    /// Abscissas, increasing.
    pub x: Vec<f64>,
    /// Ordinates; NaN breaks the line.
    pub y: Vec<f64>,
}

/// Stroke of a series; strokes differ so that nobody depends on colour alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A line.
    Solid,
    /// A dashed line.
    Dashed,
    /// Held from one sample to the next, as a command is.
    Steps,
    /// A dot a sample.
    Points,
}

/// The colour of a series; each is legible on both grounds and distinct to the colour-blind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// The next colour that this plot has not used.
    #[default]
    Next,
    /// The colour of text: what everything else is held against (a reference, a measurement).
    Ink,
    /// Colour 1 (blue), by convention what the product does.
    Blue,
    /// Colour 2 (orange), by convention its rival.
    Orange,
    /// Colour 3.
    Green,
    /// Colour 4.
    Purple,
    /// Colour 5, by convention a limit or an error.
    Red,
}

impl Report {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// Sets the sentence below the heading.
    #[must_use]
    pub fn lead(mut self, lead: impl Into<String>) -> Self {
        self.lead = lead.into();
        self
    }

    /// Sets the step that comes next.
    #[must_use]
    pub fn next(mut self, next: impl Into<String>) -> Self {
        self.next = next.into();
        self
    }

    /// Adds a number that matters.
    #[must_use]
    pub fn fact(
        mut self,
        label: impl Into<String>,
        value: impl Into<String>,
        note: impl Into<String>,
    ) -> Self {
        self.facts.push(Fact {
            label: label.into(),
            value: value.into(),
            note: note.into(),
        });
        self
    }

    /// Adds a chapter.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// Sets the last line.
    #[must_use]
    pub fn made(mut self, by: &Provenance) -> Self {
        self.footer = by.line();
        self
    }

    /// The whole file.
    pub fn to_html(&self) -> String {
        html::page(self)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// `Write`.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        Ok(sinew_files::write(path, self.to_html())?)
    }
}

impl Section {
    /// An empty chapter.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            blocks: Vec::new(),
        }
    }

    /// Adds a piece.
    #[must_use]
    pub fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn text(self, text: impl Into<String>) -> Self {
        self.with(Block::Text(text.into()))
    }
}

impl Table {
    /// A table without rows; a title that begins with `#` marks a column of numbers:
    /// `["name", "#kg"]`.
    pub fn new<'a>(caption: impl Into<String>, titles: impl IntoIterator<Item = &'a str>) -> Self {
        let columns = titles
            .into_iter()
            .map(|title| match title.strip_prefix('#') {
                Some(title) => TableColumn {
                    title: title.to_owned(),
                    numeric: true,
                },
                None => TableColumn {
                    title: title.to_owned(),
                    numeric: false,
                },
            });
        Self {
            caption: caption.into(),
            columns: columns.collect(),
            rows: Vec::new(),
        }
    }

    /// For a terminal: the caption, then columns as wide as they must be.
    pub fn text(&self) -> String {
        let titles = self.columns.iter().map(|column| column.title.clone());
        let titles: Vec<String> = titles.collect();
        let rows = || std::iter::once(&titles).chain(&self.rows);
        let width = |i: usize| rows().map(|row| row[i].chars().count()).max();
        let widths: Vec<usize> = (0..titles.len()).filter_map(width).collect();
        let lines = rows().map(|row| {
            let cells = row.iter().zip(&widths).zip(&self.columns);
            let cells = cells.map(|((cell, width), column)| {
                if column.numeric {
                    format!("{cell:>width$}")
                } else {
                    format!("{cell:<width$}")
                }
            });
            cells.collect::<Vec<_>>().join("  ") + "\n"
        });
        format!("{}\n{}", self.caption, lines.collect::<String>())
    }

    /// Adds a row.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }
}

impl Plot {
    /// An empty plot over time in seconds.
    pub fn over_time(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x: Axis {
                label: "time".into(),
                unit: "s".into(),
                range: None,
                logarithmic: false,
            },
            y: Axis {
                label: String::new(),
                unit: String::new(),
                range: None,
                logarithmic: false,
            },
            series: Vec::new(),
            bands: Vec::new(),
            height: 260,
        }
    }

    /// Sets the axis below.
    #[must_use]
    pub fn x(mut self, label: impl Into<String>, unit: impl Into<String>) -> Self {
        self.x = Axis {
            label: label.into(),
            unit: unit.into(),
            range: None,
            logarithmic: false,
        };
        self
    }

    /// Sets the axis at the left.
    #[must_use]
    pub fn y(mut self, label: impl Into<String>, unit: impl Into<String>) -> Self {
        self.y = Axis {
            label: label.into(),
            unit: unit.into(),
            range: None,
            logarithmic: false,
        };
        self
    }

    /// Makes the axis below logarithmic.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.x.logarithmic = true;
        self
    }

    /// Fixes the ends of the axis at the left.
    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.y.range = Some([low, high]);
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The plot as an SVG element, for a page that already has the report's style sheet.
    pub fn to_svg(&self) -> String {
        plot::svg(self)
    }
}

impl Series {
    /// A series in the next free colour.
    pub fn new(name: impl Into<String>, stroke: Stroke, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            stroke,
            tone: Tone::Next,
            x,
            y,
        }
    }

    /// Sets the colour.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }
}

#[cfg(test)]
mod tests;
