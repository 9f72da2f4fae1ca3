#!/usr/bin/env python3
"""The operator table of ONNX, and every attribute and input of the operators that are read, away from its
default, with onnxruntime's outputs.

    venv/bin/python operator_table.py ../operators

`table.json` has every operator with the versions of its meaning: attributes, and inputs with `?` where one may
be left out and `*` where more may follow; `domains.json` names those of other domains. `cases.json` has a graph for each of them; `y` is null where
onnxruntime does not run the graph, and such a graph has to be refused.
"""
import base64
import json
import os
import pathlib
import sys

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, defs, helper, numpy_helper

OLDEST, NEWEST = 7, 26
onnxruntime.set_default_logger_severity(4)
rng = np.random.default_rng(3)
OPTIONAL, VARIADIC = defs.OpSchema.FormalParameterOption.Optional, defs.OpSchema.FormalParameterOption.Variadic


def f(*shape):
    return np.round(rng.normal(0, 0.7, shape), 3).astype(np.float32)


def positive(*shape):
    return np.abs(f(*shape)) + np.float32(0.5)


def i(*values):
    return np.asarray(values, np.int64)


def scalar(value):
    return np.asarray(value, np.float32)


# Inputs of an operator: "x" is the graph's own, its shape beside it; attributes as far as they are needed.
ANY = ([1, 2, 3], ["x"], {})
IMAGE = [1, 2, 5, 4]


def recurrent(gates):
    return ([3, 1, 2], ["x", f(1, gates * 2, 2), f(1, gates * 2, 2)], {"hidden_size": 2})


REDUCED = ["ReduceMean", "ReduceMax", "ReduceMin", "ReduceSum", "ReduceL1", "ReduceL2", "ReduceSumSquare"]
PAIRED = ["Add", "Sub", "Mul", "Div", "Pow"]
SEVERAL = ["Max", "Min", "Sum"]
ALONE = ["Identity", "Dropout", "Neg", "Abs", "HardSwish", "Mish", "Celu", "Relu", "Sigmoid", "Tanh", "Softplus", "Softsign", "Exp",
         "LeakyRelu", "Elu", "Selu", "HardSigmoid", "Gelu", "Swish", "Softmax", "LogSoftmax", "Flatten", "Clip", "Transpose"]


