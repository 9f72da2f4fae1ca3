"""Cost over the optimum of a controller's closed loop, by IPOPT in double precision.

usage: ipopt_optimum.py RUN.csv NETWORK.json PROBLEM.json REFERENCE.csv BLOCK[,BLOCK...] N [STARTS]

RUN.csv has a row for each control step: k, y1..y3 (measured), u1, u2 (applied), then the plan that the
controller held when it returned: the commands at the ends of its blocks of equal moves. From the same
state, with the same f32 weights, IPOPT (CasADi) minimises the same J without blocking (Nc = N) from several
starts: holding the last command, the controller's own plan, and ramps at the rate limit. Then the loop is
closed once more around the plant with IPOPT's own commands. Prints one JSON object.
"""

import csv
import json
import sys

import casadi as ca
import numpy as np


def plant_derivative(x, u):
    """The plant of models/reference/problem.json."""
    t1, t2, w1, w2 = x
    return np.array([
        w1,
        w2,
        540 * np.tanh(1.3 * u[0]) - 405 * t1 - 270 * t1**3 - 20 * w1 + 110 * (t2 - t1),
        675 * np.tanh(1.1 * u[1]) - 540 * t2 - 360 * t2**3 - 24 * w2 + 135 * (t1 - t2)
        - 54 * np.sin(t1 + t2),
    ])


def advance(x, u, period):
    h = period / 4
    for _ in range(4):
        a = plant_derivative(x, u)
        b = plant_derivative(x + h / 2 * a, u)
        c = plant_derivative(x + h / 2 * b, u)
        d = plant_derivative(x + h * c, u)
        x = x + h / 6 * (a + 2 * b + 2 * c + d)
    return x


def outputs(x):
    return np.array([x[0], x[1], 0.6 * np.sin(x[0] + 0.7 * x[1]) + 0.25 * x[0] * x[1]])


class Problem:
    """J and its minimiser for a horizon of n steps."""

    def __init__(self, network, problem, n):
        layers = [
            (np.array(l["w"], dtype=np.float32).astype(float),
             np.array(l["b"], dtype=np.float32).astype(float),
             l["activation"])
            for l in network["layers"]
        ]
        act = {"tanh": ca.tanh, "relu": lambda x: ca.fmax(x, 0), "linear": lambda x: x}
        past_u, past_y = network["inputs_past"], network["outputs_past"]
        q, lam = np.array(problem["Q"]), np.array(problem["Lambda"])
        self.limit = (np.array(problem["u_min"]), np.array(problem["u_max"]))
        self.rate = np.array(problem["du_max_per_step"])
        self.n, self.past_u, self.past_y = n, past_u, past_y
        plan = ca.MX.sym("U", 2, n)
        us_past = ca.MX.sym("up", 2, past_u - 1)      # newest first
        ys_past = ca.MX.sym("yp", 3, past_y)
        ref = ca.MX.sym("r", 3, n)
        us = [us_past[:, i] for i in reversed(range(past_u - 1))]
        ys = [ys_past[:, i] for i in reversed(range(past_y))]
        cost, changes = 0, []
        for j in range(n):
            before = us[-1]
            us.append(plan[:, j])
            x = ca.vertcat(*[us[-1 - l] for l in range(past_u)], *[ys[-1 - l] for l in range(past_y)])
            for w, b, name in layers:
                x = act[name](ca.mtimes(w, x) + b)
            ys.append(x)
            error, change = x - ref[:, j], us[-1] - before
            cost += ca.dot(q * error, error) + ca.dot(lam * change, change)
            changes.append(change)
        given = ca.vertcat(ca.vec(us_past), ca.vec(ys_past), ca.vec(ref))
        self.cost = ca.Function("J", [plan, given], [cost])
        options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.tol": 1e-10}
        nlp = {"x": ca.vec(plan), "f": cost, "g": ca.vertcat(*changes), "p": given}
        self.ipopt = ca.nlpsol("ipopt", "ipopt", nlp, options)

    def given(self, us, ys, ref):
        return np.concatenate([np.ravel(us), np.ravel(ys), np.ravel(ref)])

    def optimum(self, us, ys, ref, starts):
        given = self.given(us, ys, ref)
        best = None
        for start in starts:
            found = self.ipopt(
                x0=np.ravel(start), p=given,
                lbx=np.tile(self.limit[0], self.n), ubx=np.tile(self.limit[1], self.n),
                lbg=np.tile(-self.rate, self.n), ubg=np.tile(self.rate, self.n))
            if self.ipopt.stats()["success"] and (best is None or float(found["f"]) < best[0]):
                best = float(found["f"]), np.array(found["x"]).reshape(self.n, 2)
        return best


