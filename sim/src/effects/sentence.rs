//! Laws and findings with their numbers, as a report prints them.

use super::Kind;

impl Kind {
    /// The law with numbers for its parameters: `F = -20.1 N sign(v)`. `values` are value and unit,
    /// in the order of the description.
    pub fn equation(self, values: &[(f64, &str)]) -> String {
        let description = self.description();
        let mut text = String::new();
        let mut rest = description.law;
        while !rest.is_empty() {
            let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let length = rest.find(|c| !word(c)).unwrap_or(rest.len());
            let (token, _) = rest.split_at(length);
            let known = description
                .parameters
                .iter()
                .position(|parameter| parameter.name == token);
            match known.and_then(|index| values.get(index)) {
                Some(&value) => text += &quantity(value),
                None => text += token,
            }
            rest = &rest[length..];
            let gap = rest.find(word).unwrap_or(rest.len());
            text += &rest[..gap];
            rest = &rest[gap..];
        }
        text
    }

    /// Sentence of a report about the effect at a component. `values` as in [`Kind::equation`].
    ///
    /// ```
    /// let kind = sinew_sim::effects::Kind::named("coulomb_friction").unwrap();
    /// assert_eq!(
    ///     kind.sentence("carriage", &[(20.1, "N")]),
    ///     "Dry friction of 20.1 N at carriage is missing from the model."
    /// );
    /// assert_eq!(kind.equation(&[(20.1, "N")]), "F = -20.1 N sign(v)");
    /// ```
    pub fn sentence(self, component: &str, values: &[(f64, &str)]) -> String {
        let description = self.description();
        let mut text = description.sentence.replace("{component}", component);
        for (parameter, &value) in description.parameters.iter().zip(values) {
            text = text.replace(&format!("{{{}}}", parameter.name), &quantity(value));
        }
        text
    }
}

/// Three significant digits and the unit.
fn quantity((value, unit): (f64, &str)) -> String {
    let number = if value == 0.0 || !value.is_finite() {
        format!("{value}")
    } else {
        let digits = 2 - value.abs().log10().floor() as i32;
        if (-2..=5).contains(&digits) {
            format!("{value:.*}", digits.max(0) as usize)
        } else {
            format!("{value:.2e}")
        }
    };
    if unit.is_empty() || unit == "1" {
        number
    } else {
        format!("{number} {unit}")
    }
}
