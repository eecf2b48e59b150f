//! How torque ends when the command is rest.

use garde::Validate;
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{self, BLEED_S, HOLD_TORQUE_SQUARED_N2M2S, TIME_S};

/// How torque ends while rest is commanded: in a stop, after a time-out. By default it falls to 0
/// within half a second, whatever is measured, and a vehicle on a slope then rolls. A hold on the
/// slope is bounded by time and torque squared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Rest {
    /// Time within which every torque falls to 0 \[s\], 0 to 10; 0.5 by default.
    #[garde(adapt(ranges), range(min = BLEED_S.min, max = BLEED_S.max))]
    pub bleed_s: f64,
    /// Time before that in which the wheels are held \[s\], 0 to 3600; 0 by default.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub hold_s: f64,
    /// The hold also ends when the sum over the wheels of the integral of torque squared reaches
    /// this \[N^2.m^2.s\], 0 to 1e9; above 0 if `hold_s` is, 0 by default.
    #[garde(adapt(ranges), range(min = HOLD_TORQUE_SQUARED_N2M2S.min, max = HOLD_TORQUE_SQUARED_N2M2S.max))]
    pub hold_torque_squared_n2m2s: f64,
    /// Shorts the windings of every motor when its torque has ended, so that the motors brake a vehicle that
    /// still rolls; false by default. A `[drive]` does so in a safe stop and in an emergency stop by itself.
    #[garde(skip)]
    pub short_windings: bool,
}

impl Default for Rest {
    fn default() -> Self {
        let omni_core::loops::Rest {
            bleed_s,
            hold_s,
            hold_torque_squared_n2m2s,
            short_windings,
            ..
        } = omni_core::loops::Rest::default();
        Self {
            bleed_s,
            hold_s,
            hold_torque_squared_n2m2s,
            short_windings,
        }
    }
}

impl Rest {
    /// Longest duration of a torque once every reference is 0 \[s\]: `hold_s` and `bleed_s`.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let rest = Scenario::load("flat", &[Override::parse("control.rest.bleed_s=0.3")?])?.control.rest;
    /// assert_eq!(rest.torque_ends_s(), 0.3);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn torque_ends_s(&self) -> f64 {
        self.hold_s + self.bleed_s
    }

    /// As omni-core has it.
    pub(crate) fn rule<R: omni_core::Real>(&self) -> omni_core::loops::Rest<R> {
        let mut rule =
            omni_core::loops::Rest::hold(R::of(self.hold_s), R::of(self.hold_torque_squared_n2m2s));
        rule.bleed_s = R::of(self.bleed_s);
        rule.short_windings = self.short_windings;
        rule
    }
}

#[cfg(test)]
mod tests {
    use crate::{Override, Scenario};

    #[test]
    fn holding_without_a_bound_of_torque_squared_is_refused_by_key() {
        let scenario =
            Scenario::load("flat", &[Override::new("control.rest.hold_s", 30.0)]).expect("each key alone");
        let error = scenario
            .controller::<f64, 7>()
            .map(drop)
            .expect_err("refused")
            .to_string();
        assert!(
            error.contains(
                "rest.hold_torque_squared_n2m2s = 0, allowed: above 0, up to 1e9, where hold_s is above 0"
            ),
            "{error}"
        );
    }
}