def written_out(before, ends, blocks, n):
    """Every command of a plan in blocks of equal moves; held after the last."""
    plan = []
    for end, length in zip(ends, blocks):
        plan += [before + (end - before) * (i + 1) / length for i in range(length)]
        before = end
    return np.array(plan + [before] * (n - len(plan)))


def main():
    run, network, problem, reference, blocks, n = sys.argv[1:7]
    starts_wanted = int(sys.argv[7]) if len(sys.argv) > 7 else 4
    network, problem = json.load(open(network)), json.load(open(problem))
    blocks, n = [int(b) for b in blocks.split(",")], int(n)
    rows = [[float(v) for v in row] for row in list(csv.reader(open(reference)))[1:]]
    ref = np.array(rows, dtype=np.float32).astype(float)[:, 1:]
    steps = [[float(v) for v in row] for row in csv.reader(open(run)) if row[0][0] not in "k#"]
    mpc = Problem(network, problem, n)
    at = lambda k: ref[min(k, len(ref) - 1)]

    def starts(before, own):
        ramp = np.arange(1, n + 1)[:, None] * mpc.rate
        hold = np.tile(before, (n, 1))
        clip = lambda plan: np.clip(plan, *mpc.limit)
        every = [own, hold, clip(hold + ramp), clip(hold - ramp)]
        return [s for s in every if s is not None][:starts_wanted]

    us, ys = np.zeros((mpc.past_u - 1, 2)), None
    held = best_sum = worst = 0.0
    missed = 0
    for row in steps:
        k, y, u = int(row[0]), np.array(row[1:4]), np.array(row[4:6])
        ends = np.array(row[6:]).reshape(-1, 2)
        ys = np.tile(y, (mpc.past_y, 1)) if ys is None else np.vstack([y, ys[:-1]])
        preview = np.array([at(k + j) for j in range(1, n + 1)])
        own = written_out(us[0], ends, blocks, n)
        cost = float(mpc.cost(own.T, mpc.given(us, ys, preview)))
        best = mpc.optimum(us, ys, preview, starts(us[0], own))
        if best is None:
            missed += 1
        else:
            held, best_sum = held + cost, best_sum + best[0]
            if best[0] > 1e-4:
                worst = max(worst, cost / best[0] - 1)
        us = np.vstack([u, us[:-1]])

    x, us, ys, squares, own = np.zeros(4), np.zeros((mpc.past_u - 1, 2)), None, 0.0, None
    for k in range(len(steps)):
        y = outputs(x)
        squares += np.sum((y - at(k)) ** 2)
        ys = np.tile(y, (mpc.past_y, 1)) if ys is None else np.vstack([y, ys[:-1]])
        preview = np.array([at(k + j) for j in range(1, n + 1)])
        best = mpc.optimum(us, ys, preview, starts(us[0], own)[:2])
        own = us[:1].repeat(n, 0) if best is None else best[1]
        x = advance(x, own[0], problem["period_s"])
        us = np.vstack([own[0], us[:-1]])
    print(json.dumps({
        "cost_over_optimum": held / best_sum - 1,
        "largest_step_over_optimum": worst,
        "steps_without_optimum": missed,
        "tracking_rms_of_ipopt": float(np.sqrt(squares / len(steps) / 3)),
        "solver": "IPOPT by CasADi " + ca.__version__,
    }))


if __name__ == "__main__":
    main()
