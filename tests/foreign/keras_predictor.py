#!/usr/bin/env python3
"""A predictor trained in Keras, as somebody who has TensorFlow would: from recordings alone, in their own units.

    python3 keras_predictor.py OUT fit.csv [more.csv ...]       (packages: codegen/nn/tests/frameworks/requirements.txt)

OUT.keras and OUT.tflite take u(k) .. u(k-3) and y(k) .. y(k-7) of the mass on a spring and give y(k+1) - y(k). The
normalisation is inside. rigs/experiments/mass-spring-damper.tflite was made by it from fit.csv of `cargo xtask experiments
mass-spring-damper` (seed 1).
"""

import os
import sys

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("TF_ENABLE_ONEDNN_OPTS", "0")

import keras  # noqa: E402
import numpy as np  # noqa: E402
import tensorflow as tf  # noqa: E402

PAST_INPUTS, PAST_OUTPUTS, HIDDEN, SEED = 4, 8, 12, 7


def windows(path):
    """Regressors and the changes that follow them."""
    table = np.genfromtxt(path, delimiter=",", names=True, comments="#")
    u, y = table["u_N"], table["q_m"]
    first = max(PAST_INPUTS, PAST_OUTPUTS) - 1
    k = np.arange(first, len(y) - 1)
    x = [u[k - i] for i in range(PAST_INPUTS)] + [y[k - i] for i in range(PAST_OUTPUTS)]
    return np.stack(x, axis=1).astype("float32"), (y[k + 1] - y[k]).astype("float32")[:, None]


def main():
    out, *paths = sys.argv[1:]
    keras.utils.set_random_seed(SEED)
    pairs = [windows(path) for path in paths]
    x, y = np.concatenate([p[0] for p in pairs]), np.concatenate([p[1] for p in pairs])
    normal = keras.layers.Normalization()
    normal.adapt(x)
    back = keras.layers.Rescaling(float(y.std()))
    net = keras.Sequential([keras.Input((x.shape[1],)), normal, keras.layers.Dense(HIDDEN, "tanh"), keras.layers.Dense(1), back])
    net.compile(keras.optimizers.Adam(3e-3), loss=lambda a, b: keras.ops.mean(((a - b) / y.std()) ** 2))
    stop = keras.callbacks.EarlyStopping(patience=40, restore_best_weights=True)
    slower = keras.callbacks.ReduceLROnPlateau(factor=0.5, patience=15)
    order = np.random.default_rng(SEED).permutation(len(x))
    net.fit(x[order], y[order], batch_size=128, epochs=400, validation_split=0.2, verbose=0, callbacks=[stop, slower])
    print("loss, 1 = no better than a constant:", float(net.evaluate(x, y, verbose=0)))
    net.save(out + ".keras")
    with open(out + ".tflite", "wb") as file:
        file.write(tf.lite.TFLiteConverter.from_keras_model(net).convert())


if __name__ == "__main__":
    main()
