//! Parts of `src/network.rs` for a first layer that is a GRU or an LSTM: its weights, its hidden
//! state as channels that the model predicts, and derivatives along directions.

use super::backward::{chain, slope};
use crate::spec::{Layer, ModelSpec, OutputForm};
use sinew_nn::emit::{Weights, recurrent_weights};
use sinew_nn::{Cell, Recurrent};

/// The kernel's module.
pub(super) fn module(layer: &Recurrent) -> &'static str {
    match layer.cell {
        Cell::Lstm { .. } => "lstm",
        _ => "gru",
    }
}

/// The parts of the hidden state: their field in what a step leaves, and where each begins.
fn parts(layer: &Recurrent) -> Vec<(&'static str, &'static str, String)> {
    let all = [
        ("state", "h", "MEASURED".to_string()),
        ("cell", "c", format!("MEASURED + {}", layer.units)),
    ];
    all.into_iter().take(layer.cell.vectors()).collect()
}

/// `&h` or `(&h, &c)`, each name by `of`.
fn together(layer: &Recurrent, of: impl Fn(&str) -> String) -> String {
    let names: Vec<String> = parts(layer).iter().map(|(_, name, _)| of(name)).collect();
    match names.as_slice() {
        [one] => one.clone(),
        _ => format!("({})", names.join(", ")),
    }
}

pub(super) fn weights(n: usize, layer: &Recurrent) -> String {
    let (_, kind, value) = recurrent_weights(layer, Weights::Float32);
    let units = layer.units;
    format!(
        "
/// Layer {n}, {units} units, the gates in the order of its kernel.
#[rustfmt::skip]
static L{n}: {kind} = {value};
"
    )
}

/// Imports of a recurrent layer.
pub(super) fn uses(layer: &Recurrent) -> String {
    let kind = match layer.cell {
        Cell::Lstm { .. } => "Lstm",
        _ => "Gru",
    };
    let module = module(layer);
    format!(
        "use crate::layers::activation::{{Sigmoid, Tanh}};\nuse crate::layers::{module}::{{self, {kind}}};\n"
    )
}

/// The step, `x` the regressor before and the layer's input after it.
pub(super) fn forward(layer: &Recurrent) -> String {
    let mut text = String::new();
    for (_, name, start) in parts(layer) {
        text += &format!("    let {name} = recurrent::at(&x.s, {start}, 0.0);\n");
    }
    let state = together(layer, |name| format!("&{name}"));
    let module = module(layer);
    text + &format!(
        "    let x = recurrent::input(x);\n    \
         {module}::step(&L1, Sigmoid, Tanh, &x, {state}, &mut a.a1);\n"
    )
}

/// From `t1`, the adjoints of the layer's results, to `t_x`, those of its input, `columns` results
/// at once.
fn backward(layer: &Recurrent, columns: &str) -> Vec<String> {
    let (inputs, module) = (layer.inputs(), module(layer));
    let state = match layer.cell {
        Cell::Lstm { .. } => "(&mut t1, &mut c1)",
        _ => "&mut t1",
    };
    vec![
        format!("let mut t_x = [[0.0; {columns}]; {inputs}];"),
        format!("{module}::step_back(&L1, Sigmoid, Tanh, &a.a1, {state}, &mut t_x);"),
    ]
}

/// From the output side to `t_x`.
fn outputs_backward(layers: &[Layer], layer: &Recurrent) -> Vec<String> {
    let mut lines = chain(layers);
    if let Cell::Lstm { .. } = layer.cell {
        lines.push(format!("let mut c1 = [[0.0; NY]; {}];", layer.units));
    }
    lines.extend(backward(layer, "NY"));
    lines
}

/// The derivatives of the outputs by commands and outputs.
pub(super) fn jacobian(layers: &[Layer], layer: &Recurrent) -> Vec<String> {
    let mut lines = outputs_backward(layers, layer);
    lines.push("recurrent::enter_jacobian(&t_x, jacobian);".into());
    lines
}

/// Sensitivity propagation by products with directions.
pub(super) const PROPAGATE_CHANNELS: &str = "
    #[inline(never)]
    fn propagate_channels(
        &self,
        a: &Activations,
        stage: &Stage,
        sensitivities: &mut Sensitivities,
        channels: &mut [[[f32; NU]; NS]],
    ) {
        sensitivity::propagate_along(stage, sensitivities, channels, |direction| {
            along(a, direction)
        });
    }
