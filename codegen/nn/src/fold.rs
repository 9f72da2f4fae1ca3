//! Constant folding, once instead of at every call: batch normalisation and scaling go into the
//! weights beside them, orders of axes into the columns of a dense layer, and layers without an
//! effect go.

use super::{Activation, Dense, Network, Op};

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

    /// A scale or an order of axes before layer `place` into its weights.
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
        let dense = matches!(self.nodes[place].op, Op::Dense(_));
        if !dense && !path.is_empty() {
            return false;
        }
        match self.nodes[source].op.clone() {
            Op::Permute(axes) => {
                let shape = self.nodes[before].shape.clone();
                let Op::Dense(dense) = &mut self.nodes[place].op else {
                    return false;
                };
                permute_columns(dense, &axes, &shape);
            }
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

fn permute_columns(dense: &mut Dense, axes: &[usize], shape: &[usize]) {
    // Place, in what is read now, of each value of what was read.
    let stride = |axis: usize| shape[axis + 1..].iter().product::<usize>();
    let mut places = vec![0];
    for &axis in axes {
        places = places
            .iter()
            .flat_map(|&place| (0..shape[axis]).map(move |i| (place, i)))
            .map(|(place, i)| place + i * stride(axis))
            .collect();
    }
    for row in dense.weights.chunks_mut(places.len()) {
        let old = row.to_vec();
        for (&place, value) in places.iter().zip(old) {
            row[place] = value;
        }
    }
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
