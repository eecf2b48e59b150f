//! Motors: torques in, duty and direction out.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

/// A brushed motor on a bridge without a current loop, described by its torque at rest and at whole duty
/// (k U / R: torque constant, supply voltage, resistance) and by what speed takes off it (k^2 / R).
///
/// They are the two numbers of the vehicle file's `[motor]`. The simulator takes the limits of the torque from them, the
/// firmware also the duty: `torque = stall * duty - slope * velocity`, solved for the duty. For an amplifier that has a
/// current loop, and so takes a torque as it is, `slope_n_m_s_rad` is 0 and `stall_torque_n_m` that at whole duty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Torque at rest and whole duty \[N.m\], > 0.
    pub stall_torque_n_m: f32,
    /// Torque lost per speed \[N.m per rad/s\], >= 0.
    pub slope_n_m_s_rad: f32,
}

impl Motor {
    /// The duty, -1 to 1, that gives `torque_n_m` \[N.m\] at `velocity_rad_s` \[rad/s\], or the nearest there is; 0 for
    /// what is not a number.
    #[must_use]
    pub fn duty(&self, torque_n_m: f32, velocity_rad_s: f32) -> f32 {
        let duty = (torque_n_m + self.slope_n_m_s_rad * velocity_rad_s) / self.stall_torque_n_m;
        if duty.is_nan() { 0.0 } else { duty.clamp(-1.0, 1.0) }
    }
}

/// A pin or a PWM channel did not do what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorFailed;

/// A bridge with three inputs: PWM, direction and enable. With enable low it is open and the motor gives no torque; with
/// enable high and no duty it shorts the motor, which brakes. So zero torque is enable low, not zero duty.
#[derive(Debug)]
pub struct MotorDriver<P, D> {
    motor: Motor,
    pwm: P,
    direction: D,
    enable: D,
}

impl<P: SetDutyCycle, D: OutputPin> MotorDriver<P, D> {
    /// A driver; `direction` is high where a positive torque is wanted.
    #[must_use]
    pub const fn new(motor: Motor, pwm: P, direction: D, enable: D) -> Self {
        Self {
            motor,
            pwm,
            direction,
            enable,
        }
    }

    /// Gives `torque_n_m` \[N.m\] while the wheel turns with `velocity_rad_s` \[rad/s\].
    ///
    /// # Errors
    /// A pin or the PWM failed. What the motor does now is not known: [`MotorDriver::let_go`].
    pub fn apply(&mut self, torque_n_m: f32, velocity_rad_s: f32) -> Result<(), MotorFailed> {
        let duty = self.motor.duty(torque_n_m, velocity_rad_s);
        let whole = self.pwm.max_duty_cycle();
        // To the nearest; the cast saturates. More than `whole` makes some drivers panic.
        let count = ((duty.abs() * f32::from(whole) + 0.5) as u16).min(whole);
        // A timer takes a new duty at the end of its PWM period, a pin at once: for up to 50 us the new direction has the old
        // duty. That is too short to feel.
        self.direction
            .set_state((duty >= 0.0).into())
            .map_err(|_| MotorFailed)?;
        self.pwm.set_duty_cycle(count).map_err(|_| MotorFailed)?;
        self.enable.set_high().map_err(|_| MotorFailed)
    }

    /// No torque: opens the bridge. All that can be done is tried, whatever fails.
    ///
    /// # Errors
    /// A pin or the PWM failed.
    pub fn let_go(&mut self) -> Result<(), MotorFailed> {
        let open = self.enable.set_low().is_ok();
        let none = self.pwm.set_duty_cycle_fully_off().is_ok();
        if open && none { Ok(()) } else { Err(MotorFailed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTOR: Motor = Motor {
        stall_torque_n_m: 2.0,
        slope_n_m_s_rad: 0.25,
    };

    #[test]
    fn duty_makes_up_for_what_speed_takes() {
        // 0.5 of 2 N.m at rest; at 4 rad/s 1 N.m more is needed for the same.
        assert_eq!(MOTOR.duty(0.5, 0.0), 0.25);
        assert_eq!(MOTOR.duty(0.5, 4.0), 0.75);
        assert_eq!(MOTOR.duty(-0.5, -4.0), -0.75);
        assert_eq!(MOTOR.duty(-1.0, 4.0), 0.0); // a shorted motor brakes with slope * velocity by itself
    }

    #[test]
    fn duty_saturates() {
        assert_eq!(MOTOR.duty(2.0, 4.0), 1.0);
        assert_eq!(MOTOR.duty(-7.0, 0.0), -1.0);
        assert_eq!(MOTOR.duty(f32::INFINITY, 0.0), 1.0);
    }

    #[test]
    fn what_is_not_a_number_is_no_duty() {
        assert_eq!(MOTOR.duty(f32::NAN, 0.0), 0.0);
        assert_eq!(MOTOR.duty(0.0, f32::NAN), 0.0);
        assert_eq!(MOTOR.duty(f32::INFINITY, f32::NEG_INFINITY), 0.0);
    }
}
