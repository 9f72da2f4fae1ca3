//! Rust literals, laid out for a reader.

/// Width at which a line of numbers is broken, rustfmt's own.
const WIDTH: usize = 100;

/// A literal that the compiler reads back to the same bits; the shortest one there is.
pub fn float(value: f32) -> String {
    if value == f32::INFINITY {
        return "f32::INFINITY".into();
    }
    if value == f32::NEG_INFINITY {
        return "f32::NEG_INFINITY".into();
    }
    format!("{value:?}")
}

/// As [`float`], in double precision.
pub fn double(value: f64) -> String {
    format!("{value:?}")
}

/// `[a, b, c]` on one line.
pub fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    format!("[{}]", items.join(", "))
}

/// `[a, b, c]` at `indent` spaces, after and before `beside` characters on the same line; broken at
/// the line's width with the items one level further in.
pub fn block(items: impl IntoIterator<Item = String>, indent: usize, beside: usize) -> String {
    let items: Vec<String> = items.into_iter().collect();
    let line = list(items.iter().cloned());
    if indent + beside + line.len() <= WIDTH {
        return line;
    }
    let mut text = String::from("[\n");
    let mut used = 0;
    for item in &items {
        if used > 0 && indent + 4 + used + item.len() + 2 > WIDTH {
            text.push('\n');
            used = 0;
        }
        let lead = if used == 0 { indent + 4 } else { 1 };
        text.push_str(&" ".repeat(lead));
        text.push_str(item);
        text.push(',');
        used += item.len() + 1 + usize::from(used > 0);
    }
    text.push('\n');
    text.push_str(&" ".repeat(indent));
    text.push(']');
    text
}

/// Rows of numbers, one under another, at `indent` spaces.
pub fn matrix(rows: impl IntoIterator<Item = Vec<String>>, indent: usize) -> String {
    let mut text = String::from("[\n");
    for row in rows {
        text.push_str(&" ".repeat(indent + 4));
        text.push_str(&block(row, indent + 4, 1));
        text.push_str(",\n");
    }
    text.push_str(&" ".repeat(indent));
    text.push(']');
    text
}

/// `Name { a, b }` at `indent` spaces, one field a line where rustfmt would not leave it on one.
pub fn structure(name: &str, fields: &[String], indent: usize) -> String {
    const STRUCT_LIT_WIDTH: usize = 18;
    let line = fields.join(", ");
    let margin = " ".repeat(indent);
    if line.len() <= STRUCT_LIT_WIDTH {
        return format!("{margin}{name} {{ {line} }}");
    }
    let fields: String = fields
        .iter()
        .map(|field| format!("{margin}    {field},\n"))
        .collect();
    format!("{margin}{name} {{\n{fields}{margin}}}")
}

/// `1 input`, `2 inputs`.
pub fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_literal_is_the_number() {
        let mut bits = 0x9e37_79b9_u32;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let value = f32::from_bits(bits);
            if value.is_finite() {
                let text = float(value);
                assert_eq!(text.parse::<f32>().map(f32::to_bits), Ok(bits), "{text}");
                // An integer literal would not compile where a float is expected.
                assert!(text.contains(['.', 'e']), "{text}");
            }
        }
        assert_eq!(float(f32::INFINITY), "f32::INFINITY");
    }

    #[test]
    fn a_long_row_is_broken_within_the_width() {
        let text = block((0..40).map(|i| format!("-0.1234{i:05}")), 4, 0);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() > 4);
        assert!(lines.iter().all(|line| line.len() <= WIDTH), "{text}");
        assert!(lines[1].len() > WIDTH - 16, "lines are filled: {text}");
        assert_eq!(text.matches(',').count(), 40);
    }
}
