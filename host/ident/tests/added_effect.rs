//! An effect that this workspace does not have is simulated, found and named without a line in it.

use sinew_ident::diagnose::{DiagnoseOptions, Recordings, Verdict, diagnose};
use sinew_ident::recording::{Column, Recording};
use sinew_sim::effects::{
    AddedEffect, At, Description, Energy, Explanation, Family, Jet, Kind, ParameterSpec, Port,
    Quantity, Role, Scales, Sign, Slopes,
};
use sinew_sim::{Plant, Rig};

/// `F = -strength v^5`: next to nothing at low speed.
struct QuinticDrag;

const PARAMETERS: &[ParameterSpec] =
    &[
        ParameterSpec::new("strength", Quantity::Ratio, Sign::NonNegative)
            .with_role(Role::Strength),
    ];

static DESCRIPTION: Description = Description {
    kind: "quintic_drag",
    family: Family::Damping,
    ports: &[Port::Body],
    energy: Energy::Dissipates,
    law: "F = -strength v^5",
    equation: "",
    parameters: PARAMETERS,
    confusable: &["quadratic_drag"],
    excited_by: "motion at low and at high speed",
    sentence: "A drag of {strength} times the fifth power of speed at {component} is missing from the model.",
};

impl AddedEffect for QuinticDrag {
    fn description(&self) -> &'static Description {
        &DESCRIPTION
    }

    fn explanation(&self) -> &'static Explanation {
        &Explanation {
            cause: "A fluid that thickens when it is sheared.",
            parameters: &[("strength", "force over the fifth power of the velocity")],
            next: "Record motion at low and at high speed.",
        }
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let strength = scales.force / scales.velocity.powi(5);
        vec![vec![0.02 * strength], vec![0.2 * strength]]
    }

    fn force(&self, p: &[Jet], at: &At<Jet>) -> Jet {
        let square = at.velocity * at.velocity;
        -(p[0] * square * square * at.velocity)
    }

    fn slopes(&self, p: &[f64], at: &At<f64>) -> Slopes {
        Slopes {
            damping: 5.0 * (p[0] * at.velocity.powi(4)).abs(),
            ..Slopes::default()
        }
    }
}

/// Ten seconds of a rig that is pushed by three sines, with 0.2 mm of noise.
fn recorded(rig: &Rig, seed: u64) -> Recording {
    let plant = Plant::new(rig).expect("the rig can be simulated");
    let t: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
    let phase = seed as f64;
    let force = |t: &f64| {
        9.0 * (5.5 * t + phase).sin() + 3.0 * (2.1 * t).sin() + 3.0 * (9.7 * t + 2.0 * phase).sin()
    };
    let input: Vec<f64> = t.iter().map(force).collect();
    let unseen = vec![f64::NAN; t.len()];
    let run = plant.simulate_recording(&t, &[&input], &[&unseen]);
    let seen = run.expect("the motion stays finite").trajectory.column(0);
    // Uniform noise by a generator of its own (Lehmer).
    let mut state = seed.wrapping_mul(2_654_435_761).max(1) % 2_147_483_647;
    let noisy = seen.into_iter().map(|q| {
        state = state * 48_271 % 2_147_483_647;
        q + 7e-4 * (state as f64 / 2_147_483_647.0 - 0.5)
    });
    let column = |name: &str, values: Vec<f64>| Column {
        name: name.into(),
        values,
    };
    let columns = vec![column("u_N", input), column("q_m", noisy.collect())];
    Recording::new(format!("{seed}.csv"), t, columns).expect("the text is a recording")
}

#[test]
fn an_effect_of_a_users_own_is_simulated_found_and_named() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../rigs/mass-spring-damper.toml"
    );
    let rig = Rig::load(file).expect("the rig ships with the project");
    let drag = Kind::register(&QuinticDrag).expect("the name is free");
    let site = rig.site(drag, "mass").expect("drag can sit at a body");
    let real = rig
        .with_effect(drag, site, &[3.0])
        .expect("a rig file holds it");
    let recordings = Recordings {
        fit: vec![recorded(&real, 1), recorded(&real, 2)],
        check: vec![recorded(&real, 3)],
        test: Vec::new(),
    };
    let known = ["viscous_damping", "quadratic_drag", "coulomb_friction"];
    let kinds = known.map(|name| Kind::named(name).expect("the vocabulary has it"));
    let mut options = DiagnoseOptions {
        effects: kinds.to_vec(),
        ..DiagnoseOptions::default()
    };
    let without = diagnose(&rig, &recordings, &options, &|_, _, _| {}).expect("an answer");
    assert!(without.effects.iter().all(|one| one.kind != "quintic_drag"));
    options.effects.push(drag);
    let found = diagnose(&rig, &recordings, &options, &|_, _, _| {}).expect("an answer");
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    let [effect] = &found.effects[..] else {
        panic!("{}", found.sentence);
    };
    assert_eq!(effect.kind, "quintic_drag");
    let strength = effect.parameters["strength"].value;
    assert!((strength / 3.0 - 1.0).abs() < 0.1, "{strength}");
    assert!(found.mended.to_toml().contains("quintic_drag"));
}
