//! The controller's part of the summary as a page of tables, each figure beside its goal and other
//! people's.

use serde_json::{Map, Value};

/// The page `docs/evaluation/benchmarks.md`; `None` where no section of the controller has been
/// measured.
pub fn of_the_controller(summary: &Map<String, Value>) -> Option<String> {
    summary.get("mpc_instructions").or(summary.get("image"))?;
    let figures = Figures(summary);
    let mut page = String::new();
    figures.forward(&mut page);
    figures.steps(&mut page);
    figures.linear_mpc(&mut page);
    figures.terminal_values(&mut page);
    figures.budgets(&mut page);
    figures.memory(&mut page);
    figures.times(&mut page);
    Some(page)
}

/// Figures of the summary as text.
struct Figures<'a>(&'a Map<String, Value>);

impl Figures<'_> {
    fn at(&self, path: &str) -> Option<&Value> {
        summary_at(self.0, path)
    }

    fn count(&self, path: &str) -> String {
        self.at(path)
            .and_then(Value::as_u64)
            .map_or(absent(), grouped)
    }

    fn percent(&self, path: &str) -> String {
        let value = self.at(path).and_then(Value::as_f64);
        value.map_or(absent(), |part| format!("{:.2} %", 100.0 * part))
    }

    fn rms(&self, path: &str) -> String {
        let value = self.at(path).and_then(Value::as_f64);
        value.map_or(absent(), |rms| format!("{rms:.4}"))
    }

    fn name(&self, path: &str) -> &str {
        self.at(path)
            .and_then(Value::as_str)
            .unwrap_or("not measured")
    }

    /// Networks alone, beside printed C.
    fn forward(&self, page: &mut String) {
        page.push_str(HEAD);
        page.push_str(&row(&[
            "network",
            "sinew",
            "goal",
            self.name("peers/forward/S/peer"),
            "onnx2c, quoted",
        ]));
        page.push_str(&rule(5));
        for (network, shape, goal, quoted) in FORWARD {
            page.push_str(&row(&[
                shape,
                &self.count(&format!("forward_instructions/{network}")),
                goal,
                &self.count(&format!("peers/forward/{network}/instructions")),
                quoted,
            ]));
        }
    }

    /// Control steps.
    fn steps(&self, page: &mut String) {
        page.push_str(STEP);
        page.push_str(&row(&[
            "problem",
            "mean",
            "largest",
            "goal",
            "stack, B",
            "J over IPOPT's",
            "worst step",
            "tracking",
            "IPOPT's",
            "another's, quoted: largest",
        ]));
        page.push_str(&rule(10));
        for (case, problem, goal, quoted) in PROBLEMS {
            let of = |key: &str| format!("mpc_instructions/{case}/{key}");
            page.push_str(&row(&[
                problem,
                &self.count(&of("mean")),
                &self.count(&of("max")),
                goal,
                &self.count(&of("stack_bytes")),
                &self.percent(&of("cost_over_optimum")),
                &self.percent(&of("largest_step_over_optimum")),
                &self.rms(&of("tracking_rms")),
                &self.rms(&of("tracking_rms_of_ipopt")),
                quoted,
            ]));
        }
    }

    /// A linear MPC on the same problems.
    fn linear_mpc(&self, page: &mut String) {
        page.push_str(&format!(
            "\n{}, a linear MPC on the network linearised at rest, every command free, printed by its code generator and counted \
             in the same way (tolerance 1e-3, at most 400 iterations, the best of six rho):\n\n",
            self.name("peers/mpc/S_N10/peer")
        ));
        page.push_str(&row(&[
            "problem", "mean", "largest", "tracking", "flash, B", "RAM, B",
        ]));
        page.push_str(&rule(6));
        for (case, problem, ..) in PROBLEMS.iter().filter(|p| matches!(p.0, "S_N5" | "S_N10")) {
            let of = |key: &str| format!("peers/mpc/{case}/{key}");
            page.push_str(&row(&[
                problem,
                &self.count(&of("mean")),
                &self.count(&of("max")),
                &self.rms(&of("tracking_rms")),
                &self.count(&of("flash_bytes")),
                &self.count(&of("ram_bytes")),
            ]));
        }
    }

    /// Short horizons with a cost-to-go.
    fn terminal_values(&self, page: &mut String) {
        page.push_str(TERMINAL_VALUE);
        for (case, horizon, value) in VALUES {
            let of = |key: &str| format!("terminal_value/{case}/{key}");
            page.push_str(&row(&[
                horizon,
                value,
                &self.count(&of("mean")),
                &self.count(&of("max")),
                &self.rms(&of("tracking_rms")),
                &self.count(&of("image_flash_bytes")),
                &self.count(&of("image_static_bytes")),
                &self.count(&of("stack_bytes")),
            ]));
        }
    }

    /// Steps with a budget.
    fn budgets(&self, page: &mut String) {
        page.push_str(BUDGET);
        for (network, problem) in [("S", "S, N = 10"), ("L", "L, N = 10")] {
            for (share, budget) in BUDGETS {
                let of = |key: &str| format!("budget/{network}_{share}/{key}");
                page.push_str(&row(&[
                    problem,
                    budget,
                    &self.count(&of("budget")),
                    &self.count(&of("mean")),
                    &self.count(&of("max")),
                    &self.count(&of("stopped")),
                    &self.rms(&of("tracking_rms")),
                ]));
            }
        }
    }

    /// Flash and RAM.
    fn memory(&self, page: &mut String) {
        page.push_str(BUDGET_REMARK);
        page.push_str(MEMORY);
        for (what, flash, ram, goal) in [
            (
                "control step",
                "image/flash_bytes",
                "image/ram_bytes",
                "16,000 and 8,000",
            ),
            (
                "whole counting image",
                "image/whole_flash_bytes",
                "image/whole_ram_bytes",
                "",
            ),
        ] {
            page.push_str(&row(&[what, &self.count(flash), &self.count(ram), goal]));
        }
        let flash = self.at("image/flash_bytes").and_then(Value::as_u64);
        if let Some(over) = flash.and_then(|flash| flash.checked_sub(16_000))
            && over > 0
        {
            page.push_str(&format!(
                "\nFlash misses its goal by {} bytes ([0018](../lab/0018-size-of-the-control-step.md)).\n",
                grouped(over)
            ));
        }
    }

    /// Estimated times.
    fn times(&self, page: &mut String) {
        page.push_str(TIME);
        for (case, problem, ..) in PROBLEMS {
            let of = |mhz: &str| {
                let path = format!("mpc_instructions/{case}/step_us_estimated/{mhz} MHz");
                let us = self.at(&path).and_then(Value::as_f64);
                us.map_or(absent(), |us| grouped(us as u64))
            };
            page.push_str(&row(&[problem, &of("84"), &of("100"), &of("168")]));
        }
    }
}

