//! Levenberg-Marquardt on the logarithms of the settings (docs/explanation/controller.md, eq. 24).

/// A sum of squares around a place.
pub struct Quadratic {
    /// Half of its gradient, `J'r`.
    pub gradient: Vec<f64>,
    /// `J'J`, row after row.
    pub normal: Vec<Vec<f64>>,
}

/// Reason for which a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The next step promises next to nothing.
    Converged,
    /// No step lowers the cost though the derivatives promise one: a kink or a jump.
    Stalled,
    /// The evaluations were used up.
    Exhausted,
}

/// Result of a search.
#[derive(Clone, Debug)]
pub struct Descent {
    /// The cheapest place.
    pub place: Vec<f64>,
    /// Its cost.
    pub cost: f64,
    /// Evaluations without derivatives.
    pub plain: usize,
    /// Evaluations with derivatives.
    pub linear: usize,
    /// All of them, derivatives at their price.
    pub made: usize,
    /// Reason of the end.
    pub ended: Ended,
}

/// Part of the cost that a step has to promise.
const WORTHWHILE: f64 = 1e-3;
/// Longest change of a logarithm in one step.
const LONGEST: f64 = 3.0;
/// Damping of the first step, and the one at which a search counts as stalled.
const DAMPING: [f64; 2] = [1e-2, 1e4];
/// Decrease as a multiple of what was promised from which on the step was too short: far from a fit
/// the residuals' own curvature, which (24) leaves out, bends the other way.
const GENEROUS: f64 = 1.5;
/// Least damping, and the least after a step that was not taken.
const LEAST_DAMPING: f64 = 1e-6;
const DAMPED: f64 = 1e-3;

/// Lowers a sum of squares inside `ranges`, from the cheapest of `starts` and then, as far as they
/// go, from the next, in at most `evaluations`, of which derivatives cost `price`. `cost` is not
/// finite where there is none; `linearise` gives nothing there.
pub fn descend(
    ranges: &[[f64; 2]],
    starts: &[Vec<f64>],
    evaluations: usize,
    price: usize,
    cost: impl Fn(&[f64]) -> f64,
    linearise: impl Fn(&[f64]) -> Option<Quadratic>,
) -> Descent {
    let search = Search {
        ranges,
        evaluations,
        price,
        cost,
        linearise,
    };
    let mut best = Descent {
        place: starts.first().cloned().unwrap_or_default(),
        cost: f64::INFINITY,
        plain: 0,
        linear: 0,
        made: 0,
        ended: Ended::Exhausted,
    };
    let mut begun: Vec<(f64, &Vec<f64>)> = Vec::new();
    for start in starts.iter().take(evaluations) {
        begun.push(((search.cost)(start), start));
        best.plain += 1;
        best.made += 1;
    }
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (cost, start) in begun.into_iter().filter(|(cost, _)| cost.is_finite()) {
        let from = Descent {
            place: start.clone(),
            cost,
            ended: Ended::Exhausted,
            ..best
        };
        let found = search.from(from);
        best = Descent {
            plain: found.plain,
            linear: found.linear,
            made: found.made,
            ..if found.cost < best.cost { found } else { best }
        };
    }
    best
}

/// A sum of squares and what may be spent on it.
struct Search<'a, C, L> {
    ranges: &'a [[f64; 2]],
    evaluations: usize,
    price: usize,
    cost: C,
    linearise: L,
}

impl<C: Fn(&[f64]) -> f64, L: Fn(&[f64]) -> Option<Quadratic>> Search<'_, C, L> {
    /// Goes on from a place.
    fn from(&self, mut found: Descent) -> Descent {
        let mut damping = DAMPING[0];
        while found.made + self.price < self.evaluations {
            let quadratic = (self.linearise)(&found.place);
            found.linear += 1;
            found.made += self.price;
            let Some(quadratic) = quadratic else {
                found.ended = Ended::Stalled;
                return found;
            };
            // A damped step is short and promises little wherever it is.
            let (_, most) = quadratic.step(&found.place, self.ranges, 0.0);
            if most <= WORTHWHILE * found.cost {
                found.ended = Ended::Converged;
                return found;
            }
            loop {
                if found.made >= self.evaluations {
                    return found;
                }
                let (next, promised) = quadratic.step(&found.place, self.ranges, damping);
                let reached = (self.cost)(&next);
                found.plain += 1;
                found.made += 1;
                let ratio = (found.cost - reached) / promised;
                if reached < found.cost {
                    let begun = std::mem::replace(&mut found.place, next);
                    found.cost = reached;
                    if ratio > GENEROUS {
                        self.stretch(&begun, &mut found);
                    }
                    let factor = match ratio {
                        0.7.. => 0.1,
                        0.2.. => 1.0,
                        _ => 4.0,
                    };
                    damping = (damping * factor).max(LEAST_DAMPING);
                    break;
                }
                damping = (damping * 10.0).max(DAMPED);
                if damping > DAMPING[1] {
                    found.ended = Ended::Stalled;
                    return found;
                }
            }
        }
        found
    }
}

