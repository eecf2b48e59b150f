//! Odometry in three dimensions: the vehicle feels the ground with its wheels.
//!
//! Wheel encoders, hinges, gyros and the attitude of the base tell where each wheel is against the base, and how its rim moves. A wheel that
//! climbs moves along a sloped path; which slope follows from the linkage, as the contact angles of Lamon and Siegwart (*3D position tracking in
//! challenging terrain*, Int. J. of Robotics Research 26, 2007). The first wheel that passes over the ground records its height in a small grid, and later wheels, which
//! pass over the same ground, carry the height of the vehicle.

mod carried;
mod config;
mod edges;
mod grid;
mod height;
mod input;
mod travel;

use crate::constants::constant_struct;
use crate::estimate::PoseCovariance;
use crate::geometry::WheelLayout;
use crate::linkage::{Attitude, Linkage, MAX_HINGES, WheelPlace, axes_of, turned};
use crate::scalar::{all_plausible, follow, is_plausible};
use crate::sum::Sum;
use crate::{ConfigError, Real};
use carried::Carried;
pub use config::GroundOdometryConfig;
use edges::{Contact, Path, angle};
pub use edges::{EdgeEvent, EdgeKind};
use grid::{Grid, Place, Who};
use height::{Follower, Way, rise};
pub use input::GroundInput;
use travel::{RollingWheel, Travel, WheelView, travel};

/// Time over which rates are averaged \[s\].
const RATES_S: f64 = 0.015;
/// Time over which the rise of the base is averaged \[s\].
const BASE_RISE_S: f64 = 0.03;
/// Acceleration of a body that falls \[m/s^2\].
const GRAVITY_M_S2: f64 = 9.81;
/// Way over which the slope of a wheel's path is averaged \[m\].
const SLOPE_M: f64 = 0.03;
/// Time over which the disagreement of the wheels is averaged \[s\].
const DISAGREEMENT_S: f64 = 0.03;
/// Disagreement of the wheels at which half of what they say of the lean counts \[m/s\].
const LEAN_SLIP_M_S: f64 = 0.01;
/// Periods for which an error of the gyro's zero is taken to add up.
const PERIODS: u16 = 2000;
/// Agreement of the wheels with the carried velocity, 0 to 1, below which it is alone, and how long it may be \[s\].
const ALONE: f64 = 0.3;
const LOST_S: f64 = 1.0;
/// Part of a hinge's noise that is left in a cell.
const HINGE_PART: f64 = 0.2;
/// Part of a disagreement of the wheels that is an error of the velocity, and how long it lasts \[s\].
const SLIP_PART: f64 = 0.1;
const SLIP_S: f64 = 0.2;
/// Deviation of the place where a wheel meets an edge \[m\].
const PLACE_M: f64 = 3e-3;
/// Unknown ground rises or falls by this part of the travel \[m/m\].
const UNKNOWN_SLOPE: f64 = 0.1;

/// Odometry in three dimensions of a vehicle with `N` wheels. Immutable; what changes is in [`GroundOdometryState`].
///
/// Each period
///
/// 1. gyros and accelerometer carry the velocity and the lean of the base on. Without accelerometer the lean is the measured one;
/// 2. every wheel says what the velocity is by its rim: along the path of its centre, which rises by attitude and hinges, and less what its
///    carrier turns. Least squares over the wheels and the gyro; a wheel that slips or is lifted disagrees, and counts less;
/// 3. the velocity corrects the lean and the place, by what they have in common with it (a Kalman filter);
/// 4. wheels on ground whose height is known carry the height: those on even ground first. Where none is, the ground is taken to go on as it
///    was, and the variance of the height grows by a tenth of the way, squared;
/// 5. each wheel records the height of its contact where nothing is known, and the path of each wheel is searched for edges.
///
/// While the vehicle stands, what the gyros read is their zero. On level ground so is what roll, pitch, hinges and accelerometer read: an
/// error of 4 mrad would be a false rise of 4 mm a metre.
///
/// What it is not: it has no map. Ground that left the 512 cells is new when the vehicle comes back to it.
///
/// ```
/// use omni_core::estimate::{GroundInput, GroundOdometry, GroundOdometryConfig, GroundOdometryState};
/// use omni_core::geometry::Wheel;
/// use omni_core::linkage::{CarriedWheel, Linkage};
/// use omni_core::policy::Imu;
/// use omni_core::WheelLayout;
/// let layout = WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076)?;
/// let wheel = |wheel: Wheel<f64>| CarriedWheel { body: 0, centre_m: [wheel.position_m[0], wheel.position_m[1], wheel.radius_m] };
/// let linkage = Linkage::new(&[], &layout.wheels().map(wheel))?;
/// let odometry = GroundOdometry::new(GroundOdometryConfig::new(0.005), &layout, linkage)?;
/// let mut state = GroundOdometryState::new();
/// // It stands on level ground for a second, its gyro off by 0.01 rad/s, and then goes ahead at 0.3 m/s.
/// let mut imu = Imu::level();
/// imu.rate_rad_s[2] = 0.01;
/// for _ in 0..200 {
///     odometry.step(&mut state, &GroundInput::new(&[0.0; 4].into(), &imu).at_rest(true));
/// }
/// for period in 0..1000 {
///     imu.specific_force_m_s2[0] = if period < 100 { 0.6 } else { 0.0 };
///     let speed = 0.3 * f64::min(f64::from(period + 1) / 100.0, 1.0);
///     odometry.step(&mut state, &GroundInput::new(&[speed / 0.076; 4].into(), &imu));
/// }
/// let [x, y, z] = state.pose().position_m;
/// assert!((x - 1.4258).abs() < 3e-3 && y.abs() < 1e-3 && z.abs() < 1e-3);
/// # Ok::<(), omni_core::ConfigError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct GroundOdometry<R, const N: usize> {
    config: GroundOdometryConfig<R>,
    linkage: Linkage<R, N>,
    radius_m: [R; N],
    rim_m_rad: [R; N],
    direction: [[R; 2]; N],
    roller: [[R; 2]; N],
    /// Mean length of the vehicle between its wheels \[m\].
    length_m: R,
}

