//! A node's attributes.

use super::proto::{AttributeProto, NodeProto};
use crate::NetworkError;

/// A node, its name made up where it has none.
pub(super) struct Node<'a> {
    pub(super) name: String,
    pub(super) proto: &'a NodeProto,
}

impl<'a> Node<'a> {
    pub(super) fn new(proto: &'a NodeProto, place: usize) -> Self {
        let name = if proto.name.is_empty() {
            format!("{}_{place}", proto.op_type)
        } else {
            proto.name.clone()
        };
        Self { name, proto }
    }

    fn attribute(&self, name: &str) -> Option<&'a AttributeProto> {
        self.proto
            .attribute
            .iter()
            .find(|attribute| attribute.name == name)
    }

    pub(super) fn int(&self, name: &str, otherwise: i64) -> i64 {
        self.attribute(name)
            .map_or(otherwise, |attribute| attribute.i)
    }

    pub(super) fn float(&self, name: &str, otherwise: f32) -> f32 {
        self.attribute(name)
            .map_or(otherwise, |attribute| attribute.f)
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
