//! The covariance of the twist by odometry, from the errors of the encoders and the slip that they show.

use std::f64::consts::{E, TAU};

use omni_config::{EncoderVelocity, MOST_WHEELS, Scenario, Vehicle, for_wheel_count};
use omni_core::Kinematics;
use omni_sim::controller::ControlSample;

/// Variance of the velocity of each wheel \[rad^2/s^2\], all wheels independent:
/// `noise^2 + counting + k^2 |w| / dt + g r^2`, w being the velocity and r its residual: the part that no
/// motion of the vehicle explains.
///
/// k and g are those of the pose's covariance ([`omni_core::estimate::OdometryNoise`]), and dt the time
/// between two messages: a filter that integrates the twist from message to message adds to its pose what
/// odometry adds to the variance of its own.
struct WheelVariance {
    /// Of noise and counting, which a wheel at rest has, too.
    fixed: f64,
    /// `k^2 / dt`.
    per_rad_s: f64,
    /// g.
    per_residual: f64,
}

impl WheelVariance {
    fn new(scenario: &Scenario, message_period_s: f64) -> Self {
        let noise = scenario.drive.as_ref().and_then(|drive| drive.noise);
        let noise = noise.unwrap_or_default();
        Self {
            fixed: scenario.sensors.encoder_noise_rad_s.powi(2) + counting(scenario),
            per_rad_s: noise.wheel_rad_per_sqrt_rad.powi(2) / message_period_s,
            per_residual: noise.residual_gain,
        }
    }
}

/// Variance of a velocity that is computed from whole counts \[rad^2/s^2\]. Over n periods the error is the
/// difference of two angles, each of which is anywhere within a count: a triangle. That of an observer is
/// taken as anywhere within its bound, and edges with their times have none.
fn counting(scenario: &Scenario) -> f64 {
    let sensors = &scenario.sensors;
    if sensors.encoder_counts == 0.0 {
        return 0.0;
    }
    let count_rad = TAU / sensors.encoder_counts;
    let over = |periods: u16| (count_rad / (f64::from(periods) * scenario.period_s())).powi(2) / 6.0;
    match sensors.encoder_velocity {
        None => over(1),
        Some(EncoderVelocity::Window { periods }) => over(periods),
        Some(EncoderVelocity::Observer { bandwidth_rad_s }) => (bandwidth_rad_s * count_rad / E).powi(2) / 3.0,
        Some(_) => 0.0,
    }
}

/// Twist by wheel velocities, one row per axis, and back.
struct Maps {
    forward: [[f64; MOST_WHEELS]; 3],
    inverse: [[f64; 3]; MOST_WHEELS],
}

/// None if too few wheels are left to determine the motion.
fn maps<const N: usize>(vehicle: &Vehicle, excluded: &[bool; MOST_WHEELS]) -> Option<Maps> {
    let kinematics = Kinematics::<f64, N>::new(&vehicle.layout().ok()?).ok()?;
    let kinematics = kinematics.excluding(&std::array::from_fn(|i| excluded[i]))?;
    let (mut forward, mut inverse) = ([[0.0; MOST_WHEELS]; 3], [[0.0; 3]; MOST_WHEELS]);
    for (to, from) in forward.iter_mut().zip(kinematics.forward_matrix()) {
        to[..N].copy_from_slice(from);
    }
    inverse[..N].copy_from_slice(kinematics.inverse_matrix());
    Some(Maps { forward, inverse })
}

/// Makes the covariance of a scenario's twist.
pub(crate) struct TwistCovariance {
    vehicle: Vehicle,
    wheels: WheelVariance,
    excluded: [bool; MOST_WHEELS],
    maps: Option<Maps>,
}

impl TwistCovariance {
    /// For messages that far apart \[s\].
    pub(crate) fn new(scenario: &Scenario, message_period_s: f64) -> Self {
        let mut new = Self {
            vehicle: scenario.vehicle().clone(),
            wheels: WheelVariance::new(scenario, message_period_s),
            excluded: [false; MOST_WHEELS],
            maps: None,
        };
        new.exclude([false; MOST_WHEELS]);
        new
    }

    fn exclude(&mut self, excluded: [bool; MOST_WHEELS]) {
        let count = self.vehicle.wheel.len();
        self.maps = for_wheel_count!(count, maps[](&self.vehicle, &excluded), |_| None);
        self.excluded = excluded;
    }

    /// `J diag(variances) J^T`, J being the forward map: rows and columns vx, vy \[m/s\] and wz \[rad/s\].
    /// None if the readings do not determine the motion.
    pub(crate) fn of(&mut self, sample: &ControlSample) -> Option<[[f64; 3]; 3]> {
        let (mut read, mut excluded) = ([0.0; MOST_WHEELS], [false; MOST_WHEELS]);
        let drive = sample.report.drive.as_ref();
        for (i, wheel) in sample.wheels.iter().enumerate().take(MOST_WHEELS) {
            let known = drive.and_then(|drive| drive.wheels.get(i));
            excluded[i] = !wheel.measured_rad_s.is_finite() || known.is_some_and(|wheel| wheel.excluded);
            if !excluded[i] {
                read[i] = wheel.measured_rad_s;
            }
        }
        if excluded != self.excluded {
            self.exclude(excluded);
        }
        let maps = self.maps.as_ref()?;
        let covariance = self.wheels.seen_by(maps, &read);
        covariance
            .as_flattened()
            .iter()
            .all(|part| part.is_finite())
            .then_some(covariance)
    }
}

impl WheelVariance {
    fn seen_by(&self, maps: &Maps, read: &[f64; MOST_WHEELS]) -> [[f64; 3]; 3] {
        let twist = maps
            .forward
            .map(|row| row.iter().zip(read).map(|(by, wheel)| by * wheel).sum::<f64>());
        let mut covariance = [[0.0; 3]; 3];
        for (i, (velocity, back)) in read.iter().zip(&maps.inverse).enumerate() {
            let explained: f64 = back.iter().zip(&twist).map(|(by, axis)| by * axis).sum();
            let variance = self.fixed
                + self.per_rad_s * velocity.abs()
                + self.per_residual * (velocity - explained).powi(2);
            // A wheel that is excluded, or that the vehicle has not, has a column of zeros.
            for (row, to) in maps.forward.iter().zip(&mut covariance) {
                for (column, to) in maps.forward.iter().zip(to) {
                    *to += variance * row[i] * column[i];
                }
            }
        }
        covariance
    }
}
