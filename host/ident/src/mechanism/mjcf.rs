//! MJCF (mujoco.readthedocs.io, XML reference) as a tree of links and joints, with what drives and
//! what reads them.

use nalgebra::{
    Isometry3, Matrix3, Quaternion, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};

use super::defaults::Defaults;
use super::document::Node;
use super::geom::Shape;
use super::left_out;
use super::numbers::{direction, number, numbers, vector};
use super::tree::{Joint, Link, Mass, Motion, Tree};
use super::{Cable, Drive, Mechanism, Reading};
use crate::error::Result;

/// Bodies of one model.
const MOST_BODIES: usize = 500;
/// Density of a geom that says none, kg/m^3.
const WATER: f64 = 1000.0;

/// # Errors
/// `File` for what is no MJCF, for numbers that are none, and for what changes the dynamics and is
/// not read (meshes without an inertia, copies of bodies, ...).
pub fn read(root: &Node) -> Result<Mechanism> {
    if root.tag != "mujoco" {
        let message = format!("the file begins with `{}`, not with `mujoco`", root.tag);
        return Err(root.error(message).help("URDF is read with --urdf"));
    }
    let mut reader = Reader::new(root)?;
    let world = Isometry3::identity();
    for node in root.all("worldbody") {
        reader.inside(node, &world, None, None)?;
    }
    let mut left_out = left_out::list(root, left_out::MJCF);
    let drives = reader.drives(root, &mut left_out)?;
    let readings = reader.readings(root)?;
    let cables = reader.cables(root, &mut left_out)?;
    Ok(Mechanism {
        name: root.get("model").unwrap_or("model").to_owned(),
        degrees: reader.degrees,
        tree: reader.tree,
        drives,
        readings,
        cables,
        left_out,
    })
}

struct Reader {
    defaults: Defaults,
    degrees: bool,
    auto_limits: bool,
    euler: String,
    /// `true`: from geoms whatever `inertial` says; `None`: where there is no `inertial`.
    from_geoms: Option<bool>,
    tree: Tree,
}

impl Reader {
    fn new(root: &Node) -> Result<Self> {
        let mut reader = Self {
            defaults: Defaults::read(root)?,
            degrees: true,
            auto_limits: true,
            euler: "xyz".into(),
            from_geoms: None,
            tree: Tree {
                links: Vec::new(),
                joints: Vec::new(),
                gravity: Vector3::new(0.0, 0.0, -9.81),
            },
        };
        for node in root.all("compiler") {
            reader.degrees = node
                .get("angle")
                .map_or(reader.degrees, |angle| angle == "degree");
            let limits = node.get("autolimits");
            reader.auto_limits = limits.map_or(reader.auto_limits, |limits| limits == "true");
            reader.euler = node.get("eulerseq").unwrap_or(&reader.euler).to_owned();
            reader.from_geoms = match node.get("inertiafromgeom") {
                Some("true") => Some(true),
                Some("false") => Some(false),
                Some("auto") => None,
                _ => reader.from_geoms,
            };
            for key in ["inertiagrouprange", "settotalmass"] {
                if node.get(key).is_some() {
                    return Err(node.error(format!("`{key}` changes masses and is not read")));
                }
            }
        }
        for node in root.all("option") {
            if let Some(gravity) = vector(node, "gravity", node.get("gravity"))? {
                reader.tree.gravity = gravity;
            }
            if node
                .all("flag")
                .any(|flag| flag.get("gravity") == Some("disable"))
            {
                reader.tree.gravity = Vector3::zeros();
            }
        }
        Ok(reader)
    }

    fn angle(&self, angle: f64) -> f64 {
        if self.degrees {
            angle.to_radians()
        } else {
            angle
        }
    }

