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
    let page = Report::new("A <small> report")
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
        .next("sinew diagnose rig.toml --fit a.csv");
    Report {
        footer: "sinew 0.1.0, 1.9 s".into(),
        ..page
    }
}

#[test]
fn a_small_page_is_what_it_was() {
    let html = small().to_html();
    // The style sheet has a file of its own to be reviewed in.
    let (before, rest) = html.split_once("<style>").unwrap();
    let (_, after) = rest.split_once("</style>").unwrap();
    let (between, rest) = after.split_once("<script>").unwrap();
    let (_, after) = rest.split_once("</script>").unwrap();
    insta::assert_snapshot!(
        "small_report",
        format!("{before}<style>...</style>{between}<script>...</script>{after}")
    );
}

#[test]
fn a_page_loads_nothing_and_runs_only_its_own_script() {
    let html = small().to_html();
    for forbidden in [
        "http:",
        "https:",
        "@import",
        "src=",
        "<small>",
        "fetch(",
        "XMLHttp",
        "import(",
        "eval(",
        "innerHTML",
    ] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    assert_eq!(html.matches("<script").count(), 1);
    let unplotted = Report::new("words").section(Section::new("Text").text("No plot."));
    assert!(!unplotted.to_html().contains("<script"));
}

/// The script in a JavaScript engine: it reads back what the page draws.
#[test]
fn the_script_of_a_page_reads_the_values_that_were_drawn() {
    let x: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
    let y: Vec<f64> = x.iter().map(|x| 0.02 * (2.0 * x).sin()).collect();
    let plot = Plot::over_time("Sine")
        .y("q", "m")
        .with(Series::new("sine", Stroke::Solid, x, y));
    let svg = plot.to_svg();
    let part = |from: &str| {
        let (_, rest) = svg.split_once(from).unwrap();
        rest.split_once('"').unwrap().0.replace("&quot;", "\"")
    };
    let frame = part("data-frame=\"");
    let path = {
        let (_, rest) = svg.split_once("class=\"series").unwrap();
        let (_, rest) = rest.split_once(" d=\"").unwrap();
        rest.split_once('"').unwrap().0.to_owned()
    };
    let program = format!(
        "{}\nconst p = globalThis.sinewPlot, f = {frame}, all = p.points({path:?});\n\
         const read = (t) => p.valueOf(f.y, p.nearest(all, p.pixelOf(f.x, t))[1]);\n\
         const dot = p.points('M1 2h0M3 4h0'), step = p.points('M1 2H3V4');\n\
         console.log(JSON.stringify([all.length, read(0.8), read(2.4), f.yUnit, dot, step,\n\
           p.ticks(0, 4.9, 10), p.ticks(-0.02, 0.01, 5), p.readable(f.y, -1.23456)]));",
        include_str!("interact.js")
    );
    let node = std::process::Command::new("node")
        .args(["-e", &program])
        .output();
    let Ok(said) = node else {
        eprintln!("SKIPPED: node is not there, so the script of a page was not run");
        return;
    };
    assert!(said.status.success(), "{said:?}");
    let said: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
    assert_eq!(said[0], 50);
    for (index, t) in [(1, 0.8_f64), (2, 2.4)] {
        let (read, truth) = (said[index].as_f64().unwrap(), 20.0 * (2.0 * t).sin());
        assert!((read - truth).abs() < 0.05, "{read} mm, {truth} mm");
    }
    assert_eq!(said[3], "mm");
    assert_eq!(said[4], serde_json::json!([[1, 2], [3, 4]]));
    assert_eq!(said[5], serde_json::json!([[1, 2], [3, 2], [3, 4]]));
    assert_eq!(said[6].as_array().unwrap().len(), 10);
    assert_eq!(
        said[7],
        serde_json::json!(["−0.02", "−0.01", "0.00", "0.01"])
    );
    assert_eq!(said[8], "−1.23");
}

#[test]
fn tags_close_in_the_order_they_opened() {
    let html = small().to_html().replace(include_str!("interact.js"), "");
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
