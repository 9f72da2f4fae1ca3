#!/usr/bin/env python3
"""Networks as the exporters of the frameworks write them, with the frameworks' own outputs.

    python3 -m venv venv && venv/bin/pip install -r requirements.txt && venv/bin/python matrix.py OUT [EXPORTER ...]

Exporters: torch-script, torch-dynamo, tf2onnx, skl2onnx, jax2onnx, keras, tflite. Each makes a folder OUT/EXPORTER
with its files and expected.json: for every file `x`, inputs row by row, and `y`, what the framework gives for each.
An exporter whose packages are missing says so and is left out.
"""
import json
import os
import pathlib
import subprocess
import sys
import warnings

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "-1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
warnings.filterwarnings("ignore")

import numpy as np  # noqa: E402

VECTORS = 4


class Folder:
    """One exporter's files."""

    def __init__(self, out, exporter):
        self.path = pathlib.Path(out) / exporter
        self.path.mkdir(parents=True, exist_ok=True)
        self.expected, self.failed, self.exporter = {}, [], exporter

    def add(self, name, framework, x, y, tolerance=None):
        if not np.all(np.isfinite(np.asarray(y, dtype=np.float64))):
            return self.fail(name, "its outputs are not finite")
        rows = lambda v: np.asarray(v, dtype=np.float64).reshape(len(v), -1).tolist()
        self.expected[name] = {"framework": framework, "x": rows(x), "y": rows(y)}
        if tolerance:
            self.expected[name]["tolerance"] = tolerance

    def fail(self, name, error):
        self.failed.append(name)
        print(f"{self.exporter}/{name}: the exporter itself refuses: {str(error).splitlines()[0][:100] if str(error) else type(error)}")

    def close(self):
        (self.path / "expected.json").write_text(json.dumps(self.expected))
        print(f"{self.exporter}: {len(self.expected)} networks, {len(self.failed)} not exported", flush=True)


def draw(rng, shape):
    return rng.normal(0, 1, [VECTORS] + list(shape)).astype(np.float32)


