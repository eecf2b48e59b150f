//! Gains from masses, motor and control period, for vehicle files without gains.

use nalgebra::{Matrix3, Vector3};

use crate::digits::digits;
use crate::ranges::{Bounded, GAIN};
use crate::{Error, Gains, Vehicle};

/// How soon a wheel follows, unless something below asks for more time \[s\]: at once for a person
/// who drives, and twenty times slower than contacts of 200 Hz, which are then stiff.
const SHORTEST_S: f64 = 0.1;
/// Control periods of the shortest time constant: the loop's delay of one and a half periods then
/// costs 9 degrees of phase.
const PERIODS: f64 = 10.0;
/// Largest request for an error of the whole speed, in stall torques: beyond one it is clipped anyway, and two is
/// reached only at the start.
const STALL_TORQUES: f64 = 2.0;
/// Largest fraction of the speed error of a wheel in the air that a control period may remove: above 1 it would
/// oscillate.
const SHARE_OF_A_FREE_WHEEL: f64 = 0.5;

/// Gains that were derived, and from what.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DerivedGains {
    /// The gains.
    pub gains: Gains,
    /// The largest inertia that a wheel's loop moves, seen by its actuator \[kg.m^2\].
    pub inertia_kg_m2: f64,
    /// Time constant that the loops were given, `inertia / kp` \[s\].
    pub time_constant_s: f64,
}

impl std::fmt::Display for DerivedGains {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "kp {} N.m.s/rad, ki {} N.m/rad, from {} kg.m2 at a wheel and a time constant of {} ms",
            digits(self.gains.kp_n_m_s_rad),
            digits(self.gains.ki_n_m_rad),
            digits(self.inertia_kg_m2),
            digits(1e3 * self.time_constant_s)
        )
    }
}

impl Vehicle {
    /// The gains of its file or, if they are left out, the derived gains for this control period \[s\].
    ///
    /// # Errors
    /// As [`Vehicle::derived_gains`].
    pub fn gains_at(&self, period_s: f64) -> Result<Gains, Error> {
        match self.gains {
            Some(gains) => Ok(gains),
            None => Ok(self.derived_gains(period_s)?.gains),
        }
    }

