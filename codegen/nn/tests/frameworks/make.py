#!/usr/bin/env python3
"""Makes the files of models/ with the frameworks themselves, and beside each its own outputs.

    python3 -m venv venv && venv/bin/pip install -r requirements.txt && venv/bin/python make.py [NAME ...]

For every model there is NAME.{keras,h5,onnx,tflite} and NAME.golden.safetensors: `x`, inputs drawn from a
fixed seed, and `y`, what the framework gives for them, batches first. Sequences of any length (None) are
given whole; what is kept is the output after the last step.
"""
import json
import os
import pathlib
import struct
import sys
import zipfile

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")

import keras  # noqa: E402
import numpy as np  # noqa: E402
import onnx  # noqa: E402
import onnxruntime  # noqa: E402
import tensorflow as tf  # noqa: E402
import tf_keras  # noqa: E402
from ai_edge_litert.interpreter import Interpreter  # noqa: E402
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

HERE = pathlib.Path(__file__).parent / "models"
VECTORS, STEPS = 4, 7
MODELS = {}


def model(function):
    """Registers a model under its function's name, with `-` for `_`."""
    MODELS[function.__name__.replace("_", "-")] = function
    return function


def save_golden(name, x, y):
    """The safetensors format: length of the header, header, values."""
    x, y = x.astype("<f4"), y.astype("<f8")
    entries = {
        "x": {"dtype": "F32", "shape": list(x.shape), "data_offsets": [0, x.nbytes]},
        "y": {"dtype": "F64", "shape": list(y.shape), "data_offsets": [x.nbytes, x.nbytes + y.nbytes]},
    }
    header = json.dumps(entries).encode()
    header += b" " * (-len(header) % 8)
    (HERE / f"{name}.golden.safetensors").write_bytes(
        struct.pack("<Q", len(header)) + header + x.tobytes() + y.tobytes()
    )


def draw(rng, shape):
    return rng.uniform(-1, 1, [VECTORS] + [STEPS if n is None else n for n in shape]).astype(np.float32)


def stir(net, rng):
    """Weights that no layer has by default: biases and statistics that are not 0 or 1."""
    for layer in net.layers:
        values = [v.numpy() for v in layer.weights]
        names = [v.name.split("/")[-1] for v in layer.weights]
        for i, (name, value) in enumerate(zip(names, values)):
            if "bias" in name or "beta" in name or "moving_mean" in name:
                values[i] = rng.uniform(-0.5, 0.5, value.shape).astype(value.dtype)
            if "gamma" in name or "moving_variance" in name:
                values[i] = rng.uniform(0.5, 1.5, value.shape).astype(value.dtype)
        if values and not any("count" in name for name in names):
            layer.set_weights(values)


def keras_file(name, net, suffix, rng):
    stir(net, rng)
    path = HERE / f"{name}.{suffix}"
    net.save(path)
    if suffix == "keras":
        restamp(path)
    x = draw(rng, net.input_shape[1:])
    save_golden(name, x, np.asarray(net(x)))


def restamp(path):
    """The archive with fixed times, so that the same model is the same file."""
    with zipfile.ZipFile(path) as archive:
        entries = [(entry.filename, archive.read(entry)) for entry in archive.infolist()]
    with zipfile.ZipFile(path, "w") as archive:
        for entry, data in entries:
            if entry == "metadata.json":
                data = json.dumps({**json.loads(data), "date_saved": "2026-01-01@00:00:00"}).encode()
            archive.writestr(zipfile.ZipInfo(entry), data)


# --- Keras 3 -------------------------------------------------------------------------------------------

ACTIVATIONS = ["linear", "relu", "leaky_relu", "elu", "selu", "gelu", "softplus", "softsign", "swish",
               "hard_sigmoid", "sigmoid", "tanh", "exponential", "softmax"]


def k3(name, net, rng):
    keras_file(name, net, "keras", rng)


@model
def keras_mlp(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((12,)), k.Dense(10, "tanh"), k.Dense(3)]), rng)


@model
def keras_activations(name, rng):
    k = keras.layers
    x = k.Input((6,))
    y = [k.Dense(4, a, name=f"with_{a}")(x) for a in ACTIVATIONS]
    k3(name, keras.Model(x, k.Dense(3)(k.Concatenate()(y))), rng)


