//! Learned laws in a rig: energy, derivatives, files, shared numbers and refusals.

use crate::broken_rigs::refusals;
use crate::mechanisms::{plant, run, times};
use proptest::prelude::*;
use sinew_sim::{Dual, InputTrajectory, LawKind, LawShape, Plant, Rig, Scalar};

/// Two bodies on springs that share a law, with a damper that has one, too.
fn chain(stiffness: &[f64], damping: &[f64], start: f64, odd: bool) -> String {
    format!(
        "[[law]]\nname = \"foam\"\nreach = 0.1\nodd = {odd}\nstiffness = {stiffness:?}\n\
         [[law]]\nname = \"oil\"\nreach = 0.5\ndamping = {damping:?}\n\
         [[body]]\nname = \"a\"\nmotion = \"slide\"\ninertia = 1.3\nstart = {start:?}\n\
         [[body]]\nname = \"b\"\nmotion = \"slide\"\ninertia = 0.6\nstart_velocity = -0.5\n\
         [[spring]]\nname = \"one\"\nfrom = \"ground\"\nto = \"a\"\nlaw = \"foam\"\n\
         [[spring]]\nname = \"two\"\nfrom = \"a\"\nto = \"b\"\nlaw = \"foam\"\nlaw_length = 2.0\n\
         law_width = 3.0\nrest = 0.02\n\
         [[damper]]\nname = \"pot\"\nfrom = \"a\"\nto = \"b\"\nlaw = \"oil\"\n\
         [[sensor]]\nname = \"xa\"\nreads = \"a.position\"\nsignal = \"xa_m\"\n\
         [[sensor]]\nname = \"va\"\nreads = \"a.velocity\"\nsignal = \"va_m_s\"\n\
         [[sensor]]\nname = \"xb\"\nreads = \"b.position\"\nsignal = \"xb_m\"\n\
         [[sensor]]\nname = \"vb\"\nreads = \"b.velocity\"\nsignal = \"vb_m_s\"\n"
    )
}

/// Potential of a law by Simpson's rule, which the plant does not use.
fn potential(numbers: &[f64], odd: bool, [length, width]: [f64; 2], x: f64) -> f64 {
    let shape = LawShape {
        kind: LawKind::Spring,
        odd,
        reach: 0.1,
        length,
        width,
    };
    let parts = 400;
    let step = x / f64::from(parts);
    let force = |k: f64| shape.resistance(numbers, k * step);
    let inner = (0..parts).map(|k| {
        let k = f64::from(k);
        (force(k) + 4.0 * force(k + 0.5) + force(k + 1.0)) * step / 6.0
    });
    inner.sum()
}

fn energies(stiffness: &[f64], damping: &[f64], start: f64, odd: bool) -> Vec<f64> {
    let plant = plant(&chain(stiffness, damping, start, odd));
    let run = run(&plant, &times(300, 0.01), &[]);
    let energy = |row: &[f64]| {
        let [xa, va, xb, vb] = [row[0], row[1], row[2], row[3]];
        0.65 * va * va
            + 0.3 * vb * vb
            + potential(stiffness, odd, [1.0, 1.0], xa)
            + potential(stiffness, odd, [2.0, 3.0], xb - xa - 0.02)
    };
    run.signals.chunks(run.sensors).map(energy).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_rig_with_learned_laws_never_gains_energy(
        stiffness in prop::collection::vec(0.0..300.0, 9),
        damping in prop::collection::vec(0.0..4.0, 5),
        start in -0.25..0.25f64,
        odd in any::<bool>(),
    ) {
        let energies = energies(&stiffness, &damping, start, odd);
        let mut lowest = energies[0];
        for (row, energy) in energies.iter().enumerate() {
            prop_assert!(
                energy - lowest <= 1e-5 * (energies[0] + 1.0),
                "energy grew by {:e} of {} by row {row}", energy - lowest, energies[0]
            );
            lowest = lowest.min(*energy);
        }
    }
}

#[test]
fn energy_stays_without_a_damping_and_falls_with_one() {
    let stiffness = [40.0, 42.0, 50.0, 60.0, 90.0];
    let kept = energies(&stiffness, &[0.0; 3], 0.15, true);
    assert!((kept[299] / kept[0] - 1.0).abs() < 1e-5, "{kept:?}");
    let lost = energies(&stiffness, &[0.1, 0.3, 1.0], 0.15, true);
    assert!(lost[299] < 0.7 * lost[0], "{lost:?}");
}

