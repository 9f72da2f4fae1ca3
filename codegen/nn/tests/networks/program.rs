//! The programs that try networks, as text.

use super::bench::Case;

/// The lines that try one network.
pub fn call(case: &Case) -> String {
    let network = &case.network;
    let library = network.name.replace('-', "_");
    let inputs: String = case
        .inputs
        .iter()
        .map(|input| {
            let calls: String = input
                .chunks(network.inputs())
                .map(|x| {
                    format!(
                        "[{}], ",
                        x.iter()
                            .map(|v| format!("{v:?}"))
                            .collect::<Vec<_>>()
                            .join(", ")
                    )
                })
                .collect();
            format!("        &[{calls}],\n")
        })
        .collect();
    let kind = if network.state() > 0 {
        "stateful"
    } else {
        "stateless"
    };
    let curvature = case.curvature;
    format!(
        "    static {}: &[&[[f32; {}]]] = &[\n{inputs}    ];\n    bench.numbers(\"network {}\", &mut [].into_iter());\n    {kind}!(bench, {library}, {}, {curvature});\n",
        library.to_uppercase(),
        network.inputs(),
        network.name,
        library.to_uppercase()
    )
}

/// The host's build is the quick one: not optimised, which takes a fifth of the time, and with
/// arithmetic checked.
pub const WORKSPACE: &str = r#"[workspace]
resolver = "3"
members = ["host", "image", "cases", "checked", "joined", "kernels", "networks/*"]

[profile.release]
codegen-units = 1
panic = "abort"
debug = false

[profile.quick]
inherits = "release"
opt-level = 0
overflow-checks = true
debug-assertions = true
"#;

/// Compiled for both.
pub const CASES: &str = r#"//! Every network under test, tried.
#![no_std]

use core::hint::black_box;

{uses}
{bench}
fn weight(r: usize) -> f32 {
    1.0 - 0.5 * (r % 4) as f32
}

macro_rules! stateless {
    ($bench:ident, $network:ident, $inputs:ident, $curvature:literal) => {{
        use $network::{INPUTS, OUTPUTS, curvature, predict, predict_with_jacobian};
        let mut jacobian = [[f32::NAN; OUTPUTS]; INPUTS];
        for calls in $inputs {
            let y: [f32; OUTPUTS] = predict(&calls[0]);
            $bench.numbers("y", &mut y.into_iter());
            let again = predict_with_jacobian(&calls[0], &mut jacobian);
            assert_eq!(y.map(f32::to_bits), again.map(f32::to_bits));
            $bench.numbers("jacobian", &mut jacobian.iter().flatten().copied());
        }
        let x = &$inputs[0][0];
        if $curvature {
            let weights = core::array::from_fn(weight);
            let mut h = [[f32::NAN; INPUTS]; INPUTS];
            curvature(x, &weights, &mut h);
            $bench.numbers("curvature", &mut h.iter().flatten().copied());
        }
        $bench.measure("predict", &mut || { let _ = black_box(predict(black_box(x))); });
        $bench.measure("jacobian", &mut || { let _ = black_box(predict_with_jacobian(black_box(x), black_box(&mut jacobian))); });
    }};
}

macro_rules! stateful {
    ($bench:ident, $network:ident, $inputs:ident, $curvature:literal) => {{
        use $network::{OUTPUTS, RESULTS, State, VARIABLES, curvature, predict, predict_with_jacobian};
        let mut jacobian = [[f32::NAN; RESULTS]; VARIABLES];
        let mut state = State::new();
        for calls in $inputs {
            state = State::new();
            let mut before = state;
            let mut y = [f32::NAN; OUTPUTS];
            for x in *calls {
                before = state;
                y = predict(&mut state, x);
            }
            $bench.numbers("y", &mut y.into_iter());
            let last = &calls[calls.len() - 1];
            let again = predict_with_jacobian(&mut before, last, &mut jacobian);
            assert_eq!(y.map(f32::to_bits), again.map(f32::to_bits));
            assert_eq!(before, state);
            $bench.numbers("jacobian", &mut jacobian.iter().flatten().copied());
        }
        let x = &$inputs[0][0];
        if $curvature {
            let weights = core::array::from_fn(weight);
            let mut h = [[f32::NAN; VARIABLES]; VARIABLES];
            curvature(&State::new(), x, &weights, &mut h);
            $bench.numbers("curvature", &mut h.iter().flatten().copied());
        }
        $bench.measure("predict", &mut || { let _ = black_box(predict(black_box(&mut state), black_box(x))); });
        $bench.measure("jacobian", &mut || { let _ = black_box(predict_with_jacobian(black_box(&mut state), black_box(x), black_box(&mut jacobian))); });
    }};
}

pub fn run(bench: &mut dyn Bench) {
{calls}}
"#;

/// Prints what the networks say.
pub const HOST: &str = r#"//! Every network under test on this computer.

struct Lines;

impl cases::Bench for Lines {
    fn numbers(&mut self, name: &str, values: &mut dyn Iterator<Item = f32>) {
        let words: Vec<String> = values.map(|value| format!(" {:08x}", value.to_bits())).collect();
        println!("{name}{}", words.concat());
    }

    fn measure(&mut self, _name: &str, _work: &mut dyn FnMut()) {}
}

fn main() {
    cases::run(&mut Lines);
}
"#;
