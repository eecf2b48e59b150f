//! A vehicle: bodies, passive hinges, wheels, motors, gains.

use garde::Validate;
use omni_core::{AxisLimits, PidGains, TorqueLimit, TwistLimits, Wheel, WheelLayout};
use serde::{Deserialize, Serialize};
use toml::Table;

use crate::Error;
use crate::check::{
    between, direction, finite_all, is_name, is_schema_version, not_negative, positive, positive_all,
};
use crate::load::{Override, Source, read};
use crate::rollers::{Misfit, RollerWheel, Rollers, WheelModel};
use crate::tagged::deserialize_by_kind;

/// A vehicle file. Lengths are in the vehicle's frame as it stands on flat ground: x forward, y left, z up, z = 0 at the
/// ground, the origin under the point that the kinematics refer to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Version of the file format, [`crate::SCHEMA_VERSION`].
    #[garde(custom(is_schema_version))]
    pub schema_version: u32,
    /// Name in logs.
    #[garde(custom(is_name))]
    pub name: String,
    /// Rigid bodies; the first one is the base, whose pose is the vehicle's.
    #[garde(length(min = 1, max = 16), dive)]
    pub body: Vec<Body>,
    /// Passive hinges that join the bodies into a tree.
    #[serde(default)]
    #[garde(dive)]
    pub hinge: Vec<Hinge>,
    /// Wheels, in the controller's order.
    #[garde(length(min = 3, max = 8), dive)]
    pub wheel: Vec<WheelSpec>,
    /// Rollers of the wheels whose `contact` gives none of their own, for
    /// `physics.wheel_model = "rollers"`.
    #[serde(default)]
    #[garde(dive)]
    pub rollers: Option<Rollers>,
    /// The actuator of every wheel.
    #[garde(dive)]
    pub motor: Motor,
    /// Gains of every wheel's loop.
    #[garde(dive)]
    pub gains: Gains,
    /// What the vehicle may be commanded to do; anything if left out.
    #[serde(default)]
    #[garde(dive)]
    pub limits: Option<Limits>,
}

/// A rigid body without its wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, unique among bodies.
    #[garde(custom(is_name))]
    pub name: String,
    /// Mass \[kg\], > 0.
    #[garde(custom(positive))]
    pub mass_kg: f64,
    /// Centre of mass \[m\].
    #[garde(custom(finite_all))]
    pub com_m: [f64; 3],
    /// Edge lengths \[m\], > 0, of the solid box that has this body's inertia. It collides with nothing.
    #[garde(custom(positive_all))]
    pub box_m: [f64; 3],
}

/// A passive hinge between two bodies: no motor, no sensor in the controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// Name, unique among hinges.
    #[garde(custom(is_name))]
    pub name: String,
    /// Body on the side of the base.
    #[garde(custom(is_name))]
    pub parent: String,
    /// Body that the hinge carries.
    #[garde(custom(is_name))]
    pub child: String,
    /// Axis; a positive angle turns the child about it by the right-hand rule.
    #[garde(custom(direction))]
    pub axis: [f64; 3],
    /// A point of the axis \[m\].
    #[garde(custom(finite_all))]
    pub anchor_m: [f64; 3],
    /// The angle stays within plus and minus this \[rad\], 0 to 3.
    #[garde(custom(between(0.0, 3.0)))]
    pub limit_rad: f64,
    /// Viscous damping \[N.m.s/rad\], >= 0.
    #[garde(custom(not_negative))]
    pub damping_n_m_s_rad: f64,
}

/// What of a wheel touches the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Validate)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WheelContact {
    /// A ball of the wheel's radius: for wheels that meet obstacles along their rolling direction.
    Ball {},
    /// A ball of the rollers' radius under the axle, geared so that the wheel's rim and inertia are right: for wheels
    /// that meet obstacles sideways, with a roller.
    Roller {
        /// Radius of the rollers \[m\], > 0, less than the wheel's.
        #[garde(custom(positive))]
        radius_m: f64,
    },
    /// Rollers, each a body on its own bearing.
    Rollers(#[garde(dive)] Rollers),
}

#[derive(Deserialize)]
#[serde(remote = "WheelContact", rename_all = "snake_case", deny_unknown_fields)]
enum ContactByKind {
    Ball {},
    Roller { radius_m: f64 },
    Rollers(Rollers),
}
deserialize_by_kind!(WheelContact, ContactByKind);

