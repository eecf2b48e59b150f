//! The odometry of a run, with its covariance.

use omni_core::BodyTwist;
use omni_core::estimate::{CovarianceGrowth, Odometry, OdometryNoise, OdometryState, PoseCovariance};
use omni_core::geometry::{BodyDisplacement, PlanarPose, WheelAngles};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::config::{self, DriveNoise, OdometryKind, PoseSource, Scenario, Vehicle, WheelMaps};
use crate::control_sample::ControlSample;
use crate::ground_odometry::{self, GroundOdometer};
use crate::observation::{OdometryEstimate, Pose3};
use crate::report::GroundReport;
use crate::sensed::Sensed;

/// A vehicle of fewer wheels has columns of zeros, so that how many there are does not matter.
const WHEELS: usize = config::MOST_WHEELS;
/// Time over which what the wheels turned is gathered before the covariance grows by it \[s\]. A slip of one
/// period and one count of a coarse encoder are then no noise of their own, and it costs next to nothing.
const WINDOW_S: f64 = 0.01;

/// Speeds along \[m/s\] and about \[rad/s\] where it is not known how fast the vehicle goes: the
/// most that a file may have.
const FASTEST: f64 = 100.0;

/// Dead reckoning by twists: how many wheels there are does not matter to it.
type ByTwists = Odometry<f64, 1>;

/// The saved state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct State {
    reckoned: OdometryState<f64, 1>,
    twist: BodyTwist<f64>,
    covariance: PoseCovariance<f64>,
    /// Rotation of the wheels since the covariance grew \[rad\], the number of periods, and the pose then.
    turned: [f64; WHEELS],
    periods: u32,
    from: PlanarPose<f64>,
    /// Wheels that are excluded.
    excluded: [bool; WHEELS],
    /// How far it may have come along \[m\] and about \[rad\] since too few wheels determine the
    /// motion, and how fast it was or may be.
    drift: [f64; 2],
    drift_speed: [f64; 2],
    ground: Option<ground_odometry::State>,
}

/// The odometry of a vehicle, with its state.
pub(crate) struct Odometer {
    vehicle: Vehicle,
    odometry: ByTwists,
    growth: CovarianceGrowth<f64>,
    /// Takes each residual as the deviation that it is.
    residual_growth: CovarianceGrowth<f64>,
    /// The fastest that the vehicle goes along \[m/s\] and about \[rad/s\].
    top: [f64; 2],
    period_s: f64,
    /// Periods after which the covariance grows.
    window: u32,
    start: PlanarPose<f64>,
    /// The controller is a drive, whose own pose counts.
    drive: bool,
    /// None if too few wheels determine the motion.
    maps: Option<WheelMaps>,
    /// Odometry in three dimensions, where the scenario uses it, and whether its pose is the one that is given.
    ground: Option<GroundOdometer>,
    shows_ground: bool,
    state: State,
}

