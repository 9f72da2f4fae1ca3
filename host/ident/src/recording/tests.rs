//! Refusals, kept samples, and speed.

use proptest::prelude::*;

use super::*;

fn parse(text: &str) -> Result<Recording> {
    Recording::parse(text.as_bytes(), "a.csv")
}

fn refusal(text: &str) -> String {
    parse(text)
        .expect_err("this text should have been refused")
        .to_string()
}

#[test]
fn comments_blank_lines_mark_and_line_ends_do_not_matter() {
    let plain = parse("t,u_V,q_m\n0,1,2\n1,3,4\n").unwrap();
    for text in [
        "\u{feff}t,u_V,q_m\r\n0,1,2\r\n1,3,4\r\n",
        "# a comment\n\n t , u_V,q_m\n# another, with comma\n0, 1 ,2\n\n1,3,4",
        "\"t\",\"u_V\",\"q_m\"\n0,\"1\",2\n1,3,4\n",
        "t,u_V,q_m\r0,1,2\r1,3,4\r",
    ] {
        let other = parse(text).unwrap();
        assert_eq!(other.t(), plain.t(), "{text:?}");
        assert_eq!(other.column("u_V"), plain.column("u_V"), "{text:?}");
        assert_eq!(other.column("q_m"), plain.column("q_m"), "{text:?}");
    }
}

#[test]
fn missing_samples_are_nan_and_inputs_hold() {
    let recording = parse("t,u_V,q_m\n0,,1\n1,5,nan\n2,NaN,\n3,6,2\n").unwrap();
    assert_eq!(
        recording.held("u_V", "x").unwrap(),
        Held {
            values: vec![5.0, 5.0, 5.0, 6.0],
            missing: 2
        }
    );
    let q = recording.column("q_m").unwrap();
    assert_eq!(
        q.iter().map(|value| value.is_nan()).collect::<Vec<_>>(),
        [false, true, true, false]
    );
    let empty = parse("t,u_V\n0,\n1,\n").unwrap();
    assert!(
        empty
            .held("u_V", "the drive")
            .unwrap_err()
            .to_string()
            .contains("no value at all")
    );
}

#[test]
fn every_refusal_names_file_line_and_column() {
    for (text, start) in [
        ("", "a.csv:1:1: there is no line with column names"),
        (
            "# only a comment\n",
            "a.csv:2:1: there is no line with column names",
        ),
        ("t,q_m\n", "a.csv:2:1: there are no rows"),
        (
            "t,q_m\n0,1\n1,abc\n",
            "a.csv:3:3: `abc` in column `q_m` is not a number",
        ),
        ("# c\n\nt,q_m\n# c\n0,1\n\n# c\n1,abc\n", "a.csv:8:3: `abc`"),
        (
            "t,q_m\r\n0,1\r\n1, 1e999\r\n",
            "a.csv:3:4: `1e999` in column `q_m` is not finite",
        ),
        (
            "t,q_m\n0,1\n1,inf\n",
            "a.csv:3:3: `inf` in column `q_m` is not finite",
        ),
        (
            "t,q_m\n0,1\n0,2\n",
            "a.csv:3:1: time does not increase: 0 after 0",
        ),
        (
            "t,q_m\n1,1\n0,2\n",
            "a.csv:3:1: time does not increase: 0 after 1",
        ),
        ("t,q_m\n0,1\n,2\n", "a.csv:3:1: the time is missing"),
        ("t,q_m\n0,1\nnan,2\n", "a.csv:3:1: the time is missing"),
        ("t,q_m\n0,1\n1\n", "a.csv:3:1: this row has 1 field"),
        ("t,q_m\n0,1\n1,2,3\n", "a.csv:3:3: this row has 3 fields"),
        (
            "t,q_m,q_m\n0,1,2\n",
            "a.csv:1:7: column `q_m` is there twice",
        ),
        ("t,q_m,\n0,1,2\n", "a.csv:1:7: column 3 has no name"),
        // It was taken, and what was written of it was not read again (tests/fuzz, target
        // `recording`).
        (
            "t,u_V,\"q\n0,1\"\n0,1,2\n",
            "a.csv:1:7: a column name goes on over the end of its line",
        ),
        ("time,q_m\n0,1\n", "a.csv:1:1: the first column is `time`"),
        ("0,1\n1,2\n", "a.csv:1:1: the first column is `0`"),
        ("t;q_m\n0;1\n", "a.csv:1:1: the first column is `t;q_m`"),
        ("t,µ_1,q_m\n0,1,x\n", "a.csv:2:5: `x`"),
    ] {
        let message = refusal(text);
        assert!(message.starts_with(start), "{text:?}\n{message}");
    }
    assert!(refusal("t;q_m\n0;1\n").contains("separate them by `,`"));
    // Renamed alone, these times would be taken as seconds.
    for (name, help) in [
        ("Time (ms)", "say its unit: --time-unit ms"),
        ("t_ms", "say its unit: --time-unit ms"),
        ("time_us", "say its unit: --time-unit us"),
        ("timestamp_ns", "say its unit: --time-unit ns"),
        ("time_s", "rename it to `t` if it is in seconds"),
    ] {
        let message = refusal(&format!("{name},q_m\n0,1\n"));
        assert!(message.contains(help), "{message}");
    }
    assert!(refusal("0,1\n1,2\n").contains("column names seems to be missing"));
}

