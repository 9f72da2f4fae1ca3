//! Logs and mechanisms of other programs, by the commands of docs/how-to/from-matlab-and-ros.md and
//! docs/how-to/use-with-mujoco.md.

use crate::desk::Desk;

fn desk(files: &[&str]) -> Desk {
    let desk = Desk::new();
    for file in files {
        desk.bring(&format!("tests/foreign/{file}"));
    }
    desk
}

#[test]
fn a_log_is_listed_and_converted() {
    let desk = desk(&["logs/logsout.mat", "logs/types.mat"]);
    let list = desk.succeed("convert logsout.mat --list");
    for line in [
        "MATLAB v5",
        "times logsout/angle/Time (24 rows, 50 Hz, 0.0 to 0.46 s)",
        "  logsout/command/Data  6 x 1  -> command_V",
    ] {
        assert!(list.contains(line), "{list}");
    }
    let said = desk.succeed("convert logsout.mat --join last --out recording.csv");
    let rule = "(1 column, 12.5 Hz): the last value at each row; 1 of 24 rows without one";
    assert!(said.contains(rule), "{said}");
    assert!(
        desk.read("recording.csv")
            .starts_with("t,angle_rad,command_V\n0.0,0.0,\n")
    );
    desk.succeed("convert types.mat --column u_V=x_int16 --column q_rad=q_rad:2 --out two.csv");
    assert!(
        desk.read("two.csv")
            .starts_with("t,u_V,q_rad\n0.0,0.0,1.5\n")
    );
    // Standard output holds the recording and nothing else.
    let printed = desk.succeed("convert types.mat --column q_rad=q_rad:2 --out -");
    assert!(
        printed.starts_with("t,q_rad\n") && printed.lines().count() == 25,
        "{printed}"
    );
}

#[test]
fn matlab_v7_3_and_a_bag_are_converted() {
    let desk = desk(&["logs/v73.mat", "logs/ros_zstd.mcap"]);
    desk.succeed("convert v73.mat --out v73.csv");
    assert!(
        desk.read("v73.csv")
            .starts_with("t,q1_rad,q2_rad,u_V\n0.0,0.0,1.5,2.0\n")
    );
    let list = desk.succeed("convert ros_zstd.mcap --list");
    assert!(list.contains("t = 0 is 1700000000.123456789 s"), "{list}");
    desk.succeed("convert ros_zstd.mcap --base /joint_states --out bag.csv");
    let bag = desk.read("bag.csv");
    assert!(
        bag.contains("shoulder_rad_s") && bag.contains("command"),
        "{bag}"
    );
}

#[test]
fn a_mechanism_becomes_a_rig_and_its_correction_a_list_of_changes() {
    let desk = desk(&[
        "mechanism/pendulum.xml",
        "mechanism/pendulum.urdf",
        "mechanism/chain.xml",
    ]);
    let said = desk.succeed("new --mjcf pendulum.xml --out rig.toml");
    assert!(said.contains("left out: pendulum.xml:11: light"), "{said}");
    let corrected = desk
        .read("rig.toml")
        .replace("damping = { value = 0.004 }", "damping = 0.006");
    desk.write("fitted.toml", &corrected);
    let said = desk.succeed("mjcf fitted.toml --out fitted.xml --changes pendulum.xml");
    let change = "pendulum.xml:14: joint \"shoulder\": damping = 0.006 (was 0.004)";
    assert!(said.contains(change), "{said}");
    let list = desk.read("fitted.changes.csv");
    let rows: Vec<&str> = list.lines().collect();
    assert_eq!(rows[0], "place,element,attribute,old,new");
    assert_eq!(
        rows[1],
        "pendulum.xml:14,\"joint \"\"shoulder\"\"\",damping,0.004,0.006"
    );
    assert_eq!(rows.len(), 2, "{list}");
    let said = desk.succeed("new --urdf pendulum.urdf --out urdf.toml");
    assert!(
        said.contains("left out: pendulum.urdf:10: visual"),
        "{said}"
    );
    desk.succeed("new --mjcf chain.xml --joint elbow --out elbow.toml");
    assert!(desk.read("elbow.toml").contains("input = \"m2_Nm\""));
}

#[test]
fn quiet_keeps_back_remarks_about_a_log_and_shows_its_faults() {
    let desk = desk(&["logs/bam.json"]);
    let errors = |line: &str| {
        let output = desk.sinew(line);
        let (text, errors) = (output.stdout, output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}");
        [text, errors].map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
    };
    let (remark, fault) = ("left out: `kp` = 200.0", "warning: dead_channel");
    let [text, loud] = errors("check bam.json");
    assert!(
        loud.contains(remark) && text.contains(fault),
        "{loud}{text}"
    );
    let [text, quiet] = errors("check bam.json --quiet");
    assert!(
        quiet.starts_with("bam.json:2: warning: dead_channel\n"),
        "{quiet}"
    );
    assert!(text.is_empty() && !quiet.contains(remark), "{text}{quiet}");
}
