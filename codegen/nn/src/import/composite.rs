//! Functions that several layers together compute: bounds, powers, quotients, activations without
//! a kernel of their own. Importers of all formats share them.

use super::shapes::{self, spread_places};
use crate::{Activation, Network, NetworkError, Op, Selection};

/// The largest integer power, which takes a product less.
const MAX_POWER: u32 = 8;

/// Bounds from which on a value is not bounded.
const UNBOUNDED: f32 = 1e30;

/// The largest bound. Values are bounded by sums with it, which keep no digit below its own last:
/// near 1 they would lose more than a thousandth.
const FAR: f32 = 1e4;

/// Part of a function of `z`, with its factor.
enum Piece {
    /// `z`.
    Linear(f32),
    /// `exp(z) - 1`.
    Saturating(f32),
}

impl Network {
    /// As [`Network::push`], with a number after the name where another layer has it.
    pub(in crate::import) fn append(
        &mut self,
        name: &str,
        op: Op,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        let taken = |name: &str| self.nodes.iter().any(|node| node.name == name);
        let mut free = name.to_owned();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        self.push(&free, op, from.to_vec())
    }

    fn apply(&mut self, name: &str, g: Activation, x: usize) -> Result<usize, NetworkError> {
        self.append(name, Op::Activation(g), &[x])
    }

    /// `gain x + offset`, the same for every value.
    pub(in crate::import) fn scaled(
        &mut self,
        name: &str,
        x: usize,
        gain: f32,
        offset: f32,
    ) -> Result<usize, NetworkError> {
        if gain == 1.0 && offset == 0.0 {
            return Ok(x);
        }
        let channels = self.nodes[x].shape.last().copied().unwrap_or(1);
        let (gain, offset) = (vec![gain; channels], vec![offset; channels]);
        self.append(name, Op::Scale { gain, offset }, &[x])
    }

    /// `min(max(x, low), high)`: a hard sigmoid between two bounds, a ReLU at one.
    pub(in crate::import) fn clipped(
        &mut self,
        name: &str,
        x: usize,
        low: f32,
        high: f32,
    ) -> Result<usize, NetworkError> {
        let open = |bound: f32| bound.abs() >= UNBOUNDED;
        let far = |bound: &f32| !open(*bound) && bound.abs() > FAR;
        if let Some(bound) = [low, high].iter().find(|bound| far(bound)) {
            return Err(NetworkError::unsupported(
                name,
                format!("a bound of {bound}"),
                format!("leave it out where no value is that large, or keep it within {FAR}"),
            ));
        }
        match (open(low), open(high)) {
            (true, true) => Ok(x),
            (false, true) => {
                let shifted = self.scaled(name, x, 1.0, -low)?;
                let cut = self.apply(name, Activation::Relu, shifted)?;
                self.scaled(name, cut, 1.0, low)
            }
            (true, false) => {
                let shifted = self.scaled(name, x, -1.0, high)?;
                let cut = self.apply(name, Activation::Relu, shifted)?;
                self.scaled(name, cut, -1.0, high)
            }
            (false, false) if low < high => {
                let width = high - low;
                let g = Activation::HardSigmoid {
                    alpha: 1.0 / width,
                    beta: -low / width,
                };
                let cut = self.apply(name, g, x)?;
                self.scaled(name, cut, width, low)
            }
            _ => Err(NetworkError::unsupported(
                name,
                format!("a bound between {low} and {high}"),
                "use min < max",
            )),
        }
    }

    /// `|x|`, a leaky ReLU of slope -1.
    pub(in crate::import) fn absolute(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        self.apply(name, Activation::LeakyRelu { alpha: -1.0 }, x)
    }

    /// `ln sigmoid(x) = -softplus(-x)`.
    pub(in crate::import) fn log_sigmoid(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let negative = self.scaled(name, x, -1.0, 0.0)?;
        let softplus = self.apply(name, Activation::Softplus, negative)?;
        self.scaled(name, softplus, -1.0, 0.0)
    }

