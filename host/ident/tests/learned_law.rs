//! A law is learned from recordings of somebody else's physics (`tests/foreign/pad.py`), and used
//! in another shape.

use std::path::PathBuf;

use sinew_ident::fit::score;
use sinew_ident::learn::{LearnOptions, Learned, Origin, law_file, learn};
use sinew_ident::recording::{Column, Recording};
use sinew_sim::{LawKind, Rig};

fn recording(name: &str) -> Recording {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/foreign/pad");
    Recording::read(path.join(name)).expect("the recording is sound")
}

const BLOCK: &str = r#"format = "sinew-rig/1"
name = "block"
[[body]]
name = "block"
motion = "slide"
inertia = 0.5
[[spring]]
name = "pad"
from = "ground"
to = "block"
stiffness = { value = 300.0 }
[[damper]]
name = "oil"
from = "ground"
to = "block"
damping = { value = 0.8 }
[[actuator]]
name = "push"
drives = "block"
input = "u_N"
gain = 1.0
[[sensor]]
name = "x"
reads = "block.position"
signal = "q_m"
"#;

/// Two masses on pads; `lower` and `upper` are what stands in the place of their stiffness.
fn tower(lower: &str, upper: &str, more: &str) -> Rig {
    let text = format!(
        "format = \"sinew-rig/1\"\nname = \"tower\"\n{}{}{}{}{more}",
        "[[body]]\nname = \"lower\"\nmotion = \"slide\"\ninertia = 1.2\n\
         [[body]]\nname = \"upper\"\nmotion = \"slide\"\ninertia = 0.4\n",
        format_args!(
            "[[spring]]\nname = \"one\"\nfrom = \"ground\"\nto = \"lower\"\n{lower}\n\
             [[spring]]\nname = \"two\"\nfrom = \"lower\"\nto = \"upper\"\n{upper}\n"
        ),
        "[[damper]]\nname = \"a\"\nfrom = \"ground\"\nto = \"lower\"\ndamping = 2.0\n\
         [[damper]]\nname = \"b\"\nfrom = \"ground\"\nto = \"upper\"\ndamping = 0.7\n\
         [[actuator]]\nname = \"push\"\ndrives = \"upper\"\ninput = \"u_N\"\ngain = 1.0\n",
        "[[sensor]]\nname = \"xl\"\nreads = \"lower.position\"\nsignal = \"lower_m\"\n\
         [[sensor]]\nname = \"xu\"\nreads = \"upper.position\"\nsignal = \"upper_m\"\n",
    );
    Rig::parse(&text, "tower.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn learned(at: &[&str], options: LearnOptions) -> sinew_ident::error::Result<Learned> {
    let rig = Rig::parse(BLOCK, "block.toml").expect("the rig is sound");
    let names: Vec<String> = at.iter().map(|name| (*name).to_owned()).collect();
    let (fit, check) = ([recording("block.fit.csv")], [recording("block.check.csv")]);
    learn(&rig, &names, (&fit, &check), options, &mut |_| {})
}

/// The claim of a law: learned on one shape, it is nearly as good in another as the true law.
#[test]
fn a_law_learned_on_a_block_is_used_in_a_tower() {
    let found = learned(&["pad"], LearnOptions::default()).expect("there is a law");
    let (straight, law) = &found.check[0];
    assert!(law.rms < 2.0 * 5e-5, "check error {} m", law.rms);
    assert!(straight.rms > 50.0 * law.rms, "{straight:?} {law:?}");
    assert!(found.laws[0].values().iter().all(|&k| k >= 0.0));

    let text = law_file(&found, 0, &Origin::default());
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("pad.law.toml"), &text).expect("it is written");
    let named = "law = \"pad.law.toml\"";
    let rig = tower("stiffness = 0.0", "stiffness = 0.0", "");
    let text = (rig.to_toml())
        .replacen(
            "stiffness = 0.0",
            &format!("{named}\nlaw_length = 2.0\nlaw_width = 3.0"),
            1,
        )
        .replacen("stiffness = 0.0", named, 1);
    let file = folder.path().join("tower.toml");
    std::fs::write(&file, text).expect("it is written");
    let with_law = Rig::load(&file).unwrap_or_else(|error| panic!("{error}"));

    // The true law, in as many numbers as a law may have.
    let reach = 0.08;
    let exact = (0..33).map(|k| 150.0 * (reach * f64::from(k) / 32.0 / 0.02).cosh());
    let exact: Vec<f64> = exact.collect();
    let truth = format!("[[law]]\nname = \"truth\"\nreach = {reach}\nstiffness = {exact:?}\n");
    let with_truth = tower(
        "law = \"truth\"\nlaw_length = 2.0\nlaw_width = 3.0",
        "law = \"truth\"",
        &truth,
    );
    let line = found.straight.rig.springs[0].stiffness.value;
    let with_line = tower(
        &format!("stiffness = {:?}", 1.5 * line),
        &format!("stiffness = {line:?}"),
        "",
    );
    let recordings = [recording("tower.csv")];
    let errors = |rig: &Rig| score(rig, &recordings).expect("it is simulated");
    let (law, truth, line) = (errors(&with_law), errors(&with_truth), errors(&with_line));
    for ((law, truth), line) in law.iter().zip(&truth).zip(&line) {
        println!(
            "{}: {:.3e} m with the learned law, {:.3e} with the true one, {:.3e} with a line",
            law.signal, law.rms, truth.rms, line.rms
        );
        assert!(law.rms <= 2.0 * truth.rms, "{law:?} {truth:?}");
        assert!(law.rms < 0.1 * line.rms, "{law:?} {line:?}");
    }
}

