//! Adam (Kingma and Ba 2015).

const BETA: (f64, f64) = (0.9, 0.99);
const TINY: f64 = 1e-9;

/// State of the optimiser.
pub(crate) struct Adam {
    mean: Vec<f64>,
    square: Vec<f64>,
    steps: i32,
}

impl Adam {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            mean: vec![0.0; count],
            square: vec![0.0; count],
            steps: 0,
        }
    }

    /// Moves the weights against the gradient.
    pub(crate) fn step(&mut self, weights: &mut [f64], gradient: &[f64], rate: f64) {
        self.steps += 1;
        let corrected = (1.0 - BETA.0.powi(self.steps), 1.0 - BETA.1.powi(self.steps));
        for (i, weight) in weights.iter_mut().enumerate() {
            let g = gradient[i];
            self.mean[i] += (1.0 - BETA.0) * (g - self.mean[i]);
            self.square[i] += (1.0 - BETA.1) * (g * g - self.square[i]);
            let mean = self.mean[i] / corrected.0;
            *weight -= rate * mean / ((self.square[i] / corrected.1).sqrt() + TINY);
        }
    }
}
