//! Soft sensor: outputs that no sensor reads, computed from channels that are read
//! (docs/explanation/controller.md, section 11).

use crate::budget::Budget;
use crate::channel_watch::{LeftOut, Unwatched, Watch};
use crate::controller::{ControlLoop, Step};
use crate::cost::CostTerm;
use crate::limits::Limits;
use crate::predictive_loop::PredictiveLoop;
use crate::scaling::Scaling;
use crate::work_bound::{Parts, Work};

pub use crate::channel_watch::REACH;

/// Quadratic map from `NS` channels to `NY` outputs (docs/explanation/controller.md, eq. 21):
/// `y_r = c_r + sum_i z_i (a_ri + sum_{j >= i} b_rij z_j)`, z the channels in model units.
/// `NQ = NS (NS + 1) / 2` products, row by row: 11, 12, .., 1n, 22, ..
///
/// ```
/// use sinew_mpc::scaling::Scaling;
/// use sinew_mpc::soft_sensor::SoftSensor;
///
/// // A fibre's light, 0.2 to 1.0, and a tip that bends by 10 mm: y = 0.01 (z + 0.5 z^2).
/// let light = Scaling { span: [0.4], offset: [0.6] };
/// let tip = Scaling { span: [0.01], offset: [0.0] };
/// let sensor: SoftSensor<1, 1, 1> = SoftSensor {
///     channels: light,
///     outputs: tip,
///     bias: [0.0],
///     linear: [[1.0]],
///     quadratic: [[0.5]],
/// };
/// let [y] = sensor.outputs(&[1.0]);
/// assert!((y - 0.015).abs() < 1e-6);
/// // A broken fibre is no reading.
/// assert!(sensor.outputs(&[-3.0])[0].is_nan());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftSensor<const NS: usize, const NY: usize, const NQ: usize> {
    /// Scaling of the channels.
    pub channels: Scaling<NS>,
    /// Scaling of the outputs.
    pub outputs: Scaling<NY>,
    /// c, model units.
    pub bias: [f32; NY],
    /// A, a row an output.
    pub linear: [[f32; NS]; NY],
    /// B, the products of a row an output.
    pub quadratic: [[f32; NQ]; NY],
}

impl<const NS: usize, const NY: usize, const NQ: usize> SoftSensor<NS, NY, NQ> {
    /// Outputs in physical units, from channels in physical units; NaN where a channel is missing
    /// or further than [`REACH`] from its calibration. Cost: `NY (NQ + 2 NS)` multiply-adds.
    pub fn outputs(&self, channels: &[f32; NS]) -> [f32; NY] {
        self.said(&self.channels.to_model(channels))
    }

    /// As [`SoftSensor::outputs`], from channels in model units.
    fn said(&self, z: &[f32; NS]) -> [f32; NY] {
        const { assert!(NQ == NS * (NS + 1) / 2, "each product of two channels once") };
        let mut y = self.bias;
        for (y, (linear, quadratic)) in y.iter_mut().zip(self.linear.iter().zip(&self.quadratic)) {
            let mut products = quadratic.as_slice();
            for (i, (a, z_i)) in linear.iter().zip(z).enumerate() {
                let (row, rest) = products.split_at_checked(NS - i).unwrap_or_default();
                products = rest;
                let mut slope = *a;
                for (b, z_j) in row.iter().zip(z.iter().skip(i)) {
                    slope += b * z_j;
                }
                *y += slope * z_i;
            }
        }
        // A NaN is not within.
        if z.iter().all(|z| z.abs() <= REACH) {
            self.outputs.to_physical(&y)
        } else {
            [f32::NAN; NY]
        }
    }
}

/// A predictive controller behind a soft sensor: where an output is not measured, it takes what the
/// `NS` channels say. The controller within has `NI` channels, none or what its network remembers.
/// `W` judges the channels first: [`ChannelWatch`](crate::channel_watch::ChannelWatch), or nobody.
#[derive(Clone, Debug)]
pub struct SensedLoop<
    C,
    const NS: usize,
    const NY: usize,
    const NQ: usize,
    const NI: usize,
    const N: usize,
    W = Unwatched,
> {
    controller: C,
    sensor: &'static SoftSensor<NS, NY, NQ>,
    watch: W,
    /// This sample's channels have been judged.
    judged: bool,
}

impl<C, const NS: usize, const NY: usize, const NQ: usize, const NI: usize, const N: usize>
    SensedLoop<C, NS, NY, NQ, NI, N>
{
    /// `controller` behind `sensor`.
    pub const fn new(controller: C, sensor: &'static SoftSensor<NS, NY, NQ>) -> Self {
        Self::watched(controller, sensor, Unwatched)
    }
}

impl<C, const NS: usize, const NY: usize, const NQ: usize, const NI: usize, const N: usize, W>
    SensedLoop<C, NS, NY, NQ, NI, N, W>
{
    /// `controller` behind `sensor`, whose channels `watch` judges.
    pub const fn watched(controller: C, sensor: &'static SoftSensor<NS, NY, NQ>, watch: W) -> Self {
        Self {
            controller,
            sensor,
            watch,
            judged: false,
        }
    }

    /// The judge of the channels.
    pub const fn watch(&self) -> &W {
        &self.watch
    }

    /// The soft sensor.
    pub const fn sensor(&self) -> &SoftSensor<NS, NY, NQ> {
        self.sensor
    }

    /// The controller within.
    pub const fn controller(&self) -> &C {
        &self.controller
    }

    /// One control step, as [`PredictiveLoop::step`].
    #[inline(always)]
    pub fn step<const NU: usize>(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        reference: &[[f32; NY]; N],
    ) -> Step<NU>
    where
        C: PredictiveLoop<NU, NY, NI, N>,
        W: Watch<NS>,
    {
        PredictiveLoop::step(self, y, s, reference)
    }
}

