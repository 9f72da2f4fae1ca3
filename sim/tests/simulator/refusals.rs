//! Every refusal of a rig file, word for word: file, line, column, what was expected, what was
//! meant.

use super::broken_rigs::{SOUND, refusals};
use sinew_sim::Rig;
use sinew_sim::effects::{Kind, Sign};

/// (what is replaced, by what): the first place only.
const CASES: &[(&str, &str)] = &[
    ("format = \"sinew-rig/1\"", ""),
    ("sinew-rig/1", "sinew-rig/2"),
    ("format = \"sinew-rig/1\"", "format = 1"),
    ("name = \"two-mass drive\"", ""),
    ("[[body]]", "[[bodi]]"),
    ("[[body]]", "[[body]"),
    ("name = \"motor\"", "name = \"motor\"\nname = \"again\""),
    ("motion = \"hinge\"", "motion = \"hing\""),
    ("motion = \"hinge\"", "motion = 3"),
    ("motion = \"hinge\"\n", ""),
    ("inertia = { value = 0.02 }", "inertia = { value = 0.0 }"),
    ("inertia = { value = 0.02 }", "inertia = -0.02"),
    ("inertia = { value = 0.02 }", "inertia = inf"),
    ("inertia = { value = 0.02 }", "inertia = { value = nan }"),
    ("inertia = { value = 0.02 }", "inertia = \"heavy\""),
    ("inertia = { value = 0.02 }", "inertia = { valeu = 0.02 }"),
    ("inertia = { value = 0.02 }", "inertia = {}"),
    ("inertia = { value = 0.02 }", "inertia = 0.02\nstart = true"),
    (
        "inertia = { value = 0.02 }",
        "inertia = 0.0\nmotion_from = \"\"",
    ),
    (
        "inertia = { value = 0.02 }",
        "inertia = 0.0\nmotion_from = \"q_rad\"\nstart = 0.1",
    ),
    (
        "inertia = { value = 0.02 }",
        "inertia = 0.02\nunit = \"mm\"",
    ),
    (
        "inertia = { value = 0.02 }",
        "inertia = -1.0\nmotion_from = \"q_rad\"",
    ),
    ("min = 0.01", "min = 0.5"),
    ("min = 0.01", "min = 2.0"),
    ("name = \"load\"", "name = \"motor\""),
    ("name = \"load\"", "name = \"ground\""),
    ("name = \"load\"", "name = \"lo.ad\""),
    ("name = \"shaft\"", "name = \"motor\""),
    ("from = \"motor\"", "from = \"moter\""),
    ("from = \"motor\"", "from = \"load\""),
    ("from = \"motor\"", "from = \"carriage\""),
    (
        "stiffness = { value = 30.0 }",
        "stifness = { value = 30.0 }",
    ),
    (
        "stiffness = { value = 30.0 }",
        "stiffness = { value = -30.0 }",
    ),
    ("body = \"load\"", "body = \"weight\""),
    (
        "{ body = \"motor\", arm = 0.010 }, ",
        "{ body = \"load\", arm = 0.010 }, ",
    ),
    ("arm = 0.010", "arm = 0.0"),
    ("arm = 0.010", "amr = 0.010"),
    (
        "path = [{ body = \"motor\", arm = 0.010 }, { body = \"load\", arm = 0.008 }]",
        "path = []",
    ),
    (
        "path = [{ body = \"motor\", arm = 0.010 }, { body = \"load\", arm = 0.008 }]",
        "path = \"motor\"",
    ),
    ("drives = \"motor\"", "drives = \"encoder\""),
    ("drives = \"motor\"", "drives = \"motr\""),
    ("input = \"u_V\"", "input = \"\""),
    ("limit = [-10.0, 10.0]", "limit = [10.0, -10.0]"),
    ("limit = [-10.0, 10.0]", "limit = 10.0"),
    ("limit = [-10.0, 10.0]", "hold = \"lineal\""),
    ("limit = [-10.0, 10.0]", "rate_limit = 0.0"),
    ("limit = [-10.0, 10.0]", "unit = \"milivolt\""),
    ("reads = \"load.position\"", "reads = \"load\""),
    ("reads = \"load.position\"", "reads = \"load.postion\""),
    ("reads = \"load.position\"", "reads = \"lod.position\""),
    ("reads = \"load.position\"", "reads = \"load.tension\""),
    ("reads = \"load.position\"", "reads = \"load.effort\""),
    ("reads = \"load.position\"", "reads = \"drive.effort\""),
    ("signal = \"q_rad\"", "signal = \"q_rad\"\ngain = 0.0"),
    ("kind = \"coulomb_friction\"", "kind = \"coulomb_fricton\""),
    ("kind = \"coulomb_friction\"", "kind = \"backlash\""),
    ("kind = \"coulomb_friction\"", "kind = \"magic\""),
    (
        "kind = \"coulomb_friction\"",
        "kind = \"stribeck_friction\"",
    ),
    ("component = \"load\"", "component = \"shaft\""),
    ("component = \"load\"", "component = \"laod\""),
    ("level = { value = 0.1 }", "level = { value = -0.1 }"),
    (
        "[control]",
        "[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"load\"\nlevel = 0.2\n[control]",
    ),
];

