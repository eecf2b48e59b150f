//! `Drive::step` of 3, 4 and 7 wheels, f32 and f64: any accepted configuration, any bits as readings and commands.

use arbitrary::Unstructured;
use omni_core::drive::DriveSample;
use omni_core::geometry::PathFactors;
use omni_core::motor::{TorqueRange, TorqueRanges};
use omni_core::{BodyTwist, Drive, DriveInput, DriveMode, DriveState, Real, TorqueLimit, WheelVelocities};

use super::config;
use super::numbers::{bits, byte, one_in, signed, within};

/// Steps as far as the bytes reach; returns how many.
pub(super) fn run(data: &[u8]) -> usize {
    let mut u = Unstructured::new(data);
    match byte(&mut u) % 6 {
        0 => drive::<f32, 3>(&mut u),
        1 => drive::<f32, 4>(&mut u),
        2 => drive::<f32, 7>(&mut u),
        3 => drive::<f64, 3>(&mut u),
        4 => drive::<f64, 4>(&mut u),
        _ => drive::<f64, 7>(&mut u),
    }
}

fn drive<R: Real, const N: usize>(u: &mut Unstructured<'_>) -> usize {
    let Some((config, limits)) = config::drive::<R, N>(u) else {
        return 0;
    };
    let at_once = config.shaping.emergency_deceleration.is_none();
    let rest_s = (config.rest.bleed_s + config.rest.hold_s).as_f64();
    // Each of the two times is rounded up to periods.
    let allowed = (rest_s / config.control.pid.period_s.as_f64()) as usize + 3;
    let Ok(drive) = Drive::new(config) else { return 0 };
    let mut state = DriveState::new(&drive);
    let mut watch = Watch {
        stopped: None,
        at_once,
    };
    let (mut resting, mut stopped, mut emergency) = (0, false, false);
    let mut steps = 0;
    while !u.is_empty() {
        match byte(u) {
            0..3 => {
                emergency = true;
                watch.stop(DriveMode::EmergencyStop);
            }
            3..6 => {
                emergency = false;
                state.release_safe_stop();
                watch.stopped = None;
            }
            _ => {}
        }
        let mut input = input::<R, N>(u);
        input.emergency = emergency;
        let sample = drive.step(&mut state, &input);
        steps += 1;
        torques(&sample, &limits, &input.torque_ranges);
        numbers(&sample);
        let pose = [sample.pose.x_m, sample.pose.y_m, sample.pose.yaw_rad];
        finite("pose", pose);
        finite("integral", state.control.integral_n_m);
        not_nan(
            "covariance",
            state.covariance.matrix().as_flattened().iter().copied(),
        );
        watch.holds(&sample);
        // Whatever the wheels measure and remember, no torque is left once the command is rest.
        let rests = sample
            .desaturated
            .velocities
            .rad_s
            .iter()
            .all(|&r| r == R::zero());
        // A stop uses up nothing of the time to hold, so that begins with its release.
        let stops = matches!(sample.mode, DriveMode::SafeStop | DriveMode::EmergencyStop);
        resting = if rests && (stops || !stopped) {
            resting + 1
        } else {
            usize::from(rests)
        };
        stopped = stops;
        let torques = sample.wheels.applied.n_m;
        assert!(
            resting < allowed || torques == [R::zero(); N],
            "{resting} periods at rest, allowed {allowed}: {torques:?} N.m"
        );
    }
    steps
}

/// Does a stop hold, once there is one?
struct Watch<R> {
    /// The mode, and the size of each component of the twist in the last step.
    stopped: Option<(DriveMode, Option<[R; 3]>)>,
    /// Without a deceleration a stop is one at once.
    at_once: bool,
}

impl<R: Real> Watch<R> {
    fn stop(&mut self, mode: DriveMode) {
        let speeds = self.stopped.and_then(|(_, speeds)| speeds);
        self.stopped = Some((mode, speeds));
    }

    fn holds<const N: usize>(&mut self, sample: &DriveSample<R, N>) {
        let now = sample.shaped.twist.to_array().map(|v| v.abs());
        if let Some((mode, before)) = self.stopped {
            assert!(
                sample.mode == mode || sample.mode == DriveMode::EmergencyStop,
                "a stop does not hold: {:?} after {mode:?}",
                sample.mode
            );
            if self.at_once {
                assert!(now == [R::zero(); 3], "stopped at once, but commands {now:?}");
            }
            for (now, before) in now.iter().zip(before.iter().flatten()) {
                assert!(now <= before, "a stop grows faster: {now:?} after {before:?}");
            }
        }
        self.stopped = match sample.mode {
            mode @ (DriveMode::SafeStop | DriveMode::EmergencyStop) => Some((mode, Some(now))),
            _ => None,
        };
    }
}

