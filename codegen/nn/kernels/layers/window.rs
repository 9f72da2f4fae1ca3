//! The window that convolutions and pools move over an image.

/// Sizes are rows, then columns; an image of one dimension has one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Size of the input image.
    pub image: [usize; 2],
    /// Size of the output image.
    pub output: [usize; 2],
    /// Size of the window.
    pub size: [usize; 2],
    /// Steps between outputs.
    pub stride: [usize; 2],
    /// Steps between elements of the window.
    pub dilation: [usize; 2],
    /// Padding before the first row and column.
    pub before: [usize; 2],
}

impl Window {
    /// Place in the input image of element `(row, column)` of the window for output `(y, x)`; none
    /// in the padding.
    #[inline(always)]
    pub fn place(&self, y: usize, x: usize, row: usize, column: usize) -> Option<usize> {
        let row = (y * self.stride[0] + row * self.dilation[0]).wrapping_sub(self.before[0]);
        let column = (x * self.stride[1] + column * self.dilation[1]).wrapping_sub(self.before[1]);
        (row < self.image[0] && column < self.image[1]).then(|| row * self.image[1] + column)
    }
}
