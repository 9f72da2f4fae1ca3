//! Refusals of the program, word for word: the place, what was expected, what was meant, the exit
//! status.

use crate::desk::Desk;

/// Runs every line and takes down what it says.
fn refusals(desk: &Desk, lines: &[&str]) -> String {
    lines.iter().map(|line| desk.refusal(line)).collect()
}

/// A desk with the demo's rig and one of its recordings, cut to a readable length.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    desk.write(
        "good.csv",
        "t,u_N,q_m\n0,0,0\n0.01,1,0.001\n0.02,1,0.002\n0.03,1,0.004\n",
    );
    desk
}

const RIG: &str = "mass-spring-damper.toml";

#[test]
fn command_lines() {
    let desk = desk();
    insta::assert_snapshot!(refusals(
        &desk,
        &[
            "",
            "fitt",
            &format!("fit {RIG}"),
            &format!("build {RIG} --fit good.csv"),
            &format!("build {RIG} --fit good.csv --out out --board esp32"),
            &format!("fit {RIG} --fit good.csv --sed 3"),
        ]
    ));
}

#[test]
fn rigs() {
    let desk = desk();
    let sound = desk.read(RIG);
    let broken = |name: &str, from: &str, to: &str| {
        assert!(
            sound.contains(from),
            "{from} is not in the rig: nothing would be broken"
        );
        desk.write(name, &sound.replace(from, to));
    };
    broken("key.toml", "stiffness = ", "stifness = ");
    broken("sign.toml", "{ value = 1.0, min", "{ value = -1.0, min");
    broken("name.toml", "to = \"mass\"", "to = \"mas\"");
    broken("syntax.toml", "gain = 1.0", "gain = 1.0.0");
    broken("control.toml", "rate_hz = ", "rate_hzz = ");
    let line = |rig: &str| format!("fit {rig} --fit good.csv");
    let lines: Vec<String> = [
        "mass-spring-dampr.toml",
        "control.toml",
        "key.toml",
        "sign.toml",
        "name.toml",
        "syntax.toml",
        "good.csv",
    ]
    .map(line)
    .into();
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(refusals(&desk, &lines));
}

#[test]
fn recordings() {
    let desk = desk();
    desk.write("empty.csv", "");
    desk.write("header.csv", "t,u_N,q_m\n");
    desk.write("text.csv", "t,u_N,q_m\n0,0,0\n0.01,abc,0\n");
    desk.write("comma.csv", "t;u_N;q_m\n0;0;0\n0,01;1;0\n");
    desk.write("back.csv", "t,u_N,q_m\n0,0,0\n0.02,0,0\n0.01,0,0\n");
    desk.write("twice.csv", "t,u_N,q_m\n0,0,0\n0.02,0,0\n0.02,0,0\n");
    desk.write("column.csv", "t,u_N,q_mm\n0,0,0\n0.01,0,0\n0.02,0,0\n");
    desk.write("short.csv", "t,u_N,q_m\n0,0,0\n0.01,0\n");
    let lines: Vec<String> = [
        "absent.csv",
        "empty.csv",
        "header.csv",
        "text.csv",
        "comma.csv",
        "back.csv",
        "twice.csv",
        "column.csv",
        "short.csv",
    ]
    .map(|recording| format!("fit {RIG} --fit {recording}"))
    .into();
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(refusals(&desk, &lines));
}