/// A driven wheel with free rollers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct WheelSpec {
    /// Name, unique among wheels.
    #[garde(custom(is_name))]
    pub name: String,
    /// The body that carries it.
    #[garde(custom(is_name))]
    pub body: String,
    /// Place on the ground plane \[m\]: x forward, y left. The axle is `radius_m` above.
    #[garde(custom(finite_all))]
    pub position_m: [f64; 2],
    /// The way the vehicle moves when this wheel alone turns positively.
    #[garde(custom(direction))]
    pub rolling_direction: [f64; 2],
    /// Axis of the roller on the ground, counter-clockwise from the rolling direction \[rad\], -1.5 to 1.5: 0 for an omni
    /// wheel, usually +-pi/4 for a mecanum wheel.
    #[serde(default)]
    #[garde(custom(between(-1.5, 1.5)))]
    pub roller_angle_rad: f64,
    /// Rolling radius \[m\], > 0.
    #[garde(custom(positive))]
    pub radius_m: f64,
    /// Mass \[kg\], > 0.
    #[garde(custom(positive))]
    pub mass_kg: f64,
    /// Moment of inertia about the axle \[kg.m^2\], rotor included, > 0.
    #[garde(custom(positive))]
    pub inertia_kg_m2: f64,
    /// Wheel velocity over actuator velocity, k of eq. (1), > 0; 1 for direct drive.
    #[serde(default = "one")]
    #[garde(custom(positive))]
    pub gear: f64,
    /// What touches the ground.
    #[garde(dive)]
    pub contact: WheelContact,
}

fn one() -> f64 {
    1.0
}

/// Torque-speed line of every actuator, four-quadrant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Torque at rest \[N.m\], > 0.
    #[garde(custom(positive))]
    pub stall_torque_n_m: f64,
    /// Torque lost per speed while driving \[N.m per rad/s\], >= 0; 0 for a constant limit.
    #[garde(custom(not_negative))]
    pub slope_n_m_s_rad: f64,
}

impl Motor {
    /// The limit that the controller works with.
    ///
    /// # Errors
    /// As [`TorqueLimit::line`].
    pub fn limit<R: omni_core::Real>(&self) -> Result<TorqueLimit<R>, omni_core::ConfigError> {
        TorqueLimit::line(R::of(self.stall_torque_n_m), R::of(self.slope_n_m_s_rad))
    }
}

/// Limits of the commanded twist, the same forward and in reverse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Speed forward \[m/s\], > 0.
    #[garde(custom(positive))]
    pub vx_m_s: f64,
    /// Speed sideways \[m/s\], > 0.
    #[garde(custom(positive))]
    pub vy_m_s: f64,
    /// Yaw rate \[rad/s\], > 0.
    #[garde(custom(positive))]
    pub wz_rad_s: f64,
    /// Speeding up and braking, forward and sideways \[m/s^2\], > 0; left out: at once.
    #[serde(default)]
    #[garde(inner(custom(positive)))]
    pub linear_m_s2: Option<f64>,
    /// The same of the yaw rate \[rad/s^2\], > 0; left out: at once.
    #[serde(default)]
    #[garde(inner(custom(positive)))]
    pub yaw_rad_s2: Option<f64>,
}

impl Limits {
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
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// k_p \[N.m per rad/s\], >= 0.
    #[garde(custom(not_negative))]
    pub kp_n_m_s_rad: f64,
    /// k_i \[N.m per rad\], >= 0.
    #[garde(custom(not_negative))]
    pub ki_n_m_rad: f64,
    /// k_d \[N.m per rad/s^2\], >= 0.
    #[serde(default)]
    #[garde(custom(not_negative))]
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

impl Vehicle {
    /// The built-in vehicle or the file of that name.
    ///
    /// # Errors
    /// What is wrong with it, in one line.
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

    /// The vehicle that a source describes, with some keys replaced.
    ///
    /// # Errors
    /// What is wrong with it, in one line.
    pub fn from_source(source: &Source, overrides: &[Override]) -> Result<Self, Error> {
        Self::from_table(source, source.table()?, overrides)
    }

    /// The vehicle that a table of a source describes.
    pub(crate) fn from_table(
        source: &Source,
        mut table: Table,
        overrides: &[Override],
    ) -> Result<Self, Error> {
        for each in overrides {
            each.apply(source, &mut table)?;
        }
        let vehicle: Self = read(source, table)?;
        vehicle.check(source)?;
        Ok(vehicle)
    }