    /// Bodies, frames, joints and geoms in an element.
    fn inside(
        &mut self,
        node: &Node,
        pose: &Isometry3<f64>,
        link: Option<usize>,
        childclass: Option<&str>,
    ) -> Result<()> {
        let childclass = node.get("childclass").or(childclass);
        for inner in &node.inside {
            match inner.tag.as_str() {
                "body" => self.body(inner, pose, link, childclass)?,
                "frame" => {
                    let pose = pose * self.pose(inner)?;
                    self.inside(inner, &pose, link, childclass)?;
                }
                "joint" | "freejoint" => {
                    let Some(link) = link else {
                        return Err(inner.error("the world has no joints"));
                    };
                    self.joint(inner, pose, link, childclass)?;
                }
                "replicate" | "attach" | "composite" | "flexcomp" => {
                    let message = format!("`{}` makes bodies and is not read", inner.tag);
                    return Err(inner
                        .error(message)
                        .help("MuJoCo writes the model without it: mujoco.mj_saveLastXML"));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn body(
        &mut self,
        node: &Node,
        pose: &Isometry3<f64>,
        parent: Option<usize>,
        childclass: Option<&str>,
    ) -> Result<()> {
        if self.tree.links.len() >= MOST_BODIES {
            return Err(node.error(format!("more than {MOST_BODIES} bodies")));
        }
        let pose = pose * self.pose(node)?;
        let childclass = node.get("childclass").or(childclass);
        let mass = self.mass(node, &pose, childclass)?;
        let link = self.tree.links.len();
        self.tree.links.push(Link {
            parent,
            mass,
            joints: Vec::new(),
        });
        self.inside(node, &pose, Some(link), childclass)
    }

    /// Position and orientation of an element in the one around it.
    fn pose(&self, node: &Node) -> Result<Isometry3<f64>> {
        let place = vector(node, "pos", node.get("pos"))?.unwrap_or_default();
        Ok(Isometry3::from_parts(
            Translation3::from(place),
            self.turn(node)?,
        ))
    }

    fn turn(&self, node: &Node) -> Result<UnitQuaternion<f64>> {
        let numbers_at = |key: &str| numbers(node, key, node.get(key));
        let wrong = |key: &str| node.error(format!("`{key}` of {} is no turn", node.called()));
        if let Some(quat) = numbers_at("quat")? {
            let [w, x, y, z] = quat[..] else {
                return Err(wrong("quat"));
            };
            return UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12)
                .ok_or_else(|| wrong("quat"));
        }
        if let Some(turn) = numbers_at("axisangle")? {
            let [x, y, z, angle] = turn[..] else {
                return Err(wrong("axisangle"));
            };
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12);
            let axis = axis.ok_or_else(|| wrong("axisangle"))?;
            return Ok(UnitQuaternion::from_axis_angle(&axis, self.angle(angle)));
        }
        if let Some(angles) = numbers_at("euler")? {
            let axes: Vec<char> = self.euler.chars().collect();
            if angles.len() != 3 || axes.len() != 3 {
                return Err(wrong("euler"));
            }
            let mut turn = UnitQuaternion::identity();
            for (axis, angle) in axes.iter().zip(angles) {
                let unit = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    'z' => Vector3::z_axis(),
                    _ => return Err(wrong("euler")),
                };
                let step = UnitQuaternion::from_axis_angle(&unit, self.angle(angle));
                // Small letters turn about axes that turn along.
                turn = if axis.is_lowercase() {
                    turn * step
                } else {
                    step * turn
                };
            }
            return Ok(turn);
        }
        if let Some(axes) = numbers_at("xyaxes")? {
            let [a, b, c, d, e, f] = axes[..] else {
                return Err(wrong("xyaxes"));
            };
            let x = Vector3::new(a, b, c).try_normalize(1e-12);
            let x = x.ok_or_else(|| wrong("xyaxes"))?;
            let y = Vector3::new(d, e, f);
            let y = (y - x * x.dot(&y)).try_normalize(1e-12);
            let y = y.ok_or_else(|| wrong("xyaxes"))?;
            let turn = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            return Ok(UnitQuaternion::from_rotation_matrix(
                &Rotation3::from_matrix_unchecked(turn),
            ));
        }
        match direction(node, "zaxis", node.get("zaxis"))? {
            Some(z) => Ok(onto(z)),
            None => Ok(UnitQuaternion::identity()),
        }
    }

    /// Mass of a body without those in it, in the world.
    fn mass(&self, node: &Node, pose: &Isometry3<f64>, childclass: Option<&str>) -> Result<Mass> {
        let inertial = node.first("inertial");
        match (inertial, self.from_geoms) {
            (Some(inertial), None | Some(false)) => {
                let own = self.inertial(inertial)?;
                Ok(own.moved(&(pose * self.pose(inertial)?)))
            }
            (None, Some(false)) => Ok(Mass::none()),
            _ => self.geoms(node, pose, childclass),
        }
    }

    fn inertial(&self, node: &Node) -> Result<Mass> {
        let mass = number(node, "mass", node.get("mass"))?;
        let mass = mass.ok_or_else(|| node.error("`inertial` has no `mass`"))?;
        let numbers_at = |key: &str| numbers(node, key, node.get(key));
        let moments = if let Some(full) = numbers_at("fullinertia")? {
            let [xx, yy, zz, xy, xz, yz] = full[..] else {
                return Err(node.error("`fullinertia` has six numbers"));
            };
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        } else {
            let diagonal = vector(node, "diaginertia", node.get("diaginertia"))?;
            let diagonal = diagonal.ok_or_else(|| node.error("`inertial` has no `diaginertia`"))?;
            Matrix3::from_diagonal(&diagonal)
        };
        Ok(Mass {
            mass,
            centre: Vector3::zeros(),
            moments,
        })
    }

    /// Sum of the geoms of a body, those in frames among them.
    fn geoms(&self, node: &Node, pose: &Isometry3<f64>, childclass: Option<&str>) -> Result<Mass> {
        let childclass = node.get("childclass").or(childclass);
        let mut sum = Mass::none();
        for inner in &node.inside {
            match inner.tag.as_str() {
                "geom" => sum = sum.with(self.geom(inner, pose, childclass)?),
                "frame" => {
                    let pose = pose * self.pose(inner)?;
                    sum = sum.with(self.geoms(inner, &pose, childclass)?);
                }
                _ => {}
            }
        }
        Ok(sum)
    }

    fn geom(&self, node: &Node, pose: &Isometry3<f64>, childclass: Option<&str>) -> Result<Mass> {
        let node = &self.defaults.apply(node, childclass)?;
        let mass = number(node, "mass", node.get("mass"))?;
        let density = number(node, "density", node.get("density"))?.unwrap_or(WATER);
        if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
            return Ok(Mass::none());
        }
        if let Some(key) = ["shellinertia", "mesh", "fitscale"]
            .into_iter()
            .find(|key| node.get(key).is_some_and(|value| value != "false"))
        {
            let message = format!(
                "the mass of {} comes from `{key}`, which is not read",
                node.called()
            );
            return Err(node.error(message).help("give its body an `inertial`"));
        }
        let size = numbers(node, "size", node.get("size"))?.unwrap_or_default();
        let kind = node.get("type").unwrap_or("sphere");
        let mut own = self.pose(node)?;
        let mut half = size.get(1).copied();
        if let Some(ends) = numbers(node, "fromto", node.get("fromto"))? {
            let [a, b, c, d, e, f] = ends[..] else {
                return Err(node.error("`fromto` has six numbers"));
            };
            let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let along = (from - to).try_normalize(1e-12);
            let along = along.ok_or_else(|| node.error("`fromto` has no length"))?;
            own = Isometry3::from_parts(Translation3::from((from + to) / 2.0), onto(along));
            half = Some((to - from).norm() / 2.0);
        }
        let fromto = node.get("fromto").is_some();
        let shape = match (kind, size.as_slice(), half) {
            ("sphere", [r, ..], _) => Shape::Sphere(*r),
            ("capsule", [r, ..], Some(half)) => Shape::Capsule(*r, half),
            ("cylinder", [r, ..], Some(half)) => Shape::Cylinder(*r, half),
            ("box", [x, y, z], _) if !fromto => Shape::Box(*x, *y, *z),
            ("ellipsoid", [x, y, z], _) if !fromto => Shape::Ellipsoid(*x, *y, *z),
            // Along `fromto` both other half lengths are the first.
            ("box", [x, ..], Some(half)) if fromto => Shape::Box(*x, *x, half),
            ("ellipsoid", [x, ..], Some(half)) if fromto => Shape::Ellipsoid(*x, *x, half),
            ("plane" | "hfield" | "sdf", ..) => return Ok(Mass::none()),
            ("mesh", ..) => {
                let message = format!("the mass of {} comes from its mesh", node.called());
                return Err(node.error(message).help("give its body an `inertial`"));
            }
            _ => {
                let message = format!("{} is a {kind} of size {size:?}", node.called());
                return Err(node.error(message));
            }
        };
        let mass = mass.unwrap_or(density * shape.volume());
        Ok(shape.filled(mass).moved(&(pose * own)))
    }

