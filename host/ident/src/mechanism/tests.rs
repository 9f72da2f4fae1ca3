//! Mechanisms as rigs. What MuJoCo makes of the same files is in `tests/foreign/mechanism`.

use std::path::PathBuf;

use sinew_sim::Plant;

use super::*;
use crate::recording::Recording;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/foreign/mechanism")
}

fn imported(text: &str) -> Result<Imported> {
    one_joint(text, &[])
}

fn one_joint(text: &str, joints: &[&str]) -> Result<Imported> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.xml");
    std::fs::write(&path, text).expect("a file");
    let format = if text.contains("<robot") {
        Format::Urdf
    } else {
        Format::Mjcf
    };
    let joints: Vec<String> = joints.iter().map(|joint| (*joint).to_owned()).collect();
    import(&path, format, &joints)
}

fn rig(text: &str) -> Rig {
    let made = imported(text).unwrap_or_else(|error| panic!("{error}"));
    Rig::parse(&made.text, "made.toml").expect("it was read back")
}

/// Largest differences between MuJoCo and an imported rig, as parts of the signals' ranges.
fn differences(name: &str, file: &str, joints: &[&str]) -> Vec<(String, f64)> {
    let format = if file.ends_with("urdf") {
        Format::Urdf
    } else {
        Format::Mjcf
    };
    let joints: Vec<String> = joints.iter().map(|joint| (*joint).to_owned()).collect();
    let made = import(&folder().join(file), format, &joints).expect("the file is committed");
    let rig = Rig::parse(&made.text, file).expect("it was read back");
    let theirs = Recording::read(folder().join(format!("{name}.csv"))).expect("a recording");
    let plant = Plant::new(&rig).expect("the rig compiles");
    let column = |name: &str| theirs.column(name).expect("MuJoCo recorded it");
    let inputs: Vec<&[f64]> = plant.inputs().iter().map(|i| column(&i.column)).collect();
    // A position that nothing recorded was added to the rig; it starts at zero as in MuJoCo.
    let zeros = vec![0.0; theirs.len()];
    let signal = |name: &str| theirs.column(name).unwrap_or(&zeros);
    let signals: Vec<&[f64]> = (plant.sensors().iter())
        .map(|s| signal(&s.column))
        .collect();
    let ours = plant
        .simulate_recording(theirs.t(), &inputs, &signals)
        .expect("it is simulated");
    let compare = |(index, theirs): (usize, &&[f64])| {
        let high = theirs.iter().copied().fold(f64::MIN, f64::max);
        let low = theirs.iter().copied().fold(f64::MAX, f64::min);
        let name = plant.sensors()[index].column.clone();
        assert!(high - low > 0.05, "{name} hardly moves: this tests nothing");
        let errors = theirs.iter().zip(ours.trajectory.column(index));
        let largest = errors.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (name, largest / (high - low))
    };
    let recorded = |index: &usize| theirs.column(&plant.sensors()[*index].column).is_some();
    let compared: Vec<(String, f64)> = (signals.iter().enumerate())
        .filter(|(index, _)| recorded(index))
        .map(compare)
        .collect();
    assert_eq!(
        compared.len() + inputs.len(),
        theirs.columns().len(),
        "{name}"
    );
    compared
}

#[test]
fn mujoco_runs_a_mechanism_as_our_simulator_runs_its_rig() {
    // The fan's dry friction is a little soft in MuJoCo.
    for (name, file, joints, tolerance) in [
        ("pendulum", "pendulum.xml", &[][..], 1e-5),
        ("slide", "slide.xml", &[], 1e-5),
        ("table", "table.xml", &[], 2e-3),
        ("elbow", "chain.xml", &["elbow"], 1e-5),
        ("urdf", "pendulum.urdf", &[], 1e-5),
    ] {
        for (signal, error) in differences(name, file, joints) {
            println!("{name}: {signal}: {error:.1e} of the range");
            assert!(
                error < tolerance,
                "{name}: {signal}: {error:.2e} of the range"
            );
        }
    }
}

