//! An optimal experiment beside the families, for a terminal.

use std::fmt::Write;

use super::{Comparison, Measures};
use crate::excite::reveal::Revelation;
use crate::report::significant;

/// One line an experiment: distances of the effects that are hardest to see in it, their geometric
/// mean, and the widest interval of a free parameter; then the effects by name.
pub fn lines(found: &Comparison, revelation: &Revelation) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        text,
        "the hardest effects of each experiment, same length, limits and noise (standard deviations):"
    );
    if found.family.is_none() {
        line(&mut text, "design", &found.chosen);
    }
    for (kind, measures) in &found.families {
        line(&mut text, kind.name(), measures);
    }
    let (gain, best) = found.gain();
    let _ = match found.family {
        Some(kind) => writeln!(
            text,
            "no design is better than `--kind {}`: written",
            kind.name()
        ),
        None => writeln!(
            text,
            "the design shows the hardest effects {} times as well as `--kind {}`",
            significant(gain, 3),
            best.name()
        ),
    };
    let names = found.chosen.hardest.iter().map(|&(index, distance)| {
        let seen = &revelation.effects[index];
        let kind = seen.kind.description().kind;
        format!("{kind} at {} {distance:.0}", seen.component)
    });
    let names: Vec<String> = names.collect();
    let _ = writeln!(text, "hardest in it: {}", names.join(", "));
    text
}

fn line(text: &mut String, name: &str, measures: &Measures) {
    let distances = measures
        .hardest
        .iter()
        .map(|(_, distance)| format!("{distance:7.1}"));
    let widest = measures
        .widest
        .as_ref()
        .map_or_else(String::new, |(name, part)| {
            format!("   {name} within {} %", significant(100.0 * part, 2))
        });
    let _ = writeln!(
        text,
        "  {name:<10}{}   mean {:6.1}{widest}",
        distances.collect::<String>(),
        measures.mean_distance,
    );
}
