//! Diagnosis of components that are alike, where each or one of them has an effect:
//! the tendon platform, of which a camera sees the tip and nothing else
//! (docs/lab/0066-tied-start-of-identical-components.md).

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problems::TENDON;
use super::published::{NOISE, excited};
use xtask::process;

/// As on the command line, and the folder of its results.
pub const NAME: &str = "alike";

/// One kind at some components, with the same parameters at each.
struct Hidden {
    kind: &'static str,
    at: &'static [&'static str],
    truth: &'static [(&'static str, f64)],
}

struct Case {
    name: &'static str,
    hidden: &'static [Hidden],
}

const TENDONS: &[&str] = &["east", "west", "north", "south"];
const WINCHES: &[&str] = &["pull_east", "pay_out_west", "pull_north", "pay_out_south"];
const CAMERA: &[&str] = &["tip_x", "tip_y", "tip_z"];
const JOINTS: &[&str] = &[
    "spine.flex_x1",
    "spine.flex_y1",
    "spine.flex_x2",
    "spine.flex_y2",
    "spine.flex_x3",
    "spine.flex_y3",
];

const BENDS: &[&str] = &[
    "spine.x1", "spine.y1", "spine.x2", "spine.y2", "spine.x3", "spine.y3",
];

const CASES: &[Case] = &[
    Case {
        name: "camera-lag",
        hidden: &[Hidden {
            kind: "sensor_lag",
            at: CAMERA,
            truth: &[("time_constant", 0.020)],
        }],
    },
    Case {
        name: "winch-lag",
        hidden: &[Hidden {
            kind: "actuator_lag",
            at: WINCHES,
            truth: &[("time_constant", 0.030)],
        }],
    },
    Case {
        name: "winch-dead-zone",
        hidden: &[Hidden {
            kind: "input_dead_zone",
            at: WINCHES,
            truth: &[("width", 0.05)],
        }],
    },
    Case {
        name: "joints-creep",
        hidden: &[Hidden {
            kind: "viscoelastic_creep",
            at: JOINTS,
            truth: &[("stiffness", 0.15), ("time_constant", 1.0)],
        }],
    },
    Case {
        name: "joints-creep-little",
        hidden: &[Hidden {
            kind: "viscoelastic_creep",
            at: JOINTS,
            truth: &[("stiffness", 0.05), ("time_constant", 1.0)],
        }],
    },
    Case {
        name: "joints-cubic",
        hidden: &[Hidden {
            kind: "cubic_stiffness",
            at: JOINTS,
            truth: &[("coefficient", 0.5)],
        }],
    },
    Case {
        name: "joints-rub",
        hidden: &[Hidden {
            kind: "coulomb_friction",
            at: BENDS,
            truth: &[("level", 0.004)],
        }],
    },
    Case {
        name: "one-joint-creeps",
        hidden: &[Hidden {
            kind: "viscoelastic_creep",
            at: &["spine.flex_x1"],
            truth: &[("stiffness", 0.10), ("time_constant", 1.0)],
        }],
    },
    Case {
        name: "one-tendon-rubs",
        hidden: &[Hidden {
            kind: "load_dependent_friction",
            at: &["north"],
            truth: &[("coefficient", 0.10)],
        }],
    },
    Case {
        name: "one-tendon-rubs-hard",
        hidden: &[Hidden {
            kind: "load_dependent_friction",
            at: &["north"],
            truth: &[("coefficient", 0.30)],
        }],
    },
    Case {
        name: "tendons-rub",
        hidden: &[Hidden {
            kind: "load_dependent_friction",
            at: TENDONS,
            truth: &[("coefficient", 0.05)],
        }],
    },
    Case {
        name: "tendons-rub-hard",
        hidden: &[Hidden {
            kind: "load_dependent_friction",
            at: TENDONS,
            truth: &[("coefficient", 0.15)],
        }],
    },
    Case {
        name: "nothing",
        hidden: &[],
    },
];

/// # Errors
/// A case that there is not, setup, or the exit status of `sinew`.
pub fn run(seed: u64, only: &[String]) -> Result<()> {
    let known = |name: &String| CASES.iter().any(|case| case.name == name);
    if let Some(name) = only.iter().find(|name| !known(name)) {
        let all: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        bail!("{NAME} has no case '{name}'; there are {}", all.join(", "));
    }
    let bench = Bench::new(NAME, seed)?;
    let whole = bench.text(Path::new("rigs/tendon.toml"))?;
    let (bare, _) = whole
        .split_once("[[waveguide]]")
        .context("rigs/tendon.toml has no fibres to leave out")?;
    let nominal = bench.write("nominal.toml", bare)?;
    let asked = |case: &&Case| only.is_empty() || only.iter().any(|name| name == case.name);
    let (mut rows, mut all) = (String::new(), Vec::new());
    for case in CASES.iter().filter(asked) {
        println!("{NAME}: {}", case.name);
        let found = diagnosed(&bench, &nominal, bare, case)?;
        rows += &row(case, &found);
        all.push(json!({ "case": case.name, "right": is_right(case, &found), "diagnosis": found }));
    }
    println!(
        "\n| case | truth | found: median, least, most; sure | s |\n|---|---|---|--:|\n{rows}"
    );
    bench.summary(json!({ "format": "sinew-experiment-alike/1", "seed": seed, "cases": all }))
}

