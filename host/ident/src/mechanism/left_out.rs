//! Elements and attributes of a file that a rig does not say, each in a line.

use super::document::Node;

/// Attributes of an element that are read, by its tag.
type Known = &'static [(&'static str, &'static [&'static str])];

/// Places and orientations.
macro_rules! posed {
    ($($key:literal),*) => {
        &["name", "class", "pos", "quat", "axisangle", "euler", "xyaxes", "zaxis", $($key),*]
    };
}

/// Elements of MJCF.
pub const MJCF: Known = &[
    ("mujoco", &["model"]),
    (
        "compiler",
        &["angle", "autolimits", "eulerseq", "inertiafromgeom"],
    ),
    ("option", &["gravity"]),
    ("default", &["class"]),
    ("worldbody", &[]),
    ("body", posed!("childclass")),
    ("frame", posed!("childclass")),
    ("inertial", posed!("mass", "diaginertia", "fullinertia")),
    (
        "joint",
        &[
            "name",
            "class",
            "type",
            "pos",
            "axis",
            "ref",
            "armature",
            "damping",
            "stiffness",
            "springref",
            "frictionloss",
            "joint",
            "coef",
        ],
    ),
    ("geom", posed!("type", "size", "fromto", "mass", "density")),
    ("tendon", &[]),
    (
        "fixed",
        &["name", "class", "stiffness", "damping", "springlength"],
    ),
    ("actuator", &[]),
    (
        "motor",
        &["name", "class", "joint", "gear", "ctrlrange", "ctrllimited"],
    ),
    (
        "position",
        &[
            "name",
            "class",
            "joint",
            "gear",
            "kp",
            "kv",
            "ctrlrange",
            "ctrllimited",
        ],
    ),
    (
        "velocity",
        &[
            "name",
            "class",
            "joint",
            "gear",
            "kv",
            "ctrlrange",
            "ctrllimited",
        ],
    ),
    (
        "general",
        &[
            "name",
            "class",
            "joint",
            "gear",
            "ctrlrange",
            "ctrllimited",
            "gainprm",
            "biastype",
            "biasprm",
            "gaintype",
            "dyntype",
        ],
    ),
    ("sensor", &[]),
    ("jointpos", &["name", "joint"]),
    ("jointvel", &["name", "joint"]),
];

/// Elements of URDF.
pub const URDF: Known = &[
    ("robot", &["name"]),
    ("link", &["name"]),
    ("inertial", &[]),
    ("origin", &["xyz", "rpy"]),
    ("mass", &["value"]),
    ("inertia", &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    ("joint", &["name", "type"]),
    ("parent", &["link"]),
    ("child", &["link"]),
    ("axis", &["xyz"]),
    ("dynamics", &["damping", "friction"]),
    ("limit", &["effort"]),
];

/// Numbers that stand for nothing, so that leaving them out changes nothing.
fn is_nothing(tag: &str, key: &str, value: &str) -> bool {
    matches!(
        (tag, key, value),
        ("compiler", "boundmass" | "boundinertia", "0") | ("compiler", "coordinate", "local")
    )
}

/// Lines about everything in a tree that is not among `known`.
pub fn list(root: &Node, known: Known) -> Vec<String> {
    let mut lines = Vec::new();
    element(root, known, &mut lines);
    lines
}

fn element(node: &Node, known: Known, lines: &mut Vec<String>) {
    let Some((_, keys)) = known.iter().find(|(tag, _)| *tag == node.tag) else {
        lines.push(format!("{}: {}", node.place, node.called()));
        return;
    };
    let unread = node
        .attributes
        .iter()
        .filter(|(key, value)| !keys.contains(&key.as_str()) && !is_nothing(&node.tag, key, value));
    let unread: Vec<String> = unread
        .map(|(key, value)| format!("{key}=\"{value}\""))
        .collect();
    let contact = if node.tag == "geom" {
        " (and its contacts)"
    } else {
        ""
    };
    if !unread.is_empty() || !contact.is_empty() {
        let what = if unread.is_empty() {
            "its looks".to_owned()
        } else {
            unread.join(" ")
        };
        lines.push(format!(
            "{}: {}: {what}{contact}",
            node.place,
            node.called()
        ));
    }
    for inner in &node.inside {
        element(inner, known, lines);
    }
}
