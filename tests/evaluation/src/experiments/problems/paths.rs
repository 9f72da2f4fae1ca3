//! References of outputs, as recordings of nothing else.

use std::f64::consts::TAU;
use std::fmt::Write;

use super::FLOOR_HZ;

/// Steps a second of the tendon platform's paths.
const PATH_HZ: f64 = 120.0;
/// Length of the segment, m.
const SEGMENT: f64 = 0.100;

/// 0 to 1 as in a minimum-jerk move (Flash and Hogan 1985).
fn eased(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// From rest to a figure of eight of 60 mm by 42 mm, once around in 10 s, and back.
pub fn eight(t: f64) -> (f64, f64) {
    let size = 0.030 * (eased((t - 0.5) / 1.5) - eased((t - 12.0) / 1.5));
    let angle = TAU * (t - 2.0).max(0.0) / 10.0;
    (size * angle.cos(), 0.7 * size * (2.0 * angle).sin())
}

/// From rest to a circle of 50 mm, once around in 5 s, and back.
pub fn circle(t: f64) -> (f64, f64) {
    let size = 0.025 * (eased((t - 0.5) / 1.5) - eased((t - 8.0) / 1.5));
    let angle = TAU * (t - 1.0).max(0.0) / 5.0;
    (size * angle.cos(), size * angle.sin())
}

/// From rest down by 5 mm, twice and a half around a circle of 7 mm, 6 s a turn, while the height
/// goes 2 mm up and down, and back: +-7 mm in x and y and 4 mm in z, as published.
pub fn swirl(t: f64) -> [f64; 3] {
    let (around, back) = (eased((t - 2.5) / 2.0), 1.0 - eased((t - 17.0) / 2.0));
    let angle = TAU * (t - 2.5).max(0.0) / 6.0;
    let size = 0.007 * around * back;
    let down = 0.005 * eased((t - 0.5) / 2.0) * (1.0 - eased((t - 19.0) / 2.0));
    let z = 0.150 - down + 0.002 * around * back * (angle / 2.0).sin();
    [size * angle.cos(), size * angle.sin(), z]
}

/// Another path in the same place, for tuning: a circle of 5 mm, 4 s a turn, tilted.
pub fn small_swirl(t: f64) -> [f64; 3] {
    let size = eased((t - 2.0) / 1.5) * (1.0 - eased((t - 8.0) / 1.5));
    let angle = TAU * (t - 2.0).max(0.0) / 4.0;
    let down = 0.005 * eased((t - 0.5) / 1.5) * (1.0 - eased((t - 9.0) / 1.5));
    let z = 0.150 - down - 0.001 * size * angle.cos();
    [0.005 * size * angle.cos(), 0.005 * size * angle.sin(), z]
}

/// Levels, m, each held for so many control periods, with jumps between them.
pub fn jumps(levels: &[(f64, usize)]) -> String {
    let rows = levels
        .iter()
        .flat_map(|(level, steps)| std::iter::repeat_n(level, *steps));
    let mut text = String::from("t,q_m\n");
    for (k, level) in rows.enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:.6},{level}", k as f64 / FLOOR_HZ);
    }
    text
}

/// Reference of a tip, `rate` times a second.
pub fn table(at: fn(f64) -> [f64; 3], seconds: f64, rate: f64) -> String {
    let mut text = String::from("t,x_m,y_m,z_m\n");
    for k in 0..=(seconds * rate) as usize {
        let t = k as f64 / rate;
        let [x, y, z] = at(t);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{t:.6},{x:.6},{y:.6},{z:.6}");
    }
    text
}

/// The path of a tip, with the height that a segment has there which bends everywhere alike: by the
/// angle a its tip goes sideways by L (1 - cos a) / a and stands at L sin a / a.
pub fn tendon_path(sideways: fn(f64) -> (f64, f64), seconds: f64) -> String {
    let mut text = String::from("t,x_m,y_m,z_m\n");
    for k in 0..=(seconds * PATH_HZ) as usize {
        let t = k as f64 / PATH_HZ;
        let (x, y) = sideways(t);
        let z = height(x.hypot(y));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{t:.6},{x:.6},{y:.6},{z:.6}");
    }
    text
}

fn height(away: f64) -> f64 {
    let (mut low, mut high) = (1e-9, 2.0);
    for _ in 0..60 {
        let a: f64 = (low + high) / 2.0;
        if SEGMENT * (1.0 - a.cos()) / a < away {
            low = a;
        } else {
            high = a;
        }
    }
    SEGMENT * low.sin() / low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_far_aside_stands_lower() {
        assert!((height(0.0) - SEGMENT).abs() < 1e-6);
        // A quarter circle: L = r pi / 2, aside and up by r.
        let r = 2.0 * SEGMENT / std::f64::consts::PI;
        assert!((height(r) - r).abs() < 1e-6, "{}", height(r));
    }

    #[test]
    fn paths_begin_and_end_at_rest_at_home() {
        for (text, home) in [
            (tendon_path(eight, 14.0), SEGMENT),
            (tendon_path(circle, 10.0), SEGMENT),
            (table(swirl, 22.0, 125.0), 0.150),
            (table(small_swirl, 11.5, 125.0), 0.150),
        ] {
            let rows: Vec<&str> = text.lines().skip(1).collect();
            for row in [rows[0], rows[1], rows[rows.len() - 1]] {
                let numbers: Vec<f64> = row.split(',').skip(1).flat_map(str::parse).collect();
                assert!(numbers[0].abs() < 1e-6 && numbers[1].abs() < 1e-6, "{row}");
                assert!((numbers[2] - home).abs() < 1e-6, "{row}");
            }
        }
    }
}
