"""Values of a graph of ONNX in double precision, by the words of its operators' pages.

It has the operators that fuzz.py draws, and neither onnxruntime nor this project's reader has a
part in it. With `noise` every value is moved by about that part of itself, as rounding moves it.
"""
import math

import numpy as np
from onnx import helper, numpy_helper

NOISE = 2.0**-22


def sigmoid(x):
    return 0.5 * (1 + np.tanh(0.5 * x))


def softplus(x):
    return np.logaddexp(0, x)


POINTWISE = {
    "Relu": lambda x: np.maximum(x, 0), "Sigmoid": sigmoid, "Tanh": np.tanh, "Softplus": softplus,
    "Softsign": lambda x: x / (1 + np.abs(x)), "Neg": np.negative, "Identity": lambda x: x,
    "Abs": np.abs, "Sqrt": np.sqrt, "Log": np.log, "Reciprocal": lambda x: 1 / x,
}
PAIRS = {
    "Add": np.add, "Sub": np.subtract, "Mul": np.multiply, "Div": np.divide, "Pow": np.power,
    "Max": np.maximum, "Min": np.minimum, "Less": np.less, "Greater": np.greater, "MatMul": np.matmul,
}
REDUCE = {
    "ReduceMean": np.mean, "ReduceMax": np.max, "ReduceMin": np.min,
    "ReduceL1": lambda x, **k: np.sum(np.abs(x), **k),
    "ReduceL2": lambda x, **k: np.sqrt(np.sum(x * x, **k)),
    "ReduceSumSquare": lambda x, **k: np.sum(x * x, **k),
}


def parameter(op, x, a):
    if op == "LeakyRelu":
        return np.where(x < 0, a.get("alpha", 0.01) * x, x)
    if op == "HardSigmoid":
        return np.clip(a.get("alpha", 0.2) * x + a.get("beta", 0.5), 0, 1)
    below = np.expm1(np.minimum(x, 0))
    if op == "Elu":
        return np.where(x < 0, a.get("alpha", 1.0) * below, x)
    return a.get("gamma", 1.0507010221481323) * np.where(x < 0, a.get("alpha", 1.6732631921768188) * below, x)


def softmax(op, x, axis, old):
    shape = x.shape
    if old:
        # Before opset 13: a matrix, split at the axis.
        x = x.reshape(math.prod(shape[:axis]), -1)
        axis = 1
    x = x - x.max(axis=axis, keepdims=True)
    total = np.exp(x).sum(axis=axis, keepdims=True)
    return (x - np.log(total) if op == "LogSoftmax" else np.exp(x) / total).reshape(shape)


def normalised(x, axes, epsilon):
    mean = x.mean(axis=axes, keepdims=True)
    return (x - mean) / np.sqrt(((x - mean) ** 2).mean(axis=axes, keepdims=True) + epsilon)


def windows(x, size, strides, counts):
    """Every window's place in the output, and its values as far as they are within the image."""
    for place in np.ndindex(*counts):
        yield place, x[(...,) + tuple(slice(p * t, p * t + k) for p, t, k in zip(place, strides, size))]