#[test]
fn the_same_recordings_to_simulate() {
    let desk = desk();
    desk.write("input.csv", "t,u_V,q_m\n0,0,0\n0.01,0,0\n");
    let line = |input: &str| format!("simulate {RIG} --input {input} --out out.csv");
    let report = refusals(&desk, &[&line("input.csv"), &line("absent.csv")]);
    assert!(!desk.path("out.csv").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn models() {
    let desk = desk();
    desk.bring("models/reference-s/model.toml");
    let sound = desk.read("model.toml");
    let weights = crate::desk::checkout().join("models/reference-s/weights.safetensors");
    for model in ["reference-s", "misspelt", "bare"] {
        desk.write(&format!("{model}/model.toml"), &sound);
    }
    std::fs::copy(&weights, desk.path("reference-s/weights.safetensors"))
        .expect("the file can be copied");
    std::fs::copy(&weights, desk.path("misspelt/weights.safetensors"))
        .expect("the file can be copied");
    desk.write(
        "misspelt/model.toml",
        &sound.replace("past_inputs", "past_input"),
    );
    let other = desk.read(RIG).replace("q_m", "x_m");
    desk.write("other.toml", &other);
    let line = |model: &str| format!("compare {RIG} {model} --fit good.csv --out out");
    let report = refusals(
        &desk,
        &[
            &line("reference-s"),
            &line("misspelt"),
            &line("bare"),
            &line("absent"),
            &line("reference-s --plant other.toml"),
            &line("reference-s/ reference-s"),
            &line("reference-s --loops 0"),
            "emit absent --out out",
            &format!("pil {RIG} reference-s --fit good.csv --out out"),
        ],
    );
    assert!(!desk.path("out").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn tunings() {
    let desk = desk();
    desk.bring("models/reference-s/model.toml")
        .bring("models/reference-s/weights.safetensors")
        .write("input.csv", "t,u_N\n0,0\n0.1,0\n")
        .write("void.csv", "t,q_m\n0,nan\n0.1,\n");
    let rig = desk.read(RIG);
    let large = rig.replace("hidden = [12]", "hidden = [60]\nfirst_layer = \"lstm\"");
    desk.write("large.toml", &large);
    let twice = "hidden = [12]\nfirst_layer = \"gru\"\nobserver_gain = 0.6";
    desk.write("twice.toml", &rig.replace("hidden = [12]", twice));
    let valued = |name: &str, key: &str| {
        let asked = format!("[control]\nterminal = \"value\"\n{key}\n");
        desk.write(name, &rig.replace("[control]\n", &asked));
    };
    valued("far.toml", "value_ahead = 150");
    valued("valued.toml", "");
    let with = |name: &str, network: &str| {
        let text = desk.read("valued.toml");
        assert!(text.contains("terminal"), "[control] is there");
        desk.write(name, &text.replace("hidden = [12]", network));
    };
    with("recalls.toml", "hidden = [12]\nfirst_layer = \"gru\"");
    let state = desk.read("valued.toml");
    let (before, _) = state.split_once("[network]").expect("the rig has one");
    desk.write(
        "state.toml",
        &format!("{before}[network]\nform = \"state\"\n"),
    );
    let (actuator, sensor) = (rig.find("[[actuator]]"), rig.find("[[sensor]]"));
    let without = actuator
        .zip(sensor)
        .map(|(a, s)| rig[..a].to_owned() + &rig[s..]);
    desk.write("idle.toml", &without.expect("the rig has both tables"));
    let line = |model: &str, rest: &str| format!("tune {RIG} {model} --fit good.csv {rest}");
    let report = refusals(
        &desk,
        &[
            &line(".", ""),
            &line(".", "--out mass-spring-damper.toml"),
            &line(".", "--out t.toml --model-out ."),
            &line(".", "--out t.toml --objective fast"),
            &line(".", "--out t.toml --disturbance wind"),
            &line(".", "--out t.toml --evaluations 3"),
            &line(".", "--out t.toml --horizons 8,many"),
            &line(".", "--out t.toml"),
            &line("absent", "--out t.toml"),
            &format!("compare {RIG} . --fit good.csv --out out --report good.csv"),
            &format!("compare {RIG} . --fit good.csv --out out --disturbance wind"),
            &line(".", "--out t.toml --delay -1"),
            &line(".", "--out t.toml --disturbance-gain 2"),
            &line(".", "--out t.toml --by guess"),
            &line(".", "--out t.toml --plants 0"),
            &line(".", "--out good.csv --reference good.csv"),
            &line(".", "--out t.toml --reference absent.csv"),
            &line(".", "--out t.toml --reference input.csv"),
            &line(".", "--out t.toml --reference void.csv"),
            &format!("compare {RIG} . --fit good.csv --out out --draws 2 --spread 1.5"),
            &format!("compare {RIG} . --fit good.csv --out out --spread 0.1"),
            &format!("compare {RIG} . --fit good.csv --out out --judged 19,2.5"),
            &format!("compare {RIG} . --fit good.csv --out out --judged 3"),
            &format!("compare {RIG} . --fit good.csv --out out --draws 2 --loops 2"),
            &format!("compare {RIG} . --fit good.csv --out out --delay 2"),
            &format!("train {RIG} --fit good.csv --out out --json good.csv"),
            "train large.toml --fit good.csv --out out",
            "train twice.toml --fit good.csv --out out",
            "train idle.toml --fit good.csv --out out",
            "train far.toml --fit good.csv --out out",
            "train recalls.toml --fit good.csv --out out",
            "train state.toml --fit good.csv --out out",
            "tune state.toml . --fit good.csv --out t.toml",
        ],
    );
    assert!(!desk.path("t.toml").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn networks_that_are_no_predictors() {
    let desk = desk();
    desk.bring("rigs/experiments/mass-spring-damper.tflite")
        .write("net/network.toml", "")
        .write("empty.csv", "")
        .write("void.csv", "t,u_N,q_m\n0,0,nan\n0.1,1,\n")
        .write("typo.csv", "t,u_N,q_mm\n0,0,1\n0.1,1,2\n")
        .write("still.csv", "t,u_N,q_m\n0,0,1\n0.1,1,1\n")
        .write("empty.tflite", "");
    let line = |network: &str, rest: &str| format!("import {network} {rest}");
    let net = "mass-spring-damper.tflite";
    desk.write(
        "short.toml",
        &desk
            .read(RIG)
            .replace("past_outputs = 8", "form = \"increment\"\npast_outputs = 7"),
    );
    let report = refusals(
        &desk,
        &[
            &line(net, &format!("--rig {RIG} --out out")),
            &line(net, "--fit good.csv --out out"),
            &line(net, &format!("--rig {RIG} --fit good.csv")),
            &line(net, "--rig absent.toml --fit good.csv --out out"),
            &line(net, &format!("--rig {RIG} --fit good.csv --out out")),
            &line(net, "--rig short.toml --fit good.csv --out out"),
            &line(net, "--rig short.toml --fit empty.csv --out out"),
            &line(net, "--rig short.toml --fit void.csv --out out"),
            &line(net, "--rig short.toml --fit typo.csv --out out"),
            &line(net, "--rig short.toml --fit still.csv --out out"),
            &line("empty.tflite", "--rig short.toml --fit good.csv --out out"),
            &line("net", &format!("--rig {RIG} --fit good.csv --out net")),
            &line(
                "absent.onnx",
                &format!("--rig {RIG} --fit good.csv --out out"),
            ),
        ],
    );
    assert!(!desk.path("out").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn networks_without_their_framework() {
    let desk = desk();
    desk.bring("rigs/experiments/mass-spring-damper.tflite");
    desk.write("empty.onnx", "");
    insta::assert_snapshot!(refusals(
        &desk,
        &[
            "verify absent.onnx",
            "verify empty.onnx",
            "verify mass-spring-damper.tflite --python no-such-python",
        ]
    ));
}

#[test]
fn programs_that_are_no_plants() {
    let desk = desk();
    let said = |name: &str, lines: &str| {
        desk.write(name, &format!("cat <<END\n{lines}\nEND\n"));
    };
    said("talk", "hello");
    said("inputs", "sinew-plant/1\nu_V\nq_m\n0");
    said("sensors", "sinew-plant/1\nu_N\np_m\n0");
    said("words", "sinew-plant/1\nu_N\nq_m\nnought");
    said("short", "sinew-plant/1\nu_N\nq_m,p_m\n0.1");
    said("ends", "sinew-plant/1\nu_N\nq_m\n0.0");
    desk.write(
        "chatter",
        "$| = 1; print qq(sinew-plant/1\\nu_N\\nq_m\\n), qq(0.0\\n) x 5000; sleep 30",
    );
    desk.write("mute", "echo sinew-plant/1; exec >&-; sleep 30");
    desk.write(
        "lost",
        "$| = 1; print qq(sinew-plant/1\\nu_N\\nq_m\\n0.0\\n); print qq(nan\\n) while <STDIN>;",
    );
    let names = ["talk", "inputs", "sensors", "words", "short", "ends"];
    // `sh` reads its program from where the plant's lines would come. No blanks: they would end the
    // argument.
    let mut programs: Vec<String> = names.iter().map(|name| format!("sh<{name}")).collect();
    programs.extend(["perl${IFS}chatter", "exec${IFS}sh<mute", "perl${IFS}lost"].map(String::from));
    let mut lines: Vec<String> = programs
        .iter()
        .map(|program| {
            format!("simulate {RIG} --input good.csv --out out.csv --plant-program {program}")
        })
        .collect();
    lines.push(format!(
        "compare {RIG} . --fit good.csv --out out --plant {RIG} --plant-program true"
    ));
    lines.push(format!(
        "simulate {RIG} --input good.csv --out out.csv --plot out.svg --plant-program true"
    ));
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let report = refusals(&desk, &lines);
    assert!(!desk.path("out.csv").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn results_that_cannot_be_written_are_status_1() {
    let desk = desk();
    desk.write("occupied/file", "");
    let line = format!("simulate {RIG} --input good.csv --out occupied");
    insta::assert_snapshot!(refusals(&desk, &[&line]));
}

#[test]
fn diagnoses() {
    let desk = desk();
    desk.write("other.csv", "t,u_N,q_m\n0,0,0\n0.01,1,\n");
    desk.write("column.csv", "t,u_N,q_mm\n0,0,0\n0.01,0,0\n0.02,0,0\n");
    desk.write("text.csv", "t,u_N,q_m\n0,0,0\n0.01,abc,0\n");
    let report = refusals(
        &desk,
        &[
            &format!("diagnose {RIG}"),
            &format!("diagnose {RIG} --fit good.csv --tst other.csv"),
            &format!("diagnose {RIG} --fit good.csv --seed minus"),
            &format!("diagnose {RIG} --fit good.csv --test ./good.csv"),
            &format!("diagnose {RIG} --fit good.csv --fit good.csv"),
            &format!("diagnose {RIG} --fit good.csv --rig-out {RIG}"),
            &format!("diagnose {RIG} --fit good.csv --json a.json --report a.json"),
            &format!("diagnose {RIG} --fit good.csv --json good.csv/a.json"),
            &format!("diagnose {RIG} --fit good.csv --report ."),
            &format!("diagnose {RIG} --fit good.csv"),
            &format!("diagnose {RIG} --fit good.csv --check column.csv"),
            &format!("diagnose {RIG} --fit good.csv --test text.csv"),
            "diagnose absent.toml --fit good.csv",
        ],
    );
    assert!(!desk.path("a.json").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

/// Sound to read and impossible to simulate, and results that cannot be where they are wanted.
#[test]
fn simulations() {
    let desk = desk();
    let sound = desk.read(RIG);
    let with = |name: &str, from: &str, to: &str| {
        assert!(sound.contains(from), "{from} is not in the rig");
        desk.write(name, &sound.replacen(from, to, 1));
    };
    with(
        "stiff.toml",
        "[[damper]]",
        "[[spring]]\nname = \"rod\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = 1e18\n[[damper]]",
    );
    let softening =
        "[[effect]]\nkind = \"cubic_stiffness\"\ncomponent = \"coil\"\ncoefficient = -1e9\n";
    desk.write("unstable.toml", &format!("{sound}\n{softening}"));
    with("misnamed.toml", "[[damper]]", "[[dampr]]");
    desk.write("far.csv", "t,u_N,q_m\n0,0,0.3\n0.01,1,\n0.02,1,\n");
    desk.write("header.csv", "t,u_N,q_m\n");
    desk.write("hollow.csv", "t,u_N,q_m\n0,,0\n0.01,,0\n");
    let simulate = |rig: &str, input: &str, more: &str| {
        format!("simulate {rig} --input {input} --out out.csv {more}")
    };
    let excite = |rig: &str| format!("excite {rig} --out exc.csv --quiet --seconds 1");
    let report = refusals(
        &desk,
        &[
            &simulate("stiff.toml", "good.csv", ""),
            &simulate("unstable.toml", "far.csv", ""),
            &simulate("misnamed.toml", "good.csv", ""),
            &simulate("absent.toml", "good.csv", ""),
            &simulate(RIG, "header.csv", ""),
            &simulate(RIG, "hollow.csv", ""),
            &simulate(RIG, "good.csv", "--plot out.csv"),
            &simulate(RIG, "good.csv", "--noise nan"),
            &format!("simulate {RIG} --input good.csv --out good.csv"),
            &excite("stiff.toml"),
            &excite("misnamed.toml"),
            &format!("excite {RIG} --out {RIG} --no-table"),
            &format!("excite {RIG} --out exc.csv --amplitude nan"),
        ],
    );
    assert!(!desk.path("out.csv").exists(), "a refusal writes nothing");
    assert!(!desk.path("exc.csv").exists(), "a refusal writes nothing");
    insta::assert_snapshot!(report);
}

#[test]
fn experiments() {
    let desk = desk();
    let free = desk
        .read(RIG)
        .replace("limit = [-20.0, 20.0]", "# no limit");
    desk.write("free.toml", &free);
    let excite = |rig: &str, more: &str| format!("excite {rig} --out exc.csv --quiet {more}");
    let lines = [
        excite("free.toml", ""),
        excite(RIG, "--kind noise"),
        excite(RIG, "--seconds 0"),
        excite(RIG, "--seconds 0.01"),
        excite(RIG, "--amplitude 1.5"),
        excite(RIG, "--band 1"),
        excite(RIG, "--band 5,70"),
        excite(RIG, "--noise 0"),
        format!("simulate {RIG} --input good.csv --out out.csv --noise 2"),
    ];
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(refusals(&desk, &lines));
}

#[test]
fn help_is_no_error() {
    let desk = Desk::new();
    for line in ["--help", "build --help", "--version"] {
        assert!(
            desk.succeed(line).to_lowercase().contains("sinew"),
            "{line}"
        );
    }
}
