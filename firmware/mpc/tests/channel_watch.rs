//! The watch over a soft sensor's channels: what is found, what is not, and what comes back.
use sinew_mpc::channel_watch::{ChannelWatch, Consistency, RETURN_SAMPLES, Watch};

/// Eight channels of a body that bends in two ways: `z_i = p cos(a_i) + q sin(a_i)`.
const N: usize = 8;
const MOST: usize = Consistency::<N>::MOST;
/// Noise of a channel.
const NOISE: f32 = 0.01;

fn angle(i: usize) -> f64 {
    0.785 * i as f64 + 0.1
}

fn bent(p: f32, q: f32) -> [f32; N] {
    core::array::from_fn(|i| p * angle(i).cos() as f32 + q * angle(i).sin() as f32)
}

/// Relation in closed form: with eight angles evenly around, the others say
/// `z_i = sum_j cos(a_i - a_j) z_j / 3`.
static RELATION: std::sync::LazyLock<Consistency<N>> = std::sync::LazyLock::new(|| Consistency {
    bias: [0.0; N],
    weights: core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            if i == j {
                0.0
            } else {
                (angle(i) - angle(j)).cos() as f32 / 3.0
            }
        })
    }),
    // The noise of one, and what seven noisy others leave.
    spread: [1.2 * NOISE; N],
});

/// Normal numbers.
struct Rough(u64);

impl Rough {
    fn next(&mut self) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum as f32
    }
}

/// Body that moves, and the watch over it.
struct Bench {
    watch: ChannelWatch<N>,
    rough: Rough,
    k: usize,
    /// Largest error of what was used, once `judged`.
    largest: f32,
}

impl Bench {
    fn new(seed: u64) -> Self {
        Self {
            watch: ChannelWatch::new(&RELATION),
            rough: Rough(seed),
            k: 0,
            largest: 0.0,
        }
    }

    /// Runs `steps` samples, each changed by `fault`; gives the first step after which the channels
    /// left out are `wanted`.
    fn run(
        &mut self,
        steps: usize,
        wanted: u32,
        mut fault: impl FnMut(&mut [f32; N], usize, &mut Rough),
    ) -> Option<usize> {
        let mut found = None;
        self.largest = 0.0;
        for step in 0..steps {
            let t = 0.02 * self.k as f64;
            let clean = bent(0.8 * t.sin() as f32, 0.6 * (0.7 * t).cos() as f32);
            let mut z = clean.map(|z| z + NOISE * self.rough.next());
            fault(&mut z, step, &mut self.rough);
            self.watch.judge(&mut z);
            for (z, clean) in z.iter().zip(&clean) {
                let error = (z - clean).abs();
                // A NaN stays.
                if error.is_nan() || error > self.largest {
                    self.largest = error;
                }
            }
            if found.is_none() && self.watch.left_out().channels == wanted {
                found = Some(step);
            }
            self.k += 1;
        }
        found
    }
}

/// Every fault of docs/reference/faults.md, on one channel.
fn faulty(kind: usize, i: usize) -> impl FnMut(&mut [f32; N], usize, &mut Rough) {
    let mut frozen = None;
    move |z, step, rough| match kind {
        0 => z[i] = -1.0,
        1 => z[i] = *frozen.get_or_insert(z[i]),
        2 => z[i] += 0.4 * (step as f32 / 600.0).min(1.0),
        3 => z[i] = 0.7 * (z[i] + 1.5) - 1.5,
        4 => z[i] += 10.0 * NOISE * rough.next(),
        _ => z[i] = f32::NAN,
    }
}

#[test]
fn each_fault_of_each_channel_is_found_and_no_other_is_blamed() {
    for kind in 0..6 {
        for i in 0..N {
            let mut bench = Bench::new(1 + i as u64);
            assert_eq!(bench.run(300, 1, |_, _, _| ()), None);
            let found = bench.run(600, 1 << i, faulty(kind, i));
            assert!(
                found.is_some_and(|step| step < 300),
                "fault {kind} of channel {i}: {found:?}"
            );
            let left_out = bench.watch.left_out();
            assert_eq!(
                (left_out.channels, left_out.times),
                (1 << i, 1),
                "{kind} {i}"
            );
            // 6 spreads before it is found; noise, and the prediction's, afterwards.
            assert!(bench.largest < 0.1, "{kind} {i}: {}", bench.largest);
        }
    }
}

#[test]
fn without_a_fault_nothing_is_left_out() {
    let mut bench = Bench::new(7);
    bench.run(100_000, 0, |_, _, _| ());
    assert_eq!(bench.watch.left_out().times, 0);
    assert!(bench.largest < 6.0 * NOISE, "{}", bench.largest);
}