/// A damper that is straight has no law beyond its line, and one is not invented.
#[test]
fn a_straight_line_gets_no_law() {
    let rig = Rig::parse(BLOCK, "block.toml").expect("the rig is sound");
    // The exact answer of the linear block to held forces would do; its own free run will.
    let shape = recording("block.fit.csv");
    let run = |name: &str, shift: usize| {
        let input = shape.column("u_N").expect("the input");
        let force: Vec<f64> = (0..400).map(|k| input[(k + shift) % input.len()]).collect();
        let t: Vec<f64> = shape.t()[..400].to_vec();
        let plant = sinew_sim::Plant::new(&rig).expect("it compiles");
        let drive = sinew_sim::InputTrajectory::new(&plant, 400, &[&force]).expect("one input");
        let values = plant.values();
        let start = plant.initial_state(&values, &[Some(0.0)]).expect("at rest");
        let motion = plant
            .simulate(&values, &start, &drive, &t)
            .expect("it moves");
        let noise = |k: usize| 1e-5 * (12.9898 * k as f64 + shift as f64).sin();
        let read = motion.column(0);
        let q = read.iter().enumerate().map(|(k, q)| q + noise(k));
        let column = |name: &str, values| Column {
            name: name.into(),
            values,
        };
        let columns = vec![column("u_N", force.clone()), column("q_m", q.collect())];
        Recording::new(name, t.clone(), columns).expect("it is sound")
    };
    let (fit, check) = ([run("a.csv", 0)], [run("b.csv", 500)]);
    let names = ["pad".to_owned()];
    let refused = learn(
        &rig,
        &names,
        (&fit, &check),
        LearnOptions::default(),
        &mut |_| {},
    );
    let said = refused.expect_err("there is nothing to learn").to_string();
    assert!(
        said.contains("no law of pad explains the check recordings"),
        "{said}"
    );
}

#[test]
fn what_cannot_have_a_law_is_refused_before_any_work() {
    let refused = |at: &[&str], options| {
        let error = learned(at, options).expect_err("it is refused");
        error.to_string()
    };
    let usual = LearnOptions::default();
    let said = refused(&["pat"], usual);
    assert!(
        said.contains("no spring and no damper") && said.contains("`pad`"),
        "{said}"
    );
    assert!(refused(&["pad", "pad"], usual).contains("twice"));
    let any = LearnOptions {
        monotone: false,
        ..usual
    };
    assert!(refused(&["oil"], any).contains("might put energy in"));
    let rig = Rig::parse(BLOCK, "block.toml").expect("the rig is sound");
    let fit = [recording("block.fit.csv")];
    let names = ["pad".to_owned()];
    let without = learn(&rig, &names, (&fit, &[]), usual, &mut |_| {});
    assert!(
        without
            .unwrap_err()
            .to_string()
            .contains("needs a check recording")
    );
    let text = BLOCK.replacen(
        "stiffness = { value = 300.0 }",
        "law = \"foam\"\n[[law]]\nname = \"foam\"\nreach = 0.1\nstiffness = [1.0, 2.0]",
        1,
    );
    let rig = Rig::parse(&text, "block.toml").expect("the rig is sound");
    let again = learn(&rig, &names, (&fit, &fit), usual, &mut |_| {});
    assert!(again.unwrap_err().to_string().contains("has a law already"));
    assert_eq!(rig.laws[0].kind, LawKind::Spring);
}