@model
def keras_activation_layers(name, rng):
    k = keras.layers
    x = k.Input((5,))
    parts = [k.ReLU()(x), k.LeakyReLU(negative_slope=0.1)(x), k.ELU(alpha=0.7)(x), k.Softmax()(x),
             k.Activation("gelu")(x), k.Activation("swish")(x), k.Activation("tanh")(x)]
    k3(name, keras.Model(x, k.Dense(3, "softmax")(k.Concatenate()(parts))), rng)


@model
def keras_classifier(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((20,)), k.Dense(16, "relu"), k.Dropout(0.3), k.Dense(10, "softmax")]), rng)


@model
def keras_conv1d(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((24, 3)), k.Conv1D(8, 5, padding="same", activation="relu"), k.MaxPooling1D(2),
        k.Conv1D(6, 3, dilation_rate=2, padding="causal"), k.Activation("swish"), k.AveragePooling1D(3, 2, padding="same"),
        k.Flatten(), k.Dense(4)]), rng)


@model
def keras_conv2d(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((12, 10, 2)), k.Conv2D(6, 3, strides=2, padding="same", activation="relu"),
        k.MaxPooling2D(2, padding="same"), k.Conv2D(5, (2, 3), activation="tanh"), k.Flatten(), k.Dense(4, "softmax")]), rng)


@model
def keras_lenet(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((16, 16, 1)), k.Conv2D(4, 5, activation="tanh"), k.AveragePooling2D(2), k.Conv2D(8, 3, activation="tanh"),
        k.AveragePooling2D(2), k.Flatten(), k.Dense(12, "tanh"), k.Dense(10)]), rng)


@model
def keras_global_pools(name, rng):
    k = keras.layers
    x = k.Input((9, 7, 3))
    y = k.Conv2D(6, 3, activation="elu")(x)
    parts = [k.GlobalAveragePooling2D()(y), k.GlobalMaxPooling2D()(y)]
    k3(name, keras.Model(x, k.Dense(3)(k.Concatenate()(parts))), rng)


@model
def keras_residual(name, rng):
    k = keras.layers
    x = k.Input((8,))
    y = k.Dense(8, "relu")(x)
    z = k.Add()([x, y])
    w = k.Add()([z, k.Dense(8, "tanh")(z), y])
    k3(name, keras.Model(x, k.Dense(2)(w)), rng)


@model
def keras_resnet(name, rng):
    k = keras.layers
    x = k.Input((8, 8, 2))
    y = k.Activation("relu")(k.BatchNormalization()(k.Conv2D(4, 3, padding="same", use_bias=False)(x)))
    z = k.BatchNormalization()(k.Conv2D(4, 3, padding="same")(y))
    y = k.Activation("relu")(k.Add()([y, z]))
    k3(name, keras.Model(x, k.Dense(3)(k.GlobalAveragePooling2D()(y))), rng)


@model
def keras_concatenate(name, rng):
    k = keras.layers
    x = k.Input((10, 4))
    parts = [k.Conv1D(3, n, padding="same", activation="relu")(x) for n in (1, 3, 5)]
    y = k.MaxPooling1D(5)(k.Concatenate(axis=-1)(parts))
    y = k.Concatenate(axis=1)([y, k.AveragePooling1D(5)(k.Concatenate()(parts))])
    k3(name, keras.Model(x, k.Dense(3)(k.Flatten()(y))), rng)


@model
def keras_batch_norm(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((7,)), k.BatchNormalization(), k.Dense(9, "relu"), k.BatchNormalization(), k.Dense(6),
        k.BatchNormalization(scale=False), k.Activation("tanh"), k.Dense(2)]), rng)


@model
def keras_scaling(name, rng):
    k = keras.layers
    scale = k.Normalization(axis=-1, mean=[0.5, -1.0, 2.0, 0.0], variance=[0.25, 4.0, 1.0, 2.0])
    k3(name, keras.Sequential([k.Input((4,)), scale, k.Dense(6, "tanh"), k.Dense(2), k.Rescaling(3.0, offset=-1.0)]), rng)


@model
def keras_reshape(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((24,)), k.Reshape((6, 4)), k.Permute((2, 1)), k.Conv1D(5, 2, activation="relu"), k.Flatten(), k.Dense(3)]), rng)


@model
def keras_simple_rnn(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((12, 3)), k.SimpleRNN(6, return_sequences=True), k.SimpleRNN(4), k.Dense(2)]), rng)


@model
def keras_gru(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((10, 4)), k.GRU(6), k.Dense(3)]), rng)


