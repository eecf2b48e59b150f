use super::*;
use crate::geometry::{Kinematics, WheelLayout};
use crate::motor::TorqueLimit;
use crate::path::*;
use crate::shaping::MotionLimits;
use proptest::prelude::*;
use std::vec;
use std::vec::Vec;

mod extremes;
mod times;

const STALL_N_M: f64 = 3.0;
const SLOPE_N_M_S: f64 = 0.1;

fn limits<R: Real>() -> PathLimits<R, 4> {
    let of = R::of;
    let linear = MotionLimits {
        velocity: of(1.0),
        acceleration: of(1.5),
        deceleration: of(2.0),
        jerk: of(12.0),
    };
    let yaw = MotionLimits {
        velocity: of(2.0),
        acceleration: of(5.0),
        deceleration: of(6.0),
        jerk: of(60.0),
    };
    // The mass ahead of the middle, so that turning takes force and moving moment.
    let body = PlanarInertia {
        mass_kg: of(24.0),
        yaw_kg_m2: of(1.3),
        centre_m: [of(0.05), of(-0.02)],
    };
    let torque = TorqueLimit::line(of(STALL_N_M), of(SLOPE_N_M_S)).expect("in range");
    let mut limits = PathLimits::new(linear, yaw, body, [of(20.0); 4], [torque; 4]);
    limits.wheel_kg_m2 = [of(0.0035); 4];
    limits.fastest = BodyTwist::from_array([of(1.0), of(0.8), of(2.0)]);
    limits.quickest = BodyTwist::from_array([of(3.0), of(2.5), of(8.0)]);
    limits
}

fn planner_within<R: Real>(limits: PathLimits<R, 4>) -> TrajectoryPlanner<R, 4> {
    let layout = WheelLayout::mecanum4(R::of(0.5), R::of(0.4), R::of(0.076)).expect("valid");
    TrajectoryPlanner::new(&Kinematics::new(&layout).expect("valid"), limits).expect("in range")
}

fn planner<R: Real>() -> TrajectoryPlanner<R, 4> {
    planner_within(limits())
}

/// A plan with the room it has.
struct Plan<R>(Vec<PathSegment<R>>, Vec<PathPiece<R>>);

impl<R: Real> Plan<R> {
    fn try_of(
        planner: &TrajectoryPlanner<R, 4>,
        waypoints: &[Waypoint<R>],
    ) -> Result<Self, crate::ConfigError> {
        let [segments, pieces] = TrajectoryPlanner::<R, 4>::room(waypoints);
        let mut plan = Self(vec![PathSegment::EMPTY; segments], vec![PathPiece::EMPTY; pieces]);
        planner.plan(waypoints, &mut plan.0, &mut plan.1)?;
        Ok(plan)
    }

    fn of(planner: &TrajectoryPlanner<R, 4>, waypoints: &[Waypoint<R>]) -> Self {
        Self::try_of(planner, waypoints).expect("can be planned")
    }

    fn trajectory(&self) -> Trajectory<'_, R> {
        Trajectory::new(&self.0, &self.1)
    }

    fn samples(&self, step_s: f64) -> impl Iterator<Item = TrajectorySample<R>> {
        let steps = (self.trajectory().duration_s().as_f64() / step_s) as u32 + 2;
        (0..steps).map(move |k| self.trajectory().at(R::of(f64::from(k) * step_s)))
    }
}

fn shaped<R: Real>(x: f64, y: f64, shape: WayShape<R>) -> Waypoint<R> {
    Waypoint {
        shape,
        ..Waypoint::at(R::of(x), R::of(y))
    }
}

fn headed<R: Real>(mut waypoint: Waypoint<R>, heading: f64) -> Waypoint<R> {
    waypoint.heading_rad = Some(R::of(heading));
    waypoint
}

