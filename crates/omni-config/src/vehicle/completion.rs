//! What a vehicle file may leave out or say in other words, written out before the file is read.

use std::f64::consts::{FRAC_PI_2, PI};

use toml::{Table, Value};

pub(super) use super::short_forms::write_out;
use crate::Error;
use crate::derived_gains::digits;
use crate::load::Source;
use crate::ranges::{MASS_KG, Range, within};

/// A key, and what is wrong with its value.
type Refusal = (String, String);

/// A number that is written out under other keys.
pub(crate) struct Number {
    key: &'static str,
    range: Range,
    #[cfg_attr(not(feature = "schema"), expect(dead_code))]
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
/// The damping of a hinge whose file gives none takes so long to stop what it carries \[s\], where nothing else moves it.
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

/// What a motor's rotor adds to the inertia of its wheel \[kg.m^2\].
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
        let [_, _, height_m] = numbers(body, "box_m")[..] else {
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
            let square: f64 = numbers(body, "box_m").iter().map(|edge| edge * edge).sum();
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

/// The mass of the whole vehicle, as a scale gives it: the base has what is left.
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

/// Tables of a list; what is no table is for the reader to refuse.
fn tables<'a>(table: &'a mut Table, key: &str) -> impl Iterator<Item = &'a mut Table> {
    let list = table.get_mut(key).and_then(Value::as_array_mut);
    list.into_iter().flatten().filter_map(Value::as_table_mut)
}

/// The name of a part, as messages have it.
fn named(part: &Table) -> String {
    part.get("name").map_or_else(String::new, Value::to_string)
}

/// The numbers of a list; none where there is no list.
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
mod tests {
    use crate::{FileKind, Override, Source, Vehicle};

    const SHORT: &str = r#"
schema_version = 1
name = "short"
total_mass_kg = 8.8
[[body]]
name = "frame"
box_m = [0.4, 0.35, 0.12]
[motor]
stall_torque_kg_cm = 24.3
no_load_rpm = 312
[mecanum4]
wheelbase_m = 0.3
track_m = 0.4
radius_m = 0.05
wheel_mass_kg = 0.4
"#;

    fn vehicle(text: &str, keys: &[&str]) -> Result<Vehicle, String> {
        let keys: Vec<_> = keys
            .iter()
            .map(|key| Override::parse(key).expect("a key"))
            .collect();
        Vehicle::from_source(&Source::text("short.toml", text), &keys).map_err(|error| error.to_string())
    }

    #[test]
    fn nine_numbers_describe_a_mecanum_base() {
        let short = vehicle(SHORT, &[]).expect("whole");
        let built_in = Vehicle::load("mecanum4").expect("built in");
        // The hands are those of the built-in one, whose rollers on the ground form a diamond.
        for (own, theirs) in short.wheel.iter().zip(&built_in.wheel) {
            assert_eq!(own.name, theirs.name);
            assert!((own.roller_angle_rad - theirs.roller_angle_rad).abs() < 1e-9);
            assert_eq!(
                own.position_m.map(f64::signum),
                theirs.position_m.map(f64::signum)
            );
            assert_eq!(own.position_m.map(f64::abs), [0.15, 0.2]);
            assert_eq!(own.inertia_kg_m2, 0.4 * 0.05 * 0.05 / 2.0);
        }
        assert!((short.motor.stall_torque_n_m - 2.383).abs() < 1e-3); // 24.3 kg.cm
        assert!((short.body[0].mass_kg - (8.8 - 4.0 * 0.4)).abs() < 1e-12);
        assert_eq!(short.body[0].com_m, [0.0, 0.0, 0.06]);
        assert_eq!(short.assumptions().len(), 3, "{:?}", short.assumptions());
        // What was assumed is written out: read again, nothing is left to assume.
        let written = toml::to_string(&short).expect("plain data");
        let again = vehicle(&written, &[]).expect("whole");
        assert_eq!(
            (again.assumptions().len(), &again.wheel, &again.body),
            (0, &short.wheel, &short.body)
        );
    }

    #[test]
    fn three_wheels_in_a_circle_are_those_of_the_built_in_vehicle() {
        let form =
            "[omni3]\nlever_m = 0.18\nradius_m = 0.05\nwheel_mass_kg = 0.4\nwheel_inertia_kg_m2 = 0.0007\n";
        let text = FileKind::Vehicle.template("omni3").expect("built in");
        let (before, _) = text.split_once("[[wheel]]").expect("it has wheels");
        let (short, whole) = (
            vehicle(&format!("{before}{form}"), &[]),
            Vehicle::load("omni3").expect("built in"),
        );
        for (own, theirs) in short.expect("whole").wheel.iter().zip(&whole.wheel) {
            let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-8 && (a[1] - b[1]).abs() < 1e-8;
            assert!(
                near(own.position_m, theirs.position_m)
                    && near(own.rolling_direction, theirs.rolling_direction)
            );
        }
    }

    #[test]
    fn a_rotor_behind_a_gear_adds_its_inertia_by_the_square_of_the_ratio() {
        let keys = ["motor.rotor_inertia_kg_m2=1e-6", "motor.gear_ratio=20"];
        let with = vehicle(SHORT, &keys).expect("whole");
        assert!((with.wheel[0].inertia_kg_m2 - (0.0005 + 1e-6 * 400.0)).abs() < 1e-12);
    }