def torch_networks():
    import torch
    from torch import nn
    import torch.nn.functional as F

    class Of(nn.Module):
        """A function with the modules that it uses."""

        def __init__(self, forward, **modules):
            super().__init__()
            self.call = forward
            for name, module in modules.items():
                if isinstance(module, torch.Tensor):
                    self.register_buffer(name, module)
                else:
                    setattr(self, name, module)

        def forward(self, x):
            return self.call(self, x)

    def mlp(g, n=4, out=2):
        return nn.Sequential(nn.Linear(n, 6), g, nn.Linear(6, out))

    nets = {}
    for name, g in {
        "relu": nn.ReLU(), "tanh": nn.Tanh(), "sigmoid": nn.Sigmoid(), "elu": nn.ELU(0.7), "selu": nn.SELU(),
        "gelu": nn.GELU(), "gelu-tanh": nn.GELU(approximate="tanh"), "softplus": nn.Softplus(), "silu": nn.SiLU(),
        "hardtanh": nn.Hardtanh(-0.5, 0.8), "relu6": nn.ReLU6(), "leaky": nn.LeakyReLU(0.1), "softsign": nn.Softsign(),
        "hardsigmoid": nn.Hardsigmoid(), "prelu": nn.PReLU(), "celu": nn.CELU(1.7), "logsigmoid": nn.LogSigmoid(),
        "mish": nn.Mish(), "hardswish": nn.Hardswish(), "softplus-beta": nn.Softplus(beta=2.0),
    }.items():
        nets[f"mlp-{name}"] = (mlp(g), (4,))
    nets["linear"] = (nn.Linear(3, 2), (3,))
    nets["no-bias"] = (nn.Sequential(nn.Linear(3, 4, bias=False), nn.Tanh(), nn.Linear(4, 1, bias=False)), (3,))
    nets["dropout"] = (nn.Sequential(nn.Linear(3, 4), nn.Dropout(0.3), nn.ReLU(), nn.Linear(4, 1)), (3,))
    nets["batchnorm1d"] = (nn.Sequential(nn.Linear(3, 4), nn.BatchNorm1d(4), nn.ReLU(), nn.Linear(4, 1)), (3,))
    nets["batchnorm-first"] = (nn.Sequential(nn.BatchNorm1d(3), nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 1)), (3,))
    nets["layernorm"] = (nn.Sequential(nn.Linear(3, 4), nn.LayerNorm(4), nn.Linear(4, 1)), (3,))
    nets["softmax"] = (nn.Sequential(nn.Linear(3, 4), nn.Softmax(dim=1)), (3,))
    nets["logsoftmax"] = (nn.Sequential(nn.Linear(3, 4), nn.LogSoftmax(dim=1)), (3,))
    nets["normalised"] = (Of(lambda s, x: s.net((x - s.mean) / s.dev) * s.gain + s.bias, net=mlp(nn.Tanh()),
                             mean=torch.tensor([0.1, 0.2, -0.3, 0.4]), dev=torch.tensor([1.5, 0.5, 2.0, 1.0]),
                             gain=torch.tensor([3.0, 0.5]), bias=torch.tensor([1.0, -1.0])), (4,))
    nets["residual"] = (Of(lambda s, x: s.b(x + F.relu(s.a(x))), a=nn.Linear(4, 4), b=nn.Linear(4, 2)), (4,))
    nets["difference"] = (Of(lambda s, x: s.b(torch.tanh(s.a(x)) - x), a=nn.Linear(4, 4), b=nn.Linear(4, 2)), (4,))
    nets["negative"] = (Of(lambda s, x: 1.0 - 2.0 * s.a(-x), a=nn.Linear(4, 3)), (4,))
    nets["concat"] = (Of(lambda s, x: s.b(torch.cat([torch.tanh(s.a(x)), x], dim=1)), a=nn.Linear(4, 3), b=nn.Linear(7, 2)), (4,))
    nets["columns"] = (Of(lambda s, x: torch.cat([s.a(x[:, :2]), s.b(x[:, 2:])], dim=1), a=nn.Linear(2, 3), b=nn.Linear(3, 2)), (5,))
    nets["chunk"] = (Of(lambda s, x: sum(f(p) for f, p in zip((s.a, s.b), x.chunk(2, dim=1))), a=nn.Linear(3, 2), b=nn.Linear(3, 2)), (6,))
    nets["index"] = (Of(lambda s, x: s.a(x[:, [3, 0, 1]]), a=nn.Linear(3, 2)), (5,))
    nets["gate"] = (Of(lambda s, x: torch.sigmoid(s.a(x)) * s.b(x), a=nn.Linear(4, 3), b=nn.Linear(4, 3)), (4,))
    nets["squeeze"] = (Of(lambda s, x: s.a(x).squeeze(-1), a=nn.Linear(4, 1)), (4,))
    nets["clamp"] = (Of(lambda s, x: s.a(x).clamp(-0.4, 0.3), a=nn.Linear(4, 3)), (4,))
    nets["clamp-above"] = (Of(lambda s, x: s.a(x).clamp(max=0.3), a=nn.Linear(4, 3)), (4,))
    nets["power"] = (Of(lambda s, x: s.a(x) ** 2, a=nn.Linear(4, 3)), (4,))
    nets["conv1d"] = (nn.Sequential(nn.Conv1d(2, 3, 3, padding=1), nn.ReLU(), nn.Flatten(), nn.Linear(24, 2)), (2, 8))
    nets["conv1d-dilated"] = (nn.Sequential(nn.Conv1d(2, 3, 3, dilation=2), nn.ReLU(), nn.Flatten(), nn.Linear(12, 2)), (2, 8))
    nets["conv1d-steps"] = (Of(lambda s, x: s.b(F.relu(s.a(x.transpose(1, 2))).mean(dim=2)), a=nn.Conv1d(3, 4, 3), b=nn.Linear(4, 2)), (8, 3))
    nets["conv2d"] = (nn.Sequential(nn.Conv2d(1, 3, 3), nn.BatchNorm2d(3), nn.ReLU(), nn.MaxPool2d(2), nn.Flatten(), nn.Linear(12, 2)), (1, 6, 6))
    nets["conv2d-view"] = (Of(lambda s, x: s.b(F.relu(s.a(x)).view(x.size(0), -1)), a=nn.Conv2d(1, 2, 3, stride=2), b=nn.Linear(8, 2)), (1, 6, 6))
    nets["conv2d-reshape"] = (Of(lambda s, x: s.b(F.relu(s.a(x)).reshape(-1, 8)), a=nn.Conv2d(1, 2, 3, stride=2), b=nn.Linear(8, 2)), (1, 6, 6))
    nets["depthwise"] = (nn.Sequential(nn.Conv2d(2, 4, 3, groups=2), nn.ReLU(), nn.Flatten(), nn.Linear(16, 2)), (2, 4, 4))
    nets["avgpool"] = (nn.Sequential(nn.Conv2d(1, 2, 3), nn.AvgPool2d(2), nn.Flatten(), nn.Linear(8, 2)), (1, 6, 6))
    nets["avgpool-padded"] = (nn.Sequential(nn.AvgPool2d(3, stride=1, padding=1), nn.Flatten(), nn.Linear(16, 2)), (1, 4, 4))
    nets["maxpool-ceil"] = (nn.Sequential(nn.MaxPool2d(2, ceil_mode=True), nn.Flatten(), nn.Linear(9, 2)), (1, 5, 5))
    nets["global-pool"] = (nn.Sequential(nn.Conv2d(1, 3, 3), nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(3, 2)), (1, 6, 6))
    nets["mean-image"] = (Of(lambda s, x: s.b(s.a(x).mean(dim=(2, 3))), a=nn.Conv2d(1, 3, 3), b=nn.Linear(3, 2)), (1, 6, 6))
    nets["max-steps"] = (Of(lambda s, x: s.a(x).amax(dim=1), a=nn.Linear(3, 2)), (5, 3))
    nets["sum-steps"] = (Of(lambda s, x: s.a(x).sum(dim=1), a=nn.Linear(3, 2)), (5, 3))
    nets["zero-pad"] = (nn.Sequential(nn.ZeroPad2d(1), nn.Conv2d(1, 2, 3), nn.Flatten(), nn.Linear(32, 2)), (1, 4, 4))
    nets["transposed-conv"] = (nn.Sequential(nn.ConvTranspose1d(2, 3, 3), nn.Flatten()), (2, 4))
    nets["dense-sequence"] = (nn.Sequential(nn.Linear(3, 4), nn.Tanh(), nn.Linear(4, 2)), (5, 3))
    nets["softmax-channels"] = (nn.Sequential(nn.Conv1d(2, 3, 3), nn.Softmax(dim=1)), (2, 6))
    nets["channel-scale"] = (Of(lambda s, x: s.a((x - s.mean) / s.dev), a=nn.Conv2d(2, 3, 3, padding=1),
                                mean=torch.tensor([0.3, -0.2]).view(1, 2, 1, 1), dev=torch.tensor([1.3, 0.7]).view(1, 2, 1, 1)), (2, 4, 4))
    nets["position"] = (Of(lambda s, x: s.a(x + s.p), a=nn.Linear(3, 2), p=torch.linspace(-1, 1, 15).view(1, 5, 3)), (5, 3))

    def recurrent(kind, take, **options):
        layer = getattr(nn, kind)(3, 4, batch_first=True, **options)
        width = 4 * (2 if options.get("bidirectional") else 1)
        return Of(lambda s, x: s.head(take(s.rnn(x))), rnn=layer, head=nn.Linear(width, 2))

    last = lambda r: r[0][:, -1]
    nets["lstm-last"] = (recurrent("LSTM", last), (6, 3))
    nets["gru-last"] = (recurrent("GRU", last), (6, 3))
    nets["rnn-last"] = (recurrent("RNN", last), (6, 3))
    nets["rnn-relu"] = (recurrent("RNN", last, nonlinearity="relu"), (6, 3))
    nets["lstm-all"] = (recurrent("LSTM", lambda r: r[0]), (6, 3))
    nets["lstm-hidden"] = (recurrent("LSTM", lambda r: r[1][0][-1]), (6, 3))
    nets["lstm-cell"] = (recurrent("LSTM", lambda r: r[1][1][-1]), (6, 3))
    nets["gru-hidden"] = (recurrent("GRU", lambda r: r[1].squeeze(0)), (6, 3))
    nets["gru-two"] = (recurrent("GRU", last, num_layers=2), (6, 3))
    nets["lstm-two"] = (recurrent("LSTM", lambda r: r[1][0][-1], num_layers=2), (6, 3))
    nets["lstm-both-ways"] = (recurrent("LSTM", lambda r: r[0], bidirectional=True), (4, 3))
    nets["gru-both-ways-last"] = (recurrent("GRU", last, bidirectional=True), (4, 3))
    nets["gru-mean"] = (recurrent("GRU", lambda r: r[0].mean(dim=1)), (6, 3))
    nets["gru-no-bias"] = (recurrent("GRU", last, bias=False), (6, 3))
    nets["attention"] = (Of(lambda s, x: s.a(x, x, x)[0], a=nn.MultiheadAttention(4, 2, batch_first=True)), (3, 4))
    nets["weight-norm"] = (Of(lambda s, x: s.a(x), a=nn.utils.parametrizations.weight_norm(nn.Linear(4, 3))), (4,))
    return nets


