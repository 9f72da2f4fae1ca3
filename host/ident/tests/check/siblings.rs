//! Faults that a lab meets beside those of the cases: other sentinels, units, sensors and rows.

use sinew_ident::check::{Check, check};
use sinew_ident::recording::Recording;
use sinew_sim::Rig;

use crate::shifted::{moved, sound};

/// The recording with another column `q_m`: row and value make the new one.
fn read_as(recording: &Recording, reading: impl Fn(usize, f64) -> f64) -> Recording {
    let q = recording.column("q_m").unwrap();
    let u = recording.column("u_N").unwrap();
    let rows = recording.t().iter().zip(u).zip(q).enumerate();
    let rows = rows.map(|(row, ((t, u), q))| format!("{t},{u},{}\n", reading(row, *q)));
    let text = "t,u_N,q_m\n".to_owned() + &rows.collect::<String>();
    Recording::parse(text.as_bytes(), "a.csv").unwrap()
}

/// The kinds that are named, each with its certainty and remedy.
fn named(rig: &Rig, recording: &Recording) -> Vec<(&'static str, bool, String)> {
    let found: Vec<Check> = check(std::slice::from_ref(recording), Some(rig));
    let said = found.into_iter().map(|it| (it.kind, it.certain, it.remedy));
    said.collect()
}

fn only(rig: &Rig, recording: &Recording) -> (&'static str, bool, String) {
    let found = named(rig, recording);
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].clone()
}

#[test]
fn sentinels_at_both_ends_and_in_a_third_of_the_rows_are_named() {
    let (rig, sound) = sound();
    let both = read_as(&sound, |row, q| match row % 100 {
        30 => -9999.0,
        60 => 9999.0,
        _ => q,
    });
    let found = only(&rig, &both);
    assert_eq!((found.0, found.1), ("sentinel", true));
    let third = sound.len() / 3;
    let many = read_as(&sound, |row, q| if row < third { -9999.0 } else { q });
    assert_eq!(
        only(&rig, &many),
        ("sentinel", true, "--missing -9999".into())
    );
}

#[test]
fn single_zeros_for_no_value_are_named_wherever_they_fall() {
    let (rig, sound) = sound();
    let zeroed = read_as(&sound, |row, q| if row % 7 == 3 { 0.0 } else { q });
    assert_eq!(
        only(&rig, &zeroed),
        ("sentinel", true, "--missing q_m=0".into())
    );
}

/// One wild sample made all the others look like noise.
#[test]
fn a_spike_does_not_hide_the_motion() {
    let (rig, sound) = sound();
    let spiked = read_as(&sound, |row, q| if row == 50 { -99.99 } else { q });
    assert_eq!(only(&rig, &spiked).0, "spike");
}

/// A motion is slow as it turns round, and a sensor that froze there looked like one at rest.
#[test]
fn a_sensor_that_freezes_in_a_slow_moment_is_named_by_its_noise() {
    let (rig, sound) = sound();
    let q = sound.column("q_m").unwrap().to_vec();
    // The slowest of a second of rows.
    let speed = |row: &usize| (q[row + 10] - q[row - 10]).abs();
    let slow = (400..500)
        .min_by(|a, b| speed(a).total_cmp(&speed(b)))
        .unwrap();
    for end in [slow + 300, q.len()] {
        let frozen = read_as(&sound, |row, value| {
            if (slow..end).contains(&row) {
                q[slow]
            } else {
                value
            }
        });
        assert_eq!(only(&rig, &frozen).0, "stuck_channel", "{slow} to {end}");
    }
}

#[test]
fn millimetres_under_the_name_of_metres_are_named() {
    let (rig, sound) = sound();
    let millimetres = read_as(&sound, |_, q| 1e3 * q);
    let found = only(&rig, &millimetres);
    assert_eq!(found.0, "millimetres_for_metres");
    assert!(
        found.1 && found.2.starts_with("`unit = \"mm\"`"),
        "{found:?}"
    );
    // A force in kilonewtons shows the same: following the first remedy would spoil the positions.
    assert!(
        found.2.contains("if u_N is a thousandth of what it says"),
        "{found:?}"
    );
}

#[test]
fn an_offset_and_a_drift_of_a_sensor_are_named_and_are_not_certain() {
    let (rig, sound) = sound();
    let off = read_as(&sound, |_, q| q + 0.02);
    let found = only(&rig, &off);
    assert_eq!((found.0, found.1), ("sensor_offset", false));
    let end = sound.len() as f64;
    let drifting = read_as(&sound, |row, q| q + 0.04 * row as f64 / end);
    let found = only(&rig, &drifting);
    assert_eq!((found.0, found.1), ("sensor_drift", false));
}