    /// The wheels as the controller knows them.
    ///
    /// # Errors
    /// As [`WheelLayout::new`]; parameter `wheel count` where `N` is not the number of wheels.
    pub fn layout<R: omni_core::Real, const N: usize>(
        &self,
    ) -> Result<WheelLayout<R, N>, omni_core::ConfigError> {
        let wheels: [&WheelSpec; N] =
            self.wheel
                .iter()
                .collect::<Vec<_>>()
                .try_into()
                .map_err(|wheels: Vec<_>| omni_core::ConfigError {
                    parameter: "wheel count",
                    index: None,
                    value: wheels.len() as f64,
                    allowed: "the layout's own",
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

    /// The rollers of the wheel with that index, from 0, under a wheel model; none where it is a ball, or the file has no
    /// rollers for it.
    ///
    /// ```
    /// use omni_config::{Vehicle, WheelModel};
    /// let vehicle = Vehicle::load("mecanum4")?;
    /// let rollers = vehicle.rollers(0, WheelModel::Rollers).expect("the file has [rollers]");
    /// assert_eq!(rollers.places().count(), 9); // nine a wheel
    /// assert!(vehicle.rollers(0, WheelModel::Contact).is_none()); // unless asked for: balls
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn rollers(&self, index: usize, model: WheelModel) -> Option<RollerWheel> {
        let own = matches!(self.wheel.get(index)?.contact, WheelContact::Rollers(_));
        match model {
            WheelModel::Ball => None,
            WheelModel::Contact if !own => None,
            _ => self.rollers_of(index)?.ok(),
        }
    }

    /// A wheel's own rollers, or the vehicle's on that wheel, or the key and what is wrong with them; none where there are none.
    fn rollers_of(&self, index: usize) -> Option<Result<RollerWheel, (String, String)>> {
        let wheel = self.wheel.get(index)?;
        let (rollers, table, on) = match wheel.contact {
            WheelContact::Rollers(own) => (own, format!("wheel[{index}].contact"), String::new()),
            _ => (self.rollers?, "rollers".into(), format!(" (on wheel {:?})", wheel.name)),
        };
        Some(rollers.on(wheel).map_err(|misfit| {
            let Misfit { key, message } = misfit;
            (format!("{table}.{key}"), format!("{message}{on}"))
        }))
    }

    /// What no single key shows: names that refer to each other, and wheels that together move the vehicle.
    fn check(&self, source: &Source) -> Result<(), Error> {
        unique(source, "body", self.body.iter().map(|b| &b.name))?;
        unique(source, "hinge", self.hinge.iter().map(|h| &h.name))?;
        unique(source, "wheel", self.wheel.iter().map(|w| &w.name))?;
        let bodies = self.body.iter().map(|b| b.name.as_str()).collect::<Vec<_>>();
        let known = |key: String, name: &str| {
            if bodies.contains(&name) {
                Ok(())
            } else {
                Err(source.refuse(key, format!("{name:?}, allowed: {}", bodies.join(", "))))
            }
        };
        // Hinges in file order grow the tree from the base: each parent is there already, each child is new.
        let mut joined = vec![bodies[0]];
        for (i, hinge) in self.hinge.iter().enumerate() {
            known(format!("hinge[{i}].parent"), &hinge.parent)?;
            known(format!("hinge[{i}].child"), &hinge.child)?;
            if !joined.contains(&hinge.parent.as_str()) {
                let allowed = joined.join(", ");
                let message = format!(
                    "{:?}, allowed: a body already joined to the base ({allowed})",
                    hinge.parent
                );
                return Err(source.refuse(format!("hinge[{i}].parent"), message));
            }
            if joined.contains(&hinge.child.as_str()) {
                let message = format!("{:?}, allowed: a body not yet joined to the base", hinge.child);
                return Err(source.refuse(format!("hinge[{i}].child"), message));
            }
            joined.push(&hinge.child);
        }
        if let Some(i) = bodies.iter().position(|b| !joined.contains(b)) {
            let message = format!(
                "{:?} hangs on no hinge; allowed: every body but the first is some hinge's child",
                bodies[i]
            );
            return Err(source.refuse(format!("body[{i}].name"), message));
        }
        for (i, wheel) in self.wheel.iter().enumerate() {
            known(format!("wheel[{i}].body"), &wheel.body)?;
            if let WheelContact::Roller { radius_m } = wheel.contact
                && radius_m >= wheel.radius_m
            {
                let message = format!(
                    "{radius_m}, allowed: less than the wheel's radius_m, {}",
                    wheel.radius_m
                );
                return Err(source.refuse(format!("wheel[{i}].contact.radius_m"), message));
            }
        }
        for i in 0..self.wheel.len() {
            self.rollers_of(i).transpose().map_err(|(key, message)| source.refuse(key, message))?;
        }
        crate::control::check_layout(self).map_err(|error| {
            let key = error
                .index
                .map_or_else(|| "wheel".to_owned(), |i| format!("wheel[{i}]"));
            source.refuse(
                key,
                format!(
                    "{} = {}, allowed: {}",
                    error.parameter, error.value, error.allowed
                ),
            )
        })
    }
}

fn unique<'a>(source: &Source, list: &str, names: impl Iterator<Item = &'a String>) -> Result<(), Error> {
    let mut seen = Vec::new();
    for (i, name) in names.enumerate() {
        if seen.contains(&name) {
            return Err(source.refuse(
                format!("{list}[{i}].name"),
                format!("{name:?} twice, allowed: each name once"),
            ));
        }
        seen.push(name);
    }
    Ok(())
}