impl<C: Fn(&[f64]) -> f64, L> Search<'_, C, L> {
    /// Goes on along the step that led from `begun` to the place, twice as far each time, as long
    /// as that lowers the cost.
    fn stretch(&self, begun: &[f64], found: &mut Descent) {
        let step: Vec<f64> = found.place.iter().zip(begun).map(|(a, b)| a - b).collect();
        let mut factor = 2.0;
        while found.made < self.evaluations {
            let ends = begun.iter().zip(&step).zip(self.ranges);
            let further =
                ends.map(|((z, step), [low, high])| (z + factor * step).clamp(*low, *high));
            let further: Vec<f64> = further.collect();
            if further == found.place {
                break;
            }
            let reached = (self.cost)(&further);
            found.plain += 1;
            found.made += 1;
            if reached.is_nan() || reached >= found.cost {
                break;
            }
            (found.place, found.cost) = (further, reached);
            factor *= 2.0;
        }
    }
}

impl Quadratic {
    /// Nothing added up yet.
    pub fn zero(unknowns: usize) -> Self {
        Self {
            gradient: vec![0.0; unknowns],
            normal: vec![vec![0.0; unknowns]; unknowns],
        }
    }

    /// Adds a residual and its derivatives.
    pub fn add(&mut self, residual: f64, row: &[f64]) {
        for (i, slope) in row.iter().enumerate() {
            self.gradient[i] += slope * residual;
            for (sum, other) in self.normal[i].iter_mut().zip(row) {
                *sum += slope * other;
            }
        }
    }

    /// Every number of it is one.
    pub fn is_finite(&self) -> bool {
        let all = self.normal.iter().flatten().chain(&self.gradient);
        all.copied().all(f64::is_finite)
    }

    /// The damped step from a place, inside the ranges, and the decrease that it promises.
    fn step(&self, place: &[f64], ranges: &[[f64; 2]], damping: f64) -> (Vec<f64>, f64) {
        // Unknowns that the step takes to an end of their range, where they are held.
        let mut held: Vec<Option<f64>> = vec![None; place.len()];
        let step = loop {
            let step = self.damped(&held, damping);
            let longest = step.iter().fold(LONGEST, |most, step| step.abs().max(most));
            let step: Vec<f64> = step.iter().map(|step| step * LONGEST / longest).collect();
            let leaves = (0..place.len()).find(|i| {
                let [low, high] = ranges[*i];
                held[*i].is_none() && !(low..=high).contains(&(place[*i] + step[*i]))
            });
            match leaves {
                Some(i) => {
                    let [low, high] = ranges[i];
                    held[i] = Some((place[i] + step[i]).clamp(low, high) - place[i]);
                }
                None => break step,
            }
        };
        let moved = place.iter().zip(&step).zip(ranges);
        let next = moved.map(|((place, step), [low, high])| (place + step).clamp(*low, *high));
        (next.collect(), self.promised(&step))
    }

    /// Decrease of the cost along a step by the quadratic.
    fn promised(&self, step: &[f64]) -> f64 {
        let rows = step.iter().zip(&self.gradient).zip(&self.normal);
        let sum = rows.map(|((p, g), row)| {
            let product: f64 = row.iter().zip(step).map(|(h, p)| h * p).sum();
            p * (2.0 * g + product)
        });
        -sum.sum::<f64>()
    }

