//! A vehicle file: bodies, passive hinges, couplings, wheels, motors, gains.

pub(crate) mod completion;
mod coupling;
mod coupling_spring;
mod motor;
mod shape;
mod short_forms;
mod validation;

use garde::Validate;
use omni_core::geometry::Wheel;
use omni_core::shaping::{AxisLimits, TwistLimits};
use omni_core::{PidGains, WheelLayout};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Table;

use crate::Error;
use crate::file_kind::FileKind;
use crate::key_place::with_place;
use crate::load::{Source, read};
use crate::override_key::Override;
use crate::ranges::{
    self, ACCELERATION_M_S2, ACCELERATION_RAD_S2, DAMPING_N_M_S_RAD, EDGE_M, GAIN, MASS_KG, PLACE_M,
    SPEED_M_S, SPEED_RAD_S, STOP_RAD, direction, is_name,
};
#[cfg(feature = "schema")]
use crate::ranges::{DIRECTION, NAME};
use crate::roller_wheel::{Misfit, RollerWheel};
use crate::rollers::{Rollers, WheelModel};
use crate::wheel_spec::{WheelContact, WheelSpec};
pub use coupling::Coupling;
pub use coupling_spring::CouplingSpring;
pub use motor::Motor;

/// A vehicle file. Lengths are in the vehicle's frame on flat ground: x forward, y left, z up from
/// the ground. The commanded twist applies to the frame's origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema), schemars(transform = completion::schema::vehicle))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Vehicle {
    /// Version of the file format; always 1.
    #[garde(skip)] // checked before anything else is read
    #[cfg_attr(feature = "schema", schemars(range(min = crate::SCHEMA_VERSION, max = crate::SCHEMA_VERSION)))]
    pub schema_version: u32,
    /// Name in logs.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// Rigid bodies; the first one is the base, whose pose is the vehicle's.
    #[garde(adapt(ranges), length(min = 1, max = 16), dive)]
    pub body: Vec<Body>,
    /// Passive hinges that join the bodies into a tree.
    #[serde(default)]
    #[garde(adapt(ranges), length(max = 15), dive)]
    pub hinge: Vec<Hinge>,
    /// Hinges that turn together, as a differential makes them.
    #[serde(default)]
    #[garde(adapt(ranges), length(max = 15), dive)]
    pub coupling: Vec<Coupling>,
    /// Wheels, in the controller's order.
    #[garde(adapt(ranges), length(min = 3, max = 8), dive)]
    pub wheel: Vec<WheelSpec>,
    /// Rollers of the wheels whose `contact` defines none, for `physics.wheel_model = "rollers"`.
    #[serde(default)]
    #[garde(dive)]
    pub rollers: Option<Rollers>,
    /// The actuator of every wheel.
    #[garde(dive)]
    pub motor: Motor,
    /// Gains of every wheel's loop; left out: derived from masses, motor and control period.
    #[serde(default)]
    #[garde(dive)]
    pub gains: Option<Gains>,
    /// Limits of the commanded twist; unlimited if left out.
    #[serde(default)]
    #[garde(dive)]
    pub limits: Option<Limits>,
    /// Assumptions about keys that the file leaves out.
    #[serde(skip)]
    #[garde(skip)]
    pub(crate) assumed: Vec<String>,
    /// Whether the file defines the motors' rotors, whose inertia adds to the wheels' own.
    #[serde(skip)]
    #[garde(skip)]
    pub(crate) with_rotors: bool,
}

/// A rigid body without its wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema), schemars(transform = completion::schema::body))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Body {
    /// Name, unique among bodies.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// Mass \[kg\], 0.001 to 10000.
    #[garde(adapt(ranges), range(min = MASS_KG.min, max = MASS_KG.max))]
    pub mass_kg: f64,
    /// Centre of mass \[m\], each within 100. Left out: half way up the box, in the middle of the
    /// wheels that the body carries.
    #[garde(adapt(ranges), inner(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub com_m: [f64; 3],
    /// Edge lengths \[m\], 0.001 to 100, of the solid box that has this body's inertia. It is no
    /// contact: nothing stops at it. A run whose ground reaches into its lower face has touched.
    #[garde(adapt(ranges), inner(range(min = EDGE_M.min, max = EDGE_M.max)))]
    pub inertia_box_m: [f64; 3],
    /// Height of its lowest point above level ground with the vehicle at rest \[m\], 0.001 to 100.
    /// Left out: the height of the box's lower face.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = EDGE_M.min, max = EDGE_M.max))]
    pub clearance_m: Option<f64>,
}

