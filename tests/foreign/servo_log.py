#!/usr/bin/env python3
"""Logs of a servo that lifts a pendulum, in the layout of BAM's recorder (github.com/Rhoban/bam).

The servo's own controller turns the error of the position into a torque; its gear has dry friction. Integrated by
itself, in steps of 20 us with friction as an impulse that stops, without code of sinew. `--check` compares only.
"""

import json
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent / "logs"
RATE_HZ, SECONDS, STEP_S = 50, 6, 2e-5
MASS, ARM_MASS, LENGTH, GRAVITY = 0.49, 0.0, 0.1, 9.81
INERTIA = 0.0062          # kg m^2: the mass, and the rotor through its gear
GAIN = 1.3                # N m/rad of the position error
DAMPING = 0.055           # N m s/rad: back-EMF and bearings
FRICTION = 0.045          # N m
ENCODER = 2 * math.pi / 4096

GOALS = {
    "sin_sin": lambda t: 0.8 * math.sin(2 * math.pi * 0.5 * t) + 0.3 * math.sin(2 * math.pi * 1.7 * t),
    "up_and_down": lambda t: 0.9 * math.sin(2 * math.pi * 0.35 * t) * min(1.0, t) + (0.25 if 2.0 < t < 4.0 else 0.0),
}


def simulate(goal):
    q = v = 0.0
    every = round(1 / (RATE_HZ * STEP_S))
    entries = []
    for step in range(RATE_HZ * SECONDS * every):
        # The servo takes a goal when it is asked for its state: held in between.
        if step % every == 0:
            t = step * STEP_S
            now = goal(t)
            entries.append({
                "position": round(round(q / ENCODER) * ENCODER, 6),
                "speed": round(v, 3),
                "load": 0.0,
                "input_volts": 7.4,
                "temp": 31,
                "timestamp": round(t, 6),
                "goal_position": round(now, 6),
                "torque_enable": True,
            })
            held = round(now, 6)
        torque = GAIN * (held - q) - DAMPING * v - MASS * GRAVITY * LENGTH * math.sin(q)
        v += STEP_S * torque / INERTIA
        stop = STEP_S * FRICTION / INERTIA
        v = 0.0 if abs(v) <= stop else v - math.copysign(stop, v)
        q += STEP_S * v
    return entries


def main():
    is_check = "--check" in sys.argv[1:]
    for name, goal in GOALS.items():
        head = {"mass": MASS, "arm_mass": ARM_MASS, "length": LENGTH, "kp": 200, "vin": 7.4, "motor": "xl330",
                "trajectory": name}
        text = json.dumps({**head, "entries": simulate(goal)}, separators=(",", ":")) + "\n"
        path = HERE / f"servo_{name}.json"
        if is_check:
            if path.read_text() != text:
                sys.exit(f"{path} is out of date: python3 {sys.argv[0]}")
        else:
            path.write_text(text)


main()
