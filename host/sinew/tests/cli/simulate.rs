//! `sinew simulate`: a rig's sensors over time, a plant in another language in its place.

use crate::desk::{Desk, checkout, columns};
use sinew_sim::Rig;

/// Two sensors on one oscillator; the encoder counts double and from 0.1.
const OSCILLATOR: &str = r#"format = "sinew-rig/1"
name = "oscillator"
[[body]]
name = "mass"
motion = "slide"
inertia = 1.0
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = 25.0
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
gain = 2.0
offset = 0.1
[[sensor]]
name = "tacho"
reads = "mass.velocity"
signal = "v_m_s"
"#;

#[test]
fn simulate_writes_every_sensor_at_the_recordings_times() {
    let desk = Desk::new();
    desk.write("rig.toml", OSCILLATOR);
    // Not uniform; the first position is missing; a column that the rig does not name; no tacho.
    desk.write(
        "in.csv",
        "t,other_V,u_N,q_m\n1,7,0,\n1.1,7,0,0.5\n1.15,7,0,9\n1.4,7,0,9\n2.5,7,0,9\n",
    );
    desk.succeed("simulate rig.toml --input in.csv --out out.csv");
    let out = columns(&desk.read("out.csv"));
    let names: Vec<&str> = out.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["t", "q_m", "v_m_s"]);
    assert_eq!(out[0].1, [1.0, 1.1, 1.15, 1.4, 2.5]);
    // It starts at rest, where the first valid sample says: (0.5 - 0.1) / 2. Then q = 0.2 cos(5 t).
    for (k, t) in out[0].1.iter().enumerate() {
        let (q, v) = (0.2 * (5.0 * (t - 1.0)).cos(), -(5.0 * (t - 1.0)).sin());
        assert!(
            (out[1].1[k] - (2.0 * q + 0.1)).abs() < 1e-5,
            "q_m at {t}: {}",
            out[1].1[k]
        );
        assert!(
            (out[2].1[k] - v).abs() < 1e-4,
            "v_m_s at {t}: {}",
            out[2].1[k]
        );
    }
}

#[test]
fn simulate_agrees_with_somebody_elses_recording() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("tests/foreign/mass_spring_damper.exact.csv");
    let truth =
        std::fs::read_to_string(checkout().join("tests/foreign/mass_spring_damper.truth.json"));
    let truth: serde_json::Value =
        serde_json::from_str(&truth.expect("the file is committed")).expect("the text is JSON");
    let number = |key: &str| truth[key].as_f64().expect("the truth holds this number");
    let rig = Rig::load(desk.path("mass-spring-damper.toml")).expect("the shipped rig is sound");
    let rig = rig.with_values(&[
        ("mass.inertia", number("mass_kg")),
        ("coil.stiffness", number("stiffness_N_m")),
        ("dashpot.damping", number("damping_N_s_m")),
    ]);
    let friction = format!(
        "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = {:?}\n",
        number("coulomb_friction_N")
    );
    desk.write(
        "truth.toml",
        &(rig.expect("the names are right").to_toml().to_string() + &friction),
    );
    desk.succeed("simulate truth.toml --input mass_spring_damper.exact.csv --out out.csv --quiet");
    let (exact, out) = (
        columns(&desk.read("mass_spring_damper.exact.csv")),
        columns(&desk.read("out.csv")),
    );
    assert_eq!(out.len(), 2);
    assert_eq!(out[0], exact[0], "the recording's times");
    let theirs = &exact
        .iter()
        .find(|(name, _)| name == "q_m")
        .expect("the recording has the position")
        .1;
    let range = theirs.iter().copied().fold(0.0, |a: f64, b| a.max(b.abs()));
    let error = theirs
        .iter()
        .zip(&out[1].1)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(range > 0.1, "it hardly moves: this tests nothing");
    assert!(error < 1e-6 * range, "{error:e} of {range}");
}

/// A cart of 1 kg with a spring of 40 N/m and some loss, in another language; Perl is part of every
/// Debian.
const CART: &str = r#"
$| = 1;
my ($q, $v) = (0, 0);
print "sinew-plant/1\nu_N\nv_m_s,q_m\n0,0\n";
while (<STDIN>) {
    my ($seconds, $u) = split /,/;
    for (1 .. 20) {
        $v += $seconds / 20 * ($u - 40 * $q - 1.2 * $v);
        $q += $seconds / 20 * $v;
    }
    print "$v,$q\n";
}
"#;

#[test]
fn a_program_can_be_the_plant() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .write("cart.pl", CART);
    let mut inputs = String::from("t,u_N\n");
    for k in 0..240 {
        let u = if (k / 60) % 2 == 0 { 1.0 } else { -1.0 };
        inputs += &format!("{},{u}\n", f64::from(k) / 120.0);
    }
    desk.write("inputs.csv", &inputs);
    let simulate = |out: &str, more: &[&str]| -> Vec<f64> {
        let line = format!("simulate mass-spring-damper.toml --input inputs.csv --out {out}");
        let output = desk
            .command(&line)
            .args(more)
            .output()
            .expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        let mut read = columns(&desk.read(out));
        assert_eq!(read.last().expect("a column").0, "q_m");
        assert_eq!(read.len(), 2, "the program's other signal is not the rig's");
        read.pop().expect("a column").1
    };
    let own = simulate("own.csv", &[]);
    let other = simulate("other.csv", &["--plant-program", "perl cart.pl"]);
    let most = own.iter().fold(0.0_f64, |m, q| m.max(q.abs()));
    assert!(most > 0.02, "it hardly moves");
    let line = "simulate mass-spring-damper.toml --input inputs.csv --out again.csv";
    let mut again = desk.command(line);
    let again = again.args(["--plant-program", "perl cart.pl"]).output();
    let said = String::from_utf8_lossy(&again.expect("the program starts").stderr).into_owned();
    assert!(
        said.contains("`v_m_s` of the program is not written"),
        "{said}"
    );
    for (own, other) in own.iter().zip(&other) {
        assert!((own - other).abs() < 2e-3 * most, "{own} {other}");
    }
}
