//! Results of the verbs.

use crate::desk::{Desk, checkout, columns, images};
use crate::schema::{schema, violations};
use sinew::device::Device;
use sinew::project::{self, Board, Optimise};
use sinew_sim::Rig;

/// Two sensors on one oscillator; the encoder counts double and from 0.1.
const OSCILLATOR: &str = r#"format = "sinew-rig/1"
name = "oscillator"
[[body]]
name = "mass"
motion = "slide"
inertia = 1.0
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = 25.0
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
gain = 2.0
offset = 0.1
[[sensor]]
name = "tacho"
reads = "mass.velocity"
signal = "v_m_s"
"#;

#[test]
fn simulate_writes_every_sensor_at_the_recordings_times() {
    let desk = Desk::new();
    desk.write("rig.toml", OSCILLATOR);
    // Not uniform; the first position is missing; a column that the rig does not name; no tacho.
    desk.write(
        "in.csv",
        "t,other_V,u_N,q_m\n1,7,0,\n1.1,7,0,0.5\n1.15,7,0,9\n1.4,7,0,9\n2.5,7,0,9\n",
    );
    desk.succeed("simulate rig.toml --input in.csv --out out.csv");
    let out = columns(&desk.read("out.csv"));
    let names: Vec<&str> = out.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["t", "q_m", "v_m_s"]);
    assert_eq!(out[0].1, [1.0, 1.1, 1.15, 1.4, 2.5]);
    // It starts at rest, where the first valid sample says: (0.5 - 0.1) / 2. Then q = 0.2 cos(5 t).
    for (k, t) in out[0].1.iter().enumerate() {
        let (q, v) = (0.2 * (5.0 * (t - 1.0)).cos(), -(5.0 * (t - 1.0)).sin());
        assert!(
            (out[1].1[k] - (2.0 * q + 0.1)).abs() < 1e-5,
            "q_m at {t}: {}",
            out[1].1[k]
        );
        assert!(
            (out[2].1[k] - v).abs() < 1e-4,
            "v_m_s at {t}: {}",
            out[2].1[k]
        );
    }
}

#[test]
fn simulate_agrees_with_somebody_elses_recording() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("tests/foreign/mass_spring_damper.exact.csv");
    let truth =
        std::fs::read_to_string(checkout().join("tests/foreign/mass_spring_damper.truth.json"));
    let truth: serde_json::Value =
        serde_json::from_str(&truth.expect("the file is committed")).expect("the text is JSON");
    let number = |key: &str| truth[key].as_f64().expect("the truth holds this number");
    let rig = Rig::load(desk.path("mass-spring-damper.toml")).expect("the shipped rig is sound");
    let rig = rig.with_values(&[
        ("mass.inertia", number("mass_kg")),
        ("coil.stiffness", number("stiffness_N_m")),
        ("dashpot.damping", number("damping_N_s_m")),
    ]);
    let friction = format!(
        "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = {:?}\n",
        number("coulomb_friction_N")
    );
    desk.write(
        "truth.toml",
        &(rig.expect("the names are right").to_toml().to_string() + &friction),
    );
    desk.succeed("simulate truth.toml --input mass_spring_damper.exact.csv --out out.csv --quiet");
    let (exact, out) = (
        columns(&desk.read("mass_spring_damper.exact.csv")),
        columns(&desk.read("out.csv")),
    );
    assert_eq!(out.len(), 2);
    assert_eq!(out[0], exact[0], "the recording's times");
    let theirs = &exact
        .iter()
        .find(|(name, _)| name == "q_m")
        .expect("the recording has the position")
        .1;
    let range = theirs.iter().copied().fold(0.0, |a: f64, b| a.max(b.abs()));
    let error = theirs
        .iter()
        .zip(&out[1].1)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(range > 0.1, "it hardly moves: this tests nothing");
    assert!(error < 1e-6 * range, "{error:e} of {range}");
}