def recipe(op, attributes, inputs):
    """Shape of x, inputs and attributes of the plainest node of an operator of that version; none where no
    recipe is written: the operator is not read."""
    by_input = len(inputs) > 1
    if op in ALONE:
        return ANY
    if op in ("Log", "Sqrt", "Reciprocal"):
        return ([1, 2, 3], ["positive"], {})
    if op == "Erf":
        return ([1, 2, 3], ["gelu"], {})
    if op in PAIRED:
        return ([1, 2, 3], ["x", scalar(2)], {})
    if op in SEVERAL:
        return ([1, 2, 3], ["x", f(1, 2, 3)], {})
    if op == "Mean":
        return ([1, 2, 3], ["x", "tanh"], {})
    if op in ("Less", "Greater", "LessOrEqual", "GreaterOrEqual"):
        return ([1, 2, 3], ["choice"], {})
    if op == "Where":
        return ([1, 2, 3], ["choice"], {})
    if op == "Cast":
        return ([1, 2, 3], ["x"], {"to": TensorProto.FLOAT})
    if op == "Pad":
        return ([1, 3, 4], ["x", i(0, 1, 0, 0, 0, 2)] if by_input else ["x"], {} if by_input else {"pads": [0, 1, 0, 0, 0, 2]})
    if op == "Expand":
        return ([1, 2, 1], ["x", i(1, 2, 3)], {})
    if op == "Tile":
        return ([1, 2, 3], ["x", i(1, 2, 1)], {})
    if op == "ReverseSequence":
        return ([1, 3, 2], ["turned", i(3)], {})
    if op == "LayerNormalization":
        return ([1, 2, 3], ["x", f(3)], {})
    if op == "RMSNormalization":
        return ([1, 2, 3], ["x", f(3)], {})
    if op == "GroupNormalization":
        each = 4 if "stash_type" in attributes else 2
        return ([1, 4, 3], ["x", f(each), f(each)], {"num_groups": 2})
    if op == "InstanceNormalization":
        return ([1, 2, 3], ["x", f(2), f(2)], {})
    if op == "BatchNormalization":
        return (IMAGE, ["x", f(2), f(2), f(2), positive(2)], {})
    if op == "Gather":
        return ([1, 2, 3], ["x", i(0)], {})
    if op == "Slice":
        return ([1, 4, 3], ["x", i(0, 1), i(1, 3)], {}) if by_input else ([1, 4, 3], ["x"], {"starts": [0, 1], "ends": [1, 3]})
    if op == "Split":
        if "num_outputs" in attributes:
            return ([1, 4, 3], ["x"], {"axis": 1, "num_outputs": 2})
        return ([1, 4, 3], ["x"], {"axis": 1})
    if op in REDUCED:
        return ([1, 2, 3], ["x"], {})
    if op == "PRelu":
        return ([1, 2, 3], ["x", f(2, 1)], {})
    if op == "Gemm":
        return ([1, 3], ["x", f(3, 3)] + ([] if "C?" in inputs else [f(3)]), {})
    if op == "MatMul":
        return ([1, 2, 3], ["x", f(3, 4)], {})
    if op == "Conv":
        return (IMAGE, ["x", f(2, 2, 2, 2)], {})
    if op in ("MaxPool", "AveragePool"):
        return (IMAGE, ["x"], {"kernel_shape": [2, 2]})
    if op in ("GlobalMaxPool", "GlobalAveragePool"):
        return (IMAGE, ["x"], {})
    if op == "Concat":
        return ([1, 2, 3], ["x", "tanh"], {"axis": 1})
    if op == "Reshape":
        return ([1, 2, 3], ["x", i(1, 6)], {})
    if op == "Squeeze":
        return ([1, 1, 3], ["x"] + ([i(1)] if by_input else []), {} if by_input else {"axes": [1]})
    if op == "Unsqueeze":
        return ([1, 3], ["x"] + ([i(1)] if by_input else []), {} if by_input else {"axes": [1]})
    if op in ("RNN", "GRU", "LSTM"):
        return recurrent({"RNN": 1, "GRU": 3, "LSTM": 4}[op])
    if op in ("Constant", "ConstantOfShape", "Shape", "Size", "Range", "ReduceProd", "Not", "Floor", "Ceil", "Mod", "Equal", "And", "Or",
              "DequantizeLinear"):
        return ([1, 2, 3], ["constant"], {})
    return None


