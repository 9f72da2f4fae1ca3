//! A sample interval: in how many sub-steps it is taken, and taken again for a tolerance.

use super::input_chain::InputChain;
use super::rate;
use super::stepper::Stepper;
use crate::error::SimulationError;
use crate::scalar::Scalar;

impl<S: Scalar> Stepper<S> {
    /// Advances by `dt` with the inputs that were taken.
    pub(crate) fn step(&mut self, dt: f64) -> Result<(), SimulationError> {
        if !self.filled {
            self.present();
        }
        self.span_motions(dt);
        if self.topology.prescribed {
            let work = &mut self.work;
            work.dynamics.impose(&mut work.state, S::constant(dt));
            return self.end_step(dt, 1);
        }
        if self.topology.rates_vary {
            self.watch_rate(dt);
        }
        let mut rate = self.rate;
        if !self.topology.stops.is_empty() || !self.topology.hasels.is_empty() {
            let near = self.work.rate(&self.topology, dt, true);
            if near.0 > rate.0 {
                rate = near;
            }
            self.report.rate = self.report.rate.max(rate.0);
        }
        let count = match self.settings.tolerance {
            _ if self.topology.linear => self.exactly(rate, dt)?,
            None => self.integrate(rate, dt, 1)?,
            Some(tolerance) => self.refine(rate, dt, tolerance)?,
        };
        self.end_step(dt, count)
    }

    /// Ends a step that took so many sub-steps; refuses a state that is not finite.
    fn end_step(&mut self, dt: f64, count: usize) -> Result<(), SimulationError> {
        self.report.substeps += count;
        self.report.most_substeps = self.report.most_substeps.max(count);
        self.time += dt;
        self.tau = dt;
        self.refresh();
        let bodies = self.topology.bodies.len();
        let state = &self.work.state;
        let lost = |x: &S| !x.value().is_finite();
        let moving = |body: &usize| lost(&state.q[*body]) || lost(&state.v[*body]);
        let body = (0..bodies).find(moving);
        match body.or_else(|| state.z.iter().position(lost).map(|_| 0)) {
            None => Ok(()),
            Some(body) => Err(SimulationError::Diverged {
                at: self.topology.place(body),
                time: self.time,
            }),
        }
    }

    /// A sample interval in `factor` times as many sub-steps as the rates ask for.
    fn integrate(
        &mut self,
        rate: (f64, usize),
        dt: f64,
        factor: usize,
    ) -> Result<usize, SimulationError> {
        if self.topology.shaped {
            return self.in_pieces(rate, dt, factor);
        }
        let count = factor * rate::substeps(&self.topology, rate, dt, &self.settings)?;
        let h = dt / count as f64;
        for substep in 0..count {
            let tau = S::constant(substep as f64 * h);
            self.work
                .advance(&self.topology, tau, h, h, &mut self.report);
        }
        Ok(count)
    }

    /// A sample interval of a linear rig. What is too stiff for sub-steps is refused all the same:
    /// a rig must not become simulable by losing its friction.
    fn exactly(&mut self, rate: (f64, usize), dt: f64) -> Result<usize, SimulationError> {
        rate::substeps(&self.topology, rate, dt, &self.settings)?;
        let work = &mut self.work;
        self.exact.advance(
            &self.topology,
            &work.dynamics,
            &work.input_signals,
            &mut work.state,
            (dt, rate.0),
        );
        Ok(1)
    }

