"""Other people's code for the shapes of the reference problem, as archives for a Cortex-M4F.

usage: peers.py emlearn NETWORK.json OUT_FOLDER
       peers.py osqp NETWORK.json PROBLEM.json N OUT_FOLDER

emlearn prints the network's forward pass as C; `peer_predict` calls it. OSQP prints an embedded solver for a linear MPC
of the same shape: the network linearised at rest, the same horizon, weights, box and rate limits, every command free;
`peer_step` keeps its history, sets the vectors and calls it. Both are compiled by the clang of the package ziglang and leave
OUT_FOLDER/libpeer.a. Prints one JSON object: what was built, with which versions.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

FLAGS = [
    "-target", "thumb-linux-musleabihf", "-mcpu=cortex_m4+vfp4d16sp", "-mfloat-abi=hard", "-O2", "-fno-math-errno",
    "-fno-sanitize=all", "-fno-stack-protector", "-fno-pic", "-fno-unwind-tables",
    "-fno-asynchronous-unwind-tables", "-ffunction-sections", "-fdata-sections", "-w",
]


def compile_archive(folder, sources):
    zig = [sys.executable, "-m", "ziglang"]
    objects = []
    for source, includes in sources.items():
        objects.append(str(folder / (pathlib.Path(source).stem + ".o")))
        subprocess.run(zig + ["cc", *FLAGS, *(f"-I{i}" for i in includes), "-c", str(source), "-o", objects[-1]],
                       check=True)
    archive = folder / "libpeer.a"
    archive.unlink(missing_ok=True)
    subprocess.run(zig + ["ar", "rcs", str(archive), *objects], check=True)


def musl(name):
    """A function of the C library that the compiler's package brings as a source."""
    import ziglang
    folder = pathlib.Path(ziglang.__file__).parent / "lib/libc/musl"
    includes = ["src/internal", "src/include", "arch/arm", "arch/generic"]
    return folder / "src" / name, [folder / i for i in includes]


def layers_of(network):
    return [(np.array(l["w"], dtype=np.float32).astype(float), np.array(l["b"], dtype=np.float32).astype(float),
             l["activation"]) for l in network["layers"]]


def emlearn(network, folder):
    from importlib.metadata import version

    import emlearn as package
    from emlearn import net
    layers = layers_of(network)
    names = [{"linear": "identity"}.get(a, a) for _, _, a in layers]
    text = net.c_generate_net_loadable(names, [w.T for w, _, _ in layers], [b for _, b, _ in layers], "net")
    inputs, outputs = layers[0][0].shape[1], layers[-1][0].shape[0]
    text += f"""
/* The package has no tanhf; by the C library's formula, on its expm1f. */
float tanhf(float x)
{{
    float a = x < 0 ? -x : x, t = a > 10 ? 1 : 1 - 2 / (expm1f(2 * a) + 2);
    return x < 0 ? -t : t;
}}
float expf(float x) {{ return expm1f(x) + 1; }}
void peer_predict(const float *x, float *y) {{ net_regress(x, {inputs}, y, {outputs}); }}
"""
    source = folder / "network.c"
    source.write_text(text)
    expm1f, includes = musl("math/expm1f.c")
    compile_archive(folder, {source: [package.includedir], expm1f: includes})
    return {"peer": "emlearn " + version("emlearn")}


def linearised(network):
    """y(k+1) = c + sum_l A_l y(k-l) + sum_l B_l u(k-l): the network and its Jacobian at rest."""
    x = np.zeros(layers_of(network)[0][0].shape[1])
    jacobian = np.eye(len(x))
    for w, b, name in layers_of(network):
        z = w @ x + b
        x = {"tanh": np.tanh, "relu": lambda z: np.maximum(z, 0), "linear": lambda z: z}[name](z)
        slope = {"tanh": 1 - x * x, "relu": (z > 0).astype(float), "linear": np.ones_like(z)}[name]
        jacobian = slope[:, None] * (w @ jacobian)
    past_u, past_y = network["inputs_past"], network["outputs_past"]
    n_y = len(x)
    n_u = (jacobian.shape[1] - past_y * n_y) // past_u
    by_u = [jacobian[:, i * n_u:(i + 1) * n_u] for i in range(past_u)]
    start = past_u * n_u
    by_y = [jacobian[:, start + i * n_y:start + (i + 1) * n_y] for i in range(past_y)]
    return x, by_u, by_y


