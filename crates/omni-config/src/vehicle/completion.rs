//! Optional keys and short forms of a vehicle file, written out before the file is read.

use std::f64::consts::{FRAC_PI_2, PI};

use toml::{Table, Value};

use super::short_forms::write_out;
use crate::Error;
use crate::digits::digits;
use crate::load::Source;
use crate::ranges::{MASS_KG, Range, within};

/// A key, and what is wrong with its value.
type Refusal = (String, String);

/// A number that is written out under other keys.
pub(crate) struct Number {
    key: &'static str,
    range: Range,
    #[cfg_attr(
        not(feature = "schema"),
        expect(dead_code, reason = "only the schema shows it")
    )]
    description: &'static str,
}

const fn number_in(key: &'static str, [min, max]: [f64; 2], description: &'static str) -> Number {
    Number {
        key,
        range: Range { min, max },
        description,
    }
}

const TOTAL_MASS: Number = number_in(
    "total_mass_kg",
    [MASS_KG.min, MASS_KG.max],
    "Mass of the whole vehicle [kg], 0.001 to 10000, as a scale gives it: the base has what is left of it.",
);
const ROLLER_ANGLE: Number = number_in(
    "roller_angle_deg",
    [-85.9, 85.9],
    "The same as roller_angle_rad in degrees, -85.9 to 85.9.",
);
const KG_CM: Number = number_in(
    "stall_torque_kg_cm",
    [2e-5, 1e7],
    "Torque at rest [kg.cm], 2e-5 to 1e7, instead of stall_torque_n_m.",
);
const OZ_IN: Number = number_in(
    "stall_torque_oz_in",
    [2e-4, 1e8],
    "Torque at rest [oz.in], 2e-4 to 1e8, instead of stall_torque_n_m.",
);
const ROTOR: Number = number_in(
    "rotor_inertia_kg_m2",
    [1e-12, 1e3],
    "Inertia of a motor's rotor [kg.m^2], 1e-12 to 1000, for wheels that leave out theirs; with gear_ratio.",
);
const RATIO: Number = number_in(
    "gear_ratio",
    [1e-3, 1e4],
    "Turns of the rotor per turn of the wheel, 0.001 to 1e4, for rotor_inertia_kg_m2.",
);
/// Time in which the default damping of a hinge stops its load \[s\], if nothing else moves it.
const HINGE_STOPS_S: f64 = 0.2;

/// Writes out what is short, and says what was assumed for what is left out.
pub(super) fn complete(source: &Source, table: &mut Table) -> Result<Vec<String>, Error> {
    if table.contains_key("mass_kg") {
        let message = "unknown field `mass_kg`; use `total_mass_kg`, or `body.0.mass_kg` of the first body";
        return Err(source.refuse("mass_kg", message));
    }
    write_out(source, table)?;
    let mut notes = Vec::new();
    let rotor_kg_m2 = match table.get_mut("motor") {
        Some(Value::Table(motor)) => {
            // 1 kg of force is 9.80665 N, 1 oz.in is 0.0070615518 N.m.
            in_unit_read(source, "motor", motor, &KG_CM, ("stall_torque_n_m", 0.098_066_5))?;
            in_unit_read(
                source,
                "motor",
                motor,
                &OZ_IN,
                ("stall_torque_n_m", 0.007_061_551_8),
            )?;
            rotor(source, motor)?
        }
        _ => None,
    };
    wheels(source, table, rotor_kg_m2, &mut notes)?;
    bodies(table, &mut notes);
    hinges(table, &mut notes);
    total_mass(source, table, &mut notes)?;
    Ok(notes)
}

impl Number {
    /// Takes it out of a table, if it is there.
    fn taken(&self, source: &Source, place: &str, keys: &mut Table) -> Result<Option<f64>, Error> {
        let Some(value) = keys.remove(self.key) else {
            return Ok(None);
        };
        let key = if place.is_empty() {
            self.key.to_owned()
        } else {
            format!("{place}.{}", self.key)
        };
        let refused = |what: String| source.refuse(key.clone(), what);
        let given = number(&value).ok_or_else(|| refused(format!("{value}, allowed: a number")))?;
        within(self.range)(&given, &()).map_err(|error| refused(error.to_string()))?;
        Ok(Some(given))
    }
}

