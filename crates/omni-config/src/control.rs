//! The controller of a scenario: coordination policy, replaced parts, period and scalar.

use garde::{Path, Report, Validate};
use omni_core::loops::{AntiWindup, Integral, Saturation};
use omni_core::{Coordination, Real};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::ranges::{self, CLIMBS_M, MAX_RETRIES, PART, Range, TRACKING_S, WINDUP_N_M, ZONE_RAD_S, within};
use crate::rest::Rest;
use crate::suggestion::did_you_mean;

/// The scalar that the controller computes in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Precision {
    /// `f32`, as in firmware.
    F32,
    /// `f64`.
    #[default]
    F64,
}

/// How requested torques are brought within the limits: [`Saturation`].
///
/// In files `"clip"`, `"scale_torques"` or `{ scale_references = { floor = 0.3 } }`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum SaturationLaw {
    /// Each wheel is cut to its own limit.
    Clip,
    /// All torques are multiplied by one factor.
    ScaleTorques,
    /// All references are multiplied by one factor.
    ScaleReferences {
        /// The least factor, 0 to 1.
        #[cfg_attr(feature = "schema", schemars(range(min = PART.min, max = PART.max)))]
        floor: f64,
    },
}

/// Which error is integrated: [`Integral`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum IntegralLaw {
    /// Each wheel's own error.
    PerWheel,
    /// The part of the errors that a motion of the vehicle explains.
    Shared,
}

/// Anti-windup of the integrals: [`AntiWindup`].
///
/// In files a name, such as `"conditional"`, or a name with its keys, such as `{ clamp = { limit_n_m = 1.0 } }`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum AntiWindupLaw {
    /// No anti-windup.
    None,
    /// An error that drives a saturated output further beyond its limit is not integrated.
    Conditional,
    /// The integrals use the reference for which the loops would have requested exactly the applied torques.
    Conditioned,
    /// Integral terms stay within a limit.
    Clamp {
        /// Largest integral term of a loop \[N.m\], 0 to 1e6; the motor's stall torque if left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[cfg_attr(feature = "schema", schemars(range(min = WINDUP_N_M.min, max = WINDUP_N_M.max)))]
        limit_n_m: Option<f64>,
    },
    /// Integrals follow the applied torques.
    BackCalculation {
        /// Time constant \[s\], from the control period to 1e6; kp / ki of the vehicle if left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[cfg_attr(feature = "schema", schemars(range(min = TRACKING_S.min, max = TRACKING_S.max)))]
        tracking_time_s: Option<f64>,
    },
}

/// Of an enum derived code would leave the law out of the path of a key.
impl Validate for SaturationLaw {
    type Context = ();

    fn validate_into(&self, _: &(), parent: &mut dyn FnMut() -> Path, report: &mut Report) {
        if let Self::ScaleReferences { floor } = self {
            check(["scale_references", "floor"], *floor, PART, parent, report);
        }
    }
}

/// As of [`SaturationLaw`].
impl Validate for AntiWindupLaw {
    type Context = ();

    fn validate_into(&self, _: &(), parent: &mut dyn FnMut() -> Path, report: &mut Report) {
        match self {
            Self::Clamp {
                limit_n_m: Some(limit),
            } => {
                check(["clamp", "limit_n_m"], *limit, WINDUP_N_M, parent, report);
            }
            Self::BackCalculation {
                tracking_time_s: Some(time),
            } => {
                check(
                    ["back_calculation", "tracking_time_s"],
                    *time,
                    TRACKING_S,
                    parent,
                    report,
                );
            }
            _ => {}
        }
    }
}

