//! The covariance of the twist by odometry, from the errors of the encoders and the slip that they show.

use std::f64::consts::{E, TAU};

use omni_config::{EncoderVelocity, MOST_WHEELS, Scenario, Vehicle, WheelMaps};
use omni_sim::Period;

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
        Some(EncoderVelocity::Observer { bandwidth_rad_s }) => {
            (bandwidth_rad_s * count_rad / E).powi(2) / 3.0
        }
        Some(_) => 0.0,
    }
}

/// Makes the covariance of a scenario's twist.
pub(crate) struct TwistCovariance {
    vehicle: Vehicle,
    wheels: WheelVariance,
    excluded: [bool; MOST_WHEELS],
    maps: Option<WheelMaps>,
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
        self.maps = self.vehicle.wheel_maps(&excluded).ok().flatten();
        self.excluded = excluded;
    }

    /// `J diag(variances) J^T`, J being the forward map: rows and columns vx, vy \[m/s\] and wz \[rad/s\].
    /// None if the readings do not determine the motion. Odometry in three dimensions has its own.
    pub(crate) fn of(&mut self, period: &Period) -> Option<[[f64; 3]; 3]> {
        let estimated = period.observed.odometry.twist_covariance;
        if estimated.is_some() {
            return estimated;
        }
        let (mut read, mut excluded) = ([0.0; MOST_WHEELS], [false; MOST_WHEELS]);
        let drive = period.control.report.drive.as_ref();
        let velocities = period.sensed.wheels_rad_s.iter().take(MOST_WHEELS);
        for (i, velocity) in velocities.enumerate() {
            let wheel = drive.and_then(|drive| drive.wheels.get(i));
            excluded[i] = !velocity.is_finite() || wheel.is_some_and(|wheel| wheel.excluded);
            if !excluded[i] {
                read[i] = *velocity;
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
    fn seen_by(&self, maps: &WheelMaps, read: &[f64; MOST_WHEELS]) -> [[f64; 3]; 3] {
        let mut covariance = [[0.0; 3]; 3];
        for (i, (velocity, residual)) in read.iter().zip(maps.residuals(read)).enumerate() {
            let variance =
                self.fixed + self.per_rad_s * velocity.abs() + self.per_residual * residual.powi(2);
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

#[cfg(test)]
mod tests {
    use omni_config::Override;
    use omni_sim::Simulation;

    use super::*;

    /// Time between messages \[s\].
    const DT_S: f64 = 0.02;
    /// Of mecanum4 \[m\]: radius of a wheel, and half of the sum of wheelbase and track.
    const RADIUS_M: f64 = 0.076;
    const LEVER_M: f64 = 0.45;

    fn scenario(keys: &[(&str, f64)]) -> Scenario {
        let vehicle = Override::new("vehicle", "mecanum4");
        let keys = keys.iter().map(|(key, value)| Override::new(*key, *value));
        Scenario::load("flat", &[vehicle].into_iter().chain(keys).collect::<Vec<_>>()).expect("in range")
    }

    /// Of mecanum4 with these wheel velocities \[rad/s\]; its other wheels are as they are at rest.
    fn covariance(scenario: &Scenario, wheels_rad_s: [f64; 4]) -> Option<[[f64; 3]; 3]> {
        let mut simulation = Simulation::new(scenario).expect("valid");
        simulation.step(&simulation.scenario_command()).expect("finite");
        let mut period = simulation.period().clone();
        period.sensed.wheels_rad_s = wheels_rad_s.into();
        TwistCovariance::new(scenario, DT_S).of(&period)
    }

    /// `vx = r/4 sum(w)`, `vy` with signs the same, `wz = r/(4 l)` times a sum with signs: independent
    /// wheels of one variance v have `r^2 v / 4` twice and `r^2 v / (4 l^2)`.
    fn assert_mecanum(found: [[f64; 3]; 3], variance: f64) {
        let along = RADIUS_M.powi(2) * variance / 4.0;
        let expected = [along, along, along / LEVER_M.powi(2)];
        for (row, of_row) in found.iter().enumerate() {
            for (column, value) in of_row.iter().enumerate() {
                let expected = if row == column { expected[row] } else { 0.0 };
                // The file has its roller angles with ten digits.
                assert!(
                    (value - expected).abs() <= 1e-8 * variance,
                    "{row}, {column}: {value}, {expected}"
                );
            }
        }
    }

    #[test]
    fn four_mecanum_wheels_of_one_variance_have_the_closed_form() {
        let noise = |scenario: &Scenario, wheels| covariance(scenario, wheels).expect("determined");
        // At rest: the noise, and the triangle of a count's width over a control period of 1 ms.
        let noisy = scenario(&[
            ("sensors.encoder_noise_rad_s", 0.1),
            ("sensors.encoder_counts", 1024.0),
        ]);
        let counting = (TAU / 1024.0 / 0.001).powi(2) / 6.0;
        assert_mecanum(noise(&noisy, [0.0; 4]), 0.01 + counting);
        // Ahead at 5 rad/s without sensor errors: 0.02 rad per root of rad, over the time between messages.
        let ideal = scenario(&[]);
        assert_mecanum(noise(&ideal, [5.0; 4]), 0.02_f64.powi(2) * 5.0 / DT_S);
        assert_mecanum(noise(&ideal, [0.0; 4]), 0.0);
        // Velocities that no motion explains are a residual whole: front against rear, left against right.
        let slip = noise(&ideal, [2.0, 2.0, -2.0, -2.0]);
        assert_mecanum(slip, 0.02_f64.powi(2) * 2.0 / DT_S + 4.0);
    }

    #[test]
    fn a_velocity_of_more_periods_is_better_in_proportion_and_edges_have_no_error() {
        let by = |method: &str| {
            let method = format!("sensors.encoder_velocity={{ kind = {method} }}");
            let keys = ["vehicle=mecanum4", "sensors.encoder_counts=1024", &method];
            let keys = keys.map(|key| Override::parse(key).expect("a key"));
            counting(&Scenario::load("flat", &keys).expect("in range"))
        };
        let count_rad = TAU / 1024.0;
        let over_four = by("\"window\", periods = 4");
        assert!((over_four / ((count_rad / 0.004).powi(2) / 6.0) - 1.0).abs() < 1e-12);
        assert_eq!(by("\"edges\""), 0.0);
        let observed = by("\"observer\", bandwidth_rad_s = 100.0");
        assert!((observed / ((100.0 * count_rad / E).powi(2) / 3.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_wheel_without_a_reading_makes_it_worse_and_two_make_it_unknown() {
        let noisy = scenario(&[("sensors.encoder_noise_rad_s", 0.1)]);
        let all = covariance(&noisy, [1.0; 4]).expect("determined");
        let three = covariance(&noisy, [f64::NAN, 1.0, 1.0, 1.0]).expect("determined");
        for axis in 0..3 {
            assert!(three[axis][axis] > 1.5 * all[axis][axis], "{axis}: {three:?}");
        }
        assert_eq!(covariance(&noisy, [f64::NAN, f64::NAN, 1.0, 1.0]), None);
        assert_eq!(covariance(&noisy, [1e200, 1.0, 1.0, 1.0]), None);
    }

    /// The measured twists of a drive scatter about the true ones as the covariance says.
    #[test]
    fn measured_twists_scatter_about_the_truth_as_much() {
        for (key, value, within) in [
            // Noise of 1 rad/s has a variance of 1. Of four wheels a quarter of it is a residual, which
            // counts once more, and k^2 w / dt is 0.08 at 4 rad/s: 1 / 1.33 is 0.75. The deviation of a
            // variance of 3000 samples is 3 %.
            ("sensors.encoder_noise_rad_s", 1.0, 0.68..0.83),
            // A speed of p counts in a period scatters by p (1 - p), at most 1.5 times the mean over all speeds, 1/6.
            ("sensors.encoder_counts", 400.0, 0.3..1.5),
        ] {
            let scenario = scenario(&[(key, value), ("duration_s", 4.0)]);
            let mut simulation = Simulation::new(&scenario).expect("valid");
            let mut covariance = TwistCovariance::new(&scenario, DT_S);
            let (mut seen, mut stated) = ([0.0; 3], [0.0; 3]);
            for period in 0..3500 {
                simulation.step(&simulation.scenario_command()).expect("finite");
                if period < 500 {
                    continue; // it speeds up
                }
                let truth = simulation.observation().twist.to_array();
                let measured = simulation.observation().odometry.twist.to_array();
                let known = covariance.of(simulation.period()).expect("determined");
                for axis in 0..3 {
                    seen[axis] += (measured[axis] - truth[axis]).powi(2);
                    stated[axis] += known[axis][axis];
                }
            }
            for axis in 0..3 {
                let ratio = seen[axis] / stated[axis];
                assert!(within.contains(&ratio), "{key}, axis {axis}: {ratio}");
            }
        }
    }
}
