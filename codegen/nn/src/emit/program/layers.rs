//! The pass forward with a call to the reader between its layers: for measurements, in no crate
//! that is printed for use.

use crate::emit::forward;
use crate::emit::plan::Plan;

/// Name of the function of a layer.
pub(in crate::emit) fn function(place: usize) -> String {
    format!("layer_{place}")
}

/// `predict_in_layers`: the values of `predict`, each layer in a function of its own, which is
/// called between two calls of `mark`. `LAYER_BYTES` has the buffers of each layer.
pub(super) fn print(plan: &Plan<'_>, buffers: &[String]) -> String {
    let (parameter, argument, state) = if plan.is_stateful() {
        ("state: &State<N>, ", "state, ", "state: &State, ")
    } else {
        ("", "", "")
    };
    let (mut functions, mut calls) = (String::new(), String::new());
    for place in 1..plan.network.nodes.len() {
        let (name, body) = (function(place), forward::statement(plan, place));
        if !body.is_empty() {
            functions += &format!(
                "#[inline(never)]\n#[allow(unused_variables)]\n\
                 fn {name}<N: Number>(x: &[N; INPUTS], {parameter}a: &mut Activations<N>) {{\n{body}}}\n\n"
            );
            calls += &format!("    {name}(x, {argument}&mut a);\n");
        }
        calls += &format!("    mark({place});\n");
    }
    let result = plan.value(plan.network.nodes.len() - 1);
    format!(
        "/// Bytes of the values and the state of each layer.
pub const LAYER_BYTES: [usize; {count}] = [{buffers}];

{functions}/// The outputs, with a call of `mark` before and after each layer.
pub fn predict_in_layers(x: &[f32; INPUTS], {state}mark: &mut dyn FnMut(usize)) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    // Twice: with nothing between them, they say what a mark takes.
    mark(0);
    mark(0);
{calls}    {result}
}}
",
        count = plan.network.nodes.len(),
        buffers = buffers.join(", "),
    )
}