def torch_exporter(out, dynamo):
    import torch

    folder = Folder(out, "torch-dynamo" if dynamo else "torch-script")
    torch.manual_seed(3)
    rng = np.random.default_rng(3)
    for name, (net, shape) in torch_networks().items():
        net.eval()
        with torch.no_grad():
            for layer in net.modules():
                if isinstance(layer, (torch.nn.BatchNorm1d, torch.nn.BatchNorm2d)):
                    layer.running_mean.uniform_(-0.5, 0.5)
                    layer.running_var.uniform_(0.5, 1.5)
                    layer.weight.uniform_(0.5, 1.5)
                    layer.bias.uniform_(-0.5, 0.5)
        x = draw(rng, shape)
        for batch in ("open", "fixed"):
            file = f"{name}-{batch}.onnx"
            options = {"input_names": ["x"], "output_names": ["y"]}
            try:
                with torch.no_grad():
                    y = [net(torch.from_numpy(x[i : i + 1])).numpy().reshape(-1) for i in range(VECTORS)]
                example = torch.from_numpy(x[:1])
                path = folder.path / file
                if dynamo:
                    dims = {"dynamic_shapes": ({0: torch.export.Dim("batch", min=1, max=64)},)} if batch == "open" else {}
                    if batch == "open":
                        example = torch.from_numpy(x[:2])
                    program = torch.onnx.export(net, (example,), dynamo=True, verbose=False, **options, **dims)
                    program.save(str(path), external_data=False)
                else:
                    dims = {"dynamic_axes": {"x": {0: "n"}, "y": {0: "n"}}} if batch == "open" else {}
                    torch.onnx.export(net, (example,), str(path), dynamo=False, opset_version=17, **options, **dims)
                folder.add(file, f"torch {torch.__version__}", x, y)
            except Exception as error:  # noqa: BLE001
                folder.fail(file, error)
    folder.close()


