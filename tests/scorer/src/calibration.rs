//! Stated confidence against how often it was right, as a plot (SVG) and as lines of a table.

use std::fmt::Write;

use crate::score;
use crate::table::Scored;

/// Edges of the bins of confidence.
const EDGES: &[f64] = &[0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0];

/// One bin.
pub struct Bin {
    /// Statements in it.
    pub count: usize,
    /// Their mean confidence.
    pub stated: f64,
    /// The part of them that was right.
    pub right: f64,
}

/// Every name that was given, in all sorts of cases; right: the case hides it.
pub fn bins(cases: &[Scored]) -> Vec<Bin> {
    let mut statements: Vec<(f64, bool)> = Vec::new();
    for case in cases {
        for named in case.answer.iter().flat_map(|answer| &answer.effects) {
            statements.push((named.confidence, score::meant(named, &case.truth).is_some()));
        }
    }
    let mut bins = Vec::new();
    for edge in EDGES.windows(2) {
        let last = edge[1] == 1.0;
        let inside: Vec<&(f64, bool)> = (statements.iter())
            .filter(|(c, _)| *c >= edge[0] && (*c < edge[1] || last))
            .collect();
        if !inside.is_empty() {
            let count = inside.len();
            bins.push(Bin {
                count,
                stated: inside.iter().map(|(c, _)| c).sum::<f64>() / count as f64,
                right: inside.iter().filter(|(_, right)| *right).count() as f64 / count as f64,
            });
        }
    }
    bins
}

/// The bins as a table.
pub fn table(bins: &[Bin]) -> String {
    let mut text = String::from("| stated | right | statements |\n|--:|--:|--:|\n");
    for bin in bins {
        let _ = writeln!(
            text,
            "| {:.3} | {:.3} | {} |",
            bin.stated, bin.right, bin.count
        );
    }
    text
}

/// The bins as a plot: the diagonal is honest, below it is boasting.
pub fn svg(bins: &[Bin]) -> String {
    let (left, top, size) = (60.0, 20.0, 360.0);
    let x = |value: f64| left + size * value;
    let y = |value: f64| top + size * (1.0 - value);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n\
         <rect x=\"{left}\" y=\"{top}\" width=\"{size}\" height=\"{size}\" fill=\"none\" stroke=\"#888\"/>\n\
         <path d=\"M{} {}L{} {}\" stroke=\"#bbb\"/>\n",
        x(0.0),
        y(0.0),
        x(1.0),
        y(1.0),
        w = left + size + 20.0,
        h = top + size + 50.0,
    );
    for tick in 0..=5 {
        let value = f64::from(tick) / 5.0;
        let _ = writeln!(
            text,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{value:.1}</text>",
            x(value),
            y(0.0) + 18.0
        );
        let _ = writeln!(
            text,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{value:.1}</text>",
            left - 6.0,
            y(value) + 4.0
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">stated confidence</text>",
        x(0.5),
        y(0.0) + 38.0
    );
    let _ = writeln!(
        text,
        "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">right</text>",
        y(0.5)
    );
    for bin in bins {
        // One standard error of a proportion; its least is that of one in twice as many.
        let count = bin.count as f64;
        let spread = (bin.right * (1.0 - bin.right) / count)
            .sqrt()
            .max(0.5 / count);
        let (low, high) = ((bin.right - spread).max(0.0), (bin.right + spread).min(1.0));
        let _ = writeln!(
            text,
            "<path d=\"M{0} {1}L{0} {2}\" stroke=\"#246\"/>",
            x(bin.stated),
            y(low),
            y(high)
        );
        let _ = writeln!(
            text,
            "<circle cx=\"{}\" cy=\"{}\" r=\"4\" fill=\"#246\"><title>{} statements</title></circle>",
            x(bin.stated),
            y(bin.right),
            bin.count
        );
    }
    text.push_str("</svg>\n");
    text
}