    fn joint(
        &mut self,
        node: &Node,
        pose: &Isometry3<f64>,
        link: usize,
        childclass: Option<&str>,
    ) -> Result<()> {
        let index = self.tree.joints.len();
        let full = match node.tag.as_str() {
            "freejoint" => node.clone(),
            _ => self.defaults.apply(node, childclass)?,
        };
        let node = &full;
        let motion = match (node.tag.as_str(), node.get("type")) {
            ("freejoint", _) | (_, Some("free")) => Motion::Other("free"),
            (_, None | Some("hinge")) => Motion::Hinge,
            (_, Some("slide")) => Motion::Slide,
            (_, Some("ball")) => Motion::Other("a ball joint"),
            (_, Some(other)) => return Err(node.error(format!("a joint of type `{other}`"))),
        };
        let turned = |value: f64| match motion {
            Motion::Hinge => self.angle(value),
            _ => value,
        };
        let number_at = |key: &str| number(node, key, node.get(key));
        let list = |key: &str| numbers(node, key, node.get(key));
        let filled = |list: Option<Vec<f64>>, at: usize| {
            list.and_then(|list| list.get(at).copied()).unwrap_or(0.0)
        };
        let damping = list("damping")?;
        let stiffness = list("stiffness")?;
        if filled(damping.clone(), 2) != 0.0 {
            return Err(node.error("cubic damping, which no rig has"));
        }
        let axis = direction(node, "axis", node.get("axis"))?.unwrap_or(Vector3::z());
        let anchor = vector(node, "pos", node.get("pos"))?.unwrap_or_default();
        let name = node.get("name").map(str::to_owned);
        self.tree.joints.push(Joint {
            name: name.unwrap_or_else(|| format!("joint{}", index + 1)),
            place: node.place.clone(),
            motion,
            axis: pose.rotation * axis,
            anchor: (pose * nalgebra::Point3::from(anchor)).coords,
            reference: turned(number_at("ref")?.unwrap_or(0.0)),
            armature: number_at("armature")?.unwrap_or(0.0),
            damping: [0, 1].map(|at| filled(damping.clone(), at)),
            friction: number_at("frictionloss")?.unwrap_or(0.0),
            stiffness: [0, 1, 2].map(|at| filled(stiffness.clone(), at)),
            rest: turned(number_at("springref")?.unwrap_or(0.0)),
            attributes: node.attributes.clone(),
        });
        self.tree.links[link].joints.push(index);
        Ok(())
    }