impl<
    M: CostTerm<NU, NY, NI, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const NQ: usize,
    const NI: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
    const P: usize,
    W,
> SensedLoop<ControlLoop<M, NU, NY, NI, ND, DD, N, NB, NV, P>, NS, NY, NQ, NI, P, W>
{
    /// Planned commands of the last step, as [`ControlLoop::plan`].
    pub const fn plan(&self) -> &[f32; NV] {
        self.controller.plan()
    }
}

impl<
    C: PredictiveLoop<NU, NY, NI, N>,
    const NU: usize,
    const NS: usize,
    const NY: usize,
    const NQ: usize,
    const NI: usize,
    const N: usize,
    W: Watch<NS>,
> PredictiveLoop<NU, NY, NS, N> for SensedLoop<C, NS, NY, NQ, NI, N, W>
{
    const HIDDEN_CHANNELS: bool = false;
    const POINT: usize = C::POINT;
    const DERIVATIVES: usize = C::DERIVATIVES;
    const SENSED: bool = true;
    const WATCHES: bool = W::WATCHES;
    const PARAMETERS: usize = C::PARAMETERS;

    /// Channels are judged once a sample, also where every output is measured.
    fn outputs(&mut self, y: &[f32; NY], s: &[f32; NS]) -> [f32; NY] {
        let all = y.iter().all(|y| !y.is_nan());
        if self.judged || (all && !W::WATCHES) {
            return *y;
        }
        let mut z = self.sensor.channels.to_model(s);
        self.watch.judge(&mut z);
        self.judged = W::WATCHES;
        if all {
            return *y;
        }
        let mut known = *y;
        for (known, sensed) in known.iter_mut().zip(self.sensor.said(&z)) {
            if known.is_nan() {
                *known = sensed;
            }
        }
        known
    }

    #[inline(always)]
    fn left_out(&self) -> LeftOut {
        self.watch.left_out()
    }

    #[inline(always)]
    fn parameter(&self, i: usize) -> (f32, f32) {
        self.controller.parameter(i)
    }

    #[inline(always)]
    fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; N]) -> Step<NU> {
        let y = self.once(y, s);
        self.controller.step(&y, &[f32::NAN; NI], reference)
    }

    #[inline(always)]
    fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU> {
        let y = self.once(y, s);
        self.controller.open_loop(&y, &[f32::NAN; NI], unsaturated)
    }

    #[inline(always)]
    fn missed(&self) -> u32 {
        self.controller.missed()
    }

    #[inline(always)]
    fn max_missing_samples(&self) -> u16 {
        self.controller.max_missing_samples()
    }

    #[inline(always)]
    fn to_model(&self, y: &[f32; NY], u: &[f32; NU]) -> ([f32; NY], [f32; NU]) {
        self.controller.to_model(y, u)
    }

    #[inline(always)]
    fn to_physical(&self, y: &[f32; NY], s: &[f32; NS]) -> ([f32; NY], [f32; NS]) {
        let (y, _) = self.controller.to_physical(y, &[0.0; NI]);
        (y, self.sensor.channels.to_physical(s))
    }

    #[inline(always)]
    fn limits(&self) -> &Limits<NU> {
        self.controller.limits()
    }

    #[inline(always)]
    fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        self.controller.set_limits(limits, widest)
    }

    #[inline(always)]
    fn applied(&self) -> &[f32; NU] {
        self.controller.applied()
    }

    #[inline(always)]
    fn tune(
        &mut self,
        tracking_weight: [f32; NY],
        move_suppression: [f32; NU],
        disturbance_gain: f32,
        iterations: u8,
    ) -> bool {
        self.controller.tune(
            tracking_weight,
            move_suppression,
            disturbance_gain,
            iterations,
        )
    }

    #[inline(always)]
    fn reset(&mut self) {
        self.watch.reset();
        self.controller.reset();
    }

    #[inline(always)]
    fn emergency_stop(&mut self) {
        self.controller.emergency_stop();
    }

    #[inline(always)]
    fn estimate(&self) -> [f32; NY] {
        self.controller.estimate()
    }

    #[inline(always)]
    fn disturbance(&self) -> &[f32] {
        self.controller.disturbance()
    }

    #[inline(always)]
    fn probe(
        &self,
        point: &[f32],
        prediction: &mut impl FnMut(f32),
        derivative: &mut impl FnMut(f32),
    ) -> bool {
        self.controller.probe(point, prediction, derivative)
    }

    #[inline(always)]
    fn parts(&self, draw: &mut impl FnMut() -> f32, ticks: impl Fn() -> u32) -> Parts {
        self.controller.parts(draw, ticks)
    }

    #[inline(always)]
    fn most_work(&self) -> Work {
        self.controller.most_work()
    }

    #[inline(always)]
    fn budget(&self) -> Option<Budget> {
        self.controller.budget()
    }
}

impl<C, const NS: usize, const NY: usize, const NQ: usize, const NI: usize, const N: usize, W>
    SensedLoop<C, NS, NY, NQ, NI, N, W>
where
    W: Watch<NS>,
{
    /// Outputs of this sample; where they were asked for before the step, they have been judged.
    #[inline(always)]
    fn once<const NU: usize>(&mut self, y: &[f32; NY], s: &[f32; NS]) -> [f32; NY]
    where
        C: PredictiveLoop<NU, NY, NI, N>,
    {
        let known = PredictiveLoop::<NU, NY, NS, N>::outputs(self, y, s);
        self.judged = false;
        known
    }
}
