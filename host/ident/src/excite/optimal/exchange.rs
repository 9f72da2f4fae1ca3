//! Exchange of segments (Fedorov): designs of the best segments of a library, one replaced at a
//! time until none improves it.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::information::Information;
use super::score::Goal;
use super::segment::{Segment, UNITS};
use crate::order;

/// Lengths of the segments of a design, each list [`UNITS`] in all.
const LAYOUTS: [&[usize]; 4] = [
    &[1; UNITS],
    &[1, 1, 1, 1, 2, 2],
    &[1, 1, 2, 2, 2],
    &[2, 2, 2, 2],
];
/// Random starts of each layout.
const STARTS: usize = 3;
/// Most rounds over all segments of a design.
const ROUNDS: usize = 12;

/// Segments with what each of them tells.
pub(super) struct Library {
    pub(super) segments: Vec<Segment>,
    pub(super) information: Vec<Information>,
}

/// Designs as indices of the library, the best first, no two alike.
pub(super) fn designs(library: &Library, goal: &Goal, random: &mut ChaCha8Rng) -> Vec<Vec<usize>> {
    let mut found: Vec<(f64, Vec<usize>)> = Vec::new();
    for layout in LAYOUTS {
        for _ in 0..STARTS {
            let mut design: Vec<usize> = (layout.iter())
                .map(|&length| library.draw(length, random))
                .collect();
            let worth = library.improve(goal, &mut design);
            design.sort_unstable();
            if found.iter().all(|(_, known)| *known != design) {
                found.push((worth, design));
            }
        }
    }
    order::sort_down(&mut found, |it| it.0);
    found.into_iter().map(|(_, design)| design).collect()
}

impl Library {
    /// A segment of a length, at random; of any, where the library has none of it.
    pub(super) fn draw(&self, length: usize, random: &mut ChaCha8Rng) -> usize {
        let all = 0..self.segments.len();
        let able: Vec<usize> = all.filter(|&k| self.segments[k].length == length).collect();
        match able.len() {
            0 => random.random_range(0..self.segments.len()),
            count => able[random.random_range(0..count)],
        }
    }

    /// Replaces one segment after another by the one of its length that improves the design most;
    /// returns its worth.
    fn improve(&self, goal: &Goal, design: &mut [usize]) -> f64 {
        let all = design.iter().map(|&index| &self.information[index]);
        let mut worth = worth(Information::sum(all), goal);
        for _ in 0..ROUNDS {
            let before = worth;
            for place in 0..design.len() {
                let others = design.iter().enumerate().filter(|(k, _)| *k != place);
                let rest = Information::sum(others.map(|(_, &index)| &self.information[index]));
                let length = self.segments[design[place]].length;
                for (next, own) in self.information.iter().enumerate() {
                    if self.segments[next].length != length {
                        continue;
                    }
                    let tried = self::worth(Information::sum(rest.iter().chain([own])), goal);
                    if tried > worth {
                        (worth, design[place]) = (tried, next);
                    }
                }
            }
            if worth <= before {
                break;
            }
        }
        worth
    }
}

fn worth(sum: Option<Information>, goal: &Goal) -> f64 {
    sum.map_or(f64::NEG_INFINITY, |sum| goal.worth(&sum.measure()))
}
