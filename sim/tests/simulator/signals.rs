//! Parameters that depend on a column of the recording, against closed forms.

use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar};

const HEAD: &str = "format = \"sinew-rig/1\"\nname = \"damper\"\n";

const MASS: &str = "[[body]]\nname = \"m\"\nmotion = \"slide\"\ninertia = 2.0\nstart = 0.0\n\
                    start_velocity = 1.0\n[[sensor]]\nname = \"v\"\nreads = \"m.velocity\"\n\
                    signal = \"v_m_s\"\n";

const OIL: &str = "[[damper]]\nname = \"oil\"\nfrom = \"ground\"\nto = \"m\"\n\
                   damping = { value = 1.0, with = \"T_K\", slope = 0.5 }\n";

fn rig(tables: &str) -> Rig {
    Rig::parse(&format!("{HEAD}{tables}"), "damper.toml").unwrap()
}

fn times(rows: usize, dt: f64) -> Vec<f64> {
    (0..rows).map(|row| dt * row as f64).collect()
}

/// Velocity at every row.
fn velocity(plant: &Plant, t: &[f64], column: &[f64]) -> Vec<f64> {
    let drive = InputTrajectory::new(plant, t.len(), &[column]).unwrap();
    let run = plant.simulate(&plant.values(), &[0.0, 1.0], &drive, t);
    run.unwrap().column(0)
}

/// The column holds between its rows: v decays by exp(-d dt / m) from each to the next.
#[test]
fn a_damping_follows_its_column_row_by_row() {
    let plant = Plant::new(&rig(&format!("{MASS}{OIL}"))).unwrap();
    let t = times(200, 0.01);
    let column: Vec<f64> = t.iter().map(|t| 3.0 + 2.0 * (5.0 * t).sin()).collect();
    let found = velocity(&plant, &t, &column);
    let mut exact = 1.0;
    for row in 0..t.len() {
        assert!((found[row] - exact).abs() < 1e-9, "row {row}");
        exact *= (-(1.0 + 0.5 * column[row]) * 0.01 / 2.0).exp();
    }
}

/// A step of the column is followed by 1 - exp(-t / lag).
#[test]
fn a_signal_with_a_lag_is_followed_late() {
    let signal = "[[signal]]\nname = \"heat\"\ncolumn = \"T_K\"\nlag = 0.2\n";
    let tables = format!("{MASS}{}{signal}", OIL.replace("T_K", "heat"));
    let plant = Plant::new(&rig(&tables)).unwrap();
    let t = times(300, 0.005);
    let column: Vec<f64> = (0..t.len())
        .map(|row| if row < 100 { 0.0 } else { 4.0 })
        .collect();
    let found = velocity(&plant, &t, &column);
    let mut exact: f64 = 1.0;
    for row in 0..t.len() {
        assert!((found[row] - exact).abs() < 1e-9, "row {row}");
        let late = (t[row] - t[100]).max(0.0);
        let heat = 4.0 * (1.0 - (-late / 0.2).exp());
        exact *= (-(1.0 + 0.5 * heat) * 0.005 / 2.0).exp();
    }
}

/// A part of a recording begins where the rows before it have left the signal.
#[test]
fn a_lagging_signal_remembers_the_rows_before() {
    let signal = "[[signal]]\nname = \"heat\"\ncolumn = \"T_K\"\nlag = 0.05\n";
    let tables = format!("{MASS}{}{signal}", OIL.replace("T_K", "heat"));
    let plant = Plant::new(&rig(&tables)).unwrap();
    let t = times(60, 0.005);
    let column: Vec<f64> = (0..t.len())
        .map(|row| if row < 28 { 0.0 } else { 4.0 })
        .collect();
    let whole = velocity(&plant, &t, &column);
    let drive = InputTrajectory::new(&plant, 30, &[&column[30..]]).unwrap();
    let drive = drive
        .after(&plant, &t[..30], t[30], &[&column[..30]])
        .unwrap();
    let part = plant
        .simulate(&plant.values(), &[0.0, whole[30]], &drive, &t[30..])
        .unwrap();
    for row in 0..30 {
        assert!(
            (part.signal(row, 0) - whole[30 + row]).abs() < 1e-12,
            "row {row}"
        );
    }
}