constant_struct!(GroundOdometry<R, const N> {
    config: GroundOdometryConfig<R>,
    linkage: Linkage<R, N>,
    radius_m: [R; N],
    rim_m_rad: [R; N],
    direction: [[R; 2]; N],
    roller: [[R; 2]; N],
    length_m: R,
});

/// Where the vehicle is, and what it remembers of the ground: 12 kB in `f32` and 19 kB in `f64`, of which the 512 cells of the ground are 10 kB
/// and 16 kB.
///
/// ```
/// use omni_core::estimate::GroundOdometryState;
/// let mut state = GroundOdometryState::<f32, 7>::new();
/// assert!(state.reset([1.0, 2.0, 0.5], 0.1));
/// assert_eq!(state.pose().position_m, [1.0, 2.0, 0.5]);
/// assert!(core::mem::size_of_val(&state) < 13_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "R: serde::Serialize", deserialize = "R: serde::Deserialize<'de>"))
)]
pub struct GroundOdometryState<R, const N: usize> {
    x: Sum<R>,
    y: Sum<R>,
    yaw: Sum<R>,
    /// Height of the base's origin, and what was set beside it.
    height_m: Sum<R>,
    set_m: R,
    attitude: Attitude<R>,
    ground_slope: [R; 2],
    carried: Carried<R>,
    rates: [R; 3],
    /// Place in the grid, whose axes are those of the heading at the start.
    place: Place<R>,
    heading: Sum<R>,
    grid: Grid<R>,
    /// There is ground below it, and it has moved on that.
    started: bool,
    moved: bool,
    /// For how long the wheels have agreed on another velocity than the accelerometer \[s\].
    lost_s: R,
    /// Travel in cells, and the rest of one.
    travel: u32,
    travel_rest: R,
    /// Height of each contact above the base's origin, ground below it, and rates, averaged.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    contact_m: [R; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    ground_m: [R; N],
    base_rise_m_s: R,
    /// Zeros of roll, pitch, hinges and gyros, and how many readings they are the mean of.
    zero_rad: [R; 2],
    zero_hinges_rad: [R; MAX_HINGES],
    zero_rad_s: [R; 3],
    zero_m_s2: [R; 3],
    zero_count: [u16; 2],
    hinges_rad: [R; MAX_HINGES],
    hinges_rad_s: [R; MAX_HINGES],
    tilt_rad_s: [R; 2],
    covariance: [[R; 3]; 3],
    variance_m2: R,
    blind_m: R,
    /// Mean square of what wheels are beyond the motion, averaged \[m^2/s^2\].
    disagreement: R,
    /// Variance of the ground that is followed, and the mean arm of the wheels that follow it.
    followed_m2: R,
    followed_arm_m: [R; 2],
    /// Slope of the path of each wheel, averaged.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    slope: [R; N],
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    paths: [Path<R>; N],
    /// Variance of the gyro's zero, and what that has in common with x, y and yaw.
    zero_variance: R,
    periods: u16,
    by_zero: [R; 3],
}