SLOPES = {"RNN": ["HardSigmoid"], "GRU": ["HardSigmoid", "LeakyRelu"], "LSTM": ["HardSigmoid", "Tanh", "Tanh"]}
PADDING = {
    "auto_pad": ["SAME_UPPER", "SAME_LOWER", "VALID"], "dilations": [[2, 1]], "pads": [[1, 0, 0, 1]], "strides": [[2, 1]],
    "ceil_mode": [1], "count_include_pad": [1], "storage_order": [1],
}
VALUES = {
    "Celu": {"alpha": [0.3]}, "LeakyRelu": {"alpha": [0.3]}, "Elu": {"alpha": [0.3]}, "Selu": {"alpha": [0.3], "gamma": [0.7]},
    "HardSigmoid": {"alpha": [0.3], "beta": [0.2]}, "Gelu": {"approximate": ["tanh", "none"]}, "Swish": {"alpha": [0.4]},
    "Softmax": {"axis": [1, 2, 0]}, "LogSoftmax": {"axis": [1, 2, 0]}, "Flatten": {"axis": [0, 2, 3]}, "Clip": {"min": [-0.2], "max": [0.1]},
    "Transpose": {"perm": [[0, 2, 1], [2, 0, 1]]}, "Dropout": {"ratio": [0.9], "seed": [5]},
    "Cast": {"to": [TensorProto.INT64, TensorProto.DOUBLE, TensorProto.FLOAT16, TensorProto.BOOL], "saturate": [0], "round_mode": ["down"]},
    "Pad": {"mode": ["edge", "reflect", "wrap"], "value": [0.4], "pads": [[0, 0, 1, 0, 1, 0], [0, -1, 0, 0, 0, 0]]},
    "ReverseSequence": {"batch_axis": [0], "time_axis": [1]},
    "LayerNormalization": {"axis": [1], "epsilon": [0.3], "stash_type": [10]},
    "RMSNormalization": {"axis": [1], "epsilon": [0.3], "stash_type": [10]},
    "GroupNormalization": {"num_groups": [1], "epsilon": [0.3], "stash_type": [10]},
    "InstanceNormalization": {"epsilon": [0.3]},
    "BatchNormalization": {"epsilon": [0.3], "momentum": [0.2], "spatial": [0], "training_mode": [1]},
    "Gather": {"axis": [1, -1]}, "Slice": {"axes": [[1, 2]], "starts": [[0, -2]], "ends": [[1, -1]]},
    "Split": {"axis": [-2, 2], "split": [[1, 3]], "num_outputs": [3, 4]},
    "Gemm": {"alpha": [0.5], "beta": [2.0], "transA": [1], "transB": [1]},
    "Conv": {**PADDING, "group": [2], "kernel_shape": [[2, 2]]},
    "MaxPool": {**PADDING, "kernel_shape": [[3, 1]]}, "AveragePool": {**PADDING, "kernel_shape": [[3, 1]]},
    "Concat": {"axis": [2, -1, 0]}, "Reshape": {"allowzero": [1]}, "Squeeze": {"axes": [[0]]}, "Unsqueeze": {"axes": [[2], [-1]]},
    **{op: {"axes": [[1], [2], [-1]], "keepdims": [0], "noop_with_empty_axes": [1]} for op in REDUCED},
    **{op: {"activations": [SLOPES[op], ["Relu"] * len(SLOPES[op]), ["Affine"] * len(SLOPES[op]), (["Sigmoid", "Tanh", "Elu"])[:len(SLOPES[op])]], "activation_alpha": [[0.3, 0.4][:2 if "LeakyRelu" in kinds else 1]],
            "activation_beta": [[0.3]], "clip": [0.4], "direction": ["reverse", "bidirectional"], "hidden_size": [3], "layout": [1],
            "linear_before_reset": [1], "input_forget": [1]} for op, kinds in SLOPES.items()},
}


def optional(op, name, shape, attributes):
    """Constants for an input that may be left out."""
    if op in ("RNN", "GRU", "LSTM"):
        gates = {"RNN": 1, "GRU": 3, "LSTM": 4}[op]
        return {"B": [f(1, gates * 4)], "sequence_lens": [np.asarray([2], np.int32), np.asarray([3], np.int32)],
                "initial_h": [f(1, 1, 2), np.zeros((1, 1, 2), np.float32)], "initial_c": [f(1, 1, 2), np.zeros((1, 1, 2), np.float32)],
                "P": [f(1, 6), np.zeros((1, 6), np.float32)]}[name]
    return {
        ("Dropout", "ratio"): [scalar(0.9)], ("Dropout", "training_mode"): [np.asarray(True), np.asarray(False)],
        ("Clip", "min"): [scalar(-0.2)], ("Clip", "max"): [scalar(0.1)],
        ("Pad", "constant_value"): [scalar(0.4)], ("Pad", "axes"): [i(1, 2, 0)],
        ("LayerNormalization", "B"): [f(3)], ("Slice", "axes"): [i(0, 2)], ("Slice", "steps"): [i(1, 2)],
        ("Split", "split"): [i(1, 3)], ("Gemm", "C"): [f(3), f(1, 1)], ("Conv", "B"): [f(2)], ("Squeeze", "axes"): [i(0)],
        **{(op, "axes"): [i(1), i(2), i(-1)] for op in REDUCED},
    }[op, name]


