//! Stiction set of paths that share bodies: found from the state, chosen among the paths at rest,
//! and updated at break-away.

use super::dynamics::Dynamics;
use super::least_constraint;
use super::modes::Mode;
use super::sticking::{self, DEPENDENT, coupling, eliminate};
use crate::plant::forces::{Point, State};
use crate::plant::topology::{Friction, Topology};
use crate::scalar::Scalar;

/// True where the velocity along a path is zero within rounding.
pub(super) fn at_rest<S: Scalar>(friction: &Friction, values: &[S], state: &State<S>) -> bool {
    if let [(body, None)] = friction.path[..] {
        return state.v[body].value() == 0.0;
    }
    let part = |&(body, arm): &(usize, Option<usize>)| {
        (Friction::arm(values, arm) * state.v[body]).value()
    };
    let size: f64 = friction.path.iter().map(|p| part(p).abs()).sum();
    friction.speed(values, state).value().abs() <= 1e-13 * size
}

/// Adds to `resting` every path that depends on those in it: its velocity is rounding.
pub(super) fn add_dependent(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    resting: &mut Vec<usize>,
) {
    let independent = resting.clone();
    for index in 0..topology.frictions.len() {
        if !independent.contains(&index) && !can_move(dynamics, topology, &independent, index) {
            resting.push(index);
        }
    }
    resting.sort_unstable();
}

/// Chooses who is held among the frictions at rest, for the forces at a point: those whose reaction
/// is inside its hold ([`least_constraint`]). Of the others those yield that cannot move since
/// others hold their path.
pub(super) fn choose(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    at: &Point<f64>,
    resting: &[usize],
    modes: &mut [Mode],
    force: &[f64],
    load: &[f64],
) {
    let mut pushed = force.to_vec();
    for (index, friction) in topology.frictions.iter().enumerate() {
        if let Mode::Slide(direction) = modes[index]
            && !resting.contains(&index)
        {
            let along = friction.force(at, load, direction);
            for &(body, arm) in &friction.path {
                pushed[body] += Friction::arm(at.values, arm) * along;
            }
        }
    }
    let accelerations: Vec<f64> = (pushed.iter().zip(&dynamics.inverse_inertia))
        .map(|(force, inverse)| force * inverse)
        .collect();
    let wanted = sticking::along(topology, at.values, resting, &accelerations);
    let hold =
        |&index: &usize| topology.frictions[index].hold(at.values, at.state, load, at.branches);
    let holds: Vec<[f64; 2]> = resting.iter().map(hold).collect();
    let borne = least_constraint::reactions(dynamics, topology, resting, &wanted, &holds);
    for (&index, borne) in resting.iter().zip(borne) {
        modes[index] = borne;
    }
    let stuck = stuck(modes);
    for &index in resting {
        if let Mode::Slide(direction) = modes[index]
            && !can_move(dynamics, topology, &stuck, index)
        {
            modes[index] = Mode::Yield(direction);
        }
    }
}

/// Updates the modes at the break-away of `index` in a direction. If others hold its path it
/// yields; else it slides, together with the paths that yielded that way. A path that yielded the
/// other way has force to spare: it sticks instead, and nothing moves.
pub(super) fn break_away(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    modes: &mut [Mode],
    index: usize,
    direction: f64,
) {
    modes[index] = Mode::Yield(direction);
    let stuck = stuck(modes);
    if !can_move(dynamics, topology, &stuck, index) {
        return;
    }
    let yields = |(other, mode): (usize, &Mode)| match *mode {
        Mode::Yield(its) if other != index => Some((other, its)),
        _ => None,
    };
    let mut freed: Vec<(usize, f64)> = modes.iter().enumerate().filter_map(yields).collect();
    freed.retain(|&(other, _)| can_move(dynamics, topology, &stuck, other));
    let against = |&&(other, its): &&(usize, f64)| {
        direction * its * reduced_coupling(dynamics, topology, &stuck, index, other) < 0.0
    };
    if let Some(&(other, _)) = freed.iter().find(against) {
        modes[other] = Mode::Stick;
        return;
    }
    modes[index] = Mode::Slide(direction);
    for (other, its) in freed {
        modes[other] = Mode::Slide(its);
    }
}

