//! What sensors and actuators lack, and what fails while a run goes on.

use std::ops::Range;

use garde::Validate;
use omni_core::HeadingHoldConfig;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Vehicle;
use crate::encoder_velocity::EncoderVelocity;
use crate::kind_tables::deserialize_by_kind;
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{
    BIAS_RAD_S, DAMPING_N_M_S_RAD, DELAY_US, ENCODER_COUNTS, ENCODER_NOISE_RAD_S, GYRO_NOISE_RAD_S,
    HOLD_PER_S, LAG_S, MASS_KG, PLACE_M, SAG, SPEED_RAD_S, TIME_S, is_name, within,
};
use crate::suggestion::did_you_mean;

/// Encoders and the gyro; ideal by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Sensors {
    /// Counts of each encoder a turn of its actuator, up to 10 million; 0: no quantisation. With counts the measured velocity is the whole
    /// counts of the last control period over the period, unless `encoder_velocity` says otherwise.
    #[serde(deserialize_with = "crate::integers::encoder_counts")]
    #[garde(custom(within(ENCODER_COUNTS)))]
    #[cfg_attr(feature = "schema", schemars(range(min = ENCODER_COUNTS.min, max = ENCODER_COUNTS.max)))]
    pub encoder_counts: u32,
    /// How velocities are computed from counts, as in firmware with coarse encoders; left out: from the counts of one control
    /// period. Traction control filters those itself, but does not filter the result of this method.
    #[garde(dive)]
    pub encoder_velocity: Option<EncoderVelocity>,
    /// Standard deviation of normal noise on each measured velocity \[rad/s\], 0 to 100.
    #[garde(custom(within(ENCODER_NOISE_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = ENCODER_NOISE_RAD_S.min, max = ENCODER_NOISE_RAD_S.max)))]
    pub encoder_noise_rad_s: f64,
    /// Delay of all readings, gyro included, at the controller \[us\], a multiple of the control period, up to 100000.
    #[serde(deserialize_with = "crate::integers::delay_us")]
    #[garde(custom(within(DELAY_US)))]
    #[cfg_attr(feature = "schema", schemars(range(min = DELAY_US.min, max = DELAY_US.max)))]
    pub delay_us: u64,
    /// Standard deviation of normal noise on the gyro's rate \[rad/s\], 0 to 10.
    #[garde(custom(within(GYRO_NOISE_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = GYRO_NOISE_RAD_S.min, max = GYRO_NOISE_RAD_S.max)))]
    pub gyro_noise_rad_s: f64,
    /// Constant error of the gyro's rate \[rad/s\], -1 to 1.
    #[garde(custom(within(BIAS_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = BIAS_RAD_S.min, max = BIAS_RAD_S.max)))]
    pub gyro_bias_rad_s: f64,
    /// No encoders on the hinges: the controller gets none of their angles.
    #[garde(skip)]
    pub no_hinge_encoders: bool,
    /// No inertial measurement unit: the controller gets no attitude and no yaw rate of the base. A heading hold has its own gyro.
    #[garde(skip)]
    pub no_imu: bool,
}

/// What lies between the torque commanded and the torque at the wheel; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Actuators {
    /// Time constant of the torque, first order \[s\], 0 to 1.
    #[garde(custom(within(LAG_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = LAG_S.min, max = LAG_S.max)))]
    pub torque_lag_s: f64,
    /// Part of the supply's voltage that is lost while every motor gives its stall torque, 0 to 0.9; in proportion below that.
    /// The motors' torque-speed line falls with the voltage, unknown to the controller.
    #[garde(custom(within(SAG)))]
    #[cfg_attr(feature = "schema", schemars(range(min = SAG.min, max = SAG.max)))]
    pub voltage_sag: f64,
}

/// An outer loop that holds the heading: it compares the integrals of the commanded yaw rate and of a gyro's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct HeadingHold {
    /// Commanded yaw rate per heading error \[rad/s per rad\], 0.001 to 100.
    #[garde(custom(within(HOLD_PER_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = HOLD_PER_S.min, max = HOLD_PER_S.max)))]
    pub gain_per_s: f64,
    /// Largest correction \[rad/s\], 0.001 to 1000.
    #[garde(custom(within(SPEED_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = SPEED_RAD_S.min, max = SPEED_RAD_S.max)))]
    pub limit_rad_s: f64,
}

impl HeadingHold {
    /// What omni-core's loop is configured with.
    #[must_use]
    pub fn config<R: omni_core::Real>(&self, period_s: f64) -> HeadingHoldConfig<R> {
        HeadingHoldConfig {
            gain_per_s: R::of(self.gain_per_s),
            limit_rad_s: R::of(self.limit_rad_s),
            period_s: R::of(period_s),
        }
    }
}

