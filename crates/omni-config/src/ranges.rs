//! Range checks for garde, which says where a value is; these say what it was and what is allowed.
//!
//! A field says its bounds once: `#[garde(adapt(ranges), range(min = X.min, max = X.max))]`, `inner(range(...))` where
//! it is a list of numbers, `length(...)` for how many there are. schemars takes the schema's bounds from there. garde
//! checks these rules by the modules of their names in this file, because its own `range` lets NaN through.

use garde::Error;

fn refuse(value: impl std::fmt::Display, allowed: &str) -> garde::Result {
    Err(Error::new(format!("{value}, allowed: {allowed}")))
}

/// Bounds of a number, both included, shared by the checks and the JSON Schemas.
#[derive(Clone, Copy)]
pub(crate) struct Range {
    pub(crate) min: f64,
    pub(crate) max: f64,
}

const fn range(min: f64, max: f64) -> Range {
    Range { min, max }
}

// From a toy to a heavy truck; each range has room beyond what is built, and ends before what is a slip of the keyboard
// (grams for kilograms, millimetres for metres) would let the simulation fail.
pub(crate) const MASS_KG: Range = range(1e-3, 1e4);
pub(crate) const RADIUS_M: Range = range(1e-3, 10.0);
/// From 1 g at 1 mm to 10 t at 10 m.
pub(crate) const INERTIA_KG_M2: Range = range(1e-10, 1e6);
/// Edges of boxes.
pub(crate) const EDGE_M: Range = range(1e-3, 100.0);
/// Of a wheel's contact: from a tyre of a toy to a train's.
pub(crate) const CONTACT_N_M: Range = range(100.0, 1e10);
/// By which a wheel is pressed on the ground more than others.
pub(crate) const PRELOAD_N: Range = range(-1e5, 1e5);
/// Places in the vehicle's frame, and where it starts in the world's.
pub(crate) const PLACE_M: Range = range(-100.0, 100.0);
/// Components of directions, whose length does not matter.
pub(crate) const DIRECTION: Range = range(-1e3, 1e3);
/// As omni-core has it.
pub(crate) const GEAR: Range = range(1e-6, 1e3);
/// As omni-core has it.
pub(crate) const GAIN: Range = range(0.0, 1e6);
pub(crate) const STALL_TORQUE_N_M: Range = range(1e-6, 1e6);
/// Speeds of motors without load: from a telescope's drive to a dental drill.
pub(crate) const NO_LOAD_RPM: Range = range(1e-3, 1e6);
pub(crate) const NO_LOAD_RAD_S: Range = range(1e-4, 1e5);
/// Dry friction of a gear at the wheel.
pub(crate) const GEAR_FRICTION_N_M: Range = range(0.0, 1e6);
/// As omni-core has it.
pub(crate) const EFFICIENCY: Range = range(0.01, 1.0);
/// Friction of a bearing or a motor, torque that a motor loses per speed.
pub(crate) const DAMPING_N_M_S_RAD: Range = range(0.0, 1e6);
pub(crate) const STIFFNESS_N_M_RAD: Range = range(1e-3, 1e9);
pub(crate) const RATIO: Range = range(-1e3, 1e3);
/// Stops of a hinge: short of a whole turn to either side, where the angle would jump.
pub(crate) const STOP_RAD: Range = range(0.0, 3.0);
/// Once around either way.
pub(crate) const HEADING_DEG: Range = range(-360.0, 360.0);
/// Past 1.5 a wheel pushes hardly anything.
pub(crate) const ROLLER_ANGLE_RAD: Range = range(-1.5, 1.5);
/// Limits of speeds.
pub(crate) const SPEED_M_S: Range = range(1e-3, 100.0);
pub(crate) const SPEED_RAD_S: Range = range(1e-3, 1e3);
pub(crate) const ACCELERATION_M_S2: Range = range(1e-3, 1e4);
pub(crate) const ACCELERATION_RAD_S2: Range = range(1e-3, 1e5);
pub(crate) const VELOCITY_M_S: Range = range(-100.0, 100.0);
pub(crate) const VELOCITY_RAD_S: Range = range(-1e3, 1e3);
/// What a run may last.
pub(crate) const DURATION_S: Range = range(0.01, 3600.0);
/// A time within a run.
pub(crate) const TIME_S: Range = range(0.0, 3600.0);
pub(crate) const FRICTION: Range = range(0.0, 2.0);
pub(crate) const STEP_HEIGHT_M: Range = range(1e-4, 10.0);
pub(crate) const BLOCK_HEIGHT_M: Range = range(1e-4, 1.0);
/// Well inside the 200 m of ground ahead.
pub(crate) const RISER_M: Range = range(1e-3, 190.0);
/// How fast integrals fall at rest, as omni-core has it.
pub(crate) const BLEED_S: Range = range(0.0, 10.0);
/// Of a whole.
pub(crate) const PART: Range = range(0.0, 1.0);
pub(crate) const MAX_RETRIES: Range = range(0.0, 100.0);
/// The least that omni-core takes, and the highest step.
pub(crate) const CLIMBS_M: Range = range(1e-3, 10.0);
/// Largest integral and proportional terms.
pub(crate) const WINDUP_N_M: Range = range(0.0, 1e6);
/// Integral zones.
pub(crate) const ZONE_RAD_S: Range = range(0.0, 1e6);
/// Of back-calculation, as omni-core has it.
pub(crate) const TRACKING_S: Range = range(1e-6, 1e6);
/// Thresholds of detectors, limits of speeds, as omni-core has them.
pub(crate) const THRESHOLD_RAD_S: Range = range(1e-9, 1e6);
/// Counts of control periods, as omni-core has them.
pub(crate) const PERIODS: Range = range(1.0, 65_535.0);
pub(crate) const PERIODS_FROM_0: Range = range(0.0, 65_534.0);
pub(crate) const PERIODS_FROM_2: Range = range(2.0, 65_535.0);
/// Of a wheel's angle per root of the angle.
pub(crate) const WHEEL_NOISE: Range = range(0.0, 100.0);
pub(crate) const RESIDUAL_GAIN: Range = range(0.0, 1e6);
/// Of holding at rest, as omni-core has it.
pub(crate) const HOLD_TORQUE_SQUARED_N2M2S: Range = range(0.0, 1e9);
/// Places in the world.
pub(crate) const WORLD_M: Range = range(-1e4, 1e4);
/// Whole numbers of 32 bits.
pub(crate) const SEED: Range = range(0.0, 4_294_967_295.0);
/// Whole numbers that TOML can hold.
pub(crate) const SEED_64: Range = range(0.0, i64::MAX as f64);
/// Values of an axis of a study.
pub(crate) const AXIS_COUNT: Range = range(2.0, 10_000.0);
/// Treads of stairs.
pub(crate) const TREAD_M: Range = range(0.01, 10.0);
pub(crate) const SLOPE_RAD: Range = range(1e-3, 1.2);
/// Extents of obstacles along the way.
pub(crate) const LENGTH_M: Range = range(0.01, 100.0);
pub(crate) const WIDTH_M: Range = range(1e-3, 10.0);
pub(crate) const BUMP_M: Range = range(1e-4, 1.0);
pub(crate) const RMS_M: Range = range(0.0, 1.0);
pub(crate) const WAVELENGTH_M: Range = range(0.02, 10.0);
/// Extents of a random surface: at most a million cells.
pub(crate) const FIELD_M: Range = range(0.1, 50.0);
pub(crate) const PIXEL_M: Range = range(1e-4, 10.0);
pub(crate) const LEVEL_M: Range = range(-10.0, 10.0);
/// Steps of stairs, bumps.
pub(crate) const COUNT: Range = range(1.0, 100.0);
/// Half a turn either way.
pub(crate) const TURN_RAD: Range = range(-3.2, 3.2);
pub(crate) const ENCODER_COUNTS: Range = range(1.0, 1e7);
/// As omni-core has them.
pub(crate) const WINDOW_PERIODS: Range = range(1.0, 32.0);
pub(crate) const BANDWIDTH_RAD_S: Range = range(1e-4, 1e6);
pub(crate) const ENCODER_NOISE_RAD_S: Range = range(0.0, 100.0);
pub(crate) const GYRO_NOISE_RAD_S: Range = range(0.0, 10.0);
pub(crate) const BIAS_RAD_S: Range = range(-1.0, 1.0);
pub(crate) const ACCELEROMETER_NOISE_M_S2: Range = range(0.0, 100.0);
pub(crate) const ACCELEROMETER_BIAS_M_S2: Range = range(-10.0, 10.0);
pub(crate) const ATTITUDE_BIAS_RAD: Range = range(-0.5, 0.5);
pub(crate) const ATTITUDE_WALK_RAD_PER_SQRT_S: Range = range(0.0, 0.1);
pub(crate) const DELAY_S: Range = range(0.0, 0.1);
pub(crate) const LAG_S: Range = range(0.0, 1.0);
pub(crate) const SAG: Range = range(0.0, 0.9);
/// Gain of the heading loop.
pub(crate) const HOLD_PER_S: Range = range(1e-3, 100.0);
pub(crate) const TIME_LIMIT_S: Range = range(0.01, 1e6);
/// A path may turn by nearly a whole circle on one arc.
pub(crate) const SWEEP_RAD: Range = range(-6.2, 6.2);
pub(crate) const PATH_TIME_S: Range = range(1e-3, 3600.0);
pub(crate) const JERK_M_S3: Range = range(1e-3, 1e5);
pub(crate) const JERK_RAD_S3: Range = range(1e-3, 1e6);
/// Of what wheels can do, how much a plan may take.
pub(crate) const SHARE: Range = range(0.05, 1.0);
pub(crate) const FOLLOW_PER_S: Range = range(0.0, 1e3);
pub(crate) const REST_BEFORE_S: Range = range(0.0, 60.0);
pub(crate) const DISTANCE_ERROR_M: Range = range(1e-3, 100.0);
pub(crate) const HEADING_ERROR_RAD: Range = range(1e-3, 100.0);
pub(crate) const HEADING_RAD: Range = range(0.0, 3.2);
pub(crate) const OFFSET_M: Range = range(0.0, 100.0);
/// Messages a second.
pub(crate) const LOG_HZ: Range = range(0.0, 1e6);
/// Of the controller, and steps of an engine.
pub(crate) const PERIOD_S: Range = range(1e-6, 0.1);
pub(crate) const ITERATIONS: Range = range(1.0, 100.0);
/// Parts of a physics step.
pub(crate) const SUBSTEPS: Range = range(1.0, 16.0);
pub(crate) const ROLLER_COUNT: Range = range(3.0, 32.0);
pub(crate) const ROLLER_ROWS: Range = range(1.0, 2.0);
/// Bearings of rollers.
pub(crate) const BEARING_N_M_S_RAD: Range = range(0.0, 1.0);
/// From a needle on: what straight ones make is a polygon.
pub(crate) const ROLLER_RADIUS_M: Range = range(1e-5, 5.0);
/// Difference of a roller's radius at its ends.
pub(crate) const CROWN_M: Range = range(0.0, 10.0);
/// From a bead to a barrel.
pub(crate) const ROLLER_MASS_KG: Range = range(1e-6, 1e3);
pub(crate) const CONTACT_FREQUENCY_HZ: Range = range(1.0, 1e5);
pub(crate) const CONTACT_DAMPING_RATIO: Range = range(1e-3, 1e3);
/// From free fall to far more than on any planet.
pub(crate) const GRAVITY_M_S2: Range = range(0.0, 100.0);
/// A reference of a motor bench experiment.
pub(crate) const SPEED_RPM: Range = range(1e-3, 1e5);

