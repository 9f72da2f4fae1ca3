//! The emitted `src/network.rs`: weights in flash and the calls that apply them.
//!
//! Both functions of the model go through one `forward`, which is what makes their outputs the same
//! bits. The Jacobian is taken from the output side (docs/reference/model-files.md, eq. 5).

use super::backward::chain;
use super::{HEADER, recurrent, soft_sensor};
use crate::spec::{Activation, Dense, Layer, ModelSpec, OutputForm};
use sinew_nn::Recurrent;
use sinew_nn::literal;

pub(super) fn print(spec: &ModelSpec) -> String {
    let layers = &spec.layers[..];
    let recurrent = match &layers[0] {
        Layer::Dense(_) => None,
        Layer::Recurrent(layer) => Some(layer),
    };
    let numbered = layers.iter().zip(1..);
    let weights: String = numbered
        .map(|(layer, n)| match layer {
            Layer::Dense(dense) => weights(n, dense),
            Layer::Recurrent(layer) => recurrent::weights(n, layer),
        })
        .collect();
    let fields = fields(layers);
    let zeros = zeros(layers);
    let mut forward = forward(layers);
    let mut jacobian = jacobian(layers);
    let mut skip = String::new();
    let mut kernels = match recurrent {
        None => "network",
        Some(_) => "network::{self, recurrent}",
    };
    if let Some(values) = &spec.skip {
        let last = layers.len();
        forward.push_str(&format!("    skip::add(&SKIP, &x, &mut a.a{last});\n"));
        jacobian.push_str("    skip::add_jacobian(&SKIP, jacobian);\n");
        skip = skip_connection(spec, values);
        kernels = match recurrent {
            None => "network::{self, skip}",
            Some(_) => "network::{self, recurrent, skip}",
        };
    }
    let last = format!("a.a{}", layers.len());
    // A linear network has the same derivative everywhere.
    let trace = if jacobian.contains("a.a") { "a" } else { "_" };
    let (meaning, result, identity, next) = match spec.form {
        OutputForm::Absolute => ("the next output", last, "", ""),
        // A model with a state is printed elsewhere.
        OutputForm::Increment | OutputForm::State => (
            "the change of the output",
            format!("next(x, &{last})"),
            "    network::add_identity(jacobian);\n",
            NEXT,
        ),
    };
    let Parts {
        uses,
        state,
        types,
        sensitivities,
        constant,
        functions,
        propagation,
        derives,
        input,
        choice,
        first,
        along,
    } = match recurrent {
        None => Parts::dense(soft_sensor::seen(spec)),
        Some(layer) => Parts::recurrent(spec, layer),
    };
    format!(
        "//! The predictor: weights in flash, {state}.
//!
//! {HEADER}

use sinew_mpc::model::{{self, Model}};
use sinew_mpc::{kernels};
use sinew_mpc::rollout;
use sinew_mpc::sensitivity::{{self, Propagate}};

{uses}
type Regressor = model::Regressor<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;
type Jacobian = model::Jacobian<NU, NY, PAST_INPUTS, PAST_OUTPUTS>;
{types}type Stage<'a> = sensitivity::Stage<'a, NY>;
type Sensitivities<'a> = sensitivity::Sensitivities<'a, NU, NY, PAST_OUTPUTS>;
{sensitivities}
/// The network of this model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network;

impl Model<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS> for Network {{
    type Trace = Activations;
    const TRACE: Activations = Activations::ZERO;
{constant}
    fn predict(&self, x: &Regressor, a: &mut Activations) -> [f32; NY] {{
        forward(x, a);
        {result}
    }}

    fn jacobian(&self, a: &Activations, jacobian: &mut Jacobian) {{
        derive(a, {choice}jacobian);
    }}
{functions}}}

impl Propagate<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS> for Network {{
    #[inline(never)]
    fn advance(
        &self,
        x: &mut Regressor,
        u: &[f32; NU],
        d: &[f32; NY],
        a: &mut Activations,
    ) -> [f32; NY] {{
        rollout::advance(self, x, u, d, a)
    }}
{propagation}}}

/// Outputs of the layers; the last is {meaning}.
#[derive({derives})]
pub struct Activations {{
{fields}}}

impl Activations {{
    const ZERO: Self = {zeros};
}}

/// The layers in turn. Every prediction goes through this one copy: flash holds it once.
#[inline(never)]
fn forward(x: &Regressor, a: &mut Activations) {{
{input}{forward}}}

/// The derivatives of a prediction{first}.
#[inline(always)]
fn derive({trace}: &Activations, {bool}jacobian: &mut Jacobian) {{
{jacobian}{identity}}}
{along}{next}{weights}{skip}",
        zeros = zeros.trim_start(),
        bool = if recurrent.is_none() {
            "first: bool, "
        } else {
            ""
        },
    )
}

/// Parts that differ between a recurrent and a dense first layer.
struct Parts {
    uses: String,
    state: &'static str,
    types: &'static str,
    sensitivities: &'static str,
    constant: &'static str,
    functions: String,
    propagation: &'static str,
    derives: &'static str,
    input: &'static str,
    choice: &'static str,
    first: &'static str,
    along: String,
}

impl Parts {
    fn dense(channels: &str) -> Self {
        Self {
            uses: format!(
                "use crate::control::{{{channels}, NU, NY, PAST_INPUTS, PAST_OUTPUTS}};\n"
            ),
            state: "no state",
            types: "",
            sensitivities: "",
            constant: "",
            functions: String::new(),
            propagation: PROPAGATE,
            derives: "Clone, Copy, Debug",
            input: "    let x = network::flatten(x);\n",
            choice: "false, ",
            first: "; `first`: by u(k) alone, as nothing else has an effect on the first one",
            along: String::new(),
        }
    }

