//! Odometry in three dimensions of `omni-core` on the plant: position, height and edges compared with the simulation,
//! and with odometry by the wheels alone.
//!
//! Sensors have the noise of commercial ones, at 200 Hz: wheel encoders 0.05 rad/s; gyros an angular random walk of
//! 1 mrad per root of s, and a bias; an accelerometer 0.05 m/s^2 and a bias; hinges 1 mrad, a bias, and 0.05 rad/s. The
//! vehicle stands for four seconds, then drives forward at 0.3 m/s for nine. Settings were found on seeds below 100.

use omni_core::estimate::{
    EdgeEvent, EdgeKind, EstimatorConfig, GroundInput, GroundOdometry, GroundOdometryConfig, Odometry,
    OdometryState, PoseCovariance,
};
use omni_core::geometry::PlanarPose;
use omni_core::{BodyTwist, Kinematics, Real};
use omni_sim::Simulation;
use omni_sim::config::{Override, Scenario};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

const PERIODS: usize = 5;
const STANDS_S: f64 = 4.0;
const DRIVES_S: f64 = 9.0;
/// The simulator's sensors, at 1 kHz; five readings make one at 200 Hz.
const IMPERFECT: [&str; 4] = [
    "sensors.encoder_noise_rad_s=0.1",
    "sensors.gyro_noise_rad_s=0.0316",
    "sensors.accelerometer_noise_m_s2=0.1",
    "sensors.attitude_walk_rad_per_sqrt_s=1e-3",
];
/// 1 mrad per root of s at 200 Hz.
const GYRO_RAD_S: f64 = 0.0141;
const HINGE_RAD: f64 = 1e-3;
const HINGE_RAD_S: f64 = 0.05;
/// Standard deviations of the biases: of gyros \[rad/s\], accelerometer \[m/s^2\], attitude and hinges \[rad\].
const BIASES: [f64; 4] = [5e-3, 0.05, 4e-3, 3e-3];

/// A number of the standard normal distribution, approximated by twelve uniform ones.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12)
        .map(|_| (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
        .sum::<f64>()
        - 6.0
}

/// Scenario, the keys of its ground, and the height of its edges \[m\]; none without edges.
struct Ground {
    name: &'static str,
    scenario: &'static str,
    keys: &'static [&'static str],
    edge_m: Option<f64>,
}

const GROUNDS: [Ground; 6] = [
    Ground {
        name: "flat",
        scenario: "flat",
        keys: &[],
        edge_m: None,
    },
    Ground {
        name: "ice",
        scenario: "ice",
        keys: &[],
        edge_m: None,
    },
    Ground {
        name: "step",
        scenario: "step",
        keys: &["terrain.height_m=0.03"],
        edge_m: Some(0.03),
    },
    Ground {
        name: "stairs",
        scenario: "stairs",
        keys: &["terrain.tread_m=0.9", "terrain.count=2", "terrain.friction=0.7"],
        edge_m: Some(0.03),
    },
    Ground {
        name: "ramp",
        scenario: "ramp",
        keys: &["terrain.slope_rad=0.15", "terrain.length_m=1.5"],
        edge_m: None,
    },
    Ground {
        name: "bumps",
        scenario: "bumps",
        keys: &[
            "terrain.height_m=0.015",
            "terrain.width_m=0.03",
        ],
        edge_m: Some(0.015),
    },
];

/// Result of a drive.
struct Drive {
    /// Error forward and to the left, of the height and of the yaw at the end \[m, m, m, rad\].
    error: [f64; 4],
    /// Error of odometry by the wheels at the end, forward and to the left.
    odometry_m: [f64; 2],
    /// Largest error of the height in the drive \[m\].
    height_peak_m: f64,
    /// Normalised squared errors of x, y and yaw over three, and of the height, mean over the drive.
    nees: [f64; 2],
    /// Errors of the heights of edges that were climbed or left: in metres, and over their standard deviation.
    edges_m: Vec<[f64; 2]>,
    /// Errors of the angles of edges.
    angles_rad: Vec<f64>,
    /// The vehicle reached the end of the ground.
    is_across: bool,
}