fn eight() -> [Waypoint<f64>; 5] {
    let arc = |x, y, sweep_rad| shaped(x, y, WayShape::Arc { sweep_rad });
    let pi = core::f64::consts::PI;
    [
        Waypoint::at(0.0, 0.0),
        arc(0.0, 2.0, pi),
        arc(0.0, 0.0, pi),
        arc(0.0, -2.0, -pi),
        headed(arc(0.0, 0.0, -pi), 1.5),
    ]
}

/// What all samples of a plan keep to, and how much of it they use at most.
fn check(
    planner: &TrajectoryPlanner<f64, 4>,
    limits: &PathLimits<f64, 4>,
    plan: &Plan<f64>,
) -> Result<f64, TestCaseError> {
    // What lies between the points that were looked at: splines bend most there.
    const BETWEEN: f64 = 1.01;
    let share = limits.share * BETWEEN;
    let mut most: f64 = 0.0;
    for sample in plan.samples(2e-3) {
        let (turns, torques) = (planner.velocities(&sample), planner.torques(&sample));
        for ((turn, torque), speed) in turns.rad_s.iter().zip(torques.n_m).zip(limits.speeds_rad_s) {
            let gives = STALL_N_M - SLOPE_N_M_S * turn.abs();
            prop_assert!(turn.abs() <= share * speed, "{turn} rad/s at {}", sample.time_s);
            prop_assert!(
                torque.abs() <= share * gives,
                "{torque} of {gives} N.m at {}",
                sample.time_s
            );
            most = most.max(torque.abs() / gives);
        }
        for (v, most) in sample
            .feed_forward()
            .to_array()
            .iter()
            .zip(limits.fastest.to_array())
        {
            prop_assert!(v.abs() <= BETWEEN * most, "{v} at {}", sample.time_s);
        }
        let v = sample.velocity;
        prop_assert!(v.vx_m_s.hypot(v.vy_m_s) <= BETWEEN * limits.linear.velocity);
        prop_assert!(v.wz_rad_s.abs() <= BETWEEN * limits.yaw.velocity);
        prop_assert!(sample.acceleration[2].abs() <= BETWEEN * limits.yaw.deceleration);
    }
    Ok(most)
}

/// Velocity is the change of the pose, acceleration that of the velocity, and that changes no
/// faster than the jerk lets it but where curvature does.
fn check_motion(plan: &Plan<f64>, curvature_jumps: bool) -> Result<(), TestCaseError> {
    let h = 1e-4;
    let all: Vec<_> = plan.samples(h).collect();
    for pair in all.windows(2) {
        let [a, b] = pair else { continue };
        let world = |s: &TrajectorySample<f64>| [s.velocity.vx_m_s, s.velocity.vy_m_s, s.velocity.wz_rad_s];
        let moved = [
            b.pose.x_m - a.pose.x_m,
            b.pose.y_m - a.pose.y_m,
            (b.pose.yaw_rad - a.pose.yaw_rad).wrapped_angle(),
        ];
        for k in 0..3 {
            // The trapezoid's error is jerk h^3 / 12 = 1e-11 of a metre at 12 m/s^3 and 1e-10 rad
            // at 60 rad/s^3; where the period of the sample holds a joint of segments twice that.
            // Arcs are polynomials, 5e-6 of the radius off.
            let trapezoid = 0.5 * h * (world(a)[k] + world(b)[k]);
            prop_assert!(
                (moved[k] - trapezoid).abs() < 1e-8,
                "{k} at {}: {} {trapezoid}",
                a.time_s,
                moved[k]
            );
            let change = world(b)[k] - world(a)[k];
            let mean = 0.5 * h * (a.acceleration[k] + b.acceleration[k]);
            let jump = if curvature_jumps { 1e-3 } else { 1e-6 };
            prop_assert!(
                (change - mean).abs() < jump,
                "{k} at {}: {change} {mean}",
                a.time_s
            );
            // 12 and 60 per second cubed, three parts of them across and along.
            let most = h * if k == 2 { 60.0 } else { 12.0 };
            let jerk = (b.acceleration[k] - a.acceleration[k]).abs();
            prop_assert!(
                curvature_jumps || jerk <= 1.02 * most + 1e-9,
                "{k} at {}: {jerk} of {most}",
                a.time_s
            );
        }
    }
    Ok(())
}

