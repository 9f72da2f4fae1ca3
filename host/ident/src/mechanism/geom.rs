//! Masses of primitive shapes, uniformly filled, their middle at the origin.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::tree::Mass;

/// A shape with its sizes as MuJoCo has them: half lengths and radii, m; z is its long axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Radius.
    Sphere(f64),
    /// Half lengths.
    Box(f64, f64, f64),
    /// Half axes.
    Ellipsoid(f64, f64, f64),
    /// Radius, half length.
    Cylinder(f64, f64),
    /// Radius, half length of the cylinder between the caps.
    Capsule(f64, f64),
}

impl Shape {
    /// m^3.
    pub fn volume(self) -> f64 {
        match self {
            Self::Sphere(r) => 4.0 / 3.0 * PI * r.powi(3),
            Self::Box(x, y, z) => 8.0 * x * y * z,
            Self::Ellipsoid(x, y, z) => 4.0 / 3.0 * PI * x * y * z,
            Self::Cylinder(r, h) => PI * r * r * 2.0 * h,
            Self::Capsule(r, h) => PI * r * r * (2.0 * h + 4.0 / 3.0 * r),
        }
    }

    /// Mass and moments.
    pub fn filled(self, mass: f64) -> Mass {
        let box_like = |x: f64, y: f64, z: f64, part: f64| {
            let moments = Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y);
            moments * (mass * part)
        };
        let moments = match self {
            Self::Sphere(r) => Vector3::repeat(0.4 * mass * r * r),
            Self::Box(x, y, z) => box_like(x, y, z, 1.0 / 3.0),
            Self::Ellipsoid(x, y, z) => box_like(x, y, z, 0.2),
            Self::Cylinder(r, h) => {
                let across = mass * (r * r / 4.0 + h * h / 3.0);
                Vector3::new(across, across, mass * r * r / 2.0)
            }
            Self::Capsule(r, h) => {
                // Cylinder and two half spheres, whose centres are 3/8 r beyond its ends.
                let ball = mass * (4.0 / 3.0 * r) / (2.0 * h + 4.0 / 3.0 * r);
                let tube = mass - ball;
                let across = tube * (r * r / 4.0 + h * h / 3.0)
                    + ball * (0.4 * r * r + h * h + 0.75 * h * r);
                Vector3::new(across, across, tube * r * r / 2.0 + 0.4 * ball * r * r)
            }
        };
        Mass {
            mass,
            centre: Vector3::zeros(),
            moments: Matrix3::from_diagonal(&moments),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over a grid of points inside.
    fn summed(inside: impl Fn(Vector3<f64>) -> bool) -> (f64, [f64; 3]) {
        let (half, count) = (0.6, 120);
        let step = 2.0 * half / f64::from(count);
        let middle_of = |k: i32| -half + (f64::from(k) + 0.5) * step;
        let (mut volume, mut squares) = (0.0, Vector3::zeros());
        for i in 0..count {
            for j in 0..count {
                for k in 0..count {
                    let p = Vector3::new(middle_of(i), middle_of(j), middle_of(k));
                    if inside(p) {
                        volume += step.powi(3);
                        squares += p.component_mul(&p) * step.powi(3);
                    }
                }
            }
        }
        let [x, y, z] = [squares.x, squares.y, squares.z].map(|s| s / volume);
        (volume, [y + z, x + z, x + y])
    }

    #[test]
    fn masses_of_shapes_are_those_of_a_sum_over_their_points() {
        let round = |x: f64, y: f64| x.hypot(y);
        let inside = |shape: Shape, p: Vector3<f64>| match shape {
            Shape::Sphere(r) => p.norm() < r,
            Shape::Box(x, y, z) => p.x.abs() < x && p.y.abs() < y && p.z.abs() < z,
            Shape::Ellipsoid(x, y, z) => p.component_div(&Vector3::new(x, y, z)).norm() < 1.0,
            Shape::Cylinder(r, h) => round(p.x, p.y) < r && p.z.abs() < h,
            Shape::Capsule(r, h) => Vector3::new(p.x, p.y, (p.z.abs() - h).max(0.0)).norm() < r,
        };
        for shape in [
            Shape::Sphere(0.5),
            Shape::Box(0.5, 0.3, 0.2),
            Shape::Ellipsoid(0.5, 0.3, 0.4),
            Shape::Cylinder(0.3, 0.5),
            Shape::Capsule(0.25, 0.3),
        ] {
            let (volume, moments) = summed(|p| inside(shape, p));
            let filled = shape.filled(1.0);
            assert!((shape.volume() / volume - 1.0).abs() < 0.01, "{shape:?}");
            for (axis, expected) in moments.into_iter().enumerate() {
                let found = filled.moments[(axis, axis)];
                assert!(
                    (found / expected - 1.0).abs() < 0.01,
                    "{shape:?}, axis {axis}"
                );
            }
        }
    }
}
