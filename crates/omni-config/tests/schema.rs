//! The JSON Schemas say what the loader does, and no more: every bound, every name, every key.

use omni_config::{FileKind, MotorBench, Override, Scenario, Source, Vehicle};
use serde_json::Value;

/// A file of that kind in which every table there is stands.
fn whole_file(kind: FileKind) -> String {
    match kind {
        FileKind::Vehicle => {
            // The paper's vehicle has limits and gains; what it lacks is a coupling.
            let text = FileKind::Vehicle.template("chugo7").expect("built in");
            let coupling = "[[coupling]]\nname = \"c\"\nhinge_a = \"pitch\"\nhinge_b = \"roll\"\n";
            format!("{text}\n{coupling}")
        }
        FileKind::Scenario => {
            // Traction control takes no [drive].
            let step = FileKind::Scenario.template("step").expect("built in");
            let text = step.replace("policy = \"traction\"", "policy = \"scale_references\"");
            let rest = r#"
[[command.then]]
at_s = 1.0
vx_m_s = 0.0
vy_m_s = 0.0
wz_rad_s = 0.0

[sensors]
encoder_counts = 360

[heading_hold]
gain_per_s = 1.0
limit_rad_s = 1.0

[drive]
command_point_m = [0.0, 0.0]

[drive.slip]

[drive.faults]

[drive.noise]

[[block]]
x_m = [2.0, 2.1]
y_m = [-1.0, 1.0]
height_m = 0.03

[[friction_patch]]
x_m = [0.0, 1.0]
y_m = [0.0, 1.0]
friction = 0.1
velocity_m_s = [0.0, 0.0]

[[fault]]
kind = "wheel_lost"
wheel = "1"
from_s = 0.0
"#;
            format!("{text}{rest}")
        }
        FileKind::Experiment => FileKind::Experiment
            .template("motor_bench")
            .expect("built in")
            .to_owned(),
        _ => unreachable!("not among KINDS: most values of a study are those of any key"),
    }
}

#[test]
fn the_schemas_in_the_package_are_those_of_the_types() {
    for kind in [
        FileKind::Vehicle,
        FileKind::Scenario,
        FileKind::Experiment,
        FileKind::Study,
    ] {
        let text = serde_json::to_string_pretty(&kind.generated_schema()).expect("plain data") + "\n";
        if std::env::var_os("OMNISTEP_WRITE_SCHEMAS").is_some() {
            let path = format!(
                "{}/schemas/{}.schema.json",
                env!("CARGO_MANIFEST_DIR"),
                kind.name()
            );
            std::fs::write(path, &text).expect("written");
        }
        assert!(
            text == kind.schema(),
            "{} files have another schema by now: make generated",
            kind.name()
        );
    }
}

/// What the loader says of the whole file with one key replaced.
fn load(kind: FileKind, overrides: &[Override]) -> Result<(), String> {
    let source = Source::text("file", whole_file(kind));
    match kind {
        FileKind::Vehicle => Vehicle::from_source(&source, overrides).map(|_| ()),
        FileKind::Scenario => Scenario::from_source(&source, overrides).map(|_| ()),
        FileKind::Experiment => MotorBench::from_source(&source, overrides).map(|_| ()),
        _ => unreachable!("not among KINDS"),
    }
    .map_err(|error| error.to_string())
}

/// A place in a file, its schema, and what must be put elsewhere for the place to be there.
struct Place {
    key: String,
    schema: Value,
    before: Vec<Override>,
}

/// Every place of the files of a kind, tables and lists included.
fn places(kind: FileKind) -> Vec<Place> {
    let root: Value = serde_json::from_str(kind.schema()).expect("JSON");
    let mut found = Vec::new();
    let top = Place {
        key: String::new(),
        schema: root.clone(),
        before: Vec::new(),
    };
    visit(&root, top, &mut found);
    found
}

/// A command that has waypoints instead of a twist.
const A_PATH: &str = "command={ path = [{ x_m = 1.0, y_m = 0.0 }] }";

