//! One period of the ground odometry, in the five steps of its documentation.

use super::biases::Unbiased;
use super::edges::{Contact, edge_normal};
use super::grid::Visit;
use super::height::{Displacement, Follower, Support, rise};
use super::inertial::{GRAVITY_M_S2, InertialNoise};
use super::pose_error::Movement;
use super::wheel_motion::{MotionEstimate, RiseRate, RollingWheel, WheelReading, YawRate, estimate_motion};
use super::{EdgeEvent, EdgeKind, GroundInput, GroundOdometry, GroundOdometryState, GroundStep};
use crate::Real;
use crate::linkage::{WheelPlace, axes_of, turned};
use crate::scalar::{all_plausible, follow, is_plausible, max};

/// Time constant of the averages of rates \[s\], of the rise of the base, and of the wheels' disagreement.
const RATES_S: f64 = 0.015;
const BASE_RISE_S: f64 = 0.03;
const DISAGREEMENT_S: f64 = 0.03;
/// Distance over which the slope of a wheel's path is averaged \[m\], and its largest magnitude.
const SLOPE_M: f64 = 0.03;
const LARGEST_SLOPE: f64 = 2.0;
/// Disagreement of the wheels at which the lean takes half of its correction \[m/s\].
const LEAN_SLIP_M_S: f64 = 0.01;
/// Agreement of the wheels with the predicted velocity, 0 to 1, below which the prediction is doubted, and for how long
/// \[s\] until its variance is increased.
const DOUBTED: f64 = 0.3;
const LOST_S: f64 = 1.0;
/// Part of the variance of a hinge's angle that remains in the mean of a cell.
const HINGE_PART: f64 = 0.2;
/// Standard deviation of the position at which a wheel meets an edge \[m\].
const EDGE_POSITION_M: f64 = 3e-3;
/// Largest sine of a lean that the accelerometer measures at rest.
const LARGEST_SINE: f64 = 0.9;
/// Least speed that has a direction \[m/s\].
const LEAST_SPEED_M_S: f64 = 1e-3;

/// The wheels in the level frame, by attitude and hinges.
pub(super) struct Wheels<R, const N: usize> {
    pub(super) places: [WheelPlace<R>; N],
    /// Heights of the contacts above the base's origin \[m\].
    pub(super) contact_m: [R; N],
}

impl<R: Real, const N: usize> Wheels<R, N> {
    /// Squared distance of a wheel from the base's origin, level \[m^2\].
    fn lever_m2(&self, wheel: usize) -> R {
        let [x, y, _] = self.places[wheel].centre_m;
        x * x + y * y
    }

    /// Slopes of the plane with the least squared distance from the contacts, along the heading and to its left.
    fn slope(&self) -> [R; 2] {
        let part = R::one() / R::of(N as f64);
        let mut mean = [R::zero(); 3];
        for (place, height) in self.places.iter().zip(self.contact_m) {
            let [x, y, _] = place.centre_m;
            for (mean, each) in mean.iter_mut().zip([x, y, height]) {
                *mean += part * each;
            }
        }
        // Wheels in one line do not determine the slope across it: it is 0.
        let least = R::of(1e-6);
        let (mut xx, mut xy, mut yy, mut xz, mut yz) = (least, R::zero(), least, R::zero(), R::zero());
        for (place, height) in self.places.iter().zip(self.contact_m) {
            let [x, y, _] = place.centre_m;
            let (x, y, z) = (x - mean[0], y - mean[1], height - mean[2]);
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xz += x * z;
            yz += y * z;
        }
        let determinant = xx * yy - xy * xy;
        [
            (xz * yy - yz * xy) / determinant,
            (yz * xx - xz * xy) / determinant,
        ]
    }
}