#[test]
fn joints_that_move_each_other_are_refused_by_name() {
    let error = import(&folder().join("chain.xml"), Format::Mjcf, &[]).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let message = error.to_string();
    for part in [
        "chain.xml:7:1: joints `shoulder` (line 4) and `elbow` move each other",
        "help: --joint ",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let one = import(&folder().join("chain.xml"), Format::Mjcf, &["elbow".into()]).unwrap();
    let held = |line: &String| line.ends_with("chain.xml:4: joint \"shoulder\": held still");
    assert!(one.left_out.iter().any(held), "{:?}", one.left_out);
    let wrong = import(&folder().join("chain.xml"), Format::Mjcf, &["elbo".into()]).unwrap_err();
    assert!(
        wrong.to_string().contains("did you mean `elbow`?"),
        "{wrong}"
    );
}

const CRANK: &str = "<mujoco><compiler angle=\"radian\"/><worldbody><body>\
    <joint name=\"j\" JOINT/><inertial pos=\"0 0 0\" mass=\"2\" diaginertia=\"3 4 5\"/>\
    </body></worldbody>REST</mujoco>";

fn crank(joint: &str, rest: &str) -> String {
    CRANK.replace("JOINT", joint).replace("REST", rest)
}

#[test]
fn what_a_rig_does_not_say_is_listed_with_its_line() {
    let text = crank(
        "range=\"-1 1\" margin=\"0.1\"",
        "\n<equality/>\n<contact><exclude name=\"no\"/></contact>\n<actuator>\n\
         <muscle name=\"m\" joint=\"j\"/>\n<motor name=\"site\" site=\"s\"/>\n\
         <general name=\"odd\" joint=\"j\" dyntype=\"filter\"/>\n<motor name=\"sided\" joint=\"j\" \
         ctrlrange=\"-1 2\" forcerange=\"-3 3\"/></actuator>\n<sensor><gyro name=\"g\" site=\"s\"/>\
         </sensor>\n<tendon><fixed name=\"dead\" stiffness=\"1\" springlength=\"0 1\"><joint \
         joint=\"j\" coef=\"1\"/></fixed><spatial name=\"wire\"/></tendon>",
    );
    let made = imported(&text).unwrap();
    for line in [
        "a.xml:1: joint \"j\": range=\"-1 1\" margin=\"0.1\"",
        "a.xml:2: equality",
        "a.xml:3: contact",
        "a.xml:5: muscle \"m\"",
        "a.xml:6: motor \"site\": it acts on no joint",
        "a.xml:7: general \"odd\": a gain or dynamics that no rig has",
        "a.xml:8: motor \"sided\": forcerange=\"-3 3\"",
        "a.xml:8: actuator \"sided\": ctrlrange clips in MuJoCo",
        "a.xml:9: gyro \"g\"",
        "a.xml:10: fixed \"dead\": a dead band",
        "a.xml:10: spatial \"wire\"",
    ] {
        let found = made.left_out.iter().any(|said| said.contains(line));
        assert!(found, "{line}\n{:#?}", made.left_out);
    }
    let lines: Vec<_> = made.left_out.iter().map(|line| line_of(line).1).collect();
    assert!(lines.is_sorted(), "{lines:?}");
    assert!(
        made.added
            .iter()
            .any(|added| added.contains("position of j"))
    );
}

#[test]
fn a_mechanism_that_changes_by_what_is_not_read_is_refused() {
    for (text, message) in [
        ("<robot/>".to_owned(), "no joint"),
        ("<mujoco/>".to_owned(), "no joint"),
        ("<a/>".to_owned(), "begins with `a`"),
        ("<mujoco>".to_owned(), "it is no XML"),
        (
            crank("type=\"ball\"", ""),
            "is a ball joint, which no rig has",
        ),
        (crank("type=\"screw\"", ""), "of type `screw`"),
        (crank("damping=\"x\"", ""), "`x` in `damping`"),
        (crank("damping=\"nan\"", ""), "`nan` in `damping`"),
        (crank("axis=\"0 0 0\"", ""), "has no length"),
        (crank("axis=\"0 1\"", ""), "2 numbers, not 3"),
        (crank("class=\"none\"", ""), "no default class `none`"),
        (
            crank("", "<compiler settotalmass=\"1\"/>"),
            "`settotalmass` changes masses",
        ),
        (
            crank("", "<actuator><motor joint=\"k\"/></actuator>"),
            "names no joint `k`",
        ),
        (
            crank("", "<worldbody><replicate count=\"2\"/></worldbody>"),
            "makes bodies",
        ),
        (crank("", "<include file=\"none.xml\"/>"), "none.xml"),
        (
            crank("", "<include file=\"a.xml\"/>"),
            "include one another",
        ),
        (
            "<mujoco><worldbody><body><joint/><geom type=\"mesh\" mesh=\"m\"/></body></worldbody>\
             </mujoco>"
                .to_owned(),
            "comes from",
        ),
        (
            "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>".to_owned(),
            "has an inertia",
        ),
        (
            "<robot><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"revolute\">\
             <parent link=\"a\"/><child link=\"b\"/></joint><joint name=\"k\" type=\"fixed\">\
             <parent link=\"b\"/><child link=\"a\"/></joint></robot>"
                .to_owned(),
            "hangs on itself",
        ),
    ] {
        let error = imported(&text).expect_err(&text);
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains(message), "{message}: {error}");
    }
}

