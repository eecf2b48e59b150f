//! The message rates of a run's log.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{self, LOG_HZ};

/// Messages per second of each topic; 0: none; more than there are control periods: one in each period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct LogRates {
    /// `/vehicle_state` \[Hz\], 0 to 1e6; left out: every control period, which replay needs.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vehicle_state_hz: Option<f64>,
    /// `/tf` \[Hz\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    pub tf_hz: f64,
    /// `/joint_states` \[Hz\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    pub joint_states_hz: f64,
    /// `/odom` and `/ground_truth/odom` \[Hz\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    pub odom_hz: f64,
    /// `/cmd_vel` \[Hz\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    pub cmd_vel_hz: f64,
    /// `/markers` \[Hz\], 0 to 1e6.
    #[garde(adapt(ranges), range(min = LOG_HZ.min, max = LOG_HZ.max))]
    pub markers_hz: f64,
}

impl Default for LogRates {
    /// Every control period, and 50 Hz for what is looked at.
    fn default() -> Self {
        Self {
            vehicle_state_hz: None,
            tf_hz: 50.0,
            joint_states_hz: 50.0,
            odom_hz: 50.0,
            cmd_vel_hz: 50.0,
            markers_hz: 50.0,
        }
    }
}
