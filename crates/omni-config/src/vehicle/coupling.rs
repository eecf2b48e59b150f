//! Hinges that turn together, as a file says it.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{self, DAMPING_N_M_S_RAD, RATIO, STIFFNESS_N_M_RAD, is_name, one};

/// Two hinges that turn together: `angle_a + ratio * angle_b = 0`, held by a stiff spring and a
/// damper whose torques on the hinges are equal and opposite. With ratio 1 on the hinges of two
/// rockers it is a differential: the angle of the body that carries both is the mean of theirs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Coupling {
    /// Name, unique among couplings.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub name: String,
    /// The one hinge.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub hinge_a: String,
    /// The other.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub hinge_b: String,
    /// Factor of the angle of `hinge_b`, -1000 to 1000 and not 0; 1 if left out.
    #[serde(default = "one")]
    #[garde(adapt(ranges), range(min = RATIO.min, max = RATIO.max))]
    pub ratio: f64,
    /// Torque on hinge a per angle of deviation \[N.m/rad\], 0.001 to 1e9; left out: the value with which the coupled
    /// bodies alone would oscillate at 100 Hz.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = STIFFNESS_N_M_RAD.min, max = STIFFNESS_N_M_RAD.max))]
    pub stiffness_n_m_rad: Option<f64>,
    /// The same per rate of that angle \[N.m.s/rad\], 0 to 1e6; left out: half of critical for that oscillation.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
    pub damping_n_m_s_rad: Option<f64>,
}
