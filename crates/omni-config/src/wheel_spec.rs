//! A driven wheel, as in a file.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::kind_tables::deserialize_by_kind;
use crate::ranges::{
    self, CONTACT_N_M, GEAR, INERTIA_KG_M2, MASS_KG, PLACE_M, PRELOAD_N, RADIUS_M, ROLLER_ANGLE_RAD, WIDTH_M,
    direction, is_name, one,
};
#[cfg(feature = "schema")]
use crate::ranges::{DIRECTION, NAME};
use crate::rollers::Rollers;

/// The part of a wheel that touches the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum WheelContact {
    /// A ball of the wheel's radius: for wheels that meet obstacles along their rolling direction.
    Ball {},
    /// A ball of the rollers' radius under the axle, geared so that the wheel's rim and inertia are right: for wheels
    /// that meet obstacles laterally, with a roller.
    Roller {
        /// Radius of the rollers \[m\], 0.001 to 10, less than the wheel's.
        #[garde(adapt(ranges), range(min = RADIUS_M.min, max = RADIUS_M.max))]
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
#[cfg_attr(feature = "schema", derive(JsonSchema), schemars(transform = crate::vehicle::completion::schema::wheel))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct WheelSpec {
    /// Name, unique among wheels.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// The body that carries it.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub body: String,
    /// Position in the ground plane \[m\], each within 100: x forward, y left. The axle is `radius_m` above.
    #[garde(adapt(ranges), inner(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub position_m: [f64; 2],
    /// Direction in which this wheel drives the vehicle when it turns positively.
    #[garde(custom(direction))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = DIRECTION.min, max = DIRECTION.max))))]
    pub rolling_direction: [f64; 2],
    /// Axis of the roller on the ground, counter-clockwise from the rolling direction \[rad\], -1.5
    /// to 1.5: 0 for an omni wheel, usually +-pi/4 for a mecanum wheel.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = ROLLER_ANGLE_RAD.min, max = ROLLER_ANGLE_RAD.max))]
    pub roller_angle_rad: f64,
    /// Rolling radius \[m\], 0.001 to 10.
    #[garde(adapt(ranges), range(min = RADIUS_M.min, max = RADIUS_M.max))]
    pub radius_m: f64,
    /// Width \[m\], 0.001 to 10, for pictures and URDF; the physics does not use it. Left out: half the radius.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = WIDTH_M.min, max = WIDTH_M.max))]
    pub width_m: Option<f64>,
    /// Mass \[kg\], 0.001 to 10000.
    #[garde(adapt(ranges), range(min = MASS_KG.min, max = MASS_KG.max))]
    pub mass_kg: f64,
    /// Moment of inertia about the axle \[kg.m^2\], rotor included, 1e-10 to 1e6. Left out: the inertia of a solid
    /// wheel, plus the motor's rotor if its inertia is set.
    #[garde(adapt(ranges), range(min = INERTIA_KG_M2.min, max = INERTIA_KG_M2.max))]
    pub inertia_kg_m2: f64,
    /// Wheel velocity over actuator velocity, k of eq. (1), 1e-6 to 1000; 1 for direct drive.
    #[serde(default = "one")]
    #[garde(adapt(ranges), range(min = GEAR.min, max = GEAR.max))]
    pub gear: f64,
    /// Stiffness of its contact with the ground \[N/m\], 100 to 1e10; left out: from `physics.contact_frequency_hz` and
    /// the wheel's mass. On a rigid frame it sets how the wheels of a row share their load. Only with
    /// `physics.engine = "articulated"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = CONTACT_N_M.min, max = CONTACT_N_M.max))]
    pub contact_stiffness_n_m: Option<f64>,
    /// Extra force that presses it on the ground \[N\], -1e5 to 1e5: it is mounted lower by this
    /// force over the stiffness of its contact. Only on a frame with other wheels; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = PRELOAD_N.min, max = PRELOAD_N.max))]
    pub preload_n: f64,
    /// Model of its contact with the ground; a ball if left out.
    #[garde(dive)]
    pub contact: WheelContact,
}

impl WheelSpec {
    /// Rate that its encoder reads per rate at which the nose, and the left side, of its body go up.
    pub(crate) fn carrier(&self) -> [f64; 2] {
        let [x, y] = self.rolling_direction;
        [x, y].map(|part| part / libm::hypot(x, y) / self.gear)
    }

    /// Radius of the ball that represents a wheel on the ground, if it is a ball \[m\]: the wheel's radius, or its
    /// rollers'.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("chugo7")?;
    /// let [along, crosswise] = [0, 1].map(|i| vehicle.wheel[i].contact_radius_m());
    /// assert_eq!((along, crosswise), (0.066, 0.025)); // wheel 2 meets a riser with a roller
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn contact_radius_m(&self) -> f64 {
        match self.contact {
            WheelContact::Ball {} | WheelContact::Rollers(_) => self.radius_m,
            WheelContact::Roller { radius_m } => radius_m,
        }
    }

    /// Displacement of a rolling wheel's centre along its push per radian of its actuator \[m/rad\].
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("mecanum4")?;
    /// let way = vehicle.wheel[0].way_per_rad();
    /// assert!((way - 0.076 * 0.5_f64.sqrt()).abs() < 1e-9); // rollers at 45 degrees
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn way_per_rad(&self) -> f64 {
        self.gear * self.radius_m * libm::cos(self.roller_angle_rad)
    }

    /// Stiffness of its contact with the ground \[N/m\] for contacts of its mass with this natural frequency in Hz: its
    /// own, or `m (2 pi f)^2`.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("chugo7")?;
    /// let stiffness = vehicle.wheel[0].contact_stiffness_n_m(200.0); // of 1 kg
    /// assert!((stiffness - 1.579e6).abs() < 1e3);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn contact_stiffness_n_m(&self, contact_frequency_hz: f64) -> f64 {
        let swing = std::f64::consts::TAU * contact_frequency_hz;
        self.contact_stiffness_n_m.unwrap_or(self.mass_kg * swing * swing)
    }

    /// Width \[m\]: the file's, or half the radius.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("chugo7")?;
    /// assert_eq!(vehicle.wheel[0].width_m(), 0.033);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn width_m(&self) -> f64 {
        self.width_m.unwrap_or(0.5 * self.radius_m)
    }
}
