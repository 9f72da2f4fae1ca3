"""Networks whose padding wraps after a cut, or whose bounds lie far beyond their values.

python wrap_and_bounds.py OUT: writes the files of tests/cases/46-wrap-and-bounds.
"""

import json
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper


def network(name, node, shape, opset, constants):
    """A graph of one node, from x to y."""
    inputs = [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)]
    outputs = [helper.make_tensor_value_info("y", TensorProto.FLOAT, [None] * len(shape))]
    held = [numpy_helper.from_array(value, key) for key, value in constants.items()]
    graph = helper.make_graph([node], name, inputs, outputs, held)
    opset = helper.make_opsetid("", opset)
    return helper.make_model(graph, opset_imports=[opset], ir_version=9)


def main(out):
    pads = np.array([0, -1, 1, 0, 0, -1], dtype=np.int64)
    wrapped = helper.make_node("Pad", ["x", "pads"], ["y"], mode="wrap")
    far = [np.array(bound, dtype=np.float32) for bound in (-1e6, 1e6)]
    bounded = helper.make_node("Clip", ["x", "low", "high"], ["y"])
    near = [np.array(bound, dtype=np.float32) for bound in (-0.5, 0.25)]
    files = {
        "wrap-cut.onnx": network("wrap", wrapped, [1, 4, 5], 19, {"pads": pads}),
        "far-bounds.onnx": network("far", bounded, [1, 4], 13, dict(zip(("low", "high"), far))),
        "near-bounds.onnx": network("near", bounded, [1, 4], 13, dict(zip(("low", "high"), near))),
    }
    draw = np.random.default_rng(46)
    expected = {}
    for name, model in files.items():
        onnx.checker.check_model(model)
        onnx.save(model, out / name)
        session = onnxruntime.InferenceSession(model.SerializeToString())
        shape = session.get_inputs()[0].shape
        xs = [draw.normal(size=shape).astype(np.float32) for _ in range(3)]
        ys = [session.run(None, {"x": x})[0] for x in xs]
        expected[name] = {
            "framework": f"onnxruntime {onnxruntime.__version__}",
            "x": [x.ravel().tolist() for x in xs],
            "y": [y.ravel().tolist() for y in ys],
        }
    (out / "expected.json").write_text(json.dumps(expected) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
