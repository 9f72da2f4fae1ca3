//! The trained form of a state-space model: its derivatives against differences in double
//! precision.

use sinew_mpc::filter::{MeasurementJacobian, StateSpace, TransitionJacobian};
use sinew_mpc::network::state::StateNetwork;

use crate::common::Random;

const NX: usize = 3;
const NU: usize = 2;
const NM: usize = 2;
const NP: usize = 2;
const NZ: usize = 7;
const H: usize = 5;

fn network(random: &mut Random) -> StateNetwork<NX, NU, NM, NP, NZ, H> {
    StateNetwork {
        linear: random.matrix(0.5),
        bias: random.array(0.2),
        hidden: random.matrix(1.0),
        hidden_bias: random.array(0.5),
        output: random.matrix(0.7),
        measurement: random.matrix(1.0),
        measurement_bias: random.array(0.3),
    }
}

/// Equation 20 in double precision.
fn exact(net: &StateNetwork<NX, NU, NM, NP, NZ, H>, z: &[f64; NZ]) -> [f64; NX] {
    let dot = |row: &[f32; NZ]| -> f64 { row.iter().zip(z).map(|(a, z)| f64::from(*a) * z).sum() };
    let hidden: [f64; H] =
        core::array::from_fn(|h| f64::tanh(dot(&net.hidden[h]) + f64::from(net.hidden_bias[h])));
    core::array::from_fn(|i| {
        let units = net.output[i].iter().zip(&hidden);
        let sum: f64 = units.map(|(g, unit)| f64::from(*g) * unit).sum();
        z[i] + dot(&net.linear[i]) + f64::from(net.bias[i]) + sum
    })
}

#[test]
fn values_and_derivatives_are_those_of_the_equation() {
    let mut random = Random(12);
    for _ in 0..200 {
        let net = network(&mut random);
        let (x, u, theta) = (random.array(1.0), random.array(1.0), random.array(1.0));
        let mut trace = [0.0; H];
        let next = net.transition(&x, &u, &theta, &mut trace);
        let mut jacobian = TransitionJacobian::ZERO;
        net.transition_jacobian(&trace, &mut jacobian);
        let mut z = [0.0; NZ];
        for (place, value) in z.iter_mut().zip(x.iter().chain(&u).chain(&theta)) {
            *place = f64::from(*value);
        }
        for (a, b) in next.iter().zip(&exact(&net, &z)) {
            assert!((f64::from(*a) - b).abs() < 2e-5, "{a} {b}");
        }
        for column in 0..NZ {
            let (mut above, mut below) = (z, z);
            above[column] += 1e-5;
            below[column] -= 1e-5;
            let (above, below) = (exact(&net, &above), exact(&net, &below));
            for row in 0..NX {
                let slope = (above[row] - below[row]) / 2e-5;
                let printed = if column < NX {
                    jacobian.x[row][column]
                } else if column < NX + NU {
                    jacobian.u[row][column - NX]
                } else {
                    jacobian.theta[row][column - NX - NU]
                };
                assert!((f64::from(printed) - slope).abs() < 3e-5, "{row} {column}");
            }
        }
        let mut of_m = MeasurementJacobian::ZERO;
        net.measurement_jacobian(&x, &theta, &mut of_m);
        let m = net.measure(&x, &theta);
        for (r, m) in m.iter().enumerate() {
            let row = of_m.x[r].iter().zip(&x);
            let sum = net.measurement_bias[r] + row.map(|(c, x)| c * x).sum::<f32>();
            assert!((m - sum).abs() < 1e-5);
        }
    }
}