    /// The joint that an element names.
    fn named(&self, node: &Node, key: &str) -> Result<usize> {
        let name = node.get(key).unwrap_or_default();
        let found = self.tree.joints.iter().position(|joint| joint.name == name);
        found.ok_or_else(|| node.error(format!("{} names no joint `{name}`", node.called())))
    }

    fn drives(&self, root: &Node, left_out: &mut Vec<String>) -> Result<Vec<Drive>> {
        let mut drives: Vec<Drive> = Vec::new();
        for raw in root.all("actuator").flat_map(|node| &node.inside) {
            let tag = raw.tag.as_str();
            if !["motor", "position", "velocity", "general"].contains(&tag) {
                continue;
            }
            let node = &self.defaults.apply(raw, None)?;
            let mut skip = |why: &str| {
                left_out.push(format!("{}: {}: {why}", node.place, node.called()));
            };
            if node.get("joint").is_none() {
                skip("it acts on no joint");
                continue;
            }
            let joint = self.named(node, "joint")?;
            let list = |key: &str| numbers(node, key, node.get(key));
            let first = |key: &str, or: f64| -> Result<f64> {
                Ok(list(key)?
                    .and_then(|list| list.first().copied())
                    .unwrap_or(or))
            };
            let gear = first("gear", 1.0)?;
            // Force on the joint: gain u + load - stiffness q - damping v.
            let [gain, load, stiffness, damping] = match tag {
                "motor" => [1.0, 0.0, 0.0, 0.0],
                "position" => {
                    let kp = first("kp", 1.0)?;
                    if node.get("dampratio").is_some() {
                        skip("`dampratio`: give `kv` in its place");
                        continue;
                    }
                    [kp, 0.0, kp, first("kv", 0.0)?]
                }
                "velocity" => {
                    let kv = first("kv", 1.0)?;
                    [kv, 0.0, 0.0, kv]
                }
                _ => {
                    let odd = |key: &str, usual: &[&str]| {
                        node.get(key).is_some_and(|value| !usual.contains(&value))
                    };
                    if odd("gaintype", &["fixed"]) || odd("dyntype", &["none"]) {
                        skip("a gain or dynamics that no rig has");
                        continue;
                    }
                    let gain = first("gainprm", 1.0)?;
                    match node.get("biastype") {
                        None | Some("none") => [gain, 0.0, 0.0, 0.0],
                        Some("affine") => {
                            let bias = list("biasprm")?.unwrap_or_default();
                            let bias_of = |place: usize| bias.get(place).copied().unwrap_or(0.0);
                            [gain, bias_of(0), -bias_of(1), -bias_of(2)]
                        }
                        Some(_) => {
                            skip("a bias that no rig has");
                            continue;
                        }
                    }
                }
            };
            if stiffness < 0.0 || damping < 0.0 {
                skip("a bias that pushes away, which no spring of a rig does");
                continue;
            }
            let limit = match list("ctrlrange")?.as_deref() {
                Some([low, high]) if low < high => Some((*low, *high)),
                _ => None,
            };
            let clipped = match node.get("ctrllimited") {
                Some("true") => true,
                Some("false") => false,
                _ => self.auto_limits,
            };
            let name = node.get("name").map(str::to_owned);
            drives.push(Drive {
                tag: tag.to_owned(),
                gear,
                gear_text: node.get("gear").map(str::to_owned),
                name: name.unwrap_or_else(|| format!("{tag}{}", drives.len() + 1)),
                place: node.place.clone(),
                joint,
                target: match tag {
                    "position" => Some("position"),
                    "velocity" => Some("velocity"),
                    _ => None,
                },
                plain: tag == "motor" && gear == 1.0,
                gain: gear * gain,
                load: gear * load,
                stiffness: gear * gear * stiffness,
                damping: gear * gear * damping,
                limit,
                clipped: clipped && limit.is_some(),
            });
        }
        Ok(drives)
    }

