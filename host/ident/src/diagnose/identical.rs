//! Groups of identical components of a rig: what one of them does, all of them do
//! (docs/lab/0060-friction-of-every-tendon.md, 0062-what-is-made-alike.md).

use sinew_sim::Rig;
use sinew_sim::effects::{Family, Kind};
use sinew_sim::rig::{Chain, Drives, End, Plate, Reads, Shape, Site};

/// Reason for which components are identical.
#[derive(Clone, Copy, PartialEq)]
enum Make {
    /// Tendons of one rig run through guides that were made alike.
    Tendon,
    /// Springs along the coordinates of one chain or plate are one piece of material; which one.
    Piece(usize),
    /// Coordinates of one chain or plate are joints of one make; which one.
    Joints(usize),
    /// Actuators that wind tendons: one drive for each of them.
    Winch,
    /// Actuators that feed HASEL actuators: one amplifier of several channels.
    Supply,
    /// Sensors of one point are one camera, those of one field one magnetometer; one of its
    /// sensors.
    Vector(Shape),
}

/// Families that a joint has because of how it was made; a load comes from outside, and a mass that
/// nobody sees hangs at one place.
const JOINTS: [Family; 3] = [Family::Friction, Family::Damping, Family::Gap];

/// The components that an effect can sit at, by what makes them alike: groups of two and more, in
/// file order.
pub(crate) fn groups(rig: &Rig, kind: Kind) -> Vec<Vec<Site>> {
    let mut groups: Vec<(Make, Vec<Site>)> = Vec::new();
    let of_joints = JOINTS.contains(&kind.description().family);
    for site in kind.sites(rig) {
        let Some(make) = make(rig, site) else {
            continue;
        };
        if matches!(make, Make::Joints(_)) && !of_joints {
            continue;
        }
        match groups.iter_mut().find(|(known, _)| known.is(make)) {
            Some((_, sites)) => sites.push(site),
            None => groups.push((make, vec![site])),
        }
    }
    let sites = groups.into_iter().map(|(_, sites)| sites);
    sites.filter(|sites| sites.len() > 1).collect()
}

fn make(rig: &Rig, site: Site) -> Option<Make> {
    match site {
        Site::Tendon(_) => Some(Make::Tendon),
        Site::Spring(spring) => piece(rig, spring).map(Make::Piece),
        Site::Actuator(actuator) => match rig.actuators[actuator].drives {
            Drives::Tendon(_) => Some(Make::Winch),
            Drives::Hasel(_) => Some(Make::Supply),
            Drives::Body(_) => None,
        },
        Site::Sensor(sensor) => match rig.sensors[sensor].reads {
            Reads::Shape(shape) => Some(Make::Vector(shape)),
            _ => None,
        },
        Site::Body(body) => piece_of(rig, body).map(Make::Joints),
        Site::Pair(..) => None,
    }
}

/// Index of the rig's chain or plate that a spring holds to the ground, chains first.
fn piece(rig: &Rig, spring: usize) -> Option<usize> {
    let spring = &rig.springs[spring];
    let body = match (spring.from, spring.to) {
        (End::Ground, End::Body(body)) | (End::Body(body), End::Ground) => body,
        _ => return None,
    };
    piece_of(rig, body)
}

/// Index of the rig's chain or plate that a body is a coordinate of, chains first.
fn piece_of(rig: &Rig, body: usize) -> Option<usize> {
    let chains = rig.geometry.chains.iter().map(Chain::bodies);
    let plates = rig.geometry.plates.iter().map(Plate::bodies);
    chains
        .chain(plates)
        .position(|bodies| bodies.contains(&body))
}

impl Make {
    fn is(self, other: Self) -> bool {
        match (self, other) {
            (Self::Vector(a), Self::Vector(b)) => a.beside(b),
            _ => self == other,
        }
    }
}
