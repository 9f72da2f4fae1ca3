#!/usr/bin/env python3
"""Siblings of the cases in ../cases: other layers, operators and opsets with the same kind of trap.

    venv/bin/python siblings.py OUT [onnx] [keras] [tflite]

One folder for each framework, its networks with the framework's own outputs in expected.json.
"""
import contextlib
import io
import json
import os
import pathlib
import sys
import traceback

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")

import numpy as np  # noqa: E402

VECTORS = 4
RNG = np.random.default_rng(40)


def floats(*shape):
    return RNG.normal(0, 0.6, shape).astype(np.float32)


class Folder:
    """A folder of networks of one framework, and what the framework gives for each."""

    def __init__(self, out, name):
        self.path = pathlib.Path(out) / name
        self.path.mkdir(parents=True, exist_ok=True)
        self.expected = {}

    def add(self, file, x, y, **more):
        if not np.isfinite(np.asarray(y, np.float64)).all():
            print("no finite outputs:", file)
            (self.path / file).unlink()
            return
        self.expected[file] = dict(more, x=np.asarray(x, np.float64).tolist(), y=np.asarray(y, np.float64).tolist())

    def done(self):
        (self.path / "expected.json").write_text(json.dumps(self.expected))
        print(self.path, len(self.expected))


def onnx_graphs(out):
    import onnx
    import onnxruntime
    from onnx import TensorProto, helper, numpy_helper

    onnxruntime.set_default_logger_severity(4)
    folder = Folder(out, "onnx")

    def graph(name, shape, nodes, weights, opset=21, scale=1.0, shift=0.0, outputs=None):
        tensors = [numpy_helper.from_array(np.asarray(value), key) for key, value in weights.items()]
        made = helper.make_graph(
            nodes, "g", [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info("y", TensorProto.FLOAT, None)], tensors)
        made.output[0].type.tensor_type.elem_type = TensorProto.FLOAT
        made.output[0].type.tensor_type.ClearField("shape")
        model = helper.make_model(made, opset_imports=[helper.make_opsetid("", opset)])
        model.ir_version = min(model.ir_version, 10)
        path = folder.path / f"{name}.onnx"
        onnx.save(model, path)
        try:
            # An optimised graph rounds activations where weights are integers.
            options = onnxruntime.SessionOptions()
            options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
            session = onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
            x = (RNG.normal(0, 1, [VECTORS, *[n if isinstance(n, int) else 1 for n in shape]]) * scale + shift).astype(np.float32)
            y = [session.run(None, {"x": one})[0] for one in x]
        except Exception as error:
            print("onnxruntime itself refuses", name, str(error).splitlines()[-1][:160])
            path.unlink()
            return
        folder.add(path.name, x, y)

    n = helper.make_node
    w = floats(5, 4)
    # 09, 11: defaults that depend on the opset or the attribute.
    for opset in (11, 13):
        graph(f"logsoftmax-{opset}", [1, 2, 5], [n("LogSoftmax", ["x"], ["y"])], {}, opset, 60.0)
        graph(f"logsoftmax-axis-{opset}", [1, 3, 4], [n("LogSoftmax", ["x"], ["y"], axis=1)], {}, opset, 60.0)
    graph("hardsigmoid", [1, 5], [n("HardSigmoid", ["x"], ["y"], alpha=0.3, beta=0.4)], {}, 13)
    graph("hardswish", [1, 5], [n("HardSwish", ["x"], ["y"])], {}, 14, 4.0)
    graph("thresholded", [1, 5], [n("ThresholdedRelu", ["x"], ["y"], alpha=0.5)], {}, 13)
    graph("shrink", [1, 5], [n("Shrink", ["x"], ["y"], lambd=0.5, bias=0.5)], {}, 13)
    graph("shrink-jump", [1, 5], [n("Shrink", ["x"], ["y"], lambd=0.5)], {}, 13)
    # 46: bounds.
    for opset, inputs, more in ((6, ["x"], {"min": -2e5, "max": 3e5}), (13, ["x", "lo", "hi"], {})):
        if opset == 6:
            opset = 10
        graph(f"clip-far-{opset}", [1, 5], [n("Clip", inputs, ["y"], **more)], {} if more else {"lo": np.float32(-2e5), "hi": np.float32(3e5)}, opset, 2e5)
    graph("clip-crossed", [1, 5], [n("Clip", ["x", "lo", "hi"], ["y"])], {"lo": np.float32(0.5), "hi": np.float32(-0.5)}, 13)
    graph("clip-equal", [1, 5], [n("Clip", ["x", "lo", "hi"], ["a"]), n("Add", ["a", "x"], ["y"])], {"lo": np.float32(0.5), "hi": np.float32(0.5)}, 13)
    graph("clip-only-high", [1, 5], [n("Clip", ["x", "", "hi"], ["y"])], {"hi": np.float32(-2e4)}, 13, 3e4)
    graph("max-far", [1, 5], [n("Max", ["x", "c"], ["y"])], {"c": np.float32([-1e6])}, 13, 1e6)
    graph("min-each", [1, 5], [n("Min", ["c", "x"], ["y"])], {"c": np.float32([[1e7, 0.1, -1e6, 0.3, -0.2]])}, 13)
    graph("max-each-row", [1, 2, 3], [n("Max", ["x", "c"], ["y"])], {"c": floats(2, 1)}, 13)
    graph("max-three", [1, 4], [n("Tanh", ["x"], ["a"]), n("Neg", ["x"], ["b"]), n("Max", ["x", "a", "b"], ["y"])], {}, 13)
    graph("max-constant-three", [1, 4], [n("Tanh", ["x"], ["a"]), n("Max", ["x", "a", "c"], ["y"])], {"c": np.float32([0.1])}, 13)
    graph("min-other-size", [1, 4], [n("MatMul", ["x", "w"], ["a"]), n("Mul", ["a", "c"], ["b"]), n("Min", ["x", "b"], ["y"])], {"w": floats(4, 4), "c": np.float32([1e6])}, 13)
    # 18: constants as operands of any operator.
    graph("matmul-left", [4, 3], [n("MatMul", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("matmul-left-batch", [1, 4, 3], [n("MatMul", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("matmul-left-vector", [4], [n("MatMul", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("matmul-left-column", [1, 4, 1], [n("MatMul", ["w", "x"], ["a"]), n("Squeeze", ["a", "ax"], ["y"])], {"w": w, "ax": np.int64([2])}, 13)
    graph("matmul-left-four", [1, 2, 4, 3], [n("MatMul", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("matmul-left-row-vector", [1, 4, 3], [n("MatMul", ["v", "x"], ["y"])], {"v": floats(4)}, 13)
    graph("matmul-turned", [1, 4], [n("Transpose", ["x"], ["t"], perm=[1, 0]), n("MatMul", ["w", "t"], ["a"]), n("Transpose", ["a"], ["y"], perm=[1, 0])], {"w": w}, 13)
    graph("matmul-left-open", ["N", 4, 3], [n("MatMul", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("matmul-batched-weights", [1, 2, 4], [n("MatMul", ["x", "w"], ["y"])], {"w": floats(1, 4, 3)}, 13)
    graph("matmul-weights-each", [1, 2, 3, 4], [n("MatMul", ["x", "w"], ["y"])], {"w": floats(2, 4, 3)}, 13)
    graph("matmul-both", [1, 3, 4], [n("Transpose", ["x"], ["t"], perm=[0, 2, 1]), n("MatMul", ["x", "t"], ["y"])], {}, 13)
    graph("gemm-left", [4, 1], [n("Gemm", ["w", "x"], ["y"])], {"w": w}, 13)
    graph("gemm-left-turned", [1, 4], [n("Gemm", ["w", "x"], ["a"], transB=1), n("Transpose", ["a"], ["y"], perm=[1, 0])], {"w": w}, 13)
    graph("gemm-transa", [4, 1], [n("Gemm", ["x", "w"], ["y"], transA=1)], {"w": floats(4, 3)}, 13)
    graph("power-base", [1, 4], [n("Pow", ["c", "x"], ["y"])], {"c": np.float32(2.0)}, 13)
    graph("mod", [1, 4], [n("Mod", ["x", "c"], ["y"], fmod=1)], {"c": np.float32(0.7)}, 13)
    graph("conv-constant-image", [1, 2, 6], [n("Conv", ["x", "w"], ["y"])], {"w": floats(3, 2, 2)}, 13)
    # Reductions and their switches.
    for name, more in (("keep", {"keepdims": 1}), ("drop", {"keepdims": 0})):
        graph(f"mean-noop-{name}", [1, 3, 4], [n("ReduceMean", ["x"], ["a"], noop_with_empty_axes=1, **more), n("Tanh", ["a"], ["y"])], {}, 18)
        graph(f"mean-noop-empty-{name}", [1, 3, 4], [n("ReduceMean", ["x", "e"], ["a"], noop_with_empty_axes=1, **more), n("Tanh", ["a"], ["y"])], {"e": np.zeros(0, np.int64)}, 18)
        graph(f"mean-noop-axes-{name}", [1, 3, 4], [n("ReduceMean", ["x", "e"], ["a"], noop_with_empty_axes=1, **more), n("Tanh", ["a"], ["y"])], {"e": np.int64([2])}, 18)
    for op in ("ReduceMin", "ReduceL2", "ReduceL1", "ReduceSumSquare", "ReduceLogSumExp", "ReduceLogSum", "ReduceProd"):
        graph(op.lower(), [1, 3, 4], [n(op, ["x"], ["y"], axes=[2], keepdims=1)], {}, 13)
    graph("globallppool", [1, 3, 4], [n("GlobalLpPool", ["x"], ["y"], p=2)], {}, 13)
    graph("lppool", [1, 3, 6], [n("LpPool", ["x"], ["y"], kernel_shape=[2], p=2)], {}, 13)
    graph("lpnormal", [1, 3, 4], [n("LpNormalization", ["x"], ["y"], axis=-1, p=2)], {}, 13)
    graph("cumsum", [1, 4], [n("CumSum", ["x", "a"], ["y"])], {"a": np.int64(1)}, 13)
    graph("cumsum-exclusive", [1, 4], [n("CumSum", ["x", "a"], ["y"], exclusive=1, reverse=1)], {"a": np.int64(1)}, 13)
    # 15: normalisations.
    s, b = floats(6), floats(6)
    graph("instance", [1, 6, 5], [n("InstanceNormalization", ["x", "s", "b"], ["y"], epsilon=1e-3)], {"s": s, "b": b}, 13)
    graph("instance-image", [1, 6, 3, 2], [n("InstanceNormalization", ["x", "s", "b"], ["y"])], {"s": s, "b": b}, 13)
    for groups in (1, 2, 3, 6):
        graph(f"group-{groups}", [1, 6, 3, 2], [n("GroupNormalization", ["x", "s", "b"], ["y"], num_groups=groups, epsilon=1e-3)], {"s": s, "b": b}, 21)
    graph("group-18", [1, 6, 3], [n("GroupNormalization", ["x", "s", "b"], ["y"], num_groups=2)], {"s": floats(2), "b": floats(2)}, 18)
    graph("rms", [1, 6], [n("RMSNormalization", ["x", "s"], ["y"])], {"s": s}, 23)
    graph("rms-axis", [1, 3, 6], [n("RMSNormalization", ["x", "s"], ["y"], axis=1, epsilon=1e-2)], {"s": floats(3, 6)}, 23)
    graph("layernorm-axis", [1, 3, 6], [n("LayerNormalization", ["x", "s", "b"], ["y"], axis=1)], {"s": floats(3, 6), "b": floats(3, 6)}, 17)
    graph("meanvariance", [1, 3, 4], [n("MeanVarianceNormalization", ["x"], ["y"], axes=[2])], {}, 13)
    graph("lrn", [1, 4, 3, 3], [n("LRN", ["x"], ["y"], size=3)], {}, 13)
    # 43, 13: outputs that are read, or not.
    graph("split-second", [1, 6], [n("Split", ["x"], ["a", "b"], axis=1), n("Tanh", ["b"], ["y"])], {}, 11)
    graph("split-second-13", [1, 6], [n("Split", ["x", "p"], ["a", "b"], axis=1), n("Tanh", ["b"], ["y"])], {"p": np.int64([2, 4])}, 13)
    graph("split-18", [1, 7], [n("Split", ["x"], ["a", "b", "c"], axis=1, num_outputs=3), n("Concat", ["c", "b"], ["y"], axis=1)], {}, 18)
    graph("split-both", [1, 6], [n("Split", ["x"], ["a", "b"], axis=-1), n("Mul", ["a", "b"], ["y"])], {}, 11)
    graph("split-output", [1, 6], [n("Split", ["x"], ["a", "y"], axis=1)], {}, 11)
    graph("split-batch", [1, 2, 3], [n("Split", ["x"], ["a", "b"], axis=1), n("Add", ["a", "b"], ["y"])], {}, 11)
    graph("dropout-mask", [1, 4], [n("Dropout", ["x"], ["y", "m"])], {}, 13)
    graph("maxpool-indices", [1, 2, 6], [n("MaxPool", ["x"], ["y", "i"], kernel_shape=[2])], {}, 13)
    graph("batchnorm-old", [1, 6], [n("BatchNormalization", ["x", "s", "b", "m", "v"], ["y"], epsilon=1e-3)], {"s": s, "b": b, "m": floats(6), "v": np.abs(s) + 0.1}, 9)
    # 17: shapes.
    graph("reshape-zero", ["N", 2, 3], [n("Reshape", ["x", "t"], ["a"]), n("Tanh", ["a"], ["y"])], {"t": np.int64([0, -1])}, 13)
    graph("flatten-0", [2, 3], [n("Flatten", ["x"], ["a"], axis=0), n("Tanh", ["a"], ["y"])], {}, 13)
    graph("depth-to-space", [1, 4, 2, 2], [n("DepthToSpace", ["x"], ["y"], blocksize=2)], {}, 13)
    graph("space-to-depth", [1, 1, 4, 4], [n("SpaceToDepth", ["x"], ["y"], blocksize=2)], {}, 13)
    graph("gather-elements", [1, 4], [n("GatherElements", ["x", "i"], ["y"], axis=1)], {"i": np.int64([[3, 0]])}, 13)
    graph("gathernd", [1, 4], [n("GatherND", ["x", "i"], ["y"])], {"i": np.int64([[0, 3], [0, 1]])}, 13)
    graph("trilu", [1, 3, 3], [n("Trilu", ["x"], ["y"], upper=0)], {}, 14)
    graph("einsum", [1, 4], [n("Einsum", ["x", "w"], ["y"], equation="bi,ij->bj")], {"w": floats(4, 3)}, 13)
    graph("einsum-turned", [1, 4], [n("Einsum", ["x", "w"], ["y"], equation="bi,ji->bj")], {"w": floats(3, 4)}, 13)
    graph("einsum-three", [1, 2, 4], [n("Einsum", ["w", "x"], ["y"], equation="hk,bth->btk")], {"w": floats(4, 3)}, 13)
    graph("resize", [1, 2, 4], [n("Resize", ["x", "", "s"], ["y"], mode="nearest")], {"s": np.float32([1, 1, 2])}, 13)
    graph("upsample", [1, 2, 2, 2], [n("Upsample", ["x", "s"], ["y"], mode="nearest")], {"s": np.float32([1, 1, 2, 2])}, 9)
    graph("convtranspose", [1, 2, 4], [n("ConvTranspose", ["x", "w"], ["y"], strides=[2])], {"w": floats(2, 3, 2)}, 13)
    graph("round", [1, 4], [n("Round", ["x"], ["y"])], {}, 13)
    graph("sign", [1, 4], [n("Sign", ["x"], ["y"])], {}, 13)
    graph("sin", [1, 4], [n("Sin", ["x"], ["y"])], {}, 13)
    graph("atan", [1, 4], [n("Atan", ["x"], ["y"])], {}, 13)
    graph("log-of-softmax", [1, 4], [n("Softmax", ["x"], ["a"]), n("Log", ["a"], ["y"])], {}, 13)
    graph("hardmax", [1, 4], [n("Hardmax", ["x"], ["y"])], {}, 13)
    graph("quantised", [1, 4], [n("QuantizeLinear", ["x", "s", "z"], ["q"]), n("DequantizeLinear", ["q", "s", "z"], ["y"])], {"s": np.float32(0.01), "z": np.int8(0)}, 13)
    graph("dynamic-quantised", [1, 4], [n("DynamicQuantizeLinear", ["x"], ["q", "s", "z"]), n("DequantizeLinear", ["q", "s", "z"], ["y"])], {}, 13)
    q = RNG.integers(-90, 90, (4, 3)).astype(np.int8)
    graph("dequantised-weights", [1, 4], [n("DequantizeLinear", ["q", "s", "z"], ["w"], axis=1), n("MatMul", ["x", "w"], ["y"])], {"q": q, "s": np.float32([0.01, 0.02, 0.005]), "z": np.int8([3, 0, -4])}, 13)
    graph("dequantised-weights-0", [1, 4], [n("DequantizeLinear", ["q", "s"], ["w"], axis=0), n("Gemm", ["x", "w"], ["y"])], {"q": q, "s": np.float32([0.01, 0.02, 0.005, 0.03])}, 13)
    # 13: recurrent layers.
    g, u, r = floats(1, 9, 2), floats(1, 9, 3), floats(1, 18)
    graph("gru-clip", [4, 1, 2], [n("GRU", ["x", "w", "r", "b"], ["a", "h"], hidden_size=3, clip=0.5), n("Squeeze", ["h", "z"], ["y"])], {"w": g, "r": u, "b": r, "z": np.int64([0])}, 13)
    graph("gru-reverse", [4, 1, 2], [n("GRU", ["x", "w", "r", "b"], ["a", "h"], hidden_size=3, direction="reverse"), n("Squeeze", ["h", "z"], ["y"])], {"w": g, "r": u, "b": r, "z": np.int64([0])}, 13)
    graph("gru-layout", [1, 4, 2], [n("GRU", ["x", "w", "r", "b"], ["a", "h"], hidden_size=3, layout=1), n("Tanh", ["h"], ["y"])], {"w": g, "r": u, "b": r}, 14)
    graph("gru-first", [4, 1, 2], [n("GRU", ["x", "w", "r", "b", "", "i"], ["a", "h"], hidden_size=3), n("Squeeze", ["h", "z"], ["y"])], {"w": g, "r": u, "b": r, "i": floats(1, 1, 3), "z": np.int64([0])}, 13)
    graph("gru-lengths", [4, 1, 2], [n("GRU", ["x", "w", "r", "b", "l"], ["a", "h"], hidden_size=3), n("Squeeze", ["h", "z"], ["y"])], {"w": g, "r": u, "b": r, "l": np.int32([3]), "z": np.int64([0])}, 13)
    lw, lr, lb = floats(1, 12, 2), floats(1, 12, 3), floats(1, 24)
    graph("lstm-peephole", [4, 1, 2], [n("LSTM", ["x", "w", "r", "b", "", "", "", "p"], ["a", "h"], hidden_size=3), n("Squeeze", ["h", "z"], ["y"])], {"w": lw, "r": lr, "b": lb, "p": floats(1, 9), "z": np.int64([0])}, 13)
    graph("lstm-cell", [4, 1, 2], [n("LSTM", ["x", "w", "r", "b"], ["a", "h", "c"], hidden_size=3), n("Squeeze", ["c", "z"], ["y"])], {"w": lw, "r": lr, "b": lb, "z": np.int64([0])}, 13)
    graph("lstm-forget", [4, 1, 2], [n("LSTM", ["x", "w", "r", "b"], ["a", "h"], hidden_size=3, input_forget=1), n("Squeeze", ["h", "z"], ["y"])], {"w": lw, "r": lr, "b": lb, "z": np.int64([0])}, 13)
    folder.done()


def keras_models(out):
    import keras
    from keras import layers as L
    from keras import ops

    folder = Folder(out, "keras")

    def model(name, shape, build, scale=1.0, kinds=(".keras",), tolerance=None, prepare=None):
        keras.utils.set_random_seed(len(name))
        try:
            x = keras.Input(shape)
            net = keras.Model(x, build(x))
            for weight in net.trainable_weights:
                weight.assign(RNG.normal(0, 0.6, weight.shape).astype(np.float32))
            if prepare:
                prepare(net)
            inputs = (RNG.normal(0, 1, [VECTORS, 1, *[4 if k is None else k for k in shape]]) * scale).astype(np.float32)
            with contextlib.redirect_stdout(io.StringIO()):
                y = [np.asarray(net(one)) for one in inputs]
            for kind in kinds:
                net.save(folder.path / f"{name}{kind}")
        except Exception as error:
            print("Keras itself refuses", name, str(error).splitlines()[-1][:160])
            return
        more = {"tolerance": tolerance} if tolerance else {}
        for kind in kinds:
            folder.add(f"{name}{kind}", inputs, y, **more)

    both = (".keras", ".h5")
    # 06: quantised and half precision.
    for mode in ("int8", "int4", "float8"):
        model(f"quantised-{mode}", (6,), lambda x: L.Dense(3)(L.Dense(5, activation="tanh")(x)), prepare=lambda net, mode=mode: net.quantize(mode))
    model("mixed", (6,), lambda x: L.Dense(3, dtype="mixed_float16")(x))
    model("bfloat", (6,), lambda x: L.Dense(3, dtype="mixed_bfloat16")(x))
    model("double", (6,), lambda x: L.Dense(3, dtype="float64")(x))
    # 04: normalisations.
    for groups in (1, 2, 3, -1):
        model(f"group-{groups}", (4, 6), lambda x, g=groups: L.GroupNormalization(g)(x), kinds=both)
    model("group-image", (3, 2, 4), lambda x: L.GroupNormalization(2, epsilon=0.1)(x))
    model("group-flat", (6,), lambda x: L.GroupNormalization(3)(x))
    model("group-plain", (6,), lambda x: L.GroupNormalization(2, center=False, scale=False)(x))
    model("rms", (6,), lambda x: L.RMSNormalization()(x), kinds=both)
    model("rms-steps", (3, 6), lambda x: L.RMSNormalization(epsilon=0.1)(x))
    model("rms-axis", (3, 6), lambda x: L.RMSNormalization(axis=1)(x))
    model("unit", (6,), lambda x: L.UnitNormalization()(x), kinds=both)
    model("unit-steps", (3, 6), lambda x: L.UnitNormalization()(x))
    model("unit-axis", (3, 6), lambda x: L.UnitNormalization(axis=1)(x))
    model("layer-axes", (3, 6), lambda x: L.LayerNormalization(axis=[1, 2])(x))
    model("batch-axis", (3, 6), lambda x: L.BatchNormalization(axis=1)(x))
    model("spectral", (6,), lambda x: L.SpectralNormalization(L.Dense(4))(x))
    # 03: operations.
    operations = {
        "mean": lambda x: ops.mean(x, axis=1), "mean-keep": lambda x: ops.mean(x, axis=-1, keepdims=True) + x,
        "sum": lambda x: ops.sum(x, axis=1), "max": lambda x: ops.max(x, axis=1), "min": lambda x: ops.min(x, axis=2),
        "rsqrt": lambda x: ops.rsqrt(ops.square(x) + 0.1), "log1p": lambda x: ops.log1p(ops.square(x)),
        "expm1": lambda x: ops.expm1(x), "sin": lambda x: ops.sin(x), "erf": lambda x: ops.erf(x), "sign": lambda x: ops.sign(x),
        "log-softmax": lambda x: ops.log_softmax(x * 90.0), "log-softmax-axis": lambda x: ops.log_softmax(x * 90.0, axis=1),
        "stack": lambda x: ops.stack([x[:, 0], x[:, 1]], axis=1), "where": lambda x: ops.where(x > 0, x, 0.1 * x),
        "clip": lambda x: ops.clip(x * 1e6, -2e5, 3e5), "maximum": lambda x: ops.maximum(x * 1e6, -2e5),
        "minimum-each": lambda x: ops.minimum(x, np.float32([1e7, -1e7, 0.1, 0.3])), "power": lambda x: ops.power(ops.abs(x) + 0.1, 1.5),
        "base": lambda x: ops.power(2.0, x), "matmul": lambda x: ops.matmul(x, ops.transpose(x, (0, 2, 1))),
        "matmul-constant": lambda x: ops.matmul(x, floats(4, 2)), "dot-constant": lambda x: ops.dot(x, floats(4, 2)),
        "einsum": lambda x: ops.einsum("bij,jk->bik", x, floats(4, 2)), "norm": lambda x: ops.norm(x, axis=-1),
        "normalize": lambda x: ops.normalize(x, axis=-1), "logsumexp": lambda x: ops.logsumexp(x, axis=-1),
        "swapaxes": lambda x: ops.swapaxes(x, 1, 2), "repeat": lambda x: ops.repeat(x, 2, axis=1), "tile": lambda x: ops.tile(x, (1, 2, 1)),
        "pad": lambda x: ops.pad(x, ((0, 0), (1, 0), (0, 2))), "roll": lambda x: ops.roll(x, 1, axis=1), "split": lambda x: ops.split(x, 2, axis=2)[1],
        "squeeze": lambda x: ops.squeeze(x[:, :1], 1), "arctan": lambda x: ops.arctan(x), "hard-shrink": lambda x: ops.hard_shrink(x),
        "soft-shrink": lambda x: ops.soft_shrink(x), "squareplus": lambda x: ops.squareplus(x), "sparse-plus": lambda x: ops.sparse_plus(x),
        "tanh-shrink": lambda x: ops.tanh_shrink(x), "sparse-sigmoid": lambda x: ops.sparse_sigmoid(x * 3), "threshold": lambda x: ops.threshold(x, 0.3, 0.1),
        "glu": lambda x: ops.glu(x), "prod": lambda x: ops.prod(x, axis=1), "var": lambda x: ops.var(x, axis=1), "cumsum": lambda x: ops.cumsum(x, axis=1),
        "relu6": lambda x: ops.relu6(x * 9), "hard-tanh": lambda x: ops.hard_tanh(x * 2), "cast": lambda x: ops.cast(x, "float32") + 1.0,
        "take": lambda x: ops.take(x, [2, 0], axis=1), "flip": lambda x: ops.flip(x, axis=1), "subtract-left": lambda x: 1.0 - x,
        "floor": lambda x: ops.floor(x), "mod": lambda x: x % 0.7, "average": lambda x: ops.average(x, axis=1),
    }
    for name, build in operations.items():
        model(f"ops-{name}", (3, 4), build)
    for name in ("log_softmax", "squareplus", "soft_shrink", "sparse_plus", "tanh_shrink", "glu", "sparsemax", "hard_shrink", "threshold", "sparse_sigmoid", "hard_tanh"):
        model(f"activation-{name}", (6,), lambda x, name=name: L.Activation(name)(x), 3.0)
        model(f"dense-{name}", (6,), lambda x, name=name: L.Dense(4, activation=name)(x), 3.0)
    # 01: recurrent layers.
    for name, cell in (("gru", L.GRUCell(3)), ("gru-before", L.GRUCell(3, reset_after=False)), ("lstm", L.LSTMCell(3)), ("rnn", L.SimpleRNNCell(3, activation="relu"))):
        for sequences in (False, True):
            model(f"cell-{name}-{sequences}", (4, 2), lambda x, cell=cell, s=sequences: L.RNN(type(cell).from_config(cell.get_config()), return_sequences=s)(x))
        model(f"cell-{name}-back", (4, 2), lambda x, cell=cell: L.RNN(type(cell).from_config(cell.get_config()), go_backwards=True)(x))
        model(f"cell-{name}-both", (4, 2), lambda x, cell=cell: L.Bidirectional(L.RNN(type(cell).from_config(cell.get_config())))(x))
    model("cell-stacked", (4, 2), lambda x: L.RNN([L.GRUCell(3), L.LSTMCell(2)])(x))
    model("cell-no-bias", (4, 2), lambda x: L.RNN(L.GRUCell(3, use_bias=False))(x))
    for name, layer in (("lstm", L.LSTM), ("gru", L.GRU), ("rnn", L.SimpleRNN)):
        for sequences in (False, True):
            model(f"state-first-{name}-{sequences}", (4, 2), lambda x, layer=layer, s=sequences: layer(3, return_state=True, return_sequences=s)(x)[0])
            model(f"state-h-{name}-{sequences}", (4, 2), lambda x, layer=layer, s=sequences: L.Dense(2)(layer(3, return_state=True, return_sequences=s)(x)[1]))
        model(f"state-both-{name}", (4, 2), lambda x, layer=layer: L.Concatenate()(list(layer(3, return_state=True)(x))[:2]))
    model("state-cell", (4, 2), lambda x: L.LSTM(3, return_state=True)(x)[2])
    model("state-cell-cell", (4, 2), lambda x: L.RNN(L.LSTMCell(3), return_state=True)(x)[2])
    model("state-encoder", (4, 2), lambda x: (lambda y, h, c: L.LSTM(3)(x, initial_state=[h, c]))(*L.LSTM(3, return_state=True)(x)))
    model("state-zero", (4, 2), lambda x: L.LSTM(3)(x, initial_state=[ops.zeros((1, 3)), ops.zeros((1, 3))]))
    model("mask", (4, 2), lambda x: L.LSTM(3)(L.Masking()(x)))
    model("zoneout", (4, 2), lambda x: L.GRU(3, dropout=0.3, recurrent_dropout=0.2)(x))
    model("time-major", (4, 2), lambda x: L.TimeDistributed(L.Conv1D(2, 1))(L.Reshape((4, 2, 1))(x)))
    model("unrolled", (4, 2), lambda x: L.LSTM(3, unroll=True)(x))
    model("wrapped-shared", (6,), lambda x: (lambda d: d(d(x)))(L.Dense(6)))
    inner = keras.Sequential([keras.Input((6,)), L.Dense(3)])
    model("nested", (6,), lambda x: L.Dense(2)(inner(x)))
    model("einsum-dense", (3, 6), lambda x: L.EinsumDense("abc,cd->abd", output_shape=(None, 4), bias_axes="d")(x))
    model("dot", (6,), lambda x: L.Dot(axes=1)([x, L.Dense(6)(x)]))
    folder.done()


def tflite_models(out):
    import keras
    import tensorflow as tf
    from ai_edge_litert.interpreter import Interpreter
    from keras import layers as L
    from keras import ops

    folder = Folder(out, "tflite")

    def model(name, shape, build, scale=1.0, kind=None, tolerance=None):
        keras.utils.set_random_seed(len(name))
        try:
            x = keras.Input(shape, batch_size=1)
            net = keras.Model(x, build(x))
            for weight in net.trainable_weights:
                weight.assign(RNG.normal(0, 0.6, weight.shape).astype(np.float32))
            inputs = (RNG.normal(0, 1, [VECTORS, 1, *shape]) * scale).astype(np.float32)
            converter = tf.lite.TFLiteConverter.from_keras_model(net)
            if kind:
                converter.optimizations = [tf.lite.Optimize.DEFAULT]
                samples = (RNG.normal(0, 1, [200, 1, *shape]) * scale).astype(np.float32)
                if kind != "dynamic":
                    converter.representative_dataset = lambda: ([one] for one in samples)
                if kind == "16x8":
                    converter.target_spec.supported_ops = [tf.lite.OpsSet.EXPERIMENTAL_TFLITE_BUILTINS_ACTIVATIONS_INT16_WEIGHTS_INT8]
                elif kind == "whole":
                    converter.target_spec.supported_ops = [tf.lite.OpsSet.TFLITE_BUILTINS_INT8]
                    converter.inference_input_type = converter.inference_output_type = tf.int8
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                content = converter.convert()
            interpreter = Interpreter(model_content=content)
            interpreter.allocate_tensors()
            source, sink = interpreter.get_input_details()[0], interpreter.get_output_details()[0]
            y = []
            for one in inputs:
                if source["dtype"] != np.float32:
                    step, zero = source["quantization"]
                    one = np.clip(np.round(one / step) + zero, -128, 127).astype(source["dtype"])
                interpreter.set_tensor(source["index"], one)
                interpreter.invoke()
                got = interpreter.get_tensor(sink["index"])
                if sink["dtype"] != np.float32:
                    step, zero = sink["quantization"]
                    got = (got.astype(np.float64) - zero) * step
                y.append(got)
        except Exception as error:
            print("the converter itself refuses", name, str(error).splitlines()[-1][:160])
            return
        (folder.path / f"{name}.tflite").write_bytes(content)
        folder.add(f"{name}.tflite", inputs, y, **({"tolerance": tolerance} if tolerance else {}))

    builds = {
        "log-softmax": ((5,), lambda x: ops.log_softmax(x * 60.0)), "log-softmax-steps": ((3, 5), lambda x: ops.log_softmax(x * 60.0)),
        "clip": ((5,), lambda x: ops.clip(x * 1e6, -2e5, 3e5)), "maximum": ((5,), lambda x: ops.maximum(x * 1e6, -2e5)),
        "minimum": ((5,), lambda x: ops.minimum(x, np.float32([1e7, -1e7, 0.1, 0.3, 0.0]))), "maximum-two": ((5,), lambda x: ops.maximum(x, L.Dense(5)(x) * 1e6)),
        "unit": ((5,), lambda x: L.UnitNormalization()(x)), "rms": ((5,), lambda x: L.RMSNormalization()(x)), "group": ((4, 6), lambda x: L.GroupNormalization(2)(x)),
        "layer": ((3, 6), lambda x: L.LayerNormalization()(x)), "split": ((3, 4), lambda x: ops.split(x, 2, axis=2)[1]),
        "mean": ((3, 4), lambda x: ops.mean(x, axis=1)), "sum": ((3, 4), lambda x: ops.sum(x, axis=1)), "max": ((3, 4), lambda x: ops.max(x, axis=1)), "min": ((3, 4), lambda x: ops.min(x, axis=1)),
        "sin": ((4,), lambda x: ops.sin(x)), "floor": ((4,), lambda x: ops.floor(x)), "sign": ((4,), lambda x: ops.sign(x)), "matmul": ((3, 4), lambda x: ops.matmul(x, ops.transpose(x, (0, 2, 1)))),
        "matmul-constant": ((3, 4), lambda x: ops.matmul(x, floats(4, 2))), "matmul-left": ((4, 3), lambda x: ops.matmul(floats(5, 4), x)), "conv-transpose": ((4, 2), lambda x: L.Conv1DTranspose(3, 2)(x)),
        "pad-reflect": ((4, 2), lambda x: ops.pad(x, ((0, 0), (1, 1), (0, 0)), mode="reflect")), "upsample": ((2, 2, 1), lambda x: L.UpSampling2D(2)(x)), "upsample-linear": ((2, 2, 1), lambda x: L.UpSampling2D(2, interpolation="bilinear")(x)),
        "rnn": ((4, 2), lambda x: L.SimpleRNN(3, unroll=True)(x)), "gru": ((4, 2), lambda x: L.GRU(3, unroll=True)(x)), "lstm": ((4, 2), lambda x: L.LSTM(3, unroll=True)(x)), "lstm-loop": ((4, 2), lambda x: L.LSTM(3)(x)),
        "power": ((4,), lambda x: ops.power(ops.abs(x) + 0.1, 1.5)), "cumsum": ((4,), lambda x: ops.cumsum(x, axis=1)), "roll": ((4,), lambda x: ops.roll(x, 1, axis=1)), "arctan": ((4,), lambda x: ops.arctan(x)), "erf": ((4,), lambda x: ops.erf(x)), "expm1": ((4,), lambda x: ops.expm1(x)), "log1p": ((4,), lambda x: ops.log1p(ops.square(x))),
    }
    for name, (shape, build) in builds.items():
        model(name, shape, build)
    dense = lambda x: L.Dense(3)(L.Dense(8, activation="relu")(x))  # noqa: E731
    conv = lambda x: L.Dense(2)(L.Flatten()(L.Conv1D(3, 2, activation="tanh")(x)))  # noqa: E731
    for kind in ("dynamic", "int8", "whole", "16x8"):
        model(f"dense-int8-{kind}", (6,), dense, kind=kind)
        model(f"conv-int8-{kind}", (6, 2), conv, kind=kind)
        model(f"softmax-int8-{kind}", (6,), lambda x: L.Softmax()(L.Dense(4)(x)), kind=kind)
    folder.done()


def main():
    out, wanted = sys.argv[1], sys.argv[2:] or ["onnx", "keras", "tflite"]
    for name in wanted:
        try:
            {"onnx": onnx_graphs, "keras": keras_models, "tflite": tflite_models}[name](out)
        except Exception:
            traceback.print_exc()
            sys.exit(1)


if __name__ == "__main__":
    main()