    fn recurrent(spec: &ModelSpec, layer: &Recurrent) -> Self {
        Self {
            uses: "use crate::control::{MEASURED, NS, NU, NY, PAST_INPUTS, PAST_OUTPUTS};\n"
                .to_string()
                + &recurrent::uses(layer),
            state: "its hidden state in its channels",
            types: "type ChannelJacobian = model::ChannelJacobian<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;\n",
            sensitivities: "type Direction<'a> = sensitivity::Direction<'a, NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;\n",
            constant: "    const PREDICTS_CHANNELS: bool = true;\n",
            functions: recurrent::functions(spec, layer),
            propagation: recurrent::PROPAGATE_CHANNELS,
            derives: "Clone, Copy",
            input: "",
            choice: "",
            first: "",
            along: recurrent::along(spec, layer),
        }
    }
}

const PROPAGATE: &str = "
    #[inline(never)]
    fn propagate(&self, a: &Activations, stage: &Stage, sensitivities: &mut Sensitivities) {
        let mut jacobian = Jacobian::ZERO;
        derive(a, stage.active_before == 0, &mut jacobian);
        sensitivity::propagate(&jacobian, stage, sensitivities);
    }
";

const NEXT: &str = "
/// The network gives the change from y(k) to y(k+1).
#[inline(always)]
fn next(x: &Regressor, change: &[f32; NY]) -> [f32; NY] {
    core::array::from_fn(|i| x.y[0][i] + change[i])
}
";

fn fields(layers: &[Layer]) -> String {
    let numbered = layers.iter().zip(1..);
    numbered
        .map(|(layer, n)| format!("    a{n}: {},\n", kind_of_result(layer).0))
        .collect()
}

fn zeros(layers: &[Layer]) -> String {
    let numbered = layers.iter().zip(1..);
    let fields: Vec<String> = numbered
        .map(|(layer, n)| format!("a{n}: {}", kind_of_result(layer).1))
        .collect();
    literal::structure("Self", &fields, 4)
}

/// Type of what a layer leaves, and its value before a prediction.
fn kind_of_result(layer: &Layer) -> (String, String) {
    match layer {
        Layer::Dense(dense) => (
            format!("[f32; {}]", dense.outputs),
            format!("[0.0; {}]", dense.outputs),
        ),
        Layer::Recurrent(layer) => (
            format!("{}::Step<f32, {}>", recurrent::module(layer), layer.units),
            format!("{}::Step::ZERO", recurrent::module(layer)),
        ),
    }
}

fn forward(layers: &[Layer]) -> String {
    let mut text = String::new();
    let mut before = String::from("x");
    for (layer, n) in layers.iter().zip(1..) {
        let dense = match layer {
            Layer::Dense(dense) => dense,
            Layer::Recurrent(layer) => {
                text.push_str(&recurrent::forward(layer));
                before = format!("a.a{n}.state");
                continue;
            }
        };
        let kernel = match dense.activation {
            Activation::Linear => "dense",
            Activation::Tanh => "dense_tanh",
            Activation::Relu => "dense_relu",
        };
        text.push_str(&format!(
            "    network::{kernel}(&W{n}, &B{n}, &{before}, &mut a.a{n});\n"
        ));
        before = format!("a.a{n}");
    }
    text
}

/// From the output side to the first layer: `d{n}` are the slopes of layer n, `t{n}` the derivative
/// of the outputs with respect to what it computes before its activation, transposed.
fn jacobian(layers: &[Layer]) -> String {
    let lines = match &layers[0] {
        Layer::Dense(_) => {
            let mut lines = chain(layers);
            lines.push("network::input_jacobian(&t1, &W1, first, jacobian);".into());
            lines
        }
        Layer::Recurrent(layer) => recurrent::jacobian(layers, layer),
    };
    lines.iter().map(|line| format!("    {line}\n")).collect()
}

fn skip_connection(spec: &ModelSpec, values: &[f32]) -> String {
    let numbers = |values: &[f32]| {
        values
            .iter()
            .copied()
            .map(literal::float)
            .collect::<Vec<_>>()
    };
    let (n_x, n_y) = (spec.regressor_len(), spec.outputs.len());
    let rows = literal::matrix(values.chunks(n_x.max(1)).map(numbers), 0);
    format!(
        "
/// Skip connection: linear weights beside the network, one row for each of its {outputs}.
#[rustfmt::skip]
static SKIP: [[f32; {n_x}]; {n_y}] = {rows};
",
        outputs = literal::count(n_y, "output")
    )
}

fn weights(n: usize, dense: &Dense) -> String {
    let numbers = |values: &[f32]| {
        values
            .iter()
            .copied()
            .map(literal::float)
            .collect::<Vec<_>>()
    };
    let rows = literal::matrix(dense.rows().map(numbers), 0);
    let (inputs, outputs) = (dense.inputs, dense.outputs);
    let bias = format!("static B{n}: [f32; {outputs}] = ");
    let bias = bias.clone() + &literal::block(numbers(&dense.bias), 0, bias.len() + 1);
    format!(
        "
/// Layer {n}, one row for each of its {outputs_words}.
#[rustfmt::skip]
static W{n}: [[f32; {inputs}]; {outputs}] = {rows};

/// Layer {n}, bias.
#[rustfmt::skip]
{bias};
",
        outputs_words = literal::count(outputs, "output")
    )
}