def keras_networks():
    import keras
    from keras import layers as L

    nets = {}

    def sequential(name, shape, *stack):
        nets[name] = keras.Sequential([keras.Input(shape), *stack])

    def functional(name, shape, call):
        x = keras.Input(shape)
        nets[name] = keras.Model(x, call(x))

    for g in ("relu", "tanh", "sigmoid", "elu", "selu", "gelu", "softplus", "softsign", "swish", "hard_sigmoid",
              "leaky_relu", "exponential", "relu6", "mish", "hard_silu", "log_sigmoid", "celu"):
        sequential(f"mlp-{g}", (4,), L.Dense(6, activation=g), L.Dense(2))
    sequential("softmax", (4,), L.Dense(3, activation="softmax"))
    sequential("batchnorm", (4,), L.Dense(5), L.BatchNormalization(), L.ReLU(), L.Dense(2))
    sequential("layernorm", (4,), L.Dense(5), L.LayerNormalization(), L.Dense(2))
    sequential("relu-max", (4,), L.Dense(5), L.ReLU(max_value=1.0), L.Dense(2))
    sequential("leaky", (4,), L.Dense(5), L.LeakyReLU(negative_slope=0.17), L.Dense(2))
    sequential("prelu", (4,), L.Dense(5), L.PReLU(alpha_initializer="ones"), L.Dense(2))
    sequential("dropout", (4,), L.Dense(5), L.Dropout(0.4), L.Dense(2))
    sequential("normalised", (3,), L.Normalization(mean=[1.0, 0.0, -1.0], variance=[2.0, 0.5, 1.0]), L.Dense(2))
    sequential("units-back", (3,), L.Dense(2), L.Normalization(mean=[1.0, -3.0], variance=[4.0, 9.0], invert=True))
    sequential("rescaled", (3,), L.Rescaling(0.3, offset=-0.2), L.Dense(2))
    sequential("conv1d", (8, 2), L.Conv1D(3, 3, padding="same", activation="relu"), L.Flatten(), L.Dense(2))
    sequential("conv1d-causal", (8, 2), L.Conv1D(3, 3, padding="causal"), L.GlobalAveragePooling1D(), L.Dense(2))
    sequential("conv2d", (6, 6, 1), L.Conv2D(3, 3), L.MaxPooling2D(), L.Flatten(), L.Dense(2))
    sequential("conv2d-groups", (5, 5, 2), L.Conv2D(4, 3, groups=2), L.Flatten(), L.Dense(2))
    sequential("depthwise", (5, 5, 2), L.DepthwiseConv2D(3), L.Flatten(), L.Dense(2))
    sequential("padded", (4, 4, 1), L.ZeroPadding2D(1), L.Conv2D(2, 3), L.Flatten(), L.Dense(2))
    sequential("pools", (6, 6, 1), L.AveragePooling2D(2, strides=1, padding="same"), L.GlobalMaxPooling2D(), L.Dense(2))
    sequential("dense-sequence", (5, 3), L.Dense(4, activation="tanh"), L.Dense(2))
    sequential("reshape", (12,), L.Reshape((4, 3)), L.Permute((2, 1)), L.Conv1D(2, 2), L.Flatten(), L.Dense(1))
    for kind in ("LSTM", "GRU", "SimpleRNN"):
        sequential(f"{kind.lower()}", (6, 3), getattr(L, kind)(4), L.Dense(2))
        sequential(f"{kind.lower()}-all", (6, 3), getattr(L, kind)(4, return_sequences=True), L.Dense(2))
        sequential(f"{kind.lower()}-two", (6, 3), getattr(L, kind)(4, return_sequences=True), getattr(L, kind)(3), L.Dense(2))
    sequential("gru-before", (6, 3), L.GRU(4, reset_after=False), L.Dense(2))
    sequential("lstm-backward", (6, 3), L.LSTM(4, go_backwards=True), L.Dense(2))
    sequential("lstm-both-ways", (4, 3), L.Bidirectional(L.LSTM(3)), L.Dense(2))
    sequential("lstm-relu", (6, 3), L.LSTM(4, activation="relu", recurrent_activation="hard_sigmoid"), L.Dense(2))
    functional("residual", (4,), lambda x: L.Dense(2)(L.Add()([x, L.Dense(4, activation="tanh")(x)])))
    functional("concat", (4,), lambda x: L.Dense(2)(L.Concatenate()([x, L.Dense(3, activation="tanh")(x)])))
    functional("plus", (4,), lambda x: L.Dense(2)(x) * 3.0 + 0.5)
    functional("minus", (4,), lambda x: 1.0 - L.Dense(2)(x) / 4.0)
    functional("vector", (4,), lambda x: L.Dense(2)(x) + np.array([0.5, -2.0], dtype=np.float32))
    functional("negative", (4,), lambda x: -L.Dense(2)(x))
    functional("difference", (4,), lambda x: L.Dense(4)(x) - x)
    functional("product", (4,), lambda x: L.Dense(4)(x) * x)
    functional("ops", (4,), lambda x: keras.ops.tanh(keras.ops.relu(L.Dense(4)(x))))
    functional("ops-leaky", (4,), lambda x: keras.ops.leaky_relu(L.Dense(4)(x), negative_slope=0.07))
    functional("columns", (4,), lambda x: L.Dense(2)(x[:, :2]))
    functional("multiply-layers", (4,), lambda x: L.Multiply()([L.Dense(4)(x), x]))
    functional("average", (4,), lambda x: L.Average()([L.Dense(4)(x), x]))
    functional("lambda", (4,), lambda x: L.Lambda(lambda v: v * 2.0)(L.Dense(2)(x)))
    functional("first-state", (4, 2), lambda x: L.GRU(3)(x, initial_state=L.Dense(3)(L.Flatten()(x))))
    functional("clip", (4,), lambda x: keras.ops.clip(L.Dense(2)(x), -0.3, 0.4))
    functional("power", (4,), lambda x: L.Dense(2)(x) ** 2)
    return nets


