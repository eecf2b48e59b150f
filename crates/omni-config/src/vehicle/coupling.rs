//! Hinges that turn together: what a file says of them, and the spring and damper that hold them.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Vehicle;
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{DAMPING_N_M_S_RAD, RATIO, STIFFNESS_N_M_RAD, is_name, one, within};

/// Swing of the coupled bodies against each other, were they held by nothing else \[Hz\]: far above what a vehicle does
/// (some Hz), and still resolved by twenty physics steps of the usual 0.5 ms.
const DEFAULT_HZ: f64 = 100.0;
/// Of critical damping: a swing dies within one period.
const DEFAULT_DAMPING_RATIO: f64 = 0.5;

/// Two hinges that turn together: `angle_a + ratio * angle_b = 0`, held by a stiff spring and a damper whose torques on the
/// hinges are equal and opposite. With ratio 1 on the hinges of two rockers it is a differential: the angle of the body that
/// carries both is the mean of theirs.
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
    #[garde(custom(within(RATIO)))]
    #[cfg_attr(feature = "schema", schemars(range(min = RATIO.min, max = RATIO.max)))]
    pub ratio: f64,
    /// Torque on hinge a per angle of deviation \[N.m/rad\], 0.001 to 1e9; left out: the value with which the coupled
    /// bodies alone would oscillate at 100 Hz.
    #[serde(default)]
    #[garde(inner(custom(within(STIFFNESS_N_M_RAD))))]
    #[cfg_attr(feature = "schema", schemars(range(min = STIFFNESS_N_M_RAD.min, max = STIFFNESS_N_M_RAD.max)))]
    pub stiffness_n_m_rad: Option<f64>,
    /// The same per rate of that angle \[N.m.s/rad\], 0 to 1e6; left out: half of critical for that oscillation.
    #[serde(default)]
    #[garde(inner(custom(within(DAMPING_N_M_S_RAD))))]
    #[cfg_attr(feature = "schema", schemars(range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max)))]
    pub damping_n_m_s_rad: Option<f64>,
}

/// A coupling's spring and damper, as simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CouplingSpring {
    /// Inertia that the coupled bodies oppose to `angle_a + ratio * angle_b` when nothing else holds them \[kg.m^2\].
    pub inertia_kg_m2: f64,
    /// Torque on hinge a per angle \[N.m/rad\].
    pub stiffness_n_m_rad: f64,
    /// Torque on hinge a per rate \[N.m.s/rad\].
    pub damping_n_m_s_rad: f64,
}

impl CouplingSpring {
    /// The longest physics step that resolves it \[s\].
    ///
    /// Torques of a step follow from the angles before it: `J x'' + c x' + k x = 0` then stays bounded while
    /// `k dt^2 + 2 c dt < 4 J`. Half of that is allowed. Hinges and wheels only add to J.
    #[must_use]
    pub fn longest_step_s(&self) -> f64 {
        let (j, k, c) = (self.inertia_kg_m2, self.stiffness_n_m_rad, self.damping_n_m_s_rad);
        // The positive root of k dt^2 + 2 c dt = 2 J, in the form that keeps its digits.
        2.0 * j / (c + (c * c + 2.0 * j * k).sqrt())
    }
}

impl Vehicle {
    /// The spring and damper of one of its couplings, keys that were left out resolved.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("rocker_bogie6")?;
    /// let spring = vehicle.coupling_spring(&vehicle.coupling[0]);
    /// let swing_hz = (spring.stiffness_n_m_rad / spring.inertia_kg_m2).sqrt() / std::f64::consts::TAU;
    /// assert!((swing_hz - 100.0).abs() < 1e-9);
    /// assert!(spring.longest_step_s() > 500e-6); // the usual physics step resolves it
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn coupling_spring(&self, coupling: &Coupling) -> CouplingSpring {
        // A unit torque of the coupling turns every body by the sum of its shares over the body's inertia.
        let mut shares = vec![[0.0; 3]; self.body.len()];
        for (name, factor) in [(&coupling.hinge_a, 1.0), (&coupling.hinge_b, coupling.ratio)] {
            let Some(hinge) = self.hinge.iter().find(|hinge| hinge.name == *name) else {
                continue; // a loaded vehicle names hinges that exist
            };
            let [x, y, z] = hinge.axis;
            let length = (x * x + y * y + z * z).sqrt();
            for (body, sign) in [(&hinge.child, 1.0), (&hinge.parent, -1.0)] {
                if let Some(i) = self.body.iter().position(|b| b.name == *body) {
                    for (share, axis) in shares[i].iter_mut().zip(hinge.axis) {
                        *share += sign * factor * axis / length;
                    }
                }
            }
        }
        let mobility = |(body, share): (&super::Body, &[f64; 3])| {
            let inertia = body.inertia_kg_m2();
            (0..3)
                .map(|axis| share[axis] * share[axis] / inertia[axis])
                .sum::<f64>()
        };
        let inertia_kg_m2 = 1.0 / self.body.iter().zip(&shares).map(mobility).sum::<f64>();
        let swing = std::f64::consts::TAU * DEFAULT_HZ;
        CouplingSpring {
            inertia_kg_m2,
            stiffness_n_m_rad: coupling
                .stiffness_n_m_rad
                .unwrap_or(inertia_kg_m2 * swing * swing),
            damping_n_m_s_rad: coupling
                .damping_n_m_s_rad
                .unwrap_or(2.0 * DEFAULT_DAMPING_RATIO * inertia_kg_m2 * swing),
        }
    }
}