/// `e^T P^-1 e` by elimination.
fn nees(mut p: [[f64; 3]; 3], mut e: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        sum += e[i] * e[i] / p[i][i];
        for j in i + 1..3 {
            let factor = p[j][i] / p[i][i];
            for k in i..3 {
                p[j][k] -= factor * p[i][k];
            }
            e[j] -= factor * e[i];
        }
    }
    sum
}

/// What the sensors are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    /// Exact, each millisecond.
    Exact,
    /// As bought, with roll and pitch, at 200 Hz.
    AsBought,
    /// As bought, without roll and pitch.
    NoAttitude,
}

fn drive<R: Real, const N: usize>(
    ground: &Ground,
    vehicle: &str,
    unit: Unit,
    [vx_m_s, vy_m_s]: [f64; 2],
    seed: u64,
) -> Drive {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut keys: Vec<_> = [
        "physics.engine=articulated",
        "physics.wheel_model=rollers",
        "control.policy=traction",
        "perturbation.yaw_rad=0.01",
        "perturbation.start_m=0.03",
    ]
    .iter()
    .chain(ground.keys)
    .map(|key| Override::parse(key).expect("KEY=VALUE"))
    .collect();
    keys.push(Override::new("vehicle", vehicle));
    keys.push(Override::new("seed", seed as i64));
    let noise = f64::from(u8::from(unit != Unit::Exact));
    let [gyro, force, attitude, hinge] = BIASES.map(|bias| noise * bias * normal(&mut rng));
    if unit != Unit::Exact {
        for key in IMPERFECT {
            keys.push(Override::parse(key).expect("KEY=VALUE"));
        }
        keys.push(Override::new("sensors.gyro_bias_rad_s", gyro));
        keys.push(Override::new("sensors.accelerometer_bias_m_s2", force));
        keys.push(Override::new("sensors.attitude_bias_rad", attitude));
    }
    let scenario = Scenario::load(ground.scenario, &keys).expect("valid");
    assert_eq!(scenario.period_s(), 1e-3);
    let layout = scenario.vehicle().layout().expect("as many wheels");
    let kinematics = Kinematics::<R, N>::new(&layout).expect("sound");
    let linkage = scenario.vehicle().linkage::<R, N>().expect("a tree");
    let bought: usize = std::env::var("PERIODS").map_or(PERIODS, |p| p.parse().unwrap());
    let periods = if unit == Unit::Exact { 1 } else { bought };
    let period_s = R::of(scenario.period_s() * periods as f64);
    let mut estimator = EstimatorConfig::new(period_s);
    if unit != Unit::Exact {
        estimator.gyro_rad_s = R::of(1e-3) / period_s.sqrt();
    }
    let mut of_ground = GroundOdometryConfig::new();
    if let Ok(value) = std::env::var("LEAN_S") {
        of_ground.lean_s = R::of(value.parse().unwrap());
    }
    let ground_odometry =
        GroundOdometry::new(of_ground, estimator, &layout, linkage).expect("valid");
    let odometry = Odometry::<R, N>::new(period_s).expect("valid");
    let (mut state, mut plain) = (Box::new(ground_odometry.start()), OdometryState::new());
    let mut simulation = Simulation::new(&scenario).expect("valid");
    let hinges = scenario.vehicle().hinge.len();
    let truth = |simulation: &Simulation| {
        let pose = &simulation.observation().pose;
        let [x, y, z] = pose.position_m;
        [x, y, z, pose.yaw_rad()]
    };
    let (mut squares, mut peak, mut edges, mut angles) = (Vec::new(), 0.0_f64, Vec::new(), Vec::new());
    let stands = (STANDS_S / period_s.as_f64()).round() as usize;
    let all = stands + (DRIVES_S / period_s.as_f64()).round() as usize;
    let mut error = [0.0; 4];
    let mut start = [0.0; 4];
    for k in 0..all {
        let standing = k < stands;
        if k <= stands {
            start = truth(&simulation);
            let [x, y, _, yaw] = start.map(R::of);
            let pose = PlanarPose {
                x_m: x,
                y_m: y,
                yaw_rad: yaw,
            };
            assert!(state.reset(&pose, &PoseCovariance::default(), R::of(0.0)));
            plain.reset(&pose);
        }
        let mut sums = (vec![0.0; N], [0.0; 3], [0.0; 3], vec![0.0; hinges]);
        for j in 0..periods {
            let time_s = (k as f64 + j as f64 / periods as f64) * period_s.as_f64() - STANDS_S;
            let part = (time_s / 0.3).clamp(0.0, 1.0);
            let command = BodyTwist {
                vx_m_s: part * vx_m_s,
                vy_m_s: part * vy_m_s,
                ..BodyTwist::ZERO
            };
            simulation.step(&command).expect("goes on");
            let sensed = simulation.sensed();
            let part = 1.0 / periods as f64;
            let add = |to: &mut [f64], from: &[f64]| {
                to.iter_mut().zip(from).for_each(|(to, from)| *to += part * from)
            };
            add(&mut sums.0, &sensed.wheels_rad_s);
            add(&mut sums.1, &sensed.imu.rate_rad_s);
            add(&mut sums.2, &sensed.imu.specific_force_m_s2);
            add(&mut sums.3, &sensed.hinges_rad_s);
        }
        let wheels: [R; N] = std::array::from_fn(|i| R::of(sums.0[i]));
        let sensed = simulation.sensed();
        let mut imu = omni_core::policy::Imu::<R>::silent();
        imu.rate_rad_s = sums.1.map(R::of);
        imu.specific_force_m_s2 = sums.2.map(R::of);
        if unit != Unit::NoAttitude {
            (imu.roll_rad, imu.pitch_rad) = (R::of(sensed.imu.roll_rad), R::of(sensed.imu.pitch_rad));
        }
        let mut noisy = |value: f64, deviation: f64| R::of(value + noise * deviation * normal(&mut rng));
        let angles_now: Vec<R> = (0..hinges)
            .map(|i| noisy(sensed.hinges_rad[i] + hinge, HINGE_RAD))
            .collect();
        let rates_now: Vec<R> = sums.3.iter().map(|rate| noisy(*rate, HINGE_RAD_S)).collect();
        let moving = if standing { 0.0 } else { 1.0 };
        let command = BodyTwist {
            vx_m_s: R::of(moving * vx_m_s),
            vy_m_s: R::of(moving * vy_m_s),
            ..BodyTwist::ZERO
        };
        let input = GroundInput::new(&wheels.into(), &imu, &command).with_hinges(&angles_now, &rates_now);
        let step = ground_odometry.step(&mut state, &input);
        if standing {
            continue;
        }
        odometry.step_velocities(&mut plain, &kinematics, &wheels.into());
        let true_pose = truth(&simulation);
        for edge in step
            .edges
            .iter()
            .flatten()
            .filter(|edge| edge.kind != EdgeKind::Met)
        {
            let EdgeEvent {
                height_m,
                height_deviation_m,
                angle,
                ..
            } = edge;
            let off = height_m.as_f64().abs() - ground.edge_m.unwrap_or(0.0);
            edges.push([off, off / height_deviation_m.as_f64()]);
            angles.extend(angle.map(|[angle, _]| angle.as_f64()));
        }
        let pose = state.pose();
        let [x, y, z] = pose.position_m.map(Real::as_f64);
        let off = [x - true_pose[0], y - true_pose[1], z - true_pose[2]];
        let yaw = (pose.yaw_rad.as_f64() - true_pose[3]).wrapped_angle();
        peak = peak.max(off[2].abs());
        if std::env::var("TRACE").is_ok() && k % (50 / periods) == 0 {
            let [px, ..] = simulation.observation().pose.axes();
            println!("t {:.2} x {:.3} off {:6.2} {:6.2} {:6.2} mm pitch {:6.2} off {:5.2} mrad slope {:.3} follows {} slip {:.1} v {:.1} ax {:.2} std z {:.2}",
                k as f64 * period_s.as_f64() - STANDS_S, true_pose[0], 1e3 * off[0], 1e3 * off[1], 1e3 * off[2],
                1e3 * px[2].asin(), 1e3 * (pose.pitch_rad.as_f64() - px[2].asin()), pose.slope[0].as_f64(), step.follows,
                1e3 * state.planar().slip().vx_m_s.as_f64(), 1e3 * state.planar().twist().vx_m_s.as_f64(), sums.2[0], 1e3 * state.height_variance_m2().as_f64().sqrt());
        }
        let ahead = (true_pose[1] - start[1]).atan2(true_pose[0] - start[0]);
        let (sin, cos) = ahead.sin_cos();
        error = [
            cos * off[0] + sin * off[1],
            cos * off[1] - sin * off[0],
            off[2],
            yaw,
        ];
        if (k - stands) % (100 / periods) == 0 && k > stands + 500 / periods {
            let variance = state.height_variance_m2().as_f64();
            let covariance = state
                .planar()
                .covariance()
                .matrix()
                .map(|row| row.map(Real::as_f64));
            squares.push([
                nees(covariance, [off[0], off[1], yaw]) / 3.0,
                off[2] * off[2] / variance,
            ]);
        }
    }
    let [x, y, ..] = truth(&simulation);
    let by_wheels = plain.pose();
    let count = squares.len() as f64;
    let off = [by_wheels.x_m.as_f64() - x, by_wheels.y_m.as_f64() - y];
    let (sin, cos) = (y - start[1]).atan2(x - start[0]).sin_cos();
    Drive {
        error,
        odometry_m: [cos * off[0] + sin * off[1], cos * off[1] - sin * off[0]],
        height_peak_m: peak,
        nees: [0, 1].map(|k| squares.iter().map(|each| each[k]).sum::<f64>() / count),
        edges_m: edges,
        angles_rad: angles,
        is_across: (x - start[0]).hypot(y - start[1]) > 2.2,
    }
}