/// Puts what is given in another unit under the key that is read, whose unit is so many of it.
fn in_unit_read(
    source: &Source,
    place: &str,
    keys: &mut Table,
    other: &Number,
    (read, factor): (&str, f64),
) -> Result<(), Error> {
    if let Some(given) = other.taken(source, place, keys)? {
        if keys.contains_key(read) {
            let message = format!("beside {read}, allowed: one of the two");
            return Err(source.refuse(format!("{place}.{}", other.key), message));
        }
        keys.insert(read.into(), (given * factor).into());
    }
    Ok(())
}

/// Inertia that a motor's rotor adds to its wheel \[kg.m^2\].
fn rotor(source: &Source, motor: &mut Table) -> Result<Option<f64>, Error> {
    let rotor_kg_m2 = ROTOR.taken(source, "motor", motor)?;
    let ratio = RATIO.taken(source, "motor", motor)?;
    let missing = match (rotor_kg_m2, ratio) {
        (Some(rotor_kg_m2), Some(ratio)) => return Ok(Some(rotor_kg_m2 * ratio * ratio)),
        (None, None) => return Ok(None),
        (Some(_), None) => RATIO.key,
        (None, Some(_)) => ROTOR.key,
    };
    let message = format!("missing, allowed: {} and {} together", ROTOR.key, RATIO.key);
    Err(source.refuse(format!("motor.{missing}"), message))
}

