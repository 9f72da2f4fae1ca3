//! Late readings at their own time: the estimate of a filter that had them at once.

use sinew_mpc::filter::{Filter, LateFilter};

use crate::rules::{Bench, Mass, PRIOR, SETTINGS};

const DEPTH: usize = 8;

/// A camera at a quarter of the rate, seven periods late, after a start with every reading.
#[test]
fn a_late_camera_gives_the_estimate_of_one_in_time() {
    let mut bench = Bench::new([1.25, 8.0]);
    let mut late: LateFilter<2, 1, 1, 2, 5, DEPTH> = LateFilter::new(Filter::new(PRIOR, SETTINGS));
    let mut taken = Vec::new();
    let mut compared = 0;
    for k in 0..400_usize {
        let reading = if k % 4 == 0 {
            bench.reading()
        } else {
            f32::NAN
        };
        taken.push(reading);
        let at_once = if k < 40 { reading } else { f32::NAN };
        let _ = late.update(&Mass, &[at_once]);
        if k >= 47 {
            let arrived = late.late(&Mass, 7, &[taken[k - 7]]);
            assert!(arrived.is_some());
        }
        // What is on its way is 4 and 0 periods old; a filter with the same readings, in time.
        if k == 300 {
            let mut again = Filter::new(PRIOR, SETTINGS);
            for (i, reading) in taken.iter().enumerate() {
                let known = i < 40 || i <= k - 7;
                let _ = again.update(&Mass, &[if known { *reading } else { f32::NAN }]);
                if i < k {
                    again.predict(&Mass, &[command(i)]);
                }
            }
            assert_eq!(again.x(), late.filter().x());
            assert_eq!(again.covariance(), late.filter().covariance());
            compared += 1;
        }
        let u = command(k);
        late.predict(&Mass, &[u]);
        bench.x =
            sinew_mpc::StateSpace::transition(&Mass, &bench.x, &[u], &bench.theta, &mut [0.0; 4]);
    }
    assert_eq!(compared, 1);
    assert!((late.filter().x()[0] - bench.x[0]).abs() < 0.05);
}

fn command(k: usize) -> f32 {
    [2.0, -2.0][(k / 37) % 2]
}

#[test]
fn a_reading_older_than_the_past_is_refused() {
    let mut late: LateFilter<2, 1, 1, 2, 5, 3> = LateFilter::new(Filter::new(PRIOR, SETTINGS));
    for _ in 0..2 {
        let _ = late.update(&Mass, &[0.3]);
        late.predict(&Mass, &[0.0]);
    }
    assert!(
        late.late(&Mass, 2, &[0.0]).is_none(),
        "only two periods have been"
    );
    assert!(late.late(&Mass, 1, &[0.3]).is_some());
    let _ = late.update(&Mass, &[0.3]);
    assert!(late.late(&Mass, 3, &[0.0]).is_none());
}