/// Largest errors over seeds: forward, of the height and of an edge's height \[m\]; the number of edges; root mean
/// squares of the planar error and of that of odometry; mean error of the height.
struct Judged {
    forward_m: f64,
    height_m: f64,
    edge_m: f64,
    edges: usize,
    place_m: f64,
    odometry_m: f64,
    mean_height_m: f64,
}

#[expect(clippy::print_stdout, reason = "the figures, with --nocapture")]
fn judged<R: Real, const N: usize>(
    ground: &Ground,
    vehicle: &str,
    unit: Unit,
    speed_m_s: [f64; 2],
    seeds: std::ops::Range<u64>,
) -> Judged {
    let all: Vec<_> = seeds
        .map(|seed| drive::<R, N>(ground, vehicle, unit, speed_m_s, seed))
        .collect();
    let across: Vec<_> = all.iter().filter(|drive| drive.is_across).collect();
    let count = across.len().max(1) as f64;
    let mm = 1e3;
    let rms = |of: &dyn Fn(&Drive) -> f64| (across.iter().map(|c| of(c).powi(2)).sum::<f64>() / count).sqrt();
    let mean = |of: &dyn Fn(&Drive) -> f64| across.iter().map(|c| of(c)).sum::<f64>() / count;
    let most = |of: &dyn Fn(&Drive) -> f64| across.iter().map(|c| of(c).abs()).fold(0.0, f64::max);
    let edges: Vec<_> = across.iter().flat_map(|c| c.edges_m.clone()).collect();
    let of_edges =
        |k: usize| (edges.iter().map(|e| e[k] * e[k]).sum::<f64>() / edges.len().max(1) as f64).sqrt();
    let angles: Vec<_> = across.iter().flat_map(|c| c.angles_rad.clone()).collect();
    let angle = (angles.iter().map(|a| a * a).sum::<f64>() / angles.len().max(1) as f64).sqrt();
    let edge_m = edges.iter().map(|e| e[0].abs()).fold(0.0, f64::max);
    let nees = [0, 1].map(|k| mean(&|c| c.nees[k]));
    println!(
        "{vehicle:13} {:6} {unit:?} {:2}/{:2}; fwd {:4.1} {:4.1} left {:4.1} {:4.1} | plain fwd {:4.1} {:5.1} left {:4.1} {:4.1} | z {:5.2} {:5.2} \
         mean {:5.2} peak {:5.2} | yaw {:4.1} | NEES {:.2} {:.2} | edges {:3} off {:4.2} {:4.2} NEES {:.2} angle {:.1}",
        ground.name,
        across.len(),
        all.len(),
        mm * rms(&|c| c.error[0]),
        mm * most(&|c| c.error[0]),
        mm * rms(&|c| c.error[1]),
        mm * most(&|c| c.error[1]),
        mm * rms(&|c| c.odometry_m[0]),
        mm * most(&|c| c.odometry_m[0]),
        mm * rms(&|c| c.odometry_m[1]),
        mm * most(&|c| c.odometry_m[1]),
        mm * rms(&|c| c.error[2]),
        mm * most(&|c| c.error[2]),
        mm * mean(&|c| c.error[2]),
        mm * most(&|c| c.height_peak_m),
        mm * rms(&|c| c.error[3]),
        nees[0],
        nees[1],
        edges.len(),
        mm * of_edges(0),
        mm * edge_m,
        of_edges(1).powi(2),
        mm * angle,
    );
    Judged {
        forward_m: most(&|c| c.error[0]),
        height_m: most(&|c| c.error[2]),
        edge_m,
        edges: edges.len(),
        place_m: rms(&|c| c.error[0].hypot(c.error[1])),
        odometry_m: rms(&|c| c.odometry_m[0].hypot(c.odometry_m[1])),
        mean_height_m: mean(&|c| c.error[2]),
    }
}

