//! Arithmetic in integers, measured beside floating point
//! (docs/decisions/0045-no-integer-arithmetic.md): the reference networks in sixteen bits, in QEMU.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use sinew_nn::emit::{Accuracy, Options};
use sinew_nn::{Activation, Network, Op, evaluate, footprint, store, target};

/// Largest sum of the sizes of a row's integers: with inputs of 15 bits no sum leaves 32.
const LARGEST: f64 = 65_000.0;
/// Inputs are within this, and saturate beyond it.
const INPUTS_WITHIN: f64 = 1.5;
/// Inputs tried.
const TRIED: usize = 32;

/// A network of dense layers as text over `kernel.rs`.
struct Integers {
    statics: String,
    body: String,
    weight_bytes: usize,
}

fn list<T: std::fmt::Debug>(values: impl IntoIterator<Item = T>) -> String {
    format!("{:?}", values.into_iter().collect::<Vec<T>>())
}

/// Layer by layer: row `r` of weights becomes integers with `step` to one, so that its sum counts
/// `step` times the step of its input.
fn integers(network: &Network) -> Integers {
    let module = network.name.replace('-', "_");
    let inputs = network.inputs();
    let mut step = INPUTS_WITHIN / 32_767.0;
    let mut bound = INPUTS_WITHIN;
    let steps = 1.0 / step;
    let mut body = format!(
        "    let q: [u32; {}] = pairs(x, {steps:?});\n",
        inputs.div_ceil(2)
    );
    let (mut statics, mut weight_bytes) = (String::new(), 0);
    let mut nodes = network.nodes.iter().enumerate().skip(1).peekable();
    while let Some((place, node)) = nodes.next() {
        let Op::Dense(layer) = &node.op else {
            match &node.op {
                Op::Activation(Activation::Tanh) => body += "    let y = y.map(coarse::tanh);\n",
                Op::Scale { gain, offset } => {
                    writeln!(
                        body,
                        "    let (gain, offset) = ({}, {});",
                        list(gain),
                        list(offset)
                    )
                    .unwrap();
                    body += "    let y = core::array::from_fn(|i| gain[i] * y[i] + offset[i]);\n";
                }
                other => panic!("{other:?}"),
            }
            continue;
        };
        let (rows, out) = (layer.weights.len() / layer.bias.len(), layer.bias.len());
        let last = !network.nodes[place + 1..]
            .iter()
            .any(|node| matches!(node.op, Op::Dense(_)));
        let (mut matrix, mut bias, mut counts, mut next) = (vec![], vec![], vec![], 0.0_f64);
        for (w, b) in layer.weights.chunks(rows).zip(&layer.bias) {
            let b = f64::from(*b);
            let size: f64 = w.iter().map(|w| f64::from(w.abs())).sum();
            let unit = (size + b.abs() / bound) / LARGEST;
            matrix.push(list(
                w.iter().map(|w| (f64::from(*w) / unit).round() as i16),
            ));
            bias.push((b / (unit * step)).round() as i32);
            counts.push(unit * step);
            next = next.max(size * bound + b.abs());
        }
        let pairs = rows.div_ceil(2);
        weight_bytes += 4 * pairs * out + 8 * out;
        let to = match nodes.peek().map(|(_, node)| &node.op) {
            _ if last => 0.0,
            Some(Op::Activation(Activation::Tanh)) => 4096.0,
            Some(Op::Activation(Activation::Relu)) => 32_767.0 / next,
            other => panic!("{other:?}"),
        };
        let gain = counts
            .iter()
            .map(|c| (c * to * 2.0_f64.powi(32)).round() as i32);
        writeln!(
            statics,
            "static {}_{place}: Layer<{pairs}, {out}> = Layer {{ rows: pack(&[{}]), bias: {}, gain: {} }};",
            module.to_uppercase(),
            matrix.join(", "),
            list(bias),
            list(gain),
        )
        .unwrap();
        let name = format!("{}_{place}", module.to_uppercase());
        writeln!(body, "    let sums = dense(&{name}, &q);").unwrap();
        if last {
            let gain = list(counts.iter().map(|c| *c as f32));
            writeln!(body, "    let y = floats(&sums, &{gain});").unwrap();
            continue;
        }
        let tanh = matches!(
            nodes.next().map(|(_, node)| &node.op),
            Some(Op::Activation(Activation::Tanh))
        );
        let g = if tanh { "tanh" } else { "relu" };
        let pairs = out.div_ceil(2);
        writeln!(
            body,
            "    let q: [u32; {pairs}] = activate(&sums, &{name}.gain, {g});"
        )
        .unwrap();
        bound = if tanh { 1.0 } else { next };
        step = bound / 32_767.0;
    }
    Integers {
        statics,
        body,
        weight_bytes,
    }
}

/// SplitMix64, as f32 within the inputs' range.
fn drawn(count: usize) -> Vec<f32> {
    let mut state = 6_u64;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    (0..count)
        .map(|_| (INPUTS_WITHIN * next()) as f32)
        .collect()
}

fn networks() -> [Network; 3] {
    ["s", "l", "p"].map(|name| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
        let network = store::load(&folder.join(format!("reference-{name}")));
        network.expect("the folder is committed").folded()
    })
}

