//! Pages of the verbs as a reader sees them: two widths, light and dark.

use std::path::Path;

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::desk::{Desk, checkout};

/// Widths at which pages are looked at: of a desk, and of half a screen.
const WIDTHS: [u32; 2] = [1200, 500];
/// Height of a page that its picture shows.
const PICTURED: u32 = 3000;
/// Side of a cell of a coarse picture, pixels.
const CELL: u32 = 50;
/// Mean difference of the cells, of 16 grey levels, that other fonts may make.
const LIKE: f64 = 0.6;
/// Difference of a page's height, as a part, that other fonts may make.
const HEIGHT: f64 = 0.045;
/// Difference of what is drawn on the ground, as a part, that other fonts may make.
const INK: f64 = 0.12;

/// Looks at a page at both widths and in both schemes: nothing sticks out, overlaps, is empty, too
/// small or too faint.
fn look_at(browser: &mut Browser, page: &Path, name: &str, plots: usize) {
    look(browser, page, name, plots, |_, _, _| {});
}

/// As [`look_at`], and the coarse pictures are the committed ones.
fn look_at_and_compare(browser: &mut Browser, page: &Path, name: &str, plots: usize) {
    look(
        browser,
        page,
        name,
        plots,
        |browser, about, (width, height)| {
            let coarse = coarse_picture(browser, width, height.min(PICTURED));
            keep_or_compare(&coarse, height, about);
        },
    );
}

fn look(
    browser: &mut Browser,
    page: &Path,
    name: &str,
    plots: usize,
    also: impl Fn(&mut Browser, &str, (u32, u32)),
) {
    for width in WIDTHS {
        for dark in [false, true] {
            browser.open(page, width, dark);
            let facts = browser.evaluate(include_str!("layout.js"));
            let scheme = if dark { "dark" } else { "light" };
            let about = format!("{name}, {width} px, {scheme}");
            for fault in ["outside", "overlaps", "flat", "small", "faint"] {
                assert_eq!(facts[fault], json!([]), "{about}: {fault}");
            }
            assert_eq!(
                facts["scroll"], facts["width"],
                "{about}: it scrolls sideways"
            );
            assert!(
                facts["plots"].as_u64() >= Some(plots as u64),
                "{about}: {facts}"
            );
            let ground = facts["ground"].as_f64().expect("a luminance");
            assert_eq!(ground < 0.2, dark, "{about}: ground of luminance {ground}");
            let height = facts["height"].as_u64().expect("a height") as u32;
            also(
                browser,
                &format!("{name}-{width}-{scheme}"),
                (width, height),
            );
        }
    }
}

/// Grey levels 0 to 15 of cells, a row of hexadecimal digits for each row of cells.
fn coarse_picture(browser: &mut Browser, width: u32, height: u32) -> String {
    let picture = browser.picture(width, height);
    let program = format!(
        "(async () => {{\n\
         const image = new Image();\n\
         image.src = 'data:image/png;base64,{picture}';\n\
         await image.decode();\n\
         const [columns, rows] = [{}, {}];\n\
         const canvas = document.createElement('canvas');\n\
         [canvas.width, canvas.height] = [image.width, image.height];\n\
         const context = canvas.getContext('2d');\n\
         context.drawImage(image, 0, 0);\n\
         const {{ data }} = context.getImageData(0, 0, image.width, image.height);\n\
         let text = '';\n\
         for (let row = 0; row < rows; row += 1) {{\n\
           for (let column = 0; column < columns; column += 1) {{\n\
             let sum = 0;\n\
             for (let y = row * {CELL}; y < (row + 1) * {CELL}; y += 1) {{\n\
               for (let x = column * {CELL}; x < (column + 1) * {CELL}; x += 1) {{\n\
                 const at = 4 * (y * image.width + x);\n\
                 sum += 0.299 * data[at] + 0.587 * data[at + 1] + 0.114 * data[at + 2];\n\
               }}\n\
             }}\n\
             const level = sum / ({CELL} * {CELL}) / 255 * 15;\n\
             text += Math.round(level).toString(16);\n\
           }}\n\
           text += '\\n';\n\
         }}\n\
         return text;\n\
         }})()",
        width / CELL,
        height / CELL
    );
    let coarse = browser.evaluate(&program);
    coarse.as_str().expect("rows of digits").to_owned()
}

