#!/usr/bin/env python3
"""Random small graphs with their frameworks' own outputs.

    venv/bin/python fuzz.py OUT COUNT [SEED]

ONNX graphs of random operators, attributes, shapes and opsets, run by onnxruntime and, in double
precision, by exact.py. Those that onnxruntime itself refuses are drawn again, as are those where
rounding moves the outputs by 1 % of their range. Files come in folders of 500.
"""
import json
import os
import pathlib
import sys

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")

import numpy as np  # noqa: E402
import onnx  # noqa: E402
import onnxruntime  # noqa: E402
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

import exact  # noqa: E402

VECTORS, FOLDER = 3, 500
# Part of the range from which on rounding leaves nothing to compare.
NO_DIGITS = 1e-2
onnxruntime.set_default_logger_severity(4)


class Graph:
    """A graph that grows by one operator at a time; shapes hold the batch of 1."""

    def __init__(self, rng):
        self.rng, self.nodes, self.weights, self.count = rng, [], [], 0
        rank = int(rng.integers(2, 5))
        self.shape = [1] + [int(rng.integers(2, 6)) for _ in range(rank - 1)]
        self.opset = int(rng.integers(7, 22))
        self.input, self.last, self.first = list(self.shape), "x", "x"
        self.before = [("x", list(self.shape))]

    def name(self):
        self.count += 1
        return f"t{self.count}"

    def weight(self, array):
        name = self.name()
        self.weights.append(numpy_helper.from_array(array, name))
        return name

    def floats(self, *shape):
        return self.weight(self.rng.normal(0, 0.6, shape).astype(np.float32))

    def ints(self, values):
        return self.weight(np.asarray(values, np.int64))

    def node(self, op, inputs, shape, **attributes):
        out = self.name()
        self.nodes.append(helper.make_node(op, inputs, [out], name=f"n{len(self.nodes)}", **attributes))
        self.last, self.shape = out, [int(n) for n in shape]
        self.before.append((out, list(self.shape)))

    def grow(self):
        rng, s, x, rank = self.rng, self.shape, self.last, len(self.shape)
        pick = rng.choice(["act", "act", "param", "dense", "dense", "const", "const", "softmax", "flatten", "reshape",
                           "transpose", "conv", "pool", "global", "norm", "slice", "gather", "concat", "add", "rnn",
                           "reduce", "squeeze", "clip", "split", "view", "product", "product", "spread", "pad", "power",
                           "layernorm", "choice", "ceil", "prelu", "left", "logsoftmax", "groups", "far", "norms", "parts"])
        if pick == "act":
            self.node(str(rng.choice(["Relu", "Sigmoid", "Tanh", "Softplus", "Softsign", "Neg", "Identity"])), [x], s)
        elif pick == "param":
            op = str(rng.choice(["LeakyRelu", "Elu", "Selu", "HardSigmoid"]))
            attributes = {} if rng.random() < 0.4 else {"alpha": float(rng.uniform(0.05, 0.9))}
            if op == "HardSigmoid" and rng.random() < 0.5:
                attributes["beta"] = float(rng.uniform(0.1, 0.9))
            self.node(op, [x], s, **attributes)
        elif pick == "dense":
            units = int(rng.integers(1, 6))
            if rank == 2 and rng.random() < 0.6:
                turned = bool(rng.random() < 0.5)
                w = self.floats(*([units, s[-1]] if turned else [s[-1], units]))
                bias = [self.floats(*([units] if rng.random() < 0.7 else [1, units]))] if rng.random() < 0.8 or self.opset < 11 else []
                self.node("Gemm", [x, w] + bias, [s[0], units], transB=int(turned), alpha=float(rng.choice([1.0, 0.5])), beta=float(rng.choice([1.0, 2.0])))
            else:
                self.node("MatMul", [x, self.floats(s[-1], units)], s[:-1] + [units])
        elif pick == "const":
            op = str(rng.choice(["Add", "Sub", "Mul", "Div"]))
            shape = [n if rng.random() < 0.5 else 1 for n in s]
            shape = shape[int(rng.integers(0, rank + 1)):]
            c = rng.normal(0, 1, shape).astype(np.float32)
            c = np.where(np.abs(c) < 0.3, np.float32(0.7), c) if op == "Div" else c
            c = self.weight(np.asarray(c, np.float32))
            reverse = op in ("Add", "Mul", "Sub") and rng.random() < 0.3
            self.node(op, [c, x] if reverse else [x, c], s)
        elif pick == "softmax":
            axis = {} if rng.random() < 0.4 else {"axis": int(rng.integers(1, rank)) - (rank if rng.random() < 0.5 and self.opset >= 11 else 0)}
            self.node("Softmax", [x], s, **axis)
        elif pick == "flatten":
            axis = int(rng.integers(0, rank))
            self.node("Flatten", [x], [int(np.prod(s[:axis])), int(np.prod(s[axis:]))], axis=axis)
        elif pick == "reshape":
            inner = int(np.prod(s))
            parts = [n for n in range(1, inner + 1) if inner % n == 0]
            a = int(rng.choice(parts))
            shape = [1, a, inner // a] if rng.random() < 0.5 else [1, inner]
            asked = list(shape)
            if rng.random() < 0.5:
                asked[int(rng.integers(1, len(asked)))] = -1
            if rng.random() < 0.3:
                asked[0] = 0 if s[0] == 1 else 1
            self.node("Reshape", [x, self.ints(asked)], shape)
        elif pick == "view":
            shape = self.name()
            self.nodes.append(helper.make_node("Shape", [x], [shape]))
            first = self.name()
            self.nodes.append(helper.make_node("Gather", [shape, self.weight(np.asarray(0, np.int64))], [first], axis=0))
            lifted = self.name()
            if self.opset < 13:
                self.nodes.append(helper.make_node("Unsqueeze", [first], [lifted], axes=[0]))
            else:
                self.nodes.append(helper.make_node("Unsqueeze", [first, self.ints([0])], [lifted]))
            both = self.name()
            self.nodes.append(helper.make_node("Concat", [lifted, self.ints([-1])], [both], axis=0))
            self.node("Reshape", [x, both], [s[0], int(np.prod(s[1:]))])
        elif pick == "transpose":
            order = [0] + [int(a) + 1 for a in rng.permutation(rank - 1)] if rng.random() < 0.7 else [int(a) for a in rng.permutation(rank)]
            self.node("Transpose", [x], [s[a] for a in order], perm=order)
        elif pick == "conv" and rank in (3, 4) and s[0] == 1:
            filters, size = int(rng.integers(1, 4)), [int(rng.integers(1, min(3, n) + 1)) for n in s[2:]]
            strides = [int(rng.integers(1, 3)) for _ in size]
            pads = [int(rng.integers(0, 2)) for _ in size]
            group = 1 if rng.random() < 0.7 else s[1]
            w = self.floats(filters * group if group > 1 else filters, s[1] // group, *size)
            shape = [1, filters * group if group > 1 else filters] + [(n + 2 * p - k) // t + 1 for n, p, k, t in zip(s[2:], pads, size, strides)]
            bias = [self.floats(shape[1])] if rng.random() < 0.7 else []
            self.node("Conv", [x, w] + bias, shape, strides=strides, pads=pads + pads, group=group)
        elif pick == "pool" and rank in (3, 4) and s[0] == 1:
            size = [int(rng.integers(1, min(3, n) + 1)) for n in s[2:]]
            strides = [int(rng.integers(1, 3)) for _ in size]
            shape = s[:2] + [(n - k) // t + 1 for n, k, t in zip(s[2:], size, strides)]
            self.node(str(rng.choice(["MaxPool", "AveragePool"])), [x], shape, kernel_shape=size, strides=strides)
        elif pick == "global" and rank in (3, 4) and s[0] == 1:
            self.node(str(rng.choice(["GlobalAveragePool", "GlobalMaxPool"])), [x], s[:2] + [1] * (rank - 2))
        elif pick == "norm" and s[0] == 1 and rank > 1:
            c = s[1]
            variance = self.weight(rng.uniform(0.3, 2, c).astype(np.float32))
            self.node("BatchNormalization", [x, self.floats(c), self.floats(c), self.floats(c), variance], s, epsilon=float(rng.choice([1e-5, 1e-3])))
        elif pick == "slice":
            axis = int(rng.integers(1, rank))
            start, end, step = int(rng.integers(0, s[axis])), 2**31, int(rng.choice([1, 1, 2]))
            length = len(range(s[axis])[start:end:step])
            shape = s[:axis] + [length] + s[axis + 1:]
            if self.opset < 10:
                shape[axis] = s[axis] - start
                self.node("Slice", [x], shape, starts=[start], ends=[end], axes=[axis])
            else:
                self.node("Slice", [x, self.ints([start]), self.ints([end]), self.ints([axis]), self.ints([step])], shape)
        elif pick == "gather":
            axis = int(rng.integers(1, rank))
            if rank > 2 and rng.random() < 0.5:
                i = int(rng.integers(-s[axis] if self.opset >= 11 else 0, s[axis]))
                self.node("Gather", [x, self.weight(np.asarray(i, np.int64))], s[:axis] + s[axis + 1:], axis=axis)
            else:
                i = [int(v) for v in rng.integers(0, s[axis], int(rng.integers(1, 4)))]
                self.node("Gather", [x, self.ints(i)], s[:axis] + [len(i)] + s[axis + 1:], axis=axis)
        elif pick == "left" and rank > 1:
            units = int(rng.integers(1, 6))
            self.node("MatMul", [self.floats(units, s[-2]), x], s[:-2] + [units, s[-1]])
        elif pick == "logsoftmax":
            far = self.name()
            self.nodes.append(helper.make_node("Mul", [x, self.weight(np.asarray(rng.choice([1, 60, -90]), np.float32))], [far]))
            axis = {} if rng.random() < 0.4 else {"axis": int(rng.integers(1, rank))}
            self.node("LogSoftmax", [far], s, **axis)
        elif pick == "groups" and rank in (3, 4) and s[0] == 1:
            if self.opset >= 21 and rng.random() < 0.6:
                groups = int(rng.choice([n for n in range(1, s[1] + 1) if s[1] % n == 0]))
                self.node("GroupNormalization", [x, self.floats(s[1]), self.floats(s[1])], s, num_groups=groups, epsilon=float(rng.choice([1e-2, 0.1])))
            else:
                self.node("InstanceNormalization", [x, self.floats(s[1]), self.floats(s[1])], s, epsilon=float(rng.choice([1e-2, 0.1])))
        elif pick == "far":
            op, size = str(rng.choice(["Max", "Min"])), float(rng.choice([1e-3, 1.0, 1e6]))
            shape = [n if rng.random() < 0.5 else 1 for n in s]
            c = self.weight(np.asarray(rng.normal(0, size, shape[int(rng.integers(0, rank + 1)):]), np.float32))
            self.node(op, [c, x] if rng.random() < 0.3 else [x, c], s)
        elif pick == "norms" and rank > 1 and self.opset < 18:
            axis, keep = int(rng.integers(1, rank)), int(rng.integers(0, 2)) if rank > 2 else 1
            shape = s[:axis] + [1] * keep + s[axis + 1:]
            self.node(str(rng.choice(["ReduceL1", "ReduceL2", "ReduceSumSquare", "ReduceMin"])), [x], shape, axes=[axis], keepdims=keep)
        elif pick == "parts" and rank > 1 and max(s[1:]) > 1 and self.opset in (11, 12):
            axis = 1 + int(np.argmax(s[1:]))
            first = int(rng.integers(1, s[axis]))
            parts = [self.name(), self.name()]
            self.nodes.append(helper.make_node("Split", [x], parts, axis=axis, split=[first, s[axis] - first]))
            which = int(rng.integers(0, 2))
            self.node("Tanh", [parts[which]], s[:axis] + [[first, s[axis] - first][which]] + s[axis + 1:])
        elif pick == "product":
            others = [name for name, shape in self.before if shape == s]
            other = str(rng.choice(others)) if others else x
            op = str(rng.choice(["Mul", "Mul", "Max", "Min", "Div"]))
            if op == "Div":
                # A divisor that is not near zero.
                positive = self.name()
                self.nodes.append(helper.make_node("Sigmoid", [other], [positive]))
                other = self.name()
                self.nodes.append(helper.make_node("Add", [positive, self.weight(np.asarray(0.5, np.float32))], [other]))
            self.node(op, [x, other] if rng.random() < 0.5 or op == "Div" else [other, x], s)
        elif pick == "spread" and rank > 2 and self.opset < 18:
            axis, mean = int(rng.integers(1, rank)), self.name()
            self.nodes.append(helper.make_node(str(rng.choice(["ReduceMean", "ReduceMax"])), [x], [mean], axes=[axis], keepdims=1))
            self.node(str(rng.choice(["Add", "Sub", "Mul", "Max"])), [x, mean] if rng.random() < 0.5 else [mean, x], s)
        elif pick == "pad":
            mode = str(rng.choice(["constant", "constant", "edge", "reflect"]))
            most = [0] + [min(2, n - 1) if mode == "reflect" else 2 for n in s[1:]]
            before, after = ([int(rng.integers(0, n + 1)) if rng.random() < 0.6 else 0 for n in most] for _ in range(2))
            shape = [n + a + b for n, a, b in zip(s, before, after)]
            if self.opset < 11:
                self.node("Pad", [x], shape, mode=mode, pads=before + after)
            else:
                self.node("Pad", [x, self.ints(before + after)], shape, mode=mode)
        elif pick == "power":
            op = str(rng.choice(["Pow", "Sqrt", "Reciprocal", "Abs", "Log"]))
            if op == "Abs":
                self.node(op, [x], s)
            elif op == "Pow" and rng.random() < 0.5:
                self.node(op, [x, self.weight(np.asarray(rng.integers(1, 4), np.float32))], s)
            else:
                positive = self.name()
                self.nodes.append(helper.make_node("Softplus", [x], [positive]))
                shifted = self.name()
                self.nodes.append(helper.make_node("Add", [positive, self.weight(np.asarray(0.3, np.float32))], [shifted]))
                exponent = [self.weight(np.asarray(rng.choice([0.5, -0.5, -1, -2, 1.5]), np.float32))] if op == "Pow" else []
                self.node(op, [shifted] + exponent, s)
        elif pick == "layernorm" and self.opset >= 17 and rank > 1 and s[-1] > 2:
            axis = int(rng.integers(1, rank))
            inner = s[axis:]
            self.node("LayerNormalization", [x, self.floats(*inner)] + ([self.floats(*inner)] if rng.random() < 0.7 else []), s,
                      axis=axis, epsilon=float(rng.choice([1e-5, 1e-2])))
        elif pick == "choice" and self.opset >= 9:
            zero, sign, slope = self.weight(np.asarray(0, np.float32)), self.name(), self.name()
            less = rng.random() < 0.5
            self.nodes.append(helper.make_node("Less" if less else "Greater", [x, zero], [sign]))
            factor = self.weight(np.asarray(rng.uniform(-1, 1), np.float32))
            self.nodes.append(helper.make_node("Mul", [x, factor], [slope]))
            self.node("Where", [sign, slope, x] if less else [sign, x, slope], s)
        elif pick == "ceil" and rank in (3, 4) and s[0] == 1 and self.opset >= 11:
            size = [int(rng.integers(1, min(3, n) + 1)) for n in s[2:]]
            strides = [int(rng.integers(1, 3)) for _ in size]
            shape = s[:2] + [-(-(n - k) // t) + 1 for n, k, t in zip(s[2:], size, strides)]
            # The last window begins within the image.
            shape = s[:2] + [m - 1 if (m - 1) * t >= n else m for m, n, t in zip(shape[2:], s[2:], strides)]
            self.node(str(rng.choice(["MaxPool", "AveragePool"])), [x], shape, kernel_shape=size, strides=strides, ceil_mode=1)
        elif pick == "prelu":
            shape = [1] * (rank - 1) + [s[-1]] if rng.random() < 0.5 else [s[1]] + [1] * (rank - 2)
            self.node("PRelu", [x, self.floats(*shape)], s)
        elif pick in ("concat", "add"):
            others = [name for name, shape in self.before[:-1] if shape == s]
            if not others:
                return
            other = str(rng.choice(others))
            if pick == "add":
                self.node(str(rng.choice(["Add", "Sub"])), [x, other], s)
            else:
                axis = int(rng.integers(1, rank))
                self.node("Concat", [x, other], s[:axis] + [2 * s[axis]] + s[axis + 1:], axis=axis)
        elif pick == "rnn" and rank == 3:
            self.recurrent()
        elif pick == "reduce" and rank > 2 and self.opset < 18:
            axis = int(rng.integers(1, rank))
            keep = int(rng.integers(0, 2))
            self.node(str(rng.choice(["ReduceMean", "ReduceMax"])), [x], s[:axis] + [1] * keep + s[axis + 1:], axes=[axis], keepdims=keep)
        elif pick == "squeeze" and 1 in s[1:] and rank > 2:
            axis = s[1:].index(1) + 1
            axes = ([x, self.ints([axis])], {}) if self.opset >= 13 else ([x], {"axes": [axis]})
            self.node("Squeeze", axes[0], s[:axis] + s[axis + 1:], **axes[1])
        elif pick == "clip":
            low, high = float(rng.uniform(-1, 0)), float(rng.uniform(0.1, 1))
            if self.opset < 11:
                self.node("Clip", [x], s, min=low, max=high)
            else:
                bounds = [self.weight(np.asarray(v, np.float32)) for v in (low, high)]
                self.node("Clip", [x] + bounds, s)
        elif pick == "split" and s[-1] > 1 and self.opset < 13:
            first = int(rng.integers(1, s[-1]))
            a, b = self.name(), self.name()
            self.nodes.append(helper.make_node("Split", [x], [a, b], axis=rank - 1, split=[first, s[-1] - first]))
            self.last, self.shape = a, s[:-1] + [first]

    def recurrent(self):
        rng, s, units = self.rng, self.shape, int(self.rng.integers(1, 4))
        if s[1] != 1:
            self.node("Transpose", [self.last], [s[1], s[0], s[2]], perm=[1, 0, 2])
            s = self.shape
        if s[1] != 1:
            return
        op = str(rng.choice(["LSTM", "GRU", "RNN"]))
        gates = {"LSTM": 4, "GRU": 3, "RNN": 1}[op]
        ways = 2 if rng.random() < 0.25 else 1
        attributes = {"hidden_size": units}
        if ways == 2:
            attributes["direction"] = "bidirectional"
        elif rng.random() < 0.25:
            attributes["direction"] = "reverse"
        if op == "GRU":
            attributes["linear_before_reset"] = int(rng.integers(0, 2))
        if rng.random() < 0.3:
            kinds = {"LSTM": ["HardSigmoid", "Tanh", "Tanh"], "GRU": ["HardSigmoid", "Tanh"], "RNN": ["HardSigmoid"]}[op]
            attributes["activations"] = kinds * ways
            if rng.random() < 0.6:
                attributes["activation_alpha"] = [float(rng.uniform(0.1, 0.5))] * ways
                attributes["activation_beta"] = [float(rng.uniform(0.3, 0.7))] * ways
        inputs = [self.last, self.floats(ways, gates * units, s[2]), self.floats(ways, gates * units, units)]
        if rng.random() < 0.7:
            inputs.append(self.floats(ways, 2 * gates * units))
            if rng.random() < 0.5:
                inputs += ["", self.weight(np.zeros((ways, 1, units), np.float32))]
        y, h = self.name(), self.name()
        last = rng.random() < 0.5
        self.nodes.append(helper.make_node(op, inputs, ["" if last and rng.random() < 0.5 else y, h], name=f"n{len(self.nodes)}", **attributes))
        self.last, self.shape = (h, [ways, 1, units]) if last else (y, [s[0], ways, 1, units])

    def model(self):
        given = helper.make_tensor_value_info("x", TensorProto.FLOAT, self.input)
        found = helper.make_tensor_value_info(self.last, TensorProto.FLOAT, self.shape)
        graph = helper.make_graph(self.nodes, "g", [given], [found], self.weights)
        return helper.make_model(graph, opset_imports=[helper.make_opsetid("", self.opset)], ir_version=8)


def of_range(outputs):
    """What a difference is a part of, as in ../cases.rs."""
    size = max(np.abs(y).max() for y in outputs)
    reach = max(y.max() for y in outputs) - min(y.min() for y in outputs)
    return max(reach, 0.1 * size, 1e-3)


def onnx_graph(rng):
    """A graph, inputs, outputs of onnxruntime and in double precision, and how far rounding moves them."""
    while True:
        graph = Graph(rng)
        for _ in range(int(rng.integers(2, 8))):
            if int(np.prod(graph.shape)) < 200:
                graph.grow()
        if not graph.nodes:
            continue
        model = graph.model()
        data = model.SerializeToString()
        try:
            session = onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"])
            x = [rng.normal(0, 1, graph.input).astype(np.float32) for _ in range(VECTORS)]
            y = [np.asarray(session.run(None, {"x": v})[0]) for v in x]
        except Exception:  # noqa: BLE001
            continue
        sound = [exact.run(model, v) for v in x]
        if not all(np.all(np.isfinite(v)) for v in y + sound):
            continue
        moved = exact.spread(model, x, sound) / of_range(sound)
        if moved < NO_DIGITS:
            return data, x, y, sound, moved


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, count = pathlib.Path(sys.argv[1]), int(sys.argv[2])
    rng = np.random.default_rng(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    for first in range(0, count, FOLDER):
        folder, expected = out / f"{first:06d}", {}
        folder.mkdir(parents=True, exist_ok=True)
        for number in range(first, min(first + FOLDER, count)):
            data, x, y, sound, moved = onnx_graph(rng)
            name = f"{number:06d}.onnx"
            (folder / name).write_bytes(data)
            rows = lambda v: [np.asarray(r, np.float64).reshape(-1).tolist() for r in v]
            expected[name] = {"framework": f"onnxruntime {onnxruntime.__version__}", "x": rows(x), "y": rows(y),
                              "exact": rows(sound), "rounding": moved}
        (folder / "expected.json").write_text(json.dumps(expected))
        print(folder, len(expected), flush=True)
