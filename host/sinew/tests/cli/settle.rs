//! Rests of a rig: numbers that a hand calculation has, files, and refusals.

use serde_json::Value;

use crate::desk::{Desk, columns};
use crate::schema::{schema, violations};

fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/demo.toml");
    desk.bring("rigs/emps.toml");
    desk.bring("rigs/hasel.toml");
    desk.bring("rigs/experiments/flexure-stage.real.toml");
    desk
}

fn document(desk: &Desk, line: &str) -> Value {
    desk.succeed(&format!("settle {line} --json rests.json --quiet"));
    let document = serde_json::from_str(&desk.read("rests.json")).expect("JSON");
    assert_eq!(violations(&schema("settle"), &document), [""; 0]);
    document
}

#[test]
fn a_force_on_a_spring_gives_position_and_derivatives() {
    let desk = desk();
    let found = document(&desk, "demo.toml --input u_N=2");
    let rest = &found["rests"][0];
    let close = |value: &Value, exact: f64| {
        let value = value.as_f64().expect("a number");
        assert!((value - exact).abs() < 1e-12, "{value} {exact}");
    };
    close(&rest["signals"]["q_m"]["value"], 0.05);
    close(&rest["by_input"]["u_N"]["q_m"], 0.025);
    close(&rest["by_parameter"]["coil.stiffness"]["q_m"], -0.05 / 40.0);
    close(&rest["by_parameter"]["mass.inertia"]["q_m"], 0.0);
    assert_eq!(rest["contraction"]["certified_steps"], 1);
    assert_eq!(rest["signals"]["q_m"]["interval"], Value::Null);
    let said = desk.succeed("settle demo.toml --input u_N=2");
    assert!(said.contains("at rest under u_N = 2"), "{said}");
    assert!(
        said.contains("50.0 mm") && said.contains("the only rest"),
        "{said}"
    );
}

#[test]
fn a_column_in_another_unit_is_converted_both_ways() {
    let desk = desk();
    let found = document(&desk, "hasel.toml --input u1_kV=4");
    let rest = |k: usize| &found["rests"][k];
    assert_eq!(rest(0)["inputs"]["u1_kV"], 4.0);
    let by = rest(0)["by_input"]["u1_kV"]["z_m"]
        .as_f64()
        .expect("a slope");
    let reading = |value: f64| {
        let found = document(&desk, &format!("hasel.toml --input u1_kV={value}"));
        found["rests"][0]["signals"]["z_m"]["value"]
            .as_f64()
            .expect("a reading")
    };
    let slope = (reading(4.001) - reading(3.999)) / 0.002;
    assert!((by - slope).abs() < 1e-5 * slope.abs(), "{by} {slope}");
}

/// Dry friction of 0.3 N: each row lies between the ends of its interval.
#[test]
fn a_sweep_is_a_table_and_a_page() {
    let desk = desk();
    desk.succeed(
        "settle flexure-stage.real.toml --sweep u_A=-2:2:9 --out rests.csv --report rests.html \
         --quiet",
    );
    let table = columns(&desk.read("rests.csv"));
    let names: Vec<&str> = table.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["u_A", "q_m", "q_m_lowest", "q_m_highest"]);
    let column = |k: usize| &table[k].1;
    assert_eq!(
        column(0),
        &[-2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0]
    );
    for row in 0..9 {
        let [u, q, low, high] = [0, 1, 2, 3].map(|k| column(k)[row]);
        assert!((10.0 * u - 1380.0 * q - 1e7 * q * q * q).abs() < 1e-10);
        let force = |q: f64| 10.0 * u - 1380.0 * q - 1e7 * q * q * q;
        assert!((force(low) - 0.3).abs() < 1e-10 && (force(high) + 0.3).abs() < 1e-10);
    }
    let page = desk.read("rests.html");
    assert!(page.contains("<svg") && page.contains("u_A") && page.contains("highest"));
}

/// Of 1e300 the table, the CSV file and a refusal print an exponent, not 300 digits.
#[test]
fn a_number_without_end_is_printed_with_its_exponent() {
    let desk = desk();
    let said = desk.succeed("settle demo.toml --input u_N=1e300");
    assert!(said.contains("at rest under u_N = 1e300\n"), "{said}");
    let refused = desk.refusal("settle hasel.toml --input u1_kV=1e300");
    assert!(
        refused.contains("at: u1_kV = 1e300, u2_kV = 0"),
        "{refused}"
    );
    desk.succeed("settle demo.toml --sweep u_N=0:1e300:3 --out rests.csv --quiet");
    let text = desk.read("rests.csv");
    assert!(text.contains("\n5e299,"), "{text}");
    let table = columns(&text);
    assert_eq!(table[0].1, [0.0, 5e299, 1e300]);
    assert!(text.lines().all(|line| line.len() < 60), "{text}");
}

/// The difference of the ends is more than a number holds; the values between are not.
#[test]
fn a_sweep_over_every_number_has_its_middle() {
    let desk = desk();
    desk.succeed("settle demo.toml --sweep u_N=-1e308:1e308:3 --out rests.csv --quiet");
    let table = columns(&desk.read("rests.csv"));
    assert_eq!(table[0].1, [-1e308, 0.0, 1e308]);
}

#[test]
fn refusals() {
    let desk = desk();
    let lines = [
        "demo.toml --input u_n=1",
        "demo.toml --input force=1",
        "demo.toml --input u_N",
        "demo.toml --input u_N=1 --input u_N=2",
        "demo.toml --input u_N=1 --sweep u_N=0:1:3",
        "demo.toml --sweep u_N=0:1",
        "demo.toml --sweep u_N=0:1:1",
        "demo.toml --sweep u_N=1:1:3",
        "demo.toml --json demo.toml",
        "emps.toml --input u_V=1",
        "absent.toml",
    ];
    let report: String = lines
        .map(|line| desk.refusal(&format!("settle {line}")))
        .concat();
    insta::assert_snapshot!(report);
}
