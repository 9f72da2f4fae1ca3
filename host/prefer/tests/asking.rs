//! Questions to people who are not in the family of the model.

use sinew_prefer::{Answer, Belief, Candidates, Choice, next, predicted, random, two_people};

/// Thirty loops on a front of error and effort, with a third feature that nobody asked for.
fn front() -> Vec<Vec<f64>> {
    (0..30)
        .map(|i| {
            let x = f64::from(i) / 29.0;
            vec![0.2 + x * x, 1.5 - x, 1.0 + (7.0 * x).sin()]
        })
        .collect()
}

fn answer(utility: impl Fn(usize) -> f64, (first, second): (usize, usize)) -> Answer {
    let (a, b) = (utility(first), utility(second));
    let choice = match a.total_cmp(&b) {
        std::cmp::Ordering::Greater => Choice::First,
        std::cmp::Ordering::Less => Choice::Second,
        std::cmp::Ordering::Equal => Choice::Alike,
    };
    Answer {
        first,
        second,
        choice,
    }
}

/// Answers to ten questions, seeds from `seed` on.
fn asked(known: &Candidates, utility: impl Fn(usize) -> f64 + Copy, seed: u64) -> Vec<Answer> {
    let mut all = Vec::new();
    for k in 0..10 {
        let belief = Belief::after(known, &all, seed + k).unwrap();
        let Some(question) = next(&belief, &all) else {
            break;
        };
        all.push(answer(utility, (question.first, question.second)));
    }
    all
}

/// The least effort among those whose error is small enough: loop 14 of 30.
fn threshold(loops: &[Vec<f64>]) -> impl Fn(usize) -> f64 + Copy + '_ {
    |i| -loops[i][1] - if loops[i][0] > 0.45 { 5.0 } else { 0.0 }
}

#[test]
fn ten_questions_find_what_a_threshold_asks_for() {
    let loops = front();
    let known = Candidates::new(&loops).unwrap();
    let utility = threshold(&loops);
    let best = (0..30).map(utility).fold(f64::MIN, f64::max);
    for seed in [0, 100, 200] {
        let answers = asked(&known, utility, seed);
        let winner = Belief::after(&known, &answers, seed).unwrap().winner();
        let missing = best - utility(winner.index);
        assert!(missing < 0.15, "seed {seed}: {missing} of {winner:?}");
    }
}

#[test]
fn questions_that_are_chosen_gain_more_than_any_pairs() {
    let loops = front();
    let known = Candidates::new(&loops).unwrap();
    let utility = threshold(&loops);
    let gain = |answers: &[Answer], seed| {
        utility(Belief::after(&known, answers, seed).unwrap().winner().index)
    };
    let (mut chosen, mut any) = (0.0, 0.0);
    for seed in (0..12).map(|k| 50 * k) {
        chosen += gain(&asked(&known, utility, seed), seed);
        let mut all = Vec::new();
        for k in 0..10 {
            let pair = random(known.len(), &all, seed + k).unwrap();
            all.push(answer(utility, pair));
        }
        any += gain(&all, seed);
    }
    assert!(chosen > any + 0.2, "{chosen} chosen, {any} any");
}

#[test]
fn no_pair_is_asked_twice_and_questions_end() {
    let loops: Vec<Vec<f64>> = front().into_iter().take(4).collect();
    let known = Candidates::new(&loops).unwrap();
    let mut all: Vec<Answer> = Vec::new();
    for k in 0..20 {
        let belief = Belief::after(&known, &all, k).unwrap();
        let Some(question) = next(&belief, &all) else {
            break;
        };
        let pair = [question.first, question.second];
        let same = |a: &Answer| pair.contains(&a.first) && pair.contains(&a.second);
        assert!(!all.iter().any(same), "{pair:?} again");
        all.push(answer(|i| -(i as f64), (pair[0], pair[1])));
    }
    assert_eq!(all.len(), 6, "all pairs of four");
}

#[test]
fn people_who_want_opposites_are_told_apart_and_one_person_is_not() {
    let loops = front();
    let known = Candidates::new(&loops).unwrap();
    let precise = |i: usize| -loops[i][0];
    let calm = |i: usize| -loops[i][1];
    let one = asked(&known, precise, 0);
    let again = asked(&known, precise, 500);
    let other = asked(&known, calm, 900);
    assert!(two_people(&known, &one, &other, 1).unwrap().apart());
    assert!(!two_people(&known, &one, &again, 1).unwrap().apart());
}

#[test]
fn answers_that_follow_a_feature_are_expected_more_than_those_that_follow_none() {
    let loops = front();
    let known = Candidates::new(&loops).unwrap();
    let mean = |answers: &[Answer]| {
        let all = predicted(&known, answers, 3).unwrap();
        all.iter().map(|p| p.ln()).sum::<f64>() / all.len() as f64
    };
    let sound = asked(&known, |i| -loops[i][1], 0);
    // Somebody who likes every fourth loop.
    let odd = asked(&known, |i| f64::from(u8::from(i % 4 == 1)), 0);
    assert!(mean(&sound) > mean(&odd) + 0.1);
}