pub fn table() {
    let of = |name: &str, fallback: &str| std::env::var(name).unwrap_or(fallback.to_string());
    let seeds = of("SEEDS", "0:6");
    let (from, to) = seeds.split_once(':').expect("a:b");
    let seeds = from.parse().unwrap()..to.parse().unwrap();
    let unit = match of("UNIT", "bought").as_str() {
        "exact" => Unit::Exact,
        "bought" => Unit::AsBought,
        _ => Unit::NoAttitude,
    };
    let way = of("WAY", "0.3:0");
    let (x, y) = way.split_once(':').expect("a:b");
    let speed = [x.parse().unwrap(), y.parse().unwrap()];
    let (grounds, vehicles) = (of("GROUNDS", ""), of("VEHICLES", "chugo7 mecanum4 rocker_bogie6 omni3"));
    for each in GROUNDS.iter().filter(|each| grounds.is_empty() || grounds.contains(each.name)) {
        for vehicle in vehicles.split(' ') {
            let seeds: std::ops::Range<u64> = Clone::clone(&seeds);
            match vehicle {
                "chugo7" => judged::<f64, 7>(each, vehicle, unit, speed, seeds),
                "mecanum4" => judged::<f64, 4>(each, vehicle, unit, speed, seeds),
                "rocker_bogie6" => judged::<f64, 6>(each, vehicle, unit, speed, seeds),
                _ => judged::<f64, 3>(each, vehicle, unit, speed, seeds),
            };
        }
    }
}

