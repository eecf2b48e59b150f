//! The signals of a wheel, one row each: columns, messages, comparisons and Python's attributes follow from it.
//!
//! After a change `scripts/docs/wheel_signals.py` writes the message's definition and the stub anew.

use omni_core::loops::WheelSample;
use omni_core::metrics::{DISTURBED_FLOOR_RAD_S, disturbed_ratio};
use omni_core::{Real, WheelVelocities};
use serde::{Deserialize, Serialize};

use crate::observation::WheelObservation;

/// The table. `control` are the fields of [`WheelSignals`], which a controller fills; `of_control`
/// is what follows from these, and `observed` what follows from the [`WheelObservation`]. `log` are
/// in the log's `/vehicle_state`, `trace` in a trace alone.
#[doc(hidden)]
#[macro_export]
macro_rules! for_each_wheel_signal {
    ($then:ident) => {
        $then! {
            // Taken from what a controller of omni-core did.
            control {
                /// Reference as commanded [rad/s].
                reference_rad_s: log = wheels.reference.rad_s;
                /// Measured velocity [rad/s], at the start of the period.
                measured_rad_s: log = wheels.measured.rad_s;
                /// Proportional term [N.m].
                p_n_m: log = wheels.p_n_m;
                /// Integral term [N.m].
                i_n_m: log = wheels.i_n_m;
                /// Derivative term [N.m].
                d_n_m: log = wheels.d_n_m;
                /// Torque requested with the whole reference [N.m].
                requested_n_m: log = wheels.requested.n_m;
                /// Torque applied [N.m], within the limits.
                applied_n_m: log = wheels.applied.n_m;
                /// Lowest torque allowed [N.m], <= 0.
                limit_lower_n_m: log = wheels.range.lower_n_m;
                /// Highest torque allowed [N.m], >= 0.
                limit_upper_n_m: log = wheels.range.upper_n_m;
                /// Part of the measured velocity that no motion of the vehicle explains [rad/s].
                residual_rad_s: trace = residual.rad_s;
            }
            // `saturated` stays first: Python shows it as yes or no.
            of_control {
                /// 1 if the request was outside the limits, else 0.
                saturated: log = WheelSignals::saturated;
                /// Safe form of eq. (14) of the paper, within -2 to 2; lagging is +.
                disturbed_ratio: log = WheelSignals::disturbed_ratio;
            }
            // The push is the rolling direction, or of a mecanum wheel the axis of its lowest roller.
            observed {
                /// Safe form of eq. (15) of the paper, within -2 to 2; spinning is +; 0 in the air.
                slip_ratio: log = WheelObservation::slip_ratio;
                /// Speed along the push [m/s], from the wheel's rotation against the world.
                rim_m_s: trace = |wheel| wheel.rim_m_s;
                /// Velocity of the wheel's centre along the push in the contact's tangent plane [m/s].
                along_m_s: trace = |wheel| wheel.along_m_s;
                /// Ground force along the contact normals [N], averaged over the period.
                force_normal_n: log = |wheel| wheel.force_normal_n;
                /// Ground force along the push [N], averaged over the period.
                force_along_n: log = |wheel| wheel.force_along_n;
                /// Direction of the normal force in the world, x; zero in the air.
                normal_x: trace = |wheel| wheel.normal[0];
                /// Direction of the normal force in the world, y.
                normal_y: trace = |wheel| wheel.normal[1];
                /// Direction of the normal force in the world, z.
                normal_z: trace = |wheel| wheel.normal[2];
                /// Centre of the axle in the world [m], x.
                x_m: trace = |wheel| wheel.centre_m[0];
                /// Centre of the axle in the world [m], y.
                y_m: trace = |wheel| wheel.centre_m[1];
                /// Centre of the axle in the world [m], z.
                z_m: trace = |wheel| wheel.centre_m[2];
                /// Torque that acted on the actuator [N.m], averaged over the period.
                torque_n_m: log = |wheel| wheel.torque_n_m;
                /// Point of contact in the world [m], x, the mean weighted by the normal force; zero in the air.
                contact_x_m: trace = |wheel| wheel.contact_m[0];
                /// Point of contact in the world [m], y.
                contact_y_m: trace = |wheel| wheel.contact_m[1];
                /// Point of contact in the world [m], z.
                contact_z_m: trace = |wheel| wheel.contact_m[2];
            }
        }
    };
}

/// What a controller of omni-core did with the wheels.
pub(crate) struct Did<'a, R, const N: usize> {
    pub(crate) wheels: &'a WheelSample<R, N>,
    /// Parts of the measured velocities that no motion of the vehicle explains.
    pub(crate) residual: &'a WheelVelocities<R, N>,
}

/// Source of a signal.
enum Value {
    Control(fn(&WheelSignals) -> f64),
    Observed(fn(&WheelObservation) -> f64),
}