def c_matrix(name, values):
    numbers = ", ".join(f"{v:.9e}f" for v in np.ravel(values))
    return f"static const float {name}[] = {{{numbers}}};\n"


def osqp(network, problem, n, folder):
    import osqp as package
    import scipy.sparse as sp
    constant, by_u, by_y = linearised(network)
    n_y, n_u = len(constant), by_u[0].shape[1]
    q, lam = np.array(problem["Q"]), np.array(problem["Lambda"])
    # z = y_1 .. y_n, u_0 .. u_{n-1}; rows: dynamics, box, rate.
    size_y, size_u = n * n_y, n * n_u
    dynamics = sp.lil_matrix((size_y, size_y + size_u))
    for j in range(n):
        row = slice(j * n_y, (j + 1) * n_y)
        dynamics[row, row] = np.eye(n_y)
        for lag, a in enumerate(by_y):
            if j - 1 - lag >= 0:
                dynamics[row, (j - 1 - lag) * n_y:(j - lag) * n_y] = -a
        for lag, b in enumerate(by_u):
            if j - lag >= 0:
                dynamics[row, size_y + (j - lag) * n_u:size_y + (j - lag + 1) * n_u] = -b
    differences = sp.eye(size_u) - sp.eye(size_u, k=-n_u)
    rows = sp.vstack([dynamics, sp.hstack([sp.csc_matrix((size_u, size_y)), sp.eye(size_u)]),
                      sp.hstack([sp.csc_matrix((size_u, size_y)), differences])]).tocsc()
    cost = sp.block_diag([sp.diags(2 * np.tile(q, n)),
                          2 * differences.T @ sp.diags(np.tile(lam, n)) @ differences]).tocsc()
    low = np.concatenate([np.zeros(size_y), np.tile(problem["u_min"], n),
                          np.tile(-np.array(problem["du_max_per_step"]), n)])
    high = np.concatenate([np.zeros(size_y), np.tile(problem["u_max"], n),
                           np.tile(problem["du_max_per_step"], n)])
    settings = {"eps_abs": 1e-3, "eps_rel": 1e-3, "max_iter": 400, "check_termination": 5, "polishing": False,
                "warm_starting": True, "adaptive_rho": False, "verbose": False}
    references = np.loadtxt(pathlib.Path(problem["reference"]), delimiter=",", skiprows=1)[:, 1:]

    def made(rho):
        solver = package.OSQP()
        solver.setup(sp.triu(cost).tocsc(), np.zeros(size_y + size_u), rows, low, high, rho=rho, **settings)
        return solver

    def iterations(rho):
        """Over the references with the linear model as the plant: the printed solver cannot adapt its rho."""
        solver, total = made(rho), 0
        us, ys = [np.zeros(n_u)] * len(by_u), [np.zeros(n_y)] * len(by_y)
        for k in range(0, len(references) - n - 1):
            lower, upper = low.copy(), high.copy()
            for j in range(n):
                free = constant + sum(by_y[l] @ ys[l - j] for l in range(j, len(by_y)))
                free = free + sum(by_u[l] @ us[l - j - 1] for l in range(j + 1, len(by_u)))
                lower[j * n_y:(j + 1) * n_y] = upper[j * n_y:(j + 1) * n_y] = free
            lower[size_y + size_u:size_y + size_u + n_u] += us[0]
            upper[size_y + size_u:size_y + size_u + n_u] += us[0]
            linear = np.concatenate([-2 * (q * references[k + 1:k + n + 1]).ravel(), -2 * lam * us[0],
                                     np.zeros(size_u - n_u)])
            solver.update(q=linear, l=lower, u=upper)
            found = solver.solve()
            total += found.info.iter
            us = [np.clip(found.x[size_y:size_y + n_u], us[0] - problem["du_max_per_step"],
                          us[0] + problem["du_max_per_step"])] + us[:-1]
            y = constant + sum(a @ v for a, v in zip(by_y, ys)) + sum(b @ v for b, v in zip(by_u, us))
            ys = [y] + ys[:-1]
        return total

    tried = {rho: iterations(rho) for rho in (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)}
    rho = min(tried, key=tried.get)
    made(rho).codegen(str(folder), parameters="vectors", use_float=True, force_rewrite=True)
    past_u, past_y = len(by_u), len(by_y)
    (folder / "glue.c").write_text(f"""/* The linear MPC's history and vectors around OSQP's printed solver. */
#include "osqp.h"
#include "workspace.h"

enum {{ N = {n}, NU = {n_u}, NY = {n_y}, PAST_U = {past_u}, PAST_Y = {past_y}, ROWS = N * (NY + 2 * NU) }};
{c_matrix("constant", constant)}{c_matrix("by_u", by_u)}{c_matrix("by_y", by_y)}{c_matrix("tracking", q)}{c_matrix("moves", lam)}
{c_matrix("low0", low)}{c_matrix("high0", high)}
static float us[PAST_U][NU], ys[PAST_Y][NY]; /* newest first; us[0] is u(k-1) */
static int started;
static OSQPFloat linear[N * (NY + NU)], low[ROWS], high[ROWS];

void peer_step(const float *y, const float *reference, float *u)
{{
    for (int l = PAST_Y - 1; l >= 0; l--)
        for (int r = 0; r < NY; r++)
            ys[l][r] = l == 0 || !started ? y[r] : ys[l - 1][r];
    started = 1;
    for (int i = 0; i < ROWS; i++) {{
        low[i] = low0[i];
        high[i] = high0[i];
    }}
    for (int j = 0; j < N; j++)
        for (int r = 0; r < NY; r++) {{
            float sum = constant[r];
            for (int l = j; l < PAST_Y; l++) /* y(k+j-l) is measured */
                for (int c = 0; c < NY; c++)
                    sum += by_y[(l * NY + r) * NY + c] * ys[l - j][c];
            for (int l = j + 1; l < PAST_U; l++) /* u(k+j-l) is applied */
                for (int c = 0; c < NU; c++)
                    sum += by_u[(l * NY + r) * NU + c] * us[l - j - 1][c];
            low[j * NY + r] = high[j * NY + r] = sum;
            linear[j * NY + r] = -2 * tracking[r] * reference[j * NY + r];
        }}
    for (int c = 0; c < NU; c++) {{
        linear[N * NY + c] = -2 * moves[c] * us[0][c];
        low[N * (NY + NU) + c] += us[0][c];
        high[N * (NY + NU) + c] += us[0][c];
    }}
    osqp_update_data_vec(&solver, linear, low, high);
    osqp_solve(&solver);
    for (int l = PAST_U - 1; l > 0; l--)
        for (int c = 0; c < NU; c++)
            us[l][c] = us[l - 1][c];
    for (int c = 0; c < NU; c++) {{
        /* The solver holds its limits to within its tolerance; the last word is exact. */
        float v = solver.solution->x[N * NY + c], d = v - us[0][c];
        float most = high0[N * (NY + NU) + c], top = high0[N * NY + c], bottom = low0[N * NY + c];
        v = d > most ? us[0][c] + most : d < -most ? us[0][c] - most : v;
        u[c] = us[0][c] = v > top ? top : v < bottom ? bottom : v;
    }}
}}
""")
    sources = [folder / "glue.c", folder / "workspace.c", *sorted((folder / "src").glob("*.c"))]
    includes = [folder, folder / "inc/public", folder / "inc/private"]
    compile_archive(folder, dict.fromkeys(sources, includes))
    return {"peer": "OSQP " + package.__version__, "rho": rho, "variables": size_y + size_u, "rows": rows.shape[0]}


def main():
    kind, network = sys.argv[1], json.load(open(sys.argv[2]))
    folder = pathlib.Path(sys.argv[-1])
    folder.mkdir(parents=True, exist_ok=True)
    if kind == "emlearn":
        print(json.dumps(emlearn(network, folder)))
    else:
        problem = json.load(open(sys.argv[3]))
        problem["reference"] = pathlib.Path(sys.argv[3]).with_name("reference.csv")
        print(json.dumps(osqp(network, problem, int(sys.argv[4]), folder)))


if __name__ == "__main__":
    main()