#[test]
fn a_sensor_that_freezes_for_good_is_named() {
    let (rig, sound) = sound();
    let q = sound.column("q_m").unwrap();
    let stuck = |recording: &Recording| {
        let found = named(&rig, recording);
        assert!(found.iter().any(|it| it.0 == "stuck_channel"), "{found:?}");
    };
    for (from, held) in q.iter().enumerate().skip(q.len() / 2).take(5) {
        stuck(&read_as(
            &sound,
            |row, y| if row >= from { *held } else { y },
        ));
    }
}

#[test]
fn rows_that_are_lost_one_by_one_are_a_gap() {
    let (rig, sound) = sound();
    let text = sound.to_csv();
    let kept = text.lines().enumerate().filter(|(row, _)| row % 19 != 18);
    let kept: Vec<&str> = kept.map(|(_, line)| line).collect();
    let lost = Recording::parse(kept.join("\n").as_bytes(), "a.csv").unwrap();
    let found = named(&rig, &lost);
    assert!(found.iter().any(|it| it.0 == "gap"), "{found:?}");
}

#[test]
fn a_sensor_that_is_two_rows_late_is_said_to_be() {
    let (rig, sound) = sound();
    let early = moved(&sound, 2);
    let found = only(&rig, &early.rows(0..early.len() - 2).unwrap());
    assert_eq!((found.0, found.1), ("input_leads", false));
    assert!(found.2.starts_with("--late u_N=-2"), "{found:?}");
}

pub const TWO: &str = r#"
format = "sinew-rig/1"
name = "two"
[[body]]
name = "motor"
motion = "hinge"
inertia = { value = 0.025 }
[[body]]
name = "load"
motion = "hinge"
inertia = { value = 0.11 }
[[spring]]
name = "shaft"
from = "motor"
to = "load"
stiffness = { value = 4.0 }
[[damper]]
name = "bearing"
from = "ground"
to = "load"
damping = { value = 0.1 }
[[spring]]
name = "return"
from = "ground"
to = "load"
stiffness = { value = 1.2 }
[[actuator]]
name = "drive"
drives = "motor"
input = "u_Nm"
gain = 1.0
[[sensor]]
name = "motor_encoder"
reads = "motor.position"
signal = "motor_rad"
[[sensor]]
name = "load_encoder"
reads = "load.position"
signal = "load_rad"
"#;

/// A motor of 0.02 kg m^2 and a load of 0.1 kg m^2 on a shaft of 5 N m/rad, the load held by 1 N
/// m/rad and 0.12 N m s/rad: four seconds, the load's angle times `gain`.
fn two(gain: f64) -> Recording {
    with_load(0.1, gain)
}

/// The same with a load of so many kg m^2.
pub fn with_load(inertia: f64, gain: f64) -> Recording {
    let drive = |at: f64| 0.5 * (2.0 * at).sin() + 0.4 * (7.0 * at).cos() + 0.3 * (13.0 * at).sin();
    driven([inertia, gain, 0.0], drive)
}

/// The same with dry friction of the motor, under a torque over time.
pub fn driven([inertia, gain, friction]: [f64; 3], torque: impl Fn(f64) -> f64) -> Recording {
    let (mut a, mut b, mut va, mut vb) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut text = "t,u_Nm,motor_rad,load_rad\n".to_owned();
    for k in 0..400 {
        let at = 0.01 * f64::from(k);
        let u = torque(at);
        // Noise of a milliradian at most, from the digits of a large multiple.
        let noise = |which: f64| 1e-3 * ((f64::from(k) * 12.9898 + which).sin() * 43_758.5).fract();
        let (seen, load) = (a + noise(1.0), gain * b + noise(2.0));
        text += &format!("{at},{u},{seen},{load}\n");
        for _ in 0..50 {
            let shaft = 5.0 * (a - b);
            va += 2e-4 * (u - shaft) / 0.02;
            va -= va.clamp(-friction * 2e-4 / 0.02, friction * 2e-4 / 0.02);
            vb += 2e-4 * (shaft - 0.12 * vb - b) / inertia;
            a += 2e-4 * va;
            b += 2e-4 * vb;
        }
    }
    Recording::parse(text.as_bytes(), "two.csv").unwrap()
}

#[test]
fn one_sensor_in_degrees_or_of_another_gain_is_named() {
    let rig = Rig::parse(TWO, "two.toml").unwrap();
    assert_eq!(named(&rig, &two(1.0)), []);
    let found = only(&rig, &two(180.0 / std::f64::consts::PI));
    assert_eq!((found.0, found.1), ("degrees_for_radians", true));
    assert!(
        found.2.contains("load_rad") && !found.2.contains("motor_rad"),
        "{found:?}"
    );
    let found = only(&rig, &two(0.9));
    assert_eq!((found.0, found.1), ("sensor_gain", false));
}