impl Odometer {
    /// Of a scenario whose vehicle starts at a true pose.
    pub(crate) fn new(scenario: &Scenario, start: &Pose3) -> Result<Self, Error> {
        let refuse = |error: omni_core::ConfigError| config::Error::Key {
            file: format!("scenario {}", scenario.name),
            key: error.parameter.into(),
            message: error.to_string(),
        };
        let noise = scenario
            .drive
            .as_ref()
            .and_then(|drive| drive.noise)
            .unwrap_or_default();
        let DriveNoise {
            wheel_rad_per_sqrt_rad,
            residual_gain,
            ..
        } = noise;
        let growth = CovarianceGrowth::new(OdometryNoise {
            wheel_rad_per_sqrt_rad,
            residual_gain,
        });
        let residual_growth = CovarianceGrowth::new(OdometryNoise {
            wheel_rad_per_sqrt_rad: 0.0,
            residual_gain: 1.0,
        });
        let [ahead, aside, about] = scenario.vehicle().top_speeds()?;
        let period_s = scenario.period_s();
        let excluded = [false; WHEELS];
        let odometry = Odometry::new(scenario.period_s()).map_err(refuse)?;
        let shows_ground = scenario.odometry.kind == OdometryKind::Ground;
        let is_followed =
            scenario.command.path.is_some() && scenario.command.follow.pose == PoseSource::Estimate;
        let ground = if shows_ground || is_followed {
            Some(GroundOdometer::new(scenario, start, &odometry)?)
        } else {
            None
        };
        let start = start.planar();
        let mut reckoned = OdometryState::new();
        reckoned.reset(&start);
        Ok(Self {
            maps: scenario.vehicle().wheel_maps(&excluded).map_err(refuse)?,
            vehicle: scenario.vehicle().clone(),
            odometry,
            growth: growth.map_err(refuse)?,
            residual_growth: residual_growth.map_err(refuse)?,
            top: [ahead.max(aside), about].map(|speed| speed.min(FASTEST)),
            period_s,
            window: (WINDOW_S / period_s).round().max(1.0) as u32,
            start,
            drive: scenario.drive.is_some(),
            ground,
            shows_ground,
            state: State {
                from: reckoned.pose(),
                reckoned,
                twist: BodyTwist::ZERO,
                covariance: PoseCovariance::default(),
                turned: [0.0; WHEELS],
                periods: 0,
                excluded,
                drift: [0.0; 2],
                drift_speed: [0.0; 2],
                ground: None,
            },
        })
    }

    /// The sensors were read at the end of a period of a controller. A drive that has not read them yet keeps its pose.
    pub(crate) fn read(&mut self, control: &ControlSample, sensed: &Sensed) {
        if let Some(ground) = &mut self.ground {
            ground.step(control, sensed);
        }
        if let Some(ground) = self.shown() {
            let planar = ground.planar();
            self.state.reckoned.reset(&planar.pose);
            (self.state.twist, self.state.covariance) = (planar.twist, planar.covariance);
        } else if !self.drive {
            let velocities = sensed.wheels_rad_s.iter().copied();
            self.turn(velocities.zip(sensed.increments_rad.iter().copied()), |_| false);
        }
    }

    /// The controller did its step: where it is a drive, its own pose counts, and which wheels it excludes.
    pub(crate) fn stepped(&mut self, sample: &ControlSample) {
        let (Some(drive), None) = (&sample.report.drive, self.shown()) else {
            return;
        };
        let excluded = |wheel: usize| drive.wheels.get(wheel).is_some_and(|wheel| wheel.excluded);
        let period_s = self.period_s;
        let wheels = sample.wheels.iter().map(|wheel| wheel.measured_rad_s);
        self.turn(wheels.map(|velocity| (velocity, velocity * period_s)), excluded);
        let PlanarPose { x_m, y_m, yaw_rad } = drive.pose;
        let (sin, cos) = omni_core::Real::sine_cosine(self.start.yaw_rad);
        // Of nonsense over a link nothing is taken.
        self.state.reckoned.reset(&PlanarPose {
            x_m: self.start.x_m + cos * x_m - sin * y_m,
            y_m: self.start.y_m + sin * x_m + cos * y_m,
            yaw_rad: self.start.yaw_rad + yaw_rad,
        });
    }

    /// The wheels turned with these velocities \[rad/s\], by these angles \[rad\], in a period. One without a reading
    /// is excluded.
    fn turn(&mut self, wheels: impl Iterator<Item = (f64, f64)>, is_excluded: impl Fn(usize) -> bool) {
        let (mut read, mut turned, mut excluded) = ([0.0; WHEELS], [0.0; WHEELS], [false; WHEELS]);
        for (i, (velocity, increment)) in wheels.enumerate().take(WHEELS) {
            excluded[i] = is_excluded(i) || !(velocity.is_finite() && increment.is_finite());
            if !excluded[i] {
                (read[i], turned[i]) = (velocity, increment);
            }
        }
        if excluded != self.state.excluded {
            self.grow();
            // The layout was good with all wheels.
            self.maps = self.vehicle.wheel_maps(&excluded).ok().flatten();
            self.state.excluded = excluded;
            if self.maps.is_some() {
                self.state.drift = [0.0; 2];
            }
        }
        let Some(maps) = &self.maps else {
            self.grow_without_motion();
            return;
        };
        self.state.twist = BodyTwist::from_array(maps.twist(&read));
        let [dx_m, dy_m, dyaw_rad] = maps.twist(&turned);
        let displacement = BodyDisplacement { dx_m, dy_m, dyaw_rad };
        self.odometry
            .step_displacement(&mut self.state.reckoned, &displacement);
        for (sum, turned) in self.state.turned.iter_mut().zip(&turned) {
            *sum += turned;
        }
        self.state.periods += 1;
        if self.state.periods >= self.window {
            self.grow();
        }
    }

