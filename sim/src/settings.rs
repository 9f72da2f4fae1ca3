//! Settings of the integrator, and its report of a run.

/// Longest sub-step, in units of one over the bound on the fastest rate. At 0.1 an undamped mode is
/// followed with a relative phase error of about 1e-6 (0.1^4 / 120), far inside the stability limit
/// of 2.8.
const RATE_STEP: f64 = 0.1;

/// The most that [`SimulationSettings::rate_step`] may be: what is left of the stability limit for
/// a rate that grows within a sample.
pub(crate) const MOST_RATE_STEP: f64 = 1.0;

/// Most sub-steps in one sample interval; a rig that needs more is refused as too stiff.
pub(crate) const MAX_SUBSTEPS: usize = 1 << 14;

/// Settings of the integrator.
///
/// ```
/// # use sinew_sim::{Plant, Rig};
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n";
/// use sinew_sim::SimulationSettings;
/// # let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let accurate = plant.with_settings(SimulationSettings {
///     tolerance: Some(1e-9),
///     ..plant.settings()
/// });
/// assert_eq!(accurate.settings().tolerance, Some(1e-9));
/// # Ok::<(), sinew_sim::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationSettings {
    /// Longest sub-step, in units of one over the bound on the fastest rate, up to 1. An undamped
    /// mode is followed with a relative phase error of the fourth power of this over 120.
    pub rate_step: f64,
    /// Refines the sub-steps that follow from the rates until halving them changes no state by more
    /// than this share of the largest that it has had; none: as the rates say.
    pub tolerance: Option<f64>,
    /// Parameter of the central path, W for friction and J for contact: friction and contact as
    /// smooth functions, for gradients that see through them. 0: the hard laws, which are its
    /// limit.
    pub smoothing: f64,
    /// Most sub-steps in one sample interval; a rig that needs more is refused as too stiff. A fit
    /// that tries many parameters may want fewer.
    pub max_substeps: usize,
}

impl Default for SimulationSettings {
    fn default() -> Self {
        Self {
            rate_step: RATE_STEP,
            tolerance: None,
            smoothing: 0.0,
            max_substeps: MAX_SUBSTEPS,
        }
    }
}

/// Report of an integration.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[spring]]\nname='k'\nfrom='ground'\nto='m'\nstiffness={ value = 40.0, min = 1.0 }\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
/// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_mm'\nunit='mm'\n";
/// use sinew_sim::{InputTrajectory, Plant, Rig};
/// let text = format!("{text}[[effect]]\nkind='coulomb_friction'\ncomponent='m'\nlevel=1.0\n");
/// let plant = Plant::new(&Rig::parse(&text, "x.toml")?)?;
/// let drive = InputTrajectory::new(&plant, 2, &[&[0.0, 0.0]])?;
/// let run = plant.simulate(&plant.values(), &[0.1, 0.0], &drive, &[0.0, 1.0])?;
/// assert!(run.report.events >= 1, "the mass turns round, or sticks, within the second");
/// assert!(run.report.most_substeps <= run.report.substeps);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntegrationReport {
    /// Largest bound on the fastest rate that was met, 1/s.
    pub rate: f64,
    /// Most sub-steps taken in one sample interval.
    pub most_substeps: usize,
    /// Sub-steps taken in all.
    pub substeps: usize,
    /// Stops, reversals and breakaways that a step was cut at.
    pub events: usize,
    /// Kinks and jumps of laws that a step was cut at: contact made and lost, slack and taut, the
    /// ends of play, reversals of a drag or a hysteresis.
    pub kinks: usize,
    /// Sub-steps with more events than are followed, which were ended with the body at rest.
    pub fallbacks: usize,
}
