//! A sensor that gave next to nothing.

use sinew_ident::check::check;
use sinew_ident::recording::Recording;
use sinew_sim::Rig;

/// Sixty rows in which the sensor has a value in the first `valid` ones.
fn recording(valid: u32) -> Recording {
    let rows: String = (0..60)
        .map(|k| {
            if k < valid {
                format!("{},{},1\n", 0.01 * f64::from(k), f64::from(k).sin())
            } else {
                format!("{},,1\n", 0.01 * f64::from(k))
            }
        })
        .collect();
    Recording::parse(format!("t,q_m,u_N\n{rows}").as_bytes(), "a.csv").unwrap()
}

fn rig() -> Rig {
    let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\nmotion = \"slide\"\n\
                inertia = 1.0\n[[actuator]]\nname = \"push\"\ndrives = \"m\"\ninput = \"u_N\"\n\
                gain = 1.0\n[[sensor]]\nname = \"s\"\nreads = \"m.position\"\nsignal = \"q_m\"\n";
    Rig::parse(text, "x.toml").unwrap()
}

#[test]
fn a_sensor_with_next_to_no_value_is_named_and_is_certain_where_a_rig_asks_for_it() {
    for (valid, said) in [
        (1, "q_m has 1 value in 60 rows"),
        (19, "q_m has 19 values in 60 rows"),
    ] {
        for (rig, certain) in [(None, false), (Some(rig()), true)] {
            let found = check(&[recording(valid)], rig.as_ref());
            let found: Vec<_> = found.iter().filter(|c| c.kind == "dead_channel").collect();
            assert_eq!(found.len(), 1, "{valid}: {found:?}");
            assert_eq!(found[0].sentence, said);
            assert_eq!(found[0].certain, certain);
        }
    }
    let found = check(&[recording(20)], Some(&rig()));
    assert!(found.iter().all(|c| c.kind != "dead_channel"), "{found:?}");
}