    #[test]
    fn rollers_that_no_file_gives_leave_no_gaps() {
        for (name, text) in [
            ("short", SHORT),
            ("omni3", FileKind::Vehicle.template("omni3").expect("built in")),
        ] {
            let mut own = vehicle(text, &[]).expect("whole");
            own.rollers = None;
            for wheel in 0..own.wheel.len() {
                let built = own.rollers(wheel, crate::WheelModel::Rollers).expect("as usual");
                let radius_m = own.wheel[wheel].radius_m;
                // A full turn in steps of a tenth of a degree: the rim is round to a thousandth.
                let heights =
                    (0..3600).map(|tenth| built.axle_height_m(f64::from(tenth) * 1e-1_f64.to_radians()));
                let (least, most) = heights.fold((f64::INFINITY, 0.0_f64), |(least, most), h| {
                    (least.min(h), most.max(h))
                });
                assert!(
                    most - least < 1e-3 * radius_m && (most / radius_m - 1.0).abs() < 1e-3,
                    "{name}: {least} to {most}"
                );
            }
        }
    }

    #[test]
    fn a_wheel_of_a_short_form_is_set_as_one_that_is_written_out() {
        let set = vehicle(
            SHORT,
            &[
                "wheel.*.mass_kg=0.5",
                "mecanum4.radius_m=0.06",
                "wheel.1.radius_m=0.07",
            ],
        );
        let set = set.expect("whole");
        let sizes: Vec<_> = set
            .wheel
            .iter()
            .map(|wheel| (wheel.mass_kg, wheel.radius_m))
            .collect();
        assert_eq!(sizes, [(0.5, 0.06), (0.5, 0.07), (0.5, 0.06), (0.5, 0.06)]);
        // What is left of the total mass knows of it.
        assert!((set.body[0].mass_kg - (8.8 - 4.0 * 0.5)).abs() < 1e-12);
    }

    #[test]
    fn a_slip_of_a_key_that_is_written_out_is_answered_with_that_key() {
        let said = |key: &str| vehicle(SHORT, &[key]).expect_err("refused");
        for (key, meant) in [
            ("mecanum_4.track_m=1", "`mecanum4`"),
            ("total_mas_kg=3", "`total_mass_kg`"),
            ("motor.stall_torque_kgcm=3", "`stall_torque_kg_cm`"),
            ("wheel.*.roller_angle_degrees=45", "`roller_angle_deg`"),
        ] {
            let said = said(key);
            assert!(said.contains(&format!("(did you mean {meant}?)")), "{said}");
        }
        let said = said("colour=1");
        assert!(said.ends_with("`mecanum4`, `omni3`, `total_mass_kg`"), "{said}");
    }

    #[test]
    fn what_is_short_and_wrong_is_refused_by_its_key() {
        let refused = |text: &str, keys: &[&str]| vehicle(text, keys).expect_err("wrong");
        let with = |keys: &[&str]| refused(SHORT, keys);
        let starts = [
            (
                with(&["total_mass_kg=1"]),
                "short.toml: total_mass_kg: 1, allowed: more than the 1.6 kg of wheels and other bodies",
            ),
            (
                with(&["mass_kg=8"]),
                "short.toml: mass_kg: unknown field `mass_kg`; use `total_mass_kg`, or `body.0.mass_kg`",
            ),
            (
                with(&["motor.stall_torque_n_m=2"]),
                "short.toml: motor.stall_torque_kg_cm: beside stall_torque_n_m, allowed: one of the two",
            ),
            (
                with(&["motor.stall_torque_kg_cm=nan"]),
                "short.toml: motor.stall_torque_kg_cm: NaN",
            ),
            (
                with(&["mecanum4.mounting=Z"]),
                "short.toml: mecanum4.mounting: unknown variant `Z`, expected `O` or `X`",
            ),
            (
                with(&["mecanum4.diameter_m=0.1"]),
                "short.toml: mecanum4.diameter_m: unknown field `diameter_m`",
            ),
            (
                with(&["mecanum4.track_m=wide"]),
                "short.toml: mecanum4.track_m: invalid type: string \"wide\", expected a number",
            ),
            (
                with(&["mecanum4.radius_m=48"]),
                "short.toml: mecanum4.radius_m: 48, allowed: 0.001 to 10",
            ),
            (
                with(&["omni3={lever_m = 1.0, radius_m = 0.05, wheel_mass_kg = 0.4}"]),
                "short.toml: omni3: beside wheel, allowed: one of the two",
            ),
            (
                with(&["motor.gear_ratio=20"]),
                "short.toml: motor.rotor_inertia_kg_m2: missing, allowed: rotor_inertia_kg_m2 and gear_ratio together",
            ),
            (
                with(&[
                    "mecanum4.wheel_inertia_kg_m2=1e-3",
                    "motor.gear_ratio=20",
                    "motor.rotor_inertia_kg_m2=1e-6",
                ]),
                "short.toml: motor.rotor_inertia_kg_m2: no use, allowed: where a wheel leaves out inertia_kg_m2",
            ),
        ];
        for (message, start) in starts {
            assert!(message.starts_with(start), "{message}");
        }
        let built_in = FileKind::Vehicle.template("mecanum4").expect("built in");
        for (key, start) in [
            (
                "wheel.*.roller_angle_rad=45",
                "short.toml: wheel[0].roller_angle_rad: 45, allowed: -1.5 to 1.5; for degrees",
            ),
            (
                "wheel.0.diameter_m=0.1",
                "short.toml: wheel[0].diameter_m: allowed: radius_m = 0.05, half of it",
            ),
            (
                "wheel.rear_left.position_m=[-250, 200]",
                "short.toml: wheel[2].position_m: -250, allowed: metres; -250 mm are -0.25",
            ),
            (
                "wheel.0.roller_angle_deg=45",
                "short.toml: wheel[0].roller_angle_deg: beside roller_angle_rad, allowed: one",
            ),
        ] {
            let message = refused(built_in, &[key]);
            assert!(message.starts_with(start), "{message}");
        }
    }
}