/// Wheels in short.
const FORMS: [(&str, &str); 2] = [
    (
        "mecanum4",
        "mecanum4={ wheelbase_m = 0.3, track_m = 0.3, radius_m = 0.05, wheel_mass_kg = 0.4 }",
    ),
    (
        "omni3",
        "omni3={ lever_m = 0.2, radius_m = 0.05, wheel_mass_kg = 0.4 }",
    ),
];

fn visit(root: &Value, mut place: Place, found: &mut Vec<Place>) {
    if let Some(name) = place.schema["$ref"]
        .as_str()
        .and_then(|r| r.strip_prefix("#/$defs/"))
    {
        place.schema = root["$defs"][name].clone();
    }
    let inside = |key: &str, schema: &Value, before: &[Override]| Place {
        key: if place.key.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", place.key)
        },
        schema: schema.clone(),
        before: before.to_vec(),
    };
    if let Some(properties) = place.schema["properties"].as_object() {
        for (key, schema) in properties {
            let form = FORMS.iter().filter(|(form, _)| form == key);
            let form = form.map(|(_, whole)| Override::parse(whole).expect("KEY=VALUE"));
            let before: Vec<_> = place.before.iter().cloned().chain(form).collect();
            visit(root, inside(key, schema, &before), found);
        }
    }
    if place.schema["items"].is_object() {
        let mut before = place.before.clone();
        if place.key == "command.path" {
            // Instead of a twist.
            before.push(Override::parse(A_PATH).expect("KEY=VALUE"));
        }
        visit(root, inside("0", &place.schema["items"], &before), found);
    }
    for variant in ["oneOf", "anyOf"]
        .iter()
        .filter_map(|key| place.schema[key].as_array())
        .flatten()
        // One that only says which keys there must be is the same place.
        .filter(|variant| !(variant["required"].is_array() && variant["properties"].is_null()))
    {
        let mut before = place.before.clone();
        if let Some(properties) = variant["properties"].as_object() {
            // A kind of its own: the table as that kind has it, every number the least allowed.
            let mut table = toml::Table::new();
            for (key, schema) in properties {
                let value = match (&schema["const"], schema["minimum"].as_f64(), key.as_str()) {
                    (Value::String(kind), _, _) => toml::Value::from(kind.as_str()),
                    (_, Some(least), _) if schema["type"] == "integer" => toml::Value::from(least as i64),
                    (_, Some(least), _) => toml::Value::from(least),
                    (_, _, "wheel") => toml::Value::from("1"),
                    (_, _, "body") => toml::Value::from("front"),
                    (_, _, "image") => toml::Value::from("hills"),
                    (_, _, "at_m") => toml::Value::from(vec![0.0; 3]),
                    // A law with its keys inside.
                    _ if schema["properties"].is_object() => {
                        let keys = schema["properties"].as_object().into_iter().flatten();
                        let least = |schema: &Value| schema["minimum"].as_f64().expect("a number");
                        toml::Value::Table(
                            keys.map(|(key, schema)| (key.clone(), least(schema).into()))
                                .collect(),
                        )
                    }
                    _ => panic!("{}.{key}: this test cannot make a value for {schema}", place.key),
                };
                table.insert(key.clone(), value);
            }
            before.push(Override::new(place.key.clone(), table));
        }
        let place = Place {
            key: place.key.clone(),
            schema: variant.clone(),
            before,
        };
        visit(root, place, found);
    }
    found.push(place);
}

const KINDS: [FileKind; 3] = [FileKind::Vehicle, FileKind::Scenario, FileKind::Experiment];

/// As messages write it: `wheel[0].radius_m`; components of a list of numbers are named by the list.
fn shown(key: &str) -> String {
    let mut text = String::new();
    for part in key.split('.') {
        if part.bytes().all(|b| b.is_ascii_digit()) {
            text.push_str(&format!("[{part}]"));
        } else {
            text.push_str(if text.is_empty() { "" } else { "." });
            text.push_str(part);
        }
    }
    text
}

