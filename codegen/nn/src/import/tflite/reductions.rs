//! Mean, sum and largest over axes.

use super::file::Operator;
use super::{Import, held, product, tensor};
use crate::import::shapes;
use crate::{NetworkError, Op, Pool, PoolKind, Window};

impl Import<'_> {
    /// The mean, sum or largest over axes.
    pub(super) fn reduce(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let input = tensor(self.model, operator.inputs.first().copied().unwrap_or(-1))?;
        let axes = &tensor(self.model, operator.inputs.get(1).copied().unwrap_or(-1))?.integers;
        let count = input.shape.len() as i64;
        let mut axes: Vec<i64> = axes
            .iter()
            .map(|&axis| if axis < 0 { axis + count } else { axis })
            .collect();
        axes.sort_unstable();
        axes.dedup();
        let dims = input.shape.clone();
        let inside = axes.iter().all(|axis| (0..count).contains(axis));
        if !inside || axes.is_empty() || product(&dims) != self.network.nodes[x].len() {
            return Err(NetworkError::unsupported(
                name,
                format!("a reduction of {dims:?} over the axes {axes:?}"),
                "constant axes work",
            ));
        }
        // The axes that are reduced come first.
        let axes: Vec<usize> = axes.iter().map(|&axis| axis as usize).collect();
        let rest = (0..dims.len()).filter(|axis| !axes.contains(axis));
        let order: Vec<usize> = axes.iter().copied().chain(rest).collect();
        let reduced: usize = axes.iter().map(|&axis| dims[axis]).product();
        let channels = product(&dims) / reduced.max(1);
        let stride = |axis: usize| dims[axis + 1..].iter().product::<usize>();
        let mut places = vec![0];
        for &axis in &order {
            places = places
                .iter()
                .flat_map(|&place| (0..dims[axis]).map(move |i| (place, i)))
                .map(|(place, i)| place + i * stride(axis))
                .collect();
        }
        let window = Window {
            size: [1, reduced],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let kind = if operator.code == 82 {
            PoolKind::Max
        } else {
            PoolKind::Average
        };
        let from = if places.is_sorted() {
            self.network.reshaped(name, x, &[reduced, channels])?
        } else {
            let op = shapes::selection(&places, vec![reduced, channels]);
            self.network.append(name, op, &[x])?
        };
        let pool = Op::Pool(Pool { window, kind });
        let mut pool = self.network.append(name, pool, &[from])?;
        if operator.code == 74 {
            pool = self.network.scaled(name, pool, reduced as f32, 0.0)?;
        }
        let output = operator.outputs.first().copied().unwrap_or(-1);
        let shape = held(&tensor(self.model, output)?.shape, channels);
        self.network.append(name, Op::Reshape(shape), &[pool])
    }
}
