//! Printed networks, compiled and run on the host and in QEMU.

mod bench;
mod budgets;
mod frameworks;
mod judge;
mod program;
mod random;

use bench::Workspace;
use sinew_nn::emit::Accuracy;

/// One in so many networks runs in QEMU, beside those with a budget; all run on the host. The image
/// is half the time of this test. `cargo xtask survive` sets SINEW_NETWORKS=1, and the table of the
/// documentation is written from all.
const IN_QEMU: usize = 5;

fn every() -> usize {
    if std::env::var("SINEW_SNAPSHOTS").is_ok_and(|mode| mode == "bless") {
        return 1;
    }
    let set = std::env::var("SINEW_NETWORKS");
    set.map_or(IN_QEMU, |every| every.parse().expect("a number above 0"))
}

/// Networks of random weights with every layer, and those of the frameworks: one build for all.
#[test]
fn networks_compute_what_double_precision_and_their_frameworks_do() {
    let mut cases = frameworks::cases();
    let foreign = cases.len();
    cases.extend(random::cases());
    let every = every();
    for (number, case) in cases.iter_mut().enumerate() {
        let own_crate = case.options.accuracy != Accuracy::Quick;
        case.in_qemu = own_crate || number % every == 0;
    }
    cases.extend(budgets::cases());
    let workspace = Workspace::new("networks", &cases);
    let errors = judge::judge(&workspace, &cases);
    assert_eq!(errors.len(), cases.len());
    for one in &errors {
        println!(
            "{:<24} {:8.1e} {:8.1e} {:8.1e} {:?}",
            one.name, one.output, one.jacobian, one.curvature, one.said.cost
        );
    }
    for (one, case) in errors.iter().zip(&cases) {
        // A coarser tanh shows in all that comes after it; weights magnify it: ten times its error.
        let coarse = case.options.accuracy.error() > 1e-5;
        let scale = if coarse {
            1e6 * case.options.accuracy.error()
        } else {
            1.0
        };
        assert!(
            one.output < 1e-5 * scale,
            "{}: an output is off by {:e}",
            one.name,
            one.output
        );
        assert!(
            one.jacobian < 1e-5 * scale,
            "{}: a derivative is off by {:e}",
            one.name,
            one.jacobian
        );
        assert!(
            one.curvature < 1e-4 * scale,
            "{}: a second derivative is off by {:e}",
            one.name,
            one.curvature
        );
    }
    budgets::judge(&errors);
    frameworks::judge(&cases[..foreign], &errors[..foreign]);
}

/// Kinds that the matrix below leaves out are not tested.
#[test]
fn every_promised_layer_and_activation_is_in_a_file_of_a_framework() {
    assert_eq!(frameworks::missing(), Vec::<&str>::new());
}
