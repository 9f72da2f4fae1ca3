//! The emitted `src/network.rs`: weights in flash and the calls that apply them.
//!
//! Both functions of the model go through one `forward`, which is what makes their outputs the same
//! bits. The Jacobian is taken from the output side (docs/codegen.md, eq. 5).

use super::{HEADER, rust};
use crate::spec::{Activation, Dense, Layer, ModelSpec, OutputForm};

pub(super) fn print(spec: &ModelSpec) -> String {
    let layers: Vec<&Dense> = spec
        .layers
        .iter()
        .map(|Layer::Dense(dense)| dense)
        .collect();
    let weights: String = layers
        .iter()
        .enumerate()
        .map(|(i, d)| weights(i + 1, d))
        .collect();
    let fields = fields(&layers);
    let forward = forward(&layers);
    let jacobian = jacobian(&layers);
    let last = layers.len();
    let (y, predict, identity) = match spec.form {
        OutputForm::Absolute => ("the next output", format!("forward(x).a{last}"), ""),
        OutputForm::Increment => (
            "the change of the output",
            format!("next(x, &forward(x).a{last})"),
            "        network::add_identity(jacobian);\n",
        ),
    };
    let result = match spec.form {
        OutputForm::Absolute => format!("a.a{last}"),
        OutputForm::Increment => format!("next(x, &a.a{last})"),
    };
    let next = match spec.form {
        OutputForm::Absolute => "",
        OutputForm::Increment => NEXT,
    };
    format!(
        "//! The predictor: weights in flash, no state.
//!
//! {HEADER}

use sinew_firmware::model::{{self, Model}};
use sinew_firmware::network;

use crate::control::{{NS, NU, NY, PAST_INPUTS, PAST_OUTPUTS}};

type Regressor = model::Regressor<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;
type Jacobian = model::Jacobian<NU, NY, PAST_INPUTS, PAST_OUTPUTS>;

/// The network of this model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network;

impl Model<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS> for Network {{
    #[inline]
    fn predict(&self, x: &Regressor) -> [f32; NY] {{
        {predict}
    }}

    #[inline]
    fn predict_with_jacobian(&self, x: &Regressor, jacobian: &mut Jacobian) -> [f32; NY] {{
        let a = forward(x);
{jacobian}{identity}        {result}
    }}
}}

/// What the layers give; the last is {y}.
struct Activations {{
{fields}}}

/// The layers in turn; everything that predicts goes through here, so that the bits are the same.
#[inline(always)]
fn forward(x: &Regressor) -> Activations {{
    let x = network::flatten(x);
{forward}}}
{next}{weights}"
    )
}

const NEXT: &str = "
/// The network gives the change from y(k) to y(k+1).
#[inline(always)]
fn next(x: &Regressor, change: &[f32; NY]) -> [f32; NY] {
    core::array::from_fn(|i| x.y[0][i] + change[i])
}
";

/// Layers whose outputs are looked at after the forward pass: the last, and those whose slope is
/// computed from them.
fn kept<'a>(layers: &'a [&Dense]) -> impl Iterator<Item = (usize, &'a Dense)> {
    let curved =
        |n: usize, dense: &Dense| n == layers.len() || dense.activation != Activation::Linear;
    let numbered = layers.iter().enumerate().map(|(i, dense)| (i + 1, *dense));
    numbered.filter(move |(n, dense)| curved(*n, dense))
}

fn fields(layers: &[&Dense]) -> String {
    kept(layers)
        .map(|(n, dense)| format!("    a{n}: [f32; {}],\n", dense.outputs))
        .collect()
}

fn forward(layers: &[&Dense]) -> String {
    let mut text = String::new();
    let mut before = String::from("x");
    for (index, dense) in layers.iter().enumerate() {
        let n = index + 1;
        text.push_str(&format!(
            "    let mut a{n} = [0.0; {}];\n    network::dense(&W{n}, &B{n}, &{before}, &mut a{n});\n",
            dense.outputs
        ));
        match dense.activation {
            Activation::Linear => {}
            Activation::Tanh => text.push_str(&format!("    network::tanh(&mut a{n});\n")),
            Activation::Relu => text.push_str(&format!("    network::relu(&mut a{n});\n")),
        }
        before = format!("a{n}");
    }
    let names: Vec<String> = kept(layers).map(|(n, _)| format!("a{n}")).collect();
    text + &rust::structure("Activations", &names, 4) + "\n"
}

/// From the output side to the first layer: `d{n}` are the slopes of layer n, `t{n}` the derivative
/// of the outputs with respect to what it computes before its activation, transposed.
fn jacobian(layers: &[&Dense]) -> String {
    let last = layers.len();
    let mut lines = Vec::new();
    let slope = |n: usize| slope(n, layers[n - 1]);
    let zeros = |n: usize| format!("let mut t{n} = [[0.0; NY]; {}];", layers[n - 1].outputs);
    if last == 1 {
        lines.extend([slope(1), zeros(1)]);
        lines.push("network::seed_diagonal(&d1, &mut t1);".into());
    } else {
        let n = last - 1;
        match layers[last - 1].activation {
            Activation::Linear => {
                lines.extend([slope(n), zeros(n)]);
                lines.push(format!("network::seed_linear(&W{last}, &d{n}, &mut t{n});"));
            }
            Activation::Tanh | Activation::Relu => {
                lines.extend([slope(last), slope(n), zeros(n)]);
                lines.push(format!(
                    "network::seed(&W{last}, &d{last}, &d{n}, &mut t{n});"
                ));
            }
        }
        for n in (1..last - 1).rev() {
            lines.extend([slope(n), zeros(n)]);
            lines.push(format!(
                "network::chain(&t{0}, &W{0}, &d{n}, &mut t{n});",
                n + 1
            ));
        }
    }
    lines.push("network::input_jacobian(&t1, &W1, jacobian);".into());
    lines
        .iter()
        .map(|line| format!("        {line}\n"))
        .collect()
}

fn slope(n: usize, dense: &Dense) -> String {
    match dense.activation {
        Activation::Linear => format!("let d{n} = [1.0; {}];", dense.outputs),
        Activation::Tanh => format!("let d{n} = network::tanh_slope(&a.a{n});"),
        Activation::Relu => format!("let d{n} = network::relu_slope(&a.a{n});"),
    }
}

fn weights(n: usize, dense: &Dense) -> String {
    let numbers = |values: &[f32]| values.iter().copied().map(rust::float).collect::<Vec<_>>();
    let rows = rust::matrix(dense.rows().map(numbers), 0);
    let bias = rust::block(numbers(&dense.bias), 0);
    let (inputs, outputs) = (dense.inputs, dense.outputs);
    format!(
        "
/// Layer {n}, one row for each of its {outputs_words}.
#[rustfmt::skip]
static W{n}: [[f32; {inputs}]; {outputs}] = {rows};

/// Layer {n}, bias.
#[rustfmt::skip]
static B{n}: [f32; {outputs}] = {bias};
",
        outputs_words = rust::count(outputs, "output")
    )
}
