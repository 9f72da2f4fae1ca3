//! The rig as indices, and the forces on its bodies (docs/plant.md, eq. 1 to 5).

use super::shapes::Shapes;
use crate::effects::{At, Kind};
use crate::rig::Reads;
use crate::scalar::Scalar;
use crate::unit::Motion;

/// Everything about a plant but its numbers, which are slots of a parameter vector. The ground is the
/// body after the last one: it has position and velocity zero, and what pushes it is forgotten.
#[derive(Debug)]
pub(crate) struct Topology {
    /// Names of the bodies.
    pub(crate) names: Vec<String>,
    pub(crate) bodies: Vec<BodySlots>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) dampers: Vec<Damper>,
    pub(crate) tendons: Vec<Tendon>,
    pub(crate) motors: Vec<Motor>,
    /// Effects on bodies that are smooth, gravity components among them.
    pub(crate) loads: Vec<Load>,
    /// One entry a body that has dry friction.
    pub(crate) frictions: Vec<Friction>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) inputs: usize,
    /// Which tendons cannot push.
    pub(crate) unilateral: Vec<usize>,
    /// Some slope depends on the state, so that the fastest rate must be watched along the way.
    pub(crate) rates_vary: bool,
    /// What has a shape.
    pub(crate) shapes: Shapes,
}

#[derive(Debug)]
pub(crate) struct BodySlots {
    pub(crate) inertia: usize,
    pub(crate) start: Option<usize>,
    pub(crate) start_velocity: Option<usize>,
}

#[derive(Debug)]
pub(crate) struct Spring {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) stiffness: usize,
    pub(crate) rest: usize,
    pub(crate) motion: Motion,
    pub(crate) laws: Vec<Law>,
}

/// An effect and the slot of its first parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    pub(crate) kind: Kind,
    pub(crate) slot: usize,
}

#[derive(Debug)]
pub(crate) struct Damper {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) damping: usize,
}

#[derive(Debug)]
pub(crate) struct Tendon {
    /// (body, slot of its arm).
    pub(crate) path: Vec<(usize, usize)>,
    pub(crate) stiffness: usize,
    pub(crate) damping: usize,
    pub(crate) pretension: usize,
    pub(crate) unilateral: bool,
    /// What lets it out.
    pub(crate) lines: Vec<Line>,
}

/// An input with its gain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) input: usize,
    pub(crate) gain: usize,
    pub(crate) linear: bool,
}

#[derive(Debug)]
pub(crate) struct Motor {
    pub(crate) body: usize,
    pub(crate) line: Line,
}

#[derive(Debug)]
pub(crate) struct Load {
    pub(crate) body: usize,
    pub(crate) motion: Motion,
    pub(crate) law: Law,
}

#[derive(Debug)]
pub(crate) struct Friction {
    pub(crate) body: usize,
    pub(crate) motion: Motion,
    pub(crate) laws: Vec<Law>,
}

#[derive(Debug)]
pub(crate) struct Sensor {
    pub(crate) reads: Reads,
    pub(crate) gain: usize,
    pub(crate) offset: usize,
}

/// What the inputs do within one sample interval: `held + slope * tau` where an actuator holds
/// linearly, `held` where it holds.
#[derive(Clone, Debug)]
pub(crate) struct Inputs<S> {
    pub(crate) held: Vec<S>,
    pub(crate) slope: Vec<S>,
}

impl<S: Scalar> Inputs<S> {
    pub(crate) fn zero(count: usize) -> Self {
        Self {
            held: vec![S::ZERO; count],
            slope: vec![S::ZERO; count],
        }
    }

    /// Gain times input, `tau` seconds into the interval.
    #[inline]
    fn through(&self, line: &Line, values: &[S], tau: S) -> S {
        let input = if line.linear {
            self.held[line.input] + self.slope[line.input] * tau
        } else {
            self.held[line.input]
        };
        values[line.gain] * input
    }
}

/// Positions and velocities, the ground's zeros last.
#[derive(Clone, Debug)]
pub(crate) struct State<S> {
    pub(crate) q: Vec<S>,
    pub(crate) v: Vec<S>,
}

impl<S: Scalar> State<S> {
    pub(crate) fn rest(bodies: usize) -> Self {
        Self {
            q: vec![S::ZERO; bodies + 1],
            v: vec![S::ZERO; bodies + 1],
        }
    }
}

