//! Files of other programs against the numbers that those programs put in
//! (`tests/foreign/logs.py`).

use std::path::{Path, PathBuf};

use sinew_convert::{Format, Join, Table, Wanted, bases, format, read, table};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/foreign/logs")
}

fn bytes(file: &str) -> Vec<u8> {
    std::fs::read(folder().join(file)).expect("the file is committed")
}

fn converted(file: &str, wanted: &Wanted) -> Table {
    let bytes = bytes(file);
    let extension = file.rsplit('.').next().expect("a file with an extension");
    let format = format(&bytes, extension).expect("a known format");
    let contents = read(&bytes, format).unwrap_or_else(|error| panic!("{file}: {error}"));
    table(&contents, wanted).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// Names and columns of a CSV, the times first.
fn csv(file: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = String::from_utf8(bytes(file)).expect("text");
    let mut lines = text.lines();
    let header = lines.next().expect("a header").split(',');
    let names: Vec<String> = header.map(str::to_owned).collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, field) in columns.iter_mut().zip(line.split(',')) {
            column.push(field.parse().unwrap_or(f64::NAN));
        }
    }
    (names, columns)
}

/// The same names, and the same bits in every number.
fn same(found: &Table, expected: &str) {
    let (names, columns) = csv(expected);
    let mut all = vec![("t".to_owned(), found.t.clone())];
    all.extend(found.columns.iter().cloned());
    let found_names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    let mut sorted = (found_names.clone(), names.clone());
    sorted.0.sort_unstable();
    sorted.1.sort_unstable();
    assert_eq!(sorted.0, sorted.1, "{expected}");
    for (name, expected_values) in names.iter().zip(&columns) {
        let (_, values) = all
            .iter()
            .find(|(other, _)| other == name)
            .expect("checked above");
        assert_eq!(values.len(), expected_values.len(), "{expected}: {name}");
        for (row, (one, other)) in values.iter().zip(expected_values).enumerate() {
            let same = one.to_bits() == other.to_bits()
                || one == other
                || (one.is_nan() && other.is_nan());
            assert!(same, "{expected}: {name}, row {row}: {one:?} for {other:?}");
        }
    }
}

#[test]
fn matlab_level_5_of_scipy_has_numpys_numbers() {
    for name in [
        "row", "column", "packed", "types", "struct", "simulink", "logsout",
    ] {
        same(
            &converted(&format!("{name}.mat"), &Wanted::default()),
            &format!("{name}.csv"),
        );
    }
}

#[test]
fn another_base_comes_in_on_a_straight_line_where_asked() {
    let wanted = Wanted {
        join: Join::Linear,
        ..Wanted::default()
    };
    let found = converted("logsout.mat", &wanted);
    let (names, columns) = csv("logsout.linear.csv");
    for (name, expected) in names.iter().zip(&columns).skip(1) {
        let (_, values) = found
            .columns
            .iter()
            .find(|(other, _)| other == name)
            .unwrap();
        for (one, other) in values.iter().zip(expected) {
            let close = (one - other).abs() < 1e-14 || (one.is_nan() && other.is_nan());
            assert!(close, "{name}: {one:?} for {other:?}");
        }
    }
    let line = "`logsout/command/Time` (1 column, 12.5 Hz): a straight line at each row; 4 of 24 \
                rows without one";
    assert!(
        found.said.iter().any(|said| said == line),
        "{:?}",
        found.said
    );
}

#[cfg(feature = "hdf5")]
#[test]
fn hdf5_of_h5py_has_numpys_numbers() {
    same(&converted("v73.mat", &Wanted::default()), "v73.csv");
    same(&converted("plain.h5", &Wanted::default()), "plain.csv");
}

#[test]
fn mcap_of_its_own_package_has_numpys_numbers_whatever_its_compression() {
    for name in ["ros", "ros_zstd", "ros_lz4"] {
        same(
            &converted(&format!("{name}.mcap"), &Wanted::default()),
            &format!("{name}.csv"),
        );
    }
}

#[test]
fn logs_of_bam_get_names_with_units() {
    let found = converted("bam.json", &Wanted::default());
    same(&found, "bam.csv");
    // What is no sample is said.
    for left_out in ["`mass` = 0.49", "`motor`: text \"xl330\""] {
        let line = format!("left out: {left_out}");
        assert!(found.said.contains(&line), "{:?}", found.said);
    }
}

