//! Motors: torques in, duty and direction out.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use omni_core::TorqueLimit;

/// A pin or a PWM channel did not do what was commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorFailed;

/// A bridge with three inputs: PWM, direction and enable. With enable low it is open and the motor gives no torque;
/// with enable high and no duty it shorts the motor, which brakes. So zero torque is enable low, not zero duty.
///
/// The duty is [`TorqueLimit::duty`]'s, from the vehicle file's `[motor]`. For an amplifier that has a current
/// loop, and so takes a torque as it is, give it a limit without a slope, whose stall torque is that at whole duty.
#[derive(Debug)]
pub struct MotorDriver<P, D> {
    motor: TorqueLimit<f32>,
    pwm: P,
    direction: D,
    enable: D,
}

impl<P: SetDutyCycle, D: OutputPin> MotorDriver<P, D> {
    /// A driver; `direction` is high where a positive torque is wanted.
    #[must_use]
    pub const fn new(motor: TorqueLimit<f32>, pwm: P, direction: D, enable: D) -> Self {
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
    /// A pin or the PWM failed. What the motor does now is not known: [`MotorDriver::release`].
    pub fn apply(&mut self, torque_n_m: f32, velocity_rad_s: f32) -> Result<(), MotorFailed> {
        let duty = self.motor.duty(torque_n_m, velocity_rad_s);
        let whole = self.pwm.max_duty_cycle();
        // To the nearest; the cast saturates. More than `whole` makes some drivers panic.
        let count = ((duty.abs() * f32::from(whole) + 0.5) as u16).min(whole);
        // A timer takes a new duty at the end of its PWM period, a pin at once: for up to 50 us the
        // new direction has the old duty. That is too short to feel.
        self.direction
            .set_state((duty >= 0.0).into())
            .map_err(|_| MotorFailed)?;
        self.pwm.set_duty_cycle(count).map_err(|_| MotorFailed)?;
        self.enable.set_high().map_err(|_| MotorFailed)
    }

    /// Shorts the motor, which brakes by itself, whatever its encoder says.
    ///
    /// # Errors
    /// A pin or the PWM failed.
    pub fn short(&mut self) -> Result<(), MotorFailed> {
        self.pwm.set_duty_cycle_fully_off().map_err(|_| MotorFailed)?;
        self.enable.set_high().map_err(|_| MotorFailed)
    }

    /// No torque: opens the bridge. All that can be done is tried, whatever fails.
    ///
    /// # Errors
    /// A pin or the PWM failed.
    pub fn release(&mut self) -> Result<(), MotorFailed> {
        let open = self.enable.set_low().is_ok();
        let none = self.pwm.set_duty_cycle_fully_off().is_ok();
        if open && none { Ok(()) } else { Err(MotorFailed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 N.m at rest, 8 rad/s without load.
    fn motor() -> TorqueLimit<f32> {
        TorqueLimit::line(2.0, 0.25).expect("valid")
    }

    #[test]
    fn duty_makes_up_for_what_speed_takes() {
        // 0.5 of 2 N.m at rest; at 4 rad/s 1 N.m more is needed for the same.
        assert_eq!(motor().duty(0.5, 0.0), 0.25);
        assert_eq!(motor().duty(0.5, 4.0), 0.75);
        assert_eq!(motor().duty(-0.5, -4.0), -0.75);
        assert_eq!(motor().duty(-1.0, 4.0), 0.0); // a shorted motor brakes with slope * velocity by itself
    }

    #[test]
    fn duty_saturates() {
        assert_eq!(motor().duty(2.0, 4.0), 1.0);
        assert_eq!(motor().duty(-7.0, 0.0), -1.0);
        assert_eq!(motor().duty(f32::INFINITY, 0.0), 1.0);
    }

    #[test]
    fn what_is_not_a_number_is_no_duty() {
        assert_eq!(motor().duty(f32::NAN, 0.0), 0.0);
        assert_eq!(motor().duty(0.0, f32::NAN), 0.0);
        assert_eq!(motor().duty(f32::INFINITY, f32::NEG_INFINITY), 0.0);
    }
}