impl Tendon {
    /// Tension, N (eq. 4).
    #[inline]
    pub(crate) fn tension<S: Scalar>(
        &self,
        values: &[S],
        state: &State<S>,
        inputs: &Inputs<S>,
        tau: S,
    ) -> S {
        let mut stretch = S::ZERO;
        let mut rate = S::ZERO;
        for &(body, arm) in &self.path {
            stretch += values[arm] * state.q[body];
            rate += values[arm] * state.v[body];
        }
        for line in &self.lines {
            stretch -= inputs.through(line, values, tau);
        }
        let tension = values[self.pretension]
            + values[self.stiffness] * stretch
            + values[self.damping] * rate;
        if self.unilateral && tension.value() < 0.0 {
            S::ZERO
        } else {
            tension
        }
    }
}

impl Topology {
    /// Every force on every body but dry friction (eq. 1 to 5, 10 to 12), `tau` seconds into the
    /// sample interval. `force` has one entry a body and one for the ground.
    #[inline]
    pub(crate) fn forces<S: Scalar>(
        &self,
        values: &[S],
        state: &State<S>,
        inputs: &Inputs<S>,
        tau: S,
        force: &mut [S],
    ) {
        force.fill(S::ZERO);
        for spring in &self.springs {
            let extension = state.q[spring.to] - state.q[spring.from] - values[spring.rest];
            let mut pull = -(values[spring.stiffness] * extension);
            if !spring.laws.is_empty() {
                let at = At {
                    position: extension,
                    velocity: state.v[spring.to] - state.v[spring.from],
                    direction: 0.0,
                    motion: spring.motion,
                };
                for law in &spring.laws {
                    pull += law.kind.force(&values[law.slot..], &at);
                }
            }
            force[spring.to] += pull;
            force[spring.from] -= pull;
        }
        for damper in &self.dampers {
            let pull = values[damper.damping] * (state.v[damper.to] - state.v[damper.from]);
            force[damper.to] -= pull;
            force[damper.from] += pull;
        }
        for tendon in &self.tendons {
            let tension = tendon.tension(values, state, inputs, tau);
            for &(body, arm) in &tendon.path {
                force[body] -= values[arm] * tension;
            }
        }
        for motor in &self.motors {
            force[motor.body] += inputs.through(&motor.line, values, tau);
        }
        for load in &self.loads {
            let at = At {
                position: state.q[load.body],
                velocity: state.v[load.body],
                direction: 0.0,
                motion: load.motion,
            };
            force[load.body] += load.law.kind.force(&values[load.law.slot..], &at);
        }
    }

    /// The signal of one sensor, SI.
    pub(crate) fn signal<S: Scalar>(
        &self,
        sensor: usize,
        values: &[S],
        state: &State<S>,
        inputs: &Inputs<S>,
        tau: S,
    ) -> S {
        let sensor = &self.sensors[sensor];
        let reading = match sensor.reads {
            Reads::Position(body) => state.q[body],
            Reads::Velocity(body) => state.v[body],
            Reads::Tension(tendon) => self.tendons[tendon].tension(values, state, inputs, tau),
            Reads::Shape(shape) => self.shapes.read(shape, values, &state.q),
        };
        values[sensor.gain] * reading + values[sensor.offset]
    }
}

impl Friction {
    /// Friction on a body that slides in `direction` (+1 or -1).
    #[inline]
    pub(crate) fn force<S: Scalar>(&self, values: &[S], state: &State<S>, direction: f64) -> S {
        let at = At {
            position: state.q[self.body],
            velocity: state.v[self.body],
            direction,
            motion: self.motion,
        };
        let mut force = S::ZERO;
        for law in &self.laws {
            force += law.kind.force(&values[law.slot..], &at);
        }
        force
    }

    /// What a resting body is held against in the directions (+, -).
    #[inline]
    pub(crate) fn hold<S: Scalar>(&self, values: &[S]) -> [S; 2] {
        let mut hold = [S::ZERO; 2];
        for law in &self.laws {
            let [forward, backward] = law.kind.hold(&values[law.slot..]);
            hold[0] += forward;
            hold[1] += backward;
        }
        hold
    }
}
