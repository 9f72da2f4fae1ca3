//! Targets of the published problems, and the margin to each.

use serde_json::{Value, json};

use sinew_nn::footprint::CYCLES_PER_INSTRUCTION;

use crate::figure::{Row, middle};

/// A number that is to be reached.
pub struct Target {
    /// Name of the figure.
    pub what: String,
    /// At most this, or where [`Target::least`] at least.
    pub wanted: f64,
    /// Measured value.
    pub found: f64,
    /// Of both.
    pub unit: &'static str,
    /// The more the better.
    pub least: bool,
}

impl Target {
    /// At most.
    pub fn most(what: &str, wanted: f64, found: f64, unit: &'static str) -> Self {
        Self {
            what: what.into(),
            wanted,
            found,
            unit,
            least: false,
        }
    }

    /// At least.
    pub fn least(what: &str, wanted: f64, found: f64, unit: &'static str) -> Self {
        Self {
            least: true,
            ..Self::most(what, wanted, found, unit)
        }
    }

    fn reached(&self) -> bool {
        if self.least {
            self.found >= self.wanted
        } else {
            self.found <= self.wanted
        }
    }

    /// For programs.
    pub fn value(&self) -> Value {
        json!({ "what": self.what, "wanted": self.wanted, "found": self.found, "unit": self.unit,
                "least": self.least, "reached": self.reached() })
    }
}

/// A line for a person.
pub fn said(target: &Target) -> String {
    let Target {
        what,
        wanted,
        found,
        unit,
        ..
    } = target;
    let bound = if target.least { "at least" } else { "at most" };
    let verdict = if target.reached() {
        "reached".into()
    } else {
        format!("missed by {:.0} %", 100.0 * (found / wanted - 1.0).abs())
    };
    let wanted = (1e3 * wanted).round() / 1e3;
    format!("{what}: {found:.3} {unit}, wanted {bound} {wanted} {unit}: {verdict}")
}

/// Loops of a controller of a comparison.
pub fn row(comparison: &Value, name: Option<&str>) -> Option<Row> {
    let mut all = comparison["controllers"].as_array()?.iter();
    let chosen = all.find(|c| name.is_none_or(|name| c["name"] == name));
    Row::of(chosen?).ok()
}

/// Median and worst loop, RMS error and largest error, millimetres.
pub fn errors(comparison: &Value, name: Option<&str>) -> [(f64, f64); 2] {
    let scaled = |values: &[f64]| {
        let (median, worst) = middle(values);
        (1e3 * median, 1e3 * worst)
    };
    row(comparison, name).map_or([(f64::NAN, f64::NAN); 2], |row| {
        [scaled(&row.rms), scaled(&row.max)]
    })
}

/// The part that figures are for: an 84 MHz Cortex-M4F.
const CLOCK_HZ: f64 = 84e6;
/// Watts while it runs: 146 uA a MHz at 3.3 V and [`CLOCK_HZ`], what an STM32F401xD/E is sold with
/// (run mode, peripherals off). An estimate with no board behind it.
const RUNNING_W: f64 = 146e-6 * 84.0 * 3.3;
/// Flash of such a part, bytes.
const FLASH: f64 = 512.0 * 1024.0;

/// Seconds of so many instructions.
fn seconds(instructions: f64) -> f64 {
    instructions * CYCLES_PER_INSTRUCTION / CLOCK_HZ
}

/// A part of the flash, in percent.
fn share(bytes: f64) -> f64 {
    100.0 * bytes / FLASH
}

/// Targets of the first controller in an image made for size, which the comparison has by `name`:
/// flash in bytes of the `control` image, of that without the control step, and of the whole image;
/// and its rate, `rate_hz` at least, which is what it costs.
pub fn for_size(
    comparison: &Value,
    name: &str,
    [control, without]: [u64; 2],
    rate_hz: f64,
) -> Vec<Target> {
    let all = comparison["controllers"].as_array();
    let small = all.and_then(|all| all.iter().find(|c| c["name"] == name));
    let of = |keys: [&str; 2]| small.and_then(|c| c[keys[0]][keys[1]].as_f64());
    let longest = of(["instructions_per_step", "max"]).unwrap_or(f64::NAN);
    let whole = of(["image", "flash_bytes"]).unwrap_or(f64::NAN);
    let flash = |what: &str, bytes: f64| Target::most(what, 3.2, share(bytes), "% of 512 kB");
    vec![
        Target::least(
            "made for size: rate, estimated from the longest step",
            rate_hz,
            1.0 / seconds(longest),
            "Hz",
        ),
        flash("made for size: flash of the control image", control as f64),
        flash(
            "made for size: flash of the control step in it",
            control.saturating_sub(without) as f64,
        ),
        flash("made for size: flash of the whole image", whole),
    ]
}

/// Targets that all problems share, of the first controller: `rate_hz` at least, flash and power.
pub fn estimate(comparison: &Value, rate_hz: f64) -> Vec<Target> {
    let first = &comparison["controllers"][0];
    let of = |key: &str| first["instructions_per_step"][key].as_f64();
    let (mean, max) = (
        of("mean").unwrap_or(f64::NAN),
        of("max").unwrap_or(f64::NAN),
    );
    let flash = first["image"]["flash_bytes"].as_f64().unwrap_or(f64::NAN);
    let rate = comparison["rate_hz"].as_f64().unwrap_or(f64::NAN);
    let power = 1e3 * RUNNING_W * seconds(mean) * rate;
    vec![
        Target::least(
            "rate, estimated from the longest step",
            rate_hz,
            1.0 / seconds(max),
            "Hz",
        ),
        Target::most(
            "energy of a mean step, estimated",
            1e6 * 45.4e-3 / 120.0,
            1e6 * RUNNING_W * seconds(mean),
            "uJ",
        ),
        Target::most(
            "mean power of the steps, asleep in between, estimated",
            45.4,
            power,
            "mW",
        ),
        Target::most("flash of the whole image", 3.2, share(flash), "% of 512 kB"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missed_target_says_by_how_much() {
        let most = |found| said(&Target::most("error", 2.0, found, "mm"));
        assert!(most(1.9).ends_with(": reached"));
        assert!(most(3.0).ends_with(": missed by 50 %"), "{}", most(3.0));
        let least = said(&Target::least("rate", 500.0, 400.0, "Hz"));
        assert!(
            least.ends_with("at least 500 Hz: missed by 20 %"),
            "{least}"
        );
    }

    #[test]
    fn the_estimate_is_of_the_longest_step() {
        let comparison = json!({ "rate_hz": 120.0, "controllers": [ {
            "instructions_per_step": { "mean": 10_000.0, "max": 49_411 }, "image": { "flash_bytes": 52_429 } } ] });
        let found: Vec<f64> = estimate(&comparison, 500.0)
            .iter()
            .map(|t| t.found)
            .collect();
        assert!((found[0] - 1000.0).abs() < 0.1, "{found:?}");
        assert!((found[3] - 10.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn an_image_made_for_size_is_found_by_its_name() {
        let of = |name: &str, max: u32, flash: u32| json!({ "name": name, "instructions_per_step": { "max": max }, "image": { "flash_bytes": flash } });
        let comparison = json!({ "controllers": [of("a", 1, 1), of("small", 49_411, 52_429)] });
        let targets = for_size(&comparison, "small", [15_729, 5_243], 500.0);
        let found: Vec<f64> = targets.iter().map(|t| t.found).collect();
        let expected = [1000.0, 3.0, 2.0, 10.0];
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{targets:?}",
                targets = targets.iter().map(said).collect::<Vec<_>>()
            );
        }
    }
}
