#!/usr/bin/env python3
"""Random small networks of Keras, as .keras or .h5 and as TensorFlow Lite, with their own outputs.

    venv/bin/python fuzz_keras.py OUT COUNT [SEED]

Layers, options and shapes are drawn; what Keras itself refuses is drawn again. TensorFlow Lite
files are float and are run by LiteRT.
"""
import contextlib
import io
import json
import os
import pathlib
import sys

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")

import keras  # noqa: E402
import numpy as np  # noqa: E402
import tensorflow as tf  # noqa: E402
from ai_edge_litert.interpreter import Interpreter  # noqa: E402
from keras import layers as L  # noqa: E402
from keras import ops  # noqa: E402

VECTORS = 3
ACTIVATIONS = ["linear", "relu", "tanh", "sigmoid", "elu", "selu", "gelu", "softplus", "softsign", "swish",
               "hard_sigmoid", "leaky_relu", "exponential", "relu6", "mish", "hard_silu", "log_sigmoid", "celu"]


def one(rng, choices):
    return choices[int(rng.integers(len(choices)))]


def flip(rng, probability=0.5):
    return bool(rng.random() < probability)


def dense(rng, x):
    return L.Dense(int(rng.integers(1, 6)), activation=one(rng, ACTIVATIONS), use_bias=flip(rng, 0.8))(x)


def activation(rng, x):
    return one(rng, [
        L.Activation(one(rng, ACTIVATIONS)),
        L.LeakyReLU(negative_slope=float(rng.uniform(0.05, 0.5))),
        L.ReLU(max_value=float(rng.uniform(0.5, 2))),
        L.ReLU(negative_slope=float(rng.uniform(0.05, 0.5)), threshold=float(rng.uniform(-0.3, 0.3))),
        L.ELU(alpha=float(rng.uniform(0.3, 2))),
        L.PReLU(alpha_initializer="glorot_uniform" if len(x.shape) > 2 else "ones"),
        L.Softmax(axis=int(rng.integers(1, len(x.shape)))),
    ])(x)


def normalise(rng, x):
    channels = x.shape[-1]
    mean, variance = rng.normal(0, 1, channels).tolist(), rng.uniform(0.3, 2, channels).tolist()
    return one(rng, [
        L.BatchNormalization(epsilon=one(rng, [1e-3, 1e-5]), center=flip(rng, 0.8), scale=flip(rng, 0.8)),
        L.Normalization(mean=mean, variance=variance, invert=flip(rng, 0.3)),
        L.Rescaling(float(rng.uniform(0.2, 2)), offset=float(rng.normal())),
        L.LayerNormalization(),
        L.Dropout(0.3),
        L.GroupNormalization(one(rng, [n for n in range(1, channels + 1) if channels % n == 0])),
        L.RMSNormalization(epsilon=one(rng, [1e-6, 1e-2])),
        L.UnitNormalization(),
    ])(x)


def constant(rng, x):
    c = float(rng.uniform(0.3, 2)) * one(rng, [-1, 1])
    if flip(rng, 0.3):
        c = rng.uniform(0.3, 2, x.shape[-1]).astype(np.float32)
    return one(rng, [lambda: x + c, lambda: x * c, lambda: x - c, lambda: c - x, lambda: x / c, lambda: -x])()


def operation(rng, x):
    return one(rng, [
        lambda: ops.relu(x), lambda: ops.tanh(x), lambda: ops.sigmoid(x), lambda: ops.softplus(x),
        lambda: ops.leaky_relu(x, negative_slope=float(rng.uniform(0.05, 0.5))), lambda: ops.clip(x, -0.4, 0.6),
        lambda: ops.log_softmax(x * one(rng, [1.0, 60.0]), axis=int(rng.integers(1, len(x.shape)))),
        lambda: ops.clip(x, -2e5, 3e5), lambda: ops.maximum(x, float(rng.normal(0, one(rng, [1, 1e6])))),
        lambda: ops.mean(x, axis=-1, keepdims=True), lambda: ops.max(x, axis=1, keepdims=True), lambda: ops.soft_shrink(x),
        lambda: ops.squareplus(x), lambda: ops.rsqrt(ops.square(x) + 0.3), lambda: ops.normalize(x, axis=-1),
        lambda: ops.elu(x, alpha=float(rng.uniform(0.3, 2))), lambda: x**2, lambda: ops.abs(x), lambda: ops.exp(x),
    ])()