def graph(op, opset, shape, inputs, attributes, outputs=1, read=0):
    """A graph of one node; "positive", "tanh", "turned", "gelu" and "choice" put what it needs around it."""
    nodes, weights, names = [], [], []
    add = lambda kind, given, found, **k: nodes.append(helper.make_node(kind, given, [found], **k))  # noqa: E731

    def weight(value):
        name = f"w{len(weights)}"
        weights.append(numpy_helper.from_array(value, name))
        return name

    found = "y"
    for given in inputs:
        if given is None:
            names.append("")
        elif not isinstance(given, str):
            names.append(weight(given))
        elif given == "positive":
            add("Exp", ["x"], "above")
            names.append("above")
        elif given == "tanh":
            add("Tanh", ["x"], "tanh")
            names.append("tanh")
        elif given == "turned":
            add("Transpose", ["x"], "turned", perm=[1, 0, 2])
            names.append("turned")
        elif given == "gelu":
            add("Div", ["x", weight(scalar(2**0.5))], "part")
            names.append("part")
        elif given == "choice":
            names = ["x", weight(scalar(0))]
        elif given == "constant":
            return None
        else:
            names.append(given)
    if op == "Where":
        add("Mul", ["x", weight(scalar(0.3))], "slope")
        add("Greater", names, "above")
        names = ["above", "x", "slope"]
    last = [f"t{k}" for k in range(outputs)]
    last[read] = found
    nodes.append(helper.make_node(op, names, last, name="node", **attributes))
    if op == "Erf":
        nodes[-1].output[0] = "erf"
        add("Add", ["erf", weight(scalar(1))], "more")
        add("Mul", ["x", "more"], "twice")
        add("Mul", ["twice", weight(scalar(0.5))], found)
    if op in ("Less", "Greater", "LessOrEqual", "GreaterOrEqual"):
        nodes[-1].output[0] = "sign"
        add("Mul", ["x", weight(scalar(0.3))], "slope")
        add("Where", ["sign", "slope", "x"], found)
    if op == "Cast" and attributes["to"] != TensorProto.FLOAT:
        nodes[-1].output[0] = "cast"
        add("Cast", ["cast"], found, to=TensorProto.FLOAT)
    whole = helper.make_graph(nodes, "g", [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)],
                              [helper.make_tensor_value_info(found, TensorProto.FLOAT, None)], weights)
    return helper.make_model(whole, opset_imports=[helper.make_opsetid("", opset)], ir_version=8)


def outputs_of(model, x):
    options = onnxruntime.SessionOptions()
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    try:
        session = onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
        return [float(f"{v:.7g}") for v in np.asarray(session.run(None, {"x": x})[0], np.float64).reshape(-1)]
    except Exception:  # noqa: BLE001
        return None


def parameters(schema):
    mark = {OPTIONAL: "?", VARIADIC: "*"}
    return [given.name + mark.get(given.option, "") for given in schema.inputs]


def revisions(op, schemas):
    """Versions of an operator's meaning that a model of the opsets here may have, each with its first opset."""
    own = sorted((s for s in schemas if s.name == op), key=lambda s: s.since_version)
    for k, schema in enumerate(own):
        until = own[k + 1].since_version - 1 if k + 1 < len(own) else NEWEST
        if until >= OLDEST and schema.since_version <= NEWEST:
            yield max(schema.since_version, OLDEST), schema