/// Network, its shape, goal, and what onnx2c took.
const FORWARD: &[(&str, &str, &str, &str)] = &[
    ("S", "S: 12-10(tanh)-3", "700", "1,343"),
    ("L", "L: 20-32-32-3, tanh", "6,500", "15,351"),
    ("P", "P: 26-8(relu)-3(tanh)", "750", "1,494"),
];

/// Name in the summary, problem, goal, and what another controller took on the same shapes.
const PROBLEMS: &[(&str, &str, &str, &str)] = &[
    (
        "S_N1",
        "S, N = 1",
        "6,000",
        "the published code: 169,874 and 109 mallocs",
    ),
    ("S_N5", "S, N = 5", "28,000", "GRAMPC 2.3: 70,336"),
    (
        "S_N10",
        "S, N = 10",
        "60,000",
        "GRAMPC 2.3: 138,139, 65 kB flash",
    ),
    ("P_N10", "P, N = 10", "", ""),
    ("L_N10", "L, N = 10", "", ""),
];

/// Name in the summary, horizon, and the cost-to-go at its end.
const VALUES: &[(&str, &str, &str)] = &[
    ("N1", "1", "none"),
    ("N3", "3, moves of 1 and 2 steps", "none"),
    ("N5", "5, moves of 2 steps", "none"),
    ("N10", "10, moves of 2, 2, 3, 3", "none"),
    ("N1_one_row", "1", "1 row, 5 points"),
    ("N1_one_point", "1", "2 rows, 1 point"),
    ("N1_value", "1", "2 rows, 5 points"),
    ("N2_value", "2, one move", "2 rows, 5 points"),
    ("N3_value", "3, one move", "2 rows, 5 points"),
    (
        "N3_value_two_moves",
        "3, moves of 1 and 2 steps",
        "2 rows, 5 points",
    ),
];

