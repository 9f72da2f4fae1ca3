//! Bound on the fastest rate of the rig, and the number of sub-steps that it asks for
//! (docs/explanation/plant.md, eq. 19).

use crate::effects::{At, Slopes};
use crate::error::SimulationError;
use crate::plant::forces::State;
use crate::plant::topology::{Followed, Memory, Topology};
use crate::settings::{MOST_RATE_STEP, SimulationSettings};

/// Row sums of |M^-1/2 K M^-1/2| and |M^-1/2 C M^-1/2|, an upper bound on their eigenvalues.
struct RowSums<'a> {
    root_inertia: &'a [f64],
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    /// Rates of internal states, 1/s.
    internal: f64,
}

impl RowSums<'_> {
    /// Adds `slope * b b^T`, where `b` has the given entries (body, coefficient). The ground has no
    /// row.
    fn add(&mut self, entries: &[(usize, f64)], slopes: Slopes) {
        let scaled = |&(body, coefficient): &(usize, f64)| {
            let root = self.root_inertia.get(body)?;
            Some((body, coefficient.abs() / root))
        };
        let total: f64 = entries.iter().filter_map(scaled).map(|(_, b)| b).sum();
        for (body, b) in entries.iter().filter_map(scaled) {
            self.stiffness[body] += slopes.stiffness * b * total;
            self.damping[body] += slopes.damping * b * total;
        }
    }

    fn springs(&mut self, topology: &Topology, values: &[f64], state: &State<f64>, ahead: f64) {
        for spring in &topology.springs {
            let extension = spring.extension(values, state);
            let velocity = spring.speed(state);
            let at = At {
                position: extension.abs() + velocity.abs() * ahead,
                velocity,
                direction: 0.0,
                motion: spring.motion,
            };
            let mut slopes = Slopes {
                stiffness: values[spring.stiffness].abs(),
                damping: 0.0,
            };
            if let Some(curve) = &spring.curve {
                slopes.stiffness = curve.steepest(values, at.position);
            }
            for law in &spring.laws {
                let more = law.kind.slopes(&values[law.slot..], &at);
                slopes.stiffness += more.stiffness;
                slopes.damping += more.damping;
            }
            for memory in &spring.memory {
                match *memory {
                    Memory::Hysteresis { slot, state: z, .. } => {
                        let p = &values[slot..];
                        // z' = v (1 - ...) is at most twice the speed inside the loop, and z
                        // settles over the distance that the strain hardens in.
                        let hardening = p[1].abs() + p[2].abs();
                        let size = strain_power(state.z[z].abs(), hardening, p[3]);
                        slopes.stiffness += 2.0 * p[0].abs();
                        self.internal += velocity.abs() * p[3].abs() * hardening * size;
                    }
                    Memory::Plastic { slot, .. } => slopes.stiffness += values[slot].abs(),
                    Memory::Creep { slot, .. } => {
                        slopes.stiffness += values[slot].abs();
                        self.internal += 1.0 / values[slot + 1].abs();
                    }
                }
            }
            self.add(&[(spring.from, 1.0), (spring.to, 1.0)], slopes);
        }
    }

    fn dampers(&mut self, topology: &Topology, values: &[f64], state: &State<f64>) {
        for damper in &topology.dampers {
            let damping = match &damper.curve {
                None => values[damper.damping].abs(),
                // The rate of the next sample is not known: the law may rise as far as it was
                // learned.
                Some(curve) => {
                    let speed = state.v[damper.to] - state.v[damper.from];
                    curve.steepest(values, speed.abs().max(curve.shape.met()))
                }
            };
            let slopes = Slopes {
                stiffness: 0.0,
                damping,
            };
            self.add(&[(damper.from, 1.0), (damper.to, 1.0)], slopes);
        }
    }

    fn servos(&mut self, topology: &Topology, values: &[f64]) {
        for motor in &topology.motors {
            let line = &topology.lines[motor.line];
            if let Some(servo) = line.servo {
                let slopes = Slopes {
                    stiffness: followed(topology, values, Followed::Motors(servo.body))
                        * values[line.gain].abs(),
                    damping: 0.0,
                };
                self.add(&[(servo.body, 1.0)], slopes);
            }
        }
    }

    /// Frictions with a state of their own: pre-sliding and warming.
    fn friction_states(&mut self, topology: &Topology, values: &[f64], state: &State<f64>) {
        for friction in &topology.presliding {
            let [level, distance] = [values[friction.slot], values[friction.slot + 1]];
            // w' = v (1 - ...) / distance is at most twice the speed over the distance.
            let slopes = Slopes {
                stiffness: 2.0 * (level / distance).abs(),
                damping: 0.0,
            };
            self.add(&[(friction.body, 1.0)], slopes);
            self.internal += (state.v[friction.body] / distance).abs();
        }
        for friction in &topology.frictions {
            for warming in &friction.warming {
                let [level, velocity, time] = [0, 1, 2].map(|at| values[warming.slot + at].abs());
                let slopes = Slopes {
                    stiffness: level / (velocity * time),
                    damping: 0.0,
                };
                self.add(&[(friction.body(), 1.0)], slopes);
                self.internal += 1.0 / time;
            }
        }
    }

    fn tendons(&mut self, topology: &Topology, values: &[f64]) {
        for (index, tendon) in topology.tendons.iter().enumerate() {
            let arms = tendon.path.iter().map(|&(body, arm)| (body, values[arm]));
            let factor = followed(topology, values, Followed::Tension(index));
            let slopes = Slopes {
                stiffness: factor * values[tendon.stiffness].abs(),
                damping: factor * values[tendon.damping].abs(),
            };
            self.add(&arms.collect::<Vec<_>>(), slopes);
        }
    }

    fn hasels(
        &mut self,
        topology: &Topology,
        values: &[f64],
        state: &State<f64>,
        (ahead, stops): (f64, bool),
    ) {
        for hasel in &topology.hasels {
            let (mut stiffness, charging) = hasel.rates(values, &state.q, state.z[hasel.charge]);
            if stops && hasel.stretches(values, state, ahead) {
                stiffness += values[hasel.film_stiffness].abs();
            }
            let arms = hasel.path.iter().map(|&(body, arm)| (body, values[arm]));
            let slopes = Slopes {
                stiffness,
                damping: 0.0,
            };
            self.add(&arms.collect::<Vec<_>>(), slopes);
            // A decay has no phase to keep: at twice the step it is as exact as a mode.
            self.internal = f64::max(self.internal, 0.5 * charging);
        }
    }

    /// Laws of a body's own position and velocity.
    fn laws(&mut self, topology: &Topology, values: &[f64], state: &State<f64>) {
        let loads = topology.loads.iter().map(|l| (l.body, l.motion, l.law));
        let frictions = (topology.frictions.iter())
            .flat_map(|f| f.laws.iter().map(|law| (f.body(), f.motion, *law)));
        for (body, motion, law) in loads.chain(frictions) {
            let at = At {
                position: state.q[body],
                velocity: state.v[body],
                direction: 0.0,
                motion,
            };
            self.add(&[(body, 1.0)], law.kind.slopes(&values[law.slot..], &at));
        }
    }

    /// Dry friction as a smooth function.
    fn smoothed_frictions(
        &mut self,
        topology: &Topology,
        values: &[f64],
        state: &State<f64>,
        smoothing: f64,
    ) {
        // Steepest at rest: level^2 / (2 smoothing).
        for friction in &topology.frictions {
            let load = vec![0.0; topology.follows];
            let branches = vec![1; topology.switches.len()];
            let [forward, backward] = friction.hold(values, state, &load, &branches);
            let level = forward.abs().max(backward.abs());
            let path = (friction.path.iter())
                .map(|&(body, arm)| (body, crate::plant::topology::Friction::arm(values, arm)));
            let slopes = Slopes {
                stiffness: 0.0,
                damping: 0.5 * level * level / smoothing,
            };
            self.add(&path.collect::<Vec<_>>(), slopes);
        }
    }

    /// Friction that follows the forces at a body makes these larger.
    fn follow(&mut self, topology: &Topology, values: &[f64]) {
        for body in 0..self.stiffness.len() {
            let factor = followed(topology, values, Followed::Pulls(body));
            self.stiffness[body] *= factor;
            self.damping[body] *= factor;
        }
    }

    fn stops(&mut self, topology: &Topology, values: &[f64], state: &State<f64>, ahead: f64) {
        for stop in &topology.stops {
            let p = &values[stop.slot..];
            let depth = p[3] * (state.q[stop.body] - p[0]);
            if depth + 2.0 * state.v[stop.body].abs() * ahead > 0.0 {
                let slopes = Slopes {
                    stiffness: p[1].abs(),
                    damping: p[2].abs(),
                };
                self.add(&[(stop.body, 1.0)], slopes);
            }
        }
    }
}