def variants(op, schema, shape, inputs, attributes):
    """Attributes and inputs of a version, each away from its default: what, shape, inputs, attributes."""
    yield "", shape, inputs, attributes
    given = parameters(schema)
    for name in sorted(schema.attributes):
        for value in VALUES[op][name]:
            x, own, mine = list(shape), list(inputs), {**attributes, name: value}
            if op == "ReverseSequence":
                x, own, mine = [1, 3, 2], ["x", i(3)], {"batch_axis": 0, "time_axis": 1}
            if op in ("LayerNormalization", "RMSNormalization") and name == "axis":
                own[1] = f(2, 3)
            if op == "Gemm" and name == "transA":
                own[1] = f(1, 3)
            if op == "Conv" and name == "group":
                own[1] = f(2, 1, 2, 2)
            if op in ("MaxPool", "AveragePool") and name in ("count_include_pad", "ceil_mode", "storage_order"):
                mine |= {"pads": [1, 0, 0, 1], "strides": [2, 2]}
            if op == "Reshape":
                own[1] = i(0, 6)
            if op == "Split" and value == 2:
                x = [1, 3, 4]
            if op == "Split" and name == "split":
                mine |= {"axis": 1}
            if name in ("starts", "ends") and op == "Slice":
                mine |= {"axes": [0, 1]}
            if op in ("RNN", "GRU", "LSTM"):
                if name in ("activation_alpha", "activation_beta"):
                    mine["activations"] = SLOPES[op]
                if name == "direction" and value == "bidirectional":
                    own[1:] = [np.concatenate([w, f(*w.shape)]) for w in own[1:]]
                if name == "hidden_size":
                    gates = own[1].shape[1] // 2
                    own[1:] = [f(1, gates * 3, 2), f(1, gates * 3, 3)]
                if name == "layout":
                    x = [1, 1, 2]
            yield name, x, own, mine
    for place, name in enumerate(given):
        if name.endswith("?"):
            for constant in optional(op, name[:-1], shape, attributes):
                own = list(inputs) + [None] * (place + 1 - len(inputs))
                mine = {k: v for k, v in attributes.items() if not (op == "Split" and k == "num_outputs")}
                if op == "Pad" and name == "axes?":
                    own[1], own[2] = i(1, 0, 0, 0, 2, 0), scalar(0.3)
                if op == "Slice" and name == "steps?":
                    own[1], own[2], own[3] = i(0, 0), i(1, 4), i(0, 1)
                if op == "Slice" and name == "axes?":
                    own[1], own[2] = i(0, 1), i(1, 3)
                if own[place] is None or op == "Squeeze":
                    own[place] = constant
                yield name, shape, own, mine
        elif name.endswith("*"):
            yield name, shape, list(inputs) + ["x"], attributes
            if op != "Concat":
                yield name, shape, ["x"], attributes


def main(out):
    schemas = [s for s in defs.get_all_schemas_with_history() if s.domain == ""]
    table, cases = {}, []
    for op in sorted({s.name for s in schemas}):
        table[op] = []
        for opset, schema in revisions(op, schemas):
            table[op].append({"opset": opset, "attributes": sorted(schema.attributes), "inputs": parameters(schema)})
            if schema.deprecated:
                table[op][-1]["deprecated"] = True
                continue
            plain = recipe(op, schema.attributes, parameters(schema))
            if plain is None or plain[1] == ["constant"]:
                continue
            seen = set()
            for what, shape, inputs, attributes in variants(op, schema, *plain):
                count = len(schema.outputs) if op in ("RNN", "GRU", "LSTM") else 1
                if op == "Split":
                    count = attributes.get("num_outputs", 2)
                for read in range(count if op in ("RNN", "GRU", "LSTM", "Split") and what == "" else 1):
                    # A choice needs Where, which is younger.
                    opset = max(opset, 9) if plain[1] == ["choice"] else opset
                    model = graph(op, opset, shape, inputs, attributes, count, read)
                    x = f(*shape)
                    y = outputs_of(model, x)
                    if (what, model.SerializeToString()) in seen:
                        continue
                    seen.add((what, model.SerializeToString()))
                    cases.append({"op": op, "opset": opset, "what": f"output {read}" if read else what, "model": base64.b64encode(model.SerializeToString()).decode(),
                                  "x": [round(float(v), 3) for v in x.reshape(-1)], "y": y})
        if not table[op]:
            newest = [s.since_version for s in schemas if s.name == op]
            table[op] = [{"opset": min(newest), "attributes": [], "inputs": []}] if min(newest) > NEWEST else []
    others = {domain: sorted({s.name for s in defs.get_all_schemas_with_history() if s.domain == domain})
              for domain in ("ai.onnx.ml", "ai.onnx.preview", "ai.onnx.preview.training")}
    lines = lambda entries: "[\n" + ",\n".join(json.dumps(entry) for entry in entries) + "\n]\n"  # noqa: E731
    rows = ",\n".join(f"{json.dumps(op)}: {json.dumps(versions)}" for op, versions in table.items())
    (out / "domains.json").write_text(json.dumps(others, indent=1) + "\n")
    (out / "table.json").write_text("{\n" + rows + "\n}\n")
    (out / "cases.json").write_text(lines(cases))
    print(f"onnx {onnx.__version__}: {len(table)} operators, {len(cases)} cases, {sum(c['y'] is None for c in cases)} that onnxruntime does not run")
    for case in cases:
        if case["y"] is None:
            print(case["op"], case["opset"], case["what"])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
