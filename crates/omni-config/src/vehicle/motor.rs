//! The motors of a vehicle, by their data sheets.

use garde::Validate;
use omni_core::TorqueLimit;
use omni_core::motor::{GearFriction, Gearbox};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{
    self, DAMPING_N_M_S_RAD, EFFICIENCY, GEAR_FRICTION_N_M, NO_LOAD_RAD_S, NO_LOAD_RPM, STALL_TORQUE_N_M, one,
};

/// Keys of which a file must set exactly one.
const LINE: [&str; 3] = ["slope_n_m_s_rad", "no_load_rpm", "no_load_rad_s"];

/// Torque-speed line of every actuator, four-quadrant: its torque at rest, and either the slope of torque over speed
/// or the no-load speed. Both are the actuator's, before the wheel's `gear`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[cfg_attr(feature = "schema", schemars(extend("oneOf" = LINE.map(|key| serde_json::json!({ "required": [key] })))))]
#[cfg_attr(feature = "schema", schemars(transform = super::completion::schema::motor))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Motor {
    /// Torque at rest \[N.m\], 1e-6 to 1e6; or in kg.cm or oz.in, under `stall_torque_kg_cm` or `stall_torque_oz_in`.
    #[garde(adapt(ranges), range(min = STALL_TORQUE_N_M.min, max = STALL_TORQUE_N_M.max))]
    pub stall_torque_n_m: f64,
    /// Torque lost per speed while driving \[N.m per rad/s\], 0 to 1e6; 0 for a constant limit.
    /// Exactly one of this, `no_load_rpm` and `no_load_rad_s`.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub slope_n_m_s_rad: Option<f64>,
    /// No-load speed in turns per minute, as in data sheets, 0.001 to 1e6, instead of `slope_n_m_s_rad`.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = NO_LOAD_RPM.min, max = NO_LOAD_RPM.max))]
    pub no_load_rpm: Option<f64>,
    /// No-load speed \[rad/s\], 1e-4 to 1e5, instead of `slope_n_m_s_rad`.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = NO_LOAD_RAD_S.min, max = NO_LOAD_RAD_S.max))]
    pub no_load_rad_s: Option<f64>,
    /// Torque limit of the motor driver \[N.m\], 1e-6 to the stall torque, at every
    /// speed: the corner of a current limit. Left out: the stall torque.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = STALL_TORQUE_N_M.min, max = STALL_TORQUE_N_M.max))]
    pub torque_limit_n_m: Option<f64>,
    /// Dry (Coulomb) friction of the gear at the wheel \[N.m\], 0 to 1e6: equal at every speed, also at rest. The
    /// torque-speed line does not include it. 0 by default.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = GEAR_FRICTION_N_M.min, max = GEAR_FRICTION_N_M.max))]
    pub gear_friction_n_m: f64,
    /// Viscous friction at the wheel \[N.m per rad/s of the wheel\], 0 to 1e6; 0 by default.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub viscous_n_m_s_rad: f64,
    /// Efficiency of the gear, 0.01 to 1: driving, the wheel receives this fraction of the torque; driven by the
    /// ground, the motor receives this fraction. 1 by default.
    #[serde(default = "one")]
    #[garde(adapt(ranges), range(min = EFFICIENCY.min, max = EFFICIENCY.max))]
    pub efficiency: f64,
}

