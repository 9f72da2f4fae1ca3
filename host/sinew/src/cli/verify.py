"""What the framework of a network gives for inputs: called by `sinew verify` with the user's own Python.

verify.py NETWORK < JSON rows of inputs > JSON rows of outputs. An input of several axes is flattened, its last axis
running fastest; batches and steps that are open are 1. A row is null where integers of TensorFlow Lite hold a value
no more: their framework cuts it off.
"""
import json
import os
import sys

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")


def of_onnx(path):
    import numpy
    import onnxruntime

    # An optimised graph rounds activations where weights are integers.
    options = onnxruntime.SessionOptions()
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    given = session.get_inputs()[0]
    shape = [n if isinstance(n, int) and n > 0 else 1 for n in given.shape]
    kind = numpy.float64 if "double" in given.type else numpy.float32
    return lambda x: session.run(None, {given.name: numpy.asarray(x, kind).reshape(shape)})[0]


def of_keras(path):
    import numpy

    try:
        import keras

        net = keras.models.load_model(path, compile=False)
    except Exception:  # a file of Keras 2
        import tf_keras

        net = tf_keras.models.load_model(path, compile=False)
    shape = [1] + [n or 1 for n in net.input_shape[1:]]

    def call(x):
        if hasattr(net, "reset_states"):
            net.reset_states()
        return numpy.asarray(net(numpy.asarray(x, numpy.float32).reshape(shape), training=False))

    return call


def of_tflite(path):
    import numpy

    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError:
        from tensorflow.lite import Interpreter
    run = Interpreter(model_path=path, experimental_preserve_all_tensors=True)
    run.allocate_tensors()
    computed = {int(index) for op in run._get_ops_details() for index in op["outputs"]}
    given, found = run.get_input_details()[0], run.get_output_details()[0]

    def ends(values, low, high):
        return (low is not None and (values == low).any()) or (values == high).any()

    # Values between layers; the smallest is what a ReLU gives where it stands for zero.
    held = []
    for tensor in run.get_tensor_details():
        scale, zero = tensor["quantization"]
        kind = tensor["dtype"]
        if scale == 0 or kind not in (numpy.int8, numpy.uint8, numpy.int16) or tensor["index"] not in computed:
            continue
        low, high = numpy.iinfo(kind).min, numpy.iinfo(kind).max
        held.append((tensor["index"], None if low == zero else low, high))

    def call(x):
        x = numpy.asarray(x, numpy.float64).reshape(given["shape"])
        scale, zero = given["quantization"]
        if given["dtype"] != numpy.float32:
            low, high = numpy.iinfo(given["dtype"]).min, numpy.iinfo(given["dtype"]).max
            x = numpy.clip(numpy.round(x / scale) + zero, low, high)
        run.set_tensor(given["index"], x.astype(given["dtype"]))
        run.invoke()
        if any(ends(run.get_tensor(index), low, high) for index, low, high in held):
            return None
        y = run.get_tensor(found["index"]).astype(numpy.float64)
        scale, zero = found["quantization"]
        return y if found["dtype"] == numpy.float32 else (y - zero) * scale

    return call


if __name__ == "__main__":
    ending = sys.argv[1].lower().rsplit(".", 1)[-1]
    call = {"onnx": of_onnx, "keras": of_keras, "h5": of_keras, "tflite": of_tflite}[ending](sys.argv[1])
    rows = json.load(sys.stdin)
    # JSON has no NaN and no infinity: these are words.
    word = lambda y: y if y - y == 0 else str(y)  # noqa: E731
    found = map(call, rows)
    json.dump([None if y is None else [word(v) for v in y.reshape(-1).tolist()] for y in found], sys.stdout)
