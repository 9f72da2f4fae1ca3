//! A force without a name: what a diagnosis learns where no law of the vocabulary fits
//! (docs/explanation/plant.md, eq. 12d).

use super::{
    At, Description, Effect, Energy, Explanation, Family, ParameterSpec, Port, Quantity, Scales,
    Sign, Slopes, parameter, place, strength,
};
use crate::scalar::Scalar;

/// Knots of the spring over the position, evenly.
pub(super) const SPRING: usize = 9;
/// Knots of the damping over the position, evenly.
const PLACES: usize = 5;
/// Knots of the damping over the speed, as parts of the largest: close together where friction
/// changes.
const SPEEDS: [f64; 5] = [0.0, 0.125, 0.25, 0.5, 1.0];
/// Parameters before the knots: middle, reach, speed.
const FRAME: usize = 3;

/// A spring and a damping in knots, straight between them and level beyond: `F = -s(x) - d(x, |v|)
/// v`.
///
/// A spring that depends on the position alone has a potential, and a damping that is nowhere below
/// zero takes energy out: whatever was learned, it cannot drive the rig.
pub(super) struct Learned;

impl Effect for Learned {
    const DESCRIPTION: Description = Description {
        kind: "learned_residual",
        family: Family::Learned,
        ports: &[Port::Body, Port::Spring],
        energy: Energy::Conserves,
        law: "F = -s(x) - d(x, |v|) v, s and d >= 0 straight between knots",
        equation: "12d",
        parameters: &[
            held(place("middle", Quantity::Coordinate, Sign::Any)),
            held(parameter("reach", Quantity::Coordinate, Sign::Positive)),
            held(parameter("speed", Quantity::Velocity, Sign::Positive)),
            spring("spring_1"),
            spring("spring_2"),
            spring("spring_3"),
            spring("spring_4"),
            spring("spring_5"),
            spring("spring_6"),
            spring("spring_7"),
            spring("spring_8"),
            spring("spring_9"),
            damping("damping_1_1"),
            damping("damping_1_2"),
            damping("damping_1_3"),
            damping("damping_1_4"),
            damping("damping_1_5"),
            damping("damping_2_1"),
            damping("damping_2_2"),
            damping("damping_2_3"),
            damping("damping_2_4"),
            damping("damping_2_5"),
            damping("damping_3_1"),
            damping("damping_3_2"),
            damping("damping_3_3"),
            damping("damping_3_4"),
            damping("damping_3_5"),
            damping("damping_4_1"),
            damping("damping_4_2"),
            damping("damping_4_3"),
            damping("damping_4_4"),
            damping("damping_4_5"),
            damping("damping_5_1"),
            damping("damping_5_2"),
            damping("damping_5_3"),
            damping("damping_5_4"),
            damping("damping_5_5"),
        ],
        confusable: &[],
        excited_by: "all positions at all speeds",
        sentence: "A force without a name stands in at {component}.",
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A force without a name. It stands in where no effect of the vocabulary explains \
                the recordings, as a spring and a damping between knots.",
        parameters: &[
            ("middle", "middle of the range of positions"),
            ("reach", "half of that range"),
            ("speed", "largest speed of the knots"),
            ("spring_*", "force of the spring at a knot of the position"),
            (
                "damping_*",
                "damping at a knot of position and speed, zero or more",
            ),
        ],
        next: "Use it inside the recorded range only. Look at the plots of --report for the \
               quantity that the force follows, and record the experiment that the diagnosis \
               proposes.",
    };

    /// No force at all, over the range that is met.
    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let (low, high) = scales.range;
        let mut start = vec![0.0; Self::DESCRIPTION.parameters.len()];
        start[..FRAME].copy_from_slice(&[
            0.5 * (low + high),
            0.5 * (high - low),
            3.0 * scales.velocity,
        ]);
        vec![start]
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        let across = (at.position - p[0]) / p[1];
        let fast = at.velocity.abs() / p[2];
        let (springs, dampings) = p[FRAME..].split_at(SPRING);
        let spring = Between::even(across, SPRING).of(|knot| springs[knot]);
        let (place, speed) = (Between::even(across, PLACES), Between::speeds(fast));
        let damping = place.of(|x| speed.of(|v| dampings[x * SPEEDS.len() + v]));
        -(spring + damping * at.velocity)
    }

    fn slopes(p: &[f64], at: &At<f64>) -> Slopes {
        let (springs, dampings) = p[FRAME..].split_at(SPRING);
        let steepest = springs.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let steepest = steepest.fold(0.0, f64::max) * (SPRING - 1) as f64;
        let largest = dampings.iter().copied().fold(0.0, f64::max);
        let fast = at.velocity.abs().max(p[2]);
        Slopes {
            stiffness: (steepest + largest * fast * (PLACES - 1) as f64) / (2.0 * p[1]),
            // Between two knots v is at most twice their distance, hence d + v d' at most three
            // times the largest.
            damping: 3.0 * largest,
        }
    }
}

/// The force of [`super::Kind::Learned`] without a plant; `p` in the order of its description, SI.
/// Linear in every parameter after the third.
pub fn learned_force(p: &[f64], position: f64, velocity: f64) -> f64 {
    let at = At {
        position,
        velocity,
        direction: 0.0,
        motion: super::Motion::Slide,
    };
    Learned::force(p, &at)
}

const fn held(spec: ParameterSpec) -> ParameterSpec {
    ParameterSpec {
        held: true,
        zero_means_absent: false,
        ..spec
    }
}