def stirred(net, rng):
    for layer in net.layers:
        values = layer.get_weights()
        names = [v.name for v in layer.weights]
        for i, (name, value) in enumerate(zip(names, values)):
            if any(part in name for part in ("bias", "beta", "moving_mean")):
                values[i] = rng.uniform(-0.5, 0.5, value.shape).astype(value.dtype)
            if any(part in name for part in ("gamma", "moving_variance")):
                values[i] = rng.uniform(0.5, 1.5, value.shape).astype(value.dtype)
        if values and not any("count" in name for name in names):
            layer.set_weights(values)
    return net


def keras_exporter(out):
    import keras

    keras.utils.set_random_seed(5)
    folder, rng = Folder(out, "keras"), np.random.default_rng(5)
    for name, net in keras_networks().items():
        stirred(net, rng)
        x = draw(rng, net.input_shape[1:])
        y = [np.asarray(net(x[i : i + 1])).reshape(-1) for i in range(VECTORS)]
        for suffix in ("keras", "h5"):
            file = f"{name}.{suffix}"
            try:
                net.save(folder.path / file)
                folder.add(file, f"keras {keras.__version__}", x, y)
            except Exception as error:  # noqa: BLE001
                folder.fail(file, error)
    folder.close()


def tf2onnx_exporter(out):
    import keras
    import tensorflow as tf
    import tf2onnx

    keras.utils.set_random_seed(7)
    folder, rng = Folder(out, "tf2onnx"), np.random.default_rng(7)
    for name, net in keras_networks().items():
        stirred(net, rng)
        x = draw(rng, net.input_shape[1:])
        file = f"{name}.onnx"
        try:
            y = [np.asarray(net(x[i : i + 1])).reshape(-1) for i in range(VECTORS)]
            signature = [tf.TensorSpec((None, *x.shape[1:]), tf.float32, name="x")]
            function = tf.function(lambda v, net=net: net(v), input_signature=signature)
            tf2onnx.convert.from_function(function, input_signature=signature, opset=15, output_path=str(folder.path / file))
            folder.add(file, f"tf2onnx {tf2onnx.__version__}", x, y)
        except Exception as error:  # noqa: BLE001
            folder.fail(file, error)
    folder.close()