/// Compares with the committed picture; `SINEW_PICTURES=write` replaces it.
fn keep_or_compare(coarse: &str, height: u32, name: &str) {
    let file = checkout().join(format!("host/sinew/tests/cli/pictures/{name}.txt"));
    let now = format!("{height} px\n{coarse}");
    if std::env::var("SINEW_PICTURES").as_deref() == Ok("write") {
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("it can be made");
        std::fs::write(&file, now).expect("it can be written");
        return;
    }
    let kept = std::fs::read_to_string(&file)
        .unwrap_or_else(|error| panic!("{}: {error}; SINEW_PICTURES=write", file.display()));
    if let Some(difference) = difference(&kept, &now) {
        panic!("{name}: {difference}; if it is meant, SINEW_PICTURES=write\n{now}");
    }
}

/// Difference of two coarse pictures in words; `None` where other fonts explain it.
fn difference(kept: &str, now: &str) -> Option<String> {
    let height = |text: &str| {
        let first = text.lines().next()?.strip_suffix(" px")?;
        first.parse::<f64>().ok()
    };
    let cells = |text: &str| -> Vec<Vec<f64>> {
        let rows = text.lines().skip(1);
        let level = |c: char| c.to_digit(16).map_or(f64::NAN, f64::from);
        rows.map(|row| row.chars().map(level).collect()).collect()
    };
    let (Some(before), Some(after)) = (height(kept), height(now)) else {
        return Some("a height is missing".into());
    };
    if (after / before - 1.0).abs() > HEIGHT {
        return Some(format!("{after} px high, {before} px before"));
    }
    let (before, after) = (cells(kept), cells(now));
    let pairs = before.iter().flatten().zip(after.iter().flatten());
    let differences: Vec<f64> = pairs.map(|(a, b)| (a - b).abs()).collect();
    let mean = differences.iter().sum::<f64>() / differences.len().max(1) as f64;
    if mean.is_nan() || mean > LIKE {
        return Some(format!("cells differ by {mean:.2} grey levels of 16"));
    }
    // The first cell is a corner of the ground.
    let ink = |cells: &[Vec<f64>]| {
        let ground = cells.first().and_then(|row| row.first()).copied();
        let all = cells.iter().flatten();
        let sum: f64 = all
            .map(|cell| (cell - ground.unwrap_or(f64::NAN)).abs())
            .sum();
        sum / cells.len() as f64
    };
    let ratio = ink(&after) / ink(&before);
    let other = ratio.is_nan() || (ratio - 1.0).abs() > INK;
    other.then(|| format!("{ratio:.2} times as much is drawn"))
}

/// A desk with the mass of the examples.
fn desk() -> Desk {
    let desk = Desk::new();
    for file in ["toml", "fit.csv", "test.csv"] {
        desk.bring(&format!("rigs/mass-spring-damper.{file}"));
    }
    desk
}

const RIG: &str = "mass-spring-damper.toml";
const BOTH: &str = "--fit mass-spring-damper.fit.csv --test mass-spring-damper.test.csv";

/// Parts that every page has in its first screen and at its end.
fn assert_framed(html: &str, command: &str) {
    assert!(
        html.contains("<p class=\"next\"><strong>Next:</strong>"),
        "no next step"
    );
    let (_, footer) = html.split_once("<footer>").expect("a footer");
    assert!(footer.starts_with(command), "{footer}");
    for part in [env!("CARGO_PKG_VERSION"), " UTC"] {
        assert!(footer.contains(part), "{part} is not in {footer}");
    }
}

