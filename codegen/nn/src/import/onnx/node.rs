//! A node's attributes and inputs, with a record of those that were looked at: what is left is not
//! understood.

use std::cell::RefCell;
use std::collections::BTreeSet;

use super::proto::{AttributeProto, NodeProto};
use crate::NetworkError;

/// Attributes that change nothing in a trained network, by operator.
const IDLE: &[(&str, &[&str])] = &[
    ("BatchNormalization", &["momentum"]),
    ("Dropout", &["ratio", "seed", "is_test"]),
    ("MaxPool", &["storage_order"]),
    ("Cast", &["saturate"]),
    ("Conv", &["kernel_shape"]),
    ("LSTM", &["hidden_size"]),
    ("GRU", &["hidden_size"]),
    ("RNN", &["hidden_size"]),
];

/// A node, its name made up where it has none.
pub(super) struct Node<'a> {
    pub(super) name: String,
    pub(super) proto: &'a NodeProto,
    /// Version of the operators.
    pub(super) opset: i64,
    attributes: RefCell<BTreeSet<String>>,
    inputs: RefCell<BTreeSet<usize>>,
}

impl<'a> Node<'a> {
    pub(super) fn new(proto: &'a NodeProto, place: usize, opset: i64) -> Self {
        let name = if proto.name.is_empty() {
            format!("{}_{place}", proto.op_type)
        } else {
            proto.name.clone()
        };
        Self {
            name,
            proto,
            opset,
            attributes: RefCell::default(),
            inputs: RefCell::default(),
        }
    }

    fn attribute(&self, name: &str) -> Option<&'a AttributeProto> {
        self.attributes.borrow_mut().insert(name.into());
        self.proto
            .attribute
            .iter()
            .find(|attribute| attribute.name == name)
    }

    /// The name at an input; none where it is left out, be it with an empty name.
    pub(super) fn input(&self, input: usize) -> Option<&'a str> {
        self.inputs.borrow_mut().insert(input);
        let name = self.proto.input.get(input).map(String::as_str);
        name.filter(|name| !name.is_empty())
    }

    /// Everything in the node has been looked at.
    ///
    /// # Errors
    /// An attribute or an input was not.
    pub(super) fn expect_read(&self) -> Result<(), NetworkError> {
        let op = self.proto.op_type.as_str();
        let looked_at = self.attributes.borrow();
        let idle = IDLE.iter().find(|(name, _)| *name == op);
        let idle = idle.map_or(&[][..], |(_, names)| names);
        let left = self
            .proto
            .attribute
            .iter()
            .map(|attribute| attribute.name.as_str());
        let left = left.filter(|name| !looked_at.contains(*name) && !idle.contains(name));
        if let Some(name) = left.into_iter().next() {
            let known: Vec<&str> = looked_at.iter().map(String::as_str).collect();
            let nearest = if known.is_empty() {
                format!("{op} works without attributes")
            } else {
                format!("{op} works with {}", known.join(", "))
            };
            return Err(self.unsupported(format!("the attribute {name} of {op}"), &nearest));
        }
        let looked_at = self.inputs.borrow();
        let left = (0..self.proto.input.len()).find(|input| !looked_at.contains(input));
        match left.filter(|&input| !self.proto.input[input].is_empty()) {
            Some(input) => Err(self.unsupported(
                format!("input {input} of {op}, {:?},", self.proto.input[input]),
                "leave it out",
            )),
            None => Ok(()),
        }
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.attribute(name).is_some()
    }

    pub(super) fn int(&self, name: &str, otherwise: i64) -> i64 {
        self.attribute(name)
            .map_or(otherwise, |attribute| attribute.i)
    }

    pub(super) fn float(&self, name: &str, otherwise: f32) -> f32 {
        self.attribute(name)
            .map_or(otherwise, |attribute| attribute.f)
    }

    pub(super) fn floats(&self, name: &str) -> &'a [f32] {
        self.attribute(name)
            .map_or(&[][..], |attribute| attribute.floats.as_slice())
    }

    pub(super) fn text(&self, name: &str) -> String {
        self.attribute(name)
            .map_or_else(String::new, |a| String::from_utf8_lossy(&a.s).into())
    }

    pub(super) fn texts(&self, name: &str) -> Vec<String> {
        let list = self
            .attribute(name)
            .map_or(&[][..], |attribute| &attribute.strings);
        list.iter()
            .map(|text| String::from_utf8_lossy(text).into())
            .collect()
    }

    pub(super) fn ints(&self, name: &str) -> Option<&'a [i64]> {
        self.attribute(name)
            .map(|attribute| attribute.ints.as_slice())
    }

    pub(super) fn tensor(&self, name: &str) -> Option<&'a super::proto::TensorProto> {
        self.attribute(name)
            .and_then(|attribute| attribute.t.as_ref())
    }

    /// # Errors
    /// The attribute is there, and another than what works.
    pub(super) fn expect_int(
        &self,
        name: &str,
        only: i64,
        nearest: &str,
    ) -> Result<(), NetworkError> {
        match self.int(name, only) {
            value if value == only => Ok(()),
            value => Err(self.unsupported(format!("{name} = {value}"), nearest)),
        }
    }

    pub(super) fn unsupported(&self, what: impl Into<String>, nearest: &str) -> NetworkError {
        NetworkError::unsupported(&self.name, what, nearest)
    }

    pub(super) fn malformed(&self, message: impl Into<String>) -> NetworkError {
        NetworkError::malformed(&self.name, message)
    }
}