/// Angles in degrees, a ball where no contact is given, the inertia of a solid wheel where none is.
fn wheels(
    source: &Source,
    table: &mut Table,
    rotor_kg_m2: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<(), Error> {
    let (mut assumed, mut largest_kg_m2) = (0_usize, 0.0_f64);
    for (i, wheel) in tables(table, "wheel").enumerate() {
        let place = format!("wheel[{i}]");
        other_units(wheel).map_err(|(key, message)| source.refuse(format!("{place}.{key}"), message))?;
        in_unit_read(
            source,
            &place,
            wheel,
            &ROLLER_ANGLE,
            ("roller_angle_rad", PI / 180.0),
        )?;
        if !wheel.contains_key("contact") {
            let ball = Table::from_iter([("kind".to_owned(), Value::from("ball"))]);
            wheel.insert("contact".into(), Value::Table(ball));
        }
        if wheel.contains_key("inertia_kg_m2") {
            continue;
        }
        let numbers = ["mass_kg", "radius_m"].map(|key| wheel.get(key).and_then(number));
        if let [Some(mass_kg), Some(radius_m)] = numbers {
            let inertia_kg_m2 = mass_kg * radius_m * radius_m / 2.0 + rotor_kg_m2.unwrap_or(0.0);
            wheel.insert("inertia_kg_m2".into(), inertia_kg_m2.into());
            assumed += 1;
            largest_kg_m2 = largest_kg_m2.max(inertia_kg_m2);
        }
    }
    if assumed > 0 {
        let with = if rotor_kg_m2.is_some() {
            "that of a solid wheel and its rotor"
        } else {
            "that of a solid wheel; a rotor behind a gear adds to it (motor.rotor_inertia_kg_m2, motor.gear_ratio)"
        };
        let largest = digits(largest_kg_m2);
        notes.push(format!(
            "{assumed} wheels without inertia_kg_m2: up to {largest} kg.m2, {with}"
        ));
    } else if rotor_kg_m2.is_some() {
        let message = "no use, allowed: where a wheel leaves out inertia_kg_m2";
        return Err(source.refuse("motor.rotor_inertia_kg_m2", message));
    }
    Ok(())
}

/// A wheel in millimetres, in degrees or by its diameter.
fn other_units(wheel: &Table) -> Result<(), Refusal> {
    if let Some(diameter_m) = wheel.get("diameter_m").and_then(number) {
        let message = format!("allowed: radius_m = {}, half of it", digits(diameter_m / 2.0));
        return Err(("diameter_m".into(), message));
    }
    let places = numbers(wheel, "position_m")
        .into_iter()
        .map(|length| ("position_m", length, 100.0));
    let radius = wheel
        .get("radius_m")
        .and_then(number)
        .map(|radius| ("radius_m", radius, 10.0));
    for (key, length, most_m) in places.chain(radius) {
        if length.abs() > most_m && length.is_finite() {
            let metres = length / 1000.0;
            let message = format!("{length}, allowed: metres; {length} mm are {metres}");
            return Err((key.into(), message));
        }
    }
    if let Some(angle) = wheel.get("roller_angle_rad").and_then(number)
        && angle.abs() > FRAC_PI_2
        && angle.is_finite()
    {
        let message = format!("{angle}, allowed: -1.5 to 1.5; for degrees write roller_angle_deg = {angle}");
        return Err(("roller_angle_rad".into(), message));
    }
    Ok(())
}

/// Centres of mass that are left out: half way up the box, between the wheels that the body carries.
fn bodies(table: &mut Table, notes: &mut Vec<String>) {
    let carried: Vec<(Option<Value>, Vec<f64>)> = tables(table, "wheel")
        .map(|wheel| (wheel.get("body").cloned(), numbers(wheel, "position_m")))
        .filter(|(_, place)| place.len() == 2)
        .collect();
    for body in tables(table, "body").filter(|body| !body.contains_key("com_m")) {
        let [_, _, height_m] = numbers(body, "inertia_box_m")[..] else {
            continue;
        };
        let name = body.get("name").cloned();
        let own: Vec<_> = carried.iter().filter(|(carrier, _)| *carrier == name).collect();
        let mean =
            |axis: usize| own.iter().map(|(_, place)| place[axis]).sum::<f64>() / own.len().max(1) as f64;
        let com_m = [mean(0), mean(1), height_m / 2.0];
        notes.push(format!(
            "body {} without com_m: [{}], half way up its box",
            named(body),
            com_m.map(digits).join(", ")
        ));
        body.insert("com_m".into(), Value::Array(com_m.map(Value::from).into()));
    }
}

/// Damping of hinges that is left out: what the hinge carries stops in some tenths of a second.
fn hinges(table: &mut Table, notes: &mut Vec<String>) {
    let inertias: Vec<(Option<Value>, Option<f64>)> = tables(table, "body")
        .map(|body| {
            let square: f64 = numbers(body, "inertia_box_m")
                .iter()
                .map(|edge| edge * edge)
                .sum();
            let mass_kg = body.get("mass_kg").and_then(number);
            (
                body.get("name").cloned(),
                mass_kg.map(|mass_kg| mass_kg * square / 12.0),
            )
        })
        .collect();
    for hinge in tables(table, "hinge").filter(|hinge| !hinge.contains_key("damping_n_m_s_rad")) {
        let child = hinge.get("child").cloned();
        let inertia = inertias.iter().find(|(name, _)| *name == child);
        if let Some((_, Some(inertia_kg_m2))) = inertia {
            let damping = inertia_kg_m2 / HINGE_STOPS_S;
            notes.push(format!(
                "hinge {} without damping_n_m_s_rad: {}, which stops what it carries in {HINGE_STOPS_S} s",
                named(hinge),
                digits(damping)
            ));
            hinge.insert("damping_n_m_s_rad".into(), damping.into());
        }
    }
}

/// The mass of the whole vehicle, as weighed: the base has the remaining mass.
fn total_mass(source: &Source, table: &mut Table, notes: &mut Vec<String>) -> Result<(), Error> {
    let Some(total_kg) = TOTAL_MASS.taken(source, "", table)? else {
        return Ok(());
    };
    let mut others_kg = 0.0;
    for (kind, first) in [("body", 1), ("wheel", 0)] {
        for part in tables(table, kind).skip(first) {
            others_kg += part.get("mass_kg").and_then(number).unwrap_or(0.0);
        }
    }
    let base_kg = total_kg - others_kg;
    if !(base_kg > 0.0 && base_kg.is_finite()) {
        let others = digits(others_kg);
        let message = format!("{total_kg}, allowed: more than the {others} kg of wheels and other bodies");
        return Err(source.refuse(TOTAL_MASS.key, message));
    }
    if let Some(base) = tables(table, "body").next() {
        base.insert("mass_kg".into(), base_kg.into());
        let (name, mass) = (named(base), digits(base_kg));
        notes.push(format!(
            "body {name} has what is left of total_mass_kg: {mass} kg"
        ));
    }
    Ok(())
}

/// Tables of a list; the reader rejects other values.
fn tables<'a>(table: &'a mut Table, key: &str) -> impl Iterator<Item = &'a mut Table> {
    let list = table.get_mut(key).and_then(Value::as_array_mut);
    list.into_iter().flatten().filter_map(Value::as_table_mut)
}

