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
