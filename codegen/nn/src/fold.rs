//! Constant folding, once instead of at every call: batch normalisation and scaling go into the
//! weights beside them, orders of axes into the columns of a dense layer, and layers without an
//! effect go.

use super::{Activation, Dense, Network, Op, Selection};

impl Network {
    /// The same function with fewer layers.
    ///
    /// ```
    /// use sinew_nn::import;
    ///
    /// // dense, tanh, dense, bias: the bias goes into the dense layer.
    /// let network = import::read("examples/mlp.onnx".as_ref())?;
    /// assert_eq!((network.nodes.len(), network.folded().nodes.len()), (5, 4));
    /// # Ok::<(), sinew_nn::NetworkError>(())
    /// ```
    ///
    /// Weights are combined in double precision and rounded once.
    #[must_use]
    pub fn folded(&self) -> Self {
        let mut network = self.clone();
        network.drop_unread();
        while network.fold_one() {}
        network
    }

    /// Removes layers that the output does not depend on.
    pub(crate) fn drop_unread(&mut self) {
        let mut read = vec![false; self.nodes.len()];
        if let (Some(last), Some(node)) = (self.nodes.len().checked_sub(1), self.nodes.last()) {
            read[0] = true;
            read[last] = true;
            let mut waiting = node.from.clone();
            while let Some(place) = waiting.pop() {
                if !std::mem::replace(&mut read[place], true) {
                    waiting.extend(&self.nodes[place].from);
                }
            }
        }
        for place in (0..self.nodes.len()).rev().filter(|&place| !read[place]) {
            self.remove(place, 0);
        }
    }

    /// True if node `place` gives the values that it reads, in their order.
    pub(crate) fn is_no_move(&self, place: usize) -> bool {
        match &self.nodes[place].op {
            Op::Reshape(_) => true,
            Op::Permute(axes) => is_no_move(axes, &self.nodes[self.nodes[place].from[0]].shape),
            _ => false,
        }
    }

    /// Takes node `place` out; what read it reads `instead`, a node before it.
    fn remove(&mut self, place: usize, instead: usize) {
        self.nodes.remove(place);
        for node in &mut self.nodes {
            for from in &mut node.from {
                if *from == place {
                    *from = instead;
                } else if *from > place {
                    *from -= 1;
                }
            }
        }
    }

    /// Number of layers that read node `place`.
    fn readers(&self, place: usize) -> usize {
        self.nodes
            .iter()
            .flat_map(|node| &node.from)
            .filter(|&&from| from == place)
            .count()
    }

    /// One step; false when there is none left.
    fn fold_one(&mut self) -> bool {
        for place in 1..self.nodes.len() {
            let node = &self.nodes[place];
            let from = node.from[0];
            let last = place == self.nodes.len() - 1;
            let done = match &node.op {
                Op::Activation(Activation::Linear) => true,
                Op::Reshape(shape) => *shape == self.nodes[from].shape,
                Op::Permute(axes) => is_no_move(axes, &self.nodes[from].shape),
                Op::Select(selection) => {
                    let all = (0..self.nodes[from].len()).map(Some);
                    selection.shape == self.nodes[from].shape
                        && selection.places.iter().copied().eq(all)
                }
                Op::Scale { .. } => self.readers(from) == 1 && self.scale_into_before(place),
                _ => false,
            };
            // A network has a layer besides its input.
            if done && (from > 0 || !last) {
                let shape = self.nodes[place].shape.clone();
                self.remove(place, from);
                if last {
                    // The result keeps its shape where only the order of axes of length 1 went.
                    if let Some(node) = self.nodes.last_mut() {
                        node.shape = if node.shape.len() == shape.len() {
                            node.shape.clone()
                        } else {
                            shape
                        };
                    }
                }
                return true;
            }
            if self.take_in(place) {
                return true;
            }
        }
        false
    }

    /// A scale into the weights of the layer that it reads.
    fn scale_into_before(&mut self, place: usize) -> bool {
        let Op::Scale { gain, offset } = self.nodes[place].op.clone() else {
            return false;
        };
        let from = self.nodes[place].from[0];
        let flat = self.nodes[from].shape.len() == 1;
        let (weights, bias) = match &mut self.nodes[from].op {
            Op::Dense(dense) if flat => (&mut dense.weights, &mut dense.bias),
            Op::Convolution(layer) => (&mut layer.weights, &mut layer.bias),
            _ => return false,
        };
        let row = weights.len() / bias.len();
        for (i, bias) in bias.iter_mut().enumerate() {
            let (gain, offset) = (f64::from(gain[i]), f64::from(offset[i]));
            *bias = (f64::from(*bias) * gain + offset) as f32;
            for w in &mut weights[i * row..][..row] {
                *w = (f64::from(*w) * gain) as f32;
            }
        }
        true
    }

