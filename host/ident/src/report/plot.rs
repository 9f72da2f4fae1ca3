//! A [`Plot`] as SVG. Colours are classes, so that the page's style sheet decides on them.

use std::fmt::Write;

use super::axis::{Layout, lay_out, lay_out_logarithmic};
use super::decimate::indices;
use super::escape::escape;
use super::quantity::multiple;
use super::{Axis, Plot, Series, Stroke, Tone};

/// Width of the drawing; the page scales it.
pub(super) const WIDTH: f64 = 960.0;
/// Room for the labels of the left axis: the same in all plots, so that their time axes align.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 40.0;
/// Least distance of two ticks of the left axis.
const TICK: f64 = 28.0;

/// Place of the drawing within the SVG.
struct Frame {
    x: Layout,
    y: Layout,
    x_factor: f64,
    y_factor: f64,
    bottom: f64,
}

impl Frame {
    /// Pixel of an abscissa in SI units.
    fn px(&self, x: f64) -> f64 {
        LEFT + self.x.fraction(x / self.x_factor) * (WIDTH - LEFT - RIGHT)
    }

    /// Pixel of an ordinate in SI units.
    fn py(&self, y: f64) -> f64 {
        self.bottom - self.y.fraction(y / self.y_factor) * (self.bottom - TOP)
    }

    /// Ends of the axes in the units that are shown, and in pixels, for `interact.js`.
    fn json(&self, x_unit: &str, y_unit: &str) -> String {
        let axis = |layout: &Layout, [from, to]: [f64; 2]| {
            let (low, high) = (layout.low, layout.high);
            let kind = if layout.logarithmic {
                ",\"log\":true"
            } else {
                ""
            };
            format!("{{\"low\":{low:?},\"high\":{high:?},\"from\":{from:?},\"to\":{to:?}{kind}}}")
        };
        format!(
            "{{\"x\":{},\"y\":{},\"xUnit\":{x_unit:?},\"yUnit\":{y_unit:?}}}",
            axis(&self.x, [LEFT, WIDTH - RIGHT]),
            axis(&self.y, [self.bottom, TOP])
        )
    }
}

pub(super) fn svg(plot: &Plot) -> String {
    let height = f64::from(plot.height.max(120));
    let (x_range, x_size) = extent(
        &plot.x,
        plot.series.iter().map(|series| series.x.as_slice()),
    );
    let (y_range, y_size) = extent(
        &plot.y,
        plot.series.iter().map(|series| series.y.as_slice()),
    );
    let (x_factor, x_symbol) = multiple(x_size, &plot.x.unit);
    let (y_factor, y_symbol) = multiple(y_size, &plot.y.unit);
    let [x_low, x_high] = x_range.map(|end| end / x_factor);
    let frame = Frame {
        x: if plot.x.logarithmic {
            lay_out_logarithmic(x_low, x_high)
        } else {
            lay_out(x_low, x_high, 10, true)
        },
        y: lay_out(
            y_range[0] / y_factor,
            y_range[1] / y_factor,
            (((height - TOP - BOTTOM) / TICK) as usize).clamp(3, 8),
            plot.y.range.is_some(),
        ),
        x_factor,
        y_factor,
        bottom: height - BOTTOM,
    };

    let mut text = String::new();
    let title = escape(&plot.title);
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        text,
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\" data-frame=\"{}\">",
        escape(&frame.json(x_symbol, y_symbol))
    );
    let clip = clip_id(plot);
    let (clip_width, clip_height) = (WIDTH - LEFT - RIGHT, frame.bottom - TOP);
    let _ = writeln!(
        text,
        "<clipPath id=\"{clip}\"><rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{clip_width}\" height=\"{clip_height}\"/></clipPath>"
    );
    let opened = format!("<g clip-path=\"url(#{clip})\"><g class=\"moves\">\n");
    if !plot.bands.is_empty() {
        text.push_str(&opened);
        draw_bands(&mut text, plot, &frame);
        text.push_str("</g></g>\n");
    }
    draw_axes(
        &mut text,
        &frame,
        &labelled(&plot.x, x_symbol),
        &labelled(&plot.y, y_symbol),
        height,
    );
    text.push_str(&opened);
    for (series, class) in plot.series.iter().zip(classes(plot)) {
        draw_series(&mut text, series, class, &frame);
    }
    text.push_str("</g></g>\n");
    if plot
        .series
        .iter()
        .all(|series| series.y.iter().all(|y| !y.is_finite()))
    {
        let (x, y) = (LEFT + clip_width / 2.0, TOP + clip_height / 2.0);
        let _ = writeln!(
            text,
            "<text class=\"empty\" x=\"{x}\" y=\"{y}\">no samples</text>"
        );
    }
    text.push_str("</svg>\n");
    text
}

/// Class of each series' colour: as asked, or the first that nobody asked for.
pub(super) fn classes(plot: &Plot) -> Vec<&'static str> {
    const COLOURS: [Tone; 5] = [
        Tone::Blue,
        Tone::Orange,
        Tone::Green,
        Tone::Purple,
        Tone::Red,
    ];
    let mut free = COLOURS
        .into_iter()
        .filter(|tone| plot.series.iter().all(|series| series.tone != *tone))
        .collect::<Vec<_>>()
        .into_iter();
    plot.series
        .iter()
        .map(|series| match series.tone {
            Tone::Next => free.next().unwrap_or(Tone::Ink),
            tone => tone,
        })
        .map(|tone| match tone {
            Tone::Ink | Tone::Next => "ink",
            Tone::Blue => "blue",
            Tone::Orange => "orange",
            Tone::Green => "green",
            Tone::Purple => "purple",
            Tone::Red => "red",
        })
        .collect()
}

