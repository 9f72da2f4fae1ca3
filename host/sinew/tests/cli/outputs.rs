//! Files that verbs write: links are followed, pipes and devices are written through, and what
//! cannot be written is one error before any work. Nothing in the place of a file is ever replaced
//! but a file.

use std::os::unix::fs::{FileTypeExt, symlink};

use crate::desk::Desk;
use sinew_sim::Rig;

/// A verb's line without the flag, and the flag of its file.
pub type Written = (&'static str, &'static str);

/// Every flag of a file that a verb writes within seconds.
pub const QUICK: &[Written] = &[
    ("new fit.csv --name stage", "--out"),
    ("new fit.csv --name stage --out new.toml --force", "--json"),
    ("check fit.csv --rig rig.toml", "--json"),
    ("simulate rig.toml --input fit.csv --out sim.csv", "--json"),
    (
        "simulate rig.toml --input fit.csv --out sim.csv",
        "--report",
    ),
    (
        "wire rig.toml --board stm32f446 --out wired.toml --force",
        "--json",
    ),
    ("import range.onnx", "--json"),
    ("convert types.mat --column q_rad=q_rad:2", "--out"),
    ("simulate rig.toml --input fit.csv", "--out"),
    ("settle rig.toml --sweep u_N=-2:2:5", "--out"),
    (
        "settle rig.toml --sweep u_N=-2:2:5 --out rests.out.csv",
        "--json",
    ),
    ("excite rig.toml --seconds 2 --no-table --quiet", "--out"),
    (
        "excite rig.toml --seconds 2 --no-table --quiet --out exc.csv",
        "--json",
    ),
    (
        "fleet rig.toml --fit fit.csv --device b=b.csv --device c=c.csv --quiet",
        "--out",
    ),
    (
        "fleet rig.toml --fit fit.csv --device b=b.csv --device c=c.csv --quiet --out fl.toml",
        "--json",
    ),
    ("fit rig.toml --fit fit.csv --quiet", "--out"),
    ("fit rig.toml --fit fit.csv --quiet", "--json"),
    ("fit rig.toml --fit fit.csv --quiet", "--report"),
    (
        "diagnose rig.toml --fit fit.csv --time-limit 1 --quiet",
        "--json",
    ),
    (
        "diagnose rig.toml --fit fit.csv --time-limit 1 --quiet",
        "--report",
    ),
    (
        "diagnose rig.toml --fit fit.csv --time-limit 1 --quiet",
        "--rig-out",
    ),
    (
        "diagnose rig.toml --fit fit.csv --time-limit 1 --quiet",
        "--mjcf",
    ),
    ("settle rig.toml --sweep u_N=-2:2:5", "--report"),
    (
        "fleet rig.toml --fit fit.csv --device b=b.csv --device c=c.csv --quiet --out fl.toml",
        "--report",
    ),
    (
        "plan rig.toml --goal encoder=0.05@0.6s --simulations 200 --out plan.csv",
        "--report",
    ),
    ("explain coulomb_friction", "--json"),
    ("mjcf rig.toml", "--out"),
    ("mjcf rig.toml --out out.xml", "--json"),
    ("convert types.mat --list", "--json"),
    (
        "plan rig.toml --goal encoder=0.05@0.6s --simulations 200",
        "--out",
    ),
    (
        "plan rig.toml --goal encoder=0.05@0.6s --simulations 200 --out plan.csv",
        "--json",
    ),
];

/// Flags of files that take a trained model, a learned law, a build or a board to be written: their
/// tests are elsewhere, and they go through the same writer.
const SLOW: &[Written] = &[
    ("build", "--json"),
    ("emit", "--json"),
    ("train", "--json"),
    ("train", "--report"),
    ("calibrate", "--json"),
    ("size", "--json"),
    ("verify", "--json"),
    ("tune", "--out"),
    ("tune", "--json"),
    ("tune", "--report"),
    ("learn", "--out"),
    ("learn", "--rig-out"),
    ("learn", "--json"),
    ("learn", "--report"),
    ("compare", "--json"),
    ("compare", "--report"),
    ("faults", "--json"),
    ("adopt", "--json"),
    ("commission", "--json"),
    ("record", "--out"),
    ("compare", "--plot"),
    ("pil", "--json"),
    ("flash", "--json"),
    ("record", "--json"),
    ("monitor", "--json"),
    ("monitor", "--out"),
    ("pil", "--recording"),
    ("pil", "--report"),
    ("adopt", "--out"),
    ("imitate", "--out"),
    ("imitate", "--json"),
    ("compare", "--recording"),
    ("share", "--out"),
    ("share", "--json"),
    ("prefer", "--out"),
    ("prefer", "--json"),
];

