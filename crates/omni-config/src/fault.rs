//! Faults that occur during a run.

use std::ops::Range;

use garde::{Path, Report, Validate};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Vehicle;
use crate::kind_tables::deserialize_by_kind;
#[cfg(feature = "schema")]
use crate::ranges::NAME;
use crate::ranges::{DAMPING_N_M_S_RAD, MASS_KG, PART, PLACE_M, TIME_S, is_name, within};
use crate::suggestion::did_you_mean;

/// When a fault lasts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct FaultSpan {
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
    /// Until this time \[s\]; left out: to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(TIME_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub until_s: Option<f64>,
}

/// A wheel, and when its fault lasts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WheelFault {
    /// The wheel's name.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub wheel: String,
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
    /// Until this time \[s\]; left out: to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(TIME_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub until_s: Option<f64>,
}

/// A wheel, what is left of it, and when its fault lasts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WheelPart {
    /// The wheel's name.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub wheel: String,
    /// What is left: of the motor's torque, or of the turning that the encoder counts, 0 to 1.
    #[garde(custom(within(PART)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PART.min, max = PART.max)))]
    pub part: f64,
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
    /// Until this time \[s\]; left out: to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(TIME_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub until_s: Option<f64>,
}

/// A wheel that drags, and when.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WheelDrag {
    /// The wheel's name.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub wheel: String,
    /// Torque per speed \[N.m per rad/s\], 0 to 1e6.
    #[garde(custom(within(DAMPING_N_M_S_RAD)))]
    #[cfg_attr(feature = "schema", schemars(range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max)))]
    pub damper_n_m_s_rad: f64,
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
    /// Until this time \[s\]; left out: to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(TIME_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub until_s: Option<f64>,
}

/// What is left of the supply's voltage, and when.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SupplyPart {
    /// What is left of the voltage, 0 to 1.
    #[garde(custom(within(PART)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PART.min, max = PART.max)))]
    pub part: f64,
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
    /// Until this time \[s\]; left out: to the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[garde(inner(custom(within(TIME_S))))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub until_s: Option<f64>,
}

/// A mass that is put on a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AddedLoad {
    /// The body's name.
    #[garde(custom(is_name))]
    #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
    pub body: String,
    /// Mass \[kg\], 0.001 to 10000.
    #[garde(custom(within(MASS_KG)))]
    #[cfg_attr(feature = "schema", schemars(range(min = MASS_KG.min, max = MASS_KG.max)))]
    pub mass_kg: f64,
    /// Its place in the vehicle's frame as the vehicle stands on flat ground \[m\], -100 to 100.
    #[garde(custom(within(PLACE_M)))]
    #[cfg_attr(feature = "schema", schemars(inner(range(min = PLACE_M.min, max = PLACE_M.max))))]
    pub at_m: [f64; 3],
    /// From this time \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub from_s: f64,
}

/// A fault that begins at a time and, if `until_s` is given, ends again.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// A motor gives no torque any more; its wheel turns freely.
    WheelLost(WheelFault),
    /// A wheel drags, as in section 3.3 of the paper: a torque against its turning.
    WheelDrag(WheelDrag),
    /// A motor gives only a part of its torque at every speed, also shorted. The controller does not know.
    MotorWeak(WheelPart),
    /// The supply has only a part of its voltage: stall torque and no-load speed of all motors fall with it. The controller does not know.
    SupplySag(SupplyPart),
    /// The electronics of an encoder repeat its last reading: with encoder counts the count, which jumps to the shaft's at the end of the fault, without counts the velocity.
    EncoderStuck(WheelFault),
    /// An encoder counts no more, as with a cut supply: its count stands, and goes on from there at the end of the fault. Without encoder counts its velocity reads 0.
    EncoderDead(WheelFault),
    /// An encoder has lost one of its two channels: its count goes to and fro by one as the shaft turns. Only with encoder counts.
    EncoderToggles(WheelFault),
    /// The coupling of an encoder slips: it turns by only a part of what the shaft turns.
    EncoderSlips(WheelPart),
    /// An encoder's readings do not arrive.
    EncoderSilent(WheelFault),
    /// No command arrives, as when the connection to the driver is lost. The loops keep the last command; a `[drive]` has a time-out.
    CommandLost(FaultSpan),
    /// The emergency stop of a `[drive]` is pressed, and released at the end.
    EmergencyStop(FaultSpan),
    /// A mass put on a body, at rest with it, for good.
    LoadAdded(AddedLoad),
}