#[test]
fn the_page_of_a_fit_has_residuals_responses_and_coverage_and_can_be_read() {
    let desk = desk();
    desk.succeed(&format!(
        "fit {RIG} {BOTH} --quiet --out fitted.toml --report fit.html"
    ));
    let html = desk.read("fit.html");
    assert_framed(&html, "sinew fit mass-spring-damper.toml --fit");
    for expected in [
        "Parameters",
        "q_m of mass-spring-damper.test.csv (test)",
        "Residuals of q_m: autocorrelation",
        "Residuals of q_m against u_N",
        "Gain of q_m by u_N",
        "Coherence of q_m",
        "Coverage of the recordings",
        "%</td>",
        "sinew diagnose mass-spring-damper.toml",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let Some(mut browser) = Browser::start() else {
        return;
    };
    look_at_and_compare(&mut browser, &desk.path("fit.html"), "fit", 9);
}

#[test]
fn a_drag_zooms_all_plots_over_time_and_a_double_click_shows_all() {
    let desk = desk();
    desk.succeed(&format!(
        "simulate {RIG} --input mass-spring-damper.fit.csv --out s.csv --report s.html --quiet"
    ));
    let html = desk.read("s.html");
    assert_framed(&html, "sinew simulate mass-spring-damper.toml --input");
    assert!(html.contains("Measured over simulated") && html.contains("fit "));
    let Some(mut browser) = Browser::start() else {
        return;
    };
    let page = desk.path("s.html");
    look_at_and_compare(&mut browser, &page, "simulate", 5);
    browser.open(&page, 1200, false);
    let place = "(() => { const plot = document.querySelector('svg[data-frame]');\n\
         plot.scrollIntoView(); const box = plot.getBoundingClientRect();\n\
         return [box.left, box.top, box.width, box.height]; })()";
    let place = browser.evaluate(place);
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| place[i].as_f64().expect("pixels"));
    let middle = top + 0.5 * height;
    browser.pointer("mouseMoved", left + 0.4 * width, middle);
    let said =
        "document.querySelector('svg[data-frame]').parentNode.querySelector('output').textContent";
    let read = browser.evaluate(said);
    let read = read.as_str().expect("a readout");
    assert!(
        read.starts_with("at ") && read.contains("measured"),
        "{read}"
    );
    browser.pointer("mousePressed", left + 0.4 * width, middle);
    browser.pointer("mouseMoved", left + 0.6 * width, middle);
    browser.pointer("mouseReleased", left + 0.6 * width, middle);
    let moved = "[...document.querySelectorAll('svg[data-frame]')]\
         .filter((svg) => JSON.parse(svg.dataset.frame).xUnit === 's')\
         .filter((svg) => svg.querySelector('g.moves').getAttribute('transform')).length";
    assert!(
        browser.evaluate(moved).as_u64() >= Some(3),
        "the plots did not move together"
    );
    let factor = "document.querySelector('g.moves').transform.baseVal.consolidate().matrix.a";
    let zoomed = browser.evaluate(factor).as_f64().expect("a factor");
    assert!((4.0..6.0).contains(&zoomed), "{zoomed}");
    let twice = "document.querySelector('svg[data-frame]')\
         .dispatchEvent(new MouseEvent('dblclick', { bubbles: true }))";
    browser.evaluate(twice);
    let back = browser.evaluate(factor).as_f64().expect("a factor");
    assert!((back - 1.0).abs() < 1e-6, "{back}");
}