/// A desk with a rig and the first five seconds of its recording.
pub fn desk() -> Desk {
    let desk = Desk::new();
    for [from, to] in [["toml", "rig.toml"], ["fit.csv", "fit.csv"]] {
        desk.bring(&format!("rigs/mass-spring-damper.{from}"));
        let text = desk.read(&format!("mass-spring-damper.{from}"));
        let lines: Vec<&str> = text.lines().take(602).collect();
        desk.write(to, &(lines.join("\n") + "\n"));
    }
    for copy in ["b.csv", "c.csv"] {
        desk.write(copy, &desk.read("fit.csv"));
    }
    desk.bring("tests/foreign/logs/types.mat");
    desk.bring("codegen/nn/tests/cases/52-odd/range.onnx");
    desk
}

/// The line with its flag and a place; blanks of a goal are written as `@` and by its unit.
pub fn run(desk: &Desk, (line, flag): Written, place: &str) -> std::process::Output {
    let mut command = desk.command("");
    for word in line.split_whitespace() {
        match word.strip_prefix("encoder=") {
            Some(_) => command.arg("encoder = 0.05 at 0.6 s"),
            None => command.arg(word),
        };
    }
    command
        .args([flag, place])
        .output()
        .expect("the program starts")
}

fn errors(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Whoever adds a flag of a file adds it here.
#[test]
fn every_flag_of_a_file_is_known_to_these_tests() {
    let reference = include_str!("../../../../docs/reference/cli.md");
    let (mut verb, mut flag, mut unknown) = ("", "", Vec::new());
    for line in reference.lines() {
        if let Some(name) = line.strip_prefix("### `sinew ") {
            verb = name.trim_end_matches('`');
        }
        let words = line.trim_start();
        let words = match words.split_once(", ") {
            Some((short, long)) if short.len() == 2 && short.starts_with('-') => long,
            _ => words,
        };
        if words.starts_with("--") {
            flag = words.split_whitespace().next().unwrap_or_default();
        }
        if words.starts_with("File for ") {
            let mut all = QUICK.iter().chain(SLOW);
            let known =
                all.any(|(line, its)| line.split_whitespace().next() == Some(verb) && *its == flag);
            if !known {
                unknown.push(format!("{verb} {flag}"));
            }
        }
    }
    assert!(unknown.is_empty(), "{unknown:?}");
}

#[test]
fn a_link_stays_and_its_target_is_written_by_every_verb() {
    let desk = desk();
    std::fs::create_dir(desk.path("kept")).expect("the desk is writable");
    for written in QUICK {
        let (link, target) = (desk.path("link"), desk.path("kept/target"));
        let _ = (std::fs::remove_file(&link), std::fs::remove_file(&target));
        symlink("kept/target", &link).expect("a link can be made");
        let output = run(&desk, *written, "link");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{written:?}\n{}",
            errors(&output)
        );
        let kept = std::fs::symlink_metadata(&link).expect("the link is there");
        assert!(kept.is_symlink(), "{written:?} replaced a link");
        let text = std::fs::read_to_string(&target).unwrap_or_default();
        assert!(!text.is_empty(), "{written:?} did not follow a link");
    }
}