    /// `max(0, x) + min(0, alpha (exp(x / alpha) - 1))`.
    pub(in crate::import) fn celu(
        &mut self,
        name: &str,
        x: usize,
        alpha: f32,
    ) -> Result<usize, NetworkError> {
        let elu = Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        };
        let place = self.scaled(name, x, 1.0 / alpha, 0.0)?;
        let place = self.apply(name, elu, place)?;
        self.scaled(name, place, alpha, 0.0)
    }

    /// `x g(x)`.
    pub(in crate::import) fn gated(
        &mut self,
        name: &str,
        x: usize,
        g: Activation,
    ) -> Result<usize, NetworkError> {
        let gate = self.apply(name, g, x)?;
        self.append(name, Op::Multiply, &[x, gate])
    }

    /// `x hard_sigmoid(x)`, with a slope of 1/6.
    pub(in crate::import) fn hard_swish(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let g = Activation::HardSigmoid {
            alpha: 1.0 / 6.0,
            beta: 0.5,
        };
        self.gated(name, x, g)
    }

    /// `x tanh(softplus(x))`.
    pub(in crate::import) fn mish(&mut self, name: &str, x: usize) -> Result<usize, NetworkError> {
        let softplus = self.apply(name, Activation::Softplus, x)?;
        let tanh = self.apply(name, Activation::Tanh, softplus)?;
        self.append(name, Op::Multiply, &[x, tanh])
    }

    /// `x` where positive, elsewhere `slopes x`: `relu(x) - slopes relu(-x)`, with a slope for each
    /// value of the last axis or for each value.
    pub(in crate::import) fn prelu(
        &mut self,
        name: &str,
        x: usize,
        slopes: &[f32],
    ) -> Result<usize, NetworkError> {
        match slopes.first() {
            Some(&alpha) if slopes.iter().all(|&other| other == alpha) => {
                return self.apply(name, Activation::LeakyRelu { alpha }, x);
            }
            _ => {}
        }
        let held = self.nodes[x].shape.clone();
        let positive = self.apply(name, Activation::Relu, x)?;
        let negative = self.scaled(name, x, -1.0, 0.0)?;
        let negative = self.apply(name, Activation::Relu, negative)?;
        let gain: Vec<f32> = slopes.iter().map(|slope| -slope).collect();
        let offset = vec![0.0; gain.len()];
        let negative = self.of_each(name, negative, gain, offset)?;
        let negative = self.reshaped(name, negative, &held)?;
        self.append(name, Op::Add, &[positive, negative])
    }

    /// A gain and an offset for each value of the last axis, or for each value; the shape stays.
    pub(in crate::import) fn of_each(
        &mut self,
        name: &str,
        x: usize,
        gain: Vec<f32>,
        offset: Vec<f32>,
    ) -> Result<usize, NetworkError> {
        let held = self.nodes[x].shape.clone();
        if held.last() == Some(&gain.len()) {
            return self.append(name, Op::Scale { gain, offset }, &[x]);
        }
        let flat = self.reshaped(name, x, &[gain.len()])?;
        let scaled = self.append(name, Op::Scale { gain, offset }, &[flat])?;
        self.reshaped(name, scaled, &held)
    }

    /// The same values in another shape.
    pub(in crate::import) fn reshaped(
        &mut self,
        name: &str,
        x: usize,
        shape: &[usize],
    ) -> Result<usize, NetworkError> {
        if self.nodes[x].shape == shape {
            return Ok(x);
        }
        self.append(name, Op::Reshape(shape.to_vec()), &[x])
    }

    /// `a - b`.
    pub(in crate::import) fn difference(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let negative = self.scaled(name, b, -1.0, 0.0)?;
        self.append(name, Op::Add, &[a, negative])
    }

    /// `max(a, b) = b + relu(a - b)`.
    pub(in crate::import) fn larger(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let beyond = self.difference(name, a, b)?;
        let beyond = self.apply(name, Activation::Relu, beyond)?;
        self.append(name, Op::Add, &[b, beyond])
    }

    /// `min(a, b) = a - relu(a - b)`.
    pub(in crate::import) fn smaller(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let beyond = self.difference(name, a, b)?;
        let beyond = self.apply(name, Activation::Relu, beyond)?;
        self.difference(name, a, beyond)
    }

    /// `a / b`.
    pub(in crate::import) fn quotient(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let inverse = self.apply(name, Activation::Reciprocal, b)?;
        self.append(name, Op::Multiply, &[a, inverse])
    }

    /// `x^exponent` for integers up to 8, halves between them, and their negatives.
    ///
    /// # Errors
    /// Another exponent.
    pub(in crate::import) fn power(
        &mut self,
        name: &str,
        x: usize,
        exponent: f32,
    ) -> Result<usize, NetworkError> {
        let size = exponent.abs();
        let (whole, half) = (size.trunc() as u32, size.fract());
        if ![0.0, 0.5].contains(&half) || whole > MAX_POWER || size == 0.0 {
            return Err(NetworkError::unsupported(
                name,
                format!("a power of {exponent}"),
                format!("integers up to {MAX_POWER}, halves between and their negatives work"),
            ));
        }
        let mut place = None;
        if half != 0.0 {
            place = Some(self.apply(name, Activation::Root, x)?);
        }
        // From the highest bit down: squared, and multiplied by x where the bit is set.
        let mut product = None;
        for bit in (0..u32::BITS - whole.leading_zeros()).rev() {
            if let Some(before) = product {
                product = Some(self.append(name, Op::Multiply, &[before, before])?);
            }
            if whole >> bit & 1 == 1 {
                product = Some(match product {
                    Some(before) => self.append(name, Op::Multiply, &[before, x])?,
                    None => x,
                });
            }
        }
        let place = match (place, product) {
            (Some(root), Some(product)) => self.append(name, Op::Multiply, &[product, root])?,
            (one, other) => one.or(other).unwrap_or(x),
        };
        if exponent < 0.0 {
            return self.apply(name, Activation::Reciprocal, place);
        }
        Ok(place)
    }

    /// The value repeated along axes of length 1 to `shape`, which has as many axes.
    ///
    /// # Errors
    /// The shapes do not go together.
    pub(in crate::import) fn spread(
        &mut self,
        name: &str,
        x: usize,
        shape: &[usize],
    ) -> Result<usize, NetworkError> {
        let own = self.nodes[x].shape.clone();
        if own == shape {
            return Ok(x);
        }
        let fits =
            own.len() == shape.len() && own.iter().zip(shape).all(|(&n, &m)| n == 1 || n == m);
        if !fits {
            let message = format!("values of shapes {own:?} and {shape:?} beside each other");
            let nearest = "values of equal shape, and axes of length 1, work";
            return Err(NetworkError::unsupported(name, message, nearest));
        }
        let op = shapes::selection(&spread_places(&own, shape), shape.to_vec());
        self.append(name, op, &[x])
    }

    /// Values of shapes that differ by axes of length 1, brought to one shape.
    ///
    /// # Errors
    /// The shapes do not go together.
    pub(in crate::import) fn alike(
        &mut self,
        name: &str,
        from: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let mut shape = Vec::new();
        for &x in from {
            let own = &self.nodes[x].shape;
            shape.resize(own.len().max(shape.len()), 1);
            for (axis, n) in shape.iter_mut().zip(own) {
                *axis = (*axis).max(*n);
            }
        }
        from.iter().map(|&x| self.spread(name, x, &shape)).collect()
    }

    /// The values padded by zeros along each axis, `[before, after]`; negative numbers cut off.
    ///
    /// # Errors
    /// Nothing is left, or too much.
    pub(in crate::import) fn padded(
        &mut self,
        name: &str,
        x: usize,
        pads: &[[i64; 2]],
    ) -> Result<usize, NetworkError> {
        if pads.iter().all(|pad| *pad == [0; 2]) {
            return Ok(x);
        }
        let (shape, places) = shapes::padded(name, &self.nodes[x].shape, pads)?;
        self.append(name, Op::Select(Selection { places, shape }), &[x])
    }

    /// The values at the given indices of one axis, which keeps its place.
    pub(in crate::import) fn along(
        &mut self,
        name: &str,
        x: usize,
        axis: usize,
        indices: &[usize],
    ) -> Result<usize, NetworkError> {
        let mut shape = self.nodes[x].shape.clone();
        let places = shapes::places_along(&shape, axis, indices);
        shape[axis] = indices.len();
        self.append(name, shapes::selection(&places, shape), &[x])
    }

    /// `factor z`, `factor (exp(z) - 1)`, or neither, past scales of one gain.
    fn piece(&self, mut place: usize, z: usize) -> Option<Piece> {
        let mut factor = 1.0_f32;
        loop {
            if place == z {
                return Some(Piece::Linear(factor));
            }
            let node = &self.nodes[place];
            let from = node.from.first().copied()?;
            match &node.op {
                Op::Activation(Activation::Elu { alpha, scale }) if from == z => {
                    return (*alpha == 1.0).then_some(Piece::Saturating(factor * scale));
                }
                Op::Scale { gain, offset } => {
                    let (g, o) = (gain.first().copied()?, offset.first().copied()?);
                    let alike = gain.iter().all(|&other| other == g)
                        && offset.iter().all(|&other| other == o);
                    let exponential = self.nodes[from].op
                        == Op::Activation(Activation::Exponential)
                        && self.below(self.nodes[from].from[0], z);
                    if !alike {
                        return None;
                    }
                    if o == -g && exponential {
                        return Some(Piece::Saturating(factor * g));
                    }
                    if o != 0.0 {
                        return None;
                    }
                    factor *= g;
                    place = from;
                }
                // Past layers that leave every value where it is.
                Op::Reshape(_) => place = from,
                _ => return None,
            }
        }
    }

    /// True if `b` is a softplus of `z`, and `a` the line that it nears where `z` is large; both
    /// past a scale.
    pub(in crate::import) fn nears(&self, z: usize, a: usize, b: usize) -> bool {
        let scale = |place: usize| match &self.nodes[place].op {
            Op::Scale { gain, offset } if offset.iter().all(|&o| o == 0.0) => {
                let first = gain.first().copied()?;
                let alike = gain.iter().all(|&g| g == first);
                alike.then_some((self.nodes[place].from[0], first))
            }
            _ => None,
        };
        let (softplus, outer) = scale(b).unwrap_or((b, 1.0));
        let node = &self.nodes[softplus];
        if node.op != Op::Activation(Activation::Softplus) || node.from != [z] {
            return false;
        }
        let inner = match scale(z) {
            Some((x, inner)) if x == a => inner,
            _ if z == a => 1.0,
            _ => return false,
        };
        (inner * outer - 1.0).abs() < 1e-6
    }

    /// True if a node is `z`, or `min(z, 0)`.
    fn below(&self, place: usize, z: usize) -> bool {
        let negative = |place: usize| match &self.nodes[place].op {
            Op::Scale { gain, offset } => {
                gain.iter().all(|&g| g == -1.0) && offset.iter().all(|&o| o == 0.0)
            }
            _ => false,
        };
        if place == z {
            return true;
        }
        let from = |place: usize| self.nodes[place].from.first().copied().unwrap_or(0);
        let cut = from(place);
        negative(place)
            && self.nodes[cut].op == Op::Activation(Activation::Relu)
            && negative(from(cut))
            && from(from(cut)) == z
    }

    /// `a` where `z` is positive and `b` elsewhere, of parts that meet at zero: linear ones, and
    /// `exp(z) - 1` below. No part is zero.
    ///
    /// # Errors
    /// The parts are others: a choice that jumps has no derivative.
    pub(in crate::import) fn piecewise(
        &mut self,
        name: &str,
        z: usize,
        [a, b]: [Option<usize>; 2],
    ) -> Result<usize, NetworkError> {
        let piece = |part: Option<usize>| match part {
            Some(part) => self.piece(part, z),
            None => Some(Piece::Linear(0.0)),
        };
        // An ELU is the identity where it is positive.
        let above = match piece(a) {
            Some(Piece::Linear(s)) => Some(s),
            Some(Piece::Saturating(s)) if a.is_some_and(|a| self.is_elu(a, z)) => Some(s),
            _ => None,
        };
        match (above, piece(b)) {
            (Some(0.0), Some(Piece::Linear(c))) => {
                let negative = self.scaled(name, z, -1.0, 0.0)?;
                let cut = self.apply(name, Activation::Relu, negative)?;
                self.scaled(name, cut, -c, 0.0)
            }
            (Some(s), Some(Piece::Linear(c))) => {
                let g = match c / s {
                    0.0 => Activation::Relu,
                    alpha => Activation::LeakyRelu { alpha },
                };
                let place = self.apply(name, g, z)?;
                self.scaled(name, place, s, 0.0)
            }
            (Some(scale), Some(Piece::Saturating(c))) if scale > 0.0 => {
                let alpha = c / scale;
                self.apply(name, Activation::Elu { alpha, scale }, z)
            }
            _ => Err(NetworkError::unsupported(
                name,
                "a choice by values, which may jump,",
                "choices by the sign of x between multiples of x and exp(x) - 1 work",
            )),
        }
    }

    /// True if a node is an ELU of `z`, past scales.
    fn is_elu(&self, mut place: usize, z: usize) -> bool {
        loop {
            let node = &self.nodes[place];
            match &node.op {
                Op::Activation(Activation::Elu { .. }) => return node.from == [z],
                Op::Scale { .. } | Op::Reshape(_) => place = node.from[0],
                _ => return false,
            }
        }
    }

    /// A function that an activation of this name is made of; none where there is none.
    pub(in crate::import) fn named_composite(
        &mut self,
        name: &str,
        function: &str,
        x: usize,
    ) -> Option<Result<usize, NetworkError>> {
        Some(match function {
            "relu6" => self.clipped(name, x, 0.0, 6.0),
            "hard_tanh" => self.clipped(name, x, -1.0, 1.0),
            "hard_silu" | "hard_swish" => self.hard_swish(name, x),
            "mish" => self.mish(name, x),
            "log_sigmoid" => self.log_sigmoid(name, x),
            "celu" => self.celu(name, x, 1.0),
            "tanh_shrink" => {
                let tanh = match self.apply(name, Activation::Tanh, x) {
                    Ok(tanh) => tanh,
                    Err(error) => return Some(Err(error)),
                };
                self.difference(name, x, tanh)
            }
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;

    fn of(f: impl Fn(&mut Network) -> Result<usize, NetworkError>, x: &[f64]) -> Vec<f64> {
        let mut network = Network::new("n", "x", vec![x.len()]);
        f(&mut network).expect("the function is composed");
        network.validate().expect("the network is valid");
        evaluate::run(&network, x)
    }

    #[test]
    fn powers_are_products_roots_and_reciprocals() {
        for exponent in [1.5, 2.0, 3.0, 7.0, 8.0, 0.5, -0.5, -1.0, -2.0, -3.5, 4.5] {
            let x = [0.3, 1.0, 2.7];
            let found = of(|network| network.power("p", 0, exponent), &x);
            for (x, y) in x.iter().zip(found) {
                let exact = x.powf(f64::from(exponent));
                assert!((y - exact).abs() <= 1e-12 * exact, "{x}^{exponent}: {y}");
            }
        }
        let mut network = Network::new("n", "x", vec![1]);
        for exponent in [0.0, 9.0, 0.3, -2.25, f32::NAN, f32::INFINITY] {
            let error = network.power("p", 0, exponent).expect_err("no such power");
            assert!(error.to_string().contains("a power of"), "{error}");
        }
    }

    #[test]
    fn bounds_and_composed_activations_are_their_formulas() {
        let x = [-4.0, -0.5, 0.0, 0.7, 8.0];
        type Formula = (&'static str, fn(f64) -> f64);
        let formulas: [Formula; 6] = [
            ("relu6", |x| x.clamp(0.0, 6.0)),
            ("hard_tanh", |x| x.clamp(-1.0, 1.0)),
            ("hard_silu", |x| x * (x / 6.0 + 0.5).clamp(0.0, 1.0)),
            ("mish", |x| x * x.exp().ln_1p().tanh()),
            ("log_sigmoid", |x| -(-x).exp().ln_1p()),
            ("celu", |x| if x > 0.0 { x } else { x.exp_m1() }),
        ];
        for (name, exact) in formulas {
            let found = of(
                |network| network.named_composite(name, name, 0).expect(name),
                &x,
            );
            for (x, y) in x.iter().zip(found) {
                assert!((y - exact(*x)).abs() < 1e-6, "{name}({x}) = {y}");
            }
        }
        let found = of(
            |network| network.prelu("p", 0, &[0.1, -0.2, 3.0, 1.0, 0.5]),
            &x,
        );
        assert_eq!(found[3..], [0.7, 8.0]);
        assert!((found[0] + 0.4).abs() < 1e-6 && (found[1] - 0.1).abs() < 1e-6);
        assert_eq!(of(|network| network.absolute("a", 0), &x)[..2], [4.0, 0.5]);
    }

    #[test]
    fn zeros_are_put_around_and_values_cut_off() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let found = of(
            |network| {
                let image = network.reshaped("r", 0, &[2, 3])?;
                network.padded("p", image, &[[1, 0], [-1, 1]])
            },
            &x,
        );
        assert_eq!(found, [0.0, 0.0, 0.0, 2.0, 3.0, 0.0, 5.0, 6.0, 0.0]);
    }

    #[test]
    fn a_bound_that_would_take_the_digits_of_a_value_is_refused() {
        let mut network = Network::new("bounded", "x", vec![2]);
        for (low, high) in [(-1e6, 1e6), (-1e5, f32::INFINITY), (f32::NEG_INFINITY, 2e4)] {
            let refused = network.clipped("clip", 0, low, high);
            let refused = refused.expect_err("a far bound").to_string();
            assert!(refused.contains("a bound of"), "{refused}");
        }
        for (low, high) in [(-1.0, 6.0), (0.0, f32::INFINITY), (f32::MIN, f32::MAX)] {
            assert!(network.clipped("clip", 0, low, high).is_ok());
        }
    }
}