#[test]
fn fit_writes_a_rig_that_keeps_its_comments() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    let said = desk.succeed(
        "fit mass-spring-damper.toml --fit mass-spring-damper.fit.csv --out fitted.toml --quiet",
    );
    assert!(said.contains("coil.stiffness"), "{said}");
    let (before, after) = (
        desk.read("mass-spring-damper.toml"),
        desk.read("fitted.toml"),
    );
    let comments = |text: &str| -> Vec<String> {
        text.lines()
            .filter_map(|line| line.split_once('#'))
            .map(|(_, c)| c.to_string())
            .collect()
    };
    assert_eq!(comments(&before), comments(&after));
    assert_ne!(before, after, "nothing was fitted");
    let rig = Rig::load(desk.path("fitted.toml")).expect("what fit writes can be read");
    // 43.6 is true; without dry friction in the rig the fit leans a little.
    let plant = sinew_sim::Plant::new(&rig).expect("and simulated");
    let at = plant
        .parameters()
        .iter()
        .position(|p| p.name == "coil.stiffness");
    let stiffness = plant.values()[at.expect("the spring is still there")];
    assert!((stiffness / 43.6 - 1.0).abs() < 0.1, "{stiffness}");
}

#[test]
fn diagnose_names_the_friction_that_the_demos_recording_hides_by_status_3_on_demand() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv")
        .bring("rigs/mass-spring-damper.test.csv");
    let line = "diagnose mass-spring-damper.toml --fit mass-spring-damper.fit.csv \
                --test mass-spring-damper.test.csv --quiet";
    let silent = desk.succeed(&format!(
        "{line} --json a.json --report a.html --rig-out mended.toml --mjcf mended.xml"
    ));
    assert_eq!(silent, "", "--quiet with --json says nothing");
    let found: serde_json::Value =
        serde_json::from_str(&desk.read("a.json")).expect("the text is JSON");
    assert_eq!(violations(&schema("diagnosis"), &found), [""; 0]);
    assert_eq!(found["verdict"], "missing_physics");
    let effect = &found["effects"][0];
    assert_eq!(effect["kind"], "coulomb_friction");
    assert_eq!(effect["component"], "mass");
    let truth =
        std::fs::read_to_string(checkout().join("tests/foreign/mass_spring_damper.truth.json"));
    let truth: serde_json::Value =
        serde_json::from_str(&truth.expect("the file is committed")).expect("the text is JSON");
    let number = |value: &serde_json::Value| value.as_f64().expect("the value is a number");
    let (level, hidden) = (
        number(&effect["parameters"]["level"]["value"]),
        number(&truth["coulomb_friction_N"]),
    );
    assert!(
        (level / hidden - 1.0).abs() < 0.02,
        "{level} N of {hidden} N"
    );
    let test = &found["fit"]["q_m"]["test"];
    assert!(
        number(&test["after_rms"]) < 0.1 * number(&test["before_rms"]),
        "{test}"
    );

    // What it leaves is what other verbs take.
    let rig = Rig::load(desk.path("mended.toml")).expect("every verb reads it");
    assert_eq!(rig.effects.len(), 1);
    assert!(desk.read("mended.xml").contains("frictionloss="));
    assert!(desk.read("a.html").contains("coulomb_friction at mass"));

    // The same input and seed: the same bytes, seconds aside; and a person gets words, and whoever
    // asks for it a status.
    let again = desk.sinew(&format!("{line} --json b.json --exit-code"));
    assert_eq!(again.status.code(), Some(3));
    let without_seconds = |name: &str| -> String {
        let text = desk.read(name);
        text.lines()
            .filter(|line| !line.contains("\"seconds\""))
            .collect()
    };
    assert_eq!(without_seconds("a.json"), without_seconds("b.json"));

    // The corrected rig lacks nothing.
    let mended = line.replace("mass-spring-damper.toml", "mended.toml");
    desk.succeed(&format!("{mended} --json c.json --exit-code"));
    let consistent: serde_json::Value =
        serde_json::from_str(&desk.read("c.json")).expect("the text is JSON");
    assert_eq!(consistent["effects"], serde_json::json!([]));
}