#[test]
fn pipes_and_standard_output_are_written_through_by_every_verb() {
    let desk = desk();
    let pipe = desk.path("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo starts").success());
    for written in QUICK {
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read_to_string(pipe).expect("the pipe can be read")
        });
        let output = run(&desk, *written, "pipe");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{written:?}\n{}",
            errors(&output)
        );
        let through = reader.join().expect("the reader ends");
        let found = std::fs::metadata(&pipe).expect("the pipe is there");
        assert!(found.file_type().is_fifo(), "{written:?} replaced a pipe");
        let output = run(&desk, *written, "/dev/stdout");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{written:?}\n{}",
            errors(&output)
        );
        let begin = |text: &str| text.chars().take(20).collect::<String>();
        let printed = String::from_utf8_lossy(&output.stdout);
        assert_eq!(
            begin(&printed),
            begin(&through),
            "{written:?} mixes with its file"
        );
    }
}

#[test]
fn a_folder_in_the_place_of_a_file_is_one_error_before_any_work() {
    let desk = desk();
    std::fs::create_dir(desk.path("place")).expect("the desk is writable");
    desk.write("place/inside", "kept");
    for written in QUICK {
        for place in ["place", "rig.toml/below"] {
            let output = run(&desk, *written, place);
            let said = errors(&output);
            assert!(
                output
                    .status
                    .code()
                    .is_some_and(|code| code != 0 && code != 101)
            );
            let lines = said.lines().filter(|line| line.starts_with("error"));
            assert_eq!(lines.count(), 1, "{written:?} {place}\n{said}");
            assert!(
                said.contains(place.split('/').next().unwrap_or(place)),
                "{said}"
            );
        }
        assert_eq!(desk.read("place/inside"), "kept");
    }
}

/// Every verb that writes refuses an output that is one of its inputs, before any work.
#[test]
fn no_verb_replaces_what_it_reads() {
    let desk = Desk::new();
    let recording = "mass-spring-damper.fit.csv";
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    let rig = desk.read("mass-spring-damper.toml");
    desk.write("rig.toml", &rig).write("model.toml", &rig);
    desk.write("test.csv", &desk.read(recording));
    std::os::unix::fs::symlink("rig.toml", desk.path("link.toml")).expect("a link can be made");
    let lines = [
        format!("fit rig.toml --fit {recording} --out ./{recording}"),
        format!("fit rig.toml --fit {recording} --test test.csv --out test.csv"),
        format!("fit rig.toml --fit {recording} --out link.toml"),
        "mjcf rig.toml --out link.toml".into(),
        format!("new {recording} --yes --force --out ./{recording}"),
        format!("build rig.toml --fit {recording} --out ."),
        format!("train model.toml --fit {recording} --out ."),
    ];
    for line in lines {
        let output = desk.sinew(&line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains("would overwrite what"), "{line}: {said}");
    }
    assert_eq!(desk.read("rig.toml"), rig);
    assert_eq!(desk.read("test.csv"), desk.read(recording));
}

/// Standard output holds the file alone.
#[test]
fn a_file_on_standard_output_stands_there_alone() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    for line in [
        "new mass-spring-damper.fit.csv --yes --spring yes --out -",
        "fit mass-spring-damper.toml --fit mass-spring-damper.fit.csv --out -",
    ] {
        let text = desk.succeed(line);
        Rig::parse(&text, "stdout").unwrap_or_else(|error| panic!("{line}: {error}\n{text}"));
    }
}

/// With `--quiet` or not, the document is all that standard output has.
#[test]
fn a_document_on_standard_output_is_json_alone_for_every_verb() {
    let desk = desk();
    let mut seen = 0;
    for (line, flag) in QUICK.iter().filter(|(_, flag)| *flag == "--json") {
        let loud = line.replace(" --quiet", "");
        let quiet = if line.starts_with("explain") {
            loud.clone()
        } else {
            format!("{loud} --quiet")
        };
        for line in [loud, quiet] {
            let output = run(&desk, (line.clone().leak(), flag), "-");
            let errors = errors(&output);
            assert_eq!(output.status.code(), Some(0), "{line}\n{errors}");
            let document = serde_json::from_slice::<serde_json::Value>(&output.stdout);
            assert!(document.is_ok(), "{line} --json -: {document:?}");
            if line.ends_with("--quiet") {
                let remark = errors.lines().find(|line| !line.starts_with("warning: "));
                assert_eq!(remark, None, "{line} --json -\n{errors}");
            }
            seen += 1;
        }
    }
    assert!(seen >= 24, "{seen}");
}
