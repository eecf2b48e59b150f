//! Wheels that a few numbers describe: four mecanum wheels in a rectangle, three omni wheels in a circle.

use std::f64::consts::{FRAC_PI_4, TAU};

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::Deserialize;
use toml::{Table, Value};

use crate::Error;
use crate::load::{Source, checked};
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{self, EDGE_M, HEADING_DEG, INERTIA_KG_M2, MASS_KG, RADIUS_M, is_name};

/// Four mecanum wheels at the corners of a rectangle, instead of `wheel`.
#[derive(Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct Mecanum4 {
    /// From the front axles to the rear ones \[m\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = EDGE_M.min, max = EDGE_M.max))]
    wheelbase_m: f64,
    /// Distance from the middle of the left wheels to the middle of the right wheels \[m\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = EDGE_M.min, max = EDGE_M.max))]
    track_m: f64,
    /// Shape of the roller axes on the ground, seen from above; O if left out. From above the upper rollers are seen,
    /// which form the other letter. With X a vehicle hardly turns.
    #[serde(default)]
    #[garde(skip)]
    mounting: Mounting,
    /// Rolling radius \[m\], 0.001 to 10.
    #[garde(adapt(ranges), range(min = RADIUS_M.min, max = RADIUS_M.max))]
    radius_m: f64,
    /// Mass of a wheel \[kg\], 0.001 to 10000.
    #[garde(adapt(ranges), range(min = MASS_KG.min, max = MASS_KG.max))]
    wheel_mass_kg: f64,
    /// Inertia of a wheel about its axle, rotor included \[kg.m^2\], 1e-10 to 1e6; left out as of any wheel.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = INERTIA_KG_M2.min, max = INERTIA_KG_M2.max))]
    wheel_inertia_kg_m2: Option<f64>,
    /// The body that carries the wheels; the first one if left out.
    #[serde(default)]
    #[garde(inner(custom(is_name)))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    body: Option<String>,
}

/// Shape of the roller axes of mecanum wheels on the ground.
#[derive(Clone, Copy, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema), schemars(inline))]
pub(super) enum Mounting {
    #[default]
    O,
    X,
}

/// Three omni wheels at 120 degrees that roll counter-clockwise, instead of `wheel`.
#[derive(Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct Omni3 {
    /// From the middle of the vehicle to a wheel \[m\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = EDGE_M.min, max = EDGE_M.max))]
    lever_m: f64,
    /// Direction of the first wheel, counter-clockwise from forward \[deg\], -360 to 360; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = HEADING_DEG.min, max = HEADING_DEG.max))]
    angle_deg: f64,
    /// Rolling radius \[m\], 0.001 to 10.
    #[garde(adapt(ranges), range(min = RADIUS_M.min, max = RADIUS_M.max))]
    radius_m: f64,
    /// Mass of a wheel \[kg\], 0.001 to 10000.
    #[garde(adapt(ranges), range(min = MASS_KG.min, max = MASS_KG.max))]
    wheel_mass_kg: f64,
    /// Inertia of a wheel about its axle, rotor included \[kg.m^2\], 1e-10 to 1e6; left out as of any wheel.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = INERTIA_KG_M2.min, max = INERTIA_KG_M2.max))]
    wheel_inertia_kg_m2: Option<f64>,
    /// The body that carries the wheels; the first one if left out.
    #[serde(default)]
    #[garde(inner(custom(is_name)))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    body: Option<String>,
}

/// Common keys of all wheels of a short form.
struct Alike {
    radius_m: f64,
    mass_kg: f64,
    inertia_kg_m2: Option<f64>,
    body: Option<String>,
}

/// Writes the wheels of a short form out.
pub(super) fn write_out(source: &Source, table: &mut Table) -> Result<(), Error> {
    let forms = ["mecanum4", "omni3"].map(|name| (name, table.remove(name)));
    for (name, form) in forms {
        let Some(form) = form else { continue };
        let inside = |error: Error| error.inside(name);
        let wheels = if name == "mecanum4" {
            checked::<Mecanum4>(source, form).map_err(inside)?.wheels(table)
        } else {
            checked::<Omni3>(source, form).map_err(inside)?.wheels(table)
        };
        if table.contains_key("wheel") {
            let message = "beside wheel, allowed: one of the two: this describes every wheel";
            return Err(source.refuse(name, message));
        }
        table.insert("wheel".into(), Value::Array(wheels));
    }
    Ok(())
}

impl Mecanum4 {
    fn wheels(self, vehicle: &Table) -> Vec<Value> {
        let alike = Alike {
            radius_m: self.radius_m,
            mass_kg: self.wheel_mass_kg,
            inertia_kg_m2: self.wheel_inertia_kg_m2,
            body: self.body.or_else(|| first_body(vehicle)),
        };
        let hand = match self.mounting {
            Mounting::O => 1.0,
            Mounting::X => -1.0,
        };
        let corners = [
            ("front_left", 1.0, 1.0),
            ("front_right", 1.0, -1.0),
            ("rear_left", -1.0, 1.0),
            ("rear_right", -1.0, -1.0),
        ];
        let corner = |(name, ahead, left): (&str, f64, f64)| {
            let place_m = [ahead * self.wheelbase_m / 2.0, left * self.track_m / 2.0];
            alike.wheel(name, place_m, [1.0, 0.0], -ahead * left * hand * FRAC_PI_4)
        };
        corners.map(corner).into()
    }
}

impl Omni3 {
    fn wheels(self, vehicle: &Table) -> Vec<Value> {
        let alike = Alike {
            radius_m: self.radius_m,
            mass_kg: self.wheel_mass_kg,
            inertia_kg_m2: self.wheel_inertia_kg_m2,
            body: self.body.or_else(|| first_body(vehicle)),
        };
        let wheel = |i: u8| {
            let (sin, cos) = libm::sincos(self.angle_deg.to_radians() + f64::from(i) * TAU / 3.0);
            let place_m = [self.lever_m * cos, self.lever_m * sin];
            alike.wheel(&(i + 1).to_string(), place_m, [-sin, cos], 0.0)
        };
        (0..3).map(wheel).collect()
    }
}

impl Alike {
    fn wheel(&self, name: &str, place_m: [f64; 2], rolls: [f64; 2], roller_angle_rad: f64) -> Value {
        let pair = |values: [f64; 2]| Value::Array(values.map(Value::from).into());
        let mut wheel = Table::from_iter([
            ("name".to_owned(), name.into()),
            ("position_m".to_owned(), pair(place_m)),
            ("rolling_direction".to_owned(), pair(rolls)),
            ("roller_angle_rad".to_owned(), roller_angle_rad.into()),
            ("radius_m".to_owned(), self.radius_m.into()),
            ("mass_kg".to_owned(), self.mass_kg.into()),
        ]);
        if let Some(body) = &self.body {
            wheel.insert("body".into(), body.as_str().into());
        }
        if let Some(inertia_kg_m2) = self.inertia_kg_m2 {
            wheel.insert("inertia_kg_m2".into(), inertia_kg_m2.into());
        }
        Value::Table(wheel)
    }
}

fn first_body(vehicle: &Table) -> Option<String> {
    let name = vehicle.get("body")?.as_array()?.first()?.get("name")?;
    name.as_str().map(str::to_owned)
}
