//! Readings that differ from recording to recording by a constant, which no law explains.

use sinew_sim::rig::Sensor;

use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::wording::share_of;
use crate::report::quantity;

/// Residuals of one sensor over one recording: their number, sum and sum of squares.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Sums {
    fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    /// Squares about the mean.
    fn about_mean(&self) -> f64 {
        self.squares - self.sum * self.mean()
    }
}

/// Notes about sensors of which one constant for each recording halves what a candidate and one
/// constant for all leave beside noise. The constants pay for their number.
pub(crate) fn differing(case: &Case, left: &Candidate) -> Vec<String> {
    let memory = left
        .fit
        .correlation_time()
        .max(left.check.correlation_time());
    let sensors = case.written.sensors.iter().enumerate();
    let differs = sensors.filter(|(_, sensor)| !sensor.offset.per_recording);
    let known = left.trial.model.plant.sensors();
    let notes = differs.filter_map(|(index, sensor)| {
        let mut all = sums(&left.fit, case.fit, index);
        all.extend(sums(&left.check, case.check, index));
        let noise = case.fit.noise[index].max(case.check.noise[index]);
        note((sensor, &known[index].unit), &all, (noise, memory))
    });
    notes.collect()
}

/// Sums over each recording of a role.
fn sums(left: &Residuals, data: &Data, sensor: usize) -> Vec<Sums> {
    let mut all = vec![Sums::default(); data.experiments.len()];
    let residuals = left.series[sensor].iter().flatten();
    for ((recording, _), residual) in left.origin[sensor].iter().zip(residuals) {
        let sums = &mut all[*recording];
        sums.count += 1.0;
        sums.sum += residual;
        sums.squares += residual * residual;
    }
    all
}

/// Note about one sensor, whose noise has this standard deviation and whose residuals remember
/// themselves for so many samples.
fn note(
    (sensor, unit): (&Sensor, &str),
    recordings: &[Sums],
    (noise, memory): (f64, f64),
) -> Option<String> {
    let mut pooled = Sums::default();
    for one in recordings {
        pooled.count += one.count;
        pooled.sum += one.sum;
        pooled.squares += one.squares;
    }
    let beside = |squares: f64| (squares - pooled.count * noise * noise).max(0.0);
    let own: f64 = recordings.iter().map(Sums::about_mean).sum();
    let (before, shared, each) = (
        beside(pooled.squares),
        beside(pooled.about_mean()),
        beside(own),
    );
    let independent = pooled.count / memory;
    let gain = 0.5 * independent * (pooled.about_mean() / own).ln();
    let price = 0.5 * (recordings.len() as f64 - 1.0) * independent.max(2.0).ln();
    let halves = each <= CONFIG.report.differing * shared;
    let worth_a_word = shared > CONFIG.report.worth_a_word * before;
    if recordings.len() < 2 || !(halves && worth_a_word && gain > price) {
        return None;
    }
    let means = recordings.iter().map(Sums::mean);
    let (low, high) = means.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mean| {
        (low.min(mean), high.max(mean))
    });
    Some(format!(
        "the recordings differ by a constant at {}, from {} to {}: one for each recording takes {} \
         of what is left there, one for all {}. If its zero or a steady force may differ, write \
         `offset = {{ value = {:?}, per = \"recording\" }}` at that sensor",
        sensor.name,
        quantity(low, unit),
        quantity(high, unit),
        share_of(1.0 - each / before),
        share_of(1.0 - shared / before),
        sensor.offset.value,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Note about residuals of so many samples around each of these means, with a standard
    /// deviation of 0.1 N: the noise.
    fn noted(means: &[f64], count: f64) -> Option<String> {
        let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\n\
                    motion = \"slide\"\ninertia = 1.0\n[[sensor]]\nname = \"cell\"\n\
                    reads = \"m.position\"\nsignal = \"f\"\noffset = 0.5\n";
        let rig = sinew_sim::Rig::parse(text, "x.toml").expect("the rig is sound");
        let sums = means.iter().map(|mean| Sums {
            count,
            sum: count * mean,
            squares: count * (mean * mean + 0.01),
        });
        note(
            (&rig.sensors[0], "N"),
            &sums.collect::<Vec<_>>(),
            (0.1, 20.0),
        )
    }

    #[test]
    fn constants_that_differ_are_noted_with_the_key_to_write() {
        let note = noted(&[-0.4, 0.8, 0.1], 2000.0).expect("the constants differ");
        let begins = "the recordings differ by a constant at cell, from \u{2212}0.400 N to 0.800 N";
        assert!(note.starts_with(begins), "{note}");
        let key = "`offset = { value = 0.5, per = \"recording\" }` at that sensor";
        assert!(note.ends_with(key), "{note}");
    }

    #[test]
    fn a_constant_for_all_no_constant_and_few_samples_are_not_noted() {
        assert_eq!(noted(&[0.7, 0.75, 0.8], 2000.0), None);
        assert_eq!(noted(&[0.0, 0.0, 0.0], 2000.0), None);
        assert_eq!(noted(&[-0.4], 2000.0), None);
        // Two independent samples each.
        assert_eq!(noted(&[-0.1, 0.1, 0.0], 20.0), None);
    }
}
