//! Learned laws as a page with plots.

use super::{Learned, Target};
use crate::fit::{FreeRun, SensorError};
use crate::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, quantity,
};
use sinew_sim::rig::LearnedLaw;

/// Points of a law's line.
const POINTS: usize = 401;

/// A page about laws; `runs` are free runs of the rig with the laws, each with its role, and
/// `test` the errors on test recordings.
pub fn page(
    learned: &Learned,
    runs: &[(&str, FreeRun)],
    test: &[(SensorError, SensorError)],
    made: &Provenance,
) -> Report {
    let names: Vec<&str> = learned.targets.iter().map(Target::name).collect();
    let mut report = Report::new(format!("Learned law of {}", names.join(" and ")))
        .lead(
            "Each law is zero at rest and passive by its shape; the check recordings chose how \
               smooth it is.",
        )
        .made(made);
    for (role, errors) in [
        ("fit", &learned.fit[..]),
        ("check", &learned.check),
        ("test", test),
    ] {
        for (straight, law) in errors {
            report = report.fact(
                format!("{} ({role})", law.signal),
                quantity(law.rms, &law.unit),
                format!("straight line {}", quantity(straight.rms, &law.unit)),
            );
        }
    }
    let mut laws = Section::new("Laws");
    for (law, target) in learned.laws.iter().zip(&learned.targets) {
        laws = laws.with(Block::Plot(curve(learned, law, target)));
    }
    report = report.section(laws);
    let mut motions = Section::new("Free runs");
    for (role, run) in runs {
        for sensor in &run.sensors {
            let title = format!("{} ({role}): {}", run.recording, sensor.signal);
            let plot = Plot::over_time(title)
                .y(sensor.signal.clone(), sensor.unit.clone())
                .with(
                    Series::new(
                        "measured",
                        Stroke::Solid,
                        run.t.clone(),
                        sensor.measured.clone(),
                    )
                    .tone(Tone::Ink),
                )
                .with(Series::new(
                    "with the law",
                    Stroke::Solid,
                    run.t.clone(),
                    sensor.simulated.clone(),
                ));
            motions = motions.with(Block::Plot(plot));
        }
    }
    let mut table = Table::new("Smoothness", ["#width of the bends", "#check error"]);
    for it in &learned.tried {
        table = table.row([
            format!("{}", it.width),
            format!("{:.4} %", 100.0 * it.check),
        ]);
    }
    report.section(motions).section(
        Section::new("Choice")
            .text("The check error is the free-run error as a part of the signals' spread.")
            .with(Block::Table(table)),
    )
}

/// Force over extension or rate, a fifth beyond what was met.
fn curve(learned: &Learned, law: &LearnedLaw, target: &Target) -> Plot {
    let values = law.values();
    let most = 1.2 * law.reach;
    let x: Vec<f64> = (0..POINTS)
        .map(|k| most * (2.0 * k as f64 / (POINTS - 1) as f64 - 1.0))
        .collect();
    let shape = law.shape();
    let force = x.iter().map(|&x| shape.resistance(&values, x));
    let line = target.line(&learned.straight.rig);
    let straight = x.iter().map(|x| line * x);
    let label = match target.kind() {
        sinew_sim::LawKind::Spring => "extension",
        sinew_sim::LawKind::Damper => "rate",
    };
    let mut plot = Plot::over_time(format!("{} of {}", target.kind().noun(), target.name()))
        .x(label, target.unit())
        .y("force", target.force_unit())
        .with(Series::new(
            "learned",
            Stroke::Solid,
            x.clone(),
            force.collect(),
        ))
        .with(Series::new(
            "straight line",
            Stroke::Dashed,
            x.clone(),
            straight.collect(),
        ));
    plot.bands = vec![[-most, -law.reach], [law.reach, most]];
    plot
}
