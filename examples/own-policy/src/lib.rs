//! A controller of one's own: proportional control of the vehicle's motion instead of each wheel's.
//!
//! The wheels' velocities are turned into the motion that they amount to. What lacks of the
//! commanded motion is asked of all wheels together, so that wheels never work against each other;
//! what no motion explains, a wheel that slips, is braked a little.
#![cfg_attr(not(test), no_std)]

use omni_core::{BodyTwist, Kinematics, Policy, Readings, WheelVelocities};

/// Gains and what the last step did, for a vehicle of `N` wheels.
pub struct MotionControl<const N: usize> {
    kinematics: Kinematics<f64, N>,
    /// Torque per lack of the velocity that the motion asks of a wheel [N.m.s/rad].
    pub motion_n_m_s_rad: f64,
    /// Torque against what no motion explains [N.m.s/rad].
    pub slip_n_m_s_rad: f64,
    lack_m_s: f64,
}

impl<const N: usize> MotionControl<N> {
    /// For the vehicle of these maps.
    pub fn new(kinematics: Kinematics<f64, N>) -> Self {
        Self {
            kinematics,
            motion_n_m_s_rad: 1.0,
            slip_n_m_s_rad: 0.1,
            lack_m_s: 0.0,
        }
    }
}

impl<const N: usize> Policy<f64> for MotionControl<N> {
    fn reset(&mut self) {
        self.lack_m_s = 0.0;
    }

    fn step(&mut self, readings: &Readings<'_, f64>, torques_n_m: &mut [f64]) {
        let mut measured = WheelVelocities::<f64, N>::zero();
        for (own, reading) in measured.rad_s.iter_mut().zip(readings.wheels_rad_s) {
            // A wheel without a reading counts as standing.
            *own = if reading.is_nan() { 0.0 } else { *reading };
        }
        let (motion, slip) = (
            self.kinematics.forward(&measured),
            self.kinematics.residual(&measured),
        );
        let lack = BodyTwist {
            vx_m_s: readings.command.vx_m_s - motion.vx_m_s,
            vy_m_s: readings.command.vy_m_s - motion.vy_m_s,
            wz_rad_s: readings.command.wz_rad_s - motion.wz_rad_s,
        };
        self.lack_m_s = lack.vx_m_s.abs() + lack.vy_m_s.abs();
        let asked = self.kinematics.inverse(&lack);
        for (i, torque) in torques_n_m.iter_mut().enumerate().take(N) {
            *torque = self.motion_n_m_s_rad * asked.rad_s[i] - self.slip_n_m_s_rad * slip.rad_s[i];
        }
    }

    fn signal_name(&self, index: usize) -> Option<&str> {
        (index == 0).then_some("lack_m_s")
    }

    fn signals(&self, values: &mut [f64]) {
        values[0] = self.lack_m_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use omni_core::WheelLayout;

    #[test]
    fn wheels_that_do_what_is_asked_get_no_torque_and_a_slipping_one_is_braked() {
        let layout = WheelLayout::<f64, 4>::mecanum4(0.6, 0.4, 0.1).expect("a layout");
        let kinematics = Kinematics::new(&layout).expect("it moves any way");
        let mut policy = MotionControl::new(kinematics);
        let ahead = BodyTwist {
            vx_m_s: 0.5,
            ..BodyTwist::ZERO
        };
        let mut torques_n_m = [0.0; 4];
        policy.step(&Readings::new(ahead, &[5.0; 4]), &mut torques_n_m);
        // Rounding of sums of four numbers of size five.
        assert!(
            torques_n_m.iter().all(|torque| torque.abs() < 1e-12),
            "{torques_n_m:?}"
        );
        // Of 4 rad/s too much of one wheel a quarter is no motion of the vehicle, in each of the four.
        policy.motion_n_m_s_rad = 0.0;
        policy.step(&Readings::new(ahead, &[9.0, 5.0, 5.0, 5.0]), &mut torques_n_m);
        assert!((torques_n_m[0] + 0.1 * 1.0).abs() < 1e-12, "{torques_n_m:?}");
    }
}
