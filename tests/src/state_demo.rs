//! The closed loop of a committed state network: the demo's rig with dry friction as the plant.

use sinew::closed_loop::disturbance::Disturbance;
use sinew::closed_loop::mpc::MpcController;
use sinew::closed_loop::reference::{Reference, Workspace};
use sinew::closed_loop::scenario::{Run, Scenario};
use sinew::device::Device;
use sinew::project::{self, Board, Optimise, board_folder, image::sizes};
use sinew_ident::error::{Error, Result};
use sinew_model::{fingerprint, store};
use sinew_sim::{Plant, Rig};

use crate::closed_loop::hash;
use crate::image;
use crate::snapshot::Measured;

/// Folder of the model in `models/`.
pub const MODEL: &str = "demo-state";
/// Dry friction of the plant, newtons: what the demo's recordings conceal.
const FRICTION: &str = "
[[effect]]
kind = \"coulomb_friction\"
component = \"mass\"
level = 0.58
";
/// Standard deviation of the readings, metres: that of the demo's recordings.
const NOISE_M: f64 = 0.47e-3;
/// Steps of each level of the reference.
const LEVEL_STEPS: usize = 333;
/// Largest RMS tracking error of a loop worth measuring, metres.
const MOST_ERROR_M: f64 = 1e-3;

/// Builds the image of the model and runs it in QEMU on the plant as the rig file has it, which is
/// not the one that the network was trained about.
///
/// # Errors
/// The image does not build, the run breaks off, or the loop does not follow.
pub fn measure() -> Result<Measured> {
    let spec = store::load(&image::root().join("models").join(MODEL)).map_err(Error::refused)?;
    let folder = image::cache().join(MODEL);
    project::write(&folder, &spec, Optimise::Speed)?;
    let built = project::build(&folder, Board::Qemu, Some(&image::cache()))?;
    let runner = board_folder(&folder, Board::Qemu).join("run.sh");
    let mut device = Device::qemu(&runner, &built.lockstep)?;
    let (run, bits, ticks) = {
        let mut controller = MpcController::new(&mut device, fingerprint(&spec))?;
        let run = scenario(&with_friction()?, spec.period_s)?.run(&mut controller)?;
        let answers = controller.answers.iter();
        let ticks: Vec<u32> = answers.clone().map(|answer| answer.ticks).collect();
        (
            run,
            hash(answers.flat_map(|a| a.bits.iter().copied())),
            ticks,
        )
    };
    let (summary, _) = device.finish()?;
    follows(&run)?;
    Measured::new(&ticks, bits, &summary, &sizes(&built.lockstep)?)
}

/// Refuses the costs of a controller that does not control.
fn follows(run: &Run) -> Result<()> {
    let error = run.score(&[]).rms[0];
    if error <= MOST_ERROR_M {
        return Ok(());
    }
    Err(Error::failed(format!(
        "the state network follows with an RMS error of {error:.2e} m; expected at most \
         {MOST_ERROR_M:.0e} m"
    )))
}

/// The demo's rig with dry friction.
fn with_friction() -> Result<Rig> {
    let path = image::root().join("rigs/demo.toml");
    let text = std::fs::read_to_string(&path).map_err(|error| Error::read(&path, error))?;
    Ok(Rig::parse(
        &(text + FRICTION),
        "demo.toml with dry friction",
    )?)
}

/// A loop over a staircase with this rig as the plant.
///
/// # Errors
/// The rig cannot be simulated.
pub fn scenario(rig: &Rig, period_s: f64) -> Result<Scenario> {
    let plant = Plant::new(rig)?;
    let values = plant.values();
    let workspace = Workspace {
        low: 0.0,
        high: 0.3,
        speed: 0.2,
    };
    let reference = Reference::staircase(&[workspace], LEVEL_STEPS, period_s);
    Ok(Scenario {
        start: plant.initial_state(&values, &[Some(0.0)])?,
        plant,
        values,
        outputs: vec![0],
        noise: vec![NOISE_M],
        channels: (Vec::new(), Vec::new()),
        delay_s: 0.0,
        seed: 1,
        period_s,
        reference,
        load: (Disturbance::None, vec![0.0]),
        program: None,
    })
}
