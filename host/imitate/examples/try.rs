use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_ident::recording::Recording;
use sinew_imitate::*;
use sinew_sim::{Plant, Rig};
fn draws(plant: &Plant, spread: f64, first: u64, n: u64) -> Vec<Vec<f64>> {
    (0..n)
        .map(|k| {
            let mut random = ChaCha8Rng::seed_from_u64(first + k);
            let mut values = plant.values();
            for slot in plant.free_slots() {
                let share: f64 = random.random_range(0.0..=spread);
                let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
                values[slot] *= 1.0 + sign * share;
            }
            values
        })
        .collect()
}
fn show(name: &str, mut e: Vec<f64>) {
    e.sort_by(f64::total_cmp);
    println!(
        "{name}: median {:.4} mm worst {:.4} mm",
        1e3 * 0.5 * (e[e.len() / 2] + e[(e.len() - 1) / 2]),
        1e3 * e[e.len() - 1]
    );
}
fn main() {
    let arg = |i: usize, d: f64| std::env::args().nth(i).map_or(d, |a| a.parse().unwrap());
    let seed = arg(1, 1.0) as u64;
    let load = arg(2, 0.0);
    let steps = arg(3, 1500.0) as usize;
    let rate = arg(4, 3e-3);
    let batch = arg(5, 8.0) as usize;
    let rig = Rig::parse(
        &std::fs::read_to_string("target/demo/rig.toml").unwrap(),
        "rig.toml",
    )
    .unwrap();
    let plant = Plant::new(&rig).unwrap();
    let rec = Recording::read("target/demo/loop.csv").unwrap();
    let y: Vec<Vec<f64>> = rec
        .column("mpc_q_m")
        .unwrap()
        .iter()
        .map(|v| vec![*v])
        .collect();
    let u: Vec<Vec<f64>> = rec
        .column("mpc_u_N")
        .unwrap()
        .iter()
        .map(|v| vec![*v])
        .collect();
    let r: Vec<Vec<f64>> = rec
        .column("ref_q_m")
        .unwrap()
        .iter()
        .map(|v| vec![*v])
        .collect();
    let limits = Limits {
        lower: vec![-20.0],
        upper: vec![20.0],
        rate: vec![400.0 / 120.0],
        safe: vec![0.0],
    };
    let noise = [arg(6, 3.4e-4)];
    let period_s = 1.0 / 120.0;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    use sinew_ident::noise::gaussian;
    let yn: Vec<Vec<f64>> = y
        .iter()
        .map(|y| vec![y[0] + noise[0] * gaussian(&mut random)])
        .collect();
    let start = plant
        .initial_state(&plant.values(), &[Some(y[0][0])])
        .unwrap();
    let t0 = std::time::Instant::now();
    let motion = inverse(
        &plant,
        &plant.values(),
        &start,
        &[0],
        &yn,
        &noise,
        &limits,
        period_s,
    )
    .unwrap();
    println!(
        "inverse: {:.4} mm from the clean, {:.4} from noisy, {:?}",
        1e3 * rms(&motion.y, &y),
        1e3 * rms(&motion.y, &yn),
        t0.elapsed()
    );
    println!("demo from ref {:.4} mm", 1e3 * rms(&y, &r));
    let view = View {
        outputs: 1,
        inputs: 1,
        past_outputs: 8,
        past_inputs: 6,
        ahead: 12,
    };
    let train_p = draws(&plant, 0.2, 100, 16);
    let select = draws(&plant, 0.2, 200, 8);
    let test = draws(&plant, 0.2, 4001, 10);
    let task = Task {
        plant: &plant,
        outputs: &[0],
        motion: &motion,
        period_s,
        noise: &noise,
        load: &[load],
        train: &train_p,
        select: &select,
    };
    let asked = Inverse {
        u: motion.u.clone(),
        x: motion.x.clone(),
        y: r.clone(),
    };
    let judge = Task {
        motion: &asked,
        ..task.clone()
    };
    let fresh = |random: &mut ChaCha8Rng| {
        Policy::new(
            view,
            Network::new(&[26, 14, 8, 1], random),
            limits.clone(),
            (&motion.y, &motion.u),
        )
    };
    println!("{} weights", fresh(&mut random).network.weights.len());
    let mut cloned = fresh(&mut random);
    clone(&mut cloned, (&y, &u), &r, 300, seed);
    show("clone of the commands", judge.judge(&cloned, &test, 5));
    let t0 = std::time::Instant::now();
    let trained = train(
        &task,
        fresh(&mut random),
        &Options {
            seed,
            steps,
            rate,
            batch,
            ..Options::default()
        },
        &mut |p| {
            if p.step % 100 == 0 {
                println!(
                    "{} w {} rms {:.4} best {:.4}",
                    p.step,
                    p.window,
                    1e3 * p.rms,
                    1e3 * p.best
                );
            }
            true
        },
    );
    println!("{:?}", t0.elapsed());
    show("imitation on ref", judge.judge(&trained.policy, &test, 5));
    show("imitation on demo", task.judge(&trained.policy, &test, 5));
}