/// Derivatives by value, slope and lag are those of differences.
#[test]
fn derivatives_by_slope_and_lag_are_true() {
    let signal = "[[signal]]\nname = \"heat\"\ncolumn = \"T_K\"\nlag = { value = 0.1 }\n";
    let oil = OIL.replace("\"T_K\", slope = 0.5", "\"heat\"");
    let plant = Plant::new(&rig(&format!("{MASS}{oil}{signal}"))).unwrap();
    let mut values = plant.values();
    let names = ["oil.damping", "oil.damping.slope", "heat.lag"];
    let slots = names.map(|name| plant.slot(name).unwrap());
    assert!(slots.iter().all(|slot| plant.free_slots().contains(slot)));
    values[slots[1]] = 0.5;
    let t = times(100, 0.01);
    let column: Vec<f64> = t.iter().map(|t| 2.0 + (9.0 * t).sin()).collect();
    let drive = InputTrajectory::new(&plant, t.len(), &[&column]).unwrap();
    let end = |values: &[f64]| {
        let run = plant.simulate(values, &[0.0, 1.0], &drive, &t).unwrap();
        run.signal(t.len() - 1, 0)
    };
    let seeded: Vec<Dual<3>> = (values.iter().enumerate())
        .map(|(slot, &value)| {
            let mut seeded = Dual::constant(value);
            if let Some(seed) = slots.iter().position(|&own| own == slot) {
                seeded.derivative[seed] = 1.0;
            }
            seeded
        })
        .collect();
    let start = [0.0, 1.0].map(Dual::<3>::constant);
    let exact = plant.simulate(&seeded, &start, &drive, &t).unwrap();
    let exact = exact.signal(t.len() - 1, 0);
    for (seed, &slot) in slots.iter().enumerate() {
        let mut moved = [values.clone(), values.clone()];
        moved[0][slot] += 1e-6;
        moved[1][slot] -= 1e-6;
        let difference = (end(&moved[0]) - end(&moved[1])) / 2e-6;
        let found = exact.derivative[seed];
        assert!(
            (found - difference).abs() < 1e-7 * (1.0 + difference.abs()),
            "{seed}"
        );
    }
}

/// A rig that is written back keeps slope, lag and comments.
#[test]
fn slopes_are_written_where_they_stand() {
    let given = rig(&format!(
        "{MASS}{}",
        OIL.replace("slope = 0.5", "slope = { value = 0.5 }")
    ));
    let written = given
        .with_values(&[("oil.damping.slope", 0.75), ("oil.damping", 2.0)])
        .unwrap();
    let line = "damping = { value = 2.0, with = \"T_K\", slope = { value = 0.75 } }";
    assert!(written.to_toml().contains(line), "{}", written.to_toml());
    let given = rig(&format!("{MASS}{}", OIL.replace(", slope = 0.5", "")));
    let written = given.with_values(&[("oil.damping.slope", 0.75)]).unwrap();
    assert!(
        written.to_toml().contains("slope = { value = 0.75 }"),
        "{}",
        written.to_toml()
    );
}

#[test]
fn what_cannot_depend_on_a_column_is_refused_with_its_line() {
    let refused = |tables: &str| {
        let error = Rig::parse(&format!("{HEAD}{tables}"), "damper.toml").unwrap_err();
        error.to_string()
    };
    let inertia = refused(&MASS.replace("2.0", "{ value = 2.0, with = \"T_K\" }"));
    assert!(inertia.starts_with("damper.toml:6:"), "{inertia}");
    assert!(
        inertia.contains("`inertia` of body `m` cannot depend on a column"),
        "{inertia}"
    );
    let alone = refused(&format!("{MASS}{}", OIL.replace("with = \"T_K\", ", "")));
    assert!(
        alone.contains("`slope` of `damping` of damper `oil` without `with`"),
        "{alone}"
    );
    let twice = "[[signal]]\nname = \"a\"\ncolumn = \"T_K\"\n";
    let twice = refused(&format!("{MASS}{twice}{twice}"));
    assert!(twice.contains("a signal `a` is there twice"), "{twice}");
}