#[test]
fn a_state_is_bit_identical_after_serialisation_also_before_its_first_step() {
    let layout = omni_core::WheelLayout::<f64, 4>::mecanum4(0.5, 0.4, 0.076).expect("valid");
    let wheels = layout.wheels().map(|wheel| omni_core::linkage::CarriedWheel {
        body: 0,
        centre_m: [wheel.position_m[0], wheel.position_m[1], wheel.radius_m],
    });
    let linkage = omni_core::linkage::Linkage::new(&[], &wheels).expect("a tree");
    let odometry = GroundOdometry::new(
        GroundOdometryConfig::new(),
        EstimatorConfig::new(0.005),
        &layout,
        linkage,
    )
    .expect("valid");
    let command = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    let input = GroundInput::new(&[4.0; 4].into(), &omni_core::policy::Imu::level(), &command);
    // Before the first step the heights of the contacts are NaN, which is not equal to itself: compared as bytes.
    let mut state = Box::new(odometry.start());
    assert!(state.pose().contact_m[0].is_nan());
    for _ in 0..3 {
        let bytes = postcard::to_allocvec(&*state).expect("numbers");
        let mut read: Box<omni_core::estimate::GroundOdometryState<f64, 4>> =
            postcard::from_bytes(&bytes).expect("the state");
        assert_eq!(postcard::to_allocvec(&*read).expect("numbers"), bytes);
        for _ in 0..100 {
            let (one, other) = (
                odometry.step(&mut state, &input),
                odometry.step(&mut read, &input),
            );
            assert_eq!(one, other);
        }
        let again = [&state, &read].map(|each| postcard::to_allocvec(&**each).expect("numbers"));
        assert_eq!(again[0], again[1]);
    }
}