def conv(x, w, bias, a):
    size, group = w.shape[2:], a.get("group", 1)
    strides = a.get("strides", [1] * len(size))
    pads = a.get("pads", [0] * 2 * len(size))
    x = np.pad(x, [(0, 0), (0, 0)] + list(zip(pads[:len(size)], pads[len(size):])))
    counts = [(n - k) // t + 1 for n, k, t in zip(x.shape[2:], size, strides)]
    y = np.zeros((x.shape[0], w.shape[0], *counts))
    each, inner = w.shape[0] // group, w.shape[1]
    for place, window in windows(x, size, strides, counts):
        for f in range(w.shape[0]):
            first = (f // each) * inner
            y[(slice(None), f, *place)] = (window[:, first:first + inner] * w[f]).sum(axis=tuple(range(1, x.ndim)))
    return y if bias is None else y + bias.reshape(1, -1, *[1] * len(size))


def pool(op, x, a):
    size = a["kernel_shape"]
    strides = a.get("strides", [1] * len(size))
    counts = []
    for n, k, t in zip(x.shape[2:], size, strides):
        count = -(-(n - k) // t) + 1 if a.get("ceil_mode") else (n - k) // t + 1
        counts.append(count - 1 if (count - 1) * t >= n else count)
    y = np.zeros((*x.shape[:2], *counts))
    for place, window in windows(x, size, strides, counts):
        axes = tuple(range(2, x.ndim))
        y[(slice(None), slice(None), *place)] = window.max(axis=axes) if op == "MaxPool" else window.mean(axis=axes)
    return y


def gate(name, alpha, beta):
    return {"Sigmoid": sigmoid, "Tanh": np.tanh, "HardSigmoid": lambda x: np.clip(alpha * x + beta, 0, 1)}[name]


def recurrent(op, x, w, r, b, a):
    """`Y` and `Y_h` from rest: [steps][ways][batch][units] and its last step of each way."""
    units, ways = a["hidden_size"], w.shape[0]
    kinds = a.get("activations") or {"LSTM": ["Sigmoid", "Tanh", "Tanh"], "GRU": ["Sigmoid", "Tanh"], "RNN": ["Tanh"]}[op] * ways
    # Slopes are handed out to those activations that have any, in order.
    alphas, betas = list(a.get("activation_alpha", [])), list(a.get("activation_beta", []))
    chosen = [gate(k, (alphas.pop(0) if alphas else 0.2) if k == "HardSigmoid" else 0, (betas.pop(0) if betas else 0.5) if k == "HardSigmoid" else 0) for k in kinds]
    each = len(kinds) // ways
    y = np.zeros((x.shape[0], ways, x.shape[1], units))
    last = np.zeros((ways, x.shape[1], units))
    for way in range(ways):
        f = chosen[way * each:(way + 1) * each]
        wb, rb = np.split(b[way], 2) if b is not None else (np.zeros(len(w[way])),) * 2
        h, c = np.zeros((x.shape[1], units)), np.zeros((x.shape[1], units))
        steps = range(x.shape[0])
        backward = a.get("direction") == "reverse" or way == 1
        for t in reversed(steps) if backward else steps:
            given, old = x[t] @ w[way].T + wb, h @ r[way].T + rb
            if op == "RNN":
                h = f[0](given + old)
            elif op == "GRU":
                gz, gr, gh = np.split(given, 3, axis=1)
                oz, orr, oh = np.split(old, 3, axis=1)
                z, reset = f[0](gz + oz), f[0](gr + orr)
                if a.get("linear_before_reset"):
                    n = f[1](gh + reset * oh)
                else:
                    rh = np.split(rb, 3)[2]
                    n = f[1](gh + (reset * h) @ np.split(r[way], 3)[2].T + rh)
                h = (1 - z) * n + z * h
            else:
                i, o, forget, g = np.split(given + old, 4, axis=1)
                c = f[0](forget) * c + f[0](i) * f[1](g)
                h = f[0](o) * f[2](c)
            y[t, way] = h
        last[way] = h
    return y, last


def node(op, v, a, opset):
    """Outputs of one operator for its inputs `v`, none where one is left out."""
    x = v[0]
    if op in POINTWISE:
        return POINTWISE[op](x)
    if op in PAIRS:
        return PAIRS[op](x, v[1])
    if op in REDUCE:
        return REDUCE[op](x, axis=tuple(a["axes"]), keepdims=bool(a.get("keepdims", 1)))
    if op in ("LeakyRelu", "Elu", "Selu", "HardSigmoid"):
        return parameter(op, x, a)
    if op == "PRelu":
        return np.where(x < 0, v[1] * x, x)
    if op == "Where":
        return np.where(x, v[1], v[2])
    if op == "Clip":
        low, high = (a["min"], a["max"]) if opset < 11 else v[1:]
        return np.clip(x, low, high)
    if op == "Gemm":
        y = a.get("alpha", 1.0) * ((x.T if a.get("transA") else x) @ (v[1].T if a.get("transB") else v[1]))
        return y + a.get("beta", 1.0) * v[2] if len(v) > 2 else y
    if op in ("Softmax", "LogSoftmax"):
        return softmax(op, x, a.get("axis", 1 if opset < 13 else -1) % x.ndim, opset < 13)
    if op == "Conv":
        return conv(x, v[1], v[2] if len(v) > 2 else None, a)
    if op in ("MaxPool", "AveragePool"):
        return pool(op, x, a)
    if op == "GlobalAveragePool":
        return x.mean(axis=tuple(range(2, x.ndim)), keepdims=True)
    if op == "GlobalMaxPool":
        return x.max(axis=tuple(range(2, x.ndim)), keepdims=True)
    channels = (1, -1) + (1,) * (np.ndim(x) - 2)
    if op == "BatchNormalization":
        gain, offset, mean, variance = (p.reshape(channels) for p in v[1:])
        return (x - mean) / np.sqrt(variance + a.get("epsilon", 1e-5)) * gain + offset
    if op in ("InstanceNormalization", "GroupNormalization"):
        groups = a.get("num_groups", x.shape[1])
        parts = normalised(x.reshape(x.shape[0], groups, -1), (2,), a.get("epsilon", 1e-5)).reshape(x.shape)
        return parts * v[1].reshape(channels) + v[2].reshape(channels)
    if op == "LayerNormalization":
        axes = tuple(range(a.get("axis", -1) % x.ndim, x.ndim))
        y = normalised(x, axes, a.get("epsilon", 1e-5)) * v[1]
        return y + v[2] if len(v) > 2 else y
    if op == "Shape":
        return np.asarray(x.shape, np.int64)
    if op == "Flatten":
        return x.reshape(math.prod(x.shape[:a.get("axis", 1)]), -1)
    if op == "Reshape":
        return x.reshape([x.shape[k] if n == 0 else n for k, n in enumerate(v[1])])
    if op == "Transpose":
        return x.transpose(a["perm"])
    if op == "Squeeze":
        return x.squeeze(tuple(int(n) for n in (v[1] if len(v) > 1 else a["axes"])))
    if op == "Unsqueeze":
        return np.expand_dims(x, tuple(int(n) for n in (v[1] if len(v) > 1 else a["axes"])))
    if op == "Concat":
        return np.concatenate(v, axis=a["axis"])
    if op == "Gather":
        return np.take(x, v[1].astype(int), axis=a.get("axis", 0))
    if op == "Slice":
        starts, ends, axes, steps = (a["starts"], a["ends"], a["axes"], [1]) if opset < 10 else v[1:]
        cut = [slice(None)] * x.ndim
        for start, end, axis, step in zip(starts, ends, axes, steps):
            cut[axis] = slice(int(start), int(end), int(step))
        return x[tuple(cut)]
    if op == "Split":
        return np.split(x, np.cumsum(a["split"])[:-1], axis=a.get("axis", 0))
    if op == "Pad":
        pads = [int(n) for n in (a["pads"] if opset < 11 else v[1])]
        return np.pad(x, list(zip(pads[:x.ndim], pads[x.ndim:])), mode=a.get("mode", "constant"))
    if op in ("LSTM", "GRU", "RNN"):
        b = v[3] if len(v) > 3 else None
        return recurrent(op, x, v[1], v[2], b, a)
    raise NotImplementedError(op)


def plain(value):
    if isinstance(value, bytes):
        return value.decode()
    return [plain(v) for v in value] if isinstance(value, list) else value


def wide(array):
    return array.astype(np.float64) if array.dtype == np.float32 else array


def within(op, v, a):
    """The largest value on the way to an operator's output, where it may be above the output: what is below
    the last digit of that is lost."""
    if op == "LogSoftmax":
        # x - (m + ln sum).
        return np.abs(v[0]).max()
    if op in ("InstanceNormalization", "GroupNormalization"):
        # gain x / root + (offset - gain mean / root), the way of onnxruntime, over one value: 0 / epsilon.
        groups = a.get("num_groups", v[0].shape[1])
        root = np.sqrt(v[0].reshape(v[0].shape[0], groups, -1).var(axis=2).min() + a.get("epsilon", 1e-5))
        return np.abs(v[0]).max() * np.abs(v[1]).max() / root
    return 0.0


def run(model, x, noise=0.0, rng=None):
    """The output for an input, in double precision."""

    def moved(value, size=0.0):
        if not noise or value.dtype != np.float64:
            return value
        return value + noise * np.maximum(np.abs(value), size) * rng.normal(0, 1, value.shape)

    opset, graph = model.opset_import[0].version, model.graph
    values = {weight.name: moved(wide(numpy_helper.to_array(weight))) for weight in graph.initializer}
    values["x"] = moved(np.asarray(x, np.float64))
    for proto in graph.node:
        attributes = {a.name: plain(helper.get_attribute_value(a)) for a in proto.attribute}
        inputs = [values[name] if name else None for name in proto.input]
        found = node(proto.op_type, inputs, attributes, opset)
        size = within(proto.op_type, inputs, attributes)
        for name, value in zip(proto.output, found if isinstance(found, (tuple, list)) else [found]):
            values[name] = moved(value, size)
    return values[graph.output[0].name]


def spread(model, inputs, exact, draws=6):
    """How far rounding moves the outputs: the largest difference of some draws in which the input, the
    weights and every value are moved by 2^-22 of themselves, four times the last digit of float32."""
    rng = np.random.default_rng(0)
    return max(np.abs(run(model, x, NOISE, rng) - y).max() for _ in range(draws) for x, y in zip(inputs, exact))