#[test]
fn from_rest_to_rest_on_a_line_takes_what_the_seven_phases_take() {
    // Speed, acceleration, jerk and way, so that each of the phases is there or not; deceleration is acceleration.
    for (v, a, j, way) in [
        (0.5, 1.0, 10.0, 2.0),
        (0.5, 1.0, 10.0, 0.1),
        (0.9, 1.0, 2.0, 3.0),
        (0.9, 1.0, 2.0, 0.2),
    ] {
        let mut limits = limits();
        limits.linear = MotionLimits {
            velocity: v,
            acceleration: a,
            deceleration: a,
            jerk: j,
        };
        let plan = Plan::of(
            &planner_within(limits),
            &[Waypoint::at(0.0, 0.0), Waypoint::at(way, 0.0)],
        );
        let ramp = |v: f64| {
            if v * j < a * a {
                2.0 * (v / j).sqrt()
            } else {
                v / a + a / j
            }
        };
        let expected = if v * ramp(v) <= way {
            ramp(v) + way / v
        } else if 2.0 * a * a * a / (j * j) >= way {
            4.0 * (way / (2.0 * j)).cbrt() // jerk all the way: way = 2 j t^3, four times
        } else {
            // v (v / a + a / j) = way
            let peak = 0.5 * (-a * a / j + ((a * a / j).powi(2) + 4.0 * a * way).sqrt());
            2.0 * ramp(peak)
        };
        let found = plan.trajectory().duration_s();
        // Roots and bisections in f64.
        assert!(
            (found - expected).abs() < 1e-9,
            "{v} {a} {j} {way}: {found} {expected}"
        );
    }
}

#[test]
fn along_a_figure_of_eight_wheels_keep_to_what_they_turn_and_push() {
    let planner = planner::<f64>();
    let plan = Plan::of(&planner, &eight());
    let most = check(&planner, &limits(), &plan).expect("within limits");
    assert!(most > 0.5, "{most}"); // not by being slow: the command's limits are met first
    check_motion(&plan, true).expect("moves as it says");
    // Never at rest between: all of it is one smooth path.
    let speeds = plan
        .samples(1e-2)
        .filter(|s| s.time_s > 1.0 && s.time_s < plan.trajectory().duration_s() - 1.0);
    assert!(speeds.map(|s| s.speed_m_s).fold(f64::INFINITY, f64::min) > 0.3);
    for sample in plan.samples(1e-2) {
        let middle = if sample.pose.y_m > 0.0 { 1.0 } else { -1.0 };
        let radius = sample.pose.x_m.hypot(sample.pose.y_m - middle);
        assert!((radius - 1.0).abs() < 6e-6, "{radius}"); // 45 degrees as a polynomial: (pi/8)^6 / 720 = 5e-6 of it
    }
}

#[test]
fn more_mass_or_weaker_motors_take_longer_stronger_ones_as_long_as_the_command() {
    let lasts = |mass_kg: f64| {
        let mut limits = limits();
        limits.body.mass_kg = mass_kg;
        let planner = planner_within(limits);
        let plan = Plan::of(&planner, &eight());
        let most = check(&planner, &limits, &plan).expect("within limits");
        (plan.trajectory().duration_s(), most)
    };
    let [(slow, most), (usual, _), (light, _), (lighter, _)] = [96.0, 24.0, 2.0, 1.0].map(lasts);
    assert!(slow > 1.2 * usual && most > 0.7, "{slow} {usual} {most}"); // of the 0.9 that it may take of its motors
    assert!((light - lighter).abs() < 0.02 * light); // wheels' inertia and the command's limits are left
}