    fn readings(&self, root: &Node) -> Result<Vec<Reading>> {
        let mut readings: Vec<Reading> = Vec::new();
        for node in root.all("sensor").flat_map(|node| &node.inside) {
            let velocity = match node.tag.as_str() {
                "jointpos" => false,
                "jointvel" => true,
                _ => continue,
            };
            let joint = self.named(node, "joint")?;
            let name = node.get("name").map(str::to_owned);
            readings.push(Reading {
                name: name.unwrap_or_else(|| format!("{}{}", node.tag, readings.len() + 1)),
                joint,
                velocity,
            });
        }
        Ok(readings)
    }

    /// Fixed tendons with stiffness or damping.
    fn cables(&self, root: &Node, left_out: &mut Vec<String>) -> Result<Vec<Cable>> {
        let mut cables: Vec<Cable> = Vec::new();
        for raw in root.all("tendon").flat_map(|node| node.all("fixed")) {
            let mut node = self.defaults.apply(raw, None)?;
            // Defaults of fixed tendons are those of `tendon`.
            node.tag = "tendon".into();
            let mut node = self.defaults.apply(&node, None)?;
            node.tag = "fixed".into();
            let number_at = |key: &str| number(&node, key, node.get(key));
            let lengths = numbers(&node, "springlength", node.get("springlength"))?;
            let length = match lengths.as_deref() {
                Some([length]) if *length >= 0.0 => *length,
                Some([low, high]) if low == high => *low,
                None if number_at("stiffness")?.unwrap_or(0.0) == 0.0 => 0.0,
                _ => {
                    let why = "a dead band, or a rest length from the reference configuration";
                    left_out.push(format!("{}: {}: {why}", node.place, node.called()));
                    continue;
                }
            };
            let mut arms = Vec::new();
            for joint in node.all("joint") {
                let coefficient = number(joint, "coef", joint.get("coef"))?.unwrap_or(0.0);
                arms.push((self.named(joint, "joint")?, coefficient));
            }
            let name = node.get("name").map(str::to_owned);
            cables.push(Cable {
                name: name.unwrap_or_else(|| format!("tendon{}", cables.len() + 1)),
                place: node.place.clone(),
                arms,
                stiffness: number_at("stiffness")?.unwrap_or(0.0),
                damping: number_at("damping")?.unwrap_or(0.0),
                length,
            });
        }
        Ok(cables)
    }
}

/// The shortest turn of z onto a direction.
fn onto(z: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), &z).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}
