//! Static equilibrium of a plant.

use super::simulated::Simulated;
use crate::error::SimulationError;
use crate::plant::Plant;
use crate::statics::{Rest, RestInterval};

impl Plant {
    /// Static equilibrium under constant inputs: velocities zero, forces balanced, effects and lags
    /// at rest, HASEL actuators charged. Dry friction is left out ([`Plant::rest_intervals`]).
    ///
    /// `values` has one entry a parameter slot, `inputs` one an input, SI. The search starts at the
    /// positions of `start`, a state, and goes downhill in potential energy: of several stable
    /// rests it finds one nearby. Numbers that carry derivatives give those of the rest, by one
    /// implicit solve (docs/explanation/plant.md, eq. 30).
    ///
    /// ```
    /// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\n\
    /// # inertia=2.0\n[[spring]]\nname='coil'\nfrom='ground'\nto='m'\nstiffness=40.0\n\
    /// # [[actuator]]\nname='push'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
    /// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_m'\n";
    /// use sinew_sim::{Dual, Plant, Rig, Scalar};
    /// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
    /// let values: Vec<_> = plant.values().into_iter().map(Dual::<1>::constant).collect();
    /// let push = Dual::variable(10.0, 0);
    /// let rest = plant.rest(&values, &[push], &[0.0, 0.0])?;
    /// assert!((rest.signals[0].value - 0.25).abs() < 1e-12); // 10 N on 40 N/m
    /// assert!((rest.signals[0].derivative[0] - 0.025).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SimulationError::NoRest`] where nothing holds a body, where the balance is unstable, where
    /// none is found, and where a motion is imposed; `Shape` and `NotFinite`.
    pub fn rest<S: Simulated>(
        &self,
        values: &[S],
        inputs: &[S],
        start: &[f64],
    ) -> Result<Rest<S>, SimulationError> {
        S::rest(self, values, inputs, start)
    }

    /// Intervals of rests that dry friction, hysteresis and play leave around the rest in `state`:
    /// one a component, the others at their middle.
    ///
    /// ```
    /// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\n\
    /// # inertia=2.0\n[[spring]]\nname='coil'\nfrom='ground'\nto='m'\nstiffness=40.0\n\
    /// # [[effect]]\nkind='coulomb_friction'\ncomponent='m'\nlevel=2.0\n\
    /// # [[sensor]]\nname='s'\nreads='m.position'\nsignal='q_m'\n";
    /// use sinew_sim::{Plant, Rig};
    /// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
    /// let values = plant.values();
    /// let rest = plant.rest(&values, &[], &[0.1, 0.0])?;
    /// let intervals = plant.rest_intervals(&values, &[], &rest.state)?;
    /// assert_eq!(intervals[0].component, "m.coulomb_friction");
    /// let ends = intervals[0].ends.each_ref().map(|end| end.as_ref().map(|end| end.signals[0]));
    /// // 2 N of friction on 40 N/m.
    /// let [Some(back), Some(forward)] = ends else { panic!("nothing balances an end") };
    /// assert!((back.abs() - 0.05).abs() < 1e-9 && (back + forward).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Plant::rest`], but for an end that nothing balances.
    pub fn rest_intervals(
        &self,
        values: &[f64],
        inputs: &[f64],
        state: &[f64],
    ) -> Result<Vec<RestInterval>, SimulationError> {
        self.find_rest_intervals(values, inputs, state)
    }
}
