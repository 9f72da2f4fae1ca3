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

/// What each layer gives; the last is {y}.
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

fn fields(layers: &[&Dense]) -> String {
    let field =
        |(i, dense): (usize, &&Dense)| format!("    a{}: [f32; {}],\n", i + 1, dense.outputs);
    layers.iter().enumerate().map(field).collect()
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
    let names = (1..=layers.len()).map(|n| format!("a{n}"));
    let names: Vec<String> = names.collect();
    text.push_str(&format!("    Activations {{ {} }}\n", names.join(", ")));
    text
}

/// From the output side to the first layer: `t{n}` is the derivative of the outputs with respect to
/// what layer n computes before its activation, transposed.
fn jacobian(layers: &[&Dense]) -> String {
    let last = layers.len();
    let mut text = String::new();
    let mut declare = |n: usize, call: String| {
        let width = layers[n - 1].outputs;
        text.push_str(&format!(
            "        let mut t{n} = [[0.0; NY]; {width}];\n        {call}\n"
        ));
    };
    let slope = |n: usize| slope(n, layers[n - 1]);
    if last == 1 {
        declare(
            1,
            format!("network::seed_diagonal(&{}, &mut t1);", slope(1)),
        );
    } else {
        let (n, output) = (last - 1, layers[last - 1]);
        declare(
            n,
            match output.activation {
                Activation::Linear => {
                    format!("network::seed_linear(&W{last}, &{}, &mut t{n});", slope(n))
                }
                Activation::Tanh | Activation::Relu => format!(
                    "network::seed(&W{last}, &{}, &{}, &mut t{n});",
                    slope(last),
                    slope(n)
                ),
            },
        );
        for n in (1..last - 1).rev() {
            declare(
                n,
                format!(
                    "network::chain(&t{0}, &W{0}, &{1}, &mut t{n});",
                    n + 1,
                    slope(n)
                ),
            );
        }
    }
    text.push_str("        network::input_jacobian(&t1, &W1, jacobian);\n");
    text
}

fn slope(n: usize, dense: &Dense) -> String {
    match dense.activation {
        Activation::Linear => format!("[1.0; {}]", dense.outputs),
        Activation::Tanh => format!("network::tanh_slope(&a.a{n})"),
        Activation::Relu => format!("network::relu_slope(&a.a{n})"),
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
