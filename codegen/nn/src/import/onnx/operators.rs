//! Operator of a node: the method that reads it, or the nearest operator that works.

use super::{Import, Node, Value};
use crate::{Activation, Network, NetworkError, Op};

/// Operators that are not read, and what works in their place.
const NEAREST: &[(&[&str], &str)] = &[
    (&["ConvTranspose"], "the nearest is Conv"),
    (&["Einsum"], "use MatMul with weights"),
    (&["If"], "export the branch that is taken"),
    (
        &["Loop", "Scan"],
        "export an RNN, GRU or LSTM, or steps written out",
    ),
    (
        &[
            "ConvInteger",
            "DequantizeLinear",
            "DynamicQuantizeLinear",
            "MatMulInteger",
            "QLinearConv",
            "QLinearMatMul",
            "QuantizeLinear",
        ],
        "export float32 weights; int8 is an option of the emitter",
    ),
    (
        &[
            "Attention",
            "CausalConvWithState",
            "LinearAttention",
            "RotaryEmbedding",
            "TensorScatter",
        ],
        "the nearest is GRU",
    ),
    (&["SwiGLU"], "use Swish, Split and Mul"),
    (
        &[
            "And",
            "ArgMax",
            "ArgMin",
            "BitCast",
            "BitShift",
            "BitwiseAnd",
            "BitwiseNot",
            "BitwiseOr",
            "BitwiseXor",
            "Ceil",
            "Compress",
            "Equal",
            "Floor",
            "Hardmax",
            "IsInf",
            "IsNaN",
            "Mod",
            "NonZero",
            "Not",
            "OneHot",
            "Or",
            "Round",
            "Shrink",
            "Sign",
            "ThresholdedRelu",
            "TopK",
            "Unique",
            "Xor",
        ],
        "it jumps, and a jump has no derivative: the nearest is Relu, or Sigmoid",
    ),
    (
        &[
            "Acos", "Acosh", "Asin", "Asinh", "Atan", "Atanh", "Cos", "Cosh", "Sin", "Sinh", "Tan",
        ],
        "give sines and cosines of angles as inputs; the nearest is Tanh",
    ),
    (
        &[
            "Bernoulli",
            "Multinomial",
            "RandomNormal",
            "RandomNormalLike",
            "RandomUniform",
            "RandomUniformLike",
        ],
        "it draws numbers: export for inference",
    ),
    (
        &["NegativeLogLikelihoodLoss", "SoftmaxCrossEntropyLoss"],
        "leave the loss out: export for inference",
    ),
    (
        &[
            "ConcatFromSequence",
            "Optional",
            "OptionalGetElement",
            "OptionalHasElement",
            "SequenceAt",
            "SequenceConstruct",
            "SequenceEmpty",
            "SequenceErase",
            "SequenceInsert",
            "SequenceLength",
            "SequenceMap",
            "SplitToSequence",
        ],
        "a list of tensors: use Split and Concat",
    ),
    (
        &[
            "ImageDecoder",
            "RegexFullMatch",
            "StringConcat",
            "StringNormalizer",
            "StringSplit",
            "TfIdfVectorizer",
        ],
        "inputs are numbers: decode before the network",
    ),
    (
        &[
            "AffineGrid",
            "CenterCropPad",
            "Col2Im",
            "DeformConv",
            "DepthToSpace",
            "GridSample",
            "MaxRoiPool",
            "MaxUnpool",
            "NonMaxSuppression",
            "Resize",
            "RoiAlign",
            "SpaceToDepth",
            "Upsample",
        ],
        "the nearest is a Conv with strides",
    ),
    (&["GlobalLpPool", "LpPool"], "the nearest is AveragePool"),
    (
        &["LRN", "LpNormalization", "MeanVarianceNormalization"],
        "the nearest is LayerNormalization",
    ),
    (
        &[
            "BlackmanWindow",
            "DFT",
            "HammingWindow",
            "HannWindow",
            "MelWeightMatrix",
            "STFT",
        ],
        "compute spectra before the network",
    ),
    (
        &["CumProd", "CumSum"],
        "the nearest is MatMul with a triangle of ones",
    ),
    (&["Det"], "write the products out"),
    (
        &[
            "GatherElements",
            "GatherND",
            "Scatter",
            "ScatterElements",
            "ScatterND",
            "Trilu",
        ],
        "use Gather, Slice and Concat with constant places",
    ),
    (
        &["ReduceLogSum", "ReduceLogSumExp"],
        "use Exp, ReduceSum and Log in turn",
    ),
    (&["ReduceProd"], "use Mul of Split's outputs"),
    (&["CastLike"], "use Cast"),
    (
        &["Constant", "ConstantOfShape", "EyeLike", "Range"],
        "it works of constants alone",
    ),
];

