//! Default classes of MJCF: attributes that an element has without saying so.

use std::collections::BTreeMap;

use super::document::Node;
use crate::error::Result;

/// Class that all elements are of.
const MAIN: &str = "main";

/// Attributes by class, tag and key.
#[derive(Clone, Debug, Default)]
pub struct Defaults {
    classes: BTreeMap<String, BTreeMap<(String, String), String>>,
}

impl Defaults {
    /// The classes of a model.
    ///
    /// # Errors
    /// `File` for a nested class without a name, and for classes without end.
    pub fn read(root: &Node) -> Result<Self> {
        let mut defaults = Self::default();
        defaults.classes.insert(MAIN.into(), BTreeMap::new());
        for node in root.all("default") {
            let name = node.get("class").unwrap_or(MAIN);
            defaults.class(node, name, MAIN)?;
        }
        Ok(defaults)
    }

    fn class(&mut self, node: &Node, name: &str, parent: &str) -> Result<()> {
        let mut own = self.classes.get(parent).cloned().unwrap_or_default();
        if let Some(already) = self.classes.get(name) {
            own.extend(already.clone());
        }
        for element in node.inside.iter().filter(|inner| inner.tag != "default") {
            for (key, value) in &element.attributes {
                own.insert((element.tag.clone(), key.clone()), value.clone());
            }
        }
        self.classes.insert(name.to_owned(), own);
        for inner in node.all("default") {
            let Some(inner_name) = inner.get("class") else {
                return Err(inner.error("a `default` within another needs a `class`"));
            };
            self.class(inner, inner_name, name)?;
        }
        Ok(())
    }

    /// An element with what its class adds. `childclass`: the class that bodies around it say.
    ///
    /// # Errors
    /// `File` for a class that is not there.
    pub fn apply(&self, node: &Node, childclass: Option<&str>) -> Result<Node> {
        let name = node.get("class").or(childclass).unwrap_or(MAIN);
        let Some(class) = self.classes.get(name) else {
            return Err(node.error(format!("there is no default class `{name}`")));
        };
        let mut full = node.clone();
        for ((tag, key), value) in class {
            if *tag == node.tag && full.get(key).is_none() {
                full.attributes.push((key.clone(), value.clone()));
            }
        }
        Ok(full)
    }
}
