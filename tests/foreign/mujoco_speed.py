"""How fast MuJoCo is on devices of mujoco_trajectories.py, on one core, for `cargo xtask bench plant`.

    python mujoco_speed.py NAME=ERROR...

For each device: every integrator at every step that divides a sample, its error against Runge-Kutta at a tenth
of the shortest step, and, of those at least as accurate as ERROR (a part of the range), the fastest. Where none is, the most accurate
one, with `reached` false: it is held to less than was asked, and what it takes is a lower bound. Driven by MuJoCo's own batched
rollout, one thread, 16 runs a call, best of several calls. Prints one JSON object.
"""

import json
import sys
import time

import mujoco
import mujoco.rollout
import numpy as np

import mujoco_trajectories as trajectories

BATCH, ROUNDS = 16, 4
STEPS_PER_SAMPLE = (1, 2, 3, 4, 5, 6, 8, 10, 16, 20, 40, 80, 160)
INTEGRATORS = ("Euler", "implicitfast", "implicit", "RK4")


def configured(device, integrator, steps):
    _, model, seen, motors, _ = device(1.0 / trajectories.RATE_HZ / steps)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, "mjINT_" + integrator.upper())
    return model, [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in seen], motors


def motion(device, integrator, steps, u):
    model, qpos, _ = configured(device, integrator, steps)
    return trajectories.run(model, u, qpos)


def error(device, integrator, steps, u, reference):
    """Largest difference from the reference, over the range of the motion."""
    run = motion(device, integrator, steps, u)
    if not np.isfinite(run).all():
        return float("inf")
    return float((np.abs(run - reference).max(axis=0) / np.ptp(reference, axis=0)).max())


def speed(device, integrator, steps, u):
    """Simulated seconds a second."""
    model, _, _ = configured(device, integrator, steps)
    data = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros(size)
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = np.repeat(u[:-1], steps, axis=0)
    control = np.broadcast_to(control, (BATCH, *control.shape)).copy()
    starts = np.tile(start, (BATCH, 1))
    state = np.zeros((BATCH, control.shape[1], size))
    best = float("inf")
    with mujoco.rollout.Rollout(nthread=0) as rollout:
        for _ in range(ROUNDS):
            begun = time.perf_counter()
            rollout.rollout([model] * BATCH, data, starts, control, state=state)
            best = min(best, time.perf_counter() - begun)
    return BATCH * (len(u) - 1) / trajectories.RATE_HZ / best


def main():
    found = {}
    for argument in sys.argv[1:]:
        name, wanted = argument.split("=")
        device = getattr(trajectories, name)
        number = trajectories.DEVICES.index(device)
        u = trajectories.inputs_of(number)
        reference = motion(device, "RK4", 10 * STEPS_PER_SAMPLE[-1], u)
        finest = {i: error(device, i, STEPS_PER_SAMPLE[-1], u, reference) for i in INTEGRATORS}
        reached = min(finest.values()) <= float(wanted)
        # Where nobody is that accurate the most accurate one sets the mark.
        mark = float(wanted) if reached else min(finest.values())
        best = None
        for integrator in INTEGRATORS:
            if finest[integrator] > mark:
                continue  # nor at any longer step
            for steps in STEPS_PER_SAMPLE:
                size = error(device, integrator, steps, u, reference)
                if size <= mark:
                    # Longer steps are faster: this is the integrator's best.
                    fast = speed(device, integrator, steps, u)
                    if best is None or fast > best["seconds_per_second"]:
                        best = {"error": size, "seconds_per_second": fast, "integrator": integrator,
                                "step_s": 1.0 / trajectories.RATE_HZ / steps, "reached": reached}
                    break
        found[name] = best
    print(json.dumps({"version": mujoco.__version__, "devices": found}))


if __name__ == "__main__":
    main()
