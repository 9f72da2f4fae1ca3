//! Identification with exact derivatives beside two searches without: simulations until 1.05 times
//! the lowest error that any of them found.

mod methods;
mod problem;

use anyhow::Result;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use methods::{Trace, evolution, growing, levenberg_marquardt, simplex};
use problem::Problem;

/// Starts of each rig.
const STARTS: usize = 3;
/// Farthest start, as the logarithm of a parameter beside the rig's: half to twice.
const FAR: f64 = std::f64::consts::LN_2;
/// Error, beside the lowest, that counts as found.
const NEAR: f64 = 1.05;

/// A method: its name and its search from a start.
type Method = (&'static str, fn(&Problem, &[f64], u64) -> Result<Trace>);

const METHODS: [Method; 4] = [
    ("L-M, growing", |problem, start, _| growing(problem, start)),
    ("L-M, whole", |problem, start, _| {
        Ok(levenberg_marquardt(problem, start))
    }),
    ("Nelder-Mead", |problem, start, _| {
        Ok(simplex(problem, start))
    }),
    ("CMA-ES", |problem, start, seed| {
        Ok(evolution(problem, start, seed))
    }),
];

/// Measures, prints the table and returns `fit`.
///
/// # Errors
/// A rig or a recording cannot be read.
pub fn run() -> Result<Value> {
    let problems = [Problem::emps()?, Problem::two_mass()?, Problem::tendon()?];
    println!(
        "simulations until {NEAR} times the lowest error, from {STARTS} starts; a simulation with \
         k derivatives counts as 1 + k, part of one as that part\n"
    );
    let titles = METHODS.map(|(name, _)| format!("{name:>24}"));
    println!("{:<42}{}", "", titles.concat());
    let mut rows = Vec::new();
    for problem in &problems {
        rows.push(measure(problem)?);
    }
    Ok(json!({ "near": NEAR, "rigs": rows }))
}

/// Simulations of every method from every start, for one rig.
fn measure(problem: &Problem) -> Result<Value> {
    let traces: Vec<Vec<Trace>> = (0..STARTS as u64)
        .map(|seed| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let start: Vec<f64> = (0..problem.unknowns())
                .map(|_| random.random_range(-FAR..FAR))
                .collect();
            let searches = METHODS.iter();
            searches
                .map(|(_, search)| search(problem, &start, seed))
                .collect()
        })
        .collect::<Result<_>>()?;
    let lowest = (traces.iter().flatten())
        .map(Trace::lowest)
        .fold(f64::INFINITY, f64::min);
    let mut row = format!("{:<42}", problem.name());
    let mut found = serde_json::Map::new();
    for (which, (name, _)) in METHODS.iter().enumerate() {
        let of_method = traces.iter().map(|of_start| &of_start[which]);
        let reached: Vec<Option<usize>> = of_method
            .clone()
            .map(|trace| trace.until(NEAR * lowest))
            .collect();
        let each: Vec<String> = reached
            .iter()
            .map(|count| {
                count.map_or_else(|| format!("> {}", problem.most), |count| count.to_string())
            })
            .collect();
        row += &format!("{:>24}", each.join(", "));
        let lowest: Vec<f64> = of_method.map(Trace::lowest).collect();
        found.insert(
            (*name).into(),
            json!({ "simulations": reached, "lowest": lowest }),
        );
    }
    println!("{row}");
    Ok(
        json!({ "rig": problem.name(), "parameters": problem.unknowns(), "most": problem.most, "lowest": lowest,
        "methods": found }),
    )
}
