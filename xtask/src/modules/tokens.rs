//! Rust source as tokens: enough of the grammar to find modules, imports and paths.

/// One token and the line it stands on, counted from one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    pub text: String,
    pub line: usize,
}

impl Token {
    pub fn is(&self, text: &str) -> bool {
        self.text == text
    }

    pub fn is_word(&self) -> bool {
        self.text
            .starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

/// Words, `::` and single characters of punctuation. Comments are left out; a string keeps its
/// quotes, a character or a number is left out.
pub fn tokens(source: &str) -> Vec<Token> {
    let mut reader = Reader {
        rest: source,
        line: 1,
    };
    let mut found = Vec::new();
    while !reader.rest.is_empty() {
        let line = reader.line;
        if let Some(text) = reader.token() {
            found.push(Token {
                text: text.to_string(),
                line,
            });
        }
    }
    found
}

struct Reader<'a> {
    rest: &'a str,
    line: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(bytes);
        self.line += taken.matches('\n').count();
        self.rest = rest;
        taken
    }

    fn token(&mut self) -> Option<&'a str> {
        let rest = self.rest;
        let first = rest.chars().next()?;
        if rest.starts_with("//") {
            self.take(rest.find('\n').unwrap_or(rest.len()));
            return None;
        }
        if rest.starts_with("/*") {
            self.take(block_comment(rest));
            return None;
        }
        if let Some(length) = string(rest) {
            return Some(self.take(length));
        }
        if let Some(length) = character(rest) {
            self.take(length);
            return None;
        }
        if first.is_alphabetic() || first == '_' {
            // A raw identifier, r#type, is the word behind its mark.
            let skip = if rest.starts_with("r#") { 2 } else { 0 };
            self.take(skip);
            let end = self.rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            return Some(self.take(end.unwrap_or(self.rest.len())));
        }
        if first.is_ascii_digit() {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            self.take(end.unwrap_or(rest.len()));
            return None;
        }
        if rest.starts_with("::") {
            return Some(self.take(2));
        }
        let taken = self.take(first.len_utf8());
        (!first.is_whitespace()).then_some(taken)
    }
}

/// Length of a comment that begins here; comments may hold others.
fn block_comment(text: &str) -> usize {
    let mut depth = 0_usize;
    let mut at = 0;
    while at < text.len() {
        if text[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if text[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += text[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    text.len()
}

/// Length of a string literal that begins here: plain, raw, of bytes, of C.
fn string(text: &str) -> Option<usize> {
    let prefix = ["br", "cr", "b", "c", "r", ""]
        .iter()
        .find(|prefix| {
            let after = text.strip_prefix(*prefix).unwrap_or_default();
            let after = if prefix.ends_with('r') {
                after.trim_start_matches('#')
            } else {
                after
            };
            after.starts_with('"')
        })?
        .len();
    let raw = text[..prefix].ends_with('r');
    let marks = text[prefix..].bytes().take_while(|b| *b == b'#').count();
    let body = prefix + marks + 1;
    if raw {
        let end = format!("\"{}", "#".repeat(marks));
        let length = text[body..].find(&end).map(|at| body + at + end.len());
        return Some(length.unwrap_or(text.len()));
    }
    let mut escaped = false;
    for (at, c) in text[body..].char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return Some(body + at + 1),
            _ => {}
        }
    }
    Some(text.len())
}

/// Length of a character literal or of a lifetime that begins here.
fn character(text: &str) -> Option<usize> {
    let quote = if text.starts_with("b'") { 1 } else { 0 };
    let body = text[quote..].strip_prefix('\'')?;
    let mut characters = body.char_indices();
    let (_, first) = characters.next()?;
    if first == '\\' {
        let end = body[2..].find('\'')?;
        return Some(quote + 1 + 2 + end + 1);
    }
    match characters.next() {
        Some((at, '\'')) => Some(quote + 1 + at + 1),
        _ => {
            let end = body.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            Some(quote + 1 + end.unwrap_or(body.len()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::tokens;

    fn words(source: &str) -> Vec<String> {
        tokens(source).into_iter().map(|token| token.text).collect()
    }

    #[test]
    fn comments_and_characters_are_left_out() {
        let source = "a /* b /* c */ d */ e // f\n'g' '\\'' '\\u{1F}' h<'i> b'j' 1.5e3_f64 k";
        assert_eq!(words(source), ["a", "e", "h", "<", ">", ".", "k"]);
    }

    #[test]
    fn a_string_is_one_token() {
        assert_eq!(
            words(r##"x("a \" crate::b", r#"c " d"#, br"e")"##),
            [
                "x",
                "(",
                r#""a \" crate::b""#,
                ",",
                r##"r#"c " d"#"##,
                ",",
                "br\"e\"",
                ")"
            ]
        );
    }

    #[test]
    fn lines_are_counted() {
        let tokens = tokens("a\n\"b\nc\"\n/* \n */ d::e");
        let lines: Vec<usize> = tokens.iter().map(|token| token.line).collect();
        assert_eq!(lines, [1, 2, 5, 5, 5]);
    }
}
