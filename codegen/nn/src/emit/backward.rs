//! The body of `backward`: the layers from the last to the first, each taking adjoints of what it
//! gives to adjoints of what it reads.

use super::forward::{activation, call, cell, constant, inverse_permutation, parts};
use super::plan::Plan;
use crate::{Activation, Op, PoolKind, Recurrent, literal};

/// State of the printer: the text, and the adjoints so far.
struct Printer<'a> {
    plan: &'a Plan<'a>,
    text: String,
    /// True where the adjoints of a buffer have been begun.
    begun: Vec<bool>,
    /// The activation that the layer after it has taken care of.
    done: Option<usize>,
}

/// The statements from node `last`, whose adjoints are there, to the input.
pub(super) fn print(plan: &Plan<'_>, last: usize) -> String {
    let mut printer = Printer {
        plan,
        text: String::new(),
        begun: vec![false; plan.network.nodes.len()],
        done: None,
    };
    printer.begun[plan.buffer[last]] = true;
    for place in (1..=last).rev() {
        printer.layer(place);
    }
    without_idle_mut(&printer.text)
}

/// `let mut` only where something changes the variable after.
fn without_idle_mut(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut rest = text;
    for line in text.lines() {
        rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
        let name = line
            .trim_start()
            .strip_prefix("let mut ")
            .and_then(|l| l.split(' ').next());
        let idle = name.is_some_and(|name| {
            let uses = [format!("&mut {name}"), format!("{name}.chunks_exact_mut")];
            !uses.iter().any(|used| rest.contains(used))
        });
        lines.push(if idle {
            line.replacen("let mut ", "let ", 1)
        } else {
            line.into()
        });
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// The adjoints of a buffer as a name.
pub(super) fn adjoint(plan: &Plan<'_>, node: usize) -> String {
    match plan.buffer[node] {
        0 => "t_x".into(),
        own => format!("t_{}", plan.names[own]),
    }
}

impl Printer<'_> {
    /// Calls a kernel whose last argument is the adjoints of `from`, which it overwrites; where
    /// there are some already, it is given others, and these are added.
    fn reach(&mut self, from: usize, function: &str, mut arguments: Vec<String>) {
        let plan = self.plan;
        let buffer = plan.buffer[from];
        let name = adjoint(plan, from);
        let length = plan.network.nodes[from].len();
        let zero = format!("[[N::ZERO; R]; {length}]");
        let whole = if buffer == 0 {
            name.clone()
        } else {
            format!("&mut {name}")
        };
        if !self.begun[buffer] {
            self.begun[buffer] = true;
            if buffer != 0 {
                self.text
                    .push_str(&format!("    let mut {name} = {zero};\n"));
            }
            arguments.push(whole);
            self.text.push_str(&call(4, function, &arguments));
        } else {
            self.text.push_str(&format!("    let mut more = {zero};\n"));
            arguments.push("&mut more".into());
            self.text.push_str(&call(4, function, &arguments));
            self.text
                .push_str(&call(4, "add_back", &["&more".into(), whole]));
        }
    }

    /// The adjoints of `place` go on to `from` as they are.
    fn pass(&mut self, place: usize, from: usize) {
        let plan = self.plan;
        let (own, name) = (adjoint(plan, place), adjoint(plan, from));
        let buffer = plan.buffer[from];
        if self.begun[buffer] {
            let whole = if buffer == 0 {
                name
            } else {
                format!("&mut {name}")
            };
            self.text
                .push_str(&call(4, "add_back", &[format!("&{own}"), whole]));
        } else {
            self.begun[buffer] = true;
            self.text.push_str(&if buffer == 0 {
                format!("    *t_x = {own};\n")
            } else {
                format!("    let mut {name} = {own};\n")
            });
        }
    }

    fn layer(&mut self, place: usize) {
        let plan = self.plan;
        let node = &plan.network.nodes[place];
        if !self.begun[plan.buffer[place]] || self.done == Some(place) {
            return; // beside the way from the seed to the input
        }
        let from = node.from[0];
        let own = adjoint(plan, place);
        let weights = |suffix| format!("&weights::{}", constant(plan, place, suffix));
        let window = || format!("&{}", constant(plan, place, "_WINDOW"));
        let t_y = format!("&{own}");
        let channels = plan.network.nodes[from].shape.last().copied().unwrap_or(1);
        let (before, after) = (plan.network.nodes[from].len(), node.len());
        match &node.op {
            Op::Input => {}
            Op::Dense(_) => match &plan.network.nodes[from].op {
                Op::Activation(g) if plan.fused(from) => {
                    let arguments = [weights("_W"), t_y, activation(*g), plan.borrowed(from)];
                    self.reach(from, "dense_back_activated", arguments.into());
                    self.done = Some(from);
                }
                _ => self.reach(from, "dense_back", vec![weights("_W"), t_y]),
            },
            Op::Convolution(_) => {
                self.reach(from, "convolve_back", vec![window(), weights("_W"), t_y]);
            }
            Op::Pool(pool) => {
                let (function, argument) = match pool.kind {
                    PoolKind::Max => ("max_pool_back", plan.borrowed(from)),
                    kind => {
                        let padding = kind == PoolKind::AverageWithPadding;
                        ("average_pool_back", padding.to_string())
                    }
                };
                let function = format!("{function}::<_, {before}, {after}, {channels}, R>");
                let mut arguments = vec![window(), argument, t_y];
                if pool.kind == PoolKind::Max && plan.buffer[from] == 0 {
                    arguments[1] = "x".into();
                }
                self.reach(from, &function, arguments);
            }
            Op::Reshape(_) if plan.is_in_place(place) => {}
            Op::Reshape(_) | Op::Activation(Activation::Linear) => {
                if !plan.is_in_place(place) {
                    self.pass(place, from);
                }
            }
            Op::Permute(axes) => {
                let (shape, steps) = inverse_permutation(axes, &node.shape);
                self.reach(from, "permute", vec![shape, steps, t_y]);
            }
            Op::Scale { .. } => self.reach(from, "scale_back", vec![weights("_GAIN"), t_y]),
            Op::Activation(g) => {
                let z = if plan.is_in_place(place) { place } else { from };
                let values = [plan.borrowed(z), plan.borrowed(place)];
                self.within(
                    place,
                    "activate_back",
                    [vec![activation(*g)], values.into()].concat(),
                );
            }
            Op::Softmax | Op::LogSoftmax => {
                let kernel = node.op.kind();
                let last = node.shape.last().copied().unwrap_or(1);
                let function = format!("{kernel}_back::<_, {after}, {last}, R>");
                self.within(place, &function, vec![plan.borrowed(place)]);
            }
            Op::Add => {
                for &from in &node.from {
                    self.pass(place, from);
                }
            }
            Op::Multiply => {
                for (own, other) in [(0, 1), (1, 0)] {
                    let other = plan.borrowed(node.from[other]);
                    self.reach(node.from[own], "multiply_back", vec![other, t_y.clone()]);
                }
            }
            Op::Maximum | Op::Minimum => {
                let largest = node.op == Op::Maximum;
                let values = [0, 1].map(|input| plan.borrowed(node.from[input]));
                for input in 0..2 {
                    let first = input == 0;
                    let function = format!("extreme_back::<_, {after}, R, {largest}, {first}>");
                    let arguments = [values.to_vec(), vec![t_y.clone()]].concat();
                    self.reach(node.from[input], &function, arguments);
                }
            }
            Op::Select(_) => self.reach(from, "select_back", vec![weights("_PLACES"), t_y]),
            Op::Normalise { epsilon } => {
                let last = node.shape.last().copied().unwrap_or(1);
                let function = format!("normalise_back::<_, {after}, {last}, R>");
                let values = [plan.borrowed(from), plan.borrowed(place)];
                let arguments = [vec![literal::float(*epsilon)], values.into()].concat();
                self.within(place, &function, arguments);
            }
            Op::Concatenate(axis) => {
                let total: usize = node.shape[*axis..].iter().product();
                for (from, start, length) in parts(plan, place, *axis) {
                    let part = plan.network.nodes[from].len();
                    let function =
                        format!("concatenate_back::<_, {part}, {after}, {length}, {total}>");
                    self.reach(from, &function, vec![start.to_string(), t_y.clone()]);
                }
            }
            Op::Recurrent(layer) => self.recurrent(place, layer, from),
        }
    }

    /// A kernel that turns a layer's own adjoints into those of what it reads, in place; then,
    /// where these lie elsewhere, they go on.
    fn within(&mut self, place: usize, function: &str, mut arguments: Vec<String>) {
        arguments.push(format!("&mut {}", adjoint(self.plan, place)));
        self.text.push_str(&call(4, function, &arguments));
        if !self.plan.is_in_place(place) {
            self.pass(place, self.plan.network.nodes[place].from[0]);
        }
    }

    fn recurrent(&mut self, place: usize, layer: &Recurrent, from: usize) {
        let plan = self.plan;
        let name = &plan.names[place];
        let own = adjoint(plan, place);
        let (module, mut arguments) = cell(plan, place, layer);
        let two = layer.cell.vectors() == 2;
        let function = format!("{module}::step_back");
        if layer.streaming {
            let state = format!("&mut t_state.{name}");
            self.text
                .push_str(&call(4, "add_back", &[format!("&{own}"), state.clone()]));
            let state = if two {
                format!("({state}, &mut t_state.{name}_cell)")
            } else {
                state
            };
            arguments.extend([format!("&a.{name}_step"), state]);
            return self.reach(from, &function, arguments);
        }
        let rest = format!("[[N::ZERO; R]; {}]", layer.units);
        let start = if layer.sequences {
            rest.clone()
        } else {
            own.clone()
        };
        self.text.push_str(&if two {
            format!("    let (mut t_h, mut t_c) = ({start}, {rest});\n")
        } else {
            format!("    let mut t_h = {start};\n")
        });
        let target = adjoint(plan, from);
        let buffer = plan.buffer[from];
        let length = plan.network.nodes[from].len();
        let again = self.begun[buffer];
        let target = if again {
            self.text
                .push_str(&format!("    let mut more = [[N::ZERO; R]; {length}];\n"));
            "more".to_string()
        } else {
            self.begun[buffer] = true;
            if buffer != 0 {
                self.text.push_str(&format!(
                    "    let mut {target} = [[N::ZERO; R]; {length}];\n"
                ));
            }
            target
        };
        let inputs = layer.inputs();
        self.text.push_str(&format!(
            "    let inputs = {target}.chunks_exact_mut({inputs});\n"
        ));
        let mut items = format!("a.{name}_steps.iter().zip(inputs)");
        let mut pattern = "(step, t_x)".to_string();
        if layer.sequences {
            let units = layer.units;
            self.text
                .push_str(&format!("    let outputs = {own}.chunks_exact({units});\n"));
            items = format!("{items}.zip(outputs)");
            pattern = format!("({pattern}, t_y)");
        }
        self.text
            .push_str(&format!("    for {pattern} in {items}.rev() {{\n"));
        self.text
            .push_str("        let Some(t_x) = t_x.first_chunk_mut() else { continue };\n");
        if layer.sequences {
            self.text.push_str(
                "        let Some(t_y) = t_y.first_chunk() else { continue };\n        \
                 add_back(t_y, &mut t_h);\n",
            );
        }
        let state = if two {
            "(&mut t_h, &mut t_c)"
        } else {
            "&mut t_h"
        };
        arguments.extend(["step".into(), state.into(), "t_x".into()]);
        self.text.push_str(&call(8, &function, &arguments));
        self.text.push_str("    }\n");
        if again {
            let whole = adjoint(plan, from);
            let whole = if buffer == 0 {
                whole
            } else {
                format!("&mut {whole}")
            };
            self.text
                .push_str(&call(4, "add_back", &["&more".into(), whole]));
        }
    }
}