impl Import<'_> {
    /// The outputs of a node.
    pub(super) fn node(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let op = node.proto.op_type.as_str();
        match op {
            "Identity" => Ok(vec![self.value(node, 0)?]),
            "Dropout" => {
                let training = self.integers(node, 2, "training_mode");
                if node.input(2).is_some()
                    && training.is_none_or(|list| list.iter().any(|&n| n != 0))
                {
                    return Err(node.unsupported("a Dropout in training", "export for inference"));
                }
                node.input(1);
                Ok(vec![self.value(node, 0)?])
            }
            "Cast" => self.cast(node),
            "Clip" => self.clip(node),
            "Neg" => self.composed(node, |network, name, x| network.scaled(name, x, -1.0, 0.0)),
            "Abs" => self.composed(node, Network::absolute),
            "HardSwish" => self.composed(node, Network::hard_swish),
            "Mish" => self.composed(node, Network::mish),
            "Celu" => {
                let alpha = node.float("alpha", 1.0);
                self.composed(node, |network, name, x| network.celu(name, x, alpha))
            }
            "Max" | "Min" => self.bounded(node),
            "Mean" => self.joined(node),
            "Pow" => self.power(node),
            "Where" => self.choice(node),
            "Pad" => self.pad(node),
            "Expand" | "Tile" => self.repeated(node),
            "ReverseSequence" => self.reverse_sequence(node),
            "LayerNormalization" | "RMSNormalization" => self.layer_norm(node),
            "GroupNormalization" | "InstanceNormalization" => self.group_norm(node),
            "Log" => self.activation(node, Activation::Logarithm),
            "Sqrt" => self.activation(node, Activation::Root),
            "Reciprocal" => self.activation(node, Activation::Reciprocal),
            "Gather" => self.gather(node),
            "Slice" => self.slice(node),
            "Split" => self.split(node),
            "ReduceMean" | "ReduceMax" | "ReduceMin" | "ReduceSum" | "ReduceL1" | "ReduceL2"
            | "ReduceSumSquare" => self.reduce(node),
            "PRelu" => self.prelu(node),
            "Relu" => self.activation(node, Activation::Relu),
            "Sigmoid" => self.activation(node, Activation::Sigmoid),
            "Tanh" => self.activation(node, Activation::Tanh),
            "Softplus" => self.activation(node, Activation::Softplus),
            "Softsign" => self.activation(node, Activation::Softsign),
            "Exp" => self.activation(node, Activation::Exponential),
            "LeakyRelu" => {
                let alpha = node.float("alpha", 0.01);
                self.activation(node, Activation::LeakyRelu { alpha })
            }
            "Elu" => {
                let alpha = node.float("alpha", 1.0);
                self.activation(node, Activation::Elu { alpha, scale: 1.0 })
            }
            "Selu" => {
                let (alpha, scale) = (
                    node.float("alpha", 1.673_263_2),
                    node.float("gamma", 1.050_701),
                );
                self.activation(node, Activation::Elu { alpha, scale })
            }
            "HardSigmoid" => {
                let (alpha, beta) = (node.float("alpha", 0.2), node.float("beta", 0.5));
                self.activation(node, Activation::HardSigmoid { alpha, beta })
            }
            "Gelu" => {
                let g = match node.text("approximate").as_str() {
                    "" | "none" => Activation::Gelu,
                    "tanh" => Activation::GeluTanh,
                    other => {
                        let what = format!("the approximation {other:?} of Gelu");
                        return Err(node.unsupported(what, "none and tanh work"));
                    }
                };
                self.activation(node, g)
            }
            "Swish" => self.swish(node),
            "Softmax" => self.softmax(node, &Op::Softmax),
            "LogSoftmax" => self.softmax(node, &Op::LogSoftmax),
            "Gemm" => self.gemm(node),
            "MatMul" => self.matmul(node),
            "Add" | "Sub" | "Mul" | "Div" | "Erf" | "Sum" => self.arithmetic(node),
            "Conv" => self.conv(node),
            "MaxPool" | "AveragePool" => self.pool(node),
            "GlobalMaxPool" | "GlobalAveragePool" => self.global_pool(node),
            "BatchNormalization" => self.batch_norm(node),
            "Concat" => self.concat(node),
            "Flatten" => self.flatten(node),
            "Reshape" => self.reshape(node),
            "Squeeze" | "Unsqueeze" => self.squeeze(node),
            "Transpose" => self.transpose(node),
            "RNN" | "GRU" | "LSTM" => self.recurrent(node),
            other => {
                let nearest = NEAREST.iter().find(|(names, _)| names.contains(&other));
                let nearest = nearest.map_or(
                    "see docs/reference/networks.md for the operators that are",
                    |(_, n)| n,
                );
                Err(node.unsupported(format!("the operator {other}"), nearest))
            }
        }
    }
}