fn stuck(modes: &[Mode]) -> Vec<usize> {
    let stuck = |&index: &usize| modes[index] == Mode::Stick;
    (0..modes.len()).filter(stuck).collect()
}

/// True where a path can move while others are held.
fn can_move(dynamics: &Dynamics<f64>, topology: &Topology, held: &[usize], index: usize) -> bool {
    let whole = coupling(dynamics, topology, index, index);
    reduced_coupling(dynamics, topology, held, index, index) > DEPENDENT * whole
}

/// Coupling of paths `a` and `b` while others are held: the Schur complement in `B M^-1 B'` of the
/// part of the held paths.
fn reduced_coupling(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    held: &[usize],
    a: usize,
    b: usize,
) -> f64 {
    // One row a path: held, then a; the columns have b for the last.
    let n = held.len() + 1;
    let rows: Vec<usize> = held.iter().copied().chain([a]).collect();
    let columns: Vec<usize> = held.iter().copied().chain([b]).collect();
    let mut matrix: Vec<f64> = (rows.iter())
        .flat_map(|&row| columns.iter().map(move |&column| (row, column)))
        .map(|(row, column)| coupling(dynamics, topology, row, column))
        .collect();
    eliminate(&mut matrix, n, n - 1, |_, _, _| {});
    matrix[n * n - 1]
}

#[cfg(test)]
mod tests {
    use super::super::modes::{Held, Mode};
    use super::super::substep::Substep;
    use super::break_away;
    use crate::plant::Plant;
    use crate::rig::Rig;
    use proptest::prelude::*;

    /// Acceleration that is left along paths that count as dependent, 1e-5 apart.
    const NEAR: f64 = 1e-4;

    /// Three bodies and tendons that rub with a tenth of 10 N along these paths.
    fn plant(paths: &[[f64; 3]]) -> Plant {
        let mut text = "format = \"sinew-rig/1\"\nname = \"x\"\n".to_owned();
        for (name, inertia) in [("a", 1.0), ("b", 0.4), ("c", 2.5)] {
            text += &format!(
                "[[body]]\nname = \"{name}\"\nmotion = \"slide\"\ninertia = {inertia:?}\n"
            );
        }
        for (index, [a, b, c]) in paths.iter().enumerate() {
            text += &format!(
                "[[tendon]]\nname = \"t{index}\"\nstiffness = 0.0\npretension = 10.0\npath = [{{ body = \"a\", arm = {a:?} }}, \
                 {{ body = \"b\", arm = {b:?} }}, {{ body = \"c\", arm = {c:?} }}]\n\
                 [[effect]]\nkind = \"load_dependent_friction\"\ncomponent = \"t{index}\"\ncoefficient = 0.1\n"
            );
        }
        let rig = Rig::parse(&text, "x.toml").unwrap_or_else(|error| panic!("{error}"));
        Plant::new(&rig).unwrap_or_else(|error| panic!("{error}"))
    }

    fn arm() -> impl Strategy<Value = f64> {
        prop_oneof![-2.0..-0.1f64, 0.1..2.0f64]
    }