#[test]
fn new_writes_a_rig_that_fit_accepts() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.fit.csv");
    desk.succeed("new mass-spring-damper.fit.csv --yes --spring yes --inertia 1.1 --out rig.toml");
    let said =
        desk.succeed("fit rig.toml --fit mass-spring-damper.fit.csv --out fitted.toml --quiet");
    assert!(said.contains("free-run error"), "{said}");
    Rig::load(desk.path("fitted.toml")).expect("what fit writes can be read");
    let again = desk.sinew("new mass-spring-damper.fit.csv --yes --out rig.toml");
    assert_eq!(
        again.status.code(),
        Some(2),
        "it does not overwrite what somebody may have edited"
    );
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

/// A desk with the beginning of a shipped recording, `ms.csv`, whose times are in milliseconds.
fn milliseconds() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.fit.csv");
    let sound = desk.read("mass-spring-damper.fit.csv");
    let mut lines = sound.lines().skip_while(|line| !line.starts_with("t,"));
    let header = lines.next().expect("a header").to_owned() + "\n";
    let rows = lines.take(1500).enumerate().map(|(row, line)| {
        let (_, fields) = line.split_once(',').expect("a row has fields");
        format!("{},{fields}\n", 8 * row)
    });
    desk.write("ms.csv", &(header + &rows.collect::<String>()));
    desk
}

#[test]
fn a_build_refuses_recordings_that_are_certainly_wrong_before_it_fits() {
    let desk = milliseconds();
    desk.bring("rigs/mass-spring-damper.toml");
    let line = "build mass-spring-damper.toml --fit ms.csv --board host --out out";
    let said = desk.refusal(line);
    assert!(said.contains("time_in_milliseconds"), "{said}");
    assert!(said.contains("--time-unit ms"), "{said}");
    assert!(!desk.path("out/rig.toml").exists(), "{said}");
}

/// The unit that a person states is not refused on numbers that `sinew new` guessed.
#[test]
fn a_stated_unit_of_time_passes_from_new_to_fit() {
    let desk = milliseconds();
    let said = desk.succeed("new ms.csv --yes --spring no --time-unit ms --inertia 1e-3");
    let next = said.lines().last().expect("the verb names the next step");
    assert!(next.ends_with("--fit ms.csv --time-unit ms"), "{said}");
    desk.succeed(&format!(
        "{} --quiet",
        next.trim_start_matches("next: sinew ")
    ));
}

