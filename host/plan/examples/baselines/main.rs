//! `cargo run -p sinew-plan --example baselines -- PART...`: tables of docs/evaluation/plan.md.

mod cma;
mod sled;
mod tasks;

fn main() -> sinew_ident::error::Result<()> {
    let parts: Vec<String> = std::env::args().skip(1).collect();
    let (sleds, others): (Vec<String>, Vec<String>) =
        parts.iter().cloned().partition(|part| part == "sled");
    if parts.is_empty() || !sleds.is_empty() {
        sled::run()?;
    }
    if parts.is_empty() || !others.is_empty() {
        tasks::run(&others)?;
    }
    Ok(())
}
