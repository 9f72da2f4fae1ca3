//! Mean, sum and largest over axes.

use super::file::Operator;
use super::{Import, product, tensor};
use crate::{NetworkError, Op, Pool, PoolKind, Window};

impl Import<'_> {
    /// The mean, sum or largest over all axes between the batch and the last.
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
        // What is reduced is one run of axes, and what stands before it is 1.
        let run = axes.windows(2).all(|pair| pair[1] == pair[0] + 1);
        let (first, after) = (
            axes.first().copied().unwrap_or(-1),
            axes.last().map_or(0, |axis| axis + 1),
        );
        let inside = run && first >= 0 && after <= count;
        let outer: usize = if inside {
            product(&input.shape[..first as usize])
        } else {
            0
        };
        if outer != 1 {
            return Err(NetworkError::unsupported(
                name,
                format!("a reduction of {:?} over the axes {axes:?}", input.shape),
                "all axes between the batch and the channels work, as in GlobalAveragePooling2D",
            ));
        }
        let reduced = product(&input.shape[first as usize..after as usize]);
        let channels = product(&input.shape[after as usize..]);
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
        let mut from = x;
        if self.network.nodes[x].shape != [reduced, channels] {
            let rows = Op::Reshape(vec![reduced, channels]);
            from = self
                .network
                .push(&self.free_name(&format!("{name} rows")), rows, vec![x])?;
        }
        let pool = Op::Pool(Pool { window, kind });
        let mut pool =
            self.network
                .push(&self.free_name(&format!("{name} pool")), pool, vec![from])?;
        if operator.code == 74 {
            let op = self.scale(pool, reduced as f32);
            pool = self
                .network
                .push(&self.free_name(&format!("{name} sum")), op, vec![pool])?;
        }
        self.network
            .push(name, Op::Reshape(vec![channels]), vec![pool])
    }
}
