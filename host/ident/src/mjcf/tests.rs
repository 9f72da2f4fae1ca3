//! Golden file of the MuJoCo export; that it means the same to MuJoCo is checked by
//! `tests/foreign/mjcf.py`.

use super::*;

/// A rig with one of everything that MuJoCo carries.
const ALL: &str = include_str!("../../../../tests/foreign/mjcf/all.toml");

#[test]
fn the_file_that_mujoco_was_asked_about_is_what_is_written() {
    let golden = include_str!("../../../../tests/foreign/mjcf/all.xml");
    let rig = Rig::parse(ALL, "all.toml").expect("the rig is sound");
    let written = mjcf(&rig);
    assert_eq!(written.text, golden, "see tests/foreign/mjcf.py");
    assert_eq!(written.left_out, [""; 0]);
}

#[test]
fn what_mujoco_cannot_carry_is_named_with_its_numbers() {
    let rig = ALL.to_owned()
        + "\n[[effect]]\nkind = \"position_ripple\"\ncomponent = \"cart\"\namplitude = 0.25\n\
           wave_number = 40.0\nphase = 0.5\n";
    let rig = Rig::parse(&rig, "ripple.toml").expect("the rig is sound");
    let written = mjcf(&rig);
    assert_eq!(written.left_out.len(), 1, "{:?}", written.left_out);
    let what = "position_ripple at cart (F = amplitude sin(wave_number q + phase); amplitude 0.25";
    assert!(
        written.left_out[0].starts_with(what),
        "{:?}",
        written.left_out
    );
    assert!(written.text.contains(&format!("<!-- LEFT OUT: {what}")));
}

#[test]
fn a_position_loop_is_a_bias_and_a_limit_of_the_force() {
    let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"arm\"\n\
                motion = \"hinge\"\ninertia = 1.0\n[[actuator]]\nname = \"servo\"\n\
                drives = \"arm\"\ninput = \"goal_rad\"\ngain = 12.5\nloop = \"position\"\n\
                effort_limit = 0.75\n";
    let written = |more: &str| {
        let rig = Rig::parse(&format!("{text}{more}"), "servo.toml");
        mjcf(&rig.expect("the rig is sound"))
    };
    let plain = written("");
    let mut lines = plain.text.lines();
    let servo = lines.find(|line| line.contains("<general name=\"servo\""));
    let servo = servo.expect("the actuator is written");
    for part in [
        "gainprm=\"12.5\"",
        "biasprm=\"0.0 -12.5 0.0\"",
        "forcerange=\"-0.75 0.75\"",
    ] {
        assert!(servo.contains(part), "{servo}");
    }
    assert_eq!(plain.left_out, [""; 0]);
    let with_a_band = written("dead_band = 0.01\n").left_out;
    assert_eq!(with_a_band.len(), 1, "{with_a_band:?}");
    assert!(with_a_band[0].contains("dead band of the position loop of `servo`"));
}

#[test]
fn a_number_that_depends_on_a_column_is_named_as_left_out() {
    let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"cart\"\n\
                motion = \"slide\"\ninertia = 1.0\n[[damper]]\nname = \"oil\"\nfrom = \"ground\"\n\
                to = \"cart\"\ndamping = { value = 0.25, with = \"T_K\", slope = 0.5 }\n";
    let rig = Rig::parse(text, "warm.toml").expect("the rig is sound");
    let left_out = mjcf(&rig).left_out;
    let what = "oil.damping by a recorded column: it is written at the column's zero; add 0.5";
    assert!(
        left_out.iter().any(|line| line.starts_with(what)),
        "{left_out:?}"
    );
}

/// A force without a name is not lost on the way to MuJoCo without a word.
#[test]
fn a_learned_force_is_named_as_left_out() {
    let rig = Rig::parse(ALL, "all.toml").expect("the rig is sound");
    let kind = Kind::Learned;
    let mut values = vec![0.0; kind.description().parameters.len()];
    values[..4].copy_from_slice(&[0.0, 1.0, 2.0, 0.5]);
    let site = rig.site(kind, "cart").expect("cart is a body");
    let rig = rig
        .with_effect(kind, site, &values)
        .expect("the component bears this effect");
    let written = mjcf(&rig);
    assert_eq!(written.left_out.len(), 1, "{:?}", written.left_out);
    assert!(written.left_out[0].starts_with("learned_residual at cart"));
}

