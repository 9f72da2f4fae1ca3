//! The sample that the next tick answers.

use sinew_device::protocol::ToDevice;

/// Holds one sample. A later one replaces it; taken once, it counts as missing afterwards.
pub struct Newest {
    sample: Option<ToDevice>,
    fresh: bool,
}

impl Newest {
    /// No sample yet.
    #[expect(clippy::new_without_default, reason = "made once a program")]
    pub const fn new() -> Self {
        Self {
            sample: None,
            fresh: false,
        }
    }

    /// A sample has arrived.
    pub fn put(&mut self, sample: ToDevice) {
        self.sample = Some(sample);
        self.fresh = true;
    }

    /// Sample to answer now: the newest, or, if it was answered before, the same with every
    /// output missing, which the controller then predicts. `None` before the first.
    pub fn take(&mut self) -> Option<&ToDevice> {
        if !core::mem::take(&mut self.fresh)
            && let Some(ToDevice::Sample { y, .. }) = &mut self.sample
        {
            y.fill(f32::NAN);
        }
        self.sample.as_ref()
    }
}
