//! Learned laws of springs and dampers as the polynomials that MuJoCo takes.

use nalgebra::{DMatrix, DVector};
use sinew_sim::rig::{AppliedLaw, Rig};
use sinew_sim::{LawKind, LawShape};

/// Places at which polynomial and law are compared, on each side of rest.
const PLACES: usize = 64;

/// Largest difference over the largest force at which a polynomial is the law itself.
const EXACT: f64 = 1e-6;

/// A polynomial for a law, and what MuJoCo loses by it.
pub(super) struct Polynomial {
    /// Linear, quadratic and cubic coefficient of a spring; linear and quadratic (over the
    /// magnitude) of a damper.
    pub coefficients: [f64; 3],
    /// A line where the polynomial is not the law.
    pub left_out: Option<String>,
}

/// The polynomial of a law at a component by least squares over all that the law was learned from.
pub(super) fn polynomial(rig: &Rig, component: &str, applied: &AppliedLaw) -> Polynomial {
    let law = &rig.laws[applied.law];
    let shape = LawShape {
        length: applied.length,
        width: applied.width,
        ..law.shape()
    };
    let values = law.values();
    let reach = law.reach * applied.length;
    let force = |share: f64| shape.resistance(&values, share * reach);
    let basis = |share: f64| match (law.kind, law.odd) {
        (LawKind::Spring, true) => [share, 0.0, share.powi(3)],
        (LawKind::Spring, false) => [share, share * share, share.powi(3)],
        (LawKind::Damper, _) => [share, share * share.abs(), 0.0],
    };
    let shares: Vec<f64> = (0..=2 * PLACES)
        .map(|k| k as f64 / PLACES as f64 - 1.0)
        .collect();
    let rows = DMatrix::from_fn(shares.len(), 3, |row, column| basis(shares[row])[column]);
    let right = DVector::from_iterator(shares.len(), shares.iter().map(|&share| force(share)));
    let solved = rows.clone().svd(true, true).solve(&right, 1e-12);
    // A matrix of finite numbers has a decomposition.
    let solved = solved.unwrap_or_else(|_| DVector::zeros(3));
    let largest = right.amax();
    let off = (&rows * &solved - &right).amax();
    let coefficients = [0, 1, 2].map(|k| solved[k] / reach.powi(k as i32 + 1));
    let rises = values.last() >= values.get(values.len().saturating_sub(2));
    let left_out = (off > EXACT * largest || !rises).then(|| {
        format!(
            "learned law of {component}: a polynomial stands for it, off by up to {:.2} % of its \
             largest force within {reach:.4} and not to be used beyond",
            100.0 * off / largest.max(f64::MIN_POSITIVE)
        )
    });
    Polynomial {
        coefficients,
        left_out,
    }
}

/// Lines about every law whose polynomial is not the law itself.
pub(super) fn left_out(rig: &Rig) -> Vec<String> {
    let springs = rig.springs.iter().map(|spring| (&spring.name, &spring.law));
    let dampers = rig.dampers.iter().map(|damper| (&damper.name, &damper.law));
    let lines = springs.chain(dampers).filter_map(|(name, applied)| {
        let applied = applied.as_ref()?;
        polynomial(rig, name, applied).left_out
    });
    lines.collect()
}