/// The plant's own derivatives, through every crossing of a knot, are those of differences.
#[test]
fn derivatives_by_the_numbers_of_a_law_are_those_of_differences() {
    let stiffness = [40.0, 42.0, 50.0, 60.0, 90.0];
    let damping = [0.1, 0.3, 1.0];
    let plant = plant(&chain(&stiffness, &damping, 0.15, true));
    let times = times(120, 0.01);
    let last = |values: &[f64]| simulate(&plant, values, &times);
    for k in 0..8 {
        let slot = if k < 5 {
            plant.slot(&format!("foam.stiffness.{k}"))
        } else {
            plant.slot(&format!("oil.damping.{}", k - 5))
        };
        let slot = slot.expect("the law has this number");
        let values = plant.values();
        let mut dual: Vec<Dual<1>> = values.iter().map(|&v| Dual::constant(v)).collect();
        dual[slot] = Dual::variable(values[slot], 0);
        let start = plant.initial_state(&dual, &[None; 4]).unwrap();
        let drive = InputTrajectory::new(&plant, times.len(), &[]).unwrap();
        let exact = plant.simulate(&dual, &start, &drive, &times).unwrap();
        let h = 1e-5 * values[slot];
        let moved = |by: f64| {
            let mut values = values.clone();
            values[slot] += by;
            last(&values)
        };
        let (up, down) = (moved(h), moved(-h));
        for sensor in 0..4 {
            let by = (up[sensor] - down[sensor]) / (2.0 * h);
            let exact = exact.signal(times.len() - 1, sensor).derivative[0];
            assert!(
                (exact - by).abs() < 1e-5 * (1.0 + by.abs()),
                "{k} {sensor}: {exact} {by}"
            );
        }
    }
}

fn simulate(plant: &Plant, values: &[f64], times: &[f64]) -> Vec<f64> {
    let start = plant.initial_state(values, &[None; 4]).unwrap();
    let drive = InputTrajectory::new(plant, times.len(), &[]).unwrap();
    let run = plant.simulate(values, &start, &drive, times).unwrap();
    (0..4)
        .map(|sensor| run.signal(times.len() - 1, sensor))
        .collect()
}

const HEAD: &str = "format = \"sinew-rig/1\"\nname = \"test\"\n";

#[test]
fn components_that_share_a_law_share_its_numbers_and_a_fit_may_write_free_ones() {
    let tables = chain(&[40.0, 42.0, 50.0], &[0.1, 0.3], 0.1, true);
    let free = tables.replace(
        "[40.0, 42.0, 50.0]",
        "[40.0, { value = 42.0, min = 1.0 }, 50.0]",
    );
    let rig = Rig::parse(&format!("{HEAD}{free}"), "rig.toml").unwrap();
    let plant = Plant::new(&rig).unwrap();
    let named: Vec<&str> = (plant.parameters().iter().map(|p| p.name.as_str()))
        .filter(|name| name.starts_with("foam."))
        .collect();
    assert_eq!(
        named,
        ["foam.stiffness.0", "foam.stiffness.1", "foam.stiffness.2"]
    );
    let fitted = rig.with_values(&[("foam.stiffness.1", 45.5)]).unwrap();
    assert!(
        fitted
            .to_toml()
            .contains("[40.0, { value = 45.5, min = 1.0 }, 50.0]")
    );
    assert_eq!(fitted.laws[0].values(), [40.0, 45.5, 50.0]);
}

