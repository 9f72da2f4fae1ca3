#!/usr/bin/env python3
"""Recurrent networks over an open number of steps, with the frameworks' outputs after six steps.

    venv/bin/python open_steps.py OUT

A call of the emitted network is one step, so a layer that sees other steps than its own has to be
refused. The committed result is ../cases/45-open-steps.
"""
import json
import os
import pathlib
import sys

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")

import keras  # noqa: E402
import numpy as np  # noqa: E402
import onnx  # noqa: E402
import onnxruntime  # noqa: E402
from keras import layers as L  # noqa: E402
from onnx import TensorProto, helper, numpy_helper  # noqa: E402

STEPS, VECTORS = 6, 3
RNG = np.random.default_rng(45)


def gru():
    return L.GRU(3, return_sequences=True)


KERAS = {
    "last-step": lambda x: L.Dense(2)(gru()(x)[:, -1]),
    "layer-norm": lambda x: L.Dense(2)(L.GRU(3)(L.LayerNormalization()(L.Dense(4)(x)))),
    "gated": lambda x: L.GRU(2)(L.Multiply()([L.Dense(3, "sigmoid")(x), L.Dense(3)(x)])),
    "first-step": lambda x: L.Dense(2)(gru()(x)[:, 0]),
    "backward": lambda x: L.Dense(2)(L.GRU(3, go_backwards=True)(x)),
    "both-ways": lambda x: L.Dense(2)(L.Bidirectional(L.GRU(3))(x)),
    "padded": lambda x: L.Dense(2)(L.GRU(3)(L.ZeroPadding1D(2)(x))),
    "twice": lambda x: L.GRU(2)(L.Concatenate(axis=1)([x, x])),
    "mean": lambda x: L.Dense(2)(L.GlobalAveragePooling1D()(gru()(x))),
}


class Graph:
    def __init__(self):
        self.nodes, self.weights = [], []

    def constant(self, array):
        self.weights.append(numpy_helper.from_array(np.asarray(array), f"w{len(self.weights)}"))
        return self.weights[-1].name

    def floats(self, *shape):
        return self.constant(RNG.normal(0, 0.5, shape).astype(np.float32))

    def ints(self, *values):
        return self.constant(np.array(values, np.int64))

    def node(self, op, *inputs, outputs=1, **attributes):
        names = [f"v{len(self.nodes)}_{i}" for i in range(outputs)]
        self.nodes.append(helper.make_node(op, list(inputs), names, name=f"{op}_{len(self.nodes)}", **attributes))
        return names[0] if outputs == 1 else names

    def place(self, x, index, axis=1):
        return self.node("Gather", x, self.constant(np.int64(index)), axis=axis)


ONNX = {
    "last-step": lambda g, y: g.node("MatMul", g.place(y, -1), g.floats(3, 2)),
    "last-slice": lambda g, y: g.node("MatMul", g.node("Slice", y, g.ints(-1), g.ints(2**31), g.ints(1)), g.floats(3, 2)),
    "first-step": lambda g, y: g.node("MatMul", g.place(y, 0), g.floats(3, 2)),
    "first-slice": lambda g, y: g.node("MatMul", g.node("Slice", y, g.ints(0), g.ints(1), g.ints(1)), g.floats(3, 2)),
    "mean": lambda g, y: g.node("MatMul", g.node("ReduceMean", y, axes=[1], keepdims=0), g.floats(3, 2)),
    "softmax": lambda g, y: g.place(g.node("Softmax", y, axis=1), -1),
    "convolution": lambda g, y: g.place(
        g.node("Conv", g.node("Transpose", y, perm=[0, 2, 1]), g.floats(2, 3, 3), pads=[2, 0]), -1, axis=2),
    "padded": lambda g, y: g.place(g.node("Pad", y, g.ints(0, 0, 0, 0, 1, 0)), -1),
}


def onnx_model(tail):
    g = Graph()
    y, _ = g.node("GRU", "x", g.floats(1, 9, 2), g.floats(1, 9, 3), g.floats(1, 18), outputs=2, hidden_size=3)
    y = g.node("Transpose", g.node("Squeeze", y, g.ints(1)), perm=[1, 0, 2])
    result = tail(g, y)
    x = helper.make_tensor_value_info("x", TensorProto.FLOAT, ["steps", 1, 2])
    out = helper.make_tensor_value_info(result, TensorProto.FLOAT, None)
    graph = helper.make_graph(g.nodes, "g", [x], [out], g.weights)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def main(out):
    out.mkdir(parents=True, exist_ok=True)
    keras.utils.set_random_seed(45)
    expected = {}
    rows = lambda values: [np.asarray(v, np.float64).reshape(-1).tolist() for v in values]
    for name, call in KERAS.items():
        given = keras.Input((None, 2))
        net = keras.Model(given, call(given))
        x = [RNG.normal(0, 1, (1, STEPS, 2)).astype(np.float32) for _ in range(VECTORS)]
        net.save(out / f"{name}.keras")
        expected[f"{name}.keras"] = {"framework": f"keras {keras.__version__}", "x": rows(x), "y": rows(net(v) for v in x)}
    for name, tail in ONNX.items():
        model = onnx_model(tail)
        run = onnxruntime.InferenceSession(model.SerializeToString())
        x = [RNG.normal(0, 1, (STEPS, 1, 2)).astype(np.float32) for _ in range(VECTORS)]
        onnx.save(model, out / f"{name}.onnx")
        y = [run.run(None, {"x": v})[0] for v in x]
        expected[f"{name}.onnx"] = {"framework": f"onnxruntime {onnxruntime.__version__}", "x": rows(x), "y": rows(y)}
    (out / "expected.json").write_text(json.dumps(expected))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
