//! Rig files as text: nothing makes the reader panic, and writing back keeps what the user wrote.

use proptest::prelude::*;
use sinew_sim::{Plant, Rig};

const RIGS: [&str; 2] = [
    include_str!("../../../rigs/mass-spring-damper.toml"),
    include_str!("../../../rigs/emps.toml"),
];

const COMPLICATED: &str = r#"# A finger.
format = "sinew-rig/1"
name = "finger"
body = [{ name = "motor", motion = "hinge", inertia = { value = 0.02 } }, { name = "tip", motion = "hinge", inertia = 0.1 }]

[[tendon]]   # along the back
name = "flexor"
path = [{ body = "motor", arm = 0.010 }, { body = "tip", arm = { value = 0.008, min = 0.0 } }]
stiffness.value = 2000.0   # N/m

[[sensor]]
name = "encoder"
reads = "tip.position"
signal = "q_deg"
unit = "deg"   # converted

[[actuator]]
name = "drive"
drives = "flexor"
input = "u_V"
gain = -1   # takes in
"#;

/// Text that a hand or a disk might have done to a rig: pieces cut, doubled, swapped, and symbols
/// that mean something dropped in.
fn mutilated() -> impl Strategy<Value = String> {
    let texts = prop::sample::select(vec![RIGS[0], RIGS[1], COMPLICATED]);
    let cut = (any::<prop::sample::Index>(), any::<prop::sample::Index>());
    let scraps = prop::sample::select(vec![
        "[[body]]",
        "[[",
        "]]",
        "[body]",
        "{",
        "}",
        "=",
        "\"",
        "'",
        "\n",
        "#",
        ".",
        ",",
        "inf",
        "nan",
        "-1",
        "0",
        "1e999",
        "99999999999999999999",
        "true",
        "[]",
        "{}",
        "1979-05-27",
        "µ",
        "\u{0}",
        "name",
        "inertia",
        "value",
        "[[effect]]\nkind='cubic_stiffness'\ncomponent='coil'\n",
        "ground",
        "unit = 'mm'",
        "path = [{}]",
        "\r\n",
        "\"\"\"",
        "stiffness.value = 3\n",
    ]);
    let edits = prop::collection::vec((0..4u8, cut, scraps), 1..6);
    (texts, edits).prop_map(|(text, edits)| {
        let mut chars: Vec<char> = text.chars().collect();
        for (kind, (a, b), scrap) in edits {
            if chars.is_empty() {
                break;
            }
            let (a, b) = (a.index(chars.len()), b.index(chars.len()));
            let (a, b) = (a.min(b), a.max(b).min(a.min(b) + 40));
            match kind {
                0 => drop(chars.drain(a..b)),
                1 => {
                    let piece: Vec<char> = chars[a..b].to_vec();
                    chars.splice(a..a, piece);
                }
                2 => drop(chars.splice(a..b, scrap.chars())),
                _ => drop(chars.splice(a..a, scrap.chars())),
            }
        }
        chars.into_iter().collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_text_makes_the_reader_panic(text in mutilated()) {
        match Rig::parse(&text, "rig.toml") {
            Ok(rig) => prop_assert!(Plant::new(&rig).is_ok_and(|p| !p.parameters().is_empty())
                || text.contains("unit")),
            Err(error) => prop_assert!(error.to_string().starts_with("rig.toml:")),
        }
    }

    #[test]
    fn no_noise_makes_the_reader_panic(text in "\\PC{0,200}") {
        prop_assert!(Rig::parse(&text, "rig.toml").is_err());
    }
}

#[test]
fn fitted_values_change_numbers_and_nothing_else() {
    let rig = Rig::parse(RIGS[1], "emps.toml").unwrap();
    let fitted = rig
        .with_values(&[
            ("carriage.inertia", 95.1089),
            ("screw.damping", 203.5034),
            ("carriage.coulomb_friction.level", 20.39),
            ("motor.gain", 35.0),
        ])
        .unwrap();
    let expected = RIGS[1]
        .replace("value = 95.0", "value = 95.1089")
        .replace("value = 203.0", "value = 203.5034")
        .replace("value = 20.0", "value = 20.39")
        .replace("gain = 35.1507", "gain = 35.0");
    assert_ne!(fitted.to_toml(), RIGS[1]);
    assert_eq!(fitted.to_toml(), expected);
    let plant = Plant::new(&fitted).unwrap();
    let inertia = &plant.parameters()[plant.slot("carriage.inertia").unwrap()];
    assert_eq!(
        (inertia.value, inertia.free, inertia.min),
        (95.1089, true, Some(10.0))
    );
}

#[test]
fn a_comment_stands_above_its_parameter_once() {
    let rig = Rig::parse(COMPLICATED, "finger.toml").unwrap();
    let plant = Plant::new(&rig).unwrap();
    for parameter in plant.parameters() {
        let name = parameter.name.as_str();
        // A parameter that the file leaves to its default has no line of its own.
        let Ok(rig) = rig.with_values(&[(name, parameter.value.max(0.5))]) else {
            continue;
        };
        let mut commented = rig.clone();
        for text in ["first", "second"] {
            commented = commented
                .with_comments("as seen:", &[(name, text)])
                .unwrap();
        }
        let own = format!("# {name} as seen: second");
        let added: Vec<&str> = (commented.to_toml().lines())
            .filter(|line| !rig.to_toml().lines().any(|other| other == *line))
            .collect();
        assert_eq!(added.len(), 1, "{name}: {added:?}");
        assert_eq!(added[0].trim(), own);
        let below = commented
            .to_toml()
            .lines()
            .skip_while(|line| line.trim() != own);
        assert!(below.clone().nth(1).is_some_and(|line| line.contains('=')));
    }
    let own = "[[body]]\nname = \"b\"\nmotion = \"slide\"\n[body.inertia]\nvalue = 1.0\n";
    let own = format!("format = \"sinew-rig/1\"\nname = \"r\"\n{own}");
    let own = Rig::parse(&own, "rig.toml").unwrap();
    let own = own
        .with_comments("as seen:", &[("b.inertia", "text")])
        .unwrap();
    assert!(
        own.to_toml()
            .contains("\n# b.inertia as seen: text\n[body.inertia]\n")
    );
    let unknown = rig.with_comments("as seen:", &[("nothing", "text")]);
    assert!(unknown.unwrap_err().to_string().contains("`nothing`"));
}

#[test]
fn any_spelling_of_a_parameter_is_written_back() {
    let rig = Rig::parse(COMPLICATED, "finger.toml").unwrap();
    let names: Vec<String> = Plant::new(&rig)
        .unwrap()
        .parameters()
        .iter()
        .map(|p| p.name.clone())
        .collect();
    assert!(names.contains(&"flexor.arm.tip".to_owned()), "{names:?}");
    let values: Vec<(&str, f64)> = names
        .iter()
        .map(String::as_str)
        .zip((1..).map(f64::from))
        .collect();
    let written = rig.with_values(&values).unwrap();
    let found = Plant::new(&written).unwrap().values();
    assert_eq!(found, values.iter().map(|&(_, v)| v).collect::<Vec<f64>>());
    for comment in [
        "# A finger.",
        "# along the back",
        "# N/m",
        "# converted",
        "# takes in",
    ] {
        assert!(written.to_toml().contains(comment), "{comment} is lost");
    }
}

#[test]
fn a_value_that_the_file_could_not_hold_is_refused() {
    let rig = Rig::parse(RIGS[0], "rig.toml").unwrap();
    let refuse =
        |name: &str, value: f64| rig.with_values(&[(name, value)]).unwrap_err().to_string();
    let report = [
        refuse("mass.inertia", -1.0),
        refuse("mass.inertia", 11.0),
        refuse("coil.stiffness", f64::NAN),
        refuse("mass.inerta", 1.0),
    ];
    insta::assert_snapshot!(report.join("\n"));
}

#[test]
fn parameters_have_names_units_and_bounds() {
    let rig = Rig::parse(COMPLICATED, "finger.toml").unwrap();
    let emps = Rig::parse(RIGS[1], "emps.toml").unwrap();
    let mut report = String::new();
    for rig in [rig, emps] {
        for p in Plant::new(&rig).unwrap().parameters() {
            report += &format!(
                "{} = {} {}{}{}{}\n",
                p.name,
                p.value,
                p.unit,
                if p.free { ", free" } else { "" },
                p.min.map_or(String::new(), |min| format!(", from {min}")),
                p.max.map_or(String::new(), |max| format!(", to {max}")),
            );
        }
    }
    insta::assert_snapshot!(report);
}