#[test]
fn a_reading_that_is_missing_is_said_by_the_others_and_blames_nobody() {
    let mut bench = Bench::new(3);
    bench.run(2000, 1, |z, step, _| {
        if step % 7 == 0 {
            z[step % N] = f32::NAN;
        }
    });
    assert_eq!(bench.watch.left_out().times, 0);
    assert!(bench.largest < 0.05, "{}", bench.largest);
}

#[test]
fn a_channel_that_is_mended_comes_back_and_one_that_is_frozen_does_not_at_rest() {
    let mut bench = Bench::new(5);
    bench.run(200, 1 << 4, faulty(0, 4));
    assert_eq!(bench.watch.left_out().channels, 1 << 4);
    let back = bench.run(1000, 0, |_, _, _| ());
    let back = back.expect("it is mended");
    assert!(back + 1 >= usize::from(RETURN_SAMPLES), "{back}");

    // At rest a frozen channel agrees for as long as you like.
    let mut watch = ChannelWatch::new(&RELATION);
    let mut judge = |p: f32, frozen: Option<f32>| {
        let mut z = bent(p, 0.2);
        z[3] = frozen.unwrap_or(z[3]);
        watch.judge(&mut z);
        watch.left_out().channels
    };
    let held = bent(0.5, 0.2)[3];
    let along = |k: usize| -0.5 + k as f32 / 100.0;
    assert_eq!(
        (0..100).map(|k| judge(along(k), Some(held))).max(),
        Some(1 << 3)
    );
    let at_rest = (0..5 * usize::from(RETURN_SAMPLES)).map(|_| judge(0.5, Some(held)));
    assert_eq!(
        at_rest.min(),
        Some(1 << 3),
        "agreement at rest proves nothing"
    );
    // In motion it would be believed.
    let moving = (0..600_u32).map(|k| judge(0.5 * (0.05 * f64::from(k)).cos() as f32, None));
    assert_eq!(moving.last(), Some(0));
}

#[test]
fn as_many_as_there_are_to_spare_are_left_out_and_one_more_is_a_missing_sample() {
    let mut bench = Bench::new(11);
    for i in 0..MOST {
        bench.run(200, 1, |z, _, _| (0..=i).for_each(|j| z[3 * j] = -1.0));
        let expected = (0..=i).fold(0, |bits, j| bits | 1 << (3 * j));
        assert_eq!(bench.watch.left_out().channels, expected);
        assert!(bench.largest < 0.15, "{}", bench.largest);
    }
    bench.run(1, 0, |z, _, _| (0..=MOST).for_each(|j| z[3 * j % N] = -1.0));
    assert!(bench.largest.is_nan(), "three of eight say nothing certain");
    bench.run(200, 0, |z, _, _| {
        (0..=MOST).for_each(|j| z[3 * j % N] = -1.0)
    });
    let left_out = bench.watch.left_out().channels;
    assert_eq!(left_out.count_ones() as usize, MOST, "{left_out:b}");
    // Nor is a body half of whose readings are lost.
    let mut z = [f32::NAN; N];
    bench.watch.judge(&mut z);
    assert!(z.iter().all(|z| z.is_nan()));
    bench.watch.reset();
    assert_eq!(bench.watch.left_out(), Default::default());
}

#[test]
fn any_bits_leave_readings_finite_or_all_missing() {
    let mut watch = ChannelWatch::new(&RELATION);
    let mut state = 1_u64;
    for _ in 0..200_000 {
        let mut z: [f32; N] = core::array::from_fn(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            match state >> 62 {
                0 => f32::from_bits((state >> 16) as u32),
                _ => (state >> 40) as f32 / (1 << 24) as f32 - 0.5,
            }
        });
        watch.judge(&mut z);
        let finite = z.iter().filter(|z| z.is_finite()).count();
        assert!(finite == N || z.iter().all(|z| z.is_nan()), "{z:?}");
    }
}

/// A fault moves what the others say of the rest, so their deviations are the fault's. Short
/// disturbances of one of them afterwards must not be the last straw.
#[test]
fn a_fault_leaves_no_suspicion_of_the_others() {
    for other in [1, 2, 4, 7] {
        let mut bench = Bench::new(17);
        bench.run(100, 1, |_, _, _| ());
        // Fewer samples than the fault takes to be found.
        bench.run(8, 1, |z, _, _| z[0] = -1.5);
        assert_eq!(bench.watch.left_out().channels, 0);
        bench.run(15, 1, |z, _, _| z[other] += 0.9);
        assert_eq!(bench.watch.left_out().channels, 0, "channel {other}");
        // It is found; the other begins anew, and takes as long as from rest.
        let samples = (1..100).find(|_| bench.run(1, 1, |z, _, _| z[0] = -1.5).is_some());
        assert!(samples.is_some());
        bench.run(18, 1, |z, _, _| (z[0], z[other]) = (-1.5, z[other] + 0.9));
        assert_eq!(bench.watch.left_out().channels, 1, "channel {other}");
    }
}