/// The vehicle inside a scenario is checked with the vehicles.
fn own(kind: FileKind, place: &Place) -> bool {
    !(kind == FileKind::Scenario && place.key.starts_with("vehicle"))
}

#[test]
fn every_number_of_a_schema_has_bounds_and_the_loader_has_the_same() {
    let mut numbers = 0;
    for kind in KINDS {
        for place in places(kind).into_iter().filter(|p| own(kind, p)) {
            let whole = place.schema["type"] == "integer";
            if !whole && place.schema["type"] != "number" {
                continue;
            }
            if place.key.ends_with("seed") {
                continue; // any whole number of its type
            }
            let bound = |name: &str| {
                place.schema[name]
                    .as_f64()
                    .unwrap_or_else(|| panic!("{}: its schema has no {name}: {}", place.key, place.schema))
            };
            let (least, most) = (bound("minimum"), bound("maximum"));
            let with = |value: f64| {
                let value = if whole {
                    toml::Value::from(value as i64)
                } else {
                    toml::Value::from(value)
                };
                let mut overrides = place.before.clone();
                overrides.push(Override::new(place.key.clone(), value));
                load(kind, &overrides)
            };
            let list = place
                .key
                .rsplit_once('.')
                .filter(|(_, last)| *last == "0")
                .map(|(list, _)| list);
            let key = shown(list.unwrap_or(&place.key));
            let beyond = if whole {
                [least - 1.0, most + 1.0]
            } else {
                [least.next_down(), most.next_up()]
            };
            let mut allowed = String::new();
            for value in beyond.into_iter().chain((!whole).then_some(f64::NAN)) {
                let said = with(value).expect_err(&format!("{key} = {value} is beyond {least} to {most}"));
                assert!(said.starts_with(&format!("file: {key}: ")), "{value}: {said}");
                allowed = said
                    .rsplit_once("allowed: ")
                    .map_or(allowed, |(_, range)| range.to_owned());
            }
            for value in [least, most] {
                // Other checks may mind; the range does not.
                if let Err(said) = with(value) {
                    assert!(
                        !said.ends_with(&allowed),
                        "{key} = {value} is within {least} to {most}: {said}"
                    );
                }
            }
            numbers += 1;
        }
    }
    assert!(numbers >= 55, "{numbers} numbers"); // that the walk went everywhere
}

#[test]
fn every_table_refuses_a_key_that_its_schema_does_not_know() {
    let mut tables = 0;
    for kind in KINDS {
        for place in places(kind).into_iter().filter(|p| own(kind, p)) {
            if !place.schema["properties"].is_object() {
                continue;
            }
            assert_eq!(place.schema["additionalProperties"], false, "{}", place.key);
            // A law with its keys inside is a table of one key, its name.
            let of_law = |schema: &Value| schema["properties"].is_object() || schema["$ref"].is_string();
            let mut laws = ["control.saturation", "control.anti_windup"].into_iter();
            if laws.any(|law| place.key == law) {
                let properties = place.schema["properties"].as_object().expect("a table");
                assert!(
                    properties.len() == 1 && properties.values().all(of_law),
                    "{}",
                    place.key
                );
                continue;
            }
            let dot = if place.key.is_empty() { "" } else { "." };
            let mut overrides = place.before.clone();
            overrides.push(Override::new(format!("{}{dot}nonsense", place.key), 1));
            let said = load(kind, &overrides).expect_err("an unknown key");
            assert!(said.contains("unknown field `nonsense`"), "{}: {said}", place.key);
            tables += 1;
        }
    }
    assert!(tables >= 15, "{tables} tables");
}