    /// A scale, an order of axes or a choice of values before layer `place` into its weights, its
    /// padding or its own choice.
    fn take_in(&mut self, place: usize) -> bool {
        // Past layers that only change the shape.
        let mut source = self.nodes[place].from.first().copied().unwrap_or(0);
        let mut path = Vec::new();
        while matches!(self.nodes[source].op, Op::Reshape(_)) {
            path.push(source);
            source = self.nodes[source].from[0];
        }
        let before = self.nodes[source].from.first().copied();
        let Some(before) = before else { return false };
        // What the order of axes was makes no difference to a dense layer; others see the shape.
        let flat = matches!(self.nodes[place].op, Op::Dense(_) | Op::Select(_));
        if !flat && !path.is_empty() {
            return false;
        }
        let before_shape = self.nodes[before].shape.clone();
        match self.nodes[source].op.clone() {
            Op::Permute(axes) => {
                let places = permuted_places(&axes, &before_shape);
                match &mut self.nodes[place].op {
                    Op::Dense(dense) => permute_columns(dense, &places),
                    Op::Select(selection) => {
                        chosen_of(selection, |place| places.get(place).copied());
                    }
                    _ => return false,
                }
            }
            Op::Select(inner) => match &mut self.nodes[place].op {
                Op::Select(selection) => {
                    chosen_of(selection, |place| {
                        inner.places.get(place).copied().flatten()
                    });
                }
                Op::Dense(dense) => {
                    let length = before_shape.iter().product();
                    // The columns of what was not chosen are zeros.
                    if length > inner.places.len() {
                        return false;
                    }
                    spread_columns(dense, &inner.places, length);
                }
                Op::Convolution(layer) => {
                    let Some([before, after]) = padding(&inner, &before_shape) else {
                        return false;
                    };
                    for axis in 0..2 {
                        layer.window.before[axis] += before[axis];
                        layer.window.after[axis] += after[axis];
                    }
                }
                _ => return false,
            },
            Op::Scale { gain, offset } => {
                if !scale_inputs(&mut self.nodes[place].op, &gain, &offset) {
                    return false;
                }
            }
            _ => return false,
        }
        self.nodes[place].from[0] = before;
        self.drop_unread();
        true
    }
}

/// Returns true if an order of axes moves no value.
fn is_no_move(axes: &[usize], shape: &[usize]) -> bool {
    let long: Vec<usize> = axes
        .iter()
        .copied()
        .filter(|&axis| shape[axis] > 1)
        .collect();
    long.is_sorted()
        && axes
            .iter()
            .zip(shape)
            .all(|(&axis, &length)| shape[axis] == length)
}

/// Place, before an order of axes, of each value after it.
fn permuted_places(axes: &[usize], shape: &[usize]) -> Vec<usize> {
    let stride = |axis: usize| shape[axis + 1..].iter().product::<usize>();
    let mut places = vec![0];
    for &axis in axes {
        places = places
            .iter()
            .flat_map(|&place| (0..shape[axis]).map(move |i| (place, i)))
            .map(|(place, i)| place + i * stride(axis))
            .collect();
    }
    places
}

fn permute_columns(dense: &mut Dense, places: &[usize]) {
    for row in dense.weights.chunks_mut(places.len()) {
        let old = row.to_vec();
        for (&place, value) in places.iter().zip(old) {
            row[place] = value;
        }
    }
}

/// A choice among values that stand elsewhere, or nowhere, before.
fn chosen_of(selection: &mut Selection, before: impl Fn(usize) -> Option<usize>) {
    for place in &mut selection.places {
        *place = place.and_then(&before);
    }
}

/// Columns of the `length` values of which those at `places` were read; those of one value add up.
fn spread_columns(dense: &mut Dense, places: &[Option<usize>], length: usize) {
    let rows = dense.weights.chunks(places.len()).map(|old| {
        let mut row = vec![0.0_f64; length];
        for (place, &w) in places.iter().zip(old) {
            if let Some(place) = *place {
                row[place] += f64::from(w);
            }
        }
        row
    });
    dense.weights = rows.flatten().map(|w| w as f32).collect();
}

/// Rows and columns of zeros before and after an image, if a choice is that and nothing else.
fn padding(selection: &Selection, image: &[usize]) -> Option<[[usize; 2]; 2]> {
    let two = |shape: &[usize]| match *shape {
        [columns, channels] => Some(([1, columns], channels)),
        [rows, columns, channels] => Some(([rows, columns], channels)),
        _ => None,
    };
    let ((from, channels), (to, all)) = (two(image)?, two(&selection.shape)?);
    let first = selection
        .places
        .iter()
        .position(|&place| place == Some(0))?;
    let before = [first / channels / to[1], first / channels % to[1]];
    let after = [0, 1].map(|axis| to[axis].checked_sub(from[axis] + before[axis]));
    let [Some(below), Some(beside)] = after else {
        return None;
    };
    let expected = (0..selection.places.len()).map(|place| {
        let (cell, channel) = (place / channels, place % channels);
        let (row, column) = (cell / to[1], cell % to[1]);
        let (row, column) = (row.checked_sub(before[0])?, column.checked_sub(before[1])?);
        let inside = row < from[0] && column < from[1];
        inside.then_some((row * from[1] + column) * channels + channel)
    });
    let alike = channels == all && selection.places.iter().copied().eq(expected);
    alike.then_some([before, [below, beside]])
}

/// `op(gain x + offset)` as an `op(x)` with other weights; false where there is none.
fn scale_inputs(op: &mut Op, gain: &[f32], offset: &[f32]) -> bool {
    let channels = gain.len();
    let (weights, bias) = match op {
        Op::Dense(dense) => (&mut dense.weights, &mut dense.bias),
        Op::Convolution(layer) => {
            let padded = layer.window.before != [0; 2] || layer.window.after != [0; 2];
            // In the padding, which stays zero, the offset would be missing.
            if padded && offset.iter().any(|&offset| offset != 0.0) {
                return false;
            }
            (&mut layer.weights, &mut layer.bias)
        }
        Op::Recurrent(layer) => (&mut layer.kernel, &mut layer.bias),
        _ => return false,
    };
    let row = weights.len() / bias.len();
    for (weights, bias) in weights.chunks_mut(row).zip(bias) {
        let mut sum = f64::from(*bias);
        for (i, w) in weights.iter_mut().enumerate() {
            let wide = f64::from(*w);
            sum += wide * f64::from(offset[i % channels]);
            *w = (wide * f64::from(gain[i % channels])) as f32;
        }
        *bias = sum as f32;
    }
    true
}
