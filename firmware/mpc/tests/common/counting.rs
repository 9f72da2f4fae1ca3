//! A network that counts what is asked of it.

use std::cell::Cell;

use sinew_mpc::Tuning;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::sensitivity::Propagate;

use super::Shallow;

const NU: usize = 2;
const NY: usize = 3;

/// Counts predictions and derivatives, each of one step.
pub struct Counting<'a> {
    pub net: Shallow<12, 6, NY>,
    pub predictions: &'a Cell<u32>,
    pub derivatives: &'a Cell<u32>,
}

impl Model<NU, NY, 0, 3, 2> for Counting<'_> {
    type Trace = [f32; 6];
    const TRACE: [f32; 6] = [0.0; 6];

    fn predict(&self, x: &Regressor<NU, NY, 0, 3, 2>, a: &mut [f32; 6]) -> [f32; NY] {
        self.predictions.set(self.predictions.get() + 1);
        self.net.predict(x, a)
    }

    fn jacobian(&self, a: &[f32; 6], jacobian: &mut Jacobian<NU, NY, 3, 2>) {
        self.derivatives.set(self.derivatives.get() + 1);
        Model::<NU, NY, 0, 3, 2>::jacobian(&self.net, a, jacobian);
    }
}

impl Propagate<NU, NY, 0, 3, 2> for Counting<'_> {}
impl Tuning for Counting<'_> {}