#[test]
fn every_refusal_names_its_place() {
    insta::assert_snapshot!(refusals(SOUND, CASES, Rig::parse));
}

/// `[control]` and `[network]` are for programs that read them; the plant keeps their text.
#[test]
fn tables_of_other_programs_are_kept_unread() {
    let text = SOUND.replace("rate_hz = 120.0", "rate_hzz = true");
    let rig = Rig::parse(&text, "rig.toml").expect("the plant does not read [control]");
    assert_eq!(rig.to_toml(), text);
    let unknown = rig.read_tables(|tables| match tables.table("control")? {
        Some(control) => control.allow(&["rate_hz", "outputs", "horizon", "control_horizon"]),
        None => Ok(()),
    });
    let refused = unknown.expect_err("the key is misspelt").to_string();
    let expected = "unknown key `rate_hzz` in [control]\n  help: did you mean `rate_hz`?";
    assert!(refused.contains(expected), "{refused}");
}

#[test]
fn files_that_are_no_rig_are_refused() {
    let mut report = String::new();
    let only_head = "format = \"sinew-rig/1\"\nname = \"nothing\"\n";
    for text in [
        "",
        "  \n\t\n",
        "# a comment\n",
        "just words",
        "<?xml version=\"1.0\"?>\n<mujoco model=\"arm\"/>",
        "<robot name=\"arm\"/>",
        only_head,
        "body = 3\nformat = \"sinew-rig/1\"\nname = \"x\"",
    ] {
        let refused = Rig::parse(text, "rig.toml").unwrap_err();
        report += &format!("--- {}\n{refused}\n", text.escape_debug());
    }
    let absent = Rig::load("no/such/rig.toml").unwrap_err();
    report += &format!("--- a file that is not there\n{absent}\n");
    insta::assert_snapshot!(report);
}

/// One sound instance of every kind at one place; every number of every kind is then spoilt.
#[test]
fn every_number_of_every_effect_is_checked() {
    let head = SOUND.split("[[effect]]").next().expect("a head");
    // A pair of bodies of one motion that no spring joins.
    let sound = Rig::parse(&head.replace("slide", "hinge"), "rig.toml");
    let sound = sound.unwrap_or_else(|error| panic!("{error}"));
    let mut tried = 0;
    for kind in Kind::ALL {
        let Some(&site) = kind.sites(&sound).first() else {
            panic!("{kind:?} has no place in this rig");
        };
        let description = kind.description();
        let values: Vec<f64> = (description.parameters.iter())
            .map(|spec| if spec.sign == Sign::Side { -1.0 } else { 1.5 })
            .collect();
        let with = sound.with_effect(*kind, site, &values);
        let text = with
            .unwrap_or_else(|error| panic!("{error}"))
            .to_toml()
            .to_owned();
        let table = text
            .lines()
            .position(|line| line == "[[effect]]")
            .expect("the effect was added");
        for (index, spec) in description.parameters.iter().enumerate() {
            let line = table + 3 + index;
            for (wrong, allowed) in [
                ("nan", false),
                ("{ value = inf }", false),
                ("\"much\"", false),
                ("-2.0", spec.sign == Sign::Any),
            ] {
                let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
                assert!(
                    lines[line].starts_with(spec.name),
                    "{}: {}",
                    description.kind,
                    lines[line]
                );
                lines[line] = format!("{} = {wrong}", spec.name);
                let place = format!("rig.toml:{}:", line + 1);
                match Rig::parse(&lines.join("\n"), "rig.toml") {
                    Ok(_) => assert!(allowed, "{} = {wrong} of {}", spec.name, description.kind),
                    Err(error) => {
                        let said = error.to_string();
                        assert!(!allowed && said.starts_with(&place), "{said}");
                    }
                }
                tried += 1;
            }
            let mut lines: Vec<&str> = text.lines().collect();
            lines.remove(line);
            if spec.default.is_some() {
                continue;
            }
            let lacking = Rig::parse(&lines.join("\n"), "rig.toml");
            let said = lacking.expect_err("it lacks a number").to_string();
            assert!(said.contains(&format!("lacks `{}`", spec.name)), "{said}");
        }
    }
    assert!(tried > 100, "{tried}");
}