#[test]
fn words_and_lists_that_a_schema_refuses_are_refused_by_the_loader() {
    let mut words = 0;
    for kind in KINDS {
        for place in places(kind).into_iter().filter(|p| own(kind, p)) {
            let closed = ["pattern", "enum", "const"]
                .iter()
                .any(|key| !place.schema[key].is_null());
            if closed && place.schema["type"] == "string" {
                let mut overrides = place.before.clone();
                overrides.push(Override::new(place.key.clone(), "not that!"));
                let said = load(kind, &overrides).expect_err("a word that is not allowed");
                assert!(said.contains("not that!"), "{}: {said}", place.key);
                words += 1;
            }
            // Lists of tables; lists of numbers have a length of their own type.
            let most = place.schema["maxItems"]
                .as_u64()
                .filter(|_| place.schema["items"]["$ref"].is_string());
            if let Some(most) = most {
                let least = place.schema["minItems"].as_u64().unwrap_or(0);
                let file = toml::Value::Table(whole_file(kind).parse().expect("TOML"));
                let (item, before) = if place.key == "command.path" {
                    let waypoint: toml::Table = "x_m = 1.0\ny_m = 0.0".parse().expect("TOML");
                    (toml::Value::Table(waypoint), Override::parse(A_PATH).ok())
                } else {
                    let list = place.key.split('.').fold(&file, |table, key| &table[key]);
                    (list[0].clone(), None)
                };
                for count in [most + 1].into_iter().chain(least.checked_sub(1)) {
                    let items = vec![item.clone(); count as usize];
                    let overrides: Vec<_> = before
                        .clone()
                        .into_iter()
                        .chain([Override::new(place.key.clone(), items)])
                        .collect();
                    let said = load(kind, &overrides).expect_err("so many");
                    let expected =
                        format!("file: {}: {count} entries, allowed: {least} to {most}", place.key);
                    assert!(said.starts_with(&expected), "{said}");
                }
            }
        }
    }
    assert!(words >= 15, "{words} words");
}

#[test]
fn every_key_is_described_in_plain_words() {
    for kind in KINDS {
        for place in places(kind).into_iter().filter(|p| !p.key.is_empty()) {
            let last = place.key.rsplit('.').next().unwrap_or_default();
            let parent = place.key.strip_suffix(last).unwrap_or_default();
            let is_law = ["control.saturation.", "control.anti_windup."].contains(&parent);
            if last == "kind" || last == "0" || last == "vehicle" || is_law {
                continue; // kinds and laws are described, the elements by their list
            }
            let Some(text) = place.schema["description"].as_str() else {
                panic!("{} has no description", place.key)
            };
            assert!(
                !text.contains("::") && !text.contains("\\[") && !text.contains('\n'),
                "{text}"
            );
        }
    }
}

#[test]
fn a_description_that_says_a_range_says_that_of_its_schema() {
    // Further bounds depend on other keys, or hold beside a single value.
    let more_is_said = ["bandwidth_rad_s", "sweep_rad", "encoder_counts"];
    let number = |word: &str| {
        word.trim_end_matches(['.', ',', ';', ':', ')'])
            .parse::<f64>()
            .ok()
    };
    let mut ranges = 0;
    for place in KINDS.into_iter().flat_map(places) {
        let bounds = if place.schema["items"].is_object() {
            &place.schema["items"]
        } else {
            &place.schema
        };
        let (Some(least), Some(most)) = (bounds["minimum"].as_f64(), bounds["maximum"].as_f64()) else {
            continue;
        };
        let words: Vec<_> = place.schema["description"]
            .as_str()
            .unwrap_or_default()
            .split(' ')
            .collect();
        let said: Vec<_> = words
            .windows(3)
            .filter(|three| three[1] == "to")
            .filter_map(|three| Some((number(three[0])?, number(three[2])?)))
            .collect();
        if said.is_empty() || more_is_said.iter().any(|key| place.key.ends_with(key)) {
            continue;
        }
        assert!(
            said.contains(&(least, most)),
            "{}: {said:?}, {least} to {most}",
            place.key
        );
        ranges += 1;
    }
    assert!(ranges >= 150, "{ranges} ranges");
}