def window(rng, x):
    rank, padding = len(x.shape) - 2, one(rng, ["valid", "same"])
    size = [int(rng.integers(1, min(3, n) + 1)) for n in x.shape[1:-1]]
    strides = [int(rng.integers(1, 3))] * rank
    conv = {"kernel_size": size, "strides": strides, "padding": padding, "activation": one(rng, ACTIVATIONS)}
    pool = {"pool_size": size, "strides": strides, "padding": padding}
    filters = int(rng.integers(1, 4))
    if rank == 1:
        causal = dict(conv, padding="causal", strides=[1], dilation_rate=int(rng.integers(1, 3)))
        return one(rng, [L.Conv1D(filters, **conv), L.Conv1D(filters, **causal), L.MaxPooling1D(**pool),
                         L.AveragePooling1D(**pool), L.SeparableConv1D(filters, **dict(conv, kernel_size=size[0], strides=1)),
                         L.ZeroPadding1D(int(rng.integers(0, 3))), L.Cropping1D((0, 1)), L.UpSampling1D(2)])(x)
    groups = dict(conv, groups=x.shape[-1])
    return one(rng, [L.Conv2D(filters, **conv), L.Conv2D(x.shape[-1] * filters, **groups), L.DepthwiseConv2D(**conv),
                     L.MaxPooling2D(**pool), L.AveragePooling2D(**pool), L.ZeroPadding2D(1)])(x)


def globally(rng, x):
    name = one(rng, ["GlobalAveragePooling", "GlobalMaxPooling"]) + f"{len(x.shape) - 2}D"
    return getattr(L, name)(keepdims=flip(rng, 0.3))(x)