@model
def keras_gru_reset_before(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((10, 4)), k.GRU(6, reset_after=False, return_sequences=True), k.Flatten(), k.Dense(3)]), rng)


@model
def keras_lstm(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((9, 3)), k.LSTM(5, return_sequences=True), k.LSTM(4), k.Dense(2)]), rng)


@model
def keras_gru_stream(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([k.Input((None, 15)), k.GRU(5), k.Dense(3)]), rng)


@model
def keras_lstm_stream(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((None, 15)), k.LSTM(5, return_sequences=True), k.TimeDistributed(k.Dense(4, "relu")), k.LSTM(5), k.Dense(3)]), rng)


# --- Keras 2 -------------------------------------------------------------------------------------------


def k2(name, net, rng):
    keras_file(name, net, "h5", rng)


@model
def h5_mlp(name, rng):
    k = tf_keras.layers
    k2(name, tf_keras.Sequential([k.Input((26,)), k.Dense(8, "relu"), k.Dense(3, "tanh")]), rng)


@model
def h5_conv2d(name, rng):
    k = tf_keras.layers
    x = k.Input((10, 10, 2))
    y = k.BatchNormalization()(k.Conv2D(4, 3, padding="same")(x))
    y = k.LeakyReLU(0.15)(y)
    y = k.Concatenate()([y, x])
    y = k.MaxPooling2D((2, 3))(y)
    k2(name, tf_keras.Model(x, k.Dense(3)(k.Flatten()(y))), rng)


@model
def h5_gru_hard_sigmoid(name, rng):
    k = tf_keras.layers
    k2(name, tf_keras.Sequential([
        k.Input((8, 4)), k.GRU(5, recurrent_activation="hard_sigmoid", reset_after=False), k.Dense(2)]), rng)


@model
def h5_lstm_stateful(name, rng):
    k = tf_keras.layers
    k2(name, tf_keras.Sequential([k.Input((None, 6)), k.LSTM(4), k.Dense(2)]), rng)


# --- ONNX ----------------------------------------------------------------------------------------------


class Graph:
    """An ONNX graph as the exporters write it: weights as initialisers, batch first."""

    def __init__(self, rng):
        self.rng, self.nodes, self.values = rng, [], []

    def weight(self, *shape, low=-0.6, high=0.6):
        return self.constant(self.rng.uniform(low, high, shape).astype(np.float32))

    def constant(self, array):
        name = f"w{len(self.values)}"
        self.values.append(numpy_helper.from_array(np.asarray(array), name))
        return name

    def node(self, op, *inputs, outputs=1, **attributes):
        names = [f"{op.lower()}_{len(self.nodes)}_{i}" for i in range(outputs)]
        self.nodes.append(helper.make_node(op, list(inputs), names, name=f"{op}_{len(self.nodes)}", **attributes))
        return names[0] if outputs == 1 else names

    def save(self, name, shape, y, out, opset=17, ir=8):
        x = helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)
        out = helper.make_tensor_value_info(y, TensorProto.FLOAT, out)
        graph = helper.make_graph(self.nodes, name, [x], [out], self.values)
        net = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=ir)
        onnx.checker.check_model(net)
        onnx.save(net, HERE / f"{name}.onnx")
        session = onnxruntime.InferenceSession(net.SerializeToString())
        inner = [STEPS if n in ("T",) else 1 if n == "N" else n for n in shape]
        xs = self.rng.uniform(-1, 1, [VECTORS] + inner).astype(np.float32)
        ys = np.stack([session.run(None, {"x": one})[0] for one in xs])
        save_golden(name, xs, ys)


@model
def onnx_mlp(name, rng):
    g = Graph(rng)
    y = g.node("Tanh", g.node("Gemm", "x", g.weight(10, 12), g.weight(10), transB=1))
    y = g.node("Add", g.node("MatMul", y, g.weight(10, 3)), g.weight(3))
    g.save(name, ["N", 12], y, ["N", 3])