impl Body {
    /// Height of its lowest point above level ground at rest \[m\]: the file's value, or the height of its box's lower
    /// face. None if the box reaches into the ground: then it has the body's inertia, but not its shape.
    ///
    /// ```
    /// use omni_config::Vehicle;
    /// let mut base = Vehicle::load("omni3")?.body[0].clone();
    /// assert!((base.underside_m().expect("known") - 0.03).abs() < 1e-12); // 8 cm up to its middle, less half of 10 cm
    /// base.clearance_m = Some(0.02);
    /// assert_eq!(base.underside_m(), Some(0.02));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn underside_m(&self) -> Option<f64> {
        let face_m = self.com_m[2] - self.inertia_box_m[2] / 2.0;
        self.clearance_m.or((face_m > 0.0).then_some(face_m))
    }
}

/// A passive hinge between two bodies: no motor, no sensor in the controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema), schemars(transform = completion::schema::hinge))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Hinge {
    /// Name, unique among hinges.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// Body on the side of the base.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub parent: String,
    /// Body that the hinge carries.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub child: String,
    /// Axis; a positive angle turns the child about it by the right-hand rule.
    #[garde(custom(direction))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = DIRECTION.min, max = DIRECTION.max))))]
    pub axis: [f64; 3],
    /// A point of the axis \[m\], within or near the vehicle.
    #[garde(adapt(ranges), inner(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub anchor_m: [f64; 3],
    /// The angle stays within plus and minus this \[rad\], 0 to 3.
    #[garde(adapt(ranges), range(min = STOP_RAD.min, max = STOP_RAD.max))]
    pub limit_rad: f64,
    /// Viscous damping \[N.m.s/rad\], 0 to 1e6. Left out: the damping that stops the child in 0.2 s.
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub damping_n_m_s_rad: f64,
}

/// Limits of the commanded twist, the same forward and in reverse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Limits {
    /// Speed forward \[m/s\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = SPEED_M_S.min, max = SPEED_M_S.max))]
    pub vx_m_s: f64,
    /// Lateral speed \[m/s\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = SPEED_M_S.min, max = SPEED_M_S.max))]
    pub vy_m_s: f64,
    /// Yaw rate \[rad/s\], 0.001 to 1000.
    #[garde(adapt(ranges), range(min = SPEED_RAD_S.min, max = SPEED_RAD_S.max))]
    pub wz_rad_s: f64,
    /// Forward and lateral acceleration and deceleration \[m/s^2\], 0.001 to 1e4; left out: unlimited.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = ACCELERATION_M_S2.min, max = ACCELERATION_M_S2.max))]
    pub linear_m_s2: Option<f64>,
    /// The same for the yaw rate \[rad/s^2\], 0.001 to 1e5; left out: unlimited.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = ACCELERATION_RAD_S2.min, max = ACCELERATION_RAD_S2.max))]
    pub yaw_rad_s2: Option<f64>,
}

impl Limits {
    /// The forward and lateral speeds \[m/s\] and the yaw rate \[rad/s\].
    pub(crate) fn speeds(&self) -> [f64; 3] {
        [self.vx_m_s, self.vy_m_s, self.wz_rad_s]
    }

    /// The limits in the controller's scalar, axis by axis.
    #[must_use]
    pub fn of_twist<R: omni_core::Real>(&self) -> TwistLimits<R> {
        let axis = |speed: f64, acceleration: Option<f64>| {
            let acceleration = R::of(acceleration.unwrap_or(f64::INFINITY));
            AxisLimits::symmetric(R::of(speed), acceleration, acceleration, R::of(f64::INFINITY))
        };
        TwistLimits::PerAxis {
            vx: axis(self.vx_m_s, self.linear_m_s2),
            vy: axis(self.vy_m_s, self.linear_m_s2),
            wz: axis(self.wz_rad_s, self.yaw_rad_s2),
        }
    }
}