#[test]
fn names_and_remarks_cannot_break_the_file() {
    let text = "format = \"sinew-rig/1\"\nname = \"a -- b\"\n[[body]]\nname = \"x<y & \\\"z\\\"\"\n\
                motion = \"slide\"\ninertia = 1.0\n";
    let rig = Rig::parse(text, "odd.toml").expect("the rig is sound");
    let written = mjcf(&rig).text;
    assert!(written.contains("x&lt;y &amp; &quot;z&quot;"), "{written}");
    let comment = written.lines().next().expect("a comment comes first");
    assert_eq!(comment.matches("--").count(), 2, "{comment}");
}

#[test]
fn a_number_that_differs_by_recording_is_written_at_what_recordings_share() {
    let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"cart\"\n\
                motion = \"slide\"\ninertia = { value = 2.0, per = \"recording\" }\n";
    let rig = Rig::parse(text, "laden.toml").expect("the rig is sound");
    let left_out = mjcf(&rig).left_out;
    let what = "differing by recording, here at `value`: `cart.inertia` = 2.00 kg";
    assert_eq!(left_out, [what]);
}

/// A cart on a spring and a damper with learned laws, joined to a second one by another.
fn on_laws(stiffness: &str, damping: &str) -> Rig {
    let text = format!(
        "format = \"sinew-rig/1\"\nname = \"x\"\n[[law]]\nname = \"foam\"\nreach = 0.1\n\
         stiffness = {stiffness}\n[[law]]\nname = \"oil\"\nreach = 2.0\ndamping = {damping}\n\
         [[body]]\nname = \"cart\"\nmotion = \"slide\"\ninertia = 1.0\n[[body]]\nname = \"rider\"\n\
         motion = \"slide\"\ninertia = 1.0\n[[spring]]\nname = \"block\"\nfrom = \"ground\"\n\
         to = \"cart\"\nlaw = \"foam\"\n[[spring]]\nname = \"pad\"\nfrom = \"cart\"\n\
         to = \"rider\"\nlaw = \"foam\"\nlaw_length = 2.0\nlaw_width = 3.0\n[[damper]]\n\
         name = \"pot\"\nfrom = \"ground\"\nto = \"cart\"\nlaw = \"oil\"\n"
    );
    Rig::parse(&text, "laws.toml").expect("the rig is sound")
}

/// `k + 3 c x^2` is the slope of a cubic spring, `c + 2 d v` that of quadratic drag.
#[test]
fn a_learned_law_that_is_a_polynomial_is_written_as_one() {
    let rig = on_laws("[40.0, 100.0]", "[0.5, 4.5]");
    let written = mjcf(&rig);
    assert_eq!(written.left_out, [""; 0]);
    let numbers = |tag: &str, key: &str| -> Vec<f64> {
        let (_, rest) = written.text.split_once(tag).expect("it is written");
        let (_, rest) = rest.split_once(&format!(" {key}=\"")).expect("it has one");
        let (list, _) = rest.split_once('"').expect("it ends");
        list.split(' ')
            .map(|n| n.parse().expect("a number"))
            .collect()
    };
    let near = |found: &[f64], wanted: &[f64]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        for (found, wanted) in found.iter().zip(wanted) {
            assert!(
                (found - wanted).abs() < 1e-6 * (1.0 + wanted),
                "{found} {wanted}"
            );
        }
    };
    near(
        &numbers("<joint name=\"cart\"", "stiffness"),
        &[40.0, 0.0, 2000.0],
    );
    near(&numbers("<joint name=\"cart\"", "damping"), &[0.5, 1.0]);
    // Twice as long and three times as wide: 1.5 times as stiff, the cubic part 3 / 8.
    near(
        &numbers("<fixed name=\"pad\"", "stiffness"),
        &[60.0, 0.0, 750.0],
    );
}

#[test]
fn a_learned_law_that_is_no_polynomial_is_named_with_how_far_off_it_is() {
    let rig = on_laws("[40.0, 30.0, 5.0, 1.0]", "[0.5, 4.5]");
    let written = mjcf(&rig);
    assert_eq!(written.left_out.len(), 2, "{:?}", written.left_out);
    for (line, name) in written.left_out.iter().zip(["block", "pad"]) {
        let what = format!("learned law of {name}: a polynomial stands for it, off by up to ");
        assert!(line.starts_with(&what), "{line}");
    }
}
