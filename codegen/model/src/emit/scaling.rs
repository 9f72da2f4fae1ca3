//! Printed scalings of the signals of one role.

use crate::spec::{ModelSpec, Role};
use sinew_nn::literal;

/// `Scaling` of a role; of channels with those of the hidden state behind them.
pub(super) fn scaling(spec: &ModelSpec, role: Role) -> String {
    let signals = spec.signals(role);
    // A hidden state has no unit.
    let hidden = match role {
        Role::Channel => spec.hidden_state_len(),
        _ => 0,
    };
    let plain = |value| std::iter::repeat_n(literal::float(value), hidden);
    let spans = signals.iter().map(|s| literal::float(s.span as f32));
    let offsets = signals.iter().map(|s| literal::float(s.offset as f32));
    let (spans, offsets) = (spans.chain(plain(1.0)), offsets.chain(plain(0.0)));
    format!(
        "Scaling {{\n        span: {},\n        offset: {},\n    }}",
        literal::block(spans, 8, 7),
        literal::block(offsets, 8, 9)
    )
}
