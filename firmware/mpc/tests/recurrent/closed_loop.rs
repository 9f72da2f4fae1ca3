//! Loops around predictors with memory: no steady error, gaps, and channels that are predicted or
//! held.

use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::sensitivity::Propagate;

use sinew_mpc::Horizons;
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{ChannelJacobian, Jacobian, Model, Regressor};
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::status::Status;

use crate::cells::{GruNet, LstmNet};
use crate::common::Random;
use crate::exact::Exact;

type Loop<M, const NS: usize> = ControlLoop<M, 1, 1, NS, 1, 1, 8, 3, 3>;

const LIMITS: Limits<1> = Limits {
    lower: [-1.0],
    upper: [1.0],
    rate: [0.3],
    safe: [0.0],
};

fn control<M: Propagate<1, 1, NS, 1, 1>, const NS: usize>(model: M) -> Loop<M, NS> {
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.01],
        disturbance_gain: 0.5,
        iterations: 2,
        max_missing_samples: 5,
    };
    let horizons = Horizons::new(1, [1, 2, 3]);
    ControlLoop::new(model, ModelScaling::IDENTITY, LIMITS, settings, horizons)
}

/// A plant of the predictor's kind in double precision, its input 20 % weaker and under a constant
/// load.
struct Plant<M, const NS: usize> {
    model: M,
    y: [f64; 1],
    s: [f64; NS],
}

const GAIN: f64 = 0.8;
const LOAD: f64 = 0.05;

impl<M: Exact<1, NS>, const NS: usize> Plant<M, NS> {
    fn at_rest(model: M) -> Self {
        Self {
            model,
            y: [0.0],
            s: [0.0; NS],
        }
    }

    fn advance(&mut self, u: f64) -> f64 {
        let (y, s) = self.model.exact(&[GAIN * u, self.y[0]], &self.s);
        (self.y, self.s) = ([y[0] + LOAD], s);
        self.y[0]
    }
}

/// Largest error of the last 50 samples at a level that the plant reaches, as a part of the plant's
/// range, over all plants with enough gain. A sample in twenty is lost on the way there.
fn steady_error<M, const NS: usize>(seed: u64) -> f64
where
    M: Exact<1, NS> + Propagate<1, 1, NS, 1, 1>,
{
    let (mut worst, mut plants, mut predicted) = (0.0_f64, 0, 0);
    for case in 0..150 {
        let model = || M::random(&mut Random(seed + 7919 * case));
        let level_after = |first: f64, u: f64| {
            let mut plant = Plant::at_rest(model());
            let commands = (0..800).map(|k| if k < 400 { first } else { u });
            commands.map(|u| plant.advance(u)).last().unwrap_or(0.0)
        };
        let level = |u: f64| level_after(u, u);
        let (low, middle, high) = (level(-0.6), level(0.3), level(0.6));
        let range = (high - low).abs();
        // A plant with two places to rest may stay at the other one, whoever controls it.
        let places = (level_after(-0.6, 0.3) - level_after(0.6, 0.3)).abs();
        if range < 0.2 || (level(0.35) - middle).abs() < 0.01 || places > 1e-6 {
            continue;
        }
        plants += 1;
        let mut loop_ = control(model());
        let mut plant = Plant::at_rest(model());
        let mut y = plant.y[0];
        for k in 0..400 {
            let measured = if k % 20 == 13 && k < 300 {
                f32::NAN
            } else {
                y as f32
            };
            let step = loop_.step(&[measured], &[f32::NAN; NS], &[[middle as f32]; 8]);
            predicted += u32::from(step.predicted);
            assert!(LIMITS.contain(&step.u));
            y = plant.advance(f64::from(step.u[0]));
            if k >= 350 {
                worst = worst.max((y - middle).abs() / range);
            }
        }
    }
    assert!(
        plants >= 10 && predicted >= 10 * plants,
        "{plants} {predicted}"
    );
    println!("{plants} plants, largest steady error {worst:.1e}");
    worst
}

#[test]
fn a_gru_leaves_no_steady_error_under_load_and_gain_error() {
    assert!(steady_error::<GruNet<2, 5, 1>, 5>(61) < 1e-3);
}

#[test]
fn an_lstm_leaves_no_steady_error_under_load_and_gain_error() {
    assert!(steady_error::<LstmNet<2, 4, 1>, 8>(62) < 1e-3);
}

/// s(k+1) = 0.5 s + 0.5 u, y(k+1) = 0.8 y + 0.2 s: the command acts through the channel alone.
struct ThroughAChannel<const PREDICTED: bool>;

impl<const PREDICTED: bool> Model<1, 1, 1, 1, 1> for ThroughAChannel<PREDICTED> {
    type Trace = ();
    const TRACE: () = ();
    const PREDICTS_CHANNELS: bool = PREDICTED;

    fn predict(&self, x: &Regressor<1, 1, 1, 1, 1>, (): &mut ()) -> [f32; 1] {
        [0.8 * x.y[0][0] + 0.2 * x.s[0]]
    }

    fn jacobian(&self, (): &(), jacobian: &mut Jacobian<1, 1, 1, 1>) {
        jacobian.u = [[[0.0]]];
        jacobian.y = [[[0.8]]];
    }

    fn channels(&self, x: &Regressor<1, 1, 1, 1, 1>, (): &()) -> [f32; 1] {
        [0.5 * x.s[0] + 0.5 * x.u[0][0]]
    }

    fn channel_jacobian(&self, (): &(), jacobian: &mut ChannelJacobian<1, 1, 1, 1, 1>) {
        jacobian.y_by_s = [[0.2]];
        jacobian.u = [[[0.5]]];
        jacobian.s = [[0.5]];
    }
}

impl<const PREDICTED: bool> Propagate<1, 1, 1, 1, 1> for ThroughAChannel<PREDICTED> {}
impl<const PREDICTED: bool> sinew_mpc::Tuning for ThroughAChannel<PREDICTED> {}

fn run<const PREDICTED: bool>(measured: bool) -> (f32, Status) {
    let mut loop_: Loop<_, 1> = control(ThroughAChannel::<PREDICTED>);
    let (mut y, mut s) = (0.0, 0.0);
    let mut status = Status::SignalLost;
    for _ in 0..100 {
        let reading = if measured { s } else { f32::NAN };
        let step = loop_.step(&[y], &[reading], &[[0.4]; 8]);
        status = step.status;
        (y, s) = (0.8 * y + 0.2 * s, 0.5 * s + 0.5 * step.u[0]);
    }
    (y, status)
}

#[test]
fn a_command_that_acts_through_a_channel_is_found_where_the_channel_is_predicted() {
    for measured in [true, false] {
        let (y, status) = run::<true>(measured);
        assert!((y - 0.4).abs() < 1e-3, "{y}");
        assert!(status.is_controlled());
    }
    let (held, _) = run::<false>(true);
    assert!(
        held.abs() < 1e-3,
        "a held channel hides the command: {held}"
    );
}