#[test]
fn a_missing_column_suggests_the_nearest() {
    let recording = parse("# c\nt,q_mm,u_V\n0,1,2\n").unwrap();
    let message = recording
        .require("q_m", "the rig's sensor `encoder`")
        .unwrap_err()
        .to_string();
    assert_eq!(
        message,
        "a.csv:2:1: there is no column `q_m`, which the rig's sensor `encoder` needs\n  \
         expected: `q_m` among the columns; this recording has `q_mm`, `u_V`\n  \
         help: did you mean `q_mm`?"
    );
}

#[test]
fn rows_and_intervals() {
    let recording = parse("t,q_m\n0,1\n1,2\n2,3\n10,4\n").unwrap();
    assert_eq!(recording.interval(), Some(1.0));
    assert_eq!(recording.duration(), 10.0);
    let tail = recording.rows(2..4).unwrap();
    assert_eq!(
        (tail.t(), tail.column("q_m").unwrap()),
        ([2.0, 10.0].as_slice(), [3.0, 4.0].as_slice())
    );
    assert!(recording.rows(2..2).is_err() && recording.rows(3..5).is_err());
}

#[test]
fn two_hundred_thousand_rows_read_within_a_second() {
    let mut text = String::from("t,u_V,q_m,force_N\n");
    for row in 0..200_000 {
        text.push_str(&format!(
            "{:.4},{:.5},{:.9},{:.4}\n",
            f64::from(row) * 1e-4,
            0.123_45,
            1e-6,
            12.345_6
        ));
    }
    let begun = std::time::Instant::now();
    let recording = parse(&text).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    assert_eq!(recording.len(), 200_000);
    // Takes 0.04 s; the bound only catches a reader that has become quadratic.
    assert!(seconds < 1.0, "{seconds} s");
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("finite or missing", |value| !value.is_infinite()),
        Just(f64::NAN),
        Just(-0.0),
        Just(f64::MIN_POSITIVE / 4.0),
        -1e3..1e3,
    ]
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = Recording::parse(&bytes, "a.csv").map_err(|error| error.to_string());
    }

    #[test]
    fn nothing_that_looks_like_csv_panics(text in "(# ?c\r?\n)?t,[uq\",]{0,4}\n[-0-9.,e#\"\r\nnaµ ]{0,80}") {
        let _ = parse(&text).map_err(|error| error.to_string());
    }

    #[test]
    fn written_and_read_is_the_same_bits(
        rows in proptest::collection::vec((1e-9..1e3_f64, value(), value()), 1..40),
        name in "[a-z#,\"][a-z ,\"_#]{0,6}[a-z]",
    ) {
        let t: Vec<f64> = rows.iter().scan(-5.0, |now, row| { *now += row.0; Some(*now) }).collect();
        let columns = vec![
            Column { name: "u_V".into(), values: rows.iter().map(|row| row.1).collect() },
            Column { name, values: rows.iter().map(|row| row.2).collect() },
        ];
        let written = Recording::new("a.csv", t, columns).unwrap();
        let read = parse(&written.to_csv()).unwrap();
        let bits = |values: &[f64]| values.iter().map(|value| if value.is_nan() { 0 } else { value.to_bits() }).collect::<Vec<_>>();
        prop_assert_eq!(bits(written.t()), bits(read.t()));
        for (one, other) in written.columns().iter().zip(read.columns()) {
            prop_assert_eq!(&one.name, &other.name);
            prop_assert_eq!(bits(&one.values), bits(&other.values));
        }
    }
}

/// Files as spreadsheets and loggers write them: the cause is told, not only the place.
#[test]
fn the_usual_causes_of_a_refusal_are_told() {
    for (text, help) in [
        ("t,q_m\ns,m\n0,1\n", "a line of units"),
        (
            "t,q_m\n0,1\n1,2\nt,q_m\n0,1\n",
            "was the recorder restarted",
        ),
        ("Logger 1.2\nrate,50\nt,q_m\n0,1\n", "in line 3"),
        ("t [s],q [m]\n0,1\n", "rename it to `t`"),
        (
            "t,q_m\n2026-11-28 12:00:00,1\n",
            "as seconds from the first row",
        ),
        ("t,q_m\n0,1\n1,-", "cut off here"),
        ("t,u_N,q_m\n0,1,2\n\"1,1,2\n2,1,2\n", "is not closed"),
        ("t,u_N,q_m\n0,1,2\n   \n", "delete the blank line"),
        ("t,q_m\n0,\"0,5\"\n", "decimal point"),
    ] {
        let said = refusal(text);
        assert!(said.contains(help), "{text:?}: {said}");
    }
    let infinite = refusal("t,q_m\n0,inf\n1,2\n");
    assert!(!infinite.contains("decimal point"), "{infinite}");
    let text = "t,q_m\n0,1\n1,2\n";
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [[b"\xFF\xFE", &wide[..]].concat(), wide] {
        let said = Recording::parse(&bytes, "a.csv").unwrap_err().to_string();
        assert!(said.contains("UTF-16"), "{said}");
    }
}