#[test]
fn a_topic_that_is_not_read_is_listed() {
    let contents = read(&bytes("image.mcap"), Format::Mcap).unwrap();
    assert_eq!(contents.others[0].path, "/camera");
    assert_eq!(
        contents.others[0].what,
        "1 messages of sensor_msgs/msg/Image (cdr)"
    );
    assert!(bases(&contents).is_empty());
    let error = table(&contents, &Wanted::default()).unwrap_err();
    assert!(error.message.contains("no times"), "{error}");
}

#[test]
fn columns_are_chosen_by_path_and_number() {
    let wanted = |columns: &[(&str, &str)], base: Option<&str>| Wanted {
        columns: (columns.iter())
            .map(|(name, path)| ((*name).to_owned(), (*path).to_owned()))
            .collect(),
        base: base.map(str::to_owned),
        join: Join::Last,
    };
    let found = converted("types.mat", &wanted(&[("w_rad_s", "q_rad:2")], None));
    assert_eq!(found.columns[0].1, csv("types.csv").1.pop().unwrap());
    let by_dots = converted(
        "struct.mat",
        &wanted(&[("q_rad", "log.motor.angle_rad")], None),
    );
    assert_eq!(by_dots.columns[0].1[1], csv("struct.csv").1[1][1]);
    // Rows of the command: its own six times.
    let rows = converted("logsout.mat", &wanted(&[], Some("logsout/command")));
    assert_eq!(rows.t.len(), 6);
    let contents = read(&bytes("types.mat"), Format::Mat5).unwrap();
    for (column, expected) in [
        (("q", "q_rad"), "has 2 signals"),
        (("q", "q_rad:3"), "not 3"),
        (("q", "q_rad:0"), "not 0"),
        (("q", "qrad"), "no numbers at `qrad`"),
        (("t", "q_rad:1"), "cannot name"),
    ] {
        let error = table(&contents, &wanted(&[column], None)).unwrap_err();
        assert!(error.message.contains(expected), "{error}");
    }
}

#[test]
fn times_that_go_back_are_an_error_with_their_place() {
    let text = br#"{"t": [0.0, 0.2, 0.1], "q_rad": [1, 2, 3]}"#;
    let contents = read(text, Format::Json).unwrap();
    let error = table(&contents, &Wanted::default())
        .unwrap_err()
        .to_string();
    let expected = "`t` does not increase at its value 3: 0.1 after 0.2";
    assert!(error.starts_with(expected), "{error}");
}

#[test]
fn names_that_meet_get_their_groups_and_none_is_lost() {
    let text = br#"{"a": {"t": [0, 1], "q_rad": [1, 2]}, "b": {"t": [0, 1], "q_rad": [3, 4]},
                   "c": {"time": [0, 1], "t": [5, 6]}}"#;
    let contents = read(text, Format::Json).unwrap();
    let found = table(&contents, &Wanted::default()).unwrap();
    let names: Vec<&str> = found
        .columns
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(names, ["a_q_rad", "b_q_rad"]);
    assert!(
        found.said.iter().any(|said| said.contains("`c/")),
        "{:?}",
        found.said
    );
}

#[test]
fn a_matrix_with_a_million_signals_is_an_error_at_once() {
    let row = format!("[{}0]", "0,".repeat(999_999));
    let text = format!("{{\"t\": [0, 1], \"x\": [{row}, {row}]}}");
    let contents = read(text.as_bytes(), Format::Json).unwrap();
    let error = table(&contents, &Wanted::default()).unwrap_err();
    assert!(error.message.starts_with("1000000 signals"), "{error}");
}

#[test]
fn null_is_a_missing_sample_and_true_is_one() {
    let text =
        br#"[{"t": 0, "q_rad": 1.5}, {"t": 1, "q_rad": null}, {"t": 2}, {"t": 3, "q_rad": true}]"#;
    let contents = read(text, Format::Json).unwrap();
    let found = table(&contents, &Wanted::default()).unwrap();
    let (_, q) = &found.columns[0];
    assert_eq!((q[0], q[3]), (1.5, 1.0));
    assert!(q[1].is_nan() && q[2].is_nan());
}

#[test]
fn a_changed_byte_in_a_chunk_fails_its_checksum() {
    let mut file = bytes("ros.mcap");
    let place = file
        .windows(8)
        .position(|part| part == b"shoulder")
        .unwrap();
    file[place] = b'S';
    let error = read(&file, Format::Mcap).unwrap_err();
    assert!(error.message.contains("its checksum differs"), "{error}");
}