/// Checks the range of a key inside a law.
fn check(
    [law, key]: [&'static str; 2],
    value: f64,
    range: Range,
    parent: &mut dyn FnMut() -> Path,
    report: &mut Report,
) {
    if let Err(error) = within(range)(&value, &()) {
        report.append(parent().join(law).join(key), error);
    }
}

/// The controller.
///
/// A policy is a named point of a grid; `saturation`, `integral` and `anti_windup` replace its parts one by one,
/// `integral_zone_rad_s` and `proportional_limit_n_m` bound terms of its loops.
///
/// ```
/// use omni_config::{Override, Scenario};
/// use omni_core::loops::{Integral, Saturation};
/// let keys = ["control.policy=scale_references", "control.saturation.scale_references.floor=0.5", "control.integral=shared"];
/// let keys = keys.iter().map(|key| Override::parse(key)).collect::<Result<Vec<_>, _>>()?;
/// let own = Scenario::load("flat", &keys)?;
/// let law = own.coordination::<f64>()?;
/// assert_eq!((law.saturation, law.integral), (Saturation::ScaleReferences { floor: 0.5 }, Integral::Shared));
/// assert_eq!(own.control.law(), "scale_references+saturation=scale_references+floor=0.5+integral=shared");
/// # Ok::<(), omni_config::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Control {
    /// Name of a policy, one of [`POLICIES`]. If left out, or `"auto"`: traction control with the available sensors, or
    /// `scale_references` if traction control would be rejected; a loaded scenario contains the chosen policy's name,
    /// and [`crate::Scenario::auto_policy`] states the reason.
    #[garde(custom(known_policy))]
    #[cfg_attr(feature = "schema", schemars(extend("enum" = [&[AUTO], &POLICIES[..]].concat())))]
    pub policy: String,
    /// Method that brings torques within limits; the policy's own method if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub saturation: Option<SaturationLaw>,
    /// The error that is integrated; the policy's own choice if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(skip)]
    pub integral: Option<IntegralLaw>,
    /// Anti-windup, `none` if left out. With references that are scaled: `conditioned` if left out,
    /// or `clamp` in addition.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub anti_windup: Option<AntiWindupLaw>,
    /// Integral zone \[rad/s\], 0 to 1e6: errors up to this are integrated, larger ones set the
    /// integrals to 0; every error counts if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = ZONE_RAD_S.min, max = ZONE_RAD_S.max))]
    pub integral_zone_rad_s: Option<f64>,
    /// Largest proportional term of a loop \[N.m\], 0 to 1e6; unlimited if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = WINDUP_N_M.min, max = WINDUP_N_M.max))]
    pub proportional_limit_n_m: Option<f64>,
    /// Retries at each row of wheels with `traction` and `traction_runup`, 0 to 100; 8 if left out.
    /// With 0 a stuck vehicle stays stuck.
    #[serde(
        skip_serializing_if = "Option::is_none",
        deserialize_with = "crate::integers::max_retries"
    )]
    #[garde(adapt(ranges), range(min = MAX_RETRIES.min, max = MAX_RETRIES.max))]
    pub max_retries: Option<u32>,
    /// Highest edge that the vehicle climbs with `traction` and `traction_runup`, by its climb chart \[m\], 0.001 to
    /// 10. Where a wheel has climbed a higher one, there is one retry at most. Only with `odometry.kind = "ground"`,
    /// which measures edges; a controller at the other end of a link does not get them.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = CLIMBS_M.min, max = CLIMBS_M.max))]
    pub climbs_m: Option<f64>,
    /// Control period \[us\], a multiple of the physics step, 1 to 100 000; 1000 by default. A file has it in seconds.
    #[serde(
        rename = "period_s",
        deserialize_with = "crate::microseconds::period",
        serialize_with = "crate::microseconds::write"
    )]
    #[garde(skip)]
    #[cfg_attr(feature = "schema", schemars(with = "f64", description = "Control period [s]: whole microseconds, a multiple of the physics step, 1e-6 to 0.1; 0.001 if left out.", range(min = crate::ranges::PERIOD_S.min, max = crate::ranges::PERIOD_S.max)))]
    pub period_us: u64,
    /// Scalar of the controller.
    #[garde(skip)]
    pub precision: Precision,
    /// How torque ends while rest is commanded.
    #[garde(dive)]
    pub rest: Rest,
}

impl Default for Control {
    /// The best policy that vehicle and sensors allow, at 1 kHz.
    fn default() -> Self {
        Self {
            policy: AUTO.into(),
            saturation: None,
            integral: None,
            anti_windup: None,
            integral_zone_rad_s: None,
            proportional_limit_n_m: None,
            max_retries: None,
            climbs_m: None,
            period_us: 1000,
            precision: Precision::default(),
            rest: Rest::default(),
        }
    }
}

/// Names of every policy: the presets of [`Coordination`], then the presets of traction control
/// ([`omni_core::traction::Traction`]), the best last.
///
/// ```
/// assert_eq!(omni_config::POLICIES.last(), Some(&"traction"));
/// ```
pub const POLICIES: [&str; 6] = {
    let [independent, scale_torques, scale_references, shared_integral] = Coordination::<f64>::PRESETS;
    [
        independent,
        scale_torques,
        scale_references,
        shared_integral,
        TRACTION_RUNUP,
        TRACTION,
    ]
};
/// Whichever policy suits a scenario.
pub(crate) const AUTO: &str = "auto";
/// The presets of traction control.
pub(crate) const TRACTION: &str = "traction";
const TRACTION_RUNUP: &str = "traction_runup";
/// Of the loops, those that keep the ratios of the wheels' speeds.
pub(crate) const LOOPS: &str = "scale_references";