    /// Modes under these forces, Signorini's conditions of each checked: a held path has force to
    /// spare and stays, one without moves its way or not at all.
    fn sound(plant: &Plant, paths: &[[f64; 3]], force: [f64; 3]) -> Result<Vec<Mode>, String> {
        let topology = &plant.topology;
        let mut work = Substep::<f64>::new(topology, &plant.values(), 0.0);
        work.initialise_branches(topology, 0.0);
        work.other_forces(topology, 0.0);
        work.first.force[..3].copy_from_slice(&force);
        work.initialise_frictions(topology, 0.0, None);
        let modes = work.modes.friction.clone();
        let mut held = vec![Held::NOTHING; modes.len()];
        let mut forces = work.first.clone();
        let at = work.point(0.0);
        (work.dynamics).accelerate(topology, &at, &modes, &mut forces, &mut held);
        for (index, (mode, path)) in modes.iter().zip(paths).enumerate() {
            let along: f64 = path.iter().zip(&forces.force).map(|(arm, a)| arm * a).sum();
            let sound = match *mode {
                Mode::Stick => held[index].margin() >= 0.0 && along.abs() < NEAR,
                Mode::Yield(_) => along.abs() < NEAR,
                Mode::Slide(direction) => direction * along > -NEAR,
            };
            if !sound {
                return Err(format!("{index} of {modes:?}: {along:e}, {held:?}"));
            }
        }
        Ok(modes)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_rests_has_force_to_spare_and_what_starts_has_none(
            mut paths in prop::collection::vec(prop::array::uniform3(arm()), 1..6),
            repeated in any::<bool>(),
            force in prop::array::uniform3(-4.0..4.0f64),
        ) {
            if repeated {
                paths.push(paths[0].map(|arm| -0.7 * arm));
            }
            let sound = sound(&plant(&paths), &paths, force);
            prop_assert!(sound.is_ok(), "{sound:?}");
        }
    }

    /// Without pivots in the order of their size rounding passes for an independent path here.
    #[test]
    fn rounding_makes_no_path_independent() {
        let paths = [
            [
                -0.173_483_278_314_142_3,
                0.300_501_824_397_768_85,
                1.446_833_728_220_534_6,
            ],
            [
                -1.462_918_154_832_936_6,
                0.384_866_678_729_058_1,
                -1.139_995_174_220_149_7,
            ],
            [
                -0.765_068_005_461_755,
                1.235_968_538_204_673_7,
                0.650_162_755_864_162_2,
            ],
            [-1.234_602_975_690_383_4, 1.972_251_944_152_742_9, -0.1],
            [0.1, 0.1, 0.1],
        ];
        let force = [
            -1.641_578_223_533_831_2,
            0.650_576_010_704_211_9,
            0.257_801_037_135_546_7,
        ];
        let modes = sound(&plant(&paths), &paths, force);
        assert!(modes.is_ok(), "{modes:?}");
    }

    /// A fit may try a level below zero: it leaves rest towards the larger excess.
    #[test]
    fn a_level_below_zero_holds_nothing() {
        let path = [[1.0, -0.5, 0.3]];
        let plant = plant(&path);
        let slot = plant.slot("t0.load_dependent_friction.coefficient");
        let mut values = plant.values();
        values[slot.expect("the plant has this parameter")] = -0.1;
        let topology = &plant.topology;
        let mut work = Substep::<f64>::new(topology, &values, 0.0);
        for sign in [1.0, -1.0] {
            work.initialise_branches(topology, 0.0);
            work.other_forces(topology, 0.0);
            work.first.force[..3].copy_from_slice(&[0.1 * sign, 0.0, 0.0]);
            work.forget();
            work.initialise_frictions(topology, 0.0, None);
            assert_eq!(work.modes.friction, [Mode::Slide(sign)]);
        }
    }

    #[test]
    fn what_yields_the_other_way_takes_over_from_what_is_overcome() {
        let plant = plant(&[[1.0, -0.5, 0.3], [-2.0, 1.0, -0.6]]);
        let work = Substep::<f64>::new(&plant.topology, &plant.values(), 0.0);
        let after = |yielding: f64, direction: f64| {
            let mut modes = [Mode::Yield(yielding), Mode::Stick];
            break_away(&work.dynamics, &plant.topology, &mut modes, 1, direction);
            modes
        };
        // The paths are opposite: a push along the second is one against the first.
        assert_eq!(after(1.0, -1.0), [Mode::Slide(1.0), Mode::Slide(-1.0)]);
        assert_eq!(after(1.0, 1.0), [Mode::Stick, Mode::Yield(1.0)]);
        assert_eq!(after(-1.0, 1.0), [Mode::Slide(-1.0), Mode::Slide(1.0)]);
        assert_eq!(after(-1.0, -1.0), [Mode::Stick, Mode::Yield(-1.0)]);
    }
}
