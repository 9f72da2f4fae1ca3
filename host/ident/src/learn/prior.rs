//! The smoothness of a law as a prior of its numbers.

use sinew_sim::LawKind;
use sinew_sim::Plant;
use sinew_sim::rig::LearnedLaw;

/// Bends of a law over `size`, each a sum over slots of the plant: the change of slope at an inner
/// number, where the slope is over the square of a spring's extension or the rate of a damper, both
/// as parts of the reach (docs/explanation/identification.md, eq. 18).
pub(super) fn bends(plant: &Plant, law: &LearnedLaw, size: f64) -> Vec<Vec<(usize, f64)>> {
    let numbers = law.numbers.len();
    let slot = |k: usize| plant.slot(&format!("{}.{}.{k}", law.name, law.kind.key()));
    let steps = law.shape().steps(numbers);
    let sides: &[i8] = if law.odd { &[1] } else { &[1, -1] };
    let mut all = Vec::new();
    for side in sides {
        let at = |k: usize| match (law.odd, side) {
            (true, _) => slot(k),
            (false, 1) => slot(steps + k),
            (false, _) => slot(steps - k),
        };
        for k in 1..steps {
            let (before, after) = (gap(law.kind, k, steps), gap(law.kind, k + 1, steps));
            let terms = [
                (at(k - 1), 1.0 / before),
                (at(k), -1.0 / before - 1.0 / after),
                (at(k + 1), 1.0 / after),
            ];
            let terms = terms.map(|(slot, factor)| Some((slot?, factor / size)));
            all.extend(terms.into_iter().collect::<Option<Vec<_>>>());
        }
    }
    all
}

/// Distance of a number from the one before it.
fn gap(kind: LawKind, k: usize, steps: usize) -> f64 {
    let place = |k: usize| {
        let share = k as f64 / steps as f64;
        match kind {
            LawKind::Spring => share * share,
            LawKind::Damper => share,
        }
    };
    place(k) - place(k - 1)
}
