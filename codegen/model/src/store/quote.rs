//! Strings as TOML writes them.

/// A TOML string with its quotes and escapes.
pub(super) fn string(value: &str) -> String {
    toml::Value::from(value).to_string()
}
