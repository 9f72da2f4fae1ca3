//! Plots one below the other as one SVG file, for where no page is wanted.

use std::fmt::Write;

use super::Plot;
use super::escape::escape;
use super::html::STYLE;
use super::plot::{WIDTH, classes, stroke_class, svg};

/// Room around everything.
const MARGIN: f64 = 20.0;
/// Height of a plot's title and of each line of its legend.
const LINE: f64 = 24.0;
/// Width of one entry of a legend.
const ENTRY: f64 = 190.0;

/// A whole SVG file: titles, legends and plots, with the report's style sheet inside, so that it
/// follows the reader's light or dark setting.
pub fn sheet(plots: &[Plot]) -> String {
    let entries = ((WIDTH / ENTRY) as usize).max(1);
    let mut body = String::new();
    let mut y = MARGIN;
    for plot in plots {
        let title = escape(&plot.title);
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            body,
            "<text class=\"title\" x=\"{MARGIN}\" y=\"{:.0}\">{title}</text>",
            y + 16.0
        );
        y += LINE;
        for (row, (series, tone)) in (plot.series.chunks(entries))
            .zip(classes(plot).chunks(entries))
            .enumerate()
        {
            let y = y + LINE * row as f64;
            for (column, (series, tone)) in series.iter().zip(tone).enumerate() {
                let x = MARGIN + ENTRY * column as f64;
                let _ = writeln!(
                    body,
                    "<path class=\"series {tone} {}\" d=\"M{x:.0} {:.0}h24\"/>\
                     <text x=\"{:.0}\" y=\"{:.0}\">{}</text>",
                    stroke_class(series.stroke),
                    y + 8.0,
                    x + 32.0,
                    y + 12.0,
                    escape(&series.name)
                );
            }
        }
        y += LINE * plot.series.len().div_ceil(entries) as f64;
        let height = f64::from(plot.height.max(120));
        // Placed where it belongs; its own view box stays as it is.
        let placed =
            format!("<svg x=\"{MARGIN}\" y=\"{y:.0}\" width=\"{WIDTH}\" height=\"{height}\" ");
        body += &svg(plot).replacen("<svg ", &placed, 1);
        y += height + MARGIN;
    }
    let width = WIDTH + 2.0 * MARGIN;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {y}\" width=\"{width}\" \
         height=\"{y}\" font-family=\"system-ui, sans-serif\">\n<style>\n{STYLE}\
         .title {{ font-size: 15px; font-weight: 600; fill: var(--ink); }}\n</style>\n\
         <rect width=\"100%\" height=\"100%\" style=\"fill: var(--ground)\"/>\n{body}</svg>\n"
    )
}