/// The policy that `control.policy = "auto"` is in a scenario.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AutoPolicy {
    /// Its name.
    pub policy: &'static str,
    /// Why it is not traction control, in a clause; none if it is.
    pub because: Option<String>,
    /// Inputs that traction control lacks, one line each, as in
    /// [`Scenario::traction_notes`](crate::Scenario::traction_notes).
    pub without: Vec<String>,
}

impl AutoPolicy {
    pub(crate) fn traction() -> Self {
        Self {
            policy: TRACTION,
            because: None,
            without: Vec::new(),
        }
    }

    pub(crate) fn loops(because: String) -> Self {
        Self {
            policy: LOOPS,
            because: Some(because),
            without: Vec::new(),
        }
    }
}

/// A preset of traction control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TractionPreset {
    Traction,
    TractionRunup,
}

/// Description of a policy, in one line.
///
/// ```
/// for policy in omni_config::POLICIES {
///     assert!(omni_config::policy_in_a_line(policy).len() > 20, "{policy}");
/// }
/// assert_eq!(omni_config::policy_in_a_line("unknown"), "");
/// ```
#[must_use]
pub fn policy_in_a_line(policy: &str) -> &'static str {
    match policy {
        "independent" => {
            "plain PID: each wheel's torque is cut to its own limit, and each loop has its own integral"
        }
        "scale_torques" => {
            "the paper's eqs. (11) and (12): all torques are scaled by the factor of the most saturated wheel"
        }
        "scale_references" => {
            "all references are scaled together, down to 0.3, so that no wheel saturates: keeps the speed ratios"
        }
        "shared_integral" => {
            "each wheel's torque is cut to its own limit, and the wheels share one integral: least heat of the loops"
        }
        TRACTION => {
            "traction control: the same thrust on all driven wheels, less where one slips, and retries if stuck: little slip and heat"
        }
        TRACTION_RUNUP => {
            "as traction, but every retry is faster and spins up the climbing row: highest steps, needs spare motor speed"
        }
        _ => "",
    }
}

/// Keys that replace parts of a policy, in the order of its name.
const PARTS: [&str; 7] = [
    "saturation",
    "integral",
    "anti_windup",
    "integral_zone_rad_s",
    "proportional_limit_n_m",
    "max_retries",
    "climbs_m",
];
/// Those of traction control, which has none of the others.
const OF_TRACTION: [&str; 2] = ["max_retries", "climbs_m"];