    /// A sample interval, taken again in half the sub-steps until that changes little: by
    /// Richardson a fourth-order step errs by a fifteenth of the change.
    fn refine(
        &mut self,
        rate: (f64, usize),
        dt: f64,
        tolerance: f64,
    ) -> Result<usize, SimulationError> {
        let (state, supply, report) = (self.state(), self.supply.clone(), self.report);
        let rests = self.work.modes.friction.clone();
        let values = |state: &[S]| state.iter().map(|x| x.value()).collect::<Vec<f64>>();
        self.largest.resize(state.len(), 0.0);
        let mut factor = self.refinement;
        self.integrate(rate, dt, factor)?;
        let mut coarse = values(&self.state());
        loop {
            self.place(&state)?;
            self.work.modes.friction.clone_from(&rests);
            self.supply = supply.clone();
            self.report = report;
            factor *= 2;
            let count = self.integrate(rate, dt, factor)?;
            let fine = values(&self.state());
            let mut error = 0.0f64;
            for ((fine, coarse), largest) in fine.iter().zip(&coarse).zip(&mut self.largest) {
                *largest = largest.max(fine.abs());
                if *largest > 0.0 {
                    error = error.max((fine - coarse).abs() / (15.0 * *largest));
                }
            }
            if error <= tolerance || 2 * count > self.settings.max_substeps {
                // Begin the next interval as fine as this one had to be, or coarser.
                self.refinement = if error * 64.0 < tolerance {
                    factor / 4
                } else {
                    factor / 2
                };
                self.refinement = self.refinement.max(1);
                return Ok(count);
            }
            coarse = fine;
        }
    }

    /// A sample interval on which the inputs change their formulas: cut where they do. Returns how
    /// many sub-steps it took.
    fn in_pieces(
        &mut self,
        rate: (f64, usize),
        dt: f64,
        factor: usize,
    ) -> Result<usize, SimulationError> {
        let (mut cursor, mut count) = (S::ZERO, 0);
        self.supply
            .begin(&self.topology, &self.work.dynamics.values, self.time);
        loop {
            let work = &mut self.work;
            let values = &work.dynamics.values;
            let input_signals = &mut work.input_signals;
            let cut = self.supply.next_piece(
                &self.topology,
                values,
                self.time,
                cursor,
                dt,
                input_signals,
            );
            let end = cut.unwrap_or(S::constant(dt));
            let length = end - cursor;
            count += self.piece(rate, cursor, length, factor)?;
            let work = &self.work;
            let values = &work.dynamics.values;
            self.supply
                .arrive(&self.topology, values, self.time, end, &work.input_signals);
            if cut.is_none() {
                return Ok(count);
            }
            cursor = end;
            let most = self.settings.max_substeps;
            if count > most * factor {
                return Err(rate::too_stiff(&self.topology, rate, dt, most));
            }
        }
    }

    /// A part of a sample interval on which every input is one formula. Where a lag decays faster
    /// than the rig moves, sub-steps grow from its time constant on.
    fn piece(
        &mut self,
        rate: (f64, usize),
        cursor: S,
        length: S,
        factor: usize,
    ) -> Result<usize, SimulationError> {
        let whole = length.value();
        let settings = &self.settings;
        let count = factor * rate::substeps(&self.topology, rate, whole.max(0.0), settings)?;
        let step = whole / count as f64;
        let mut cuts = vec![S::ZERO];
        if let Some(time) = InputChain::unsettled(&self.work.input_signals) {
            // In units of the time constant, so that the cuts move with it.
            let mut at = 0.0;
            loop {
                let next = 0.2 * crate::math::exp(0.2 * at) / factor as f64;
                at += next;
                if next * time.value() >= step || at * time.value() >= whole {
                    break;
                }
                cuts.push(time * at);
            }
        }
        let graded = cuts[cuts.len() - 1];
        let left = length - graded;
        let rest = (left.value() / step).ceil().max(1.0) as usize;
        cuts.extend((1..=rest).map(|k| graded + left * (k as f64 / rest as f64)));
        for pair in cuts.windows(2) {
            let h = pair[1] - pair[0];
            self.work.advance(
                &self.topology,
                cursor + pair[0],
                h,
                h.value(),
                &mut self.report,
            );
        }
        Ok(cuts.len() - 1)
    }

    /// Looks at the rate here and keeps the largest so far, so that a stiffening spring is not
    /// taken for soft each time it passes its rest.
    pub(super) fn watch_rate(&mut self, ahead: f64) {
        let here = self.work.rate(&self.topology, ahead, false);
        if here.0 > self.rate.0 || here.0.is_nan() {
            self.rate = here;
        }
        self.report.rate = self.report.rate.max(self.rate.0);
    }
}
