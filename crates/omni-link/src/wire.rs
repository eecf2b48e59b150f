//! The types of omni-core in a message: field after field, numbers of a fixed size.
//!
//! Therefore each message has one length, and lost bytes are detected.

use omni_core::geometry::WheelTorques;
use omni_core::loops::WheelSample;
use omni_core::motor::TorqueRanges;
use omni_core::{BodyTwist, WheelVelocities};
use serde::{Deserialize, Serialize};

/// A number of 4 bytes; postcard's own would be of 1 to 5.
pub(crate) mod plain {
    use postcard::fixint::le;
    use serde::{Deserializer, Serializer};

    // Never inlined: there are also many of these.
    #[inline(never)]
    pub(crate) fn serialize<S: Serializer>(value: &u32, serializer: S) -> Result<S::Ok, S::Error> {
        le::serialize(value, serializer)
    }

    #[inline(never)]
    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
        le::deserialize(deserializer)
    }
}

/// As many numbers or marks as there are wheels, without their count.
pub(crate) mod each {
    use core::fmt;
    use core::marker::PhantomData;

    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    // Never inlined: an answer has a dozen of these.
    #[inline(never)]
    pub(crate) fn serialize<S: Serializer, T: Serialize, const N: usize>(
        values: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for value in values {
            tuple.serialize_element(value)?;
        }
        tuple.end()
    }

    #[inline(never)]
    pub(crate) fn deserialize<'de, D, T, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
    where
        D: Deserializer<'de>,
        T: Deserialize<'de> + Default + Copy,
    {
        deserializer.deserialize_tuple(N, Each(PhantomData))
    }

    struct Each<T, const N: usize>(PhantomData<T>);

    impl<'de, T: Deserialize<'de> + Default + Copy, const N: usize> Visitor<'de> for Each<T, N> {
        type Value = [T; N];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("one value a wheel")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[T; N], A::Error> {
            let mut values = [T::default(); N];
            for value in &mut values {
                *value = sequence
                    .next_element()?
                    .ok_or_else(|| A::Error::custom("one value a wheel"))?;
            }
            Ok(values)
        }
    }
}

/// The types whose fields are written out below, with the one parameter left that the derivation hands on.
mod of_f32 {
    pub(super) type WheelVelocities<const N: usize> = omni_core::WheelVelocities<f32, N>;
    pub(super) type WheelTorques<const N: usize> = omni_core::geometry::WheelTorques<f32, N>;
    pub(super) type TorqueRanges<const N: usize> = omni_core::motor::TorqueRanges<f32, N>;
    pub(super) type WheelSample<const N: usize> = omni_core::loops::WheelSample<f32, N>;
    pub(super) type ControlSample<const N: usize> = omni_core::loops::ControlSample<f32, N>;
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "BodyTwist<f32>")]
pub(crate) struct Twist {
    vx_m_s: f32,
    vy_m_s: f32,
    wz_rad_s: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "of_f32::WheelVelocities")]
pub(crate) struct Velocities<const N: usize> {
    #[serde(with = "each")]
    rad_s: [f32; N],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "of_f32::WheelTorques")]
struct Torques<const N: usize> {
    #[serde(with = "each")]
    n_m: [f32; N],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "of_f32::TorqueRanges")]
struct Ranges<const N: usize> {
    #[serde(with = "each")]
    lower_n_m: [f32; N],
    #[serde(with = "each")]
    upper_n_m: [f32; N],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "of_f32::WheelSample")]
struct Wheels<const N: usize> {
    #[serde(with = "Velocities")]
    reference: WheelVelocities<f32, N>,
    #[serde(with = "Velocities")]
    measured: WheelVelocities<f32, N>,
    #[serde(with = "each")]
    active: [bool; N],
    #[serde(with = "each")]
    p_n_m: [f32; N],
    #[serde(with = "each")]
    i_n_m: [f32; N],
    #[serde(with = "each")]
    d_n_m: [f32; N],
    #[serde(with = "each")]
    ff_n_m: [f32; N],
    #[serde(with = "Torques")]
    requested: WheelTorques<f32, N>,
    #[serde(with = "Torques")]
    applied: WheelTorques<f32, N>,
    #[serde(with = "Ranges")]
    range: TorqueRanges<f32, N>,
    #[serde(with = "each")]
    saturated: [bool; N],
    common_factor: f32,
    ended: bool,
    shorted: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "of_f32::ControlSample")]
pub(crate) struct Sample<const N: usize> {
    #[serde(with = "Twist")]
    command: BodyTwist<f32>,
    #[serde(with = "Wheels")]
    wheels: WheelSample<f32, N>,
}