/// Pose in three dimensions: [`GroundOdometryState::pose`].
///
/// ```
/// use omni_core::estimate::GroundOdometryState;
/// let pose = GroundOdometryState::<f64, 3>::new().pose();
/// assert_eq!((pose.position_m, pose.yaw_rad), ([0.0; 3], 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundPose<R, const N: usize> {
    /// Place of the base's origin in the world \[m\].
    pub position_m: [R; 3],
    /// Angle of the base's y axis above the horizon \[rad\]: left side up.
    pub roll_rad: R,
    /// Angle of the base's x axis above the horizon \[rad\]: nose up.
    pub pitch_rad: R,
    /// Heading, counter-clockwise, in (-pi, pi] \[rad\].
    pub yaw_rad: R,
    /// Height of each wheel's contact in the world \[m\].
    pub contact_m: [R; N],
    /// Slope of the ground below the vehicle along its heading and to its left \[m/m\]: of the plane that is nearest to its contacts.
    pub slope: [R; 2],
}

/// What a step of a [`GroundOdometry`] found.
///
/// ```
/// use omni_core::estimate::GroundStep;
/// let climbs = |step: &GroundStep<f32, 7>| step.edges.iter().flatten().any(|edge| edge.height_m > 0.02);
/// # let _ = climbs;
/// assert_eq!(core::mem::size_of::<GroundStep<f32, 7>>() % 4, 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GroundStep<R, const N: usize> {
    /// What each wheel did with an edge in this period.
    pub edges: [Option<EdgeEvent<R>>; N],
    /// Wheels follow ground whose height is known. Where none does, only the variance of the height says how much it means.
    pub follows: bool,
    /// False where the result was not finite: velocity and lean are as at rest, and the pose stays.
    pub taken: bool,
}

impl<R: Real, const N: usize> GroundStep<R, N> {
    const NOTHING: Self = Self {
        edges: [None; N],
        follows: true,
        taken: true,
    };
}

impl<R: Real, const N: usize> GroundOdometry<R, N> {
    /// For a vehicle with this layout of wheels on this linkage, in the same order.
    ///
    /// # Errors
    /// What of the configuration is out of its range.
    pub fn new(
        config: GroundOdometryConfig<R>,
        layout: &WheelLayout<R, N>,
        linkage: Linkage<R, N>,
    ) -> Result<Self, ConfigError> {
        let wheels = layout.wheels();
        let (mut low, mut high) = (R::zero(), R::zero());
        for wheel in wheels {
            let [x, _] = wheel.position_m;
            low = if x < low { x } else { low };
            high = if x > high { x } else { high };
        }
        Ok(Self {
            config: config.checked()?,
            linkage,
            radius_m: wheels.map(|wheel| wheel.radius_m),
            rim_m_rad: wheels.map(|wheel| wheel.radius_m * wheel.wheel_per_actuator()),
            direction: wheels.map(|wheel| wheel.unit_direction()),
            roller: wheels.map(|wheel| {
                let (sin, cos) = wheel.roller_angle_rad.sine_cosine();
                [cos, sin]
            }),
            length_m: high - low,
        })
    }

    fn wheel(&self, i: usize) -> RollingWheel<R> {
        RollingWheel {
            radius_m: self.radius_m[i],
            rim_m_rad: self.rim_m_rad[i],
            direction: self.direction[i],
            roller: self.roller[i],
        }
    }

