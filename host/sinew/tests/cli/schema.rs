//! The part of JSON Schema that docs/reference/schemas uses: type, const, enum, properties,
//! required, additionalProperties, items.

use serde_json::Value;

use crate::desk::checkout;

/// The committed schema of that name.
pub fn schema(name: &str) -> Value {
    let path = checkout().join(format!("docs/reference/schemas/{name}.schema.json"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).expect("a schema is JSON")
}

/// Places where a document breaks its schema.
pub fn violations(schema: &Value, document: &Value) -> Vec<String> {
    let mut found = Vec::new();
    walk(schema, document, "$", &mut found);
    found
}

fn walk(schema: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    for key in schema.as_object().into_iter().flatten().map(|(key, _)| key) {
        let known = [
            "$schema",
            "$id",
            "title",
            "type",
            "const",
            "enum",
            "properties",
            "required",
            "additionalProperties",
            "items",
        ];
        assert!(
            known.contains(&key.as_str()),
            "{place}: `{key}` is not checked"
        );
    }
    if let Some(constant) = schema.get("const").filter(|constant| *constant != value) {
        found.push(format!("{place}: {value} is not {constant}"));
    }
    if let Some(words) = schema.get("enum").and_then(Value::as_array)
        && !words.contains(value)
    {
        found.push(format!("{place}: {value} is not in {words:?}"));
    }
    let types = match schema.get("type") {
        Some(Value::Array(types)) => types.iter().filter_map(Value::as_str).collect(),
        Some(Value::String(kind)) => vec![kind.as_str()],
        _ => Vec::new(),
    };
    if !types.is_empty() && !types.iter().any(|kind| is_of(kind, value)) {
        found.push(format!("{place}: {value} is no {types:?}"));
    }
    if let Value::Array(items) = value
        && let Some(of_items) = schema.get("items")
    {
        for (k, item) in items.iter().enumerate() {
            walk(of_items, item, &format!("{place}[{k}]"), found);
        }
    }
    let Value::Object(members) = value else {
        return;
    };
    for name in schema["required"].as_array().into_iter().flatten() {
        let name = name.as_str().expect("names are strings");
        if !members.contains_key(name) {
            found.push(format!("{place}: `{name}` is missing"));
        }
    }
    for (name, member) in members {
        let place = format!("{place}.{name}");
        match (&schema["properties"][name], &schema["additionalProperties"]) {
            (Value::Null, Value::Bool(false)) => found.push(format!("{place}: not in the schema")),
            (Value::Null, of_others) => walk(of_others, member, &place, found),
            (of_it, _) => walk(of_it, member, &place, found),
        }
    }
}

fn is_of(kind: &str, value: &Value) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("unknown type {other}"),
    }
}

#[test]
fn a_schema_refuses_wrong_missing_and_unknown_keys() {
    let fit = schema("fit");
    let sound = serde_json::json!({
        "format": "sinew-fit/1", "parameters": {}, "signals": {}, "warnings": [], "checks": [],
        "steps": 3, "seconds": 0.5,
    });
    assert_eq!(violations(&fit, &sound), [""; 0]);
    let broken = |change: &dyn Fn(&mut Value)| {
        let mut document = sound.clone();
        change(&mut document);
        violations(&fit, &document).len()
    };
    assert_eq!(broken(&|d| d["steps"] = "three".into()), 1);
    assert_eq!(broken(&|d| d["format"] = "sinew-fit/2".into()), 1);
    assert_eq!(broken(&|d| d["more"] = 1.into()), 1);
    assert_eq!(
        broken(&|d| d["parameters"]["a.b"] = serde_json::json!({})),
        6
    );
}