def shaped(rng, x):
    shape = list(x.shape[1:])
    inner = int(np.prod(shape))
    parts = [n for n in range(1, inner + 1) if inner % n == 0]
    a = int(one(rng, parts))
    order = [int(n) + 1 for n in rng.permutation(len(shape))]
    return one(rng, [lambda: L.Flatten()(x), lambda: L.Reshape((a, inner // a))(x), lambda: L.Reshape((inner,))(x),
                     lambda: L.Reshape((a, -1))(x), lambda: L.Permute(order)(x)])()


def part(rng, x):
    axis = int(rng.integers(1, len(x.shape)))
    start = int(rng.integers(0, x.shape[axis]))
    index = [slice(None)] * len(x.shape)
    index[axis] = slice(start, None) if len(x.shape) == 2 or flip(rng) else start
    return x[tuple(index)]


def recurrent(rng, x):
    kind, units = one(rng, ["LSTM", "GRU", "SimpleRNN"]), int(rng.integers(1, 4))
    options = {"return_sequences": flip(rng), "go_backwards": flip(rng, 0.2), "use_bias": flip(rng, 0.8)}
    if flip(rng, 0.3):
        options["activation"] = one(rng, ["tanh", "relu", "sigmoid", "softsign"])
    if kind != "SimpleRNN" and flip(rng, 0.3):
        options["recurrent_activation"] = one(rng, ["sigmoid", "hard_sigmoid"])
    if kind == "GRU":
        options["reset_after"] = flip(rng, 0.7)
    if kind == "LSTM":
        options["unit_forget_bias"] = flip(rng)
    if flip(rng, 0.25):
        # The same as a cell, whose options are its own.
        outer = {key: options.pop(key) for key in ("return_sequences", "go_backwards")}
        return L.RNN(getattr(L, f"{kind}Cell")(units, **options), **outer)(x)
    if flip(rng, 0.2):
        return getattr(L, kind)(units, return_state=True, **options)(x)[int(rng.integers(0, 2))]
    layer = getattr(L, kind)(units, **options)
    if flip(rng, 0.2):
        layer = L.Bidirectional(layer, merge_mode=one(rng, ["concat", "sum", "ave", "mul"]))
    return layer(x)


def joined(rng, x, before):
    others = [other for other in before[:-1] if other.shape == x.shape]
    if not others:
        return x
    layer = one(rng, [L.Add(), L.Subtract(), L.Multiply(), L.Average(), L.Maximum(), L.Minimum(),
                      L.Concatenate(axis=int(rng.integers(1, len(x.shape))))])
    return layer([x, one(rng, others)])


def grow(rng, x, before):
    rank = len(x.shape)
    kinds = [dense, dense, activation, activation, normalise, constant, operation, shaped, part]
    if rank == 3:
        kinds += [recurrent, recurrent, recurrent]
    if rank in (3, 4):
        kinds += [window, window, globally]
    kind = one(rng, kinds + [None, None])
    return joined(rng, x, before) if kind is None else kind(rng, x)


def network(rng):
    """One network, or none where Keras refuses what was drawn."""
    shape = [int(n) for n in rng.integers(2, 6, int(rng.integers(1, 4)))]
    x = keras.Input(shape)
    before, first = [x], x
    for _ in range(int(rng.integers(2, 7))):
        x = grow(rng, x, before)
        if int(np.prod(x.shape[1:])) > 200:
            return None
        before.append(x)
    return keras.Model(first, x) if len(before) > 2 and x is not first else None


def stirred(net, rng):
    for variable in net.weights:
        if variable.dtype != "float32":
            continue
        if any(word in variable.name for word in ("gamma", "variance")):
            variable.assign(rng.uniform(0.5, 1.5, variable.shape))
        elif any(word in variable.name for word in ("bias", "beta", "moving_mean", "alpha")):
            variable.assign(rng.uniform(-0.5, 0.5, variable.shape))


def nudged(net, x, rng):
    """Outputs where inputs and weights have other last digits."""
    weights = net.get_weights()
    noise = lambda value: (value * (1 + 1e-6 * rng.normal(0, 1, value.shape))).astype(value.dtype)
    net.set_weights([noise(value) if value.dtype == np.float32 else value for value in weights])
    found = [np.asarray(net(noise(row)[None])) for row in x]
    net.set_weights(weights)
    return found


def lite(net, x):
    converter = tf.lite.TFLiteConverter.from_keras_model(net)
    data = converter.convert()
    run = Interpreter(model_content=data)
    run.allocate_tensors()
    outputs = []
    for row in x:
        run.set_tensor(run.get_input_details()[0]["index"], row[None])
        run.invoke()
        outputs.append(run.get_tensor(run.get_output_details()[0]["index"]).copy())
    return data, outputs


def bounded(outputs):
    return all(np.all(np.isfinite(y)) and np.abs(y).max() < 1e4 for y in outputs)


def rows(values):
    return [np.asarray(row, np.float64).reshape(-1).tolist() for row in values]


def main(out, count, seed):
    rng = np.random.default_rng(seed)
    keras.utils.set_random_seed(seed)
    folders = {name: out / name for name in ("keras", "tflite")}
    expected = {name: {} for name in folders}
    for folder in folders.values():
        folder.mkdir(parents=True, exist_ok=True)
    made = 0
    while made < count:
        keras.backend.clear_session()
        try:
            net = network(rng)
            if net is None:
                continue
            stirred(net, rng)
            x = rng.normal(0, 1, (VECTORS, *net.input_shape[1:])).astype(np.float32)
            y = [np.asarray(net(row[None])) for row in x]
            beside = nudged(net, x, rng)
        except Exception:  # noqa: BLE001
            continue
        # A network that magnifies rounding is drawn again.
        size = max(np.abs(v).max() for v in y)
        reach = max(max(v.max() for v in y) - min(v.min() for v in y), 0.1 * size)
        if not bounded(y + beside) or max(np.abs(a - b).max() for a, b in zip(y, beside)) > 1e-4 * reach:
            continue
        made += 1
        name = f"{made:06d}.{one(rng, ['keras', 'keras', 'h5'])}"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(Exception):
            net.save(folders["keras"] / name)
            expected["keras"][name] = {"framework": f"keras {keras.__version__}", "x": rows(x), "y": rows(y)}
        with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(Exception):
            data, found = lite(net, x)
            if not bounded(found):
                raise ValueError("no finite outputs")
            name = f"{made:06d}.tflite"
            (folders["tflite"] / name).write_bytes(data)
            expected["tflite"][name] = {"framework": "LiteRT", "x": rows(x), "y": rows(found)}
        if made % 50 == 0 or made == count:
            for kind, folder in folders.items():
                (folder / "expected.json").write_text(json.dumps(expected[kind]))
            print(made, {kind: len(files) for kind, files in expected.items()}, file=sys.stderr, flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1)
