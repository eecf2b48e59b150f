//! Generates the JSON Schemas in the folder `schemas` from the types that read the files.

use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use schemars::{JsonSchema, Schema};
use serde_json::Value;

use crate::{FileKind, MotorBench, Scenario, Study, Vehicle};

impl FileKind {
    /// The schema that [`FileKind::schema`] has as text, from the types.
    ///
    /// ```
    /// let schema = omni_config::FileKind::Vehicle.generated_schema();
    /// let mass = &schema["$defs"]["Body"]["properties"]["mass_kg"];
    /// assert_eq!((mass["minimum"].as_f64(), mass["maximum"].as_f64()), (Some(0.001), Some(10000.0)));
    /// assert_eq!(mass["description"], "Mass [kg], 0.001 to 10000.");
    /// ```
    #[must_use]
    pub fn generated_schema(self) -> Value {
        match self {
            Self::Vehicle => of::<Vehicle>(),
            Self::Scenario => of::<Scenario>(),
            Self::Experiment => of::<MotorBench>(),
            Self::Study => of::<Study>(),
        }
    }
}

fn of<T: JsonSchema>() -> Value {
    SchemaSettings::draft2020_12()
        .with_transform(Plain)
        .into_generator()
        .into_root_schema_for::<T>()
        .into()
}

/// Details of Rust are removed from the schema: links in descriptions, `null` (TOML has none), formats of numbers. No
/// table accepts unknown keys (the kinds of a tagged enum read theirs by way of a mirror, which the derive does not
/// see).
#[derive(Clone)]
struct Plain;

impl Transform for Plain {
    fn transform(&mut self, schema: &mut Schema) {
        transform_subschemas(self, schema);
        if let Some(Value::String(text)) = schema.get_mut("description") {
            *text = plain(text);
        }
        schema.remove("format");
        if schema.get("properties").is_some() {
            schema.insert("additionalProperties".into(), false.into());
        }
        if schema.get("default").is_some_and(Value::is_null) {
            schema.remove("default");
        }
        if let Some(Value::Array(types)) = schema.get_mut("type") {
            types.retain(|t| t != "null");
            if let [one] = types.as_slice() {
                let one = one.clone();
                schema.insert("type".into(), one);
            }
        }
        // `anyOf: [{$ref}, null]`, an optional table.
        if let Some(Value::Array(any)) = schema.get_mut("anyOf") {
            any.retain(|each| each["type"] != "null");
            if let [Value::Object(one)] = any.as_slice() {
                let one = one.clone();
                schema.remove("anyOf");
                for (key, value) in one {
                    schema.insert(key, value);
                }
            }
        }
    }
}

/// A doc comment as plain text, in one line and without examples: brackets of units as they are, links by their names.
fn plain(text: &str) -> String {
    // Examples are for programs.
    let text = text.split("```").next().unwrap_or_default();
    let mut words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    while let Some((before, link)) = words.split_once("[`") {
        let Some((name, after)) = link.split_once("`]") else {
            break;
        };
        let after = match after.split_once(')') {
            Some((_, rest)) if after.starts_with('(') => rest,
            _ => after,
        };
        words = format!("{before}{}{after}", name.rsplit("::").next().unwrap_or(name));
    }
    words.replace("\\[", "[").replace("\\]", "]")
}
