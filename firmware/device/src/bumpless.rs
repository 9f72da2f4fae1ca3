//! Bumpless transfer: the reference starts at the present output.
//!
//! `r'(k+j) = r(k+j) + (1 - (k+j)/n) (y(0) - r(0))` for k + j < n, and `r` from then on: the
//! reference as asked, reached in a straight line over n steps (docs/reference/protocol.md,
//! "Arming").

/// Reference ramp: the part of the first error that is still taken out. Physical units.
///
/// ```
/// use sinew_device::bumpless::BumplessTransfer;
///
/// // The output is at 2, the reference at 1: over four steps the reference comes from 2 to 1.
/// let mut transfer = BumplessTransfer::over(4);
/// let mut preview = [[1.0_f32]; 4];
/// transfer.apply(&[2.0], &mut preview);
/// assert_eq!(preview, [[1.75], [1.5], [1.25], [1.0]]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BumplessTransfer<const NY: usize> {
    offset: [f32; NY],
    steps: u16,
    left: u16,
    /// The first complete sample is yet to come.
    waiting: bool,
}

impl<const NY: usize> BumplessTransfer<NY> {
    /// Takes nothing out.
    pub const NONE: Self = Self {
        offset: [0.0; NY],
        steps: 0,
        left: 0,
        waiting: false,
    };

    /// Begins at the next complete sample and lasts `steps`; 0: not at all.
    pub const fn over(steps: u16) -> Self {
        Self {
            offset: [0.0; NY],
            steps,
            left: steps,
            waiting: steps > 0,
        }
    }

    /// Moves the preview r(k+1) .. r(k+N) of the sample `y` (NaN: missing).
    pub fn apply<const N: usize>(&mut self, y: &[f32; NY], reference: &mut [[f32; NY]; N]) {
        if self.left == 0 {
            return;
        }
        if let (true, Some(first)) = (self.waiting, reference.first()) {
            if !y.iter().chain(first).all(|value| value.is_finite()) {
                // Nothing is known to start from; the controller predicts or refuses this sample.
                return;
            }
            for ((offset, y), r) in self.offset.iter_mut().zip(y).zip(first) {
                *offset = *y - *r;
            }
            self.waiting = false;
        }
        for (ahead, row) in (1..=self.left).zip(reference.iter_mut()) {
            let share = f32::from(self.left - ahead) / f32::from(self.steps);
            for (r, offset) in row.iter_mut().zip(&self.offset) {
                *r += share * offset;
            }
        }
        self.left -= 1;
    }
}