#[test]
fn emit_writes_a_project_that_builds_and_answers() {
    let desk = Desk::new();
    let model = checkout().join("models/reference-s");
    desk.succeed(&format!("emit {} --out project", model.display()));
    let built = project::build(&desk.path("project"), Board::Host, Some(&images()));
    let built = built.unwrap_or_else(|error| panic!("{error}"));
    let mut device = Device::host(&built.lockstep).expect("the program starts");
    let identity = device.hello(None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((identity.n_u, identity.n_y, identity.horizon), (2, 3, 10));
}

#[test]
fn a_controller_can_be_made_for_size_and_a_network_alone_cannot() {
    let desk = Desk::new();
    let model = checkout().join("models/reference-s");
    let emit = format!("emit {} --optimise size --out out", model.display());
    let network = checkout().join("rigs/experiments/mass-spring-damper.tflite");
    let alone = format!("emit {} --optimise size --out out", network.display());
    let said = desk.refusal(&format!("{alone} --c-abi"));
    assert!(said.contains("--optimise is for a controller"), "{said}");
    assert!(!desk.path("out").exists(), "a refusal writes nothing");
    let size = format!("size {} --board qemu --optimise size", network.display());
    let said = desk.refusal(&size);
    assert!(said.contains("--optimise is for a controller"), "{said}");
    desk.succeed(&emit);
    for board in ["qemu", "stm32f446", "nrf52840"] {
        let manifest = desk.read(&format!("out/boards/{board}/Cargo.toml"));
        let lines = [
            "opt-level = \"s\"",
            "[profile.release.package.sinew-model-reference-s]\nopt-level = 2",
        ];
        for line in lines {
            assert!(manifest.contains(line), "{board}: {manifest}");
        }
    }
}

/// The model of the reference problem S in a folder of its own.
pub fn reference_model(desk: &Desk, folder: &str) {
    std::fs::create_dir_all(desk.path(folder)).expect("the folder is writable");
    for file in ["model.toml", "weights.safetensors"] {
        let from = checkout().join("models/reference-s").join(file);
        std::fs::copy(from, desk.path(folder).join(file)).expect("the file can be copied");
    }
}

#[test]
fn compare_puts_several_models_to_the_same_loops_of_the_plant_it_is_given() {
    let desk = crate::interrupt::reference_desk();
    let cache = images();
    for copy in ["a", "b"] {
        reference_model(&desk, copy);
    }
    let damped = desk
        .read("rig.toml")
        .replace("damping = 20.0", "damping = 26.0");
    desk.write("real.toml", &damped);
    let loops = |plant: &str| -> Vec<serde_json::Value> {
        desk.succeed(&format!(
            "compare rig.toml a b --fit recording.csv {plant} --loops 2 --evaluations 20 --out out --build-dir {} --quiet \
             --json scores.json --report page.html --plot error.svg",
            cache.display()
        ));
        let scores: serde_json::Value =
            serde_json::from_str(&desk.read("scores.json")).expect("the text is JSON");
        let controllers = scores["controllers"].as_array().expect("a list");
        controllers.iter().map(|c| c["loops"].clone()).collect()
    };
    let real = loops("--plant real.toml");
    // Two inputs and three outputs: PID and RISE have the first two, the third is only scored.
    assert_eq!(real.len(), 4);
    assert_eq!(real[0], real[1], "one model twice has one score");
    assert_ne!(real[0][0], real[0][1], "the second loop is another");
    let believed = loops("--plant rig.toml");
    assert_ne!(
        real[0][0], believed[0][0],
        "the plant of the loop is the one given"
    );
    assert_ne!(believed[0][0], loops("")[0][0], "without one it is moved");
    for file in ["page.html", "error.svg"] {
        assert!(desk.read(file).contains("<svg"), "{file}");
    }
}

#[test]
fn compare_draws_a_plant_a_loop_and_follows_a_path() {
    let desk = crate::interrupt::reference_desk();
    let cache = images();
    reference_model(&desk, "model");
    let mut path = String::from("t,y3,y2,y1\n");
    for k in 0..120 {
        let t = f64::from(k) / 120.0;
        path += &format!("{t},{},{},{}\n", 0.1 * t, 0.2 * t, 0.3 * t);
    }
    desk.write("path.csv", &path);
    let scores = |more: &str| -> serde_json::Value {
        desk.succeed(&format!(
            "compare rig.toml model --fit recording.csv --reference path.csv --evaluations 20 --out out \
             --build-dir {} --quiet --json scores.json {more}",
            cache.display()
        ));
        serde_json::from_str(&desk.read("scores.json")).expect("the text is JSON")
    };
    let drawn = scores("--draws 3 --delay 0.004");
    assert_eq!(drawn["reference"], "the path of path.csv");
    assert_eq!(
        (&drawn["steps"], &drawn["spread"], &drawn["delay_s"]),
        (&119.into(), &0.2.into(), &0.004.into())
    );
    let loops = drawn["controllers"][0]["loops"].as_array().expect("a list");
    assert_eq!(loops.len(), 3);
    assert_ne!(loops[0], loops[1], "the second loop is another");
    // The same noise and delay, so that the difference is the plant's.
    let same = scores("--draws 3 --delay 0.004 --spread 0");
    let loops = same["controllers"][0]["loops"].as_array().expect("a list");
    for (k, one) in loops.iter().enumerate() {
        let other = &drawn["controllers"][0]["loops"][k];
        assert_ne!(one, other, "loop {k} has a plant of its own");
    }
    let length = loops[0]["distance"]["rms"].as_f64().expect("one unit");
    let parts = loops[0]["rms"].as_array().expect("a list").iter();
    let sum: f64 = parts.filter_map(|r| r.as_f64()).map(|r| r * r).sum();
    assert!(length > 1e-3 && (length - sum.sqrt()).abs() < 1e-9);
    let prompt = scores("--draws 3 --spread 0");
    assert_ne!(
        loops[0], prompt["controllers"][0]["loops"][0],
        "late measurements change nothing"
    );
    assert!(prompt.get("judged_s").is_none());
    let part = scores("--draws 3 --spread 0 --judged 0,0.3");
    assert_eq!(part["judged_s"], serde_json::json!([0.0, 0.3]));
    let most = |scores: &serde_json::Value| scores["controllers"][0]["loops"][0]["max"].clone();
    assert_ne!(most(&part), most(&prompt), "it is judged as a whole");
}

/// A cart of 1 kg with a spring of 40 N/m and some loss, in another language; Perl is part of every
/// Debian.
const CART: &str = r#"
$| = 1;
my ($q, $v) = (0, 0);
print "sinew-plant/1\nu_N\nv_m_s,q_m\n0,0\n";
while (<STDIN>) {
    my ($seconds, $u) = split /,/;
    for (1 .. 20) {
        $v += $seconds / 20 * ($u - 40 * $q - 1.2 * $v);
        $q += $seconds / 20 * $v;
    }
    print "$v,$q\n";
}
"#;

/// Three lags of two inputs, quicker for every other number of its plant.
const LAGS: &str = r#"
$| = 1;
my $rate = 3 * (1 + $ENV{SINEW_DRAW} * $ENV{SINEW_SPREAD});
my @y = (0, 0, 0);
print "sinew-plant/1\nu1,u2\ny1,y2,y3\n0,0,0\n";
while (<STDIN>) {
    my ($seconds, @u) = split /,/;
    my @to = ($u[0], $u[1], $u[0] - $u[1]);
    $y[$_] += $seconds * $rate * ($to[$_] - $y[$_]) for 0 .. 2;
    print join(",", @y), "\n";
}
"#;

#[test]
fn a_program_can_be_the_plant() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .write("cart.pl", CART);
    let mut inputs = String::from("t,u_N\n");
    for k in 0..240 {
        let u = if (k / 60) % 2 == 0 { 1.0 } else { -1.0 };
        inputs += &format!("{},{u}\n", f64::from(k) / 120.0);
    }
    desk.write("inputs.csv", &inputs);
    let simulate = |out: &str, more: &[&str]| -> Vec<f64> {
        let line = format!("simulate mass-spring-damper.toml --input inputs.csv --out {out}");
        let output = desk
            .command(&line)
            .args(more)
            .output()
            .expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        let mut read = columns(&desk.read(out));
        assert_eq!(read.last().expect("a column").0, "q_m");
        assert_eq!(read.len(), 2, "the program's other signal is not the rig's");
        read.pop().expect("a column").1
    };
    let own = simulate("own.csv", &[]);
    let other = simulate("other.csv", &["--plant-program", "perl cart.pl"]);
    let most = own.iter().fold(0.0_f64, |m, q| m.max(q.abs()));
    assert!(most > 0.02, "it hardly moves");
    let line = "simulate mass-spring-damper.toml --input inputs.csv --out again.csv";
    let mut again = desk.command(line);
    let again = again.args(["--plant-program", "perl cart.pl"]).output();
    let said = String::from_utf8_lossy(&again.expect("the program starts").stderr).into_owned();
    assert!(
        said.contains("`v_m_s` of the program is not written"),
        "{said}"
    );
    for (own, other) in own.iter().zip(&other) {
        assert!((own - other).abs() < 2e-3 * most, "{own} {other}");
    }
}