/// Gains of eq. (10).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Gains {
    /// k_p \[N.m per rad/s\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = GAIN.min, max = GAIN.max))]
    pub kp_n_m_s_rad: f64,
    /// k_i \[N.m per rad\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = GAIN.min, max = GAIN.max))]
    pub ki_n_m_rad: f64,
    /// k_d \[N.m per rad/s^2\], 0 to 1e6; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = GAIN.min, max = GAIN.max))]
    pub kd_n_m_s2_rad: f64,
}

impl Gains {
    /// The gains in the controller's scalar.
    #[must_use]
    pub fn pid<R: omni_core::Real>(&self) -> PidGains<R> {
        PidGains {
            kp_n_m_s_rad: R::of(self.kp_n_m_s_rad),
            ki_n_m_rad: R::of(self.ki_n_m_rad),
            kd_n_m_s2_rad: R::of(self.kd_n_m_s2_rad),
        }
    }
}

/// Wheels side by side.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Row {
    /// Place of the foremost of them along x \[m\].
    pub x_m: f64,
    /// Their indices, from 0, in the vehicle's order.
    pub wheels: Vec<usize>,
}

impl Vehicle {
    /// The built-in vehicle or the file of that name.
    ///
    /// # Errors
    /// Its first error, in one line.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("chugo7")?;
    /// let total: f64 = vehicle.body.iter().map(|b| b.mass_kg).chain(vehicle.wheel.iter().map(|w| w.mass_kg)).sum();
    /// assert_eq!(total, 20.0);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn load(name: &str) -> Result<Self, Error> {
        Self::from_source(&Source::vehicle(name, None)?, &[])
    }

    /// The vehicle as a file says it, everything that was completed written out.
    ///
    /// ```
    /// use omni_config::{Source, Vehicle};
    /// let chugo7 = Vehicle::load("chugo7")?;
    /// assert_eq!(Vehicle::from_source(&Source::text("copy", chugo7.to_toml()), &[])?, chugo7);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).unwrap_or_default() // plain data, read from TOML
    }

    /// The vehicle that a source describes, with some keys replaced.
    ///
    /// # Errors
    /// Its first error, in one line.
    pub fn from_source(source: &Source, overrides: &[Override]) -> Result<Self, Error> {
        let table = source.table()?;
        source.expect(FileKind::Vehicle, &table)?;
        Self::from_table(source, table, overrides)
    }

    /// The vehicle that a table of a source describes.
    pub(crate) fn from_table(
        source: &Source,
        mut table: Table,
        overrides: &[Override],
    ) -> Result<Self, Error> {
        // Those of wheels come last: a short form may have to write its wheels out first.
        let (wheels, others): (Vec<_>, Vec<_>) = overrides
            .iter()
            .partition(|each| each.key().starts_with("wheel."));
        for each in others {
            each.apply(source, &mut table)?;
        }
        if !wheels.is_empty() && !table.contains_key("wheel") {
            short_forms::write_out(source, &mut table)?;
        }
        for each in wheels {
            each.apply(source, &mut table)?;
        }
        let with_rotors = table
            .get("motor")
            .is_some_and(|motor| motor.get("rotor_inertia_kg_m2").is_some());
        let assumed = completion::complete(source, &mut table)?;
        let whole = || Source::vehicle("chugo7", None).ok()?.table().ok();
        let vehicle: Self = read(source, table).map_err(|error| with_place(error, whole))?;
        vehicle.check(source)?;
        Ok(Self {
            assumed,
            with_rotors,
            ..vehicle
        })
    }

    /// Assumptions about keys that the file leaves out, in words: inertias of wheels, centres of mass, damping of
    /// hinges.
    ///
    /// ```
    /// use omni_config::{FileKind, Source, Vehicle};
    /// let text = FileKind::Vehicle.template("omni3")?.replace("inertia_kg_m2 = 0.0007", "");
    /// let vehicle = Vehicle::from_source(&Source::text("mine.toml", &*text), &[])?;
    /// assert_eq!(vehicle.wheel[0].inertia_kg_m2, 0.4 * 0.05 * 0.05 / 2.0); // a solid wheel
    /// assert!(vehicle.assumptions()[0].starts_with("3 wheels without inertia_kg_m2: up to 0.0005 kg.m2"));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn assumptions(&self) -> &[String] {
        &self.assumed
    }

    /// Rows of wheels that meet an obstacle in front at the same time, front row first: wheels whose x differs by less
    /// than 2 cm from the next wheel's.
    ///
    /// ```
    /// let rows = omni_config::Vehicle::load("chugo7")?.rows();
    /// let wheels: Vec<_> = rows.iter().map(|row| row.wheels.clone()).collect();
    /// assert_eq!(wheels, [vec![4, 5, 6], vec![3], vec![0, 1, 2]]); // wheels 5, 6, 7, then 4, then 1, 2, 3
    /// assert_eq!(rows[0].x_m, 0.30);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let x = |wheel: usize| self.wheel[wheel].position_m[0];
        let mut order: Vec<usize> = (0..self.wheel.len()).collect();
        order.sort_by(|a, b| x(*b).total_cmp(&x(*a)));
        let mut rows: Vec<Row> = Vec::new();
        let mut last = f64::NAN;
        for wheel in order {
            match rows.last_mut() {
                Some(row) if last - x(wheel) < 0.02 => row.wheels.push(wheel),
                _ => rows.push(Row {
                    x_m: x(wheel),
                    wheels: vec![wheel],
                }),
            }
            last = x(wheel);
        }
        rows
    }

    /// The wheels as the controller knows them.
    ///
    /// # Errors
    /// As [`WheelLayout::new`]; parameter `wheel count` if `N` is not the number of wheels.
    pub fn layout<R: omni_core::Real, const N: usize>(
        &self,
    ) -> Result<WheelLayout<R, N>, omni_core::ConfigError> {
        let wheels: [&WheelSpec; N] =
            self.wheel
                .iter()
                .collect::<Vec<_>>()
                .try_into()
                .map_err(|wheels: Vec<_>| {
                    omni_core::ConfigError::new("wheel count", wheels.len() as f64, "the layout's own")
                })?;
        WheelLayout::new(wheels.map(|w| {
            let (position, direction) = (w.position_m.map(R::of), w.rolling_direction.map(R::of));
            let omni = Wheel::omni(position, direction, R::of(w.radius_m)).geared(R::of(w.gear));
            let roller_angle_rad = R::of(w.roller_angle_rad);
            Wheel {
                roller_angle_rad,
                ..omni
            }
        }))
    }

    /// The rollers of the wheel with that index, from 0, under a wheel model, on level ground if
    /// that is automatic; none if it is a ball. Those of a file that has none are nine, or twice nine on an omni wheel,
    /// of a fifth of the wheel's radius.
    ///
    /// ```
    /// use omni_config::{Vehicle, WheelModel};
    /// let vehicle = Vehicle::load("mecanum4")?;
    /// let rollers = vehicle.rollers(0, WheelModel::Rollers).expect("the file has [rollers]");
    /// assert_eq!(rollers.places().count(), 9); // nine a wheel
    /// assert!(vehicle.rollers(0, WheelModel::Auto).is_none()); // on level ground: balls
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn rollers(&self, index: usize, model: WheelModel) -> Option<RollerWheel> {
        let own = matches!(self.wheel.get(index)?.contact, WheelContact::Rollers(_));
        match model {
            WheelModel::Ball => None,
            WheelModel::Auto if !own => None,
            _ => match self.rollers_of(index) {
                Some(given) => given.ok(),
                None => {
                    let wheel = self.wheel.get(index)?;
                    Rollers::usual(wheel).on(wheel).ok()
                }
            },
        }
    }

    /// A wheel's own rollers, or the vehicle's rollers on that wheel, or the key and the error; none if there are none.
    pub(crate) fn rollers_of(&self, index: usize) -> Option<Result<RollerWheel, (String, String)>> {
        let wheel = self.wheel.get(index)?;
        let (rollers, table, on) = match wheel.contact {
            WheelContact::Rollers(own) => (own, format!("wheel[{index}].contact"), String::new()),
            _ => (
                self.rollers?,
                "rollers".into(),
                format!(" (on wheel {:?})", wheel.name),
            ),
        };
        Some(rollers.on(wheel).map_err(|misfit| {
            let Misfit { key, message } = misfit;
            (format!("{table}.{key}"), format!("{message}{on}"))
        }))
    }
}