const fn spring(name: &'static str) -> ParameterSpec {
    strength(name, Quantity::Force, Sign::Any)
}

const fn damping(name: &'static str) -> ParameterSpec {
    strength(name, Quantity::Damping, Sign::NonNegative)
}

/// A place between two knots.
struct Between<S> {
    knot: usize,
    share: S,
}

impl<S: Scalar> Between<S> {
    /// From -1 to 1 in even steps.
    #[inline]
    fn even(across: S, knots: usize) -> Self {
        let last = (knots - 1) as f64;
        Self::knots(
            (across + S::constant(1.0)) * (0.5 * last),
            last,
            |place| place as usize,
            |knot| [knot as f64, 1.0],
        )
    }

    #[inline]
    fn speeds(fast: S) -> Self {
        let knot = |place: f64| {
            SPEEDS[1..]
                .iter()
                .take_while(|&&knot| knot <= place)
                .count()
        };
        Self::knots(fast, 1.0, knot, |knot| {
            [SPEEDS[knot], SPEEDS[knot + 1] - SPEEDS[knot]]
        })
    }

    /// `knot` says before which a place lies, `cell` where that one is and how far the next; level
    /// beyond 0 and `end`.
    #[inline]
    fn knots(
        place: S,
        end: f64,
        knot: impl Fn(f64) -> usize,
        cell: impl Fn(usize) -> [f64; 2],
    ) -> Self {
        let x = place.value();
        // What is not a number is level too.
        if !(x > 0.0 && x < end) {
            let knot = if x >= end { knot(end) } else { 0 };
            return Self {
                knot,
                share: S::ZERO,
            };
        }
        let knot = knot(x);
        let [from, width] = cell(knot);
        Self {
            knot,
            share: (place - from) / width,
        }
    }

    #[inline]
    fn of(&self, at: impl Fn(usize) -> S) -> S {
        let here = at(self.knot);
        if self.share.value() == 0.0 {
            return here;
        }
        here + self.share * (at(self.knot + 1) - here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;
    use crate::unit::Motion;

    fn at<S: Scalar>(position: S, velocity: S) -> At<S> {
        At {
            position,
            velocity,
            direction: 0.0,
            motion: Motion::Slide,
        }
    }

    /// Middle 0.5, reach 2, speed 4: -1.5 to 2.5 m, up to 4 m/s; every knot another number.
    fn numbers() -> Vec<f64> {
        let knots = (0..SPRING).map(|k| 0.3 * (k as f64 - 3.0) * (k as f64));
        let dampings = (0..PLACES * SPEEDS.len()).map(|k| 0.1 + (0.7 * k as f64).sin().abs());
        [0.5, 2.0, 4.0]
            .into_iter()
            .chain(knots)
            .chain(dampings)
            .collect()
    }

    #[test]
    fn it_is_its_knots_at_them_straight_between_and_level_beyond() {
        let p = numbers();
        let force = |x: f64, v: f64| Learned::force(&p, &at(x, v));
        for k in 0..SPRING {
            assert!((force(-1.5 + 0.5 * k as f64, 0.0) + p[FRAME + k]).abs() < 1e-12);
        }
        assert!((force(-1.25, 0.0) + 0.5 * (p[FRAME] + p[FRAME + 1])).abs() < 1e-12);
        assert_eq!(force(-9.0, 0.0), -p[FRAME]);
        assert_eq!(force(9.0, 0.0), -p[FRAME + SPRING - 1]);
        // The third place, halfway between the third and the fourth speed.
        let damping = &p[FRAME + SPRING..];
        let between = 0.5 * (damping[2 * 5 + 2] + damping[2 * 5 + 3]);
        assert!((force(0.5, 1.5) - force(0.5, 0.0) + between * 1.5).abs() < 1e-12);
        assert!((force(0.5, -7.0) - force(0.5, 0.0) - damping[2 * 5 + 4] * 7.0).abs() < 1e-12);
    }

    #[test]
    fn whatever_was_learned_its_damping_takes_energy_out_and_its_slopes_are_bounded() {
        let p = numbers();
        for i in -30..=50 {
            for j in -60..=60 {
                let (x, v) = (0.1 * f64::from(i) + 0.003, 0.1 * f64::from(j) + 0.003);
                let force = |x: f64, v: f64| Learned::force(&p, &at(x, v));
                assert!((force(x, v) - force(x, 0.0)) * v <= 0.0, "{x} {v}");
                let bound = Learned::slopes(&p, &at(x, v));
                let h = 1e-7;
                assert!((force(x + h, v) - force(x, v)).abs() < h * bound.stiffness * 1.001);
                assert!((force(x, v + h) - force(x, v)).abs() < h * bound.damping * 1.001);
            }
        }
    }

    #[test]
    fn its_derivatives_are_those_of_differences() {
        let p = numbers();
        for (x, v) in [(-0.8, 0.3), (1.1, -2.7), (2.2, 5.0), (7.0, 0.2)] {
            let dual: Vec<Dual<2>> = p.iter().map(|&p| Dual::constant(p)).collect();
            let exact = Learned::force(&dual, &at(Dual::variable(x, 0), Dual::variable(v, 1)));
            let force = |x: f64, v: f64| Learned::force(&p, &at(x, v));
            let h = 1e-6;
            let by = [
                force(x + h, v) - force(x - h, v),
                force(x, v + h) - force(x, v - h),
            ];
            for (exact, by) in exact.derivative.iter().zip(by) {
                assert!((exact - by / (2.0 * h)).abs() < 1e-7, "{x} {v}: {exact}");
            }
        }
    }
}
