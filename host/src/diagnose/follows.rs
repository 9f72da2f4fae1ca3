//! What a recovered force follows (docs/diagnosis.md, eq. 16).

use nalgebra::{DMatrix, DVector};

/// Columns that a force may follow, one entry a row.
pub(super) struct Company<'a> {
    pub t: &'a [f64],
    pub force: &'a [f64],
    pub deviation: &'a [f64],
    pub position: &'a [f64],
    pub velocity: &'a [f64],
    pub input: Option<&'a [f64]>,
}

/// Less than this part of the force's variance is not following.
const LITTLE: f64 = 0.3;

/// A plainer law wins unless another explains this much more of the variance.
const PLAINER: f64 = 0.03;

/// The quantity that explains most of a force beyond a straight line in position and velocity, which the
/// refitted parameters have taken already; and the part of the variance that it explains.
pub(super) fn follows(company: &Company) -> (&'static str, f64) {
    let (q, v) = (company.position, company.velocity);
    let most = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (reach, speed) = (most(q).max(1e-300), most(v).max(1e-300));
    let over = |f: &dyn Fn(usize) -> f64| (0..q.len()).map(f).collect::<Vec<f64>>();
    // Sign as far as the speed is known: a tenth of the largest is moving for sure.
    let sign = |v: f64| (v / (0.02 * speed)).clamp(-1.0, 1.0);
    let mut laws: Vec<(&'static str, Vec<f64>)> = vec![
        ("position", over(&|k| q[k])),
        ("velocity", over(&|k| v[k])),
        ("sign of velocity", over(&|k| sign(v[k]))),
        ("velocity times its magnitude", over(&|k| v[k] * v[k].abs())),
        ("square of position", over(&|k| q[k] * q[k])),
        ("cube of position", over(&|k| q[k].powi(3))),
        ("position times velocity", over(&|k| q[k] * v[k])),
        ("position near its ends", over(&|k| (q[k] / reach).powi(9))),
        ("time", over(&|k| company.t[k])),
    ];
    if let Some(u) = company.input {
        let largest = most(u).max(1e-300);
        laws.push(("input", over(&|k| u[k])));
        laws.push(("curve of the input", over(&|k| u[k] * u[k].abs())));
        laws.push((
            "load times sign of velocity",
            over(&|k| u[k].abs() * sign(v[k])),
        ));
        laws.push((
            "change of the input",
            over(&|k| (u[k] - u[k.saturating_sub(1)]) / largest),
        ));
    }
    let mut best = ("no quantity that was recorded", 0.0);
    for (name, column) in &laws {
        let explained = explained(company, column);
        if explained > best.1 + PLAINER && explained > LITTLE {
            best = (name, explained);
        }
    }
    best
}

/// Part of the force's variance that a straight line in position, velocity and one more column explains,
/// rows weighted by how well the force is known there.
fn explained(company: &Company, column: &[f64]) -> f64 {
    let rows = company.force.len();
    let floor = company
        .deviation
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min)
        .max(1e-300);
    let weight = |row: usize| (floor / company.deviation[row].max(floor)).powi(2);
    let mut normal = DMatrix::<f64>::zeros(2, 2);
    let mut right = DVector::<f64>::zeros(2);
    let (mut total, mut sum, mut count) = (0.0, 0.0, 0.0);
    let scale = column
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()))
        .max(1e-300);
    for row in 0..rows {
        let x = DVector::from_vec(vec![1.0, column[row] / scale]);
        let w = weight(row);
        normal += &x * x.transpose() * w;
        right += &x * (w * company.force[row]);
        total += w * company.force[row].powi(2);
        sum += w * company.force[row];
        count += w;
    }
    let variance = total - sum * sum / count;
    let Some(factor) = normal.cholesky() else {
        return 0.0;
    };
    let left = total - right.dot(&factor.solve(&right));
    if variance > 0.0 {
        (1.0 - left / variance).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dry_friction_follows_the_sign_of_velocity_and_drag_its_square() {
        let t: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let q: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        let v: Vec<f64> = t.iter().map(|t| 3.0 * (3.0 * t).cos()).collect();
        let deviation = vec![1.0; 400];
        let of = |law: &dyn Fn(f64) -> f64| {
            let force: Vec<f64> = v.iter().map(|v| law(*v)).collect();
            let company = Company {
                t: &t,
                force: &force,
                deviation: &deviation,
                position: &q,
                velocity: &v,
                input: None,
            };
            follows(&company).0
        };
        assert_eq!(of(&|v| -v.signum()), "sign of velocity");
        assert_eq!(of(&|v| -v * v.abs()), "velocity times its magnitude");
        assert_eq!(of(&|v| -v), "velocity");
    }
}
