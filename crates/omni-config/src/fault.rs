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
use crate::ranges::{self, DAMPING_N_M_S_RAD, MASS_KG, PART, PLACE_M, TIME_S, is_name};
use crate::suggestion::did_you_mean;

/// A table of keys that lasts: whatever else it has, it has one span, with the same two keys.
macro_rules! lasting {
    ($(#[$doc:meta])* $table:ident { $($(#[$key_is:meta])* $key:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
        #[cfg_attr(feature = "schema", derive(JsonSchema))]
        #[serde(deny_unknown_fields)]
        pub struct $table {
            $($(#[$key_is])* pub $key: $type,)*
            /// From this time \[s\], 0 to 3600.
            #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
            pub from_s: f64,
            /// Until this time \[s\]; left out: to the end.
            #[serde(skip_serializing_if = "Option::is_none")]
            #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
            pub until_s: Option<f64>,
        }

        impl $table {
            fn span_s(&self) -> Range<f64> {
                self.from_s..self.until_s.unwrap_or(f64::INFINITY)
            }
        }
    };
}

lasting! {
    /// When a fault lasts.
    FaultSpan {}
}

lasting! {
    /// A wheel, and when its fault lasts.
    WheelFault {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
    }
}

lasting! {
    /// A wheel, what is left of it, and when its fault lasts.
    WheelPart {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// Remaining fraction of the motor's torque, or of the rotation that the encoder counts, 0 to 1.
        #[garde(adapt(ranges), range(min = PART.min, max = PART.max))]
        part: f64,
    }
}

lasting! {
    /// A wheel that drags, and when.
    WheelDrag {
        /// The wheel's name.
        #[garde(custom(is_name))]
        #[cfg_attr(feature = "schema", schemars(regex(pattern = NAME)))]
        wheel: String,
        /// Torque per speed \[N.m per rad/s\], 0 to 1e6.
        #[garde(adapt(ranges), range(min = DAMPING_N_M_S_RAD.min, max = DAMPING_N_M_S_RAD.max))]
        damper_n_m_s_rad: f64,
    }
}

lasting! {
    /// Remaining fraction of the supply voltage, and its times.
    SupplyPart {
        /// Remaining fraction of the voltage, 0 to 1.
        #[garde(adapt(ranges), range(min = PART.min, max = PART.max))]
        part: f64,
    }
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
    #[garde(adapt(ranges), range(min = MASS_KG.min, max = MASS_KG.max))]
    pub mass_kg: f64,
    /// Its place in the vehicle's frame as the vehicle stands on flat ground \[m\], -100 to 100.
    #[garde(adapt(ranges), inner(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub at_m: [f64; 3],
    /// From this time \[s\], 0 to 3600.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub from_s: f64,
}

/// A fault that begins at a time and, if `until_s` is given, ends again.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Fault {
    /// A motor applies no torque any more; its wheel turns freely.
    WheelLost(WheelFault),
    /// A wheel drags, as in section 3.3 of the paper: a torque against its turning.
    WheelDrag(WheelDrag),
    /// A motor applies only a fraction of its torque at every speed, also when shorted. The controller does not know.
    MotorWeak(WheelPart),
    /// The supply provides only a fraction of its voltage: stall torque and no-load speed of all motors fall with it.
    /// The controller does not know.
    SupplySag(SupplyPart),
    /// The electronics of an encoder repeat its last reading: with encoder counts the count, which
    /// jumps to the shaft's at the end of the fault, without counts the velocity.
    EncoderStuck(WheelFault),
    /// An encoder counts no more, as with a cut supply: its count stands, and goes on from there at
    /// the end of the fault. Without encoder counts its velocity reads 0.
    EncoderDead(WheelFault),
    /// An encoder has lost one of its two channels: its count goes to and fro by one as the shaft
    /// turns. Only with encoder counts.
    EncoderToggles(WheelFault),
    /// The coupling of an encoder slips: the encoder turns by only a fraction of the shaft's rotation.
    EncoderSlips(WheelPart),
    /// An encoder's readings do not arrive.
    EncoderSilent(WheelFault),
    /// No command arrives, as when the connection to the driver is lost. The loops keep the last
    /// command; a `[drive]` has a time-out.
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
        self.parts().0.validate_into(context, parent, report);
    }
}

impl Fault {
    /// Its table, its wheel, and from when up to when it lasts \[s\].
    fn parts(&self) -> (&dyn Validate<Context = ()>, Option<&str>, Range<f64>) {
        match self {
            Self::WheelLost(fault)
            | Self::EncoderStuck(fault)
            | Self::EncoderDead(fault)
            | Self::EncoderToggles(fault)
            | Self::EncoderSilent(fault) => (fault, Some(&fault.wheel), fault.span_s()),
            Self::WheelDrag(fault) => (fault, Some(&fault.wheel), fault.span_s()),
            Self::MotorWeak(fault) | Self::EncoderSlips(fault) => (fault, Some(&fault.wheel), fault.span_s()),
            Self::SupplySag(fault) => (fault, None, fault.span_s()),
            Self::CommandLost(fault) | Self::EmergencyStop(fault) => (fault, None, fault.span_s()),
            Self::LoadAdded(fault) => (fault, None, fault.from_s..f64::INFINITY),
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
        self.parts().2
    }

    /// The wheel that has it; none if it is no wheel's.
    ///
    /// ```
    /// use omni_config::{Fault, WheelFault};
    /// let lost = Fault::WheelLost(WheelFault { wheel: "5".into(), from_s: 1.0, until_s: None });
    /// assert_eq!(lost.wheel(), Some("5"));
    /// ```
    #[must_use]
    pub fn wheel(&self) -> Option<&str> {
        self.parts().1
    }

    /// The key and its error, if the vehicle has no such part or the fault ends before it begins.
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