/// `|z|^(n-1)` of a hysteresis. Below n = 1 it has no bound where z goes through zero, and no
/// influence there either: z passes in no time. From this part of its limit, `hardening^(-1/n)`, on
/// it counts as it is.
fn strain_power(z: f64, hardening: f64, exponent: f64) -> f64 {
    const PASSING: f64 = 0.05;
    if exponent == 1.0 {
        return 1.0;
    }
    let limit = crate::math::exp(-crate::math::ln(hardening.max(1e-300)) / exponent);
    let least = if exponent < 1.0 { PASSING * limit } else { 0.0 };
    crate::math::exp((exponent - 1.0) * crate::math::ln(z.max(least).max(1e-300)))
}

/// Factor by which friction that follows a load increases what makes the load.
fn followed(topology: &Topology, values: &[f64], load: Followed) -> f64 {
    let follows = topology.frictions.iter().flat_map(|f| &f.follows);
    let here = follows.filter(|follow| follow.load == load);
    1.0 + here.map(|f| values[f.coefficient].abs()).sum::<f64>()
}

/// A bound on the largest rate of the rig linearised near a state, 1/s, and the body where it sits.
/// A slope that grows with position is taken as far on as the velocity leads in `ahead` seconds.
///
/// With omega^2 and gamma the row sums of stiffness and damping scaled by inertia, an eigenvalue
/// obeys |lambda|^2 <= gamma |lambda| + omega^2, hence
/// |lambda| <= gamma/2 + sqrt(gamma^2/4 + omega^2). Rates of internal states add to it. Stops count
/// where `stops` asks for them and the body may meet them in that time.
pub(super) fn bound(
    topology: &Topology,
    values: &[f64],
    state: &State<f64>,
    ahead: f64,
    stops: bool,
    smoothing: f64,
) -> (f64, usize) {
    let bodies = topology.bodies.iter().enumerate();
    let root_inertia: Vec<f64> = bodies
        .map(|(body, slots)| {
            // No force moves an imposed body.
            if topology.is_imposed(body) {
                f64::INFINITY
            } else {
                crate::math::sqrt(values[slots.inertia])
            }
        })
        .collect();
    let bodies = root_inertia.len();
    let mut rows = RowSums {
        root_inertia: &root_inertia,
        stiffness: vec![0.0; bodies],
        damping: vec![0.0; bodies],
        internal: 0.0,
    };
    rows.springs(topology, values, state, ahead);
    rows.dampers(topology, values, state);
    rows.servos(topology, values);
    rows.friction_states(topology, values, state);
    rows.tendons(topology, values);
    rows.hasels(topology, values, state, (ahead, stops));
    rows.laws(topology, values, state);
    if smoothing > 0.0 {
        rows.smoothed_frictions(topology, values, state, smoothing);
    }
    if topology.follows > 0 {
        rows.follow(topology, values);
    }
    if stops {
        rows.stops(topology, values, state, ahead);
    }
    // The two maxima may sit at different bodies; the bound needs both, the name only the larger.
    let largest = |rows: &[f64]| rows.iter().copied().fold(0.0, f64::max);
    let (omega2, gamma) = (largest(&rows.stiffness), largest(&rows.damping));
    let of =
        |omega2: f64, gamma: f64| 0.5 * gamma + crate::math::sqrt(0.25 * gamma * gamma + omega2);
    let own = |body: usize| of(rows.stiffness[body], rows.damping[body]);
    let fastest = (0..bodies).max_by(|&a, &b| own(a).total_cmp(&own(b)));
    (of(omega2, gamma) + rows.internal, fastest.unwrap_or(0))
}

/// Sub-steps for an interval: the smallest power of two that keeps a sub-step within the rate. A
/// power of two, so that a small change of a parameter seldom changes the number.
pub(super) fn substeps(
    topology: &Topology,
    (rate, body): (f64, usize),
    interval: f64,
    settings: &SimulationSettings,
) -> Result<usize, SimulationError> {
    let most = settings.max_substeps;
    let wanted = rate * interval / settings.rate_step.min(MOST_RATE_STEP);
    if wanted <= most as f64 {
        Ok((wanted.ceil() as usize).max(1).next_power_of_two())
    } else {
        Err(too_stiff(topology, (rate, body), interval, most))
    }
}

/// The refusal of a rig that moves too fast for its samples.
pub(super) fn too_stiff(
    topology: &Topology,
    (rate, body): (f64, usize),
    interval: f64,
    most: usize,
) -> SimulationError {
    SimulationError::TooStiff {
        at: topology.place(body),
        rate,
        interval,
        most,
    }
}