/// Three recordings of the platform with what is hidden, its joints 6 % stiffer and 16 % more
/// damped than its owner wrote; and what is said of them.
fn diagnosed(bench: &Bench, nominal: &Path, bare: &str, case: &Case) -> Result<Value> {
    let stiffer = bare.replace("value = 0.293", "value = 0.310");
    let mut text = stiffer.replace("value = 0.0019", "value = 0.0022");
    for Hidden { kind, at, truth } in case.hidden {
        for component in *at {
            write!(
                text,
                "\n[[effect]]\nkind = \"{kind}\"\ncomponent = \"{component}\"\n"
            )?;
            for (parameter, value) in *truth {
                writeln!(text, "{parameter} = {value}")?;
            }
        }
    }
    let real = bench.write(&format!("{}.real.toml", case.name), &text)?;
    let mut diagnose = bench.sinew("diagnose", nominal);
    for (k, role) in (0..).zip(["fit", "check", "test"]) {
        let seed = (10 * bench.seed + k).to_string();
        let inputs = bench.inputs(nominal, &excited(&TENDON), &seed)?;
        let recording = bench.path(&format!("{}.{role}.csv", case.name));
        let mut simulate = bench.sinew("simulate", &real);
        simulate.arg("--input").arg(inputs);
        simulate.arg("--out").arg(&recording);
        simulate.args(["--with-inputs", "--noise", NOISE, "--quiet"]);
        process::run(simulate.args(["--seed", &seed]))?;
        diagnose.arg(format!("--{role}")).arg(recording);
    }
    let json = format!("{}.json", case.name);
    process::run(diagnose.arg("--json").arg(bench.path(&json)))?;
    bench.json(&json)
}

/// Kinds and components of what is named are those of what is hidden.
fn is_right(case: &Case, found: &Value) -> bool {
    let mut named: Vec<(&str, &str)> = effects(found)
        .filter_map(|effect| Some((effect["kind"].as_str()?, effect["component"].as_str()?)))
        .collect();
    let mut hidden: Vec<(&str, &str)> = (case.hidden.iter())
        .flat_map(|hidden| hidden.at.iter().map(|component| (hidden.kind, *component)))
        .collect();
    named.sort_unstable();
    hidden.sort_unstable();
    named == hidden
}

fn effects(found: &Value) -> impl Iterator<Item = &Value> {
    found["effects"].as_array().into_iter().flatten()
}

/// A line of the table.
fn row(case: &Case, found: &Value) -> String {
    let truth = case.hidden.iter().flat_map(|hidden| {
        let places = hidden.at.len();
        let each = hidden.truth.iter();
        each.map(move |(name, value)| format!("{} {name} {value}, {places} times", hidden.kind))
    });
    let truth: Vec<String> = truth.collect();
    let said = if is_right(case, found) && !case.hidden.is_empty() {
        let parameters = case.hidden.iter().flat_map(|hidden| {
            let each = hidden.truth.iter();
            each.map(move |(name, _)| spread(found, hidden.kind, name))
        });
        let parameters: Vec<String> = parameters.collect();
        let least = effects(found).filter_map(|effect| effect["confidence"].as_f64());
        format!(
            "{}; {:.2}",
            parameters.join("; "),
            least.fold(1.0, f64::min)
        )
    } else {
        let kinds =
            effects(found).filter_map(|e| Some((e["kind"].as_str()?, e["component"].as_str()?)));
        let others: Vec<String> = kinds.map(|(kind, at)| format!("{kind} at {at}")).collect();
        format!(
            "`{}` {}",
            found["verdict"].as_str().unwrap_or_default(),
            others.join(", ")
        )
    };
    let seconds = found["seconds"].as_f64().unwrap_or(f64::NAN);
    let truth = truth.join("; ");
    format!("| {} | {truth} | {said} | {seconds:.0} |\n", case.name)
}

/// Middle, least and largest value of a parameter over the components.
fn spread(found: &Value, kind: &str, parameter: &str) -> String {
    let mut values: Vec<f64> = effects(found)
        .filter(|effect| effect["kind"] == kind)
        .filter_map(|effect| effect["parameters"][parameter]["value"].as_f64())
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    match &values[..] {
        [] => "none".into(),
        [one] => format!("{one:.4}"),
        [least, .., most] => format!("{:.4}, {least:.4}, {most:.4}", values[values.len() / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(kind: &str, named: &[(&str, f64)]) -> Value {
        let effect = |(component, value): &(&str, f64)| {
            json!({ "kind": kind, "component": component, "confidence": 0.9,
                    "parameters": { "coefficient": { "value": value } } })
        };
        let effects: Vec<Value> = named.iter().map(effect).collect();
        json!({ "verdict": "missing_physics", "effects": effects, "seconds": 12.3 })
    }

    #[test]
    fn a_case_is_right_where_each_component_is_named_and_no_other() {
        let case = CASES.iter().find(|case| case.name == "tendons-rub");
        let case = case.expect("tendons-rub is a case");
        let kind = "load_dependent_friction";
        let all = [
            ("west", 0.04),
            ("east", 0.05),
            ("south", 0.06),
            ("north", 0.07),
        ];
        let right = said(kind, &all);
        assert!(is_right(case, &right));
        assert!(row(case, &right).contains("| 0.0600, 0.0400, 0.0700; 0.90 | 12 |"));
        let three = said(kind, &all[..3]);
        assert!(!is_right(case, &three) && row(case, &three).contains("at south"));
        assert!(!is_right(case, &said("tendon_slack", &all)));
    }
}
