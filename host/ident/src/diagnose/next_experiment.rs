//! The next experiment: one that would tell rivals apart.

use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::{FoundEffect, Remainder, Verdict};
use sinew_sim::effects::{Family, Kind};

/// The experiment and the command that designs it.
pub(crate) fn next_experiment(
    verdict: Verdict,
    effects: &[FoundEffect],
    remainder: Option<&Remainder>,
    place: &str,
) -> String {
    match verdict {
        Verdict::Consistent | Verdict::Parameters => {
            "None is needed for what the rig is used for here; motion beyond what these recordings visit \
             would be new to it."
                .into()
        }
        Verdict::Unexplained => moving_alone(place, "what is missing"),
        Verdict::MissingPhysics => {
            let doubt = effects.iter().find_map(|effect| {
                let rivals = effect.rivals.iter().filter(|r| r.confidence > CONFIG.report.doubt);
                let rival = effect.indistinguishable_from.iter().chain(rivals).next()?;
                Some((effect, rival))
            });
            match doubt {
                None if let Some(left) = remainder => moving_alone(&left.component, "what remains"),
                None => "None is needed to tell what is missing; the intervals of its parameters narrow \
                         with more of the same."
                    .into(),
                Some((effect, rival)) => {
                    let named = Kind::named(&effect.kind);
                    let other = Kind::named(&rival.kind);
                    let wanted = named.or(other).map_or("other motion", |kind| {
                        kind.description().excited_by
                    });
                    let shape = other.or(named).map_or("mixed", shape);
                    format!(
                        "To tell {} at {} from {} at {}, record {wanted}: `{}`.",
                        effect.kind.replace('_', " "),
                        effect.component,
                        rival.kind.replace('_', " "),
                        rival.component,
                        command(shape)
                    )
                }
            }
        }
    }
}

fn moving_alone(place: &str, what: &str) -> String {
    format!(
        "Record {place} moving alone, slowly and fast, small and large, so that {what} shows by \
         itself: `{}`.",
        command("mixed")
    )
}

fn command(shape: &str) -> String {
    format!("sinew excite RIG.toml --kind {shape} --out next.csv")
}

/// Shape of an input that shows an effect of this family best.
fn shape(kind: Kind) -> &'static str {
    match kind.description().family {
        Family::Friction | Family::Memory | Family::Gap => "triangle",
        Family::Actuator | Family::Sensor => "steps",
        Family::Mode => "chirp",
        Family::Stiffness | Family::Damping | Family::Load | Family::Learned => "mixed",
    }
}