/// Name in the summary, and share of the longest step without a budget.
const BUDGETS: &[(&str, &str)] = &[
    ("none", "none"),
    ("100", "100 %"),
    ("75", "75 %"),
    ("50", "50 %"),
    ("25", "25 %"),
];

const HEAD: &str = "# Speed, size and quality of the control step

This page is written by `cargo xtask bench SECTIONS --publish`, with the sections
`forward_instructions mpc_instructions terminal_value budget image peers`. The command takes
minutes, most of them IPOPT's. It measures every figure except those headed *quoted*, which were
measured elsewhere on the same shapes, and *goal*. Instructions are counted exactly on QEMU's
Cortex-M4F (mps2-an386). They are the same in every run of the same compiler. The reference problem
is that of `models/reference`, with 590 control steps of its closed loop.

## One prediction: instructions, largest over the golden vectors

The peer is compiled by clang (`ziglang`, from PyPI) at -O2, its expm1f is musl's.

";

const STEP: &str = "
## One control step: instructions

Estimator, optimisation and limits together, at most 2 iterations.

- *J over IPOPT's*: the cost of the controller's plan, summed over the run, against the optimum by
  IPOPT (CasADi) in double precision from the same states, without blocking and from several
  starts. The goal is 1 %.
- *Tracking*: RMS error of the plant's outputs, beside a loop closed with IPOPT's own commands.
- P and L run the problem of S with other networks. P holds its eleven channels over the horizon, so
  its tracking says nothing about a realistic controller.

";

const TERMINAL_VALUE: &str = "
## Cost-to-go at the end of the horizon: S

Rows of a cost-to-go stand for the steps after the horizon
([0091](../decisions/0091-cost-to-go.md)), with four rows of the reference behind it. Network,
weights and limits are those of the table above. The aims: at N = 1 a tracking of 0.031 within
8,000 instructions, at N = 3 of 0.0275 within 16,000. Flash, statics and stack are those of the
whole counting image. This table alone comes from `cargo xtask bench terminal_value`.

| N | cost-to-go | mean | largest | tracking | flash, B | statics, B | stack, B |
|---|---|---|---|---|---|---|---|
";

const BUDGET: &str = "
## A budget of the optimisation

`budget` of `[control]` ends an optimisation with the best plan so far
([0110](../decisions/0110-budget-of-a-step.md)). Shares are those of the longest step without
one. A step has estimator, limits and the first evaluation of J beside what the budget may grant.
*Stopped*: of 590 steps. This table alone comes from `cargo xtask bench budget`.

| problem | share | budget | mean | largest | stopped | tracking |
|---|---|---|---|---|---|---|
";

const BUDGET_REMARK: &str = "
The counting image is built for size, and takes up to a third more instructions than a budget
counts. At 25 % no iteration fits, and the controller shifts its plan. A shorter horizon is the
answer there.
";

const MEMORY: &str = "
## Flash and RAM, S at N = 10, bytes

The step is the counting image less the same image without it; RAM is statics and stack.

| | flash | RAM | goal |
|---|---|---|---|
";

const TIME: &str = "
## Time of the largest step: an estimate, in microseconds

No board has run this: the estimate is instructions times 1.7 cycles, over the clock. The
Cortex-M4's reference manual has 2 cycles for a load or store, 1 for a multiplication or addition in
single precision, 14 for a division and 2 to 4 for a taken branch. `vldr, vldr, vmul, vadd`, the
step's commonest sequence, takes 6 cycles for 4 instructions; branches and divisions take the rest.
Flash without wait states is assumed, which needs the part's accelerator at 100 and 168 MHz. The
same step counts its own cycles on a board ([boards/step](../../boards/step/README.md)).

| | 84 MHz | 100 MHz | 168 MHz |
|---|---|---|---|
";

fn summary_at<'a>(summary: &'a Map<String, Value>, path: &str) -> Option<&'a Value> {
    let mut keys = path.split('/');
    let first = summary.get(keys.next()?)?;
    keys.try_fold(first, |value, key| value.get(key))
}

fn absent() -> String {
    "-".into()
}

fn row(cells: &[&str]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn rule(columns: usize) -> String {
    format!("|{}\n", "---|".repeat(columns))
}

/// 12345 as 12,345.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