    /// One period: where the vehicle has come to is in `state`.
    ///
    /// ```
    /// use omni_core::estimate::{GroundInput, GroundOdometry, GroundOdometryConfig, GroundOdometryState};
    /// use omni_core::linkage::{CarriedWheel, Linkage};
    /// use omni_core::policy::Imu;
    /// use omni_core::{BodyTwist, Kinematics, WheelLayout};
    /// // Three wheels: none follows another, so that nothing says how high the vehicle is.
    /// let layout = WheelLayout::<f64, 3>::omni(0.2, 0.0, 0.05)?;
    /// let linkage = Linkage::new(&[], &layout.wheels().map(|w| CarriedWheel { body: 0, centre_m: [w.position_m[0], w.position_m[1], 0.05] }))?;
    /// let odometry = GroundOdometry::new(GroundOdometryConfig::new(0.005), &layout, linkage)?;
    /// let mut state = GroundOdometryState::new();
    /// let kinematics = Kinematics::new(&layout)?;
    /// let (mut imu, mut follows) = (Imu::level(), true);
    /// for period in 0..1000 {
    ///     let vx_m_s = 0.3 * f64::min(f64::from(period + 1) / 60.0, 1.0);
    ///     imu.specific_force_m_s2[0] = if period < 60 { 1.0 } else { 0.0 };
    ///     let ahead = kinematics.inverse(&BodyTwist { vx_m_s, ..BodyTwist::ZERO });
    ///     follows = odometry.step(&mut state, &GroundInput::new(&ahead, &imu)).follows;
    /// }
    /// assert!(!follows && state.height_variance_m2().sqrt() > 0.05); // after 1.5 m
    /// # Ok::<(), omni_core::ConfigError>(())
    /// ```
    pub fn step(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) -> GroundStep<R, N> {
        let config = &self.config;
        let period_s = config.period_s;
        state.learn_zeros(input, config.gyro_rad_s);
        self.carry(state, input);
        let part = period_s / (period_s + R::of(RATES_S));
        let base = state.read(input, part);
        let places = self.linkage.places(&base, &state.hinges_rad, &state.hinges_rad_s);
        let mut contact_m = [R::zero(); N];
        for i in 0..N {
            contact_m[i] = places[i].centre_m[2] - self.radius_m[i];
        }
        if !state.started || input.standing {
            self.stand(state, &contact_m, &places.map(|place| place.centre_m));
            return GroundStep::NOTHING;
        }
        state.moved = true;
        // How the wheels roll and rise.
        let lever = |k: usize| {
            let [x, y, _] = places[k].centre_m;
            x * x + y * y
        };
        let smooth = part / (R::of(2.0) - part);
        let gyro2 = config.gyro_rad_s * config.gyro_rad_s;
        let hinge2 = config.hinge_rad_s * config.hinge_rad_s;
        let views: [WheelView<R>; N] = core::array::from_fn(|i| {
            let rate2 = if self.linkage.carrier(i) == 0 {
                gyro2
            } else {
                gyro2 + hinge2
            };
            let variance = lever(i) * rate2 * smooth;
            let rise = places[i].velocity_m_s[2] + state.base_rise_m_s;
            let read = input.wheels.rad_s[i];
            let read = is_plausible(read).then_some(read);
            let wheel_m_s = self.rim_m_rad[i] * config.wheel_rad_s;
            let turning2 = self.radius_m[i] * self.radius_m[i] * rate2 * R::of(2.0);
            let noise = (wheel_m_s * wheel_m_s + config.slip_m_s * config.slip_m_s + turning2).sqrt();
            self.wheel(i).view(&places[i], read, (rise, variance), noise)
        });
        let level = axes_of(&base);
        let gyro = is_plausible(input.imu.rate_rad_s[2]).then(|| {
            let ([along, _, up], [x, ..]) = (turned(&level, &state.rates), &level);
            // An error of its zero adds up: in the end it is as much as this noise would be.
            let lasting = state.zero_variance * R::of(f64::from(state.periods));
            let noise = (config.gyro_rad_s * config.gyro_rad_s + lasting).sqrt();
            (up - along * x[2] / x[0], noise)
        });
        state.periods = (state.periods + 1).min(PERIODS);
        let moved = travel(&views, &state.carried, gyro, state.disagreement);
        follow(
            &mut state.disagreement,
            moved.disagreement,
            period_s / (period_s + R::of(DISAGREEMENT_S)),
        );
        let sound = |values: &[R; 3]| all_plausible(values);
        if !(sound(&moved.velocity) && moved.covariance.iter().all(sound) && state.carried.is_sound()) {
            state.carried.rest([R::zero(); 2]);
            return GroundStep {
                taken: false,
                ..GroundStep::NOTHING
            };
        }
        // An accelerometer that is off for long, or a lean that was wrong, is not what the vehicle does.
        let alone = moved.agreement < R::of(ALONE) && state.carried.by_accelerometer;
        state.lost_s = if alone { state.lost_s + period_s } else { R::zero() };
        if state.lost_s > R::of(LOST_S) {
            state.lost_s = R::zero();
            state.carried.forget();
        }
        let slips = R::of(LEAN_SLIP_M_S);
        let trust = R::one() / (R::one() + state.disagreement / (slips * slips));
        let ([fix_x, fix_y], lost) = state.carried.correct(moved.velocity, &moved.covariance, trust);
        let [vx, vy, wz] = moved.velocity;
        // Move.
        let half = R::of(0.5);
        let turn = wz * period_s;
        let (dx, dy) = (vx * period_s, vy * period_s);
        let (sin, cos) = (state.yaw.total + half * turn).sine_cosine();
        let [wx, wy] = [cos * dx - sin * dy + fix_x, sin * dx + cos * dy + fix_y];
        state.x = state.x.plus(wx);
        state.y = state.y.plus(wy);
        let gained = state.carried.moved((sin, cos), period_s);
        state.grow(&gained, &lost, [wx, wy], &moved, period_s, config.gyro_rad_s);
        // The same in the axes of the grid.
        let away = state.yaw.total - state.heading.total;
        let (sin, cos) = away.sine_cosine();
        let [gx, gy] = [cos * wx + sin * wy, cos * wy - sin * wx];
        state.yaw = state.yaw.plus(turn);
        state.heading = state.heading.plus(turn);
        let per_cell = R::one() / config.cell_m;
        state.place = state.place.moved([gx * per_cell, gy * per_cell]);
        let way_m = (dx * dx + dy * dy).sqrt();
        let way = (state.travel_rest + way_m * per_cell).limited(R::zero(), R::of(1e6));
        let whole = way.whole_part();
        state.travel = state.travel.wrapping_add(whole);
        state.travel_rest = way - R::of(f64::from(whole));
        // Height.
        let (sin, cos) = state.heading.total.sine_cosine();
        let speed = (vx * vx + vy * vy).sqrt();
        let least = R::of(1e-3);
        let unit = R::one() / if speed > least { speed } else { least };
        let ahead = [(cos * vx - sin * vy) * unit, (sin * vx + cos * vy) * unit];
        let followers: [Follower<R>; N] = core::array::from_fn(|i| {
            let [x, y, _] = places[i].centre_m;
            Follower {
                place: state
                    .place
                    .moved([(cos * x - sin * y) * per_cell, (sin * x + cos * y) * per_cell]),
                height_m: contact_m[i],
                grown_m: contact_m[i] - state.contact_m[i],
                last_m: state.ground_m[i],
                arm_m: [x, y],
                slope: state.slope[i],
                steep: views[i].steep(&moved.velocity),
            }
        });
        let travel = state.travel;
        let way = Way {
            ahead,
            way_m,
            period_s,
            travel,
            cell_m: config.cell_m,
        };
        let risen = rise(&state.grid, &followers, state.height_m.total, &way);
        state.height_m = state.height_m.plus(risen.by_m);
        follow(
            &mut state.base_rise_m_s,
            risen.by_m / period_s,
            period_s / (period_s + R::of(BASE_RISE_S)),
        );
        // How well it is known: as well as the ground that is followed.
        let (nose, left) = (state.carried.nose_variance(), state.carried.left_variance());
        let leaned = |[x, y]: [R; 2]| nose * x * x + left * y * y;
        let (followed, arm) = match risen.followed {
            Some((variance, arm)) => {
                state.blind_m = R::zero();
                (variance, arm)
            }
            None => {
                let before = R::of(UNKNOWN_SLOPE) * state.blind_m;
                state.blind_m += way_m;
                let after = R::of(UNKNOWN_SLOPE) * state.blind_m;
                (
                    state.followed_m2 + after * after - before * before,
                    state.followed_arm_m,
                )
            }
        };
        (state.followed_m2, state.followed_arm_m) = (followed, arm);
        state.variance_m2 = followed + leaned(arm);
        let hinge = config.hinge_rad * config.hinge_rad;
        let along = way_m / (way_m + R::of(SLOPE_M));
        let (sin_yaw, cos_yaw) = state.yaw.total.sine_cosine();
        let mut events = [None; N];
        for (i, follower) in followers.iter().enumerate() {
            let [x, y] = follower.arm_m;
            let from = [x - arm[0], y - arm[1]];
            let carried = if self.linkage.carrier(i) == 0 {
                R::zero()
            } else {
                hinge * lever(i) * R::of(HINGE_PART)
            };
            let height = state.height_m.total + follower.height_m;
            let who = Who { wheel: i, travel };
            state
                .grid
                .write(&follower.place, height, followed + leaned(from) + carried, who);
            let [wx, wy] = views[i].over_ground(&moved.velocity);
            let contact = Contact {
                wheel: i,
                height_m: height,
                way_m: (wx * wx + wy * wy).sqrt() * period_s,
                place_m: [
                    state.x.total + cos_yaw * x - sin_yaw * y,
                    state.y.total + sin_yaw * x + cos_yaw * y,
                ],
                variance_m2: leaned(from) + carried,
            };
            events[i] = state.paths[i].step(&contact, config.edge_m);
            if way_m > R::zero() {
                let grown = (risen.by_m + follower.grown_m) / way_m;
                follow(&mut state.slope[i], grown.limited(R::of(-2.0), R::of(2.0)), along);
            }
        }
        state.ground_slope = slope_below(&places, &contact_m);
        state.ground_m = risen.ground_m;
        state.contact_m = contact_m;
        let along = [cos_yaw * vx - sin_yaw * vy, sin_yaw * vx + cos_yaw * vy];
        for event in events.iter_mut().flatten() {
            if event.kind != EdgeKind::Met {
                event.angle = angle(&state.paths, event, along, R::of(PLACE_M));
            }
        }
        GroundStep {
            edges: events,
            follows: risen.followed.is_some(),
            taken: true,
        }
    }

