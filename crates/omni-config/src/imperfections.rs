//! Imperfections of sensors and actuators.

use garde::Validate;
use omni_core::shaping::HeadingHoldConfig;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoder_velocity::EncoderVelocity;
use crate::ranges::{
    self, ACCELEROMETER_BIAS_M_S2, ACCELEROMETER_NOISE_M_S2, ATTITUDE_BIAS_RAD, ATTITUDE_WALK_RAD_PER_SQRT_S,
    BIAS_RAD_S, ENCODER_NOISE_RAD_S, GYRO_NOISE_RAD_S, HOLD_PER_S, LAG_S, SAG, SPEED_RAD_S,
    is_encoder_counts,
};

/// Encoders and the inertial measurement unit; ideal by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Sensors {
    /// Counts of each encoder a turn of its actuator, 1 to 10 million, fractions allowed (a gear motor may have
    /// 537.7); 0: no quantisation. With counts the measured velocity is the whole counts of the last control
    /// period over the period, unless `encoder_velocity` says otherwise; exactly 0 if the counter has stayed within two
    /// counts for 0.1 s, or for the time of three counts at 0.25 rad/s if that is longer.
    #[garde(custom(is_encoder_counts))]
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0, max = crate::ranges::ENCODER_COUNTS.max)))]
    pub encoder_counts: f64,
    /// How velocities are computed from counts, as in firmware with coarse encoders; left out: from the counts of
    /// one control period. Traction control filters those itself, but does not filter the result of this method.
    #[garde(dive)]
    pub encoder_velocity: Option<EncoderVelocity>,
    /// Standard deviation of normal noise on each measured velocity \[rad/s\], 0 to 100.
    #[garde(adapt(ranges), range(min = ENCODER_NOISE_RAD_S.min, max = ENCODER_NOISE_RAD_S.max))]
    pub encoder_noise_rad_s: f64,
    /// Delay of all readings, gyro included, at the controller \[us\], a multiple of the control
    /// period, up to 100 000. A file has it in seconds.
    #[serde(
        rename = "delay_s",
        deserialize_with = "crate::microseconds::delay",
        serialize_with = "crate::microseconds::write"
    )]
    #[garde(skip)]
    #[cfg_attr(feature = "schema", schemars(with = "f64", description = "Delay of all readings, gyro included, at the controller [s]: a multiple of the control period, up to 0.1.", range(min = crate::ranges::DELAY_S.min, max = crate::ranges::DELAY_S.max)))]
    pub delay_us: u64,
    /// Standard deviation of normal noise on the gyro's rate \[rad/s\], 0 to 10.
    #[garde(adapt(ranges), range(min = GYRO_NOISE_RAD_S.min, max = GYRO_NOISE_RAD_S.max))]
    pub gyro_noise_rad_s: f64,
    /// Constant error of the gyro's rate \[rad/s\], -1 to 1.
    #[garde(adapt(ranges), range(min = BIAS_RAD_S.min, max = BIAS_RAD_S.max))]
    pub gyro_bias_rad_s: f64,
    /// Standard deviation of normal noise on each axis of the accelerometer \[m/s^2\], 0 to 100.
    #[garde(adapt(ranges), range(min = ACCELEROMETER_NOISE_M_S2.min, max = ACCELEROMETER_NOISE_M_S2.max))]
    pub accelerometer_noise_m_s2: f64,
    /// Constant error of each axis of the accelerometer \[m/s^2\], -10 to 10.
    #[garde(adapt(ranges), range(min = ACCELEROMETER_BIAS_M_S2.min, max = ACCELEROMETER_BIAS_M_S2.max))]
    pub accelerometer_bias_m_s2: f64,
    /// Constant error of the measured roll and pitch \[rad\], -0.5 to 0.5.
    #[garde(adapt(ranges), range(min = ATTITUDE_BIAS_RAD.min, max = ATTITUDE_BIAS_RAD.max))]
    pub attitude_bias_rad: f64,
    /// Random walk of the measured roll and pitch \[rad per root of s\], 0 to 0.1.
    #[garde(adapt(ranges), range(min = ATTITUDE_WALK_RAD_PER_SQRT_S.min, max = ATTITUDE_WALK_RAD_PER_SQRT_S.max))]
    pub attitude_walk_rad_per_sqrt_s: f64,
    /// No encoders on the hinges: the controller receives none of their angles.
    #[garde(skip)]
    pub no_hinge_encoders: bool,
    /// No inertial measurement unit: the controller receives no attitude and no yaw rate of the base. A heading hold
    /// has its own gyro.
    #[garde(skip)]
    pub no_imu: bool,
}

/// Actuator effects between the commanded torque and the torque at the wheel; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Actuators {
    /// Time constant of the torque, first order \[s\], 0 to 1.
    #[garde(adapt(ranges), range(min = LAG_S.min, max = LAG_S.max))]
    pub torque_lag_s: f64,
    /// Fraction of the supply voltage that is lost while every motor applies its stall torque, 0 to 0.9; in proportion
    /// below that. The motors' torque-speed line falls with the voltage, unknown to the controller.
    #[garde(adapt(ranges), range(min = SAG.min, max = SAG.max))]
    pub voltage_sag: f64,
}

/// An outer loop that holds the heading: it compares the integrals of the commanded yaw rate and of a gyro's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct HeadingHold {
    /// Commanded yaw rate per heading error \[rad/s per rad\], 0.001 to 100.
    #[garde(adapt(ranges), range(min = HOLD_PER_S.min, max = HOLD_PER_S.max))]
    pub gain_per_s: f64,
    /// Largest correction \[rad/s\], 0.001 to 1000.
    #[garde(adapt(ranges), range(min = SPEED_RAD_S.min, max = SPEED_RAD_S.max))]
    pub limit_rad_s: f64,
}

impl HeadingHold {
    /// Configuration of omni-core's loop.
    #[must_use]
    pub fn config<R: omni_core::Real>(&self, period_s: f64) -> HeadingHoldConfig<R> {
        HeadingHoldConfig {
            gain_per_s: R::of(self.gain_per_s),
            limit_rad_s: R::of(self.limit_rad_s),
            period_s: R::of(period_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Override, Scenario};

    #[test]
    fn counts_of_a_turn_may_be_a_fraction_and_are_none_or_at_least_one() {
        let counts = |value: &str| {
            let key = Override::new("sensors.encoder_counts", value.parse::<f64>().expect("a number"));
            Scenario::load("flat", &[key]).map(|scenario| scenario.sensors.encoder_counts)
        };
        assert_eq!(counts("537.7").expect("in range"), 537.7);
        assert_eq!(counts("0").expect("none"), 0.0);
        for value in ["0.5", "-2", "20000000", "nan"] {
            let said = counts(value).expect_err("refused").to_string();
            let shown = value.replace("nan", "NaN");
            let expected =
                format!("built-in flat: sensors.encoder_counts: {shown}, allowed: 0, or 1 to 10000000");
            assert_eq!(said, expected);
        }
    }
}