#[test]
fn compare_lets_a_program_be_every_drawn_plant() {
    let desk = crate::interrupt::reference_desk();
    let cache = images();
    reference_model(&desk, "model");
    desk.write("lags.pl", LAGS);
    let loops = |spread: &str| -> Vec<serde_json::Value> {
        let line = format!(
            "compare rig.toml model --fit recording.csv --evaluations 20 --out out --build-dir {} --quiet --json scores.json \
             --draws 2 --spread {spread}",
            cache.display()
        );
        let mut compare = desk.command(&line);
        let output = compare.args(["--plant-program", "perl lags.pl"]).output();
        let output = output.expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        let scores: serde_json::Value =
            serde_json::from_str(&desk.read("scores.json")).expect("the text is JSON");
        assert_eq!(scores["plant"], "perl lags.pl");
        assert_eq!(scores["moved"], serde_json::json!([]));
        let controllers = scores["controllers"].as_array().expect("a list");
        assert_eq!(controllers.len(), 3, "PID and RISE are tuned on it too");
        controllers[0]["loops"].as_array().expect("a list").clone()
    };
    let (drawn, alike) = (loops("0.5"), loops("0"));
    for (k, (drawn, alike)) in drawn.iter().zip(&alike).enumerate() {
        assert_ne!(drawn, alike, "loop {k} has a plant of its own");
    }
    assert_eq!(alike, loops("0"), "the same seed, the same loops");
}