def tflite_exporter(out):
    import keras
    import tensorflow as tf
    from ai_edge_litert.interpreter import Interpreter

    keras.utils.set_random_seed(9)
    folder, rng = Folder(out, "tflite"), np.random.default_rng(9)
    for name, net in keras_networks().items():
        stirred(net, rng)
        x = draw(rng, net.input_shape[1:])
        file = f"{name}.tflite"
        try:
            converter = tf.lite.TFLiteConverter.from_keras_model(net)
            data = converter.convert()
            (folder.path / file).write_bytes(data)
            run = Interpreter(model_content=data)
            run.allocate_tensors()
            y = []
            for row in x:
                run.set_tensor(run.get_input_details()[0]["index"], row[None])
                run.invoke()
                y.append(run.get_tensor(run.get_output_details()[0]["index"]).reshape(-1).copy())
            folder.add(file, "LiteRT", x, y)
        except Exception as error:  # noqa: BLE001
            folder.fail(file, error)
    folder.close()


def skl2onnx_exporter(out):
    import sklearn
    from skl2onnx import to_onnx
    from sklearn import decomposition, ensemble, gaussian_process, linear_model, neighbors, neural_network, pipeline
    from sklearn import preprocessing, svm, tree
    from sklearn.cross_decomposition import PLSRegression

    folder, rng = Folder(out, "skl2onnx"), np.random.default_rng(11)
    data = rng.normal(0, 1, (80, 3)).astype(np.float32)
    one = (np.sin(data[:, 0]) + data[:, 1] * 0.5).astype(np.float32)
    two = np.stack([one, data[:, 2] - one], axis=1)
    mlp = lambda **o: neural_network.MLPRegressor(max_iter=60, random_state=0, **o)
    P = pipeline.make_pipeline
    models = {}
    for g in ("relu", "tanh", "logistic", "identity"):
        for depth in ((5,), (6, 4), (4, 4, 4)):
            models[f"mlp-{g}-{len(depth)}"] = (mlp(activation=g, hidden_layer_sizes=depth), one)
        models[f"mlp-{g}-two"] = (mlp(activation=g, hidden_layer_sizes=(5,)), two)
    for scaler in ("StandardScaler", "MinMaxScaler", "MaxAbsScaler", "RobustScaler"):
        models[f"{scaler.lower()}-mlp"] = (P(getattr(preprocessing, scaler)(), mlp(hidden_layer_sizes=(5,))), one)
        models[f"{scaler.lower()}-linear"] = (P(getattr(preprocessing, scaler)(), linear_model.LinearRegression()), two)
    models["minmax-clipped"] = (P(preprocessing.MinMaxScaler(clip=True), mlp(hidden_layer_sizes=(5,))), one)
    models["pca-mlp"] = (P(decomposition.PCA(2), mlp(hidden_layer_sizes=(5,))), one)
    models["linear"] = (linear_model.LinearRegression(), one)
    models["linear-two"] = (linear_model.LinearRegression(), two)
    models["ridge"] = (linear_model.Ridge(), one)
    models["lasso"] = (linear_model.Lasso(0.01), one)
    models["pls"] = (PLSRegression(2), one)
    models["polynomial"] = (P(preprocessing.PolynomialFeatures(2), linear_model.LinearRegression()), one)
    models["svr"] = (svm.SVR(), one)
    models["tree"] = (tree.DecisionTreeRegressor(max_depth=3), one)
    models["forest"] = (ensemble.RandomForestRegressor(5, max_depth=3), one)
    models["neighbours"] = (neighbors.KNeighborsRegressor(), one)
    models["gaussian-process"] = (gaussian_process.GaussianProcessRegressor(), one)
    models["classifier"] = (neural_network.MLPClassifier((5,), max_iter=60), one > 0)
    models["logistic"] = (linear_model.LogisticRegression(), one > 0)
    x = draw(rng, (3,))
    for name, (model, y) in models.items():
        file = f"{name}.onnx"
        try:
            model.fit(data, y)
            onnx = to_onnx(model, data[:1])
            (folder.path / file).write_bytes(onnx.SerializeToString())
            folder.add(file, f"scikit-learn {sklearn.__version__}", x, np.asarray(model.predict(x)).reshape(VECTORS, -1))
        except Exception as error:  # noqa: BLE001
            folder.fail(file, error)
    folder.close()


