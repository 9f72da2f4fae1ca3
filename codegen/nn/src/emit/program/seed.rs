//! The end of a network whose weights are the adjoints to begin with.

use crate::emit::plan::{BLOCK, Plan};
use crate::{Activation, Op};

/// The end of a network whose derivatives begin at weights.
#[derive(Clone, Copy)]
pub(super) struct Seed {
    /// The dense layer.
    pub(super) dense: usize,
    /// An activation of the layer before it, in its place, whose slopes go into the seed.
    pub(super) inner: Option<usize>,
    /// An activation of the dense layer, in its place.
    pub(super) outer: Option<usize>,
    /// A scale at the very end.
    pub(super) scale: Option<usize>,
    /// The node whose adjoints the seed gives.
    pub(super) begin: usize,
    /// True if the inner activation is a rectifier after a dense layer of the input: its shut units
    /// are skipped.
    pub(super) rectified: bool,
}

/// The units that `rectified_back` is for.
const RECTIFIED: usize = 8;
/// The outputs from which on it pays, whatever the input (docs/lab/0048-inactive-relu-units.md).
const RESULTS: usize = 3;

impl Seed {
    /// The end of a network, if it is a dense layer, perhaps with an activation in its place,
    /// perhaps with a scale after it, and nothing is remembered.
    pub(super) fn of(plan: &Plan<'_>) -> Option<Self> {
        if plan.is_stateful() || plan.network.outputs() > BLOCK {
            return None;
        }
        let nodes = &plan.network.nodes;
        let mut end = nodes.len() - 1;
        let mut scale = None;
        // Gains by channel are gains by output where there is one axis.
        if matches!(nodes[end].op, Op::Scale { .. }) && nodes[end].shape.len() == 1 {
            scale = Some(end);
            end = nodes[end].from[0];
            if plan.readers(end) != 1 {
                return None;
            }
        }
        let (dense, outer) = match nodes[end].op {
            Op::Activation(_) if plan.is_in_place(end) => (nodes[end].from[0], Some(end)),
            _ => (end, None),
        };
        if !matches!(nodes[dense].op, Op::Dense(_)) {
            return None;
        }
        let from = nodes[dense].from[0];
        // Read by others too, its adjoints would have more than one source.
        if !plan.is_read_once(from) {
            return None;
        }
        let inner = plan.fused(from).then_some(from);
        let begin = if inner.is_some() {
            nodes[from].from[0]
        } else {
            from
        };
        let rectified = inner
            .is_some_and(|inner| matches!(nodes[inner].op, Op::Activation(Activation::Relu)))
            && nodes[begin].len() == RECTIFIED
            && nodes[dense].len() >= RESULTS
            && matches!(nodes[begin].op, Op::Dense(_))
            && plan.buffer[nodes[begin].from[0]] == 0;
        Some(Self {
            dense,
            inner,
            outer,
            scale,
            begin,
            rectified,
        })
    }
}
