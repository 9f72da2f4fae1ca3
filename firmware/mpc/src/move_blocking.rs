//! N1, N2, Nc and move blocking: which steps count, and how few numbers describe the commands
//! (docs/explanation/controller.md, section 2).
//!
//! The plan is piecewise linear: within a block every step makes the same move, so that a command
//! at its rate limit over a whole block is one number, and holding commands is a block whose move
//! is zero. The decision variables are the commands at the ends of the blocks; after the last block
//! the command is held. Blocks of one step each are the classical control horizon.

use crate::chunk::chunk;

/// Position of a command among the decision variables: between the ends of two blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpolation {
    /// The block.
    pub block: usize,
    /// Completed part of the block's move, 0 to 1.
    pub weight: f32,
}

impl Interpolation {
    /// The command here in a plan, each channel between the ends of the block; a block beyond the
    /// plan has no move.
    #[inline(always)]
    pub fn command<const NU: usize, const NV: usize>(
        &self,
        plan: &[f32; NV],
        previous: &[f32; NU],
    ) -> [f32; NU] {
        let before = self.block.checked_sub(1).and_then(|b| chunk(plan, b));
        let mut u = *before.unwrap_or(previous);
        if let Some(ends) = chunk::<_, NV, NU>(plan, self.block) {
            for (u, end) in u.iter_mut().zip(ends) {
                // Exactly the end of the block at its last step.
                *u = end - (1.0 - self.weight) * (end - *u);
            }
        }
        u
    }
}

/// The horizons of a problem: `N` steps are predicted (N2), the commands have `NB` blocks.
///
/// ```
/// use sinew_mpc::Horizons;
///
/// // 10 steps are predicted; commands change over blocks of 1, 2 and 3 steps and are held after.
/// let horizons: Horizons<10, 3> = Horizons::new(1, [1, 2, 3]);
/// assert_eq!(horizons.control_horizon(), 6);
/// // Halfway through the second block.
/// assert_eq!((horizons.interpolation[1].block, horizons.interpolation[1].weight), (1, 0.5));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Horizons<const N: usize, const NB: usize> {
    /// N1: the first predicted step that counts, from 1.
    pub first: usize,
    /// Steps in each block.
    pub length: [u8; NB],
    /// Per step, the block it lies in and how much of the block's move has been made; after the
    /// last block, all of the last.
    pub interpolation: [Interpolation; N],
}

impl<const N: usize, const NB: usize> Horizons<N, NB> {
    /// Every output from `first` (N1, from 1) to `N` counts; `length[b]` steps make the move of
    /// block b.
    ///
    /// A block is at least one step long, and what reaches beyond the horizon is cut off. Never
    /// fails: codegen refuses such lengths before they come here.
    pub const fn new(first: usize, length: [u8; NB]) -> Self {
        let mut horizons = Self {
            first,
            length,
            interpolation: [Interpolation {
                block: 0,
                weight: 1.0,
            }; N],
        };
        let mut step = 0;
        let mut block = 0;
        while block < NB {
            if horizons.length[block] == 0 {
                horizons.length[block] = 1;
            }
            let length = horizons.length[block];
            let mut done = 0;
            while done < length && step < N {
                done += 1;
                horizons.interpolation[step].block = block;
                horizons.interpolation[step].weight = done as f32 / length as f32;
                step += 1;
            }
            block += 1;
        }
        while step < N && NB > 0 {
            horizons.interpolation[step].block = NB - 1;
            step += 1;
        }
        horizons
    }

    /// Everything counts and `NB` commands are decided one by one, the last held: N1 = 1, Nc =
    /// `NB`.
    pub const fn every_step() -> Self {
        Self::new(1, [1; NB])
    }

    /// Nc: steps up to the end of the last block.
    pub const fn control_horizon(&self) -> usize {
        let mut steps = 0;
        let mut block = 0;
        while block < NB {
            steps += self.length[block] as usize;
            block += 1;
        }
        steps
    }
}