def jax2onnx_exporter(out):
    import jax
    import jax.numpy as jnp
    import onnx
    from jax2onnx import to_onnx

    folder, rng = Folder(out, "jax2onnx"), np.random.default_rng(13)
    w = lambda *shape: jnp.asarray(rng.normal(0, 0.5, shape).astype(np.float32))
    nets = {}
    for name in ("relu", "tanh", "sigmoid", "elu", "selu", "gelu", "softplus", "silu", "soft_sign", "leaky_relu",
                 "relu6", "hard_tanh", "celu", "log_sigmoid", "hard_sigmoid", "mish"):
        g = jnp.tanh if name == "tanh" else getattr(jax.nn, name)
        a, b, c, d = w(4, 6), w(6), w(6, 2), w(2)
        nets[f"mlp-{name}"] = (lambda x, g=g, a=a, b=b, c=c, d=d: g(x @ a + b) @ c + d, (4,))
    a, b = w(4, 3), w(3)
    nets["linear"] = (lambda x: x @ a + b, (4,))
    nets["no-bias"] = (lambda x: x @ a, (4,))
    nets["softmax"] = (lambda x: jax.nn.softmax(x @ a), (4,))
    nets["log-softmax"] = (lambda x: jax.nn.log_softmax(x @ a), (4,))
    nets["scaled"] = (lambda x: (x - 0.3) / 1.7 @ a * 2.0 + 1.0, (4,))
    m, s = w(4), jnp.abs(w(4)) + 0.5
    nets["normalised"] = (lambda x: jnp.tanh((x - m) / s @ a), (4,))
    q = w(4, 4)
    nets["residual"] = (lambda x: x + jnp.tanh(x @ q), (4,))
    nets["difference"] = (lambda x: jnp.tanh(x @ q) - x, (4,))
    nets["negative"] = (lambda x: -(x @ a), (4,))
    nets["concat"] = (lambda x: jnp.concatenate([x, jnp.tanh(x @ a)], axis=1) @ w7, (4,))
    w7 = w(7, 2)
    w2 = w(2, 2)
    nets["columns"] = (lambda x: x[:, 1:3] @ w2, (4,))
    nets["clip"] = (lambda x: jnp.clip(x @ a, -0.4, 0.3), (4,))
    nets["maximum"] = (lambda x: jnp.maximum(x @ a, 0.0), (4,))
    nets["product"] = (lambda x: (x @ q) * x, (4,))
    nets["power"] = (lambda x: (x @ a) ** 2, (4,))
    nets["mean"] = (lambda x: jnp.mean(x, axis=1) @ w3, (5, 3))
    w3 = w(3, 2)
    nets["sequence"] = (lambda x: jnp.tanh(x @ w3), (5, 3))
    nets["reshape"] = (lambda x: x.reshape(x.shape[0], -1) @ w15, (5, 3))
    w15 = w(15, 2)
    nets["last-step"] = (lambda x: x[:, -1] @ w3, (5, 3))
    nets["transpose"] = (lambda x: jnp.transpose(x, (0, 2, 1)) @ w5, (5, 3))
    w5 = w(5, 2)
    for batch in (1, "B"):
        for name, (call, shape) in nets.items():
            file = f"{name}-{'fixed' if batch == 1 else 'open'}.onnx"
            x = draw(rng, shape)
            try:
                y = [np.asarray(call(jnp.asarray(x[i : i + 1]))).reshape(-1) for i in range(VECTORS)]
                model = to_onnx(call, [(batch, *shape)])
                onnx.save(model, str(folder.path / file))
                folder.add(file, f"jax {jax.__version__}", x, y)
            except Exception as error:  # noqa: BLE001
                folder.fail(file, error)
    folder.close()


EXPORTERS = {
    "torch-script": lambda out: torch_exporter(out, False),
    "torch-dynamo": lambda out: torch_exporter(out, True),
    "tf2onnx": tf2onnx_exporter,
    "skl2onnx": skl2onnx_exporter,
    "jax2onnx": jax2onnx_exporter,
    "keras": keras_exporter,
    "tflite": tflite_exporter,
}

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    chosen = sys.argv[2:] or list(EXPORTERS)
    if len(chosen) > 1:
        # TensorFlow and PyTorch do not share a process.
        for exporter in chosen:
            subprocess.run([sys.executable, __file__, sys.argv[1], exporter], check=False)
        sys.exit()
    try:
        EXPORTERS[chosen[0]](sys.argv[1])
    except ImportError as error:
        print(f"{chosen[0]}: SKIPPED, {error}", flush=True)
