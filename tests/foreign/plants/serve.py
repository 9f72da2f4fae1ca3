"""The lines of a plant program (docs/how-to/plant-program.md, "A plant of another program"), and which plant it is to be."""

import os
import sys

import numpy as np

SEED = 31


def draws():
    """A function from a parameter's value to this plant's: the value itself for plant 0, else within the spread."""
    number, spread = int(os.environ.get("SINEW_DRAW", "0")), float(os.environ.get("SINEW_SPREAD", "0"))
    source = np.random.Generator(np.random.PCG64([SEED, number]))
    return lambda value: value * (1.0 + (spread * source.uniform(-1.0, 1.0) if number else 0.0))


def serve(inputs, sensors, read, advance):
    """Answers until the input ends. `read()` gives the signals, `advance(seconds, inputs)` lets time pass."""
    def say(words):
        print(",".join(words), flush=True)

    say(["sinew-plant/1"])
    say(inputs)
    say(sensors)
    say(repr(float(value)) for value in read())
    for line in sys.stdin:
        seconds, *held = [float(word) for word in line.split(",")]
        advance(seconds, held)
        say(repr(float(value)) for value in read())
