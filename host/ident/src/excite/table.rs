//! Table of visible effects for a terminal.

use std::fmt::Write;

use super::reveal::{PARALLEL, REVEALED, Revelation, Seen, WEAKLY};
use crate::order;

/// Most confusions that are listed.
const LISTED: usize = 24;

/// One line a kind of effect: where it would be revealed, where weakly, where not, each place with
/// its distance; then the pairs that would be confused.
pub fn table(found: &Revelation) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(
        text,
        "what it would show, in standard deviations of the noise, beyond what {} free parameters and\n\
         start states could imitate ({REVEALED:.0} and more: revealed; {WEAKLY:.0} and more: weakly):",
        found.directions
    );
    let mut kinds: Vec<&'static str> = Vec::new();
    for seen in &found.effects {
        let kind = seen.kind.description().kind;
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let width = kinds.iter().map(|kind| kind.len()).max().unwrap_or(0);
    for kind in kinds {
        let of_kind = || {
            found
                .effects
                .iter()
                .filter(|seen| seen.kind.description().kind == kind)
        };
        let mut name = kind;
        for (word, low, high) in [
            ("revealed", REVEALED, f64::INFINITY),
            ("weakly", WEAKLY, REVEALED),
            ("not revealed", f64::NEG_INFINITY, WEAKLY),
        ] {
            let mut places: Vec<(&str, f64)> = of_kind()
                .filter_map(|seen| Some((seen.component.as_str(), seen.distance?)))
                .filter(|(_, distance)| (low..high).contains(distance))
                .collect();
            order::sort_down(&mut places, |place| place.1);
            if !places.is_empty() {
                let list: Vec<String> = places
                    .iter()
                    .map(|(at, d)| format!("{at} {d:.0}"))
                    .collect();
                let _ = writeln!(text, "  {name:<width$}  {word:<12}  {}", list.join(", "));
                name = "";
            }
        }
        let failed: Vec<&str> = of_kind()
            .filter(|seen| seen.distance.is_none())
            .map(|seen| seen.component.as_str())
            .collect();
        if !failed.is_empty() {
            let _ = writeln!(
                text,
                "  {name:<width$}  {:<12}  {}",
                "cannot run",
                failed.join(", ")
            );
        }
    }
    confused(&mut text, found);
    text
}

fn confused(text: &mut String, found: &Revelation) {
    if found.confusions.is_empty() {
        let _ = writeln!(
            text,
            "no two of them would be confused (cosine below {PARALLEL})"
        );
        return;
    }
    let _ = writeln!(text, "would be confused (cosine {PARALLEL} and more):");
    let name = |seen: &Seen| format!("{} at {}", seen.kind.description().kind, seen.component);
    for confusion in found.confusions.iter().take(LISTED) {
        let [a, b] = confusion.pair.map(|index| name(&found.effects[index]));
        let _ = writeln!(text, "  {:.3}  {a}, {b}", confusion.cosine);
    }
    if found.confusions.len() > LISTED {
        let _ = writeln!(text, "  and {} more pairs", found.confusions.len() - LISTED);
    }
}