/// Applied torques are within the motors' limits and those of the input; a released wheel has none.
fn torques<R: Real, const N: usize>(
    sample: &DriveSample<R, N>,
    limits: &[TorqueLimit<R>; N],
    within: &TorqueRanges<R, N>,
) {
    let wheels = &sample.wheels;
    for (i, limit) in limits.iter().enumerate() {
        let (applied, motor) = (wheels.applied.n_m[i], limit.range(wheels.measured.rad_s[i]));
        let inside = |range: &TorqueRange<R>| applied >= range.lower_n_m && applied <= range.upper_n_m;
        assert!(
            inside(&motor),
            "wheel {i}: {applied:?} N.m, its motor has {motor:?}"
        );
        let asked = within.wheel(i);
        // A range that holds no rest is none: see TorqueRanges.
        if asked.lower_n_m <= R::zero() && asked.upper_n_m >= R::zero() {
            assert!(inside(&asked), "wheel {i}: {applied:?} N.m, allowed is {asked:?}");
        }
        assert!(
            wheels.active[i] || applied == R::zero(),
            "wheel {i}: released with {applied:?} N.m"
        );
    }
}

/// Every number of a step is finite, but for limits that are none.
fn numbers<R: Real, const N: usize>(sample: &DriveSample<R, N>) {
    let wheels = &sample.wheels;
    finite("shaped", sample.shaped.twist.to_array());
    finite("desaturated twist", sample.desaturated.twist.to_array());
    finite("desaturated velocities", sample.desaturated.velocities.rad_s);
    let factors = [
        sample.desaturated.translation_factor,
        sample.desaturated.yaw_factor,
        wheels.common_factor,
    ];
    finite("factors", factors);
    finite("reference", wheels.reference.rad_s);
    finite("measured", wheels.measured.rad_s);
    finite("p", wheels.p_n_m);
    finite("i", wheels.i_n_m);
    finite("d", wheels.d_n_m);
    finite("ff", wheels.ff_n_m);
    finite("requested", wheels.requested.n_m);
    finite("applied", wheels.applied.n_m);
    not_nan(
        "range",
        wheels
            .range
            .lower_n_m
            .iter()
            .chain(&wheels.range.upper_n_m)
            .copied(),
    );
    finite("estimated", sample.slip.estimated.to_array());
    finite("residual", sample.slip.residual.rad_s);
    finite("slip", sample.slip.slip_rad_s);
}

fn finite<R: Real, const M: usize>(name: &str, values: [R; M]) {
    assert!(
        values.iter().all(|v| v.is_finite_real()),
        "{name} is not finite: {values:?}"
    );
}

fn not_nan<R: Real>(name: &str, values: impl IntoIterator<Item = R>) {
    assert!(!values.into_iter().any(|v| v.as_f64().is_nan()), "{name} is NaN");
}

/// One period: mostly readings as they come, now and then any bits.
fn input<R: Real, const N: usize>(u: &mut Unstructured<'_>) -> DriveInput<R, N> {
    let hostile = one_in(u, 3);
    let number = |u: &mut Unstructured<'_>| {
        if hostile {
            bits::<R>(u)
        } else {
            signed(u, 1e-3, 300.0)
        }
    };
    let readings_rad_s = std::array::from_fn(|_| if one_in(u, 20) { None } else { Some(number(u)) });
    let command = one_in(u, 4).then(|| BodyTwist::from_array(std::array::from_fn(|_| number(u))));
    let mut torque_ranges = TorqueRanges::unlimited();
    if one_in(u, 5) {
        let (a, b) = (number(u), number(u));
        let range = if one_in(u, 4) {
            TorqueRange {
                lower_n_m: a,
                upper_n_m: b,
            }
        } else {
            TorqueRange {
                lower_n_m: -a.abs(),
                upper_n_m: b.abs(),
            }
        };
        torque_ranges.set(usize::from(byte(u)) % N, &range);
    }
    let path = if one_in(u, 5) {
        PathFactors::new(std::array::from_fn(|_| within::<R>(u, 0.01, 100.0))).unwrap_or_default()
    } else {
        PathFactors::default()
    };
    let lifted = if one_in(u, 5) {
        std::array::from_fn(|_| one_in(u, 3))
    } else {
        [false; N]
    };
    let mut input = DriveInput::measured(&WheelVelocities::zero());
    input.command = command;
    input.readings_rad_s = readings_rad_s;
    input.lifted = lifted;
    input.path = path;
    input.torque_ranges = torque_ranges;
    input
}