#[derive(Deserialize)]
#[serde(remote = "Fault", rename_all = "snake_case")]
enum FaultByKind {
    WheelLost(WheelFault),
    WheelDrag(WheelDrag),
    MotorWeak(WheelPart),
    SupplySag(SupplyPart),
    EncoderStuck(WheelFault),
    EncoderDead(WheelFault),
    EncoderToggles(WheelFault),
    EncoderSlips(WheelPart),
    EncoderSilent(WheelFault),
    CommandLost(FaultSpan),
    EmergencyStop(FaultSpan),
    LoadAdded(AddedLoad),
}
deserialize_by_kind!(Fault, FaultByKind);

/// Of an enum derived code would put the place within its kind into the path of a key.
impl Validate for Fault {
    type Context = ();

    fn validate_into(&self, context: &(), parent: &mut dyn FnMut() -> Path, report: &mut Report) {
        match self {
            Self::WheelLost(fault)
            | Self::EncoderStuck(fault)
            | Self::EncoderDead(fault)
            | Self::EncoderToggles(fault)
            | Self::EncoderSilent(fault) => fault.validate_into(context, parent, report),
            Self::WheelDrag(fault) => fault.validate_into(context, parent, report),
            Self::MotorWeak(fault) | Self::EncoderSlips(fault) => {
                fault.validate_into(context, parent, report)
            }
            Self::SupplySag(fault) => fault.validate_into(context, parent, report),
            Self::CommandLost(fault) | Self::EmergencyStop(fault) => {
                fault.validate_into(context, parent, report);
            }
            Self::LoadAdded(fault) => fault.validate_into(context, parent, report),
        }
    }
}

impl Fault {
    /// Its wheel, and from when and until when it lasts \[s\].
    fn parts(&self) -> (Option<&str>, f64, Option<f64>) {
        match self {
            Self::WheelLost(fault)
            | Self::EncoderStuck(fault)
            | Self::EncoderDead(fault)
            | Self::EncoderToggles(fault)
            | Self::EncoderSilent(fault) => (Some(&fault.wheel), fault.from_s, fault.until_s),
            Self::WheelDrag(fault) => (Some(&fault.wheel), fault.from_s, fault.until_s),
            Self::MotorWeak(fault) | Self::EncoderSlips(fault) => {
                (Some(&fault.wheel), fault.from_s, fault.until_s)
            }
            Self::SupplySag(fault) => (None, fault.from_s, fault.until_s),
            Self::CommandLost(fault) | Self::EmergencyStop(fault) => (None, fault.from_s, fault.until_s),
            Self::LoadAdded(fault) => (None, fault.from_s, None),
        }
    }

    /// From when up to when \[s\]; without an end up to infinity.
    ///
    /// ```
    /// use omni_config::{Fault, FaultSpan};
    /// let lost = Fault::CommandLost(FaultSpan { from_s: 1.0, until_s: Some(2.0) });
    /// assert_eq!([0.5, 1.0, 2.0].map(|time_s| lost.span_s().contains(&time_s)), [false, true, false]);
    /// ```
    #[must_use]
    pub fn span_s(&self) -> Range<f64> {
        let (_, from_s, until_s) = self.parts();
        from_s..until_s.unwrap_or(f64::INFINITY)
    }

    /// The wheel that has it; none where it is no wheel's.
    ///
    /// ```
    /// use omni_config::{Fault, WheelFault};
    /// let lost = Fault::WheelLost(WheelFault { wheel: "5".into(), from_s: 1.0, until_s: None });
    /// assert_eq!(lost.wheel(), Some("5"));
    /// ```
    #[must_use]
    pub fn wheel(&self) -> Option<&str> {
        self.parts().0
    }

    /// The key and what is wrong with it, where the vehicle has no such part or the fault ends before it begins.
    pub(crate) fn refusal(&self, vehicle: &Vehicle) -> Option<(&'static str, String)> {
        let known = |key, name: &str, names: Vec<&str>| {
            (!names.contains(&name)).then(|| {
                let meant = did_you_mean(name, names.iter().copied());
                (key, format!("{name:?}{meant}, allowed: {}", names.join(", ")))
            })
        };
        let unknown = match (self.wheel(), self) {
            (Some(wheel), _) => {
                let wheels = vehicle.wheel.iter().map(|w| w.name.as_str());
                known("wheel", wheel, wheels.collect())
            }
            (None, Self::LoadAdded(load)) => {
                let bodies = vehicle.body.iter().map(|b| b.name.as_str());
                known("body", &load.body, bodies.collect())
            }
            _ => None,
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
