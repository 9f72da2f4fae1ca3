//! One control period of a plant with its derivatives (docs/explanation/imitation.md, eq. 5).

use sinew_sim::{Dual, Plant, Scalar, Simulated, SimulationError, Stepper};

/// End of a period: next state and outputs, and the derivatives of both, a row each, by the state
/// and the inputs before.
pub(crate) struct Period {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub slopes: Vec<f64>,
}

/// Most states and inputs together of which the simulator carries derivatives.
pub(crate) const MOST: usize = 24;

/// A plant that is stepped with derivatives.
pub(crate) enum Linearised {
    Four(Stepper<Dual<4>>),
    Eight(Stepper<Dual<8>>),
    Sixteen(Stepper<Dual<16>>),
    Most(Stepper<Dual<MOST>>),
}

type Result<T> = std::result::Result<T, SimulationError>;

fn begin<const N: usize>(plant: &Plant, values: &[f64], x: &[f64]) -> Result<Stepper<Dual<N>>>
where
    Dual<N>: Simulated,
{
    let constants =
        |all: &[f64]| -> Vec<Dual<N>> { all.iter().map(|v| Dual::constant(*v)).collect() };
    Stepper::new(plant, &constants(values), &constants(x))
}

fn advance<const N: usize>(
    plant: &mut Stepper<Dual<N>>,
    (x, u): (&[f64], &[f64]),
    seconds: f64,
    outputs: &[usize],
) -> Result<Period>
where
    Dual<N>: Simulated,
{
    let seeded = |values: &[f64], first: usize| -> Vec<Dual<N>> {
        let each = values.iter().enumerate();
        each.map(|(i, v)| Dual::variable(*v, first + i)).collect()
    };
    plant.set_state(&seeded(x, 0))?;
    plant.advance(seconds, &seeded(u, x.len()))?;
    let next = plant.state();
    let y: Vec<Dual<N>> = outputs.iter().map(|s| plant.signal(*s)).collect();
    let width = x.len() + u.len();
    let rows = next.iter().chain(&y);
    Ok(Period {
        slopes: rows
            .flat_map(|row| &row.derivative[..width])
            .copied()
            .collect(),
        x: next.iter().map(|x| x.value).collect(),
        y: y.iter().map(|y| y.value).collect(),
    })
}

impl Linearised {
    /// A plant at state `x`.
    pub(crate) fn new(plant: &Plant, values: &[f64], x: &[f64]) -> Result<Self> {
        Ok(match x.len() + plant.inputs().len() {
            0..=4 => Self::Four(begin(plant, values, x)?),
            5..=8 => Self::Eight(begin(plant, values, x)?),
            9..=16 => Self::Sixteen(begin(plant, values, x)?),
            _ => Self::Most(begin(plant, values, x)?),
        })
    }

    /// A period from state `x` under inputs `u`.
    pub(crate) fn advance(
        &mut self,
        x: &[f64],
        u: &[f64],
        seconds: f64,
        outputs: &[usize],
    ) -> Result<Period> {
        match self {
            Self::Four(plant) => advance(plant, (x, u), seconds, outputs),
            Self::Eight(plant) => advance(plant, (x, u), seconds, outputs),
            Self::Sixteen(plant) => advance(plant, (x, u), seconds, outputs),
            Self::Most(plant) => advance(plant, (x, u), seconds, outputs),
        }
    }
}