";

/// Further functions of the implementation of `Model`.
pub(super) fn functions(spec: &ModelSpec, layer: &Recurrent) -> String {
    let enter: String = parts(layer)
        .iter()
        .map(|(field, _, start)| {
            format!("        recurrent::enter(&a.a1.{field}, {start}, &mut s);\n")
        })
        .collect();
    let (units, hidden) = (layer.units, spec.hidden_state_len());
    let adjoints = match layer.cell {
        Cell::Lstm { .. } => "&[&t1, &c1]",
        _ => "&[&t1]",
    };
    let mut lines = outputs_backward(&spec.layers, layer);
    lines.push(format!(
        "recurrent::enter_by_channels(&t_x, {adjoints}, jacobian);"
    ));
    if spec.skip.is_some() && !spec.channels.is_empty() {
        lines.push("recurrent::add_path(&SKIP, jacobian);".into());
    }
    lines.push(format!(
        "let mut t1 = recurrent::unit::<{units}, {hidden}>(0);"
    ));
    if let Cell::Lstm { .. } = layer.cell {
        lines.push(format!(
            "let mut c1 = recurrent::unit::<{units}, {hidden}>({units});"
        ));
    }
    lines.extend(backward(layer, &hidden.to_string()));
    lines.push(format!(
        "recurrent::enter_of_channels(&t_x, {adjoints}, jacobian);"
    ));
    let lines: String = lines
        .iter()
        .map(|line| format!("        {line}\n"))
        .collect();
    format!(
        "
    fn channels(&self, x: &Regressor, a: &Activations) -> [f32; NS] {{
        let mut s = x.s;
{enter}        s
    }}

    fn channel_jacobian(&self, a: &Activations, jacobian: &mut ChannelJacobian) {{
{lines}    }}
"
    )
}

/// The derivatives of the next output and channels along a direction.
pub(super) fn along(spec: &ModelSpec, layer: &Recurrent) -> String {
    let module = module(layer);
    let mut lines = vec!["let x = recurrent::input_along(direction);".to_string()];
    for (_, name, start) in parts(layer) {
        lines.push(format!(
            "let {name} = recurrent::at(direction.s, {start}, [0.0; NU]);"
        ));
    }
    let (new, old) = (
        together(layer, |name| name.to_string()),
        together(layer, |name| format!("&{name}")),
    );
    lines.push(format!(
        "let {new} = {module}::step_along(&L1, Sigmoid, Tanh, &a.a1, &x, {old});"
    ));
    let last = spec.layers.len();
    for (n, layer) in (2..).zip(spec.layers.iter().skip(1)) {
        lines.push(slope(n, layer));
        let before = match n {
            2 => "h".into(),
            n => format!("v{}", n - 1),
        };
        let (name, mutable) = if n == last {
            ("y".into(), "mut ")
        } else {
            (format!("v{n}"), "")
        };
        lines.push(format!(
            "let {mutable}{name} = recurrent::dense_along(&W{n}, &d{n}, &{before});"
        ));
    }
    if spec.skip.is_some() {
        lines.push("recurrent::add_along(&SKIP, &x, &mut y);".into());
    }
    if spec.form == OutputForm::Increment {
        lines.push("recurrent::add_present(direction, &mut y);".into());
    }
    lines.push("let mut s = *direction.s;".into());
    for (_, name, start) in parts(layer) {
        lines.push(format!("recurrent::enter(&{name}, {start}, &mut s);"));
    }
    let lines: String = lines.iter().map(|line| format!("    {line}\n")).collect();
    // Without a path or an increment the output is not added to.
    let lines = if lines.contains("&mut y") {
        lines
    } else {
        lines.replace("let mut y", "let y")
    };
    format!(
        "
/// The derivatives of the next output and channels along a direction, for every command at once.
#[inline(always)]
fn along(a: &Activations, direction: &Direction) -> ([[f32; NU]; NY], [[f32; NU]; NS]) {{
{lines}    (y, s)
}}
"
    )
}