/// A period of motion.
struct Period<R, const N: usize> {
    wheels: Wheels<R, N>,
    readings: [WheelReading<R>; N],
    motion: MotionEstimate<R>,
    displacement: Displacement<R>,
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// One period. Values that are not valid (NaN, or beyond 1e6) are left out.
    ///
    /// ```
    /// use omni_core::estimate::{GroundInput, GroundOdometry, GroundOdometryConfig, GroundOdometryState};
    /// use omni_core::linkage::{CarriedWheel, Linkage};
    /// use omni_core::policy::Imu;
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// // No wheel of three follows in the track of another one: the height of the vehicle is not determined.
    /// let layout = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?;
    /// let wheels = layout.wheels().map(|wheel| CarriedWheel {
    ///     body: 0,
    ///     centre_m: [wheel.position_m[0], wheel.position_m[1], 0.05],
    /// });
    /// let linkage = Linkage::new(&[], &wheels)?;
    /// let odometry = GroundOdometry::new(GroundOdometryConfig::new(0.005), &layout, linkage)?;
    /// let mut state = GroundOdometryState::new();
    /// let kinematics = Kinematics::new(&layout)?;
    /// let (mut imu, mut follows) = (Imu::level(), true);
    /// for period in 0..1000 {
    ///     let vx_m_s = 0.3 * f64::min(f64::from(period + 1) / 60.0, 1.0);
    ///     imu.specific_force_m_s2[0] = if period < 60 { 1.0 } else { 0.0 };
    ///     let forward = kinematics.inverse(&BodyTwist { vx_m_s, ..BodyTwist::ZERO });
    ///     follows = odometry.step(&mut state, &GroundInput::new(&forward, &imu)).follows;
    /// }
    /// assert!(!follows && state.height_variance_m2().sqrt() > 0.05); // after 1.5 m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) -> GroundStep<R, N> {
        state.learn_biases(input, self.config.gyro_rad_s);
        self.predict(state, input);
        let wheels = self.wheels(state, input);
        if !state.started || input.standing {
            self.stand(state, &wheels);
            return GroundStep::STANDING;
        }
        state.moved = true;
        let readings = self.readings(state, input, &wheels);
        let Some(motion) = self.motion(state, input, &readings) else {
            return GroundStep {
                taken: false,
                ..GroundStep::STANDING
            };
        };
        let displacement = self.correct(state, &motion);
        let period = Period {
            wheels,
            readings,
            motion,
            displacement,
        };
        let (support, follows) = self.rise(state, &period);
        let edges = self.edges(state, &period, &support);
        state.contact_m = period.wheels.contact_m;
        GroundStep {
            edges,
            follows,
            taken: true,
        }
    }

    /// Step 1: velocity and lean by gyros and accelerometer.
    fn predict(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) {
        let (config, filter) = (&self.config, &mut state.filter);
        let imu = state.biases.imu(&input.imu);
        state.rates_rad_s = imu
            .rate_rad_s
            .map(|each| if is_plausible(each) { each } else { R::zero() });
        if input.standing || !state.started {
            let lean_rad = if input.level {
                [R::zero(); 2]
            } else {
                resting_lean(&imu, filter.lean_rad(), state.biases.newest_part())
            };
            filter.rest(lean_rad);
        } else if let (Some(rate), Some(force)) = (imu.rate(), imu.force()) {
            let noise = InertialNoise {
                gyro_rad_s: config.gyro_rad_s,
                accelerometer_m_s2: config.accelerometer_m_s2,
            };
            filter.predict(rate, force, &noise, config.period_s);
        } else {
            let lean_rad = imu.lean().unwrap_or(filter.lean_rad());
            filter.predict_unaccelerated(lean_rad, config.attitude_rad, config.period_s);
        }
    }

    /// Weight of a period in an average with this time constant.
    fn part(&self, time_s: f64) -> R {
        self.config.period_s / (self.config.period_s + R::of(time_s))
    }

    /// The wheels in the level frame.
    fn wheels(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) -> Wheels<R, N> {
        state.read(input, self.part(RATES_S));
        let places = self
            .linkage
            .places(&state.attitude, &state.hinges_rad, &state.hinges_rad_s);
        let mut contact_m = [R::zero(); N];
        for i in 0..N {
            contact_m[i] = places[i].centre_m[2] - self.radius_m[i];
        }
        Wheels { places, contact_m }
    }

    /// Step 2: speeds of the rims, and motion of the centres.
    fn readings(
        &self,
        state: &GroundOdometryState<R, N>,
        input: &GroundInput<R, N>,
        wheels: &Wheels<R, N>,
    ) -> [WheelReading<R>; N] {
        let config = &self.config;
        let part = self.part(RATES_S);
        // Variance of an average, relative to that of one reading.
        let averaged = part / (R::of(2.0) - part);
        let gyro2 = config.gyro_rad_s * config.gyro_rad_s;
        let hinge2 = config.hinge_rad_s * config.hinge_rad_s;
        core::array::from_fn(|i| {
            let rate2 = if self.linkage.carrier(i) == 0 {
                gyro2
            } else {
                gyro2 + hinge2
            };
            let rise = RiseRate {
                m_s: wheels.places[i].velocity_m_s[2] + state.base_rise_m_s,
                variance: wheels.lever_m2(i) * rate2 * averaged,
            };
            let actuator_rad_s = Some(input.wheels.rad_s[i]).filter(|rate| is_plausible(*rate));
            let encoder_m_s = self.rim_m_rad[i] * config.wheel_rad_s;
            let carrier2 = self.radius_m[i] * self.radius_m[i] * rate2 * R::of(2.0);
            let noise_m_s = (encoder_m_s * encoder_m_s + config.slip_m_s * config.slip_m_s + carrier2).sqrt();
            let wheel = RollingWheel {
                radius_m: self.radius_m[i],
                rim_m_rad: self.rim_m_rad[i],
                direction: self.direction[i],
                roller: self.roller[i],
            };
            wheel.reading(&wheels.places[i], actuator_rad_s, rise, noise_m_s)
        })
    }

    /// The yaw rate by the gyro; none without a reading.
    fn yaw_rate(&self, state: &GroundOdometryState<R, N>, input: &GroundInput<R, N>) -> Option<YawRate<R>> {
        let [_, _, about_z] = input.imu.rate_rad_s;
        is_plausible(about_z).then(|| {
            let axes = axes_of(&state.attitude);
            let ([along, _, up], [x, ..]) = (turned(&axes, &state.rates_rad_s), &axes);
            let gyro = self.config.gyro_rad_s;
            YawRate {
                rad_s: up - along * x[2] / x[0],
                deviation_rad_s: (gyro * gyro + state.pose_error.accumulated_bias()).sqrt(),
            }
        })
    }

    /// Step 2: the motion by least squares; none if it is not finite.
    fn motion(
        &self,
        state: &mut GroundOdometryState<R, N>,
        input: &GroundInput<R, N>,
        readings: &[WheelReading<R>; N],
    ) -> Option<MotionEstimate<R>> {
        let gyro = self.yaw_rate(state, input);
        state.pose_error.count_period();
        let motion = estimate_motion(readings, &state.filter, gyro, state.disagreement_m2_s2);
        follow(
            &mut state.disagreement_m2_s2,
            motion.disagreement_m2_s2,
            self.part(DISAGREEMENT_S),
        );
        let valid = all_plausible(&motion.velocity)
            && motion.covariance.iter().all(all_plausible)
            && state.filter.is_valid();
        if !valid {
            state.filter.rest([R::zero(); 2]);
            return None;
        }
        Some(motion)
    }

    /// Step 3: velocity, lean, position and yaw.
    fn correct(&self, state: &mut GroundOdometryState<R, N>, motion: &MotionEstimate<R>) -> Displacement<R> {
        let config = &self.config;
        let period_s = config.period_s;
        self.doubt(state, motion);
        let slip = R::of(LEAN_SLIP_M_S);
        let trust = R::one() / (R::one() + state.disagreement_m2_s2 / (slip * slip));
        let correction = state.filter.correct(motion.velocity, &motion.covariance, trust);
        let [vx, vy, wz] = motion.velocity;
        let turn = wz * period_s;
        let (dx, dy) = (vx * period_s, vy * period_s);
        let (sin, cos) = (state.yaw.total + R::of(0.5) * turn).sine_cosine();
        let [fix_x, fix_y] = correction.by_m;
        let by_m = [cos * dx - sin * dy + fix_x, sin * dx + cos * dy + fix_y];
        state.x = state.x.plus(by_m[0]);
        state.y = state.y.plus(by_m[1]);
        let movement = Movement {
            by_m,
            increase_m2: state.filter.move_position((sin, cos), period_s),
            decrease_m2: correction.decrease_m2,
        };
        state
            .pose_error
            .grow(&movement, motion, config.gyro_rad_s, period_s);
        let cells_per_m = R::one() / config.cell_m;
        let length_m = (dx * dx + dy * dy).sqrt();
        state.track.move_by(by_m, state.yaw.total, cells_per_m);
        state.track.turn_by(turn);
        state.track.travel(length_m * cells_per_m);
        state.yaw = state.yaw.plus(turn);
        let (sin, cos) = state.track.heading.total.sine_cosine();
        let speed = (vx * vx + vy * vy).sqrt();
        let per_speed = R::one() / max(speed, R::of(LEAST_SPEED_M_S));
        Displacement {
            unit: [
                (cos * vx - sin * vy) * per_speed,
                (sin * vx + cos * vy) * per_speed,
            ],
            length_m,
            period_s,
            travelled: state.track.travelled,
            cell_m: config.cell_m,
        }
    }

    /// Increases the variance of a prediction with which the wheels have not agreed for long: the accelerometer has a
    /// bias, or the lean is wrong.
    fn doubt(&self, state: &mut GroundOdometryState<R, N>, motion: &MotionEstimate<R>) {
        let doubted = motion.agreement < R::of(DOUBTED) && state.filter.by_accelerometer();
        state.lost_s = if doubted {
            state.lost_s + self.config.period_s
        } else {
            R::zero()
        };
        if state.lost_s > R::of(LOST_S) {
            state.lost_s = R::zero();
            state.filter.widen();
        }
    }

    /// Step 4: the height. The ground that determines it, and whether its height is known.
    fn rise(&self, state: &mut GroundOdometryState<R, N>, period: &Period<R, N>) -> (Support<R>, bool) {
        let (displacement, cells_per_m) = (&period.displacement, R::one() / self.config.cell_m);
        let (sin, cos) = state.track.heading.total.sine_cosine();
        let followers: [Follower<R>; N] = core::array::from_fn(|i| {
            let [x, y, _] = period.wheels.places[i].centre_m;
            let arm = [
                (cos * x - sin * y) * cells_per_m,
                (sin * x + cos * y) * cells_per_m,
            ];
            Follower {
                position: state.track.position.moved(arm),
                height_m: period.wheels.contact_m[i],
                increase_m: period.wheels.contact_m[i] - state.contact_m[i],
                last_m: state.ground_m[i],
                arm_m: [x, y],
                slope: state.slope[i],
                slope_by_rim: period.readings[i].slope_by_rim(&period.motion.velocity),
            }
        });
        let rise = rise(&state.grid, &followers, state.height_m.total, displacement);
        state.height_m = state.height_m.plus(rise.by_m);
        follow(
            &mut state.base_rise_m_s,
            rise.by_m / self.config.period_s,
            self.part(BASE_RISE_S),
        );
        state.ground_m = rise.ground_m;
        state.ground_slope = period.wheels.slope();
        let support = state.height_error.update(rise.support, displacement.length_m);
        state.height_error.variance_m2 = support.variance_m2 + state.filter.height_variance_m2(support.arm_m);
        let length_m = displacement.length_m;
        for (i, follower) in followers.iter().enumerate() {
            let height_m = state.height_m.total + follower.height_m;
            let [lean, hinge] = self.height_variances_m2(state, &period.wheels, &support, i);
            let visit = Visit {
                wheel: i,
                travelled: displacement.travelled,
            };
            state.grid.record(
                &follower.position,
                height_m,
                support.variance_m2 + lean + hinge,
                visit,
            );
            if length_m > R::zero() {
                let slope = (rise.by_m + follower.increase_m) / length_m;
                let largest = R::of(LARGEST_SLOPE);
                let part = length_m / (length_m + R::of(SLOPE_M));
                follow(&mut state.slope[i], slope.limited(-largest, largest), part);
            }
        }
        (support, rise.support.is_some())
    }

    /// Variances of the height of a wheel's contact \[m^2\]: by the lean, relative to the wheels that determine the
    /// height of the vehicle, and by the hinges that carry the wheel.
    fn height_variances_m2(
        &self,
        state: &GroundOdometryState<R, N>,
        wheels: &Wheels<R, N>,
        support: &Support<R>,
        wheel: usize,
    ) -> [R; 2] {
        let [x, y, _] = wheels.places[wheel].centre_m;
        let [support_x, support_y] = support.arm_m;
        let lean = state.filter.height_variance_m2([x - support_x, y - support_y]);
        let hinge_rad = self.config.hinge_rad;
        let hinge = if self.linkage.carrier(wheel) == 0 {
            R::zero()
        } else {
            hinge_rad * hinge_rad * wheels.lever_m2(wheel) * R::of(HINGE_PART)
        };
        [lean, hinge]
    }

    /// Step 5: events of the wheels at edges.
    fn edges(
        &self,
        state: &mut GroundOdometryState<R, N>,
        period: &Period<R, N>,
        support: &Support<R>,
    ) -> [Option<EdgeEvent<R>>; N] {
        let (sin, cos) = state.yaw.total.sine_cosine();
        let mut events = [None; N];
        for i in 0..N {
            let [x, y, _] = period.wheels.places[i].centre_m;
            let [wx, wy] = period.readings[i].over_ground(&period.motion.velocity);
            let [lean, hinge] = self.height_variances_m2(state, &period.wheels, support, i);
            let contact = Contact {
                wheel: i,
                height_m: state.height_m.total + period.wheels.contact_m[i],
                distance_m: (wx * wx + wy * wy).sqrt() * self.config.period_s,
                place_m: [
                    state.x.total + cos * x - sin * y,
                    state.y.total + sin * x + cos * y,
                ],
                variance_m2: lean + hinge,
            };
            events[i] = state.paths[i].step(&contact, self.config.edge_m);
        }
        let [vx, vy, _] = period.motion.velocity;
        let travel = [cos * vx - sin * vy, sin * vx + cos * vy];
        for event in events.iter_mut().flatten() {
            if event.kind != EdgeKind::Met {
                event.angle = edge_normal(&state.paths, event, travel, R::of(EDGE_POSITION_M));
            }
        }
        events
    }
}

/// Lean of a vehicle that stands: the measured one, or else the mean of the lean by the accelerometer, in which the
/// newest reading has the weight `part`; `lean_rad` without readings.
fn resting_lean<R: Real>(imu: &Unbiased<R>, lean_rad: [R; 2], part: R) -> [R; 2] {
    if let Some(measured_rad) = imu.lean() {
        return measured_rad;
    }
    let [mut nose_rad, mut left_rad] = lean_rad;
    if let Some([forward, left, _]) = imu.force() {
        let largest = R::of(LARGEST_SINE);
        let up = |force: R| (force / R::of(GRAVITY_M_S2)).limited(-largest, largest).asin();
        follow(&mut nose_rad, up(*forward), part);
        follow(&mut left_rad, up(*left), part);
    }
    [nose_rad, left_rad]
}