    /// Velocity and lean a period on, by gyros and accelerometer.
    fn carry(&self, state: &mut GroundOdometryState<R, N>, input: &GroundInput<R, N>) {
        let (config, imu) = (&self.config, &input.imu);
        let less = |read: &[R; 3], zero: &[R; 3]| {
            let mut read = *read;
            for (each, zero) in read.iter_mut().zip(zero) {
                *each -= *zero;
            }
            read
        };
        let (rate, force) = (
            less(&imu.rate_rad_s, &state.zero_rad_s),
            less(&imu.specific_force_m_s2, &state.zero_m_s2),
        );
        let [zero_nose, zero_left] = state.zero_rad;
        let read = [imu.pitch_rad - zero_nose, imu.roll_rad - zero_left];
        let measured = all_plausible(&read);
        let both = all_plausible(&rate) && all_plausible(&force);
        state.rates = rate.map(|each| if is_plausible(each) { each } else { R::zero() });
        if input.standing || !state.started {
            let lean = if input.level {
                [R::zero(); 2]
            } else if measured {
                read
            } else if all_plausible(&force) {
                let up = |force: R| {
                    (force / R::of(GRAVITY_M_S2))
                        .limited(R::of(-0.9), R::of(0.9))
                        .asin()
                };
                let [count, _] = state.zero_count;
                let part = R::one() / R::of(f64::from(count.max(1)));
                let [mut nose, mut left] = state.carried.lean;
                follow(&mut nose, up(force[0]), part);
                follow(&mut left, up(force[1]), part);
                [nose, left]
            } else {
                state.carried.lean
            };
            state.carried.rest(lean);
        } else if both {
            let (gyro, accelerometer) = (config.gyro_rad_s, config.accelerometer_m_s2);
            state
                .carried
                .carry(&rate, &force, gyro, accelerometer, config.period_s);
        } else {
            let lean = if measured { read } else { state.carried.lean };
            state.carried.guess(lean, config.attitude_rad, config.period_s);
        }
    }