@model
def onnx_activations(name, rng):
    g = Graph(rng)
    x = g.node("Gemm", "x", g.weight(5, 6), g.weight(6), alpha=0.5, beta=2.0)
    cut = [g.node(op, x) for op in ["Relu", "Sigmoid", "Tanh", "Softplus", "Softsign", "Exp", "Selu", "Identity"]]
    cut += [g.node("LeakyRelu", x, alpha=0.2), g.node("Elu", x, alpha=0.8), g.node("HardSigmoid", x, alpha=0.25, beta=0.4)]
    cut.append(g.node("Mul", x, g.node("Sigmoid", x)))
    half = g.node("Div", x, g.constant(np.float32(np.sqrt(2))))
    bell = g.node("Add", g.node("Erf", half), g.constant(np.float32(1)))
    cut.append(g.node("Mul", g.node("Mul", x, bell), g.constant(np.float32(0.5))))
    y = g.node("Gemm", g.node("Concat", *cut, axis=1), g.weight(4, 6 * len(cut)), g.weight(4), transB=1)
    g.save(name, ["N", 5], g.node("Softmax", y, axis=-1), ["N", 4])


@model
def onnx_conv1d(name, rng):
    g = Graph(rng)
    y = g.node("Relu", g.node("Conv", "x", g.weight(6, 3, 5), g.weight(6), kernel_shape=[5], pads=[2, 2]))
    y = g.node("MaxPool", y, kernel_shape=[2], strides=[2])
    y = g.node("Conv", y, g.weight(4, 6, 3), kernel_shape=[3], dilations=[2])
    y = g.node("Reshape", g.node("Tanh", y), g.constant(np.array([1, -1], np.int64)))
    g.save(name, [1, 3, 20], g.node("Gemm", y, g.weight(2, 24), g.weight(2), transB=1), [1, 2])


@model
def onnx_conv2d(name, rng):
    g = Graph(rng)
    y = g.node("Conv", "x", g.weight(5, 2, 3, 3), g.weight(5), kernel_shape=[3, 3], strides=[2, 1], pads=[1, 0, 1, 2])
    stats = [g.weight(5, low=0.5, high=1.5), g.weight(5), g.weight(5), g.weight(5, low=0.5, high=1.5)]
    y = g.node("Relu", g.node("BatchNormalization", y, *stats))
    y = g.node("AveragePool", y, kernel_shape=[2, 2], pads=[1, 1, 0, 0], count_include_pad=1)
    y = g.node("MaxPool", y, kernel_shape=[2, 3], strides=[2, 2])
    y = g.node("Flatten", y)
    size = 5 * 2 * 4
    g.save(name, [1, 2, 9, 10], g.node("Gemm", y, g.weight(3, size), g.weight(3), transB=1), [1, 3])


@model
def onnx_residual(name, rng):
    g = Graph(rng)
    y = g.node("Relu", g.node("Conv", "x", g.weight(4, 4, 3, 3), g.weight(4), kernel_shape=[3, 3], pads=[1, 1, 1, 1]))
    y = g.node("Relu", g.node("Add", y, "x"))
    y = g.node("Concat", y, "x", axis=1)
    y = g.node("Flatten", g.node("GlobalAveragePool", y))
    y = g.node("Div", g.node("Sub", y, g.weight(8)), g.weight(8, low=0.5, high=1.5))
    g.save(name, [1, 4, 6, 5], g.node("Gemm", y, g.weight(3, 8), g.weight(3), transB=1), [1, 3])


def onnx_recurrent(name, rng, op, gates, **attributes):
    g, h, n = Graph(rng), 5, 4
    b = g.weight(1, 2 * gates * h)
    y = g.node(op, "x", g.weight(1, gates * h, n), g.weight(1, gates * h, h), b, outputs=2, hidden_size=h, **attributes)
    y = g.node("Squeeze", y[1], g.constant(np.array([0], np.int64)))
    g.save(name, [9, 1, n], g.node("Gemm", y, g.weight(2, h), g.weight(2), transB=1), [1, 2])


@model
def onnx_rnn(name, rng):
    onnx_recurrent(name, rng, "RNN", 1)


@model
def onnx_gru(name, rng):
    onnx_recurrent(name, rng, "GRU", 3, linear_before_reset=1)


@model
def onnx_gru_reset_before(name, rng):
    onnx_recurrent(name, rng, "GRU", 3)


@model
def onnx_lstm(name, rng):
    onnx_recurrent(name, rng, "LSTM", 4)


@model
def onnx_gru_stream(name, rng):
    g, h, n = Graph(rng), 5, 15
    b = g.weight(1, 6 * h)
    y = g.node("GRU", "x", g.weight(1, 3 * h, n), g.weight(1, 3 * h, h), b, outputs=2, hidden_size=h, linear_before_reset=1)
    y = g.node("Squeeze", y[1], g.constant(np.array([0], np.int64)))
    g.save(name, ["T", 1, n], g.node("Gemm", y, g.weight(3, h), g.weight(3), transB=1), [1, 3])