/// A row of the table.
///
/// ```
/// use omni_sim::WheelSignal;
/// let slip = WheelSignal::all().find(|signal| signal.name == "slip_ratio");
/// assert!(slip.is_some_and(|slip| slip.logged && slip.doc.contains("eq. (15)")));
/// ```
#[non_exhaustive]
pub struct WheelSignal {
    /// Its name: of the column `wheel_NAME_SIGNAL`, of the message's field, of the attribute in Python.
    pub name: &'static str,
    /// Its meaning, with its unit.
    pub doc: &'static str,
    /// It is in the log's `/vehicle_state`.
    pub logged: bool,
    value: Value,
}

/// Number of signals per wheel in the log.
pub const LOGGED_SIGNALS: usize = {
    let (mut i, mut logged) = (0, 0);
    while i < SIGNALS.len() {
        logged += SIGNALS[i].logged as usize;
        i += 1;
    }
    logged
};

const LOGGED: [&WheelSignal; LOGGED_SIGNALS] = {
    let mut found = [&SIGNALS[0]; LOGGED_SIGNALS];
    let (mut i, mut logged) = (0, 0);
    while i < SIGNALS.len() {
        if SIGNALS[i].logged {
            found[logged] = &SIGNALS[i];
            logged += 1;
        }
        i += 1;
    }
    found
};

impl WheelSignal {
    /// Every signal, in the order of the columns.
    pub fn all() -> impl ExactSizeIterator<Item = &'static Self> + Clone {
        SIGNALS.iter()
    }

    /// Those in the log's `/vehicle_state`, in the order of its message.
    #[must_use]
    pub fn logged() -> [&'static Self; LOGGED_SIGNALS] {
        LOGGED
    }

    /// Its value, where it follows from what the controller was given and did; none if it follows from the physics.
    #[must_use]
    pub fn of_control(&self, signals: &WheelSignals) -> Option<f64> {
        match self.value {
            Value::Control(value) => Some(value(signals)),
            Value::Observed(_) => None,
        }
    }

    /// Its value for a wheel.
    #[must_use]
    pub fn value(&self, signals: &WheelSignals, wheel: &WheelObservation) -> f64 {
        match self.value {
            Value::Control(value) => value(signals),
            Value::Observed(value) => value(wheel),
        }
    }
}

macro_rules! define {
    (@logged log) => { true };
    (@logged trace) => { false };
    (
        control { $($(#[doc = $doc:literal])+ $name:ident: $place:ident = $($source:ident).+;)* }
        of_control { $($(#[doc = $c_doc:literal])+ $c_name:ident: $c_place:ident = $c_value:expr;)* }
        observed { $($(#[doc = $o_doc:literal])+ $o_name:ident: $o_place:ident = $o_value:expr;)* }
    ) => {
        /// Signals of one wheel in one control step; velocities and torques are the actuator's. NaN is unknown.
        #[expect(rustdoc::broken_intra_doc_links, reason = "units in brackets, as Python shows them")]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct WheelSignals {
            $($(#[doc = $doc])+ pub $name: f64,)*
        }

        impl WheelSignals {
            /// Nothing is known.
            pub const UNKNOWN: Self = Self { $($name: f64::NAN,)* };

            /// Those of a wheel by what a controller did.
            pub(crate) fn of<R: Real, const N: usize>(did: &Did<'_, R, N>, wheel: usize) -> Self {
                Self { $($name: did.$($source).+[wheel].as_f64(),)* }
            }
        }

        const SIGNALS: &[WheelSignal] = &[
            $(define!(@row $name, [$($doc),+], $place, Value::Control(|signals| signals.$name)),)*
            $(define!(@row $c_name, [$($c_doc),+], $c_place, Value::Control($c_value)),)*
            $(define!(@row $o_name, [$($o_doc),+], $o_place, Value::Observed($o_value)),)*
        ];
    };
    (@row $name:ident, [$($doc:literal),+], $place:ident, $value:expr) => {
        WheelSignal {
            name: stringify!($name),
            doc: concat!($($doc),+),
            logged: define!(@logged $place),
            value: $value,
        }
    };
}

for_each_wheel_signal!(define);

impl WheelSignals {
    /// Disturbed ratio, the safe form of eq. (14) of the paper, within -2..=2 (behind its reference is +).
    #[must_use]
    pub fn disturbed_ratio(&self) -> f64 {
        disturbed_ratio(self.reference_rad_s, self.measured_rad_s, DISTURBED_FLOOR_RAD_S)
    }

    /// 1 if the request is outside the limits, 0 if it is inside, NaN if one of them is unknown.
    ///
    /// ```
    /// use omni_sim::WheelSignals;
    /// let asked = WheelSignals { requested_n_m: 0.5, ..WheelSignals::UNKNOWN };
    /// assert!(asked.saturated().is_nan());
    /// assert_eq!(WheelSignals { limit_lower_n_m: -0.4, limit_upper_n_m: 0.4, ..asked }.saturated(), 1.0);
    /// ```
    #[must_use]
    pub fn saturated(&self) -> f64 {
        let known = [self.requested_n_m, self.limit_lower_n_m, self.limit_upper_n_m];
        if known.iter().any(|n_m| n_m.is_nan()) {
            return f64::NAN;
        }
        let inside = (self.limit_lower_n_m..=self.limit_upper_n_m).contains(&self.requested_n_m);
        f64::from(u8::from(!inside))
    }
}
