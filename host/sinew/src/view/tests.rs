use sinew_sim::{InputTrajectory, Plant, Rig};

use super::{Animation, page, simulation};
use sinew_ident::report::sheet;

fn load(name: &str) -> (Rig, Plant) {
    let path = format!("{}/../../rigs/{name}", env!("CARGO_MANIFEST_DIR"));
    let rig = Rig::load(path).unwrap_or_else(|error| panic!("{error}"));
    let plant = Plant::new(&rig).unwrap_or_else(|error| panic!("{error}"));
    (rig, plant)
}

/// The tendon platform pulled towards +x for a second.
fn pulled() -> (Plant, Vec<f64>, Vec<Vec<f64>>, Animation) {
    let (_, plant) = load("tendon.toml");
    let t: Vec<f64> = (0..1000).map(|k| 0.001 * f64::from(k)).collect();
    let inputs = vec![t.iter().map(|t| t.min(0.5)).collect(), vec![0.0; t.len()]];
    let columns: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, t.len(), &columns).expect("two columns");
    let (values, start) = (plant.values(), vec![0.0; plant.state_len()]);
    let mut animation = Animation::new(t.len());
    plant
        .simulate_with(&values, &start, &drive, &t, |row, stepper| {
            animation
                .take(row, t[row], &plant, &values, &stepper.state())
                .expect("the state is the plant's");
        })
        .expect("the run ends");
    (plant, t, inputs, animation)
}

#[test]
fn an_animation_holds_every_outline_in_every_picture() {
    let (.., animation) = pulled();
    let data = animation.data();
    let count = |key: &str| data[key].as_array().map_or(0, Vec::len);
    // Every third of 1000 rows; the chain, 11 fibres, 4 tendons.
    assert_eq!(
        (count("times"), count("pictures"), count("outlines")),
        (334, 334, 16)
    );
    let outlines = data["outlines"].as_array().expect("a list");
    let points: u64 = outlines.iter().filter_map(|o| o["points"].as_u64()).sum();
    for picture in data["pictures"].as_array().expect("a list") {
        assert_eq!(picture.as_array().map(|p| p.len() as u64), Some(3 * points));
    }
    // The end of the chain, first in the list, goes from straight up to +x.
    let end = |picture: usize| {
        let at = 3 * (outlines[0]["points"].as_u64().expect("a number") as usize - 1);
        data["pictures"][picture][at].as_i64().expect("a number")
    };
    assert_eq!(end(0), 0);
    assert!(end(333) > 100, "10 mm at least: {}", end(333));
}

#[test]
fn a_page_loads_nothing_and_ends_its_scripts() {
    let (plant, t, inputs, animation) = pulled();
    let run = InputTrajectory::new(&plant, t.len(), &[&inputs[0], &inputs[1]])
        .and_then(|drive| {
            plant.simulate(&plant.values(), &vec![0.0; plant.state_len()], &drive, &t)
        })
        .expect("the run ends");
    let plots = simulation(&plant, &t, &inputs, &run);
    let html = page("tendon platform", String::new(), Some(&animation), plots).to_html();
    for reach in ["http://", "https://", "src=", "@import", "url("] {
        let allowed = html.matches("http://www.w3.org/2000/svg").count();
        let found = html.matches(reach).count();
        match reach {
            "http://" => assert_eq!(found, allowed, "it loads something"),
            // A plot clips its lines by a shape of its own.
            "url(" => assert_eq!(found, html.matches("url(#").count()),
            _ => assert_eq!(found, 0, "{reach}"),
        }
    }
    // That of the shape, and that of the plots.
    assert_eq!(html.matches("<script>").count(), 2);
    assert_eq!(html.matches("</script>").count(), 2);
}

#[test]
fn a_sheet_has_every_column_once_and_at_most_five_lines_a_plot() {
    let (plant, t, inputs, _) = pulled();
    let drive =
        InputTrajectory::new(&plant, t.len(), &[&inputs[0], &inputs[1]]).expect("two columns");
    let run = plant
        .simulate(&plant.values(), &vec![0.0; plant.state_len()], &drive, &t)
        .expect("the run ends");
    let plots = simulation(&plant, &t, &inputs, &run);
    assert!(plots.iter().all(|plot| plot.series.len() <= 5));
    let svg = sheet(&plots);
    for column in ["x_m", "light11_1", "u_y_rad"] {
        assert_eq!(svg.matches(&format!("<title>{column}</title>")).count(), 1);
    }
    // One svg inside the other for each plot, all of them closed.
    assert_eq!(svg.matches("<svg ").count(), plots.len() + 1);
    assert_eq!(svg.matches("</svg>").count(), plots.len() + 1);
    assert_eq!(svg.matches("xmlns=").count(), 1);
}

/// A rig of masses has nothing to animate.
#[test]
fn a_rig_without_a_shape_has_no_animation() {
    let (_, plant) = load("two-mass-drive.toml");
    let mut animation = Animation::new(1);
    let state = vec![0.0; plant.state_len()];
    animation
        .take(0, 0.0, &plant, &plant.values(), &state)
        .expect("the state is the plant's");
    assert!(animation.is_empty());
}
