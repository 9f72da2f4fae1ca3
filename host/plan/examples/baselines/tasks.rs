//! Ten tasks on three rigs: the plan beside CMA-ES and beside gradients alone.

use std::path::Path;
use std::time::Instant;

use sinew_ident::error::Result;
use sinew_ident::recording::{Column, Recording};
use sinew_plan::{Goal, Options, PlanProblem, Search, search};
use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::cma;

const MASS: &str = include_str!("../../../../rigs/mass-spring-damper.toml");
const TENDON: &str = include_str!("../../../../rigs/tendon.toml");
const HASEL: &str = include_str!("../../../../rigs/hasel.toml");

/// Simulations of CMA-ES; the plan has a tenth.
const EVALUATIONS: usize = 3000;

struct Task {
    name: &'static str,
    rig: String,
    goals: &'static [&'static str],
    path: Option<Recording>,
    /// Longest sub-step in units of one over the fastest rate.
    rate_step: f64,
}

fn friction(component: &str, level: f64) -> String {
    format!(
        "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"{component}\"\nlevel = {level}\n"
    )
}

/// A path to 80 mm and back, at rest in the middle.
fn there_and_back() -> Result<Recording> {
    let t: Vec<f64> = (0..=100).map(|k| f64::from(k) / 100.0).collect();
    let place = |t: &f64| 0.04 * (1.0 - (std::f64::consts::TAU * t).cos());
    let values = t.iter().map(place).collect();
    let column = Column {
        name: "q_m".to_owned(),
        values,
    };
    Recording::new("path.csv", t, vec![column])
}

fn tasks() -> Result<Vec<Task>> {
    let mass = |level: f64| format!("{MASS}{}", friction("mass", level));
    let dry = ["east", "west", "north", "south"].map(|tendon| {
        format!(
            "\n[[effect]]\nkind = \"load_dependent_friction\"\ncomponent = \"{tendon}\"\n\
             coefficient = 0.1\n"
        )
    });
    let tendon = format!("{TENDON}{}", dry.concat());
    let task = |name, rig: &str, goals, rate_step| Task {
        name,
        rig: rig.to_owned(),
        goals,
        path: None,
        rate_step,
    };
    Ok(vec![
        task(
            "mass 1: there, at rest",
            &mass(3.0),
            &["encoder = 0.1 at 0.6 s", "mass.velocity = 0 at 0.6 s"],
            0.1,
        ),
        task(
            "mass 2: farther, stays",
            &mass(6.0),
            &["encoder = 0.2 at 0.8 s", "encoder = 0.2 at 1.2 s"],
            0.1,
        ),
        task(
            "mass 3: both sides",
            &mass(4.0),
            &["encoder = 0.1 at 0.5 s", "encoder = -0.1 at 1.0 s"],
            0.1,
        ),
        Task {
            path: Some(there_and_back()?),
            ..task("mass 4: a path", &mass(4.0), &[], 0.1)
        },
        task(
            "tendon 1: one axis",
            &tendon,
            &["tip_x = 0.02 at 0.4 s"],
            0.2,
        ),
        task(
            "tendon 2: two axes",
            &tendon,
            &["tip_x = 0.015 at 0.4 s", "tip_y = -0.02 at 0.4 s"],
            0.2,
        ),
        task(
            "tendon 3: both sides",
            &tendon,
            &["tip_x = 0.015 at 0.3 s", "tip_x = -0.015 at 0.6 s"],
            0.2,
        ),
        task("HASEL 1: down", HASEL, &["tip_z = 0.147 at 0.2 s"], 0.3),
        task("HASEL 2: aside", HASEL, &["tip_x = 0.005 at 0.2 s"], 0.3),
        task(
            "HASEL 3: aside and down",
            HASEL,
            &[
                "tip_x = 0.004 at 0.2 s",
                "tip_y = -0.003 at 0.2 s",
                "tip_z = 0.148 at 0.2 s",
            ],
            0.3,
        ),
    ])
}

/// Prints one line a task whose name begins with one of `wanted`, or all.
pub fn run(wanted: &[String]) -> Result<()> {
    println!(
        "| task | variables | plan: cost, miss | CMA-ES {EVALUATIONS}: cost, miss | ratio \
         | CMA-ES 300 | hard laws from rest | path from rest | samples, hard laws \
         | simulations | seconds: plan, CMA-ES |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for task in tasks()? {
        if !wanted.is_empty()
            && !wanted
                .iter()
                .any(|name| task.name.starts_with(name.as_str()))
        {
            continue;
        }
        ratios.push(line(&task)?);
    }
    ratios.sort_by(f64::total_cmp);
    if let (Some(low), Some(high)) = (
        ratios.get(ratios.len().saturating_sub(1) / 2),
        ratios.get(ratios.len() / 2),
    ) {
        println!("median of {}: {:.3}", ratios.len(), (low + high) / 2.0);
    }
    Ok(())
}

/// Runs a task; returns the plan's cost over that of CMA-ES.
fn line(task: &Task) -> Result<f64> {
    let plant = Plant::new(&Rig::parse(&task.rig, "task.toml")?)?;
    let plant = plant.with_settings(SimulationSettings {
        rate_step: task.rate_step,
        ..plant.settings()
    });
    let goals = task.goals.iter().map(|goal| Goal::parse(goal));
    let goals = goals.collect::<Result<Vec<Goal>>>()?;
    let options = Options::default();
    let file = Path::new("task.toml");
    let problem = || PlanProblem::new(&plant, file, &goals, task.path.as_ref(), &options);
    let found = |how| -> Result<(f64, f64, usize, f64)> {
        let problem = problem()?;
        let begun = Instant::now();
        let found = search(&problem, &options, how, &mut |level| {
            if std::env::var_os("LEVELS").is_some() {
                eprintln!("      {level:?} {:?}", problem.count());
            }
        });
        let (seconds, used) = (begun.elapsed().as_secs_f64(), problem.count().equivalent());
        Ok((found.cost, problem.miss(&found.x), used, seconds))
    };
    let (plan, miss, used, seconds) = found(Search::CentralPath)?;
    let (hard, _, _, _) = found(Search::HardFromRest)?;
    let (rested, _, _, _) = found(Search::PathFromRest)?;
    let (sampled, _, _, _) = found(Search::SamplesThenHard)?;
    let baseline = |evaluations: usize| -> Result<(f64, f64, f64)> {
        let problem = problem()?;
        let begun = Instant::now();
        let (cost, x) = cma::minimise(
            problem.rest(),
            0.3,
            evaluations,
            options.seed,
            &|x| problem.project(x),
            &|x| problem.cost(0.0, x),
        );
        Ok((cost, problem.miss(&x), begun.elapsed().as_secs_f64()))
    };
    let (cma, cma_miss, cma_seconds) = baseline(EVALUATIONS)?;
    let (short, _, _) = baseline(EVALUATIONS / 10)?;
    println!(
        "| {} | {} | {plan:.2e}, {:.2} % | {cma:.2e}, {:.2} % | {:.3} | {short:.2e} | {hard:.2e} \
         | {rested:.2e} | {sampled:.2e} | {used} | {seconds:.1}, {cma_seconds:.1} |",
        task.name,
        problem()?.variables(),
        100.0 * miss,
        100.0 * cma_miss,
        plan / cma,
    );
    Ok(plan / cma)
}
