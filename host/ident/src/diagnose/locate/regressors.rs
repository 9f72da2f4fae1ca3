//! Selection of the quantity that a recovered force follows (docs/explanation/diagnosis.md, eq.
//! 16).

use crate::diagnose::config::CONFIG;
use nalgebra::{DMatrix, DVector};

/// Columns that a force may follow, one entry a row.
pub(crate) struct Company<'a> {
    pub t: &'a [f64],
    pub force: &'a [f64],
    pub deviation: &'a [f64],
    pub position: &'a [f64],
    pub velocity: &'a [f64],
    pub input: Option<&'a [f64]>,
}

/// The quantity that explains most of a force beyond a straight line in position and velocity,
/// which the refitted parameters have taken already; and the part of the variance that it explains.
pub(crate) fn follows(company: &Company) -> (&'static str, f64) {
    let (q, v) = (company.position, company.velocity);
    let most = |column: &[f64]| column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let (reach, speed) = (most(q).max(1e-300), most(v).max(1e-300));
    let over = |f: &dyn Fn(usize) -> f64| (0..q.len()).map(f).collect::<Vec<f64>>();
    // Sign as far as the speed is known: above a fiftieth of the largest it moves for sure.
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
    let ones = vec![1.0; q.len()];
    for (name, column) in &laws {
        // What a refitted stiffness and damping have taken from a law is given back to it.
        let beside: Vec<&[f64]> = if ["position", "velocity"].contains(name) {
            vec![&ones]
        } else {
            vec![&ones, q, v]
        };
        let explained = explained(company, &beside, column);
        if explained > best.1 + CONFIG.locate.plainer && explained > CONFIG.locate.little {
            best = (name, explained);
        }
    }
    best
}

/// Part of the squares that other columns leave which one more column explains, rows weighted by
/// how well the force is known there.
fn explained(company: &Company, beside: &[&[f64]], column: &[f64]) -> f64 {
    let without = left(company, beside);
    let with = left(company, &[beside, &[column]].concat());
    if without > 0.0 {
        (1.0 - with / without).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Weighted squares that a linear combination of columns leaves.
fn left(company: &Company, columns: &[&[f64]]) -> f64 {
    let rows = company.force.len();
    let least = company.deviation.iter().copied();
    let floor = least.fold(f64::INFINITY, f64::min).max(1e-300);
    let scales: Vec<f64> = columns
        .iter()
        .map(|column| column.iter().fold(1e-300, |most: f64, x| most.max(x.abs())))
        .collect();
    let mut normal = DMatrix::<f64>::identity(columns.len(), columns.len()) * 1e-12;
    let mut right = DVector::<f64>::zeros(columns.len());
    let mut total = 0.0;
    for row in 0..rows {
        let scaled = columns.iter().zip(&scales).map(|(c, scale)| c[row] / scale);
        let x = DVector::from_iterator(columns.len(), scaled);
        let w = (floor / company.deviation[row].max(floor)).powi(2);
        normal += &x * x.transpose() * w;
        right += &x * (w * company.force[row]);
        total += w * company.force[row].powi(2);
    }
    match normal.cholesky() {
        Some(factor) => (total - right.dot(&factor.solve(&right))).max(0.0),
        None => total,
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