    /// The motion is undetermined for a period. The vehicle may be as far as its top speed brings
    /// it, or that which it had: that is the deviation along every axis, in proportion to the time,
    /// because one way lasts. The yaw uncertainty is at most half a turn.
    fn grow_without_motion(&mut self) {
        const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let state = &mut self.state;
        if state.drift == [0.0; 2] {
            let BodyTwist {
                vx_m_s,
                vy_m_s,
                wz_rad_s,
            } = state.twist;
            let had = [libm::hypot(vx_m_s, vy_m_s), wz_rad_s.abs()];
            state.drift_speed = [0, 1].map(|axis| self.top[axis].max(had[axis]));
        }
        state.twist = BodyTwist::ZERO;
        let [way, turn] = [0, 1].map(|axis| state.drift[axis] + state.drift_speed[axis] * self.period_s);
        let further = [way, turn.min(std::f64::consts::PI)];
        // The deviations grow in a straight line: so much is new of their squares.
        let [way, turn] = [0, 1].map(|axis| {
            (further[axis].powi(2) - state.drift[axis].powi(2))
                .max(0.0)
                .sqrt()
        });
        state.drift = further;
        self.residual_growth.step_by(
            &mut state.covariance,
            &PlanarPose::origin(),
            &AXES,
            &[0.0; 3].into(),
            &[way, way, turn].into(),
        );
    }

    /// Takes what was turned since the last time into the covariance.
    fn grow(&mut self) {
        let state = &mut self.state;
        if let (Some(maps), 1..) = (&self.maps, state.periods) {
            let residuals = WheelAngles {
                rad: maps.residuals(&state.turned),
            };
            let turned = WheelAngles { rad: state.turned };
            self.growth.step_by(
                &mut state.covariance,
                &state.from,
                &maps.forward,
                &turned,
                &residuals,
            );
        }
        state.turned = [0.0; WHEELS];
        state.periods = 0;
        state.from = state.reckoned.pose();
    }

    /// Its present pose.
    pub(crate) fn estimate(&self) -> OdometryEstimate {
        OdometryEstimate {
            pose: self.state.reckoned.pose(),
            twist: self.state.twist,
            covariance: *self.state.covariance.matrix(),
            twist_covariance: self.shown().and_then(|ground| ground.planar().twist_covariance),
        }
    }

    /// Odometry in three dimensions, if its pose is the one that is given.
    fn shown(&self) -> Option<&GroundOdometer> {
        self.ground.as_ref().filter(|_| self.shows_ground)
    }

    /// What it knows besides, in three dimensions.
    pub(crate) fn ground(&self) -> Option<&GroundReport> {
        self.shown().map(GroundOdometer::report)
    }

    /// The pose by odometry in three dimensions, whether or not it is the one that is given; none if nothing uses it.
    pub(crate) fn estimated_pose(&self) -> Option<PlanarPose<f64>> {
        self.ground.as_ref().map(|ground| ground.planar().pose)
    }

    pub(crate) fn state(&self) -> State {
        let ground = self.ground.as_ref().map(GroundOdometer::state);
        State {
            ground,
            ..self.state.clone()
        }
    }

    /// Goes on from what another one remembered; false where that was of another kind.
    pub(crate) fn restore(&mut self, mut state: State) -> bool {
        let ground = state.ground.take();
        self.maps = self.vehicle.wheel_maps(&state.excluded).ok().flatten();
        self.state = state;
        match (&mut self.ground, &ground) {
            (Some(own), Some(state)) => own.restore(state),
            (None, None) => true,
            _ => false,
        }
    }
}
