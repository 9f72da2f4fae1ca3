//! As much XML as MJCF needs.

/// A tag with attributes, elements inside it, and a comment before it.
#[derive(Clone, Debug)]
pub(super) struct Element {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    inside: Vec<Element>,
    remark: Option<String>,
}

impl Element {
    pub fn new(tag: &'static str) -> Self {
        Self {
            tag,
            attributes: Vec::new(),
            inside: Vec::new(),
            remark: None,
        }
    }

    pub fn with(mut self, key: &'static str, value: &str) -> Self {
        self.attributes.push((key, value.to_owned()));
        self
    }

    /// A number that reads back to the same bits.
    pub fn number(self, key: &'static str, value: f64) -> Self {
        self.numbers(key, &[value])
    }

    pub fn numbers(self, key: &'static str, values: &[f64]) -> Self {
        // Plus zero: no negative zeros.
        let text: Vec<String> = values.iter().map(|v| format!("{:?}", v + 0.0)).collect();
        self.with(key, &text.join(" "))
    }

    pub fn holding(mut self, element: Self) -> Self {
        self.inside.push(element);
        self
    }

    pub fn remark(mut self, remark: impl Into<String>) -> Self {
        self.remark = Some(remark.into());
        self
    }

    fn write(&self, text: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        if let Some(remark) = &self.remark {
            *text += &format!("{indent}{}\n", comment(remark));
        }
        *text += &format!("{indent}<{}", self.tag);
        for (key, value) in &self.attributes {
            *text += &format!(" {key}=\"{}\"", escape(value));
        }
        if self.inside.is_empty() {
            *text += "/>\n";
            return;
        }
        *text += ">\n";
        for element in &self.inside {
            element.write(text, depth + 1);
        }
        *text += &format!("{indent}</{}>\n", self.tag);
    }
}

/// The root below some comments.
pub(super) fn document(remarks: &[String], root: &Element) -> String {
    let mut text = String::new();
    for remark in remarks {
        text += &format!("{}\n", comment(remark));
    }
    root.write(&mut text, 0);
    text
}

/// Two hyphens would end a comment.
fn comment(remark: &str) -> String {
    let mut text = remark.replace(['\n', '\r'], " ");
    while text.contains("--") {
        text = text.replace("--", "- -");
    }
    format!("<!-- {text} -->")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}