/// A rig, written for MuJoCo and read again, has the same numbers.
#[test]
fn a_rig_that_was_written_for_mujoco_reads_back_with_its_numbers() {
    let text = "format = \"sinew-rig/1\"\nname = \"both\"\n\
        [[body]]\nname = \"arm\"\nmotion = \"hinge\"\ninertia = 0.02\n\
        [[body]]\nname = \"cart\"\nmotion = \"slide\"\ninertia = 1.5\n\
        [[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"arm\"\nstiffness = 3.0\nrest = 0.25\n\
        [[damper]]\nname = \"oil\"\nfrom = \"ground\"\nto = \"arm\"\ndamping = 0.05\n\
        [[gravity]]\nname = \"weight\"\nbody = \"arm\"\namplitude = 0.8\nzero = 0.4\n\
        [[actuator]]\nname = \"drive\"\ndrives = \"cart\"\ninput = \"u_V\"\ngain = 0.4\n\
        [[sensor]]\nname = \"ruler\"\nreads = \"cart.position\"\nsignal = \"q_m\"\n\
        [[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"cart\"\nlevel = 0.3\n\
        [[effect]]\nkind = \"cubic_stiffness\"\ncomponent = \"coil\"\ncoefficient = 7.0\n\
        [[effect]]\nkind = \"input_saturation\"\ncomponent = \"drive\"\nlimit = 6.0\n\
        [[effect]]\nkind = \"constant_load\"\ncomponent = \"cart\"\nlevel = -0.7\n";
    let first = Rig::parse(text, "both.toml").unwrap();
    let again = rig(&crate::mjcf::mjcf(&first).text);
    let assert_near =
        |one: f64, other: f64| assert!((one - other).abs() < 1e-12, "{one} for {other}");
    for (one, other) in first.bodies.iter().zip(&again.bodies) {
        assert_eq!((&one.name, one.motion), (&other.name, other.motion));
        assert_near(one.inertia.value, other.inertia.value);
    }
    assert_near(again.springs[0].stiffness.value, 3.0);
    assert_near(again.springs[0].rest.value, 0.25);
    assert_near(again.dampers[0].damping.value, 0.05);
    assert_near(again.gravities[0].amplitude.value, 0.8);
    assert_near(again.gravities[0].zero.value, 0.4);
    assert_near(again.actuators[0].gain.value, 0.4);
    let mut effects: Vec<(&str, f64)> = (again.effects.iter())
        .map(|effect| (effect.kind.description().kind, effect.parameters[0].value))
        .collect();
    effects.sort_by_key(|(kind, _)| *kind);
    let expected = [
        ("constant_load", -0.7),
        ("coulomb_friction", 0.3),
        ("cubic_stiffness", 7.0),
        ("input_saturation", 6.0),
    ];
    assert_eq!(effects, expected);
}