/// The name of a part, as messages have it.
fn named(part: &Table) -> String {
    part.get("name").map_or_else(String::new, Value::to_string)
}

/// The numbers of a list; none if there is no list.
fn numbers(keys: &Table, key: &str) -> Vec<f64> {
    let list = keys.get(key).and_then(Value::as_array);
    list.into_iter().flatten().filter_map(number).collect()
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

/// What editors are to know of it: keys that may be there besides, and those that may be left out.
#[cfg(feature = "schema")]
pub(crate) mod schema {
    use schemars::{JsonSchema, Schema, SchemaGenerator};
    use serde_json::{Value, json};

    use super::{KG_CM, Number, OZ_IN, RATIO, ROLLER_ANGLE, ROTOR, TOTAL_MASS};
    use crate::vehicle::short_forms::{Mecanum4, Omni3};

    pub(crate) fn vehicle(schema: &mut Schema) {
        let form = |schema: Schema| Value::from(schema);
        let generator = &mut SchemaGenerator::default();
        let forms = [
            ("mecanum4", form(Mecanum4::json_schema(generator))),
            ("omni3", form(Omni3::json_schema(generator))),
        ];
        also(schema, [&[number(&TOTAL_MASS)], &forms[..]].concat(), &["wheel"]);
    }

    pub(crate) fn body(schema: &mut Schema) {
        also(schema, Vec::new(), &["mass_kg", "com_m"]);
    }

    pub(crate) fn hinge(schema: &mut Schema) {
        also(schema, Vec::new(), &["damping_n_m_s_rad"]);
    }

    pub(crate) fn wheel(schema: &mut Schema) {
        also(schema, vec![number(&ROLLER_ANGLE)], &["inertia_kg_m2", "contact"]);
    }

    pub(crate) fn motor(schema: &mut Schema) {
        let numbers = [&KG_CM, &OZ_IN, &ROTOR, &RATIO].map(number);
        also(schema, numbers.into(), &["stall_torque_n_m"]);
    }

    fn number(number: &Number) -> (&'static str, Value) {
        let (least, most) = (number.range.min, number.range.max);
        let schema = json!({
            "type": "number", "minimum": least, "maximum": most, "description": number.description
        });
        (number.key, schema)
    }

    /// Adds keys, and requires others no longer.
    fn also(schema: &mut Schema, keys: Vec<(&str, Value)>, left_out: &[&str]) {
        if let Some(Value::Object(properties)) = schema.get_mut("properties") {
            properties.extend(keys.into_iter().map(|(key, value)| (key.to_owned(), value)));
        }
        if let Some(Value::Array(required)) = schema.get_mut("required") {
            required.retain(|key| !left_out.iter().any(|left_out| key == left_out));
        }
    }
}

#[cfg(test)]
mod tests;