    fn stand(&self, state: &mut GroundOdometryState<R, N>, contact_m: &[R; N], centres_m: &[[R; 3]; N]) {
        state.base_rise_m_s = R::zero();
        if state.moved {
            state.contact_m = *contact_m;
            return;
        }
        let part = if state.contact_m[0].is_finite_real() {
            R::of(0.05)
        } else {
            R::one()
        };
        for (mean, now) in state.contact_m.iter_mut().zip(contact_m) {
            if part < R::one() {
                follow(mean, *now, part);
            } else {
                *mean = *now;
            }
        }
        // The ground is the plane that the base's axes are parallel to, through its origin.
        let [x, y, _] = axes_of(&state.attitude);
        let slopes = [x[2] / x[0], y[2] / y[1]];
        let mut sum = R::zero();
        for (mean, [x, y, _]) in state.contact_m.iter().zip(centres_m) {
            sum += *mean - slopes[0] * *x - slopes[1] * *y;
        }
        state.height_m = Sum::of(-sum / R::of(N as f64));
        state.ground_slope = slopes;
        for ((ground, contact), height) in state
            .ground_m
            .iter_mut()
            .zip(&state.contact_m)
            .zip([state.height_m.total; N])
        {
            *ground = *contact + height;
        }
        let cell = R::one() / self.config.cell_m;
        let (mut low, mut high) = ([R::zero(); 2], [R::zero(); 2]);
        for [x, y, _] in centres_m {
            for ((low, high), value) in low.iter_mut().zip(&mut high).zip([*x, *y]) {
                *low = if value < *low { value } else { *low };
                *high = if value > *high { value } else { *high };
            }
        }
        let margin = R::of(1.5);
        let corner = |at: [R; 2], by: R| state.place.moved(at.map(|each| each * cell + by)).cell;
        let corners = [corner(low, -margin), corner(high, margin)];
        let slopes = slopes.map(|each| each * self.config.cell_m);
        state.grid.start(corners, [R::zero(), slopes[0], slopes[1]]);
        state.started = true;
    }
}