#[test]
fn a_law_file_is_taken_into_the_rig_and_travels_with_it() {
    let folder = std::env::temp_dir().join(format!("sinew-law-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let law = "format = \"sinew-law/1\"\nname = \"foam\"\nreach = 0.1\n\
               stiffness = [40.0, 42.5, 50.0]\n[learned]\nfrom = [\"a.csv\"]\n";
    std::fs::write(folder.join("foam.law.toml"), law).unwrap();
    let rig = "format = \"sinew-rig/1\"\nname = \"test\"\n[[body]]\nname = \"a\"\n\
               motion = \"slide\"\ninertia = 1.0\n[[spring]]\nname = \"coil\"\nfrom = \"ground\"\n\
               to = \"a\"\nlaw = \"foam.law.toml\"";
    let file = folder.join("rig.toml");
    std::fs::write(&file, rig).unwrap();
    let loaded = Rig::load(&file).unwrap();
    assert_eq!(loaded.laws[0].values(), [40.0, 42.5, 50.0]);
    assert!(loaded.to_toml().starts_with(rig));
    // Elsewhere, where the file is not.
    let again = Rig::parse(loaded.to_toml(), "elsewhere/rig.toml").unwrap();
    assert_eq!(again.laws[0].values(), loaded.laws[0].values());
    assert_eq!(again.to_toml(), loaded.to_toml());

    // A file that is broken, and one that is not there: the place, and the likely fix.
    std::fs::write(folder.join("foam.law.toml"), law.replace("42.5", "-42.5")).unwrap();
    let said = Rig::load(&file).unwrap_err().to_string();
    assert!(
        said.contains("foam.law.toml:4:20: `stiffness` of a law: expected zero or more"),
        "{said}"
    );
    std::fs::write(&file, rig.replace("foam.law", "fom.law")).unwrap();
    let said = Rig::load(&file).unwrap_err().to_string();
    assert!(
        said.contains("rig.toml:11:7: `law` of spring `coil`: cannot read"),
        "{said}"
    );
    assert!(said.contains("did you mean"), "{said}");
    // A folder, or a device without an end, is no law.
    std::fs::write(&file, rig.replace("foam.law.toml", "./")).unwrap();
    let said = Rig::load(&file).unwrap_err().to_string();
    assert!(said.contains("it is no regular file"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
}

const SOUND: &str = r#"format = "sinew-rig/1"
name = "on foam"

[[law]]
name = "foam"
motion = "slide"
reach = 0.1
stiffness = [40.0, 42.0, 50.0]

[[law]]
name = "oil"
reach = 0.5
damping = [0.1, 0.3]

[[body]]
name = "mass"
motion = "slide"
inertia = 1.0

[[body]]
name = "arm"
motion = "hinge"
inertia = 1.0

[[spring]]
name = "coil"
from = "ground"
to = "mass"
law = "foam"
law_length = 2.0

[[damper]]
name = "pot"
from = "ground"
to = "mass"
law = "oil"

[[spring]]
name = "torsion"
from = "ground"
to = "arm"
stiffness = 3.0
"#;

#[test]
fn refusals_of_laws_word_for_word() {
    let cases = [
        ("name = \"oil\"", "name = \"foam\""),
        ("reach = 0.1\n", ""),
        ("reach = 0.1", "reach = 0.0"),
        ("reach = 0.1", "reach = 0.1\nreech = 0.2"),
        ("stiffness = [40.0, 42.0, 50.0]\n", ""),
        ("stiffness = [40.0, 42.0, 50.0]", "stiffness = 40.0"),
        ("stiffness = [40.0, 42.0, 50.0]", "stiffness = [40.0]"),
        (
            "stiffness = [40.0, 42.0, 50.0]",
            "stiffness = [40.0, -2.0, 5.0]",
        ),
        (
            "stiffness = [40.0, 42.0, 50.0]",
            "stiffness = [40.0, nan, 5.0]",
        ),
        (
            "stiffness = [40.0, 42.0, 50.0]",
            "stiffness = [40.0, \"soft\"]",
        ),
        (
            "reach = 0.1\nstiffness",
            "reach = 0.1\nodd = false\nmonotone = \"no\"\nstiffness",
        ),
        (
            "stiffness = [40.0, 42.0, 50.0]",
            "stiffness = [40.0, 42.0, 50.0, 1.0]\nodd = false",
        ),
        (
            "damping = [0.1, 0.3]",
            "damping = [0.1, 0.3]\nstiffness = [1.0, 2.0]",
        ),
        (
            "damping = [0.1, 0.3]",
            "damping = [0.1, 0.3]\nmonotone = false",
        ),
        ("law = \"foam\"", "law = \"foams\""),
        ("law = \"foam\"", "law = \"oil\""),
        ("law = \"foam\"", "law = \"foam\"\nstiffness = 3.0"),
        ("law = \"foam\"", "stiffness = 3.0"),
        ("law = \"oil\"", "law = \"foam\""),
        ("law_length = 2.0", "law_length = -2.0"),
        ("stiffness = 3.0", "law = \"foam\""),
        ("stiffness = 3.0", "law = \"no/such.toml\""),
    ];
    insta::assert_snapshot!(refusals(SOUND, &cases, Rig::parse));
}
