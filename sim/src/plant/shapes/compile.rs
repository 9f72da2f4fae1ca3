//! From the geometry of a rig to indices and slots.

use super::{
    ChainSlots, Course, Derived, LineSlots, MagnetSlots, PlateSlots, Role, Shapes, WaveguideSlots,
};
use crate::effects::Sign;
use crate::geometry::zip;
use crate::plant::slots::Slots;
use crate::plant::topology::Topology;
use crate::rig::{Rig, Route, Value};
use crate::unit::Motion;

/// The coordinates of a path whose arms are still to be found: body and arm.
type Arms = Vec<(usize, Derived)>;

/// The arms of a line, and where it runs.
fn arms(
    rig: &Rig,
    slots: &mut Slots,
    (line, role): (&str, Role),
    routes: &[Route],
    lines: &mut Vec<LineSlots>,
) -> Arms {
    let mut arms = Arms::new();
    let mut run = |course| {
        lines.push(LineSlots {
            name: line.to_owned(),
            role,
            course,
        });
    };
    for route in routes {
        match route {
            Route::Chain {
                chain: index,
                radius,
                angle,
                segments,
            } => {
                let chain = &rig.geometry.chains[*index];
                let mut add =
                    |key, unit, value| slots.add_as(&[line, key, &chain.name], unit, value);
                let radius = add("radius", "m", radius);
                let angle = add("angle", "rad", angle);
                run(Course::Chain(*index, radius, angle, *segments));
                for segment in 0..*segments {
                    let body = chain.first_body + 2 * segment;
                    arms.push((body, Derived::AboutX { radius, angle }));
                    arms.push((body + 1, Derived::AboutY { radius, angle }));
                }
            }
            Route::Plate { plate: index, x, y } => {
                let plate = &rig.geometry.plates[*index];
                let mut add = |key, value| slots.add_as(&[line, key, &plate.name], "m", value);
                let (x, y) = (add("x", x), add("y", y));
                run(Course::Plate(*index, x, y));
                arms.push((plate.first_body, Derived::One));
                arms.push((plate.first_body + 1, Derived::Same(y)));
                arms.push((plate.first_body + 2, Derived::Minus(x)));
            }
        }
    }
    arms
}

/// Slots of the arms at bodies that a path names itself.
fn own_arms(
    rig: &Rig,
    slots: &mut Slots,
    line: &str,
    path: &[(usize, Value)],
) -> Vec<(usize, usize)> {
    let slot = |(body, arm): &(usize, Value)| {
        let at = &rig.bodies[*body];
        let unit = match at.motion {
            Motion::Slide => "1",
            Motion::Hinge => "m",
        };
        (*body, slots.add_as(&[line, "arm", &at.name], unit, arm))
    };
    path.iter().map(slot).collect()
}

/// Part of segment `k` of `segments` that the span covers.
fn cover(k: usize, segments: usize, [from, to]: [f64; 2]) -> f64 {
    let n = segments as f64;
    let (near, far) = (k as f64, (k + 1) as f64);
    (far.min(to * n) - near.max(from * n)).max(0.0)
}

/// Adds the geometry to a topology that has everything else; the last to add slots, since what is
/// derived stands behind all parameters.
pub(in crate::plant) fn add(rig: &Rig, slots: &mut Slots, topology: &mut Topology) {
    let geometry = &rig.geometry;
    let mut shapes = Shapes::default();
    for chain in &geometry.chains {
        shapes.chains.push(ChainSlots {
            name: chain.name.clone(),
            first_body: chain.first_body,
            segments: chain.segments,
            length: slots.add_signed(&[&chain.name, "length"], "m", Sign::Positive, &chain.length),
        });
    }
    for plate in &geometry.plates {
        shapes.plates.push(PlateSlots {
            name: plate.name.clone(),
            first_body: plate.first_body,
            height: slots.add_as(&[&plate.name, "height"], "m", &plate.height),
            tip: slots.add_as(&[&plate.name, "tip"], "m", &plate.tip),
        });
    }
    for fibre in &geometry.waveguides {
        let segments = geometry.chains[fibre.chain].segments;
        let name = fibre.name.as_str();
        let radius = &fibre.radius;
        shapes.waveguides.push(WaveguideSlots {
            name: fibre.name.clone(),
            span: fibre.span,
            chain: fibre.chain,
            radius: slots.add_signed(&[name, "radius"], "m", Sign::Positive, radius),
            angle: slots.add_as(&[name, "angle"], "rad", &fibre.angle),
            loss: slots.add_as(&[name, "loss"], "1", &fibre.loss),
            cover: (0..segments)
                .map(|k| cover(k, segments, fibre.span))
                .collect(),
            part: fibre.span[1] - fibre.span[0],
        });
    }
    for magnet in &geometry.magnets {
        shapes.magnets.push(MagnetSlots {
            name: magnet.name.clone(),
            plate: magnet.plate,
            at: magnet.at,
            axis: magnet.axis,
            moment: slots.add_as(&[&magnet.name, "moment"], "A m^2", &magnet.moment),
        });
    }
    shapes.magnetometers = geometry.magnetometers.iter().map(|m| m.at).collect();

    let tendons: Vec<Arms> = (rig.tendons.iter())
        .map(|tendon| {
            let line = (tendon.name.as_str(), Role::Tendon);
            arms(rig, slots, line, &tendon.routes, &mut shapes.lines)
        })
        .collect();
    let mut own = Vec::new();
    let hasels: Vec<Arms> = (geometry.hasels.iter())
        .map(|hasel| {
            own.push(own_arms(rig, slots, &hasel.name, &hasel.path));
            let line = (hasel.name.as_str(), Role::Hasel);
            arms(rig, slots, line, &hasel.routes, &mut shapes.lines)
        })
        .collect();
    for (hasel, own) in topology.hasels.iter_mut().zip(own) {
        hasel.path = own;
    }
    let tendon_paths = topology.tendons.iter_mut().map(|tendon| &mut tendon.path);
    let hasel_paths = topology.hasels.iter_mut().map(|hasel| &mut hasel.path);
    let paths = tendon_paths.zip(tendons).chain(hasel_paths.zip(hasels));
    for (path, arms) in paths {
        for (body, derived) in arms {
            path.push((body, slots.len() + shapes.derived.len()));
            shapes.derived.push(derived);
        }
    }
    for hasel in &mut topology.hasels {
        hasel.pouch = slots.len() + shapes.derived.len();
        let rest = hasel.fill_angle;
        let numbers = (0..zip::NUMBERS).map(|number| Derived::Pouch { rest, number });
        shapes.derived.extend(numbers);
    }
    topology.shapes = shapes;
}

#[cfg(test)]
mod tests {
    use super::cover;

    #[test]
    fn a_span_covers_its_segments() {
        let covers = |span| (0..3).map(|k| cover(k, 3, span)).collect::<Vec<_>>();
        assert_eq!(covers([0.0, 1.0]), [1.0, 1.0, 1.0]);
        assert_eq!(covers([0.5, 1.0]), [0.0, 0.5, 1.0]);
        assert!(
            covers([0.4, 0.6])
                .iter()
                .zip([0.0, 0.6, 0.0])
                .all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-12)
        );
    }
}