/// A fault that begins at a time and, if `until_s` is given, ends again.
#[derive(Clone, Debug, PartialEq, Serialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// A motor gives no torque any more; its wheel turns freely.
    WheelLost {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// A wheel drags, as in section 3.3 of the paper: a torque against its turning.
    WheelDrag {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// Torque per speed \[N.m per rad/s\], 0 to 1e6.
        #[garde(custom(within(DAMPING_N_M_S_RAD)))]
        #[cfg_attr(feature = "schema", schemars(range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max)))]
        damper_n_m_s_rad: f64,
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// An encoder repeats its last reading.
    EncoderStuck {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// An encoder's readings do not arrive.
    EncoderSilent {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// No command arrives, as when the connection to the driver is lost. The loops keep the last command; a `[drive]` has a time-out.
    CommandLost {
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// Somebody presses the emergency stop of a `[drive]`, and releases it at the end.
    EmergencyStop {
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
        /// Until this time \[s\]; left out: to the end.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[garde(inner(custom(within(TIME_S))))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        until_s: Option<f64>,
    },
    /// A mass put on a body, at rest with it, for good.
    LoadAdded {
        /// The body's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        body: String,
        /// Mass \[kg\], 0.001 to 10000.
        #[garde(custom(within(MASS_KG)))]
        #[cfg_attr(feature = "schema", schemars(range(min = MASS_KG.min, max = MASS_KG.max)))]
        mass_kg: f64,
        /// Its place in the vehicle's frame as the vehicle stands on flat ground \[m\], -100 to 100.
        #[garde(custom(within(PLACE_M)))]
        #[cfg_attr(feature = "schema", schemars(inner(range(min = PLACE_M.min, max = PLACE_M.max))))]
        at_m: [f64; 3],
        /// From this time \[s\], 0 to 3600.
        #[garde(custom(within(TIME_S)))]
        #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
        from_s: f64,
    },
}

#[derive(Deserialize)]
#[serde(remote = "Fault", rename_all = "snake_case", deny_unknown_fields)]
enum FaultByKind {
    WheelLost {
        wheel: String,
        from_s: f64,
        until_s: Option<f64>,
    },
    WheelDrag {
        wheel: String,
        damper_n_m_s_rad: f64,
        from_s: f64,
        until_s: Option<f64>,
    },
    EncoderStuck {
        wheel: String,
        from_s: f64,
        until_s: Option<f64>,
    },
    EncoderSilent {
        wheel: String,
        from_s: f64,
        until_s: Option<f64>,
    },
    CommandLost {
        from_s: f64,
        until_s: Option<f64>,
    },
    EmergencyStop {
        from_s: f64,
        until_s: Option<f64>,
    },
    LoadAdded {
        body: String,
        mass_kg: f64,
        at_m: [f64; 3],
        from_s: f64,
    },
}
deserialize_by_kind!(Fault, FaultByKind);

impl Fault {
    /// From when up to when \[s\]; without an end up to infinity.
    ///
    /// ```
    /// use omni_config::Fault;
    /// let lost = Fault::CommandLost { from_s: 1.0, until_s: Some(2.0) };
    /// assert_eq!([0.5, 1.0, 2.0].map(|time_s| lost.span_s().contains(&time_s)), [false, true, false]);
    /// ```
    #[must_use]
    pub fn span_s(&self) -> Range<f64> {
        match self {
            Self::WheelLost { from_s, until_s, .. }
            | Self::WheelDrag { from_s, until_s, .. }
            | Self::EncoderStuck { from_s, until_s, .. }
            | Self::EncoderSilent { from_s, until_s, .. }
            | Self::CommandLost { from_s, until_s }
            | Self::EmergencyStop { from_s, until_s } => *from_s..until_s.unwrap_or(f64::INFINITY),
            Self::LoadAdded { from_s, .. } => *from_s..f64::INFINITY,
        }
    }

    /// The key and what is wrong with it, where the vehicle has no such part or the fault ends before it begins.
    pub(crate) fn refusal(&self, vehicle: &Vehicle) -> Option<(&'static str, String)> {
        let known = |key, name: &String, names: Vec<&str>| {
            (!names.contains(&name.as_str())).then(|| {
                let meant = did_you_mean(name, names.iter().copied());
                (key, format!("{name:?}{meant}, allowed: {}", names.join(", ")))
            })
        };
        let wheels = || vehicle.wheel.iter().map(|w| w.name.as_str()).collect();
        let bodies = || vehicle.body.iter().map(|b| b.name.as_str()).collect();
        let unknown = match self {
            Self::WheelLost { wheel, .. }
            | Self::WheelDrag { wheel, .. }
            | Self::EncoderStuck { wheel, .. }
            | Self::EncoderSilent { wheel, .. } => known("wheel", wheel, wheels()),
            Self::CommandLost { .. } | Self::EmergencyStop { .. } => None,
            Self::LoadAdded { body, .. } => known("body", body, bodies()),
        };
        let Range {
            start: from_s,
            end: until_s,
        } = self.span_s();
        unknown.or_else(|| {
            (until_s <= from_s).then(|| {
                (
                    "until_s",
                    format!("{until_s}, allowed: more than from_s, {from_s}"),
                )
            })
        })
    }
}