/// A number or numbers, every one of them within bounds.
pub(crate) trait Bounded {
    /// Some number outside the bounds, or not a number.
    fn outside(&self, range: Range) -> bool;
    /// As messages show it.
    fn shown(&self) -> String;
}

impl Bounded for f64 {
    fn outside(&self, range: Range) -> bool {
        !(range.min..=range.max).contains(self)
    }
    fn shown(&self) -> String {
        // As one writes it: 1e300, not a one with three hundred zeros.
        if *self != 0.0 && !(1e-6..1e9).contains(&self.abs()) && self.is_finite() {
            format!("{self:e}")
        } else {
            self.to_string()
        }
    }
}

impl Bounded for u16 {
    fn outside(&self, range: Range) -> bool {
        f64::from(*self).outside(range)
    }
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl Bounded for u32 {
    fn outside(&self, range: Range) -> bool {
        f64::from(*self).outside(range)
    }
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl Bounded for u64 {
    fn outside(&self, range: Range) -> bool {
        (*self as f64).outside(range)
    }
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl Bounded for usize {
    fn outside(&self, range: Range) -> bool {
        (*self as f64).outside(range)
    }
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl<const N: usize> Bounded for [f64; N] {
    fn outside(&self, range: Range) -> bool {
        self.iter().any(|v| v.outside(range))
    }
    fn shown(&self) -> String {
        format!("[{}]", self.map(|v| v.shown()).join(", "))
    }
}

/// A number that may be left out.
impl<T: Bounded> Bounded for Option<T> {
    fn outside(&self, range: Range) -> bool {
        self.as_ref().is_some_and(|value| value.outside(range))
    }
    fn shown(&self) -> String {
        self.as_ref().map_or_else(String::new, T::shown)
    }
}

/// Within a range, both ends included.
pub(crate) fn within<T: Bounded>(range: Range) -> impl FnOnce(&T, &()) -> garde::Result {
    move |value, _| {
        if value.outside(range) {
            refuse(
                value.shown(),
                &format!("{} to {}", range.min.shown(), range.max.shown()),
            )
        } else {
            Ok(())
        }
    }
}

/// The rule `range` of garde, as `adapt(ranges)` has it.
pub(crate) mod range {
    /// Within a range, both ends included.
    pub(crate) fn apply<T: super::Bounded>(
        value: &T,
        (min, max): (Option<f64>, Option<f64>),
    ) -> garde::Result {
        let min = min.unwrap_or(f64::NEG_INFINITY);
        let max = max.unwrap_or(f64::INFINITY);
        super::within(super::Range { min, max })(value, &())
    }
}

/// The rule `inner` of garde, as `adapt(ranges)` has it.
pub(crate) mod inner {
    use garde::error::NoKey;

    /// A list as one value: a message names its key without an index, and shows all of it.
    pub(crate) fn apply<T>(list: &T, mut check: impl FnMut(&T, &NoKey)) {
        check(list, &NoKey::default());
    }
}

/// The rule `length` of garde, as `adapt(ranges)` has it.
pub(crate) mod length {
    pub(crate) mod simple {
        /// A list of so many elements.
        pub(crate) fn apply<T>(list: &[T], (min, max): (usize, usize)) -> garde::Result {
            if (min..=max).contains(&list.len()) {
                Ok(())
            } else {
                let found = format!("{} entries", list.len());
                crate::ranges::refuse(found, &format!("{min} to {max}"))
            }
        }
    }
}

/// A direction: components within [`DIRECTION`], and long enough to point somewhere.
pub(crate) fn direction<const N: usize>(values: &[f64; N], context: &()) -> garde::Result {
    within(DIRECTION)(values, context)?;
    if values.iter().any(|v| v.abs() >= 1e-3) {
        Ok(())
    } else {
        refuse(
            values.shown(),
            "a direction with a component of at least 0.001 or at most -0.001",
        )
    }
}

/// Pattern of [`is_name`], as a regular expression.
#[cfg(feature = "schema")]
pub(crate) const NAME: &str = "^[A-Za-z0-9_-]{1,40}$";

/// Is it a device of Windows, which has no file of that name, whatever its extension?
fn is_device(value: &str) -> bool {
    let lower = value.to_ascii_lowercase();
    let number = lower.strip_prefix("com").or_else(|| lower.strip_prefix("lpt"));
    ["con", "prn", "aux", "nul"].contains(&&*lower)
        || number.is_some_and(|number| matches!(number.as_bytes(), [b'0'..=b'9']))
}

/// Counts of a turn, or 0 for none.
pub(crate) fn is_encoder_counts(counts: &f64, _: &()) -> garde::Result {
    let range = ENCODER_COUNTS;
    if *counts == 0.0 || !counts.outside(range) {
        return Ok(());
    }
    refuse(
        counts.shown(),
        &format!("0, or {} to {}", range.min.shown(), range.max.shown()),
    )
}

/// A name that can stand in a column and a file name: letters, digits, `_` and `-`, 1 to 40 of
/// them, and no device of Windows.
pub(crate) fn is_name(value: &str, _: &()) -> garde::Result {
    if is_device(value) {
        return refuse(format!("{value:?}"), "another name: on Windows this is a device");
    }
    let fits = (1..=40).contains(&value.len());
    if fits
        && value
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    {
        Ok(())
    } else {
        refuse(format!("{value:?}"), "1 to 40 letters, digits, '_' or '-'")
    }
}

/// Default of a ratio that a file leaves out.
pub(crate) fn one() -> f64 {
    1.0
}
