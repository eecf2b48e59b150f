//! The spring and damper of a contact, in MuJoCo's words.
//!
//! MuJoCo's contact force f and acceleration a obey `R f + a = -b v - k r`, with v the speed and r the
//! depth of touch, both negative where surfaces sink, and `R = (1 - d) / d` times the inverse mass that it
//! counts for the bodies in touch: a spring of k / R, a damper of b / R and, against quick changes, a mass
//! of 1 / R. d is `solimp`, `-k d` and `-b d` are `solref` ("Solver parameters" of MuJoCo's documentation).

use super::numbers::{number, numbers};

/// Fraction of a contact's speed that its damper removes in a step: large enough to act within few steps, and small
/// enough not to oscillate.
const DAMPED: f64 = 0.4;
/// Values of `solimp` that leave both the constraint and its softness in the digits that the solver has.
const SOLIMP: [f64; 2] = [0.05, 0.99];

/// A contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// `-k d` \[1/s^2\] and `-b d` \[1/s\].
    solref: [f64; 2],
    /// d.
    solimp: f64,
}

impl Contact {
    /// A spring \[N/m\] and damper \[N.s/m\] of rollers with an inverse mass \[1/kg\], for steps of this length \[s\].
    pub(super) fn new([spring_n_m, damper_n_s_m]: [f64; 2], mobility_per_kg: f64, step_s: f64) -> Self {
        let soft_per_kg = DAMPED / (damper_n_s_m * step_s);
        let [least, most] = SOLIMP;
        let solimp = (mobility_per_kg / (mobility_per_kg + soft_per_kg)).clamp(least, most);
        let resistance_per_kg = mobility_per_kg * (1.0 - solimp) / solimp;
        Self {
            solref: [spring_n_m, damper_n_s_m].map(|force| -force * resistance_per_kg * solimp),
            solimp,
        }
    }

    /// `solref` and `solimp`.
    pub(super) fn words(&self) -> [String; 2] {
        let d = number(self.solimp);
        [numbers(&self.solref), format!("{d} {d} 0.001")]
    }
}