    /// Gains from masses, motor and control period \[s\], regardless of the file's gains (docs/physics.md derives
    /// them).
    ///
    /// With the wheels' velocities `A x` for a twist `x` and the same loop C on every wheel, the vehicle
    /// obeys `M x' = A^T C A (u - x)`: three loops, each with an inertia J that is an eigenvalue of
    /// `(A^T A)^-1 M`. For the largest: `kp = J / T`, `ki = kp / (4 T)`, critically damped; the other two are
    /// damped more. T is 0.1 s, or longer if the control period, the motor or a wheel in the air wants it.
    ///
    /// # Errors
    /// As [`Vehicle::condition_number`]; [`Error::Key`] if kp would exceed 1e6.
    ///
    /// ```
    /// let vehicle = omni_config::Vehicle::load("omni3")?;
    /// let derived = vehicle.derived_gains(1e-3)?;
    /// // Across, three wheels at 120 degrees count for 3/2: J = 7.2 kg / (3/2) r^2 + I, a little more with the battery ahead.
    /// assert!((derived.inertia_kg_m2 / (7.2 * 0.05 * 0.05 / 1.5 + 0.0007) - 1.0).abs() < 0.02);
    /// // Sideways at its limit of 0.8 m/s wheel 1 turns with 16 rad/s: an error of all that asks for twice the motor's 1 N.m.
    /// assert!((derived.gains.kp_n_m_s_rad * 16.0 - 2.0).abs() < 1e-6);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    pub fn derived_gains(&self, period_s: f64) -> Result<DerivedGains, Error> {
        let (rows, _) = self.actuators()?;
        let inertia = self.largest_inertia(&rows);
        let free_wheel = self
            .wheel
            .iter()
            .map(|wheel| wheel.inertia_kg_m2 * wheel.gear * wheel.gear)
            .fold(f64::INFINITY, f64::min);
        let time_constant_s = [
            SHORTEST_S,
            PERIODS * period_s,
            self.of_motors_s(inertia, &rows),
            period_s * inertia / (SHARE_OF_A_FREE_WHEEL * free_wheel),
        ]
        .into_iter()
        .fold(0.0, f64::max);
        let kp = inertia / time_constant_s;
        if kp.outside(GAIN) {
            return Err(Error::Key {
                file: format!("vehicle {}", self.name),
                key: "gains".into(),
                message: format!("left out, and the derived kp_n_m_s_rad is {kp:e}, allowed: 0 to 1e6"),
            });
        }
        let gains = Gains {
            kp_n_m_s_rad: kp,
            ki_n_m_rad: kp / (4.0 * time_constant_s),
            kd_n_m_s2_rad: 0.0,
        };
        Ok(DerivedGains {
            gains,
            inertia_kg_m2: inertia,
            time_constant_s,
        })
    }

    /// The shortest time constant that the motors are strong enough for, where loops move this inertia \[s\].
    pub(crate) fn motors_time_constant_s(&self, inertia_kg_m2: f64) -> Result<f64, Error> {
        Ok(self.of_motors_s(inertia_kg_m2, &self.actuators()?.0))
    }

    /// The same, `rows` being the actuators' velocities per unit of twist; 0 if nothing limits the speed.
    fn of_motors_s(&self, inertia_kg_m2: f64, rows: &[[f64; 3]]) -> f64 {
        let full_rad_s = self.full_speed_rad_s(rows).unwrap_or(0.0);
        inertia_kg_m2 * full_rad_s / (STALL_TORQUES * self.motor.peak_torque_n_m())
    }

    /// The largest inertia that a loop moves, `rows` being the actuators' velocities per unit of twist.
    fn largest_inertia(&self, rows: &[[f64; 3]]) -> f64 {
        let mut squares = Matrix3::zeros(); // A^T A
        let mut mass = Matrix3::zeros(); // M: of the vehicle as one rigid body about its origin, and its turning wheels
        for (row, wheel) in rows.iter().zip(&self.wheel) {
            let square = Vector3::from(*row) * Vector3::from(*row).transpose();
            squares += square;
            mass += square * (wheel.inertia_kg_m2 * wheel.gear * wheel.gear);
        }
        for (kg, [x, y, _]) in self.weights() {
            mass += kg * Matrix3::new(1.0, 0.0, -y, 0.0, 1.0, x, -y, x, x * x + y * y);
        }
        mass[(2, 2)] += self.body.iter().map(|body| body.inertia_kg_m2()[2]).sum::<f64>();
        // The eigenvalues of L^-1 M L^-T, where A^T A = L L^T: symmetric, so real.
        let Some(cholesky) = squares.cholesky() else {
            return f64::NAN; // a layout that was accepted has rank 3
        };
        let half = cholesky.l().solve_lower_triangular(&mass).unwrap_or(mass);
        let whole = cholesky
            .l()
            .solve_lower_triangular(&half.transpose())
            .unwrap_or(mass);
        whole.symmetric_eigenvalues().max()
    }

    /// The fastest that an actuator is meant to turn \[rad/s\]; none if nothing limits it.
    pub(crate) fn top_rad_s(&self) -> Result<Option<f64>, Error> {
        Ok(self.full_speed_rad_s(&self.actuators()?.0))
    }

    /// The fastest that an actuator is meant to turn \[rad/s\]: where a limit of one axis is
    /// reached, but no faster than the motor.
    fn full_speed_rad_s(&self, rows: &[[f64; 3]]) -> Option<f64> {
        let commanded = self.limits.map(|limits| {
            let limit = limits.speeds();
            rows.iter()
                .flat_map(|row| (0..3).map(move |axis| row[axis].abs() * limit[axis]))
                .fold(0.0, f64::max)
        });
        match (commanded, self.no_load_rad_s()) {
            (Some(commanded), Some(no_load)) => Some(commanded.min(no_load)),
            (commanded, no_load) => commanded.or(no_load),
        }
    }
}