/// Class of a stroke.
pub(super) fn stroke_class(stroke: Stroke) -> &'static str {
    match stroke {
        Stroke::Solid => "solid",
        Stroke::Dashed => "dashed",
        Stroke::Steps => "steps",
        Stroke::Points => "points",
    }
}

/// The ends of an axis, fixed or the data's, and the largest magnitude on it.
fn extent<'a>(axis: &Axis, values: impl Iterator<Item = &'a [f64]>) -> ([f64; 2], f64) {
    let range = axis.range.unwrap_or_else(|| {
        values
            .flatten()
            .copied()
            .filter(|value| value.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |range, value| {
                [range[0].min(value), range[1].max(value)]
            })
    });
    let size = range[0].abs().max(range[1].abs());
    (range, if size.is_finite() { size } else { 0.0 })
}

fn labelled(axis: &Axis, symbol: &str) -> String {
    match (axis.label.as_str(), symbol) {
        (label, "" | "1") => label.to_owned(),
        ("", symbol) => symbol.to_owned(),
        (label, symbol) => format!("{label} ({symbol})"),
    }
}

/// Distinct for distinct plots of one page; the same in every run (FNV-1a).
fn clip_id(plot: &Plot) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut feed = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    feed(plot.title.as_bytes());
    feed(&plot.height.to_le_bytes());
    for series in &plot.series {
        feed(series.name.as_bytes());
        feed(&(series.x.len() as u64).to_le_bytes());
    }
    format!("c{hash:016x}")
}

fn draw_bands(text: &mut String, plot: &Plot, frame: &Frame) {
    for [from, to] in &plot.bands {
        let left = frame.px(*from).clamp(LEFT, WIDTH - RIGHT);
        let width = frame.px(*to).clamp(LEFT, WIDTH - RIGHT) - left;
        if width > 0.0 {
            let height = frame.bottom - TOP;
            let _ = writeln!(
                text,
                "<rect class=\"band\" x=\"{left:.1}\" y=\"{TOP}\" width=\"{width:.1}\" height=\"{height}\"/>"
            );
        }
    }
}

fn draw_axes(text: &mut String, frame: &Frame, x_label: &str, y_label: &str, height: f64) {
    let right = WIDTH - RIGHT;
    let bottom = frame.bottom;
    for tick in &frame.y.ticks {
        let y = frame.py(tick * frame.y_factor);
        let label = frame.y.label(*tick);
        let _ = writeln!(text, "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/>");
        let _ = writeln!(
            text,
            "<text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            LEFT - 8.0,
            y + 4.0
        );
    }
    for tick in &frame.x.ticks {
        let x = frame.px(tick * frame.x_factor);
        let label = frame.x.label(*tick);
        let _ = writeln!(
            text,
            "<path class=\"axis along\" d=\"M{x:.1} {bottom}v5\"/>"
        );
        let _ = writeln!(
            text,
            "<text class=\"tick along\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            bottom + 18.0
        );
    }
    let _ = writeln!(
        text,
        "<path class=\"axis\" d=\"M{LEFT} {bottom}H{right}\"/>"
    );
    // The label of the left axis lies on top of it, so that nobody tilts his head.
    let _ = writeln!(
        text,
        "<text class=\"label above\" x=\"0\" y=\"13\">{}</text>",
        escape(y_label)
    );
    let _ = writeln!(
        text,
        "<text class=\"label below\" x=\"{right}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
        height - 4.0,
        escape(x_label)
    );
}

fn draw_series(text: &mut String, series: &Series, tone: &str, frame: &Frame) {
    let end = |end: f64| {
        let shown = if frame.x.logarithmic {
            10f64.powf(end)
        } else {
            end
        };
        shown * frame.x_factor
    };
    let (low, high) = (end(frame.x.low), end(frame.x.high));
    let drawn = indices(
        &series.x,
        &series.y,
        low,
        high,
        (WIDTH - LEFT - RIGHT) as usize,
    );
    let mut path = String::new();
    let mut last: Option<f64> = None;
    for i in drawn {
        let (x, y) = (series.x[i], series.y[i]);
        if !x.is_finite() || !y.is_finite() {
            last = None;
            continue;
        }
        // Values far outside a fixed range would overflow what browsers draw.
        let (px, py) = (frame.px(x), frame.py(y).clamp(-1e4, 1e4));
        let _ = match (series.stroke, last) {
            (Stroke::Points, _) => write!(path, "M{px:.1} {py:.1}h0"),
            (_, None) => write!(path, "M{px:.1} {py:.1}"),
            (Stroke::Steps, Some(_)) => write!(path, "H{px:.1}V{py:.1}"),
            (Stroke::Solid | Stroke::Dashed, Some(_)) => write!(path, "L{px:.1} {py:.1}"),
        };
        last = Some(py);
    }
    if !path.is_empty() {
        let stroke = stroke_class(series.stroke);
        let _ = writeln!(
            text,
            "<path class=\"series {tone} {stroke}\" d=\"{path}\">{}</path>",
            if series.name.is_empty() {
                String::new()
            } else {
                format!("<title>{}</title>", escape(&series.name))
            }
        );
    }
}
