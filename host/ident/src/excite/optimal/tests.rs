use sinew_sim::{Plant, Rig};

use super::information::Information;
use super::segment::{Segment, UNITS, assemble};
use super::{FAMILIES, Optimal, optimal};
use crate::excite::reveal::{norm, weak_instances};
use crate::excite::{Kind, Options, design};

/// A mass on a spring, pushed; its damping is a free parameter.
fn rig() -> Rig {
    let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\nmotion = \"slide\"\n\
         inertia = { value = 1.0 }\n\
         [[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = { value = 40.0 }\n\
         [[damper]]\nname = \"oil\"\nfrom = \"ground\"\nto = \"mass\"\ndamping = { value = 1.2 }\n\
         [[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\ngain = 1.0\n\
         limit = [-20.0, 30.0]\nrate_limit = 400.0\n\
         [[sensor]]\nname = \"encoder\"\nreads = \"mass.position\"\nsignal = \"q_m\"\n";
    Rig::parse(text, "x.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn options() -> Options {
    Options {
        seconds: 8.0,
        rate_hz: 60.0,
        ..Options::default()
    }
}

fn found(seed: u64) -> Optimal {
    let options = Options { seed, ..options() };
    optimal(&rig(), "x.toml", &options, (0.005, 40), &|_, _| {}).expect("the rig can be driven")
}

#[test]
fn a_design_shows_the_hardest_effects_better_than_every_family() {
    let found = found(1);
    let compared = &found.comparison;
    assert_eq!(compared.families.len(), FAMILIES.len());
    for (kind, family) in &compared.families {
        assert!(compared.chosen.worth >= family.worth, "{kind:?}");
    }
    let (gain, kind) = compared.gain();
    assert!(gain > 1.0, "{gain} of {kind:?}");
    // The default of the command line shows far less.
    let mixed = compared
        .families
        .iter()
        .find(|(family, _)| *family == Kind::Mixed);
    let mixed = mixed.map_or(0.0, |(_, family)| family.mean_distance);
    assert!(compared.chosen.mean_distance > 1.3 * mixed, "{mixed}");
    // Other parameters are known no worse for it.
    let best = compared.families.iter().find(|(family, _)| *family == kind);
    let widest = best
        .and_then(|(_, family)| family.widest.as_ref())
        .map(|widest| widest.1);
    let chosen = compared.chosen.widest.as_ref().map(|widest| widest.1);
    assert!(chosen <= widest.map(|w| 1.5 * w), "{chosen:?} {widest:?}");
}

#[test]
fn a_design_keeps_to_limits_and_rates() {
    for seed in 1..3 {
        let found = found(seed);
        let (u, t) = (&found.experiment.inputs[0], &found.experiment.t);
        assert_eq!(u.len(), 481);
        assert!(
            u.iter().all(|u| (-15.0..=25.0).contains(u)),
            "80 % of the range"
        );
        for k in 1..u.len() {
            assert!(
                (u[k] - u[k - 1]).abs() <= 400.0 * (t[k] - t[k - 1]),
                "row {k}"
            );
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_design() {
    assert_eq!(found(2).experiment.inputs, found(2).experiment.inputs);
}

/// A damping that the rig fits is no aim: every refit imitates it.
#[test]
fn an_effect_that_a_free_parameter_imitates_is_no_aim() {
    let found = found(1);
    let names = found.comparison.chosen.hardest.iter();
    let names: Vec<&str> = names
        .map(|(index, _)| found.revelation.effects[*index].kind.description().kind)
        .collect();
    assert!(!names.contains(&"viscous_damping"), "{names:?}");
}

/// The products of a segment hold what a projection of its signals would leave (5).
#[test]
fn distances_from_products_are_those_of_projections() {
    let (rig, options) = (rig(), options());
    let plant = Plant::new(&rig).expect("the rig is sound");
    let mixed = design(&plant, "x.toml", &options).expect("the input has limits");
    let (instances, deviations) = weak_instances(&rig, &mixed, 0.005).expect("the rig runs");
    let segment = Segment::family(Kind::Steps, &options);
    let file = std::path::Path::new("x.toml");
    let whole = assemble(&plant, file, (&options, options.seconds), &[segment]);
    let whole = whole.expect("the input has limits");
    let products = Information::of(&rig, &whole, &instances, &deviations).expect("it runs");
    let measured = products.measure();
    let projected = super::information::projected(&rig, &whole, &instances, &deviations);
    for (product, left) in measured.distances.iter().zip(&projected) {
        let left = norm(left);
        assert!(
            (product - left).abs() < 1e-3 * left.max(1.0),
            "{product} {left}"
        );
    }
    // Twice the same segment: intervals shrink by the root of two.
    let twice = Information::sum([&products, &products].into_iter()).expect("two of them");
    for (one, two) in measured.half_widths.iter().zip(twice.measure().half_widths) {
        assert!((one / two - 2f64.sqrt()).abs() < 1e-6, "{one} {two}");
    }
}

#[test]
fn segments_fill_the_time_whatever_their_lengths() {
    let (rig, options) = (rig(), options());
    let plant = Plant::new(&rig).expect("the rig is sound");
    let file = std::path::Path::new("x.toml");
    let library = Segment::library(&options, 1);
    for lengths in [vec![UNITS], vec![1; UNITS], vec![4, 1, 1, 2], vec![2, 2, 4]] {
        let segments: Vec<Segment> = (lengths.iter().zip(&library))
            .map(|(&length, segment)| segment.with_length(length))
            .collect();
        let whole = assemble(&plant, file, (&options, options.seconds), &segments);
        assert_eq!(whole.expect("limits").inputs[0].len(), 481, "{lengths:?}");
    }
}