/// Trained in Keras by tests/foreign/keras_predictor.py, from recordings alone and in their units.
#[test]
fn a_network_of_another_tool_becomes_a_model_of_a_rig() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/mass-spring-damper.test.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml");
    desk.write("rig.toml", &(own + "form = \"increment\"\n"));
    let said = desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --test mass-spring-damper.test.csv \
         --out model",
    );
    assert!(said.contains("dense_1/BiasAdd"), "{said}");
    let spec = sinew_model::store::load(&desk.path("model")).expect("the folder holds a model");
    assert_eq!((spec.past_inputs, spec.past_outputs), (4, 8));
    assert_eq!(spec.outputs[0].name, "q_m");
    // It has seen another mass than that of these recordings, and still foresees most of a step.
    let error = said
        .split("q_m: ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let error: f64 = error
        .and_then(|word| word.parse().ok())
        .expect("millimetres");
    assert!(
        said.contains(" mm off after one step") && error < 10.0,
        "{said}"
    );
}

#[test]
fn a_cost_to_go_of_the_rig_is_in_its_model_its_crate_and_the_tuned_rig() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml") + "form = \"increment\"\n";
    let asked = "horizon = 2\nterminal = \"value\"\nvalue_ahead = 6\n";
    let own = own.replace("horizon = 12\n", asked);
    desk.write(
        "rig.toml",
        &own.replace("control_horizon = 4", "control_horizon = 1"),
    );
    desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --out model",
    );
    let control = |folder: &str| {
        let spec = sinew_model::store::load(&desk.path(folder));
        spec.expect("the folder holds a model").control
    };
    let model = control("model");
    let value = model.value.as_ref().expect("the rig asks for one");
    assert_eq!((value.rows, value.ahead, value.points.len()), (1, 6, 5));
    assert_eq!((model.horizon, model.preview()), (2, 8));
    desk.succeed("emit model --out project");
    assert!(desk.path("project/model/src/value.rs").exists());

    let cache = images();
    desk.succeed(&format!(
        "tune rig.toml model --fit mass-spring-damper.fit.csv --out tuned.toml --model-out tuned --mpc-only \
         --evaluations 20 --horizons 1 --control-horizons 1 --build-dir {} --quiet --json tuned.json \
         --report tuned.html",
        cache.display()
    ));
    crate::pages::a_tuning_can_be_read(&desk, "tuned.html");
    let tuned = control("tuned");
    assert_eq!((tuned.horizon, tuned.value), (1, model.value));
    let rig = desk.read("tuned.toml");
    assert!(
        rig.contains("horizon = 1\nterminal = \"value\"\nvalue_ahead = 6"),
        "{rig}"
    );
    let scores: serde_json::Value =
        serde_json::from_str(&desk.read("tuned.json")).expect("the text is JSON");
    let line = &scores["objectives"][0];
    let evaluations = line["evaluations"].as_u64().expect("a number");
    assert!((11..=20).contains(&evaluations), "{line}");
    let training = |when: &str| line["training"][when].as_f64().expect("a number");
    assert!(training("after") < training("before"), "{line}");
}