/// The page of `pil`, where a test has run it.
pub fn a_loop_can_be_read(desk: &Desk, page: &str) {
    let html = desk.read(page);
    let (_, footer) = html.split_once("<footer>").expect("a footer");
    assert!(
        footer.starts_with("sinew pil rig.toml model --fit"),
        "{footer}"
    );
    for expected in [
        "processor in the loop",
        "asked and done",
        "tracking error",
        ": command",
        "Counted by the device",
        "seed 1",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let Some(mut browser) = Browser::start() else {
        return;
    };
    look_at(&mut browser, &desk.path(page), "pil", 6);
}

/// The page of `tune`, where a test has run it.
pub fn a_tuning_can_be_read(desk: &Desk, page: &str) {
    let html = desk.read(page);
    assert_framed(&html, "sinew tune rig.toml model --fit");
    for expected in [
        "Objective on a loop that tuned nothing: MPC",
        "The search",
        "before → tuned",
        "MPC before",
        "MPC tuned",
        "Settings",
        "move suppression Lambda",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let Some(mut browser) = Browser::start() else {
        return;
    };
    look_at(&mut browser, &desk.path(page), "tune", 2);
}

#[test]
fn the_page_of_a_training_has_learning_curves_and_says_what_it_came_to() {
    let epoch = |k: u32| sinew_train::train::Epoch {
        training: 0.2 + 0.9 * 0.9_f64.powi(k as i32),
        validation: 0.25
            + 0.85 * 0.9_f64.powi(k as i32)
            + if k > 50 {
                0.002 * f64::from(k - 50)
            } else {
                0.0
            },
    };
    let record = sinew::pipeline::learn::Record {
        history: (0..80).map(epoch).collect(),
        kept: 50,
        parameters: 243,
        one_step_rms: vec![1.2e-4],
        horizon_rms: vec![9.1e-4],
        horizon: 12,
    };
    let made = sinew_ident::report::Provenance::new("sinew train rig.toml").seed(1);
    let page = sinew::report::training_page(
        ("mass", &record),
        &[("q_m", "m")],
        (None, "sinew tune rig.toml model"),
        &made,
    );
    let desk = Desk::new();
    page.write(desk.path("train.html"))
        .expect("it can be written");
    let html = desk.read("train.html");
    assert_framed(&html, "sinew train rig.toml · seed 1");
    for expected in [
        "Learning curves",
        "fell from 1.10 to 0.254 in 51 passes",
        "better than the best linear predictor",
        "0.910 mm after 12 steps",
        ">kept</span>",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let Some(mut browser) = Browser::start() else {
        return;
    };
    look_at(&mut browser, &desk.path("train.html"), "train", 1);
}

#[test]
fn the_page_of_a_diagnosis_draws_the_named_law_over_the_recovered_force() {
    let desk = desk();
    // Six seconds of the recording show its dry friction.
    for (role, from) in [("fit", "fit"), ("check", "test")] {
        let text = desk.read(&format!("mass-spring-damper.{from}.csv"));
        let rows: Vec<&str> = text.lines().take(722).collect();
        desk.write(&format!("{role}.csv"), &rows.join("\n"));
    }
    desk.succeed(&format!(
        "diagnose {RIG} --fit fit.csv --check check.csv --quiet --json d.json --report d.html"
    ));
    let html = desk.read("d.html");
    assert_framed(&html, "sinew diagnose mass-spring-damper.toml --fit");
    for expected in [
        ">recovered</span>",
        "coulomb friction as named",
        "as written</th>",
        "refitted</th>",
        "corrected</th>",
        "Residuals of q_m: autocorrelation",
        "Gain of q_m by u_N",
        "Coverage of the recordings",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let Some(mut browser) = Browser::start() else {
        return;
    };
    look_at_and_compare(&mut browser, &desk.path("d.html"), "diagnose", 10);
}

#[test]
fn a_page_that_cannot_be_read_is_found_out() {
    let desk = Desk::new();
    let page = |body: &str, style: &str| {
        format!(
            "<!DOCTYPE html><html><head><style>body {{ background: #fff; color: #111; }} {style}\
             </style></head><body>{body}</body></html>"
        )
    };
    let plot = "<svg data-frame=\"{}\" aria-label=\"p\" viewBox=\"0 0 960 260\" width=\"900\">\
         <path class=\"series\" style=\"stroke: #111\" d=\"M0 0L900 200\"/></svg>";
    let empty = plot.replace("M0 0L900 200", "M0 0");
    let Some(mut browser) = Browser::start() else {
        return;
    };
    for (fault, body, style) in [
        (
            "outside",
            "<p style=\"white-space: nowrap\">".to_owned() + &"long ".repeat(400),
            "",
        ),
        (
            "overlaps",
            "<p>one</p><p class=\"up\">two</p>".into(),
            ".up { margin-top: -2em; }",
        ),
        ("flat", empty, ""),
        ("small", "<p>tiny</p>".into(), "p { font-size: 6px; }"),
        ("faint", "<p>grey</p>".into(), "p { color: #ccc; }"),
    ] {
        desk.write("bad.html", &page(&body, style));
        browser.open(&desk.path("bad.html"), 1200, false);
        let facts: Value = browser.evaluate(include_str!("layout.js"));
        assert_ne!(facts[fault], json!([]), "{fault} was not found: {facts}");
    }
    desk.write(
        "good.html",
        &page(&format!("<p>one</p><p>two</p>{plot}"), ""),
    );
    browser.open(&desk.path("good.html"), 1200, false);
    let facts = browser.evaluate(include_str!("layout.js"));
    for fault in ["outside", "overlaps", "flat", "small", "faint"] {
        assert_eq!(facts[fault], json!([]), "{fault}");
    }
}

#[test]
fn other_fonts_are_no_other_picture_and_a_missing_plot_is() {
    let row = |of: &str| format!("{of}\n").repeat(10);
    let kept = format!("1000 px\n{}", row("fffeeeeeeeff"));
    let fonts = format!("1020 px\n{}", row("ffeeeeeeefff"));
    assert_eq!(difference(&kept, &fonts), None);
    let faults = [
        ("1000 px", "fffeeffffeff", "times as much is drawn"),
        ("1000 px", "fffeeeddeeff", "times as much is drawn"),
        ("1000 px", "ffff8888ffff", "grey levels"),
        ("900 px", "fffeeeeeeeff", "px high"),
    ];
    for (height, cells, expected) in faults {
        let found = difference(&kept, &format!("{height}\n{}", row(cells)));
        assert!(
            found.as_ref().is_some_and(|it| it.contains(expected)),
            "{cells}: {found:?}"
        );
    }
    assert!(difference("", &kept).is_some() && difference(&kept, "").is_some());
}
