//! A finding for the tests of what shows it: the example of docs/reference/results.md.

use crate::diagnose::details::Details;
use crate::diagnose::finding::{
    Diagnosis, Errors, Estimate, FORMAT, FoundEffect, Interval, Location, Rival, SignalFit, Verdict,
};
use crate::diagnose::locate::regime::{Axis, Regime};

const RIG: &str = r#"format = "sinew-rig/1"
name = "axis"   # the one in the corner
[[body]]
name = "carriage"
motion = "slide"
inertia = { value = 95.0, min = 1.0 }   # weighed
[[damper]]
name = "rail"
from = "ground"
to = "carriage"
damping = { value = 200.0 }
[[actuator]]
name = "motor"
drives = "carriage"
input = "u_V"
gain = 35.15
[[sensor]]
name = "encoder"
reads = "carriage.position"
signal = "q_m"
"#;

/// Dry friction at a carriage.
pub(crate) fn carriage() -> Diagnosis {
    let written = sinew_sim::Rig::parse(RIG, "axis.toml").expect("the rig is sound");
    let refitted = written
        .with_values(&[("carriage.inertia", 95.2)])
        .expect("the rig has this parameter");
    let mended = format!(
        "{}\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"carriage\"\nlevel = {{ value = 20.1 }}\n",
        refitted.to_toml()
    );
    let errors = |before_rms, after_rms| Errors {
        as_written_rms: 4.0e-3,
        before_rms,
        after_rms: Some(after_rms),
        judged_rms: None,
    };
    let estimate = |value, unit: &str, ci95| Estimate {
        value,
        unit: unit.into(),
        ci95: Some(ci95),
        recordings: Vec::new(),
    };
    Diagnosis {
        format: FORMAT,
        verdict: Verdict::MissingPhysics,
        sentence: "Dry friction of 20.1 N at carriage is missing from the model.".into(),
        complete: true,
        effects: vec![FoundEffect {
            share: 0.99,
            kind: "coulomb_friction".into(),
            component: "carriage".into(),
            with: None,
            equation: "F = -20.1 N sign(v)".into(),
            sentence: "...".into(),
            parameters: [("level".to_owned(), estimate(20.1, "N", [19.8, 20.4]))].into(),
            confidence: 0.99,
            rivals: vec![Rival {
                kind: "stribeck_friction".into(),
                component: "carriage".into(),
                confidence: 0.01,
            }],
            indistinguishable_from: Vec::new(),
        }],
        remainder: None,
        judged: [("q_m".to_owned(), "free runs of whole recordings".to_owned())].into(),
        candidates: Vec::new(),
        location: Some(Location {
            component: "carriage".into(),
            follows: "sign of velocity".into(),
            intervals: vec![Interval {
                t_start_s: 1.2,
                t_end_s: 1.5,
                recording: "A.csv".into(),
                score: 9.1,
            }],
            regime: Some(Regime {
                component: "carriage".into(),
                axis: Axis::Velocity,
                unit: "m/s".into(),
                below: Some(-1.2e-3),
                above: Some(1.1e-3),
                share: 0.94,
                agreement: 0.99,
            }),
        }),
        fit: [(
            "q_m".to_owned(),
            SignalFit {
                unit: "m".into(),
                fit: errors(1.2e-3, 9.0e-5),
                check: errors(1.3e-3, 9.6e-5),
                test: Some(errors(1.3e-3, 9.5e-5)),
                noise_rms: 8.8e-5,
            },
        )]
        .into(),
        parameters: [(
            "carriage.inertia".to_owned(),
            estimate(95.2, "kg", [94.0, 96.1]),
        )]
        .into(),
        next_experiment: "...".into(),
        notes: Vec::new(),
        checks: Vec::new(),
        seconds: 1.9,
        refitted,
        mended: sinew_sim::Rig::parse(&mended, "axis.toml").expect("the rig is sound"),
        details: Details::default(),
    }
}
