//! Diagnoses a rig from Rust:
//! `cargo run -p sinew-ident --example diagnose -- RIG.toml FIT.csv CHECK.csv`.
//!
//! Without arguments it takes a shipped rig whose recordings show dry friction.

use sinew_ident::diagnose::{DiagnoseOptions, Recordings, diagnose, output};
use sinew_ident::error::Result;
use sinew_ident::recording::Recording;
use sinew_sim::Rig;

fn main() -> Result<()> {
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/mass-spring-damper");
    let given: Vec<String> = std::env::args().skip(1).collect();
    let [rig, fit, check] = <[String; 3]>::try_from(given).unwrap_or_else(|_| {
        [".toml", ".fit.csv", ".test.csv"].map(|ending| format!("{shipped}{ending}"))
    });
    let rig = Rig::load(rig)?;
    let recordings = Recordings {
        fit: vec![Recording::read(fit)?],
        check: vec![Recording::read(check)?],
        test: vec![],
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    )?;
    print!("{}", output::text(&found));
    for effect in &found.effects {
        println!("{}: probability {:.2}", effect.kind, effect.confidence);
    }
    Ok(())
}
