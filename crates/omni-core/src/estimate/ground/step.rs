//! One period of the ground odometry, in the five steps of its documentation.

use super::edges::{Contact, edge_normal};
use super::grid::Visit;
use super::height::{Displacement, Follower, Support, rise};
use super::lean::RATES_S;
use super::push::Pushing;
use super::rolling::LevelRolling;
use super::{EdgeEvent, EdgeKind, GroundInput, GroundOdometry, GroundOdometryState, GroundStep};
use crate::Real;
use crate::estimate::{EstimatorInput, EstimatorState};
use crate::geometry::BodyTwist;
use crate::linkage::WheelPlace;
use crate::policy::Imu;
use crate::scalar::{follow, is_plausible, max, min};
use crate::sum::Sum;

/// Time constant of the average of the base's rise \[s\].
const BASE_RISE_S: f64 = 0.03;
/// Distance over which the slope of a wheel's path is averaged \[m\], and its largest magnitude.
const SLOPE_M: f64 = 0.03;
const LARGEST_SLOPE: f64 = 2.0;
/// Part of the variance of a hinge's angle that remains in the mean of a cell.
const HINGE_PART: f64 = 0.2;
/// Standard deviation of the position at which a wheel meets an edge \[m\].
const EDGE_POSITION_M: f64 = 3e-3;
/// Difference of slope between a wheel's path and the plane of the contacts from which the wheel is on an edge.
const UNEVEN_SLOPE: f64 = 0.2;
/// Slip of all wheels that is no error of the lean \[m/s\].
const SLIPS_M_S: f64 = 0.05;
/// Distance after an edge or a slip over which wheels still slip \[m\].
const EVEN_M: f64 = 0.025;
/// Standard deviation of the vehicle's rise while a wheel passes over an edge and none follows known ground \[m\].
const UNKNOWN_RISE_M: f64 = 0.01;
/// Least speed that has a direction \[m/s\].
const LEAST_SPEED_M_S: f64 = 1e-3;
/// Standard deviation of a contact's height by the shape of the rollers \[m\].
const SHAPE_M: f64 = 5e-4;
/// Longest displacement of a period \[m\].
const LONGEST_M: f64 = 1e3;
/// Weight of a period in the mean heights of the contacts at the start.
const MEAN_PART: f64 = 0.05;
/// Margin of known ground around the wheels at the start \[cells\].
const MARGIN_CELLS: f64 = 1.5;

/// The motion that the wheels show together, slip included, with the yaw rate of the vehicle.
fn shown_by_wheels<R: Real, const N: usize>(state: &EstimatorState<R, N>) -> BodyTwist<R> {
    let (twist, slip) = (state.twist(), state.slip());
    BodyTwist {
        vx_m_s: twist.vx_m_s + slip.vx_m_s,
        vy_m_s: twist.vy_m_s + slip.vy_m_s,
        ..twist
    }
}

/// The wheels in the level frame, by attitude and hinges.
struct Wheels<R, const N: usize> {
    places: [WheelPlace<R>; N],
    /// Heights of the contacts above the base's origin \[m\]; NaN if they are not known.
    contact_m: [R; N],
}