# --- TensorFlow Lite -----------------------------------------------------------------------------------


def convert(net, quantised=None):
    converter = tf.lite.TFLiteConverter.from_keras_model(net)
    if quantised is not None:
        converter.optimizations = [tf.lite.Optimize.DEFAULT]
        if callable(quantised):
            converter.representative_dataset = quantised
    return converter.convert()


def lite(name, net, rng):
    stir(net, rng)
    data = convert(net)
    (HERE / f"{name}.tflite").write_bytes(data)
    interpreter = Interpreter(model_content=data)
    interpreter.allocate_tensors()
    x = draw(rng, net.input_shape[1:])
    ys = []
    for one in x:
        interpreter.set_tensor(interpreter.get_input_details()[0]["index"], one[None])
        interpreter.invoke()
        ys.append(interpreter.get_tensor(interpreter.get_output_details()[0]["index"])[0])
    save_golden(name, x, np.stack(ys))


@model
def tflite_mlp(name, rng):
    k = tf_keras.layers
    lite(name, tf_keras.Sequential([k.Input((12,)), k.Dense(10, "tanh"), k.Dense(6, "relu"), k.Dense(3, "sigmoid")]), rng)


@model
def tflite_conv2d(name, rng):
    k = tf_keras.layers
    x = k.Input((11, 9, 2))
    y = k.Conv2D(4, 3, padding="same", strides=2, activation="relu")(x)
    z = k.Add()([y, k.Conv2D(4, 1)(y)])
    y = k.Concatenate()([k.MaxPooling2D(2)(z), k.AveragePooling2D(2)(z)])
    k2 = k.Dense(4, "softmax")(k.Flatten()(y))
    lite(name, tf_keras.Model(x, k2), rng)


def dequantised(data):
    """Every constant of a quantised file in floating point, by its name."""
    interpreter = Interpreter(model_content=data)
    interpreter.allocate_tensors()
    found = {}
    for tensor in interpreter.get_tensor_details():
        scales = tensor["quantization_parameters"]["scales"]
        if tensor["dtype"] in (np.int8, np.int32) and len(scales):
            try:
                value = interpreter.get_tensor(tensor["index"]).astype(np.float64)
            except ValueError:
                continue
            zero = tensor["quantization_parameters"]["zero_points"]
            axis = tensor["quantization_parameters"]["quantized_dimension"]
            shape = [1] * value.ndim
            shape[axis] = -1
            found[tensor["name"]] = (value - zero.reshape(shape)) * scales.reshape(shape)
    return found


def int8(name, net, rng, full):
    """The outputs are Keras's own, in floating point, with the weights that the file holds."""
    stir(net, rng)
    x = draw(rng, net.input_shape[1:])
    data = convert(net, (lambda: ([one[None]] for one in draw(rng, net.input_shape[1:]))) if full else True)
    (HERE / f"{name}.tflite").write_bytes(data)
    constants = list(dequantised(data).values())
    for layer in net.layers:
        values = []
        for value in layer.get_weights():
            # The file's own order of axes, and at most half a step away from where it came from.
            turned = value.transpose(3, 0, 1, 2) if value.ndim == 4 else value.T
            near = [c for c in constants if c.shape == turned.shape and np.abs(c - turned).max() < 0.02]
            if near:
                turned = near[0].astype(np.float32)
            values.append(turned.transpose(1, 2, 3, 0) if value.ndim == 4 else turned.T)
        if values:
            layer.set_weights(values)
    save_golden(name, x, np.asarray(net(x)))


@model
def tflite_int8_weights(name, rng):
    k = tf_keras.layers
    # The converter leaves tensors of fewer than 1,024 values as they are.
    int8(name, tf_keras.Sequential([k.Input((40,)), k.Dense(40, "tanh"), k.Dense(30, "relu"), k.Dense(3)]), rng, False)


@model
def tflite_int8(name, rng):
    k = tf_keras.layers
    int8(name, tf_keras.Sequential([
        k.Input((8, 8, 2)), k.Conv2D(4, 3, activation="relu"), k.MaxPooling2D(2), k.Flatten(), k.Dense(6, "relu"), k.Dense(3)]),
        rng, True)


