//! Recordings that may be published: what the folder has, what it has not, and refusals.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

/// A rig and recordings of four devices.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    let rig = desk.read("mass-spring-damper.toml");
    desk.succeed("excite mass-spring-damper.toml --seconds 3 --no-table --quiet --out in.csv");
    for (name, mass) in [
        ("anna", "1.1"),
        ("bert", "0.9"),
        ("carl", "1.3"),
        ("dora", "1.0"),
    ] {
        let own = rig.replacen("value = 1.0,", &format!("value = {mass},"), 1);
        desk.write("own.toml", &own);
        desk.succeed(&format!(
            "simulate own.toml --input in.csv --out {name}.csv --with-inputs --noise 0.01 --quiet"
        ));
    }
    desk
}

const SHARE: &str = "share mass-spring-damper.toml --fit anna.csv --fit bert.csv --fit carl.csv \
                     --epsilon 20 --tolerance 1 --seconds 2 --quiet";

#[test]
fn a_folder_is_published_that_names_no_device_and_replacing_one_changes_no_file_name() {
    let desk = desk();
    let output = desk.sinew(&format!("{SHARE} --seed 4 --out shared"));
    let warned = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{warned}");
    assert!(warned.contains("publish nothing of this"), "{warned}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "");
    let text = desk.read("shared/share.json");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(violations(&schema("shared"), &document), [""; 0]);
    assert_eq!(document["private"], false);
    assert_eq!(document["recordings"].as_array().map(Vec::len), Some(3));
    let other = SHARE.replace("anna", "dora");
    desk.succeed(&format!("{other} --seed 4 --out other"));
    let files = |folder: &str| {
        let entries = std::fs::read_dir(desk.path(folder)).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    };
    assert_eq!(files("shared"), files("other"));
    for file in files("shared") {
        let (own, others) = (format!("shared/{file}"), format!("other/{file}"));
        let (own, others) = (desk.read(&own), desk.read(&others));
        assert_eq!(own.lines().count(), others.lines().count(), "{file}");
        for name in ["anna", "bert", "carl"] {
            assert!(!own.contains(name), "{file}");
        }
    }
    // Without a seed no two runs have the same noise.
    let sums = |folder: &str| {
        desk.succeed(&format!("{SHARE} --out {folder}"));
        let text = desk.read(&format!("{folder}/share.json"));
        let document: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(document["private"], true);
        document["noisy_sums"].clone()
    };
    assert_ne!(sums("one"), sums("two"));
}

/// A device would be placed at the edge of the region, and the release would be of something else.
#[test]
fn a_recording_whose_times_are_milliseconds_is_refused_before_anything_is_released() {
    let desk = desk();
    let text = desk.read("anna.csv");
    let late = text.lines().map(|line| match line.split_once(',') {
        Some((t, rest)) if t.parse::<f64>().is_ok() => {
            format!("{},{rest}\n", t.parse::<f64>().unwrap_or(0.0) * 1000.0)
        }
        _ => format!("{line}\n"),
    });
    desk.write("anna.csv", &late.collect::<String>());
    let output = desk.sinew(&format!("{SHARE} --out shared"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_ne!(output.status.code(), Some(0), "{errors}");
    assert!(errors.contains("milliseconds"), "{errors}");
    let mut released = std::fs::read_dir(desk.path("shared")).expect("a folder");
    assert!(released.next().is_none());
}

/// The rig may be called rig.toml and a recording device-01.csv, as in a release.
#[test]
fn a_release_replaces_no_file() {
    let desk = desk();
    let rig = desk.read("mass-spring-damper.toml");
    desk.write("rig.toml", &rig);
    let recorded = desk.read("anna.csv");
    desk.write("device-01.csv", &recorded);
    let line = SHARE.replace("anna", "device-01");
    let line = line.replace("mass-spring-damper", "rig");
    for out in [".", "device-01.csv"] {
        let output = desk.sinew(&format!("{line} --out {out}"));
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{out}: {errors}");
        assert!(errors.contains("new or empty"), "{out}: {errors}");
    }
    assert_eq!(desk.read("rig.toml"), rig);
    assert_eq!(desk.read("device-01.csv"), recorded);
}

#[test]
fn a_fleet_that_is_too_small_and_a_second_release_are_refused() {
    let desk = desk();
    let line = SHARE.replace("--tolerance 1", "--tolerance 0.05");
    let output = desk.sinew(&format!("{line} --out shared"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("3 devices are too few"), "{errors}");
    assert!(errors.contains("devices at epsilon 20"), "{errors}");
    assert!(!desk.path("shared/share.json").exists());
    desk.succeed(&format!("{SHARE} --out shared"));
    let before = desk.read("shared/share.json");
    let output = desk.sinew(&format!("{SHARE} --out shared"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(errors.contains("spends its budget again"), "{errors}");
    assert_eq!(desk.read("shared/share.json"), before);
}
