//! What is alike is fitted as one before each has its own numbers.

use super::compiled;
use super::finger::{Finger, RUBS, suspect, track};

#[test]
fn what_is_alike_is_fitted_as_one_before_each_has_its_own_number() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let bench = finger.bench(200);
    let track = track(&bench);
    let values = compiled(bench.written).values();
    let parent = track.first(bench.written, &values, 15).expect("a rig");
    let parent = parent.expect("it can be simulated");
    let begin = |at: &[&str]| {
        let begun = track.begin(&parent, &suspect(RUBS, at), &vec![0.1; at.len()]);
        begun.expect("it can sit there")
    };

    let both = begin(&["east", "west"]);
    let from = track.together(&both).expect("it can be simulated");
    let of = |values: &[f64], tendon: &str| {
        let name = format!("{tendon}.{RUBS}.coefficient");
        values[both.model.plant.slot(&name).expect("it is there")]
    };
    let [east, west] = ["east", "west"].map(|tendon| of(&from.values, tendon));
    assert_eq!(east, west);
    assert!(0.17 < east && east < 0.22, "{east}");
    let tried = track.improved(both.suspects, both.model.clone(), from, 10);
    let own = tried.expect("it can be simulated").point.values;
    assert!((of(&own, "east") / 0.17 - 1.0).abs() < 0.1);
    assert!((of(&own, "west") / 0.22 - 1.0).abs() < 0.1);

    let one = begin(&["west"]);
    let from = track.together(&one).expect("nothing is simulated");
    assert_eq!(from.values, one.from.values);
}
