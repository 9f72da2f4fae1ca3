//! `sinew compare`: several controllers in the same loops.

use crate::desk::{Desk, checkout, images};

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