#[test]
fn a_search_by_gradients_says_how_it_went_and_lowers_the_firmwares_own_objective() {
    let desk = Desk::new();
    for file in [
        "rigs/mass-spring-damper.toml",
        "rigs/mass-spring-damper.fit.csv",
        "rigs/experiments/mass-spring-damper.tflite",
    ] {
        desk.bring(file);
    }
    let own = desk.read("mass-spring-damper.toml") + "form = \"increment\"\n";
    desk.write("rig.toml", &own);
    desk.succeed(
        "import mass-spring-damper.tflite --rig rig.toml --fit mass-spring-damper.fit.csv --out model",
    );
    let said = desk.succeed(&format!(
        "tune rig.toml model --fit mass-spring-damper.fit.csv --out tuned.toml --model-out tuned --mpc-only \
         --by gradient --evaluations 25 --plants 2 --horizons 12 --control-horizons 4 --build-dir {} --quiet \
         --json tuned.json",
        images().display()
    ));
    assert!(said.contains("objective: tracking, of 2 plants"), "{said}");
    assert!(said.contains("MPC, 12 and 4 steps: "), "{said}");
    assert!(said.contains(" with derivatives; "), "{said}");
    let scores: serde_json::Value =
        serde_json::from_str(&desk.read("tuned.json")).expect("the text is JSON");
    let line = &scores["objectives"][0];
    let evaluations = line["evaluations"].as_u64().expect("a number");
    assert!((4..=26).contains(&evaluations), "{line}");
    let training = |when: &str| line["training"][when].as_f64().expect("a number");
    assert!(training("after") < training("before"), "{line}");
    let course = &line["gradients"][0];
    let broken = violations(&schema("tuning"), &scores);
    assert_eq!(broken, [""; 0]);
    assert_eq!(course["derivatives"], "exact", "{course}");
    // The loop in double precision told the search what the firmware does.
    let expected = course["objective"].as_f64().expect("a number");
    assert!((training("after") / expected - 1.0).abs() < 0.02, "{line}");
}

#[test]
fn projects_that_share_build_outputs_keep_their_own_programs() {
    let desk = Desk::new();
    let cache = images();
    let models = ["reference-s", "reference-s-n5"].map(|model| {
        let spec = sinew_model::store::load(&checkout().join("models").join(model));
        let spec = spec.expect("the file ships with the project");
        project::write(&desk.path(model), &spec, Optimise::Speed).expect("the folder is writable");
        (model, sinew_model::fingerprint(&spec))
    });
    let built = |(model, hash): (&str, u32)| {
        for round in 0..8 {
            let built = project::build(&desk.path(model), Board::Host, Some(&cache));
            let built = built.unwrap_or_else(|error| panic!("{error}"));
            let mut device = Device::host(&built.lockstep).expect("the program starts");
            let identity = device.hello(Some(hash));
            assert!(identity.is_ok(), "{model}, round {round}: {identity:?}");
        }
    };
    std::thread::scope(|both| {
        for model in models {
            both.spawn(move || built(model));
        }
    });
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
