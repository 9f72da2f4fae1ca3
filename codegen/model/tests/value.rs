//! The cost-to-go of a model: against the least cost of a long horizon, and its place in the files.

mod support;

use sinew_model::emit::{EmitOptions, emit};
use sinew_model::spec::{Activation, Dense, Layer, ModelSpec, OutputForm, ValueSpec};
use sinew_model::{evaluate, fingerprint, reference, store, value};

/// Steps of the long horizon, behind those of the reference ahead.
const LONG: usize = 80;

/// The same numbers in every run, -1 to 1.
struct Random(u64);

impl Random {
    fn signed(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1 << 23) - 1.0
    }
}

/// Two coupled outputs with two inputs, linear, stable, offset from zero.
fn linear() -> ModelSpec {
    let rows = [
        vec![0.2, 0.05, 0.1, 0.0, -0.02, 0.0, -0.3, 0.04, 0.1, 0.02],
        vec![-0.03, 0.3, 0.02, 0.1, 0.0, 0.05, 0.05, -0.2, -0.03, 0.05],
    ];
    let mut control = support::control(2, 2);
    control.horizon = 1;
    control.control_horizon = 1;
    control.tracking_weight = vec![1.0, 0.4];
    control.move_suppression = vec![0.05, 0.2];
    control.value = Some(ValueSpec {
        rows: 2,
        ahead: 4,
        points: vec![vec![0.3, -0.1]],
    });
    ModelSpec {
        name: "linear".into(),
        period_s: 0.01,
        inputs: ["u1", "u2"]
            .map(|name| support::signal(name, "1", 1.0, 0.0))
            .to_vec(),
        outputs: ["y1", "y2"]
            .map(|name| support::signal(name, "1", 1.0, 0.0))
            .to_vec(),
        channels: vec![],
        past_inputs: 3,
        past_outputs: 2,
        form: OutputForm::Increment,
        state: None,
        skip: None,
        layers: vec![Layer::Dense(
            Dense::from_rows(&rows, vec![0.02, -0.01], Activation::Linear).expect("rows of ten"),
        )],
        control,
        soft_sensor: None,
        golden: vec![],
    }
}

/// Commands and outputs so far, the newest first.
#[derive(Clone)]
struct Past {
    u: Vec<Vec<f64>>,
    y: Vec<Vec<f64>>,
}

impl Past {
    fn advance(&mut self, spec: &ModelSpec, u: &[f64], d: &[f64]) {
        self.u.insert(0, u.to_vec());
        self.u.truncate(spec.past_inputs);
        let x: Vec<f64> = self.u.iter().chain(&self.y).flatten().copied().collect();
        let y = evaluate::predict(spec, &x);
        self.y
            .insert(0, y.iter().zip(d).map(|(y, d)| y + d).collect());
        self.y.truncate(spec.past_outputs);
    }
}

/// Residuals of every step after the first, with these commands.
fn residuals(
    spec: &ModelSpec,
    start: &Past,
    commands: &[f64],
    d: &[f64],
    reference: &[Vec<f64>],
) -> Vec<f64> {
    let (mut past, control) = (start.clone(), &spec.control);
    let mut residuals = Vec::new();
    for (j, u) in commands.chunks(2).enumerate() {
        for (c, lambda) in control.move_suppression.iter().enumerate() {
            residuals.push(lambda.sqrt() * (u[c] - past.u[0][c]));
        }
        past.advance(spec, u, d);
        let r = reference.get(j + 1).or(reference.last()).expect("rows");
        for (c, q) in control.tracking_weight.iter().enumerate() {
            residuals.push(q.sqrt() * (past.y[0][c] - r[c]));
        }
    }
    residuals
}

/// Least sum of squares of residuals that are affine in `n` unknowns.
fn least(n: usize, residuals: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let at = residuals(&vec![0.0; n]);
    let column = |i: usize| -> Vec<f64> {
        let mut unit = vec![0.0; n];
        unit[i] = 1.0;
        residuals(&unit)
            .iter()
            .zip(&at)
            .map(|(r, a)| r - a)
            .collect()
    };
    let columns: Vec<Vec<f64>> = (0..n).map(column).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut h: Vec<Vec<f64>> = columns
        .iter()
        .map(|a| columns.iter().map(|b| dot(a, b)).collect())
        .collect();
    let mut g: Vec<f64> = columns.iter().map(|a| -dot(a, &at)).collect();
    for i in 0..n {
        for row in i + 1..n {
            let factor = h[row][i] / h[i][i];
            let pivot = h[i].clone();
            for (x, of_pivot) in h[row].iter_mut().zip(&pivot) {
                *x -= factor * of_pivot;
            }
            g[row] -= factor * g[i];
        }
    }
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| h[i][k] * x[k]).sum();
        x[i] = (g[i] - known) / h[i][i];
    }
    residuals(&x).iter().map(|r| r * r).sum()
}