impl Motor {
    /// Torque lost per speed while driving \[N.m per rad/s\], for either key of the file: with a no-load speed, the
    /// stall torque over it. 0 for a constant limit.
    ///
    /// ```
    /// let motor = omni_config::Vehicle::load("omni3")?.motor;
    /// assert_eq!((motor.slope_n_m_s_rad, motor.line_slope_n_m_s_rad()), (Some(0.03), 0.03));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn line_slope_n_m_s_rad(&self) -> f64 {
        match (self.slope_n_m_s_rad, self.line_end_rad_s()) {
            (Some(slope), _) => slope,
            (None, Some(no_load)) => self.stall_torque_n_m / no_load,
            (None, None) => 0.0, // no file is loaded without
        }
    }

    /// Speed at which no torque is left \[rad/s\]; none for a constant limit.
    ///
    /// ```
    /// use omni_config::{FileKind, Source, Vehicle};
    /// let text = FileKind::Vehicle.template("omni3")?.replace("slope_n_m_s_rad = 0.03 ", "no_load_rpm = 200.0");
    /// let motor = Vehicle::from_source(&Source::text("mine.toml", &*text), &[])?.motor;
    /// let no_load = motor.line_end_rad_s().expect("it says so");
    /// assert!((no_load - 20.944).abs() < 1e-3); // 200 turns a minute
    /// assert!((motor.line_slope_n_m_s_rad() - 1.0 / no_load).abs() < 1e-15); // of 1 N.m at rest
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn line_end_rad_s(&self) -> Option<f64> {
        let by_slope = || {
            let slope = self.slope_n_m_s_rad.filter(|slope| *slope > 0.0)?;
            Some(self.stall_torque_n_m / slope)
        };
        self.no_load_rad_s
            .or_else(|| self.no_load_rpm.map(|rpm| rpm * (std::f64::consts::PI / 30.0)))
            .or_else(by_slope)
    }

    /// Largest torque \[N.m\]: the stall torque, or the limit of its driver.
    ///
    /// ```
    /// use omni_config::{Override, Source, Vehicle};
    /// let limited = Override::parse("motor.torque_limit_n_m=0.4")?;
    /// let motor = Vehicle::from_source(&Source::vehicle("omni3", None)?, &[limited])?.motor;
    /// assert_eq!((motor.stall_torque_n_m, motor.peak_torque_n_m()), (1.0, 0.4));
    /// let limit = motor.limit::<f64>()?;
    /// assert_eq!(limit.range(10.0).upper_n_m, 0.4); // the line has 0.7 N.m there
    /// assert!((limit.range(30.0).upper_n_m - 0.1).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn peak_torque_n_m(&self) -> f64 {
        self.torque_limit_n_m.unwrap_or(self.stall_torque_n_m)
    }

    /// The limit that the controller works with.
    ///
    /// # Errors
    /// As [`TorqueLimit::line`] and [`TorqueLimit::capped`].
    pub fn limit<R: omni_core::Real>(&self) -> Result<TorqueLimit<R>, omni_core::ConfigError> {
        TorqueLimit::line(R::of(self.stall_torque_n_m), R::of(self.line_slope_n_m_s_rad()))?
            .capped(R::of(self.peak_torque_n_m()))
    }

    /// Losses of the gear of a wheel with this `gear` (wheel turns per motor turn); none without losses.
    ///
    /// # Errors
    /// As [`Gearbox::new`] and [`GearFriction::new`]; a loaded vehicle has been checked.
    ///
    /// ```
    /// use omni_config::{Override, Vehicle, Source};
    /// let keys = [Override::parse("motor.gear_friction_n_m=0.04")?, Override::parse("motor.efficiency=0.8")?];
    /// let motor = Vehicle::from_source(&Source::vehicle("omni3", None)?, &keys)?.motor;
    /// let gear = motor.gear_friction(0.05).expect("in range").expect("it has some");
    /// assert!((gear.output_torque(0.1, 10.0) - (0.1 * 20.0 * 0.8 - 0.04)).abs() < 1e-12);
    /// assert_eq!(Vehicle::load("omni3")?.motor.gear_friction(1.0), Ok(None));
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn gear_friction(&self, gear: f64) -> Result<Option<GearFriction<f64>>, omni_core::ConfigError> {
        if self.gear_friction_n_m == 0.0 && self.viscous_n_m_s_rad == 0.0 && self.efficiency == 1.0 {
            return Ok(None);
        }
        let gearbox = Gearbox::new(1.0 / gear, self.efficiency)?;
        GearFriction::new(gearbox, self.gear_friction_n_m, self.viscous_n_m_s_rad).map(Some)
    }

    /// Its error across several keys.
    pub(super) fn refusal(&self) -> Option<String> {
        if let Some(limit) = self
            .torque_limit_n_m
            .filter(|limit| *limit > self.stall_torque_n_m)
        {
            let stall = self.stall_torque_n_m;
            return Some(format!(
                "torque_limit_n_m = {limit}, allowed: up to the stall torque, {stall}"
            ));
        }
        let values = [self.slope_n_m_s_rad, self.no_load_rpm, self.no_load_rad_s];
        let given = LINE
            .iter()
            .zip(values)
            .filter_map(|(key, value)| Some((key, value?)));
        let given: Vec<_> = given.map(|(key, value)| format!("{key} = {value}")).collect();
        let allowed = format!("allowed: exactly one of {}", LINE.join(", "));
        match given.as_slice() {
            [_] => None,
            [] => Some(format!("the slope of torque over speed is missing, {allowed}")),
            several => Some(format!("{} together, {allowed}", several.join(" and "))),
        }
    }
}
