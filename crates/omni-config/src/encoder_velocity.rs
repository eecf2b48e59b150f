//! How velocities are computed from encoder counts.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::kind_tables::deserialize_by_kind;
use crate::ranges::{self, BANDWIDTH_RAD_S, WINDOW_PERIODS};

/// Method that computes a velocity from whole counts: one of [`omni_core::estimate::VelocityMethod`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum EncoderVelocity {
    /// Counts of the last control periods over their time.
    Window {
        /// Control periods, 1 to 32.
        #[garde(adapt(ranges), range(min = WINDOW_PERIODS.min, max = WINDOW_PERIODS.max))]
        periods: u16,
    },
    /// Counts between edges over the time between them, the edges being stamped by a timer (period
    /// measurement, the M/T method).
    Edges {},
    /// A second-order tracking observer.
    Observer {
        /// Bandwidth \[rad/s\], 0.001 to 1 over the control period.
        #[garde(adapt(ranges), range(min = BANDWIDTH_RAD_S.min, max = BANDWIDTH_RAD_S.max))]
        bandwidth_rad_s: f64,
    },
}

#[derive(Deserialize)]
#[serde(remote = "EncoderVelocity", rename_all = "snake_case", deny_unknown_fields)]
enum EncoderVelocityByKind {
    Window {
        #[serde(deserialize_with = "crate::integers::window_periods")]
        periods: u16,
    },
    Edges {},
    Observer {
        bandwidth_rad_s: f64,
    },
}
deserialize_by_kind!(EncoderVelocity, EncoderVelocityByKind);