/// `|W z|^2` at the end of a horizon of one.
fn of_rows(value: &value::ValueRows, past: &Past, d: &[f64], reference: &[Vec<f64>]) -> f64 {
    let dot = |w: &[f64], x: &[f64]| w.iter().zip(x).map(|(w, x)| w * x).sum::<f64>();
    let point = &value.points[0];
    (0..point.offset.len())
        .map(|r| {
            let mut sum = point.offset[r];
            for (rows, u) in point.u.iter().zip(&past.u) {
                sum += dot(&rows[r], u);
            }
            for (rows, y) in point.y.iter().zip(&past.y) {
                sum += dot(&rows[r], y);
            }
            for (column, d) in point.disturbance.iter().zip(d) {
                sum += column[r] * d;
            }
            for (rows, reference) in point.reference.iter().zip(reference) {
                sum += dot(&rows[r], reference);
            }
            sum * sum
        })
        .sum()
}

#[test]
fn rows_of_a_linear_model_are_the_least_cost_of_a_long_horizon() {
    let spec = linear();
    spec.validate().expect("valid");
    let rows = value::rows(&spec).expect("a value");
    let mut random = Random(3);
    for case in 0..3 {
        let mut vector = |n: usize| (0..n).map(|_| random.signed()).collect::<Vec<f64>>();
        let start = Past {
            u: (0..3).map(|_| vector(2)).collect(),
            y: (0..2).map(|_| vector(2)).collect(),
        };
        let d: Vec<f64> = vector(2).iter().map(|d| 0.05 * d).collect();
        // r(k+1), the end of the horizon, and the rows ahead of it.
        let reference: Vec<Vec<f64>> = (0..5).map(|_| vector(2)).collect();
        let costs: Vec<[f64; 2]> = (0..4)
            .map(|_| {
                let mut past = start.clone();
                past.advance(&spec, &vector(2), &d);
                let to_go = |commands: &[f64]| residuals(&spec, &past, commands, &d, &reference);
                [
                    least(2 * LONG, to_go),
                    of_rows(&rows, &past, &d, &reference),
                ]
            })
            .collect();
        // Equal but for a constant that no command changes.
        let [exact, found] = costs[0];
        for [other_exact, other_found] in &costs[1..] {
            let (exact, found) = (other_exact - exact, other_found - found);
            assert!(
                exact.abs() > 1e-3,
                "case {case}: the commands make no difference"
            );
            assert!(
                (exact - found).abs() < 1e-6 * (1.0 + exact.abs()),
                "case {case}: {exact}, {found}"
            );
        }
    }
}

#[test]
fn a_weight_of_commands_is_in_the_cost_to_go_from_the_command_of_rest() {
    let mut spec = linear();
    // At rest at zero without a command.
    if let Layer::Dense(dense) = &mut spec.layers[0] {
        dense.bias = vec![0.0; 2];
    }
    spec.control.command_weight = 0.3;
    spec.control
        .value
        .as_mut()
        .expect("the specification has a cost-to-go")
        .points = vec![vec![0.0, 0.0]];
    spec.validate().expect("valid");
    let rows = value::rows(&spec).expect("a value");
    let mut random = Random(5);
    let mut vector = |n: usize| (0..n).map(|_| random.signed()).collect::<Vec<f64>>();
    let start = Past {
        u: (0..3).map(|_| vector(2)).collect(),
        y: (0..2).map(|_| vector(2)).collect(),
    };
    let (d, reference) = (vec![0.0; 2], (0..5).map(|_| vector(2)).collect::<Vec<_>>());
    let mut costs = |weight: f64| -> [f64; 2] {
        let mut of = || {
            let mut past = start.clone();
            past.advance(&spec, &vector(2), &d);
            let to_go = |commands: &[f64]| {
                let mut all = residuals(&spec, &past, commands, &d, &reference);
                all.extend(commands.iter().map(|u| weight.sqrt() * u));
                all
            };
            (
                least(2 * LONG, to_go),
                of_rows(&rows, &past, &d, &reference),
            )
        };
        let ((one, of_one), (two, of_two)) = (of(), of());
        [two - one, of_two - of_one]
    };
    let [exact, found] = costs(0.3);
    assert!(
        (exact - found).abs() < 1e-5 * (1.0 + exact.abs()),
        "{exact}, {found}"
    );
    let [other, found] = costs(0.0);
    assert!((other - found).abs() > 1e-3, "the weight changes nothing");
}

