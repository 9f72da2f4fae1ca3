//! Fits to tables of rests: Hooke's law, the files that they leave, and refusals.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

/// Loads on a spring of 50 N/m, read to a tenth of a millimetre.
const LOADS: &str = "u_N,q_m\n-2,-0.0401\n-1,-0.0199\n0,0.0001\n1,0.0199\n2,0.04\n3,0.0601\n";

fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/demo.toml");
    desk.write("loads.csv", LOADS);
    desk.write("others.csv", "q_m,u_N\n0.08,4\n-0.06,-3\n");
    desk
}

#[test]
fn a_table_of_loads_gives_the_stiffness_and_leaves_the_mass() {
    let desk = desk();
    let said = desk.succeed(
        "fit demo.toml --static --fit loads.csv --test others.csv --json fit.json \
         --out fitted.toml",
    );
    assert!(said.contains("not determined by these rests"), "{said}");
    assert!(said.contains("test  q_m: error at rest"), "{said}");
    let document: Value = serde_json::from_str(&desk.read("fit.json")).expect("JSON");
    assert_eq!(violations(&schema("fit"), &document), [""; 0]);
    let parameters = &document["parameters"];
    let stiffness = parameters["coil.stiffness"]["value"].as_f64();
    // Least squares by hand: sum of squares of the loads over the sum of their products.
    let exact = 19.0 / (0.0802 + 0.0199 + 0.0199 + 0.08 + 0.1803);
    let stiffness = stiffness.expect("a number");
    assert!(
        (stiffness / exact - 1.0).abs() < 1e-4,
        "{stiffness} {exact}"
    );
    assert_eq!(parameters["mass.inertia"]["value"], 1.0);
    assert_eq!(parameters["mass.inertia"]["ci95"], Value::Null);
    let test = document["signals"]["q_m"]["test"]["fitted_rms"].as_f64();
    assert!(test.is_some_and(|rms| rms < 2e-4), "{test:?}");
    let fitted = desk.read("fitted.toml");
    assert!(
        fitted.contains("inertia = { value = 1.0, min = 0.1"),
        "{fitted}"
    );
    let exit = desk.sinew("fit demo.toml --static --fit loads.csv --exit-code --quiet");
    assert_eq!(exit.status.code(), Some(3));
}

#[test]
fn refusals_of_tables() {
    let desk = desk();
    desk.bring("rigs/emps.toml");
    desk.bring("rigs/experiments/flexure-stage.real.toml");
    desk.write("gap.csv", "u_N,q_m\n0,0\n,0.1\n");
    desk.write("stage.csv", "u_A,q_m\n0,0\n1,0.006\n");
    desk.write("drive.csv", "u_V,q_m\n0,0\n1,0.006\n");
    let lines = [
        "demo.toml --static --fit gap.csv",
        "demo.toml --static --fit loads.csv --late u_N=1",
        "demo.toml --fit loads.csv",
        "flexure-stage.real.toml --static --fit stage.csv",
        "emps.toml --static --fit drive.csv",
    ];
    let report: String = lines
        .map(|line| desk.refusal(&format!("fit {line}")))
        .concat();
    insta::assert_snapshot!(report);
}
