//! What is said on the CAN bus: frames with 11-bit identifiers, numbers little-endian.
//!
//! | identifier | bytes | contents |
//! |---|---|---|
//! | 0x100, in | 8 | `i16` vx \[mm/s\], `i16` vy \[mm/s\], `i16` wz \[mrad/s\], `u8` counter, `u8` 0 |
//! | 0x180, out | 8 | `i16` torque of wheel 1 to 4 \[mN.m\], as given to the motors |
//! | 0x181, out | 8 | `i16` velocity of wheel 1 to 4 \[0.01 rad/s\], as measured |
//! | 0x182, out | 8 | `u8` [`Mode`], `u8` wheels driven (bit 0 is wheel 1), `u16` frames ignored, `u16` errors of hardware, `u8` counter, `u8` 0 |
//!
//! A twist in one frame cannot be torn apart: half of a new one with half of an old one. -32768 stands for
//! "not a number"; who scales floating-point numbers must send it for NaN, as [`scaled`] does, because a
//! bare cast makes a plausible 0 of it. The command's counter goes up by one with every frame (255, then 0).
//! A sender that hangs, with its last frame repeated by the hardware, stands still in it and sends nothing.

use embedded_can::{Frame, Id, StandardId};
use omni_core::BodyTwist;

/// Identifier of the command.
pub const COMMAND: StandardId = identifier(0x100);
/// Identifier of the torques.
pub const TORQUES: StandardId = identifier(0x180);
/// Identifier of the velocities.
pub const VELOCITIES: StandardId = identifier(0x181);
/// Identifier of the status.
pub const STATUS: StandardId = identifier(0x182);

const NOT_A_NUMBER: i16 = i16::MIN;

const fn identifier(raw: u16) -> StandardId {
    match StandardId::new(raw) {
        Some(id) => id,
        None => panic!("more than 11 bits"), // while compiling
    }
}

/// What the vehicle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// No torque until a command to stand still has come: after the start, and after an error of the motors.
    Held = 0,
    /// A command is followed, as fast as the limits allow.
    Driving = 1,
    /// The last command is too old: coming to rest, or at rest.
    TimedOut = 2,
}

/// A command as it arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The twist wanted.
    pub twist: BodyTwist<f32>,
    /// The sender's counter.
    pub counter: u8,
}

/// Is this frame addressed to [`COMMAND`]? Others on the bus are no concern of ours.
pub fn is_command(frame: &impl Frame) -> bool {
    frame.id() == Id::Standard(COMMAND)
}

/// The command in a frame; none where the frame is remote, has not 8 bytes, has a last byte other
/// than 0 or a number that is none.
pub fn command(frame: &impl Frame) -> Option<Command> {
    if frame.is_remote_frame() {
        return None;
    }
    let &[x0, x1, y0, y1, z0, z1, counter, 0] = frame.data() else {
        return None;
    };
    let component = |bytes| match i16::from_le_bytes(bytes) {
        NOT_A_NUMBER => None,
        thousandths => Some(f32::from(thousandths) * 1e-3),
    };
    Some(Command {
        twist: BodyTwist {
            vx_m_s: component([x0, x1])?,
            vy_m_s: component([y0, y1])?,
            wz_rad_s: component([z0, z1])?,
        },
        counter,
    })
}

/// The bytes of a command: what the sender sends.
#[must_use]
pub fn command_bytes(command: &Command) -> [u8; 8] {
    let [x, y, z] = command.twist.to_array().map(|v| scaled(v, 1e3).to_le_bytes());
    [x[0], x[1], y[0], y[1], z[0], z[1], command.counter, 0]
}

/// A number for each wheel, `per_unit` of them to the unit.
#[must_use]
pub fn wheels(values: &[f32; 4], per_unit: f32) -> [u8; 8] {
    let [a, b, c, d] = values.map(|v| scaled(v, per_unit).to_le_bytes());
    [a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]]
}

/// `value` in steps of which there are `per_unit` to the unit: to the nearest, -32767 to 32767, -32768 for NaN.
#[must_use]
pub fn scaled(value: f32, per_unit: f32) -> i16 {
    let steps = value * per_unit;
    if steps.is_nan() {
        NOT_A_NUMBER
    } else {
        // Casts cut off towards 0 and saturate.
        let half = if steps < 0.0 { -0.5 } else { 0.5 };
        ((steps + half) as i16).max(-i16::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_saturate() {
        assert_eq!([0.0014, 0.0016, -0.0016].map(|v| scaled(v, 1e3)), [1, 2, -2]);
        assert_eq!([100.0, -100.0].map(|v| scaled(v, 1e3)), [32_767, -32_767]);
        assert_eq!(scaled(f32::NEG_INFINITY, 1e3), -32_767);
        assert_eq!(scaled(f32::NAN, 1e3), NOT_A_NUMBER);
    }

    #[test]
    fn the_lower_byte_comes_first() {
        assert_eq!(
            wheels(&[0.258, -0.001, 0.0, 0.001], 1e3),
            [2, 1, 255, 255, 0, 0, 1, 0]
        );
    }
}