/// Changes that are made in the file by their words alone lead to the corrected rig.
#[test]
fn changes_made_in_the_file_say_what_the_corrected_rig_says() {
    let original = folder().join("pendulum.xml");
    let made = import(&original, Format::Mjcf, &[]).unwrap();
    let rig = Rig::parse(&made.text, "pendulum.toml").unwrap();
    let same = changes(&rig, &original).unwrap();
    assert_eq!(
        same.lines(),
        [""; 0],
        "a rig as it was read changes nothing"
    );
    let inertia = rig.bodies[0].inertia.value;
    let number = |from: &str, to: &str, text: String| {
        assert!(text.contains(from), "{from}\n{text}");
        text.replacen(from, to, 1)
    };
    let mut text = made.text.clone();
    for (from, to) in [
        (
            format!("inertia = {{ value = {inertia:?} }}"),
            "inertia = 0.095".to_owned(),
        ),
        (
            "stiffness = { value = 0.3 }".into(),
            "stiffness = 0.45".into(),
        ),
        (
            "rest = -0.2617993877991494".into(),
            "rest = 0.5235987755982988".into(),
        ),
        (
            "damping = { value = 0.004 }".into(),
            "damping = 0.006".into(),
        ),
        ("gain = 0.5".into(), "gain = 0.65".into()),
    ] {
        text = number(&from, &to, text);
    }
    text += "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"shoulder\"\nlevel = 0.02\n\
             [[effect]]\nkind = \"input_delay\"\ncomponent = \"drive\"\ndelay = 0.01\n";
    let corrected = Rig::parse(&text, "corrected.toml").unwrap();
    let list = changes(&corrected, &original).unwrap();
    assert_eq!(list.by_hand.len(), 1, "{:?}", list.by_hand);
    assert!(
        list.by_hand[0].starts_with("input_delay at drive ("),
        "{:?}",
        list.by_hand
    );
    let change_of = |attribute: &str| {
        list.attributes
            .iter()
            .find(|one| one.attribute == attribute)
    };
    assert_eq!(change_of("damping").unwrap().old.as_deref(), Some("0.004"));
    assert_eq!(change_of("gear").unwrap().new, "0.65");
    let mut file = std::fs::read_to_string(&original).unwrap();
    for change in &list.attributes {
        let (tag, name) = change.element.split_once(' ').unwrap();
        let element = format!("<{tag} name={name}");
        let written = format!("{}=\"{}\"", change.attribute, change.new);
        let own = change
            .old
            .as_ref()
            .map(|old| format!(" {}=\"{old}\"", change.attribute));
        if let Some(own) = own.filter(|own| {
            !["damping", "armature"].contains(&change.attribute) && file.contains(own)
        }) {
            file = file.replacen(&own, "", 1);
        }
        assert!(file.contains(&element), "{element}");
        file = file.replacen(&element, &format!("{element} {written}"), 1);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.xml");
    std::fs::write(&path, &file).unwrap();
    let left = changes(&corrected, &path).unwrap();
    assert_eq!(left.attributes, [], "{file}");
    assert!(
        list.to_csv()
            .lines()
            .any(|line| line.ends_with(",gear,0.5,0.65")),
        "{}",
        list.to_csv()
    );
}

#[test]
fn a_weight_or_inertia_that_no_attribute_holds_is_left_to_hands() {
    let original = folder().join("pendulum.xml");
    let made = import(&original, Format::Mjcf, &[]).unwrap();
    let rig = Rig::parse(&made.text, "a.toml").unwrap();
    let inertia = format!("{:?}", rig.bodies[0].inertia.value);
    let weight = format!("{:?}", rig.gravities[0].amplitude.value);
    let text = made.text.replace(&inertia, "0.001").replace(&weight, "9.0");
    let rig = Rig::parse(&text, "a.toml").unwrap();
    let list = changes(&rig, &original).unwrap();
    assert_eq!(list.attributes, []);
    assert!(
        list.by_hand[0].contains("moves an inertia of 0.001"),
        "{:?}",
        list.by_hand
    );
    assert!(list.by_hand[1].starts_with("the weight on joint \"shoulder\" is 9.0 N m"));
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_damage_to_a_mechanism_panics(
        which in 0..4_usize,
        places in proptest::collection::vec((proptest::prelude::any::<proptest::sample::Index>(), 0..6_usize), 1..5),
    ) {
        let name = ["pendulum.xml", "table.xml", "chain.xml", "pendulum.urdf"][which];
        let mut bytes = std::fs::read(folder().join(name)).unwrap();
        for (place, how) in places {
            let at = place.index(bytes.len());
            let end = (at + 4).min(bytes.len());
            match how {
                0 => bytes.truncate(at.max(1)),
                1 => drop(bytes.drain(at..end)),
                2 => bytes[at] ^= 1,
                3 => bytes[at..end].fill(b'9'),
                4 => drop(bytes.splice(at..end, *b"1e300")),
                _ => drop(bytes.splice(at..end, *b"0")),
            }
        }
        let _ = imported(&String::from_utf8_lossy(&bytes));
    }
}

/// A motor is often called as its joint.
#[test]
fn a_motor_of_its_joints_name_keeps_its_gear_among_the_changes() {
    let text = crank(
        "",
        "<actuator><motor name=\"j\" joint=\"j\" gear=\"3\"/></actuator>",
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    std::fs::write(&path, &text).unwrap();
    let made = import(&path, Format::Mjcf, &[]).unwrap();
    assert!(
        made.text
            .contains("name = \"j_2\"\ndrives = \"j\"\ninput = \"j_1\""),
        "{}",
        made.text
    );
    let rig = Rig::parse(&made.text.replace("gain = 3.0", "gain = 2.5"), "a.toml").unwrap();
    let list = changes(&rig, &path).unwrap();
    assert_eq!(list.lines().len(), 1, "{:?}", list.lines());
    assert_eq!(
        (
            list.attributes[0].attribute,
            list.attributes[0].new.as_str()
        ),
        ("gear", "2.5")
    );
}

#[test]
fn rigs_as_they_were_read_change_nothing_in_their_files() {
    for name in ["pendulum.xml", "slide.xml", "table.xml"] {
        let path = folder().join(name);
        let made = import(&path, Format::Mjcf, &[]).unwrap();
        let rig = Rig::parse(&made.text, name).unwrap();
        assert_eq!(changes(&rig, &path).unwrap().lines(), [""; 0], "{name}");
    }
}

#[test]
fn a_tendon_and_a_loop_are_compared_too() {
    let path = folder().join("table.xml");
    let made = import(&path, Format::Mjcf, &[]).unwrap();
    let text = made
        .text
        .replace("stiffness = { value = 50.0 }", "stiffness = 60.0");
    let text = text.replace("stiffness = 200.0", "stiffness = 150.0");
    let text = text
        + "\n[[spring]]\nname = \"belt\"\nfrom = \"x\"\nto = \"y\"\nstiffness = 5.0\n\
           [[effect]]\nkind = \"constant_load\"\ncomponent = \"y\"\nlevel = 0.5\n";
    let rig = Rig::parse(&text, "table.toml").unwrap();
    let lines = changes(&rig, &path).unwrap().lines();
    for part in [
        "fixed \"coupling\": stiffness = 60.0 (was 50.0)",
        "the constant load on joint \"y\" is 0.5, and the file's is 0.0",
        "the loop of position \"servo\" has a stiffness of 150.0, and the file's has 200.0",
        "spring `belt` of 5.0 joins two bodies",
    ] {
        assert!(
            lines.iter().any(|line| line.contains(part)),
            "{part}: {lines:#?}"
        );
    }
    assert_eq!(lines.len(), 4, "{lines:#?}");
}
