#!/usr/bin/env python3
"""Makes the files of hostile/: each is to be refused in words (codegen/nn/tests/hostile.rs).

Usage: hostile.py, with the packages of requirements.txt.
"""
import io
import json
import pathlib
import struct
import zipfile

import numpy as np
from onnx import TensorProto, helper, numpy_helper

HERE = pathlib.Path(__file__).parent
OUT = HERE / "hostile"


def net(nodes, values, shape=("N", 4), out=("N", 2), y="y"):
    x = helper.make_tensor_value_info("x", TensorProto.FLOAT, list(shape))
    y = helper.make_tensor_value_info(y, TensorProto.FLOAT, list(out))
    graph = helper.make_graph(nodes, "g", [x], [y], values)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8).SerializeToString()


def weight(name, array):
    return numpy_helper.from_array(np.asarray(array, np.float32), name)


def node(op, inputs, outputs, **attributes):
    return helper.make_node(op, inputs, outputs, name=f"the {op}", **attributes)


def huge(name, dims):
    tensor = TensorProto(name=name, data_type=TensorProto.FLOAT, dims=dims)
    tensor.raw_data = b"\0" * 16
    return tensor


def keras(layers, weights=None):
    """An archive with this configuration and the weights of a sound model."""
    with zipfile.ZipFile(HERE / "models/keras-mlp.keras") as archive:
        weights = archive.read("model.weights.h5") if weights is None else weights
    config = {"class_name": "Functional", "config": {"layers": layers, "output_layers": [["b", 0, 0]]}}
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in [("config.json", json.dumps(config)), ("model.weights.h5", weights)]:
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def layer(class_name, name, reads, **config):
    inbound = [[[source, 0, 0, {}] for source in reads]]
    return {"class_name": class_name, "name": name, "config": {"name": name, **config}, "inbound_nodes": inbound}


INPUT = {"class_name": "InputLayer", "name": "in", "config": {"batch_input_shape": [None, 4]}, "inbound_nodes": []}
ONE = weight("w", np.ones((4, 2)))
FILES = {
    "empty.onnx": b"",
    "wrong-magic.tflite": b"\x10\0\0\0TFL2" + b"\0" * 40,
    "text.h5": b"this is no network",
    "truncated.keras": (HERE / "models/keras-mlp.keras").read_bytes()[:4000],
    "truncated.h5": (HERE / "models/h5-mlp.h5").read_bytes()[:4000],
    "offset-outside.tflite": struct.pack("<I", 0xFFFFFFF0) + b"TFL3" + b"\0" * 40,
    "huge-shape.onnx": net([node("MatMul", ["x", "w"], ["y"])], [huge("w", [1 << 40, 1 << 40])]),
    "huge-input.onnx": net([node("Relu", ["x"], ["y"])], [], shape=("N", 1 << 40)),
    "huge-stride.onnx": net([node("MaxPool", ["x"], ["y"], kernel_shape=[1 << 40], strides=[1])], [], shape=(1, 2, 8)),
    "empty-axis.onnx": net([node("MatMul", ["x", "w"], ["y"])], [huge("w", [0, 0])]),
    "short-weights.onnx": net([node("MatMul", ["x", "w"], ["y"])], [huge("w", [4, 200])]),
    "nan-weights.onnx": net([node("MatMul", ["x", "w"], ["y"])], [weight("w", np.full((4, 2), np.nan))]),
    "cycle.onnx": net([node("Add", ["x", "y"], ["z"]), node("MatMul", ["z", "w"], ["y"])], [ONE]),
    "dangling.onnx": net([node("MatMul", ["nowhere", "w"], ["y"])], [ONE]),
    "unknown-operator.onnx": net([node("DepthToSpace", ["x"], ["y"], blocksize=2)], []),
    "cycle.keras": keras([INPUT, layer("ReLU", "a", ["b"]), layer("ReLU", "b", ["a"])]),
    "bidirectional.keras": keras([INPUT, layer("Bidirectional", "b", ["in"])]),
    "glu.keras": keras([INPUT, layer("Activation", "b", ["in"], activation="glu")]),
    "no-weights.keras": keras([INPUT, layer("Dense", "b", ["in"]), layer("Dense", "c", ["in"])], b"\x89HDF\r\n\x1a\n"),
    "unpacks-to-gigabytes.keras": keras([INPUT, layer("Dense", "b", ["in"])], b"\0" * (80 << 20)),
}

if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    for name, data in FILES.items():
        (OUT / name).write_bytes(data)
    print(sum(len(data) for data in FILES.values()), "bytes")
