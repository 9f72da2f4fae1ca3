//! Sled and second mass: five seeds, and what gradients do without samples or without a path.

use std::path::Path;
use std::time::Instant;

use sinew_ident::error::Result;
use sinew_plan::{Goal, Options, PlanProblem, Search, search};
use sinew_sim::{Plant, Rig};

pub fn run() -> Result<()> {
    let text = include_str!("../../tests/sled.toml");
    let plant = Plant::new(&Rig::parse(text, "sled.toml")?)?;
    let goals = [Goal::parse("second.position = 0.12 at 1.5 s")?];
    println!("sled: {}", goals[0]);
    let searches = [
        ("central path", Search::CentralPath, vec![1, 2, 3, 4, 5]),
        (
            "samples, hard laws",
            Search::SamplesThenHard,
            vec![1, 2, 3, 4, 5],
        ),
        ("path from rest", Search::PathFromRest, vec![1]),
        ("hard laws from rest", Search::HardFromRest, vec![1]),
        ("fixed 0.1 from rest", Search::FixedFromRest(0.1), vec![1]),
        (
            "fixed 0.001 from rest",
            Search::FixedFromRest(0.001),
            vec![1],
        ),
    ];
    for (name, how, seeds) in searches {
        for seed in seeds {
            line(name, &plant, &goals, how, seed)?;
        }
    }
    for contacts in 2..=4 {
        let text = chain(contacts);
        let plant = Plant::new(&Rig::parse(&text, "chain.toml")?)?;
        let goals = [Goal::parse(&format!(
            "body{contacts}.position = 0.06 at 2 s"
        ))?];
        println!("{contacts} contacts one after another: {}", goals[0]);
        for seed in 1..=5 {
            line("central path", &plant, &goals, Search::CentralPath, seed)?;
        }
        line("path from rest", &plant, &goals, Search::PathFromRest, 1)?;
    }
    let plant = Plant::new(&Rig::parse(&both_sides(), "both.toml")?)?;
    let goals = [
        Goal::parse("right.position = 0.08 at 3 s")?,
        Goal::parse("left.position = -0.08 at 3 s")?,
        Goal::parse("sled.position = 0.02 at 3 s")?,
    ];
    println!("both sides, then back: largest miss in units of 0.08 m");
    for seed in 1..=5 {
        line("central path", &plant, &goals, Search::CentralPath, seed)?;
        line(
            "samples, hard laws",
            &plant,
            &goals,
            Search::SamplesThenHard,
            seed,
        )?;
    }
    Ok(())
}

/// The sled between two masses, 50 mm from either: it has to reverse to push both.
fn both_sides() -> String {
    let sled = include_str!("../../tests/sled.toml");
    sled.replace("second", "right")
        + "\n[[body]]\nname = \"left\"\nmotion = \"slide\"\ninertia = 0.5\n\
           [[tendon]]\nname = \"contact_left\"\nstiffness = 2000.0\ndamping = 20.0\n\
           path = [{ body = \"sled\", arm = -1.0 }, { body = \"left\", arm = 1.0 }]\n\
           [[effect]]\nkind = \"tendon_slack\"\ncomponent = \"contact_left\"\nslack = 0.05\n\
           [[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"left\"\nlevel = 1.0\n"
}

/// The sled and so many masses behind one another, each on a dry guide and 50 mm from the next.
fn chain(contacts: usize) -> String {
    let sled = include_str!("../../tests/sled.toml");
    let mut text = sled.replace("second", "body1");
    for next in 2..=contacts {
        let last = next - 1;
        text += &format!(
            "\n[[body]]\nname = \"body{next}\"\nmotion = \"slide\"\ninertia = 0.5\n\
             [[tendon]]\nname = \"contact{next}\"\nstiffness = 2000.0\ndamping = 20.0\n\
             path = [{{ body = \"body{last}\", arm = 1.0 }}, \
             {{ body = \"body{next}\", arm = -1.0 }}]\n\
             [[effect]]\nkind = \"tendon_slack\"\ncomponent = \"contact{next}\"\nslack = 0.05\n\
             [[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"body{next}\"\nlevel = 1.0\n"
        );
    }
    text
}

/// Runs one search and prints its miss, cost and simulations.
fn line(name: &str, plant: &Plant, goals: &[Goal], how: Search, seed: u64) -> Result<()> {
    let options = Options {
        seed,
        ..Options::default()
    };
    let problem = PlanProblem::new(plant, Path::new("sled.toml"), goals, None, &options)?;
    let begun = Instant::now();
    let found = search(&problem, &options, how, &mut |level| {
        if std::env::var_os("LEVELS").is_some() {
            println!("      {level:?} {:?}", problem.count());
        }
    });
    let seconds = begun.elapsed().as_secs_f64();
    let count = problem.count();
    println!(
        "{name:<22} seed {seed}: missed {:>8.3} mm, cost {:.2e}, {} simulations \
         ({} plain, {} forward, {} backward), {seconds:.1} s",
        1e3 * goals[0].value * problem.miss(&found.x),
        found.cost,
        count.equivalent(),
        count.plain,
        count.forward,
        count.backward,
    );
    Ok(())
}
