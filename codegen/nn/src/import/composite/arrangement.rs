//! Values repeated, padded and chosen along axes.

use crate::import::shapes::{self, spread_places};
use crate::{Network, NetworkError, Op, Selection};

impl Network {
    /// The value repeated along axes of length 1 to `shape`, which has as many axes.
    ///
    /// # Errors
    /// The shapes do not go together.
    pub(in crate::import) fn spread(
        &mut self,
        name: &str,
        x: usize,
        shape: &[usize],
    ) -> Result<usize, NetworkError> {
        let own = self.nodes[x].shape.clone();
        if own == shape {
            return Ok(x);
        }
        let fits =
            own.len() == shape.len() && own.iter().zip(shape).all(|(&n, &m)| n == 1 || n == m);
        if !fits {
            let message = format!("values of shapes {own:?} and {shape:?} beside each other");
            let nearest = "values of equal shape, and axes of length 1, work";
            return Err(NetworkError::unsupported(name, message, nearest));
        }
        let op = shapes::selection(&spread_places(&own, shape), shape.to_vec());
        self.append(name, op, &[x])
    }

    /// Values of shapes that differ by axes of length 1, brought to one shape.
    ///
    /// # Errors
    /// The shapes do not go together.
    pub(in crate::import) fn alike(
        &mut self,
        name: &str,
        from: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let mut shape = Vec::new();
        for &x in from {
            let own = &self.nodes[x].shape;
            shape.resize(own.len().max(shape.len()), 1);
            for (axis, n) in shape.iter_mut().zip(own) {
                *axis = (*axis).max(*n);
            }
        }
        from.iter().map(|&x| self.spread(name, x, &shape)).collect()
    }

    /// The values padded by zeros along each axis, `[before, after]`; negative numbers cut off.
    ///
    /// # Errors
    /// Nothing is left, or too much.
    pub(in crate::import) fn padded(
        &mut self,
        name: &str,
        x: usize,
        pads: &[[i64; 2]],
    ) -> Result<usize, NetworkError> {
        if pads.iter().all(|pad| *pad == [0; 2]) {
            return Ok(x);
        }
        let (shape, places) = shapes::padded(name, &self.nodes[x].shape, pads)?;
        self.append(name, Op::Select(Selection { places, shape }), &[x])
    }

    /// The values at the given indices of one axis, which keeps its place.
    pub(in crate::import) fn along(
        &mut self,
        name: &str,
        x: usize,
        axis: usize,
        indices: &[usize],
    ) -> Result<usize, NetworkError> {
        let mut shape = self.nodes[x].shape.clone();
        let places = shapes::places_along(&shape, axis, indices);
        shape[axis] = indices.len();
        self.append(name, shapes::selection(&places, shape), &[x])
    }
}