    /// `-(N + damping diag N)^-1 g` over the free unknowns, by Gauss's elimination, where the
    /// others make steps that are given.
    fn damped(&self, held: &[Option<f64>], damping: f64) -> Vec<f64> {
        let all = 0..held.len();
        let free: Vec<usize> = all.clone().filter(|i| held[*i].is_none()).collect();
        let largest = all.clone().map(|i| self.normal[i][i]);
        let least = 1e-9 * largest.fold(f64::MIN_POSITIVE, f64::max);
        let mut rows: Vec<Vec<f64>> = (free.iter())
            .map(|i| {
                let mut row: Vec<f64> = free.iter().map(|j| self.normal[*i][*j]).collect();
                let given = self.normal[*i].iter().zip(held);
                let given: f64 = given.map(|(h, step)| h * step.unwrap_or(0.0)).sum();
                row.push(-self.gradient[*i] - given);
                row
            })
            .collect();
        let n = rows.len();
        for (i, row) in rows.iter_mut().enumerate() {
            row[i] = row[i] * (1.0 + damping) + least;
        }
        // Positive definite: no pivot is sought.
        for i in 0..n {
            let pivot = rows[i].clone();
            for row in rows.iter_mut().skip(i + 1) {
                let factor = row[i] / pivot[i];
                for (value, above) in row.iter_mut().zip(&pivot) {
                    *value -= factor * above;
                }
            }
        }
        let mut step: Vec<f64> = held.iter().map(|step| step.unwrap_or(0.0)).collect();
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| rows[i][j] * step[free[j]]).sum();
            step[free[i]] = (rows[i][n] - known) / rows[i][i];
        }
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals of a valley that bends, Rosenbrock's.
    fn valley(place: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let [x, y] = [place[0], place[1]];
        let residuals = vec![10.0 * (y - x * x), 1.0 - x];
        (residuals, vec![vec![-20.0 * x, 10.0], vec![-1.0, 0.0]])
    }

    fn quadratic(place: &[f64]) -> Option<Quadratic> {
        let (residuals, jacobian) = valley(place);
        let mut sum = Quadratic::zero(2);
        for (residual, row) in residuals.iter().zip(&jacobian) {
            sum.add(*residual, row);
        }
        Some(sum)
    }

    fn cost(place: &[f64]) -> f64 {
        valley(place).0.iter().map(|r| r * r).sum()
    }

    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        let ranges = [[-5.0, 5.0]; 2];
        let found = descend(&ranges, &[vec![-1.2, 1.0]], 60, 1, cost, quadratic);
        assert!(found.cost < 1e-6, "{found:?}");
        assert_eq!(found.cost, cost(&found.place));
    }

    #[test]
    fn the_end_of_a_range_holds() {
        let ranges = [[-5.0, 0.5], [-5.0, 5.0]];
        let found = descend(&ranges, &[vec![-1.2, 1.0]], 60, 1, cost, quadratic);
        assert_eq!(found.ended, Ended::Converged);
        assert!((0.499..=0.5).contains(&found.place[0]), "{found:?}");
        assert!((found.place[1] - 0.25).abs() < 1e-2, "{found:?}");
    }

    #[test]
    fn the_cheapest_start_is_taken_and_the_evaluations_are_kept() {
        let ranges = [[-5.0, 5.0]; 2];
        let starts = [vec![-1.2, 1.0], vec![1.1, 1.1], vec![4.0, 4.0]];
        for allowed in 1..12 {
            let found = descend(&ranges, &starts, allowed, 1, cost, quadratic);
            assert!(found.made <= allowed, "{found:?}");
            assert!(found.cost <= cost(&starts[usize::from(allowed > 1)]));
        }
    }

    #[test]
    fn what_a_start_leaves_of_the_evaluations_goes_to_the_next() {
        // Two valleys, of cost 1 about -2 and of cost 0 about 2; the cheapest start is in the
        // first.
        let residual = |x: f64| {
            if x < 0.0 {
                [x + 2.0, 1.0]
            } else {
                [x - 2.0, 0.0]
            }
        };
        let cost = |place: &[f64]| residual(place[0]).iter().map(|r| r * r).sum();
        let linearise = |place: &[f64]| {
            let mut sum = Quadratic::zero(1);
            sum.add(residual(place[0])[0], &[1.0]);
            Some(sum)
        };
        let starts = [vec![4.5], vec![-2.5], vec![9.0]];
        let found = |allowed| descend(&[[-9.0, 9.0]], &starts, allowed, 1, cost, linearise);
        assert!((found(7).cost - 1.0).abs() < 1e-2, "{:?}", found(7));
        assert!(found(40).cost < 1e-3, "{:?}", found(40));
    }

    #[test]
    fn derivatives_that_promise_what_no_step_gives_are_a_stall() {
        let wrong = |_: &[f64]| {
            Some(Quadratic {
                gradient: vec![1.0, 0.0],
                normal: vec![vec![1.0, 0.0], vec![0.0, 1.0]],
            })
        };
        let rising = |place: &[f64]| 1.0 + (place[0] - 0.3).abs();
        let found = descend(&[[-5.0, 5.0]; 2], &[vec![0.3, 0.0]], 60, 1, rising, wrong);
        assert_eq!(found.ended, Ended::Stalled);
        assert_eq!(found.cost, 1.0);
    }
}