# Last: what is drawn depends on the place.
@model
def onnx_gelu_tanh(name, rng):
    g = Graph(rng)
    y = g.node("Gelu", g.node("Gemm", "x", g.weight(6, 5), g.weight(6), transB=1), approximate="tanh")
    y = g.node("Add", g.node("MatMul", y, g.weight(6, 2)), g.weight(2))
    g.save(name, ["N", 5], y, ["N", 2], opset=20, ir=9)


@model
def keras_both_ways(name, rng):
    k = keras.layers
    x = k.Input((5, 3))
    y = k.Bidirectional(k.GRU(3, return_sequences=True))(x)
    y = k.LayerNormalization()(y)
    y = k.Bidirectional(k.LSTM(3), merge_mode="ave")(y)
    k3(name, keras.Model(x, k.Dense(2)(k.Concatenate()([y, x[:, -1], x[:, 1]]))), rng)


@model
def keras_products(name, rng):
    k, ops = keras.layers, keras.ops
    x = k.Input((5,))
    a, b = k.Dense(4, "tanh")(x), k.Dense(4, "sigmoid")(x)
    parts = [k.Multiply()([a, b]), a / (b + 0.5), a**2, ops.sqrt(b), ops.maximum(a, 0.2 * b), ops.abs(a), ops.log(b),
             k.PReLU(alpha_initializer="glorot_uniform")(a), k.Activation("mish")(a), 1.0 / (b + 1.0), b ** -0.5]
    k3(name, keras.Model(x, k.Dense(3)(k.Concatenate()(parts))), rng)


@model
def keras_padding(name, rng):
    k = keras.layers
    k3(name, keras.Sequential([
        k.Input((5, 4, 2)), k.ZeroPadding2D(((1, 0), (2, 1))), k.Conv2D(2, 3, activation="relu"), k.UpSampling2D((1, 2)),
        k.DepthwiseConv2D(2, depth_multiplier=2), k.Cropping2D(((0, 1), (1, 0))), k.SeparableConv2D(3, 2, activation="hard_silu"),
        k.Flatten(), k.Dense(2)]), rng)


@model
def onnx_products(name, rng):
    g = Graph(rng)
    y = g.node("Pad", "x", g.constant(np.array([0, 0, 1, 0, 0, 2], np.int64)))
    y = g.node("Conv", y, g.weight(3, 2, 3), g.weight(3))
    y = g.node("Pad", y, g.constant(np.array([0, 0, 1, 0, 0, 1], np.int64)), mode="edge")
    y = g.node("LayerNormalization", y, g.weight(8, low=0.5, high=1.5), g.weight(8), axis=-1)
    gate = g.node("Sigmoid", y)
    mean = g.node("ReduceMean", gate, axes=[2], keepdims=1)
    parts = [g.node("Mul", y, gate), g.node("Div", y, mean), g.node("Pow", y, g.constant(np.float32(3))),
             g.node("Sqrt", gate), g.node("Log", gate), g.node("Reciprocal", gate), g.node("Max", y, gate),
             g.node("Where", g.node("Greater", y, g.constant(np.float32(0))), y, g.node("Mul", y, g.constant(np.float32(-0.3))))]
    y = g.node("Flatten", g.node("Concat", *parts, axis=1))
    g.save(name, [1, 2, 5], g.node("Gemm", y, g.weight(2, 192), g.weight(2), transB=1), [1, 2])


@model
def tflite_products(name, rng):
    k, ops = keras.layers, keras.ops
    x = k.Input((6, 3))
    y = k.Conv1D(4, 3, padding="causal", activation="selu")(x)
    y = k.LayerNormalization()(y)
    y = k.Multiply()([y, k.Dense(4, "sigmoid")(x)])
    y = k.Concatenate()([k.PReLU(alpha_initializer="glorot_uniform")(y), k.Activation("mish")(y), ops.minimum(y, 0.3)])
    lite(name, keras.Model(x, k.Dense(2)(y[:, -1])), rng)


if __name__ == "__main__":
    HERE.mkdir(exist_ok=True)
    for number, (name, make) in enumerate(MODELS.items()):
        if len(sys.argv) > 1 and name not in sys.argv[1:]:
            continue
        keras.utils.set_random_seed(number)
        tf_keras.utils.set_random_seed(number)
        make(name, np.random.default_rng(number))
        print(name, flush=True)
    print(sum(f.stat().st_size for f in HERE.iterdir()), "bytes")