/// A key and what is wrong with it.
type Refusal = (&'static str, String);

impl Control {
    /// The policy's name with all replaced parts, as in rows, tables and logs.
    #[must_use]
    pub fn law(&self) -> String {
        let parts = self.parts().into_iter();
        let parts = parts.map(|(key, value)| format!("+{key}={value}"));
        self.policy.clone() + &parts.collect::<String>()
    }

    /// Is it a preset and nothing else?
    #[must_use]
    pub fn is_preset(&self) -> bool {
        self.parts().is_empty()
    }

    /// Does a key of a scenario, as `control.integral`, say what the policy is?
    ///
    /// ```
    /// use omni_config::Control;
    /// let keys = ["control.policy", "control.saturation.scale_references.floor", "control.period_s", "seed"];
    /// assert_eq!(keys.map(Control::is_of_policy), [true, true, false, false]);
    /// ```
    #[must_use]
    pub fn is_of_policy(key: &str) -> bool {
        let name = key
            .strip_prefix("control.")
            .and_then(|rest| rest.split('.').next());
        name.is_some_and(|name| name == "policy" || PARTS.contains(&name))
    }

    /// The replaced parts of the policy, as written.
    fn parts(&self) -> Vec<(&'static str, String)> {
        // A table of numbers and names, which can be written.
        let Ok(Value::Table(table)) = Value::try_from(self) else {
            return Vec::new();
        };
        let of = |key: &'static str| Some((key, written(table.get(key)?)));
        PARTS.into_iter().filter_map(of).collect()
    }

    /// The first key of the wheels' loops, which traction control lacks.
    pub(crate) fn part_of_loops(&self) -> Option<&'static str> {
        let mut keys = self.parts().into_iter().map(|(key, _)| key);
        keys.find(|key| !OF_TRACTION.contains(key))
    }

    /// A key that only traction control has is set.
    pub(crate) fn requires_traction(&self) -> bool {
        self.parts().iter().any(|(key, _)| OF_TRACTION.contains(key))
    }

    /// Another preset, with nothing chosen instead of its parts.
    pub(crate) fn be_preset(&mut self, policy: &str) {
        *self = Self {
            policy: policy.into(),
            period_us: self.period_us,
            precision: self.precision,
            rest: self.rest,
            ..Self::default()
        };
    }

    /// The preset of traction control; none if the wheels have loops of their own.
    pub(crate) fn traction(&self) -> Option<TractionPreset> {
        match self.policy.as_str() {
            TRACTION => Some(TractionPreset::Traction),
            TRACTION_RUNUP => Some(TractionPreset::TractionRunup),
            _ => None,
        }
    }

    /// Coordination of the wheels' loops; none if the policy is unknown. Traction control has no such
    /// loops: asked for them all the same, for their kinematics, it yields loops that are each on their own.
    pub(crate) fn coordination<R: Real>(&self) -> Option<Coordination<R>> {
        if self.traction().is_some() {
            return Some(Coordination::independent());
        }
        let preset = Coordination::<R>::preset(&self.policy)?;
        let saturation = match self.saturation {
            None => preset.saturation,
            Some(SaturationLaw::Clip) => Saturation::Clip,
            Some(SaturationLaw::ScaleTorques) => Saturation::ScaleTorques,
            Some(SaturationLaw::ScaleReferences { floor }) => {
                Saturation::ScaleReferences { floor: R::of(floor) }
            }
        };
        let integral = match self.integral {
            Some(IntegralLaw::PerWheel) => Integral::PerWheel,
            Some(IntegralLaw::Shared) => Integral::Shared,
            None => preset.integral,
        };
        Some(Coordination::new(saturation, integral))
    }

    /// How integrals are kept from winding up; `kp / ki` and the stall torque are the vehicle's.
    pub(crate) fn anti_windup<R: Real>(&self, kp_over_ki_s: f64, stall_n_m: f64) -> AntiWindup<R> {
        match self.anti_windup {
            None | Some(AntiWindupLaw::None) => AntiWindup::None,
            Some(AntiWindupLaw::Conditional) => AntiWindup::Conditional,
            Some(AntiWindupLaw::Conditioned) => AntiWindup::Conditioned,
            Some(AntiWindupLaw::Clamp { limit_n_m }) => AntiWindup::Clamp {
                limit_n_m: R::of(limit_n_m.unwrap_or(stall_n_m)),
            },
            Some(AntiWindupLaw::BackCalculation { tracking_time_s }) => AntiWindup::BackCalculation {
                tracking_time_s: R::of(tracking_time_s.unwrap_or(kp_over_ki_s)),
            },
        }
    }

    /// A key that the policy does not look at.
    pub(crate) fn refusal(&self) -> Option<Refusal> {
        let has_loops = self.traction().is_none();
        let other = |(key, _): &Refusal| OF_TRACTION.contains(key) == has_loops;
        if let Some((key, value)) = self.parts().into_iter().find(other) {
            let policies = Coordination::<f64>::PRESETS.join(", ");
            let allowed = if has_loops {
                format!("control.policy = \"{TRACTION}\" or \"{TRACTION_RUNUP}\"")
            } else {
                format!("a policy of wheel speed loops: {policies}")
            };
            return Some((key, format!("{value}, allowed: only with {allowed}")));
        }
        let saturation = self.coordination::<f64>()?.saturation;
        let scales = matches!(saturation, Saturation::ScaleReferences { .. });
        match self.anti_windup? {
            AntiWindupLaw::Clamp { .. } | AntiWindupLaw::Conditioned => None,
            law if scales => {
                let name = Value::try_from(law).map_or_else(|_| String::new(), |law| written(&law));
                let message = format!("{name}, allowed: conditioned or clamp where references are scaled");
                Some(("anti_windup", message))
            }
            _ => None,
        }
    }
}

/// A value as names of laws have it: `clip`, `0.5`, or `clamp+limit_n_m=1` of a law with its keys.
fn written(value: &Value) -> String {
    match value {
        Value::String(name) => name.clone(),
        Value::Float(number) => number.to_string(),
        Value::Table(law) => {
            let inside = |keys: &Value| {
                let keys = keys.as_table().into_iter().flatten();
                keys.map(|(key, value)| format!("+{key}={}", written(value)))
                    .collect::<String>()
            };
            law.iter()
                .map(|(name, keys)| name.clone() + &inside(keys))
                .collect()
        }
        other => other.to_string(),
    }
}

fn known_policy(value: &str, _: &()) -> garde::Result {
    if value == AUTO || POLICIES.contains(&value) {
        return Ok(());
    }
    let meant = did_you_mean(value, POLICIES);
    Err(garde::Error::new(format!(
        "{value:?}{meant}, allowed: {}",
        known_policies()
    )))
}

/// Allowed names of a policy, in one line.
pub(crate) fn known_policies() -> String {
    format!("{AUTO}, {}", POLICIES.join(", "))
}

#[cfg(test)]
mod tests;
