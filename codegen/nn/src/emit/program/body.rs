//! The passes forward and backward, and what every printed network has.

use super::seed::Seed;
use crate::emit::plan::Plan;
use crate::emit::{backward, forward};

/// The functions.
pub(super) struct Body<'a> {
    pub(super) plan: &'a Plan<'a>,
    /// The end, where derivatives begin at weights.
    pub(super) seed: Option<Seed>,
    pub(super) forward: String,
    pub(super) backward: String,
    /// Arguments of `backward` between activations and adjoints.
    pub(super) given: &'static str,
}

/// Returns true if the text uses the variable.
fn mentions(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
        .any(|found| found == word)
}

impl<'a> Body<'a> {
    pub(super) fn new(plan: &'a Plan<'a>) -> Self {
        let network = plan.network;
        let last = network.nodes.len() - 1;
        let stateful = plan.is_stateful();
        let seed = Seed::of(plan);
        let begin = seed.map_or(last, |seed| seed.begin);
        let statements = forward::print(plan);
        let state = if stateful { "state: &State<N>, " } else { "" };
        let forward = format!(
            "/// The layers in turn. All predictions go through this one copy: their bits are the same, and flash
/// holds it once.
#[inline(never)]
fn forward<N: Number>(x: &[N; INPUTS], {state}a: &mut Activations<N>) {{
{statements}}}

"
        );
        // With nothing between the input and the seed there is nothing to do.
        let statements = if plan.buffer[begin] == 0 {
            String::new()
        } else {
            backward::print(plan, begin)
        };
        let given = if mentions(&statements, "x") {
            "x, "
        } else {
            ""
        };
        let x = if given.is_empty() {
            ""
        } else {
            "\n    x: &[N; INPUTS],"
        };
        let own = backward::adjoint(plan, begin);
        let length = network.nodes[begin].len();
        let statements_need_mut = statements.contains(&format!("&mut {own})"))
            || statements.contains(&format!("        &mut {own},"));
        let mutable = if statements_need_mut { "mut " } else { "" };
        let state = if stateful {
            "\n    t_state: &mut State<[N; R]>,"
        } else {
            ""
        };
        let length = if begin == last {
            "OUTPUTS".to_string()
        } else {
            length.to_string()
        };
        let backward = if plan.buffer[begin] == 0 {
            String::new()
        } else {
            let a = if mentions(&statements, "a") {
                "a"
            } else {
                "_a"
            };
            format!(
                "/// The layers from the last to the first: adjoints of what they give to adjoints of the input, for `R`
/// results at once.
#[inline(always)]
fn backward<N: Number, const R: usize>(
    {a}: &Activations<N>,{x}
    {mutable}{own}: [[N; R]; {length}],{state}
    t_x: &mut [[N; R]; INPUTS],
) {{
{statements}}}
"
            )
        };
        Self {
            plan,
            seed,
            forward,
            backward,
            given,
        }
    }

    pub(super) fn result(&self) -> String {
        let last = self.plan.network.nodes.len() - 1;
        self.plan.value(last)
    }

    pub(super) fn predict(&self) -> String {
        format!(
            "/// The outputs for inputs `x`.
pub fn predict(x: &[f32; INPUTS]) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
    {}
}}

",
            self.result()
        )
    }
}
