//! A small page held against its snapshot, and what must never break one.

use super::*;

fn small() -> Report {
    let t: Vec<f64> = (0..6).map(|k| 0.5 * f64::from(k)).collect();
    let plot = Plot::over_time("Position & reference")
        .y("position", "m")
        .with(
            Series::new(
                "reference",
                Stroke::Dashed,
                t.clone(),
                vec![0.0, 0.0, 0.02, 0.02, 0.02, 0.02],
            )
            .tone(Tone::Ink),
        )
        .with(Series::new(
            "MPC",
            Stroke::Solid,
            t.clone(),
            vec![0.0, 0.001, f64::NAN, 0.018, 0.0202, 0.02],
        ))
        .with(Series::new(
            "command",
            Stroke::Steps,
            t.clone(),
            vec![0.0, 0.01, 0.01, 0.0, -0.005, 0.0],
        ))
        .with(
            Series::new(
                "measured",
                Stroke::Points,
                t,
                vec![0.0, 0.0012, 0.009, 0.0178, 0.02, 0.02],
            )
            .tone(Tone::Red),
        );
    let plot = Plot {
        bands: vec![[0.75, 1.25]],
        height: 200,
        ..plot
    };
    Report::new("A <small> report")
        .lead("Dry friction of 0.6 N at `mass` is missing from the model.")
        .fact("Tracking error, MPC", quantity(0.011, "m"), "PID 24.0 mm")
        .fact("Flash", "24 312 B", "")
        .section(
            Section::new("Fit")
                .text("First paragraph.\n\nSecond & last.")
                .with(Block::Notice(
                    "3 of 100 samples of `u_N` are missing.".into(),
                ))
                .with(Block::Table(
                    Table::new("Parameters", ["name", "#value", "#95 %"])
                        .row(["mass.inertia", "1.15 kg", "1.14 to 1.16"])
                        .row(["coil.stiffness", "43.6 N/m"]),
                ))
                .with(Block::Plot(plot))
                .with(Block::Code("sinew fit rig.toml --fit \"a.csv\"".into())),
        )
        .footer("sinew 0.1.0, 1.9 s")
}

#[test]
fn a_small_page_is_what_it_was() {
    let html = small().to_html();
    // The style sheet has a file of its own to be reviewed in.
    let (before, rest) = html.split_once("<style>").unwrap();
    let (_, after) = rest.split_once("</style>").unwrap();
    insta::assert_snapshot!("small_report", format!("{before}<style>...</style>{after}"));
}

#[test]
fn a_page_loads_nothing_and_runs_nothing() {
    let html = small().to_html();
    for forbidden in ["http:", "https:", "<script", "@import", "src=", "<small>"] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn tags_close_in_the_order_they_opened() {
    let html = small().to_html();
    let mut open: Vec<&str> = Vec::new();
    for tag in html
        .split('<')
        .skip(1)
        .map(|rest| rest.split('>').next().unwrap())
    {
        let name = tag
            .trim_start_matches('/')
            .split([' ', '\n'])
            .next()
            .unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !["!DOCTYPE", "meta"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn a_long_series_stays_a_small_file() {
    let x: Vec<f64> = (0..200_000).map(|k| 1e-3 * f64::from(k)).collect();
    let y: Vec<f64> = (0..200_000).map(|k| f64::from((k * 7919) % 1000)).collect();
    let svg = Plot::over_time("long")
        .with(Series::new("noise", Stroke::Solid, x, y))
        .to_svg();
    assert!(svg.len() < 80_000, "{} bytes", svg.len());
}

#[test]
fn nothing_to_draw_is_said() {
    for series in [
        Series::new("empty", Stroke::Solid, vec![], vec![]),
        Series::new(
            "missing",
            Stroke::Points,
            vec![0.0, 1.0],
            vec![f64::NAN, f64::INFINITY],
        ),
    ] {
        let svg = Plot::over_time("nothing").y("q", "m").with(series).to_svg();
        assert!(
            svg.contains("no samples") && !svg.contains("NaN") && !svg.contains("inf"),
            "{svg}"
        );
    }
}