#[test]
fn corners_are_stopped_at_and_smooth_waypoints_are_not() {
    let path = [
        Waypoint::at(0.0, 0.0),
        Waypoint::at(1.0, 0.0),
        Waypoint::at(2.0, 0.0),
        Waypoint::at(2.0, 1.0),
    ];
    let plan = Plan::of(&planner::<f64>(), &path);
    let [_, second, third] = [0, 1, 2].map(|k| plan.trajectory().at(plan.0[k].start_s()));
    assert!(second.speed_m_s > 0.5 && (second.pose.x_m - 1.0).abs() < 1e-9);
    assert!(third.speed_m_s < 1e-6 && (third.pose.x_m - 2.0).abs() < 1e-9);
}

#[test]
fn a_spline_through_points_of_a_circle_is_that_circle() {
    let points: Vec<_> = (0..=12)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * core::f64::consts::PI / 6.0).sin_cos();
            shaped::<f64>(cos, sin, WayShape::Spline)
        })
        .collect();
    let plan = Plan::of(&planner::<f64>(), &points);
    for sample in plan.samples(1e-2) {
        let radius = sample.pose.x_m.hypot(sample.pose.y_m);
        assert!((radius - 1.0).abs() < 1e-5, "{radius}"); // 30 degrees by a polynomial of the fifth degree
    }
    check_motion(&plan, false).expect("moves as it says");
    // The way is the circle's, and the speed that of the path: both to what the parametrisation by the way is off.
    let way: f64 = plan.0.iter().map(PathSegment::length_m).sum();
    assert!((way - core::f64::consts::TAU).abs() < 1e-4, "{way}");
}

#[test]
fn headings_take_the_shorter_turn_and_rest_where_they_are_given() {
    let path = [
        headed(Waypoint::at(0.0, 0.0), 3.0),
        headed(Waypoint::at(2.0, 0.0), -3.0),
        headed(Waypoint::at(2.0, 0.0), 3.0),
    ];
    let plan = Plan::of(&planner::<f64>(), &path);
    for sample in plan.samples(1e-2) {
        assert!(sample.pose.yaw_rad.abs() > 3.0 - 1e-9, "{}", sample.pose.yaw_rad); // across the seam, never through 0
    }
    let there = plan.trajectory().at(plan.0[1].start_s());
    assert!((there.pose.yaw_rad + 3.0).abs() < 1e-9 && there.velocity.wz_rad_s.abs() < 1e-9);
    let turning = plan
        .trajectory()
        .at(0.5 * (plan.0[1].start_s() + plan.trajectory().duration_s()));
    assert!(turning.velocity.wz_rad_s < -0.1 && turning.velocity.vx_m_s == 0.0); // on the spot, back again
    assert!((plan.trajectory().at(1e9).pose.yaw_rad - 3.0).abs() < 1e-9);
}

#[test]
fn single_precision_is_where_double_precision_is() {
    let single = |w: &Waypoint<f64>| {
        let mut other = shaped(
            w.x_m,
            w.y_m,
            match w.shape {
                WayShape::Arc { sweep_rad } => WayShape::Arc {
                    sweep_rad: sweep_rad as f32,
                },
                WayShape::Spline => WayShape::Spline,
                WayShape::Line => WayShape::Line,
            },
        );
        other.heading_rad = w.heading_rad.map(|h| h as f32);
        other
    };
    let (double, path) = (Plan::of(&planner::<f64>(), &eight()), eight().map(|w| single(&w)));
    let plan = Plan::of(&planner::<f32>(), &path);
    let (a, b) = (double.trajectory(), plan.trajectory());
    // Limits are found by bisection to 1e-7, and add up over 20 s; positions follow at 1 m/s.
    assert!((a.duration_s() - f64::from(b.duration_s())).abs() < 1e-3);
    for k in 0..2000 {
        let t = f64::from(k) * 1e-2;
        let (a, b) = (a.at(t).pose, b.at(t as f32).pose);
        assert!(
            (a.x_m - f64::from(b.x_m)).hypot(a.y_m - f64::from(b.y_m)) < 1e-3,
            "{t}"
        );
    }
}