/// A period of motion.
struct Period<R, const N: usize> {
    wheels: Wheels<R, N>,
    rolling: [LevelRolling<R>; N],
    displacement: Displacement<R>,
    twist: BodyTwist<R>,
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// One period. Values that are not valid (NaN, or beyond 1e6) are left out.
    ///
    /// ```
    /// # let odometry = omni_core::examples::ground_odometry()?;
    /// use omni_core::BodyTwist;
    /// use omni_core::estimate::GroundInput;
    /// use omni_core::policy::Imu;
    /// let mut state = odometry.start();
    /// // A second at rest: the readings of roll and pitch are biases.
    /// let mut imu = Imu::level();
    /// imu.pitch_rad = 0.004;
    /// let input = GroundInput::new(&[0.0; 4].into(), &imu, &BodyTwist::ZERO);
    /// (0..200).for_each(|_| _ = odometry.step(&mut state, &input));
    /// assert_eq!((state.pose().pitch_rad, state.pose().position_m[2]), (0.0, 0.0));
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) -> GroundStep<R, N> {
        let period_s = self.estimator.period_s();
        let rests = input.command == BodyTwist::ZERO;
        state.moved |= !rests;
        // Before the first command the ground below the vehicle counts as level.
        let level = !state.moved;
        let standing = level || (rests && state.standing);
        if standing {
            state.lean.stand(input, level);
        } else {
            state.lean.move_on();
        }
        let imu = state.lean.read(input, level, self.part(RATES_S), period_s);
        let wheels = self.wheels(state);
        let (before, shown_before) = (state.planar.pose(), shown_by_wheels(&state.planar));
        let rolling: [LevelRolling<R>; N] = core::array::from_fn(|i| {
            let rise = wheels.places[i].velocity_m_s[2] + state.base_rise_m_s;
            let rise = if rise.abs() < self.config.level_m_s {
                R::zero()
            } else {
                rise
            };
            self.wheel(i)
                .level(&wheels.places[i], input.wheels.rad_s[i], rise, &shown_before)
        });
        let actuators = Self::even_wheels(state, &rolling);
        let mut planar = EstimatorInput::with_imu(&actuators.into(), &imu, &input.command);
        let [ax, ay] = planar.acceleration_m_s2;
        planar.held_along = self.held_along(state, input, (&imu, [ax, ay]), &wheels, &shown_before);
        let step = self.estimator.step(&mut state.planar, &planar);
        state.standing = step.standing;
        let twist = state.planar.twist();
        if !level {
            let shown = shown_by_wheels(&state.planar);
            let gained = [
                (ax + twist.wz_rad_s * shown.vy_m_s) * period_s - (shown.vx_m_s - shown_before.vx_m_s),
                (ay - twist.wz_rad_s * shown.vx_m_s) * period_s - (shown.vy_m_s - shown_before.vy_m_s),
            ];
            state.lean.correct(
                gained,
                state.even_m >= R::of(EVEN_M),
                self.config.lean_s,
                period_s,
            );
        }
        let mut result = GroundStep {
            edges: [None; N],
            follows: true,
            standing: step.standing,
            taken: step.taken,
        };
        let now = state.planar.pose();
        let turn = (now.yaw_rad - before.yaw_rad).wrapped_angle();
        let by_m = [now.x_m - before.x_m, now.y_m - before.y_m];
        if !state.started || level {
            self.stand(state, &wheels);
            return result;
        }
        let displacement = self.displacement(state, by_m, before.yaw_rad, turn, &twist);
        let period = Period {
            wheels,
            rolling,
            displacement,
            twist,
        };
        let (support, follows) = self.rise(state, &period);
        result.follows = follows;
        result.edges = self.edges(state, &period, follows, &support);
        state.contact_m = period.wheels.contact_m;
        result
    }

    /// The direction in which something holds the vehicle that its wheels push against; zeros for none.
    fn held_along(
        &self,
        state: &mut GroundOdometryState<R, N>,
        input: &GroundInput<R, N>,
        (imu, acceleration_m_s2): (&Imu<R>, [R; 2]),
        wheels: &Wheels<R, N>,
        shown: &BodyTwist<R>,
    ) -> [R; 2] {
        let mut thrust = [R::zero(); 2];
        for ([along, across, _], torque) in self.estimator.inverse_matrix().iter().zip(input.torques.n_m) {
            thrust[0] += *along * torque / self.config.mass_kg;
            thrust[1] += *across * torque / self.config.mass_kg;
        }
        let rates = wheels.places.iter().map(|place| place.velocity_m_s[2].abs());
        let [fx, fy, _] = imu.specific_force_m_s2;
        let twist = state.planar.twist();
        let pushing = Pushing {
            thrust_m_s2: thrust,
            force_m_s2: [fx, fy],
            acceleration_m_s2,
            rise_m_s: rates.filter(|rate| is_plausible(*rate)).fold(R::zero(), max),
            twist_m_s: [twist.vx_m_s, twist.vy_m_s],
            shown_m_s: [shown.vx_m_s, shown.vy_m_s],
        };
        state.push.step(&pushing, self.estimator.period_s())
    }

    /// The wheel climbs or descends relative to the plane of the contacts.
    fn is_on_edge(state: &GroundOdometryState<R, N>, wheel: usize) -> bool {
        let slope = state.slope.get(wheel).copied().unwrap_or(R::zero());
        (slope - state.plane_slope).abs() > R::of(UNEVEN_SLOPE)
    }

    /// The readings, without those of wheels on an edge, which slip, if most of the wheels and at least three are on
    /// even ground. In a jolt none: the velocity of the base relative to its wheels is not known.
    fn even_wheels(state: &GroundOdometryState<R, N>, rolling: &[LevelRolling<R>; N]) -> [R; N] {
        let even = (0..N).filter(|i| !Self::is_on_edge(state, *i)).count();
        let leaves_out = even >= 3 && 2 * even > N;
        let mut actuators = rolling.map(|each| each.actuator_rad_s);
        for (i, actuator) in actuators.iter_mut().enumerate() {
            if state.lean.is_jolted || (leaves_out && Self::is_on_edge(state, i)) {
                *actuator = R::of(f64::NAN);
            }
        }
        actuators
    }

    /// Weight of a period in an average with this time constant.
    fn part(&self, time_s: f64) -> R {
        let period_s = self.estimator.period_s();
        period_s / (period_s + R::of(time_s))
    }

    /// The wheels in the level frame.
    fn wheels(&self, state: &GroundOdometryState<R, N>) -> Wheels<R, N> {
        let lean = &state.lean;
        let places = self
            .linkage
            .places(lean.attitude(), &lean.hinges_rad, &lean.hinges_rad_s);
        // An angle that is not known is NaN, and so are the places of the wheels that it carries.
        let base = if lean.is_known { R::zero() } else { R::of(f64::NAN) };
        let contact_m = core::array::from_fn(|i| base + places[i].centre_m[2] - self.radius_m[i]);
        Wheels { places, contact_m }
    }

    /// A period of a vehicle that stands and has not moved yet: the ground is level.
    fn stand(&self, state: &mut GroundOdometryState<R, N>, wheels: &Wheels<R, N>) {
        let part = if state.started { R::of(MEAN_PART) } else { R::one() };
        let (mut sum, mut count) = (R::zero(), 0_u16);
        for (mean, contact) in state.contact_m.iter_mut().zip(wheels.contact_m) {
            if mean.is_finite_real() && contact.is_finite_real() {
                follow(mean, contact, part);
            } else {
                *mean = contact;
            }
            if mean.is_finite_real() {
                sum += *mean;
                count += 1;
            }
        }
        let height_m = -sum / R::of(f64::from(count.max(1)));
        state.base_rise_m_s = R::zero();
        state.height_m = Sum::of(height_m);
        state.ground_m = state.contact_m.map(|contact| contact + height_m);
        let corners = self.corners(state, wheels);
        state.grid.start(corners, [R::zero(); 3]);
        state.started = true;
    }

    /// Corners of the ground below the wheels \[cells\].
    fn corners(&self, state: &GroundOdometryState<R, N>, wheels: &Wheels<R, N>) -> [[i32; 2]; 2] {
        let (mut low, mut high) = ([R::zero(); 2], [R::zero(); 2]);
        for place in &wheels.places {
            let [x, y, _] = place.centre_m;
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip([x, y]) {
                *low = min(value, *low);
                *high = max(value, *high);
            }
        }
        let cells_per_m = R::one() / self.config.cell_m;
        let margin = R::of(MARGIN_CELLS);
        let corner = |at: [R; 2], by: R| {
            let at = at.map(|each| each * cells_per_m + by);
            state.track.position.moved(at).cell
        };
        [corner(low, -margin), corner(high, margin)]
    }

    /// Moves the track.
    fn displacement(
        &self,
        state: &mut GroundOdometryState<R, N>,
        by_m: [R; 2],
        yaw_rad: R,
        turn: R,
        twist: &BodyTwist<R>,
    ) -> Displacement<R> {
        let cells_per_m = R::one() / self.config.cell_m;
        let length_m = min((by_m[0] * by_m[0] + by_m[1] * by_m[1]).sqrt(), R::of(LONGEST_M));
        state.track.move_by(by_m, yaw_rad, cells_per_m);
        state.track.turn_by(turn);
        state.track.travel(length_m * cells_per_m);
        let (sin, cos) = state.track.heading.total.sine_cosine();
        let (vx, vy) = (twist.vx_m_s, twist.vy_m_s);
        let per_speed = R::one() / max((vx * vx + vy * vy).sqrt(), R::of(LEAST_SPEED_M_S));
        let [ahead, left] = state.ground_slope;
        state.plane_slope = (ahead * vx + left * vy) * per_speed;
        let plane_m = state.plane_slope * length_m;
        Displacement {
            plane_m,
            unit: [
                (cos * vx - sin * vy) * per_speed,
                (sin * vx + cos * vy) * per_speed,
            ],
            length_m,
            period_s: self.estimator.period_s(),
            travelled: state.track.travelled,
            cell_m: self.config.cell_m,
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
            let rolling = &period.rolling[i];
            let excess = if is_plausible(rolling.excess_m_s) {
                rolling.excess_m_s
            } else {
                R::one()
            };
            Follower {
                position: state.track.position.moved(arm),
                height_m: period.wheels.contact_m[i],
                increase_m: period.wheels.contact_m[i] - state.contact_m[i],
                last_m: state.ground_m[i],
                arm_m: [x, y],
                slope: state.slope[i],
                slope_by_rim: (max(excess, R::zero()) / max(rolling.ground_m_s, R::of(0.02))).sqrt(),
            }
        });
        let rise = rise(&state.grid, &followers, state.height_m.total, displacement);
        state.height_m = state.height_m.plus(rise.by_m);
        let rate = rise.by_m / displacement.period_s;
        follow(&mut state.base_rise_m_s, rate, self.part(BASE_RISE_S));
        state.ground_m = rise.ground_m;
        if state.lean.is_known {
            state.ground_slope = period.wheels.slope();
        }
        let support = state.height_error.update(rise.support, displacement.length_m);
        let shape = R::of(SHAPE_M * SHAPE_M);
        state.height_error.variance_m2 = shape + support.variance_m2 + self.lean_variance_m2(support.arm_m);
        let length_m = displacement.length_m;
        let slip = state.planar.slip();
        let slips = max(slip.vx_m_s.abs(), slip.vy_m_s.abs()) > R::of(SLIPS_M_S);
        state.even_m = if slips || (0..N).any(|i| Self::is_on_edge(state, i)) {
            R::zero()
        } else {
            min(state.even_m + length_m, R::of(EVEN_M))
        };
        for (i, follower) in followers.iter().enumerate() {
            if !follower.increase_m.is_finite_real() {
                continue;
            }
            let height_m = state.height_m.total + follower.height_m;
            let variance_m2 = support.variance_m2 + self.contact_variance_m2(&period.wheels, &support, i);
            let visit = Visit {
                wheel: i,
                travelled: displacement.travelled,
            };
            // As wide as a wheel: later wheels do not follow exactly in its track.
            let [ux, uy] = displacement.unit;
            let [ahead, left] = state.ground_slope;
            let aside_m = self.config.cell_m * (left * (cos * ux + sin * uy) - ahead * (cos * uy - sin * ux));
            for sign in [R::zero(), R::one(), -R::one()] {
                let position = follower.position.moved([-(sign * uy), sign * ux]);
                let height_m = height_m + sign * aside_m;
                state.grid.record(&position, height_m, variance_m2, visit);
            }
            if length_m > R::zero() {
                let slope = (rise.by_m + follower.increase_m) / length_m;
                let largest = R::of(LARGEST_SLOPE);
                let part = length_m / (length_m + R::of(SLOPE_M));
                follow(&mut state.slope[i], slope.limited(-largest, largest), part);
            }
        }
        (support, rise.support.is_some())
    }

    /// Variance of the height at the end of a level arm \[m^2\].
    fn lean_variance_m2(&self, [x, y]: [R; 2]) -> R {
        self.config.attitude_rad * self.config.attitude_rad * (x * x + y * y)
    }

    /// Variance of the height of a wheel's contact \[m^2\]: by the lean, relative to the wheels that determine the
    /// height of the vehicle, and by the hinges that carry the wheel.
    fn contact_variance_m2(&self, wheels: &Wheels<R, N>, support: &Support<R>, wheel: usize) -> R {
        let [x, y, _] = wheels.places[wheel].centre_m;
        let [support_x, support_y] = support.arm_m;
        let shape = R::of(SHAPE_M * SHAPE_M);
        let lean = shape + self.lean_variance_m2([x - support_x, y - support_y]);
        let hinge_rad = self.config.hinge_rad;
        if self.linkage.carrier(wheel) == 0 {
            return lean;
        }
        lean + hinge_rad * hinge_rad * (x * x + y * y) * R::of(HINGE_PART)
    }

    /// Step 5: events of the wheels at edges.
    fn edges(
        &self,
        state: &mut GroundOdometryState<R, N>,
        period: &Period<R, N>,
        follows: bool,
        support: &Support<R>,
    ) -> [Option<EdgeEvent<R>>; N] {
        let pose = state.planar.pose();
        let (sin, cos) = pose.yaw_rad.sine_cosine();
        let mut events = [None; N];
        let unknown_m = if follows { R::zero() } else { R::of(UNKNOWN_RISE_M) };
        for i in 0..N {
            let [x, y, _] = period.wheels.places[i].centre_m;
            let contact = Contact {
                wheel: i,
                height_m: state.height_m.total + period.wheels.contact_m[i],
                distance_m: period.rolling[i].ground_m_s * self.estimator.period_s(),
                place_m: [pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y],
                variance_m2: unknown_m * unknown_m + self.contact_variance_m2(&period.wheels, support, i),
            };
            events[i] = state.paths[i].step(&contact, self.config.edge_m);
        }
        let (vx, vy) = (period.twist.vx_m_s, period.twist.vy_m_s);
        let travel = [cos * vx - sin * vy, sin * vx + cos * vy];
        for event in events.iter_mut().flatten() {
            if follows && event.kind != EdgeKind::Met {
                event.angle = edge_normal(&state.paths, event, travel, R::of(EDGE_POSITION_M));
            }
        }
        events
    }
}

impl<R: Real, const N: usize> Wheels<R, N> {
    /// Slopes of the plane with the least squared distance from the contacts, along the heading and to its left.
    fn slope(&self) -> [R; 2] {
        let known = || (self.places.iter().zip(self.contact_m)).filter(|(_, height)| height.is_finite_real());
        let part = R::one() / R::of(known().count().max(1) as f64);
        let mut mean = [R::zero(); 3];
        for (place, height) in known() {
            let [x, y, _] = place.centre_m;
            for (mean, each) in mean.iter_mut().zip([x, y, height]) {
                *mean += part * each;
            }
        }
        // Wheels in one line do not determine the slope across it: it is 0.
        let least = R::of(1e-6);
        let (mut xx, mut xy, mut yy, mut xz, mut yz) = (least, R::zero(), least, R::zero(), R::zero());
        for (place, height) in known() {
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