/// Slopes of the plane that is nearest to the contacts, along the heading and to its left.
fn slope_below<R: Real, const N: usize>(places: &[WheelPlace<R>; N], contact_m: &[R; N]) -> [R; 2] {
    let part = R::one() / R::of(N as f64);
    let mut mean = [R::zero(); 3];
    for (place, height) in places.iter().zip(contact_m) {
        let [x, y, _] = place.centre_m;
        for (mean, each) in mean.iter_mut().zip([x, y, *height]) {
            *mean += part * each;
        }
    }
    // Wheels in one line say nothing of the slope across it.
    let least = R::of(1e-6);
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (least, R::zero(), least, R::zero(), R::zero());
    for (place, height) in places.iter().zip(contact_m) {
        let [x, y, _] = place.centre_m;
        let (x, y, z) = (x - mean[0], y - mean[1], *height - mean[2]);
        xx += x * x;
        xy += x * y;
        yy += y * y;
        xz += x * z;
        yz += y * z;
    }
    let area = xx * yy - xy * xy;
    [(xz * yy - yz * xy) / area, (yz * xx - xz * xy) / area]
}

impl<R: Real, const N: usize> Default for GroundOdometryState<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R: Real, const N: usize> GroundOdometryState<R, N> {
    /// At the origin, facing +x, on even ground.
    #[must_use]
    pub fn new() -> Self {
        let zero = R::zero();
        let nan = R::of(f64::NAN);
        let none = Sum::of(zero);
        Self {
            x: none,
            y: none,
            yaw: none,
            height_m: none,
            set_m: zero,
            ground_slope: [zero; 2],
            attitude: Attitude::LEVEL,
            carried: Carried::at_rest(),
            rates: [zero; 3],
            place: Place::origin(),
            heading: none,
            grid: Grid::EMPTY,
            started: false,
            moved: false,
            lost_s: zero,
            travel: 1 << 16,
            travel_rest: zero,
            contact_m: [nan; N],
            ground_m: [nan; N],
            base_rise_m_s: zero,
            zero_rad: [zero; 2],
            zero_hinges_rad: [zero; MAX_HINGES],
            zero_rad_s: [zero; 3],
            zero_m_s2: [zero; 3],
            zero_count: [0; 2],
            hinges_rad: [zero; MAX_HINGES],
            hinges_rad_s: [zero; MAX_HINGES],
            tilt_rad_s: [zero; 2],
            covariance: [[zero; 3]; 3],
            variance_m2: zero,
            blind_m: zero,
            disagreement: zero,
            followed_m2: zero,
            followed_arm_m: [zero; 2],
            slope: [zero; N],
            paths: [Path::NONE; N],
            zero_variance: zero,
            periods: 0,
            by_zero: [zero; 3],
        }
    }

    /// Sets place and yaw; false, and nothing changed, where they are not finite. The yaw is wrapped. What is known of the ground, and the
    /// covariance, stay.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// let mut state = GroundOdometryState::<f64, 4>::new();
    /// assert!(state.reset([0.0, 0.0, 0.2], 7.0));
    /// assert!((state.pose().yaw_rad - (7.0 - core::f64::consts::TAU)).abs() < 1e-15);
    /// assert!(!state.reset([f64::NAN, 0.0, 0.0], 0.0));
    /// ```
    pub fn reset(&mut self, position_m: [R; 3], yaw_rad: R) -> bool {
        let [x, y, z] = position_m;
        let finite = [x, y, z, yaw_rad].iter().all(|each| each.is_finite_real());
        if finite {
            self.x = Sum::of(x);
            self.y = Sum::of(y);
            self.yaw = Sum::of(yaw_rad.wrapped_angle());
            self.set_m = z - self.height_m.total;
        }
        finite
    }

    /// Where the vehicle is, how it leans, and where its wheels touch the ground.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// assert_eq!(GroundOdometryState::<f32, 6>::new().pose().position_m[2], 0.0);
    /// ```
    #[must_use]
    pub fn pose(&self) -> GroundPose<R, N> {
        let height_m = self.height_m.total + self.set_m;
        GroundPose {
            position_m: [self.x.total, self.y.total, height_m],
            roll_rad: self.attitude.left_up_rad,
            pitch_rad: self.attitude.nose_up_rad,
            yaw_rad: self.yaw.total.wrapped_angle(),
            contact_m: self.contact_m.map(|each| each + height_m),
            slope: self.ground_slope,
        }
    }

    /// Covariance of x, y and yaw.
    ///
    /// ```
    /// use omni_core::estimate::GroundOdometryState;
    /// assert_eq!(GroundOdometryState::<f32, 6>::new().covariance().standard_deviations(), [0.0; 3]);
    /// ```
    #[must_use]
    pub fn covariance(&self) -> PoseCovariance<R> {
        PoseCovariance::of(self.covariance)
    }