#[test]
fn what_cannot_be_planned_is_refused_by_waypoint() {
    let planner = planner::<f64>();
    let start = Waypoint::at(0.0, 0.0);
    let timed = |x, time_s| Waypoint {
        time_s: Some(time_s),
        ..Waypoint::at(x, 0.0)
    };
    let said = |path: &[Waypoint<f64>]| Plan::try_of(&planner, path).err().expect("refused");
    for (path, parameter, index) in [
        (&[start][..], "waypoints", None),
        (&[start, start], "waypoint.x_m", Some(1)),
        (&[start, Waypoint::at(f64::NAN, 0.0)], "waypoint.x_m", Some(1)),
        (
            &[start, timed(1.0, 5.0), timed(2.0, 4.0)],
            "waypoint.time_s",
            Some(2),
        ),
        (
            &[start, timed(1.0, 5.0), timed(9.0, 6.0)],
            "waypoint.time_s",
            Some(2),
        ),
        (
            &[start, shaped(1.0, 0.0, WayShape::Arc { sweep_rad: 6.5 })],
            "waypoint.sweep_rad",
            Some(1),
        ),
    ] {
        let error = said(path);
        assert_eq!((error.parameter, error.index), (parameter, index), "{error}");
    }
    let (mut segments, mut pieces) = ([PathSegment::EMPTY; 1], [PathPiece::EMPTY; 3]);
    let error = planner
        .plan(&eight(), &mut segments, &mut pieces)
        .expect_err("no room");
    assert_eq!((error.parameter, error.value), ("segments", 1.0));
}

fn any_path() -> impl Strategy<Value = Vec<Waypoint<f64>>> {
    let place = (
        -2.0..2.0,
        -2.0..2.0,
        prop::option::of(-3.0..3.0),
        0..3,
        prop_oneof![-3.0..-0.2, 0.2..3.0],
    );
    prop::collection::vec(place, 2..6).prop_map(|places| {
        places
            .into_iter()
            .map(|(x, y, heading_rad, kind, sweep_rad)| {
                let shape = match kind {
                    0 => WayShape::Line,
                    1 => WayShape::Arc { sweep_rad },
                    _ => WayShape::Spline,
                };
                Waypoint {
                    heading_rad,
                    ..shaped(x, y, shape)
                }
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn every_wheel_keeps_to_what_it_turns_and_pushes_wherever_the_path_goes(path in any_path()) {
        let planner = planner::<f64>();
        let plan = Plan::of(&planner, &path);
        check(&planner, &limits(), &plan)?;
        let end = plan.trajectory().at(plan.trajectory().duration_s());
        let last = path[path.len() - 1];
        prop_assert!(end.done && (end.pose.x_m - last.x_m).hypot(end.pose.y_m - last.y_m) < 1e-9);
    }

    #[test]
    fn whatever_is_given_nothing_panics_and_what_is_planned_is_finite(
        values in prop::collection::vec((any::<f32>(), any::<f32>(), prop::option::of(any::<f32>()), any::<f32>(), 0..3), 0..5),
        times in prop::collection::vec(any::<f32>(), 10),
    ) {
        let path: Vec<_> = values.into_iter().map(|(x, y, some, sweep_rad, kind)| {
            let shape = match kind {
                0 => WayShape::Line,
                1 => WayShape::Arc { sweep_rad },
                _ => WayShape::Spline,
            };
            Waypoint { x_m: x, y_m: y, heading_rad: some, shape, speed_m_s: some, time_s: some }
        }).collect();
        if let Ok(plan) = Plan::try_of(&planner::<f32>(), &path) {
            for time_s in times {
                let pose = plan.trajectory().at(time_s).pose;
                prop_assert!(pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite());
            }
        }
    }
}