#[test]
fn integers_are_counted_beside_floats() {
    let qemu = Command::new("qemu-system-arm").arg("--version").output();
    if qemu.is_err() || !target::is_installed() {
        println!(
            "SKIPPED: QEMU, or cargo for {}, is not here",
            target::TARGET
        );
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fixed-point");
    let put = |path: &str, text: &str| {
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().expect("the path has a name"))
            .expect("the folder is writable");
        std::fs::write(path, text).expect("the folder is writable");
    };
    let package = "[package]\nedition = \"2024\"\nversion = \"0.0.0\"\n";
    let library = |name: &str, path: &str| {
        let path = format!("{}/{path}", env!("CARGO_MANIFEST_DIR"));
        let manifest = format!("{package}name = \"{name}\"\n\n[lib]\npath = {path:?}\n");
        put(&format!("{name}/Cargo.toml"), &manifest);
    };
    library("integers", "tests/fixed_point/kernel.rs");
    library("kernels", "kernels/lib.rs");
    let mut text = format!(
        "//! Networks in integers.\n#![no_std]\n#![allow(unused_imports)]\n\nuse core::hint::black_box;\nuse integers::*;\nuse kernels::math::coarse;\n{}",
        footprint::probe::BENCH
    );
    let mut run = String::new();
    let networks = networks();
    for network in &networks {
        let Integers { statics, body, .. } = integers(network);
        let (name, inputs) = (network.name.replace('-', "_"), network.inputs());
        let outputs = network.outputs();
        writeln!(text, "{statics}#[inline(never)]\nfn {name}(x: &[f32; {inputs}]) -> [f32; {outputs}] {{\n{body}    y\n}}\n").unwrap();
        let x = drawn(TRIED * inputs);
        let x: Vec<&[f32]> = x.chunks(inputs).collect();
        writeln!(run, "    static X_{name}: [[f32; {inputs}]; {TRIED}] = {x:?};\n    bench.numbers(\"network\", &mut [].into_iter());\n    for x in &X_{name} {{ bench.numbers(\"y\", &mut {name}(x).into_iter()); }}\n    bench.measure(\"predict\", &mut || {{ let _ = black_box({name}(black_box(&X_{name}[0]))); }});").unwrap();
    }
    writeln!(text, "/// Tries them.\n#[allow(non_upper_case_globals)]\npub fn run(bench: &mut dyn Bench) {{\n{run}}}").unwrap();
    put(
        "cases/Cargo.toml",
        &format!(
            "{package}name = \"cases\"\n\n[dependencies]\nintegers = {{ path = \"../integers\" }}\nkernels = {{ path = \"../kernels\" }}\n"
        ),
    );
    put("cases/src/lib.rs", &text);
    put(
        "Cargo.toml",
        "[workspace]\nresolver = \"3\"\nmembers = [\"cases\", \"image\", \"integers\", \"kernels\"]\n\n[profile.release]\nlto = \"fat\"\ncodegen-units = 1\npanic = \"abort\"\ndebug = false\n",
    );
    footprint::probe::write(&folder).expect("the folder is writable");
    let image = footprint::probe::build(&folder).unwrap_or_else(|error| panic!("{error}"));
    let said = footprint::probe::run(&image).unwrap_or_else(|error| panic!("{error}"));
    let said: Vec<&str> = said.split("network\n").skip(1).collect();
    for (network, said) in networks.iter().zip(said) {
        let (mut low, mut high, mut largest) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        let x = drawn(TRIED * network.inputs());
        let mut tried = 0;
        let answers = said.lines().filter_map(|line| line.strip_prefix("y "));
        for (x, answer) in x.chunks(network.inputs()).zip(answers) {
            let x: Vec<f64> = x.iter().copied().map(f64::from).collect();
            let found = answer
                .split(' ')
                .map(|word| f32::from_bits(u32::from_str_radix(word, 16).expect("bits")));
            for (found, exact) in found.zip(evaluate::run(network, &x)) {
                (low, high) = (low.min(exact), high.max(exact));
                largest = largest.max((f64::from(found) - exact).abs());
            }
            tried += 1;
        }
        assert_eq!(tried, TRIED);
        let cost = said
            .lines()
            .find_map(|line| line.strip_prefix("cost predict "));
        let cost: u64 = cost
            .and_then(|cost| cost.split(' ').next()?.parse().ok())
            .expect("QEMU counted the instructions");
        let options = Options {
            accuracy: Accuracy::Coarse,
            ..Options::default()
        };
        let folder = folder.join("floats");
        let floats =
            footprint::measure(network, &options, &folder).unwrap_or_else(|e| panic!("{e}"));
        let floats = floats.predict.instructions.expect("QEMU is here");
        let loss = largest / (high - low);
        println!(
            "{}: {cost} instructions in integers, {floats} in floats with a tanh within 5e-5; weights {} B, {} B; outputs move by up to {:.3} % of their range",
            network.name,
            integers(network).weight_bytes,
            network.weight_bytes(false),
            100.0 * loss
        );
        assert!(loss < 0.05, "{}: {loss}", network.name);
        assert!(
            loss > 1e-7,
            "{}: integers cannot be this good",
            network.name
        );
    }
}
