//! Constants of a diagnosis: value, unit, reason, and what each was settled on.
//!
//! A constant may be changed freely where it changes no name, place or confidence
//! ([`Change::Free`]): the committed cases are enough then. Every other one belongs to the
//! published table (docs/evaluation/proof.md): whoever changes it draws a new one of a seed that
//! nobody has seen.

/// Test that a change of a constant asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The committed cases: it changes what is said about a place, or a force without a name, and
    /// no name or confidence.
    Free,
    /// A new blind table.
    Table,
}

/// A constant as the test of this file sees it.
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    /// `section.field`.
    pub name: &'static str,
    /// Unit; 1 for counts and ratios.
    pub unit: &'static str,
    /// Test that a change asks for.
    pub change: Change,
}

macro_rules! constants {
    ($($(#[$of:meta])* $section:ident: $name:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty = $value:expr, $unit:literal, $change:ident;)*
    })*) => {
        $(
            $(#[$of])*
            #[derive(Clone, Debug, PartialEq)]
            pub struct $name { $($(#[$doc])* pub $field: $type,)* }
        )*

        /// Every constant.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Config { $($(#[$of])* pub $section: $name,)* }

        impl Config {
            /// Today's values.
            pub const TODAY: Self = Self { $($section: $name { $($field: $value,)* },)* };

            /// Every constant with its unit and with what its change asks for.
            pub const ALL: &[Constant] = &[$($(Constant {
                name: concat!(stringify!($section), ".", stringify!($field)),
                unit: $unit,
                change: Change::$change,
            },)*)*];
        }
    };
}

constants! {
    /// Roles of recordings.
    split: Split {
        /// Part of each recording, at its end, that is set aside for the check where none is given.
        aside: f64 = 0.35, "1", Table;
        /// A recording with fewer rows is not cut, and shows no second effect.
        shortest: usize = 100, "rows", Table;
        /// Confidence of a recording that checks itself, as a part of what it were else.
        trust_by_itself: f64 = 0.7, "1", Table;
        /// Intervals that a recording is first judged in where a body integrates; fewer where
        /// nothing is left in any of them.
        parts: usize = 8, "1", Table;
        /// Multiple of a signal's spread in one recording from where on the error of the refitted
        /// rig's free run says that it has run away: it is judged in intervals, too.
        away: f64 = 2.0, "spread", Table;
        /// The fewest rows of an interval.
        interval_rows: usize = 100, "rows", Table;
        /// The fewest intervals of a part of the rows: fewer would miss what happens once.
        fewest_intervals: usize = 8, "1", Table;
        /// Part of a signal's range on each side of its middle within which a crossing is not
        /// counted: noise crosses there, and nothing came back.
        crossing_band: f64 = 0.05, "range", Table;
    }
    /// Full refits.
    refit: Refit {
        /// Sub-steps of one simulation of a full refit, about: bounds its time.
        work: usize = 8000, "sub-steps", Table;
        /// Longest sub-step of a full refit and of all that is judged, in units of one over the
        /// fastest rate; of a rig with costly steps (`fit/pace.rs`) it is longer, and the
        /// fewest rows are fewer.
        step: f64 = 0.2, "1/rate", Table;
        /// The fewest rows of a full refit.
        rows: usize = 2000, "rows", Table;
        /// Steps of a full refit.
        steps: usize = 12, "steps", Table;
        /// Number of trials of a screening that are refitted to all recordings.
        candidates: usize = 4, "1", Table;
        /// A cost of no more than this multiple of what noise alone costs is explained: a full
        /// refit that has lost it begins again in pieces.
        explained: f64 = 1.5, "1", Table;
        /// Pieces of an interval, one refit after the other, where a full refit has lost what its
        /// screening had found.
        pieces: [usize; 4] = [8, 4, 2, 1], "1", Table;
        /// Steps of a fit to all rows, from where a full refit ended
        /// (docs/lab/0065-refit-on-all-rows.md).
        all_rows_steps: usize = 6, "steps", Table;
        /// Steps of the last fit, of the corrected model, which begins where the search ended.
        corrected_steps: usize = 15, "steps", Table;
        /// Predicted part of the cost below which a full refit has converged.
        tolerance: f64 = 1e-4, "1", Table;
    }
    /// The rig without any added term.
    baseline: Baseline {
        /// Steps of a refit of the rig that begins where a candidate ended.
        again_steps: usize = 15, "steps", Table;
        /// Largest growth of the rig's fastest rate for that refit to be tried: a stiff one
        /// takes minutes.
        slowest: f64 = 4.0, "1", Table;
        /// The rig alone must leave less than this part of what it left before, for its first refit
        /// to have stopped short.
        stopped_short: f64 = 0.5, "1", Table;
    }
    /// Models and weights.
    model: Model {
        /// Standard deviation of the prior around what the rig says, as a multiple of each value;
        /// the same as in a fit.
        prior_width: f64 = 3.0, "1", Table;
        /// Steps of a fit of start states alone.
        state_steps: usize = 6, "steps", Table;
        /// Part of a sensor's noise, as its differences show it, that the motion of the refitted
        /// rig shows as well, from where on rows are too far apart to tell noise from motion.
        blurred: f64 = 0.7, "1", Table;
        /// Weights are never finer than this part of a signal's spread: below lies round-off.
        finest_weight: f64 = 1e-6, "1", Table;
        /// Distance at which a state that an effect adds may start from where it is thought to be.
        added_state_width: f64 = 3.0, "noise", Table;
        /// A parameter of the rig this many times as large or as small as its owner wrote has
        /// changed its meaning.
        implausible_change: f64 = 5.0, "1", Table;
        /// Sub-steps allowed to what is added to a rig, as a multiple of those of the rig alone,
        /// which may have run along that bound.
        more_substeps: usize = 2, "1", Table;
        /// The fewest residuals in a row of which a correlation time is estimated.
        correlated_rows: usize = 40, "rows", Table;
        /// Part of its largest value below which a strength that depends on a signal is zero at an
        /// end of the signal's range.
        nearly_zero: f64 = 0.1, "1", Table;
        /// Starts of such a strength: its constant part, and the part proportional to the signal.
        signal_starts: [(f64, f64); 2] = [(0.5, 0.5), (0.1, 0.9)], "1", Table;
    }
    /// Screening of all terms on part of the rows.
    screening: Screening {
        /// Least gain of a parameter, in units of the noise squared: half the logarithm of some
        /// thousand samples.
        parameter_cost: f64 = 3.5, "1", Table;
        /// Sub-steps of one simulation of a screening, about: bounds its time.
        work: usize = 2500, "sub-steps", Table;
        /// Longest sub-step of a screening, in units of one over the fastest rate: three times a
        /// simulation's. An undamped mode is off by a ten-thousandth of its phase then, alike in
        /// all trials.
        step: f64 = 0.3, "1/rate", Table;
        /// Thinned recordings are still at least this dense, in steps per unit of the fastest rate.
        density: f64 = 0.1, "1/rate", Table;
        /// Intervals of a screening.
        intervals: usize = 8, "1", Table;
        /// The fewest rows of a screening.
        rows: usize = 1000, "rows", Table;
        /// The fewest rows of a piece of an interval.
        piece_rows: usize = 25, "rows", Table;
        /// Steps of the fit of the rig alone to the rows of a screening.
        baseline_steps: usize = 15, "steps", Table;
        /// Trace on diagonals, so that columns without effect can be factored.
        regularisation: f64 = 1e-9, "1", Table;
        /// Number of lowest predicted costs that are refitted, beside the lowest of each family.
        refitted: usize = 12, "1", Table;
        /// Strength of a weak start, as a part of the usual one: linear theory holds for it.
        weak: f64 = 0.02, "1", Table;
        /// Steps of the trials that are refitted.
        first_steps: usize = 6, "steps", Table;
        /// Steps of the best of them further.
        more_steps: usize = 8, "steps", Table;
        /// Number of them that go further.
        kept: usize = 8, "1", Table;
        /// Number of trials that are refitted before asking whether the mismatch is explained
        /// already.
        at_once: usize = 8, "1", Table;
        /// Explained: no more than this part of the noise, and of what there was, is left beside
        /// the noise.
        explained: f64 = 0.1, "1", Table;
        /// Once it is explained, a trial that takes less than this part of what the best one takes
        /// is left out.
        hopeless: f64 = 0.5, "1", Table;
        /// Number of starts of a term that are fitted, beside the best weak and the best usual one.
        starts: usize = 2, "1", Table;
        /// Predicted part of the cost below which a trial has converged.
        tolerance: f64 = 1e-3, "1", Table;
        /// The same of the rig alone, against which all trials are measured.
        baseline_tolerance: f64 = 1e-5, "1", Table;
        /// Laws of the best one's family are tried again where they leave more than this multiple
        /// of what it leaves.
        same_family: f64 = 1.5, "1", Table;
    }
    /// Screening over short intervals.
    short_horizon: ShortHorizon {
        /// Pieces of an interval, one screening after the other.
        pieces: [usize; 2] = [4, 2], "1", Table;
        /// Steps of the fit of the rig alone to the pieces.
        baseline_steps: usize = 15, "steps", Table;
        /// Number of single terms on top of which a second one is tried.
        parents: usize = 2, "1", Table;
        /// Largest part of the cost that half of a pair leaves.
        hopeless: f64 = 0.9, "1", Table;
        /// Number of newcomers of the best pairs on top of which a second term is tried, too.
        exchanges: usize = 2, "1", Table;
        /// They are where the best pair leaves no more than this part of what there was beside the
        /// noise.
        hopeful: f64 = 0.3, "1", Table;
        /// There is no second term where the best pair, after one parent and after two, leaves more
        /// than these parts of what the best single one leaves beside the noise: of true pairs none
        /// left more than 0.42 and 0.40.
        in_vain: [f64; 2] = [0.65, 0.5], "1", Table;
    }
    /// Second terms.
    pair: Pair {
        /// Number of candidates on top of which a second term is tried.
        parents: usize = 2, "1", Table;
        /// Largest part of the squares that half of a pair leaves.
        hopeless: f64 = 0.9, "1", Table;
        /// But what leaves less than this part where it was fitted may be one, whatever it does
        /// elsewhere without the other half.
        fitted: f64 = 0.3, "1", Table;
        /// Nor is one what leaves this many times as much as another does.
        behind: f64 = 8.0, "1", Table;
        /// The same once a pair explains all.
        close: f64 = 2.0, "1", Table;
        /// Number of times that the first of a pair is exchanged: alone, it had to explain what the
        /// second does as well.
        exchanges: usize = 2, "1", Table;
        /// Number of pairs that are taken apart, to see whether one term does it after all.
        halved: usize = 3, "1", Table;
        /// Steps of a first term on the rows of the screening of a second.
        parent_steps: usize = 6, "steps", Table;
    }
    /// Restarts from the best candidate.
    restart: Restart {
        /// Number of times that alternatives are refitted from where the best one ended, while that
        /// makes another one the best.
        rounds: usize = 3, "1", Table;
        /// Number of alternatives that are refitted once more.
        alternatives: usize = 4, "1", Table;
    }
    /// Acceptance and naming.
    acceptance: Acceptance {
        /// An accepted candidate leaves less than this part of the squares that the baseline leaves
        /// beside noise on the check recordings: it removes half of them.
        most_left: f64 = 0.5, "1", Table;
        /// The same of whole check recordings from fitted start states, where free runs grow worse.
        most_left_of_whole: f64 = 0.4, "1", Table;
        /// The same of intervals, where free runs over whole recordings grow worse: what explains
        /// them only in part has to be better there. Case 44 of the committed leaves 0.34.
        most_left_of_lost: f64 = 0.25, "1", Table;
        /// Part of its size that an effect keeps in the corrected model. The dry friction that case
        /// 44 of the committed was given had none left.
        kept_of_size: f64 = 0.1, "1", Table;
        /// Part of the mismatch that a simpler law may leave more than a richer one of its family
        /// of which some parameter is not known.
        nearly: f64 = 0.05, "1", Table;
        /// Growth of the error of one recording, over the intervals that are judged, from where on
        /// a candidate makes it worse.
        spoilt: f64 = 1.25, "1", Table;
        /// The same of a coordinate that nobody sees: behind a controller, a resonance follows any
        /// disturbance of one frequency through the command. What was named rightly on seeds 2033
        /// and 2034 left less than a thousandth, a sine that was called a mode a fiftieth.
        most_left_of_mode: f64 = 0.005, "1", Table;
        /// Amount that an effect removes from where on no second witness is asked for.
        large: f64 = 1.0, "noise", Table;
        /// An effect at one component is named instead of at a whole group where it is this part as
        /// probable.
        one_of_group: f64 = 0.1, "1", Table;
        /// Half-widths of a 95 % interval that some parameter of an effect is away from zero: three
        /// standard deviations.
        certain: f64 = 1.5, "half widths", Table;
        /// Least confidence of a name as it is printed, doubt about the recordings aside: what is
        /// as likely wrong as right is no name.
        unsure: f64 = 0.5, "1", Table;
        /// The same of a coordinate that nobody sees, which follows disturbances: the only two
        /// names that 1,280 controls of seeds 2032 to 2035 were given were modes, and of seed 2035
        /// no mode was rightly named with less than 0.83.
        unsure_of_mode: f64 = 0.7, "1", Table;
        /// Growth of the error of free runs over whole check recordings from where on a candidate
        /// is none, whatever it does on intervals. Of what was named rightly on seeds 2032 and 2033
        /// none had more than 1.16; a damping by the root of speed, called friction, had 1.51.
        lost: f64 = 1.25, "1", Table;
        /// The same with an effect of several rests: a free run ends in one or in another. A right
        /// one of seed 2034 had 1.53.
        lost_in_wells: f64 = 2.0, "1", Table;
        /// The same over the fit recordings. Of 292 names of seed 2038 none had more than 1.00003;
        /// a creep that followed a disturbance, on intervals, had 1.13.
        lost_of_fit: f64 = 1.05, "1", Table;
        /// Number of candidates that free runs may refute before nothing is named.
        refuted: usize = 5, "1", Table;
        /// An amount matters that exceeds this part of a sensor's noise and the next of its spread
        /// together.
        matters_of_noise: f64 = 0.1, "noise", Table;
        /// See `matters_of_noise`.
        matters_of_spread: f64 = 1e-3, "spread", Table;
        /// Standard deviations of what noise alone leaves from where on residuals hold something
        /// else.
        significant: f64 = 5.0, "standard deviations", Table;
        /// A law of a sensor that takes less than this part of its scale's step is as straight as
        /// that scale.
        within_step: f64 = 0.5, "steps of the sensor", Table;
        /// Most terms of a candidate that takes part in the comparison where nothing is chosen.
        most_terms: usize = 2, "1", Table;
        /// Growth of a recording's error that is a digit and no loss.
        no_worse: f64 = 1.001, "1", Table;
    }
    /// Comparison of candidates.
    evidence: Evidence {
        /// Resamplings of the blocks of time.
        resamplings: usize = 200, "1", Table;
        /// Residuals below this fraction of the signal's standard deviation are treated as
        /// round-off.
        round_off: f64 = 1e-5, "1", Table;
        /// Predictions that differ by less are the same.
        same: f64 = 0.02, "noise", Table;
        /// Predictions that differ by less cannot be told apart by these recordings.
        alike: f64 = 0.25, "noise", Table;
    }
    /// Confidence.
    calibration: Calibration {
        /// Highest confidence, however well everything fits: nobody has tried what is not in the
        /// vocabulary.
        most: f64 = 0.99, "1", Table;
        /// The same where something is left: what is named is not all, and may be the nearest name
        /// of something else.
        part: f64 = 0.9, "1", Table;
        /// Part of the confidence that goes where all of the mismatch is left: what remains lowers
        /// the name of what was found little.
        remainder: f64 = 0.5, "1", Table;
        /// Worth of a confidence for each reason to doubt it that no evidence shows.
        doubt: f64 = 0.7, "1", Table;
        /// Multiple of the error on the check recordings that the fit recordings may keep.
        left_behind: f64 = 5.0, "1", Table;
        /// The same of what removes less than the noise: of 24 such answers of seed 2030, 19 were
        /// right.
        small: f64 = 0.85, "1", Table;
        /// Confidence from where on statements are as often right as they say. Below, of seeds 2029
        /// to 2031, 15 of 25 around 0.75 were right, 5 of 25 around 0.58, and 2 of 40 around 0.4
        /// (docs/lab/0058-calibration-of-confidence.md): a line down to `half`
        /// (docs/explanation/diagnosis.md, eq. 11a).
        calibrated_above: f64 = 0.86, "1", Table;
        /// Worth of a stated half.
        half: f64 = 0.1, "1", Table;
    }
    /// Faults and numbers that could look like a named effect.
    imitations: Imitations {
        /// Error beside that of the named effect that is as small.
        as_small: f64 = 1.05, "1", Table;
        /// Corrections of a sensor's drift rate, by what is left with it.
        rounds: usize = 3, "1", Table;
        /// Most bare numbers of which every two are tried: 21 refits.
        in_pairs: usize = 7, "1", Table;
    }
    /// Place of a mismatch.
    locate: Locate {
        /// Rows of one recording that a force is recovered from, about.
        rows: usize = 800, "rows", Free;
        /// Less than this part of the force's variance is not following.
        little: f64 = 0.3, "1", Free;
        /// A plainer law is said unless another explains this much more of the variance.
        plainer: f64 = 0.03, "1", Free;
        /// Sizes of a force that wanders, in those that move the device as recorded.
        sizes: [f64; 2] = [0.1, 1.0], "1", Free;
        /// Its correlation times, in units of position over velocity.
        times: [f64; 2] = [0.1, 0.5], "1", Free;
        /// Standard deviation of a start state, in units of its scale.
        start_width: f64 = 0.3, "scale", Free;
        /// A law whose largest value is a smaller part of the force's is that of a sensor.
        no_force: f64 = 1e-6, "1", Free;
        /// Windows of a recording by which it is said when a mismatch shows (eq. 17).
        windows: usize = 40, "1", Free;
        /// Part of the worst window's error from where on a window is named.
        missed: f64 = 0.5, "1", Free;
        /// Windows with a gap of no more than this part of one are joined.
        gap: f64 = 0.2, "window", Free;
        /// Most intervals that are named.
        intervals: usize = 5, "1", Free;
        /// A force acts where it is larger than this part of its largest values (eq. 17a).
        acts: f64 = 0.2, "1", Free;
        /// Its largest values are those of this quantile.
        largest: f64 = 0.95, "1", Free;
        /// Parts of its samples between whose ends a region may end (eq. 17b).
        cuts: usize = 50, "1", Free;
        /// Agreement by which a region of two ends has to be better than one of one end.
        second_end: f64 = 0.02, "1", Free;
    }
    /// A force without a name.
    learned_force: LearnedForce {
        /// Steps of the fit of a learned force.
        steps: usize = 20, "steps", Free;
        /// Standard deviation of the prior of each knot about no force, in sizes that move the
        /// signals by the noise.
        width: f64 = 30.0, "1", Free;
        /// Part of the motion outside which knots are seldom met.
        rare: f64 = 0.005, "1", Free;
        /// Rounds over the knots of its start.
        sweeps: usize = 300, "1", Free;
        /// Part of a knot's own weight that holds its start to none.
        shrinkage: f64 = 1e-3, "1", Free;
        /// It stands in where the free-run error on the check recordings falls to this part or
        /// less.
        worth: f64 = 0.9, "1", Free;
    }
    /// Advice.
    report: Report {
        /// An alternative less probable than this needs no experiment.
        doubt: f64 = 0.02, "1", Free;
        /// The fewest rows of a window of which errors are printed.
        window_rows: usize = 100, "rows", Free;
        /// Most that constants for each recording may leave of what one for all leaves, for the
        /// recordings to differ: half, as an effect may.
        differing: f64 = 0.5, "1", Free;
        /// Least part of the mismatch that one constant for all leaves, for the difference to be
        /// said. Recordings of which one was fitted leave half.
        worth_a_word: f64 = 0.25, "1", Free;
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::TODAY
    }
}

/// The constants that a diagnosis uses.
pub static CONFIG: Config = Config::TODAY;

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever adds a constant says here whether it may be changed without a new blind table.
    #[test]
    fn these_constants_and_no_others_may_be_changed_without_a_new_blind_table() {
        let free = Config::ALL.iter().filter(|one| one.change == Change::Free);
        let free: Vec<&str> = free.map(|one| one.name).collect();
        assert_eq!(
            free,
            [
                "locate.rows",
                "locate.little",
                "locate.plainer",
                "locate.sizes",
                "locate.times",
                "locate.start_width",
                "locate.no_force",
                "locate.windows",
                "locate.missed",
                "locate.gap",
                "locate.intervals",
                "locate.acts",
                "locate.largest",
                "locate.cuts",
                "locate.second_end",
                "learned_force.steps",
                "learned_force.width",
                "learned_force.rare",
                "learned_force.sweeps",
                "learned_force.shrinkage",
                "learned_force.worth",
                "report.doubt",
                "report.window_rows",
                "report.differing",
                "report.worth_a_word",
            ]
        );
        assert_eq!(Config::ALL.len(), 131);
        assert!(Config::ALL.iter().all(|one| !one.unit.is_empty()));
    }

    #[test]
    fn the_default_is_todays() {
        assert_eq!(Config::default(), CONFIG);
    }
}