/// Network S at a horizon of one, with a value at points along its reference.
fn of_reference(points: usize) -> ModelSpec {
    let read = |file: &str| {
        std::fs::read_to_string(format!("../../models/reference/{file}")).expect("committed")
    };
    let mut spec = reference::import(&read("S.json"), &read("problem.json"), 1, &[]).expect("S");
    let motions = reference::motions(&read("reference.csv")).expect("rows of numbers");
    spec.control.value = Some(ValueSpec {
        rows: 2,
        ahead: 8,
        points: value::along(&motions, points),
    });
    spec
}

#[test]
fn the_rows_of_neighbouring_points_are_near_each_other() {
    let spec = of_reference(5);
    spec.validate().expect("valid");
    let rows = value::rows(&spec).expect("a value");
    assert_eq!(rows.points.len(), 5);
    let length: f64 = rows.direction.iter().map(|d| d * d).sum();
    assert!((length - 1.0).abs() < 1e-12);
    let flat = |p: &value::PointRows| -> Vec<f64> {
        let history = p.u.iter().chain(&p.y).flatten().flatten();
        history.copied().collect()
    };
    for pair in rows.points.windows(2) {
        let (a, b) = (flat(&pair[0]), flat(&pair[1]));
        let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let apart = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(
            apart > 1e-6 * size && apart < 0.5 * size,
            "{apart} of {size}"
        );
        assert!(pair[0].at < pair[1].at);
    }
}

#[test]
fn files_hold_a_value_and_models_without_one_are_what_they_were() {
    let with = of_reference(3);
    let folder = tempfile::tempdir().expect("a folder");
    store::save(folder.path(), &with).expect("saved");
    let again = store::load(folder.path()).expect("loaded");
    assert_eq!(again.control, with.control);
    let mut without = with.clone();
    without.control.value = None;
    assert_ne!(fingerprint(&with), fingerprint(&without));
    let files = |spec: &ModelSpec| emit(spec, &EmitOptions::default()).expect("printed");
    let text = |spec: &ModelSpec, path: &str| {
        let files = files(spec);
        let file = files.iter().find(|file| file.path == path);
        file.map(|file| file.text.clone())
    };
    assert_eq!(text(&without, "src/value.rs"), None);
    let control = text(&with, "src/control.rs").expect("always there");
    assert!(
        control.contains("pub const HORIZON: usize = 9;"),
        "{control}"
    );
    assert!(
        control.contains("pub const PREDICTED: usize = 1;"),
        "{control}"
    );
    assert!(text(&with, "src/value.rs").is_some_and(|value| value.contains("; 3] = [")));
}

#[test]
fn what_cannot_have_a_value_is_refused_with_a_reason() {
    let refused = |change: &dyn Fn(&mut ModelSpec)| {
        let mut spec = of_reference(3);
        change(&mut spec);
        spec.validate().expect_err("not valid").to_string()
    };
    fn value(spec: &mut ModelSpec) -> &mut ValueSpec {
        spec.control
            .value
            .as_mut()
            .expect("the specification has a cost-to-go")
    }
    let rows = refused(&|spec| value(spec).rows = 4);
    assert!(
        rows.contains("control.value.rows") && rows.contains("1 to 3"),
        "{rows}"
    );
    let turned = refused(&|spec| value(spec).points.swap(0, 1));
    assert!(
        turned.contains("each further than the one before"),
        "{turned}"
    );
    let short = refused(&|spec| value(spec).points[1] = vec![0.0]);
    assert!(short.contains("control.value.points.1"), "{short}");
    let none = refused(&|spec| value(spec).points.clear());
    assert!(none.contains("1 to 9 points"), "{none}");
}
