//! The reference problem's plant and reference: what closes the loop around model S. The plant is
//! given by its equations, not by the network that predicts it, and shares nothing with `sim`.

/// Control periods per second.
pub const RATE_HZ: f64 = 120.0;
/// Control steps of the closed-loop run.
pub const STEPS: usize = 590;
/// Outputs.
pub const OUTPUTS: usize = 3;
/// Inputs.
pub const INPUTS: usize = 2;
/// Box limit on both inputs: |u| <= 0.9.
pub const INPUT_LIMIT: f32 = 0.9;
/// Rate limit on both inputs, per step.
pub const RATE_LIMIT: f32 = 0.06;

/// Runge-Kutta steps in one control period.
const SUBSTEPS: usize = 4;

/// Two coupled hinges, x = (th1, th2, w1, w2); all signals scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plant {
    x: [f64; 4],
}

impl Plant {
    /// y1 = th1, y2 = th2, y3 = 0.6 sin(th1 + 0.7 th2) + 0.25 th1 th2.
    pub fn outputs(&self) -> [f64; OUTPUTS] {
        let [th1, th2, ..] = self.x;
        [th1, th2, 0.6 * (th1 + 0.7 * th2).sin() + 0.25 * th1 * th2]
    }

    /// Stretch channels of network P: g = linspace(0.2, 1, n), s = g th1 + (1.2 - g) th2, each
    /// s / (1 + 0.3 |s|) + 0.05 s^2.
    pub fn channels(&self, n: usize) -> Vec<f64> {
        let [th1, th2, ..] = self.x;
        let last = n.saturating_sub(1).max(1) as f64;
        let stretch = (0..n).map(|i| {
            let g = 0.2 + 0.8 * i as f64 / last;
            g * th1 + (1.2 - g) * th2
        });
        stretch
            .map(|s| s / (1.0 + 0.3 * s.abs()) + 0.05 * s * s)
            .collect()
    }

    /// One control period with the input held, by the classical fourth-order Runge-Kutta method.
    pub fn advance(&mut self, u: [f64; INPUTS]) {
        let h = 1.0 / (RATE_HZ * SUBSTEPS as f64);
        let along = |x: [f64; 4], d: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * d[i]);
        for _ in 0..SUBSTEPS {
            let k1 = derivative(self.x, u);
            let k2 = derivative(along(self.x, k1, h / 2.0), u);
            let k3 = derivative(along(self.x, k2, h / 2.0), u);
            let k4 = derivative(along(self.x, k3, h), u);
            let mean = std::array::from_fn(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0);
            self.x = along(self.x, mean, h);
        }
    }
}

/// th' = w,
/// w1' = 540 tanh(1.3 u1) - 405 th1 - 270 th1^3 - 20 w1 + 110 (th2 - th1),
/// w2' = 675 tanh(1.1 u2) - 540 th2 - 360 th2^3 - 24 w2 + 135 (th1 - th2) - 54 sin(th1 + th2).
fn derivative([th1, th2, w1, w2]: [f64; 4], [u1, u2]: [f64; INPUTS]) -> [f64; 4] {
    [
        w1,
        w2,
        540.0 * (1.3 * u1).tanh() - 405.0 * th1 - 270.0 * th1.powi(3) - 20.0 * w1
            + 110.0 * (th2 - th1),
        675.0 * (1.1 * u2).tanh() - 540.0 * th2 - 360.0 * th2.powi(3) - 24.0 * w2
            + 135.0 * (th1 - th2)
            - 54.0 * (th1 + th2).sin(),
    ]
}

/// The reference trajectory: row k is r(k).
pub struct Reference {
    rows: Vec<[f32; OUTPUTS]>,
}

impl Reference {
    /// Reads `models/reference/reference.csv` (columns t, r1, r2, r3), compiled into the test.
    ///
    /// # Errors
    /// The line that is not four numbers.
    pub fn load() -> Result<Self, String> {
        let text = include_str!("../../models/reference/reference.csv");
        let rows = text.lines().skip(1).map(|line| {
            let mut fields = line.split(',').skip(1).map(str::parse);
            match (fields.next(), fields.next(), fields.next()) {
                (Some(Ok(a)), Some(Ok(b)), Some(Ok(c))) => Ok([a, b, c]),
                _ => Err(format!("reference.csv: not four numbers: {line}")),
            }
        });
        Ok(Self {
            rows: rows.collect::<Result<_, _>>()?,
        })
    }

    /// Preview of the controller at step k: rows k+1 .. k+horizon, the last row held.
    pub fn preview(&self, k: usize, horizon: usize) -> Vec<[f32; OUTPUTS]> {
        let last = self.rows.len() - 1;
        (1..=horizon)
            .map(|j| self.rows[(k + j).min(last)])
            .collect()
    }

    /// r(k), the last row held.
    pub fn at(&self, k: usize) -> [f32; OUTPUTS] {
        self.rows[k.min(self.rows.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resting_plant_rests_and_a_pushed_one_settles() {
        let mut plant = Plant::default();
        plant.advance([0.0, 0.0]);
        assert_eq!(plant, Plant::default());

        for _ in 0..600 {
            plant.advance([0.5, -0.3]);
        }
        let x = plant.x;
        assert!(x[0] > 0.1 && x[1] < -0.05, "nothing moved: {x:?}");
        let rest = derivative(x, [0.5, -0.3]);
        assert!(
            rest.iter().all(|rate| rate.abs() < 1e-3),
            "no equilibrium: {rest:?}"
        );
    }

    #[test]
    fn the_preview_starts_one_step_ahead_and_holds_the_last_row() {
        let reference = Reference::load().expect("the file is compiled in");
        assert_eq!(reference.preview(0, 2), [reference.at(1), reference.at(2)]);
        assert_eq!(
            reference.preview(598, 4),
            [
                reference.at(599),
                reference.at(600),
                reference.at(600),
                reference.at(600)
            ]
        );
        assert_ne!(reference.at(1), reference.at(600));
    }
}