    /// Variance of the height \[m^2\]. It grows with the way while no wheel follows ground whose height is known.
    #[must_use]
    pub fn height_variance_m2(&self) -> R {
        self.variance_m2
    }

    fn learn_zeros(&mut self, input: &GroundInput<R, N>, gyro_rad_s: R) {
        if !input.standing {
            self.zero_count = [0; 2];
            return;
        }
        let [moving, level] = &mut self.zero_count;
        let most = 2000;
        *moving = (*moving + 1).min(most);
        let part = R::one() / R::of(f64::from(*moving));
        self.zero_variance = gyro_rad_s * gyro_rad_s * part;
        self.by_zero = [R::zero(); 3];
        self.periods = 0;
        for (zero, read) in self.zero_rad_s.iter_mut().zip(input.imu.rate_rad_s) {
            if is_plausible(read) {
                follow(zero, read, part);
            }
        }
        if input.level {
            *level = (*level + 1).min(most);
            let part = R::one() / R::of(f64::from(*level));
            let leans = [input.imu.pitch_rad, input.imu.roll_rad];
            let gravity = [R::zero(), R::zero(), R::of(GRAVITY_M_S2)];
            for ((zero, read), level) in
                (self.zero_m_s2.iter_mut().zip(input.imu.specific_force_m_s2)).zip(gravity)
            {
                if is_plausible(read) {
                    follow(zero, read - level, part);
                }
            }
            let zeros = self.zero_rad.iter_mut().chain(&mut self.zero_hinges_rad);
            for (zero, read) in zeros.zip(leans.into_iter().chain(input.hinges_rad)) {
                if is_plausible(read) {
                    follow(zero, read, part);
                }
            }
        }
    }

    /// Attitude and hinges, rates averaged. What did not arrive is as it was, and its rate is 0.
    fn read(&mut self, input: &GroundInput<R, N>, part: R) -> Attitude<R> {
        let known = |value: R, else_: R| if is_plausible(value) { value } else { else_ };
        let angles = self.hinges_rad.iter_mut().zip(input.hinges_rad);
        for ((to, read), zero) in angles.zip(self.zero_hinges_rad) {
            *to = known(read - zero, *to);
        }
        let [p, q, _] = self.rates;
        let now = input.hinges_rad_s.into_iter().chain([p, q]);
        let rates = self.hinges_rad_s.iter_mut().chain(&mut self.tilt_rad_s);
        for (rate, now) in rates.zip(now) {
            follow(rate, known(now, R::zero()), part);
        }
        let [p, q] = self.tilt_rad_s;
        self.attitude = self.carried.attitude(&[p, q, R::zero()]);
        self.attitude
    }

    /// The covariance of place and yaw after a period.
    fn grow(
        &mut self,
        gained: &[R; 3],
        lost: &[R; 3],
        [wx, wy]: [R; 2],
        moved: &Travel<R>,
        period_s: R,
        gyro_rad_s: R,
    ) {
        // F P F^T for the F that adds yaw to x and y, and the gyro's zero to yaw.
        let (a, b) = (-wy, wx);
        let turned = -(period_s * moved.gyro_part);
        let [[xx, xy, xw], [_, yy, yw], [_, _, ww]] = self.covariance;
        let [zx, zy, zw] = self.by_zero;
        let (xw_new, yw_new) = (xw + a * ww, yw + b * ww);
        let (zx_new, zy_new, zw_new) = (zx + a * zw, zy + b * zw, zw + turned * self.zero_variance);
        let slip = R::of(SLIP_PART * SLIP_PART * SLIP_S) * moved.disagreement * period_s;
        let xx = xx + a * (xw + xw_new) + gained[0] - lost[0] + slip;
        let xy = xy + a * yw + b * xw_new + gained[1] - lost[1];
        let yy = yy + b * (yw + yw_new) + gained[2] - lost[2] + slip;
        let xw = xw_new + turned * zx_new;
        let yw = yw_new + turned * zy_new;
        let (part, rest) = (moved.gyro_part, R::one() - moved.gyro_part);
        let rate_noise = part * part * gyro_rad_s * gyro_rad_s + rest * moved.covariance[2][2];
        let yaw_noise = rate_noise * period_s * period_s;
        let ww = ww + turned * (zw + zw_new) + yaw_noise;
        self.by_zero = [zx_new, zy_new, zw_new];
        self.covariance = [[xx, xy, xw], [xy, yy, yw], [xw, yw, ww]];
    }
}

#[cfg(test)]
mod tests;
