//! The metrics of a run and its verdict.

mod body_name;
mod criteria;
mod effort;
mod friction_use;
mod mean;
mod meter;
mod metrics;
mod obedience;
mod pose_errors;
mod slip_speed_std;
mod standstill;
mod undersides;

use serde::{Deserialize, Deserializer, Serialize};

use crate::config::{Engine, Scenario};
pub use body_name::BodyName;
pub use effort::LimitedBy;
pub(crate) use meter::Meter;
pub use metrics::{Better, Metric};

/// The table of verdicts: each one's name and its meaning, which is also its documentation. Which of them comes first
/// is in [`Meter`]'s `verdict`, and their exact criteria are in docs/metrics.md.
macro_rules! verdicts {
    ($($verdict:ident: $name:literal, $meaning:literal;)*) => {
        /// End of a run; docs/metrics.md lists the exact criteria.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum Verdict {
            $(
                #[doc = $meaning]
                #[serde(rename = $name)]
                $verdict,
            )*
        }

        impl Verdict {
            /// The name in tables and logs, as `climbed`.
            ///
            /// ```
            /// assert_eq!(omni_sim::Verdict::Stalled.name(), "stalled");
            /// ```
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$verdict => $name,)*
                }
            }

            /// Its meaning, in a sentence or two; docs/metrics.md lists the exact criteria.
            ///
            /// ```
            /// assert!(omni_sim::Verdict::Unfinished.meaning().contains("duration_s"));
            /// ```
            #[must_use]
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Self::$verdict => $meaning,)*
                }
            }
        }
    };
}

verdicts! {
    Climbed: "climbed",
        "Every wheel stands beyond the obstacle.";
    Stalled: "stalled",
        "In the last second the vehicle covered less than a tenth of the commanded distance, or it gave up.";
    SlidAlong: "slid_along",
        "In the last second the vehicle moved along the obstacle, and less than a tenth of the commanded distance across it.";
    Unfinished: "unfinished",
        "The vehicle was still moving, or retrying, when duration_s ended. A longer duration_s shows whether it climbs.";
    Arrived: "arrived",
        "There is no obstacle, and the vehicle is at the end of its path.";
    Completed: "completed",
        "There is no obstacle, and the vehicle moved as commanded to the run's end.";
    Tipped: "tipped",
        "The base tilted by more than 60 degrees.";
    Overspeed: "overspeed",
        "For half a second the vehicle was more than 1.5 times as fast as commanded.";
    WrongWay: "wrong_way",
        "For half a second the vehicle moved or turned against its command.";
    DroveOn: "drove_on",
        "The motors drove wheels although rest was commanded and their torque should have ended.";
    RolledOn: "rolled_on",
        "The vehicle kept moving although rest was commanded; its motors did no work. It rolled down a slope, or nothing braked it.";
    OffCourse: "off_course",
        "The vehicle turned unasked, so that its heading was more than 45 degrees off the commanded one.";
    FellShort: "fell_short",
        "The vehicle covered less than half of the commanded distance.";
    Tilted: "tilted",
        "A body tilted by 30 degrees more than the ground requires, or it fell to its hinge's stop.";
    Touched: "touched",
        "A body met the ground. In the simulation it passes through; a real vehicle would be stopped or scrape.";
    GainedEnergy: "gained_energy",
        "The physics created energy, so no metric is valid. Use a shorter physics.timestep_s.";
    Diverged: "diverged",
        "The physics failed: no metric is valid. Use a shorter physics.timestep_s.";
}

/// Metrics of a run.
///
/// If there is an obstacle, averages are over the *crossing*: from the moment the foremost wheel reaches it to the
/// moment the last wheel stands on the ground beyond, or the end of the run. On flat ground they are over the whole
/// run. If the obstacle is never reached, they are NaN: nothing was measured.
///
/// ```
/// use omni_sim::{Verdict, config::Scenario, run};
/// let climb = run(&Scenario::load("step", &[])?)?;
/// let outcome = climb.outcome();
/// assert_eq!((outcome.verdict, outcome.climbed), (Verdict::Climbed, true));
/// assert!(outcome.e_over_mgh.is_some_and(|ratio| ratio > 1.0)); // lifting is not all that the work goes into
/// # Ok::<(), omni_sim::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Outcome {
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict is `climbed`. A vehicle that got across, but with a verdict that comes first, as `touched`, has not.
    pub climbed: bool,
    /// The physics engine.
    #[serde(default)] // logs that do not say it are of the only engine that there was
    pub engine: Engine,
    /// The wheel model is valid on this ground: rollers, or balls that represent them there
    /// ([`Scenario::beyond_balls`](crate::config::Scenario::beyond_balls)). If it is false, verdict and metrics
    /// describe another vehicle.
    #[serde(default)] // of logs that do not say it, the scenario does
    pub wheel_model_valid: bool,
    /// Duration of the crossing \[s\]; none unless climbed.
    pub crossing_s: Option<f64>,
    /// World x of the base where it stalled \[m\]; none unless stalled.
    pub stalled_at_m: Option<f64>,
    /// The foremost row of wheels that had not passed the obstacle then, 1 is the front row
    /// ([`crate::config::Vehicle::rows`]); none unless stalled.
    pub stalled_row: Option<usize>,
    /// Limiting factor in the last second in which motors pushed; none unless stalled or unfinished.
    #[serde(default)]
    pub limited_by: Option<LimitedBy>,
    /// Wheels that slipped then, or stood while their motors were at their limit; none unless
    /// stalled by friction or torque.
    #[serde(default)]
    pub limited_wheels: Option<usize>,
    /// The body whose underside was the first to be more than 2 mm below the ground
    /// ([`underside_m`](crate::config::Body::underside_m)); none if none was.
    #[serde(default)]
    pub touched_body: Option<BodyName>,
    /// When that was, from the start of the run \[s\].
    #[serde(default)]
    pub touched_s: Option<f64>,
    /// World x of the deepest point then \[m\].
    #[serde(default)]
    pub touched_x_m: Option<f64>,
    /// World y of that point \[m\].
    #[serde(default)]
    pub touched_y_m: Option<f64>,
    /// Depth below the ground \[m\].
    #[serde(default)]
    pub touched_depth_m: Option<f64>,
    /// Times that traction control (`traction`, `traction_runup`) backed off for another try, from
    /// the start to the end of the crossing; none of a controller that does not try again.
    #[serde(default)] // logs of before do not say it
    pub retries: Option<u32>,
    /// Longest time in which the vehicle stood (within 2 cm of a place, turning included) and some motor applied at
    /// least nine tenths of its stall torque \[s\].
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub stall_s: f64,
    /// When that began, from the start of the run \[s\]; none if there was no such time.
    #[serde(default)]
    pub stall_from_s: Option<f64>,
    /// Largest nose-up angle of any body during the crossing \[deg\].
    #[serde(deserialize_with = "or_nan")]
    pub pitch_peak_deg: f64,
    /// Largest nose-down angle of any body during the crossing, positive \[deg\].
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub nose_down_peak_deg: f64,
    /// Heading less the heading commanded, at the end of the crossing \[deg\]; left is positive.
    #[serde(deserialize_with = "or_nan")]
    pub yaw_error_deg: f64,
    /// Root mean square of the slip ratio over driven wheels that touch the ground.
    #[serde(deserialize_with = "or_nan")]
    pub slip_rms: f64,
    /// Root mean square of the relative speed error (the disturbed ratio) over driven wheels.
    #[serde(deserialize_with = "or_nan")]
    pub speed_error_rms: f64,
    /// The same relative to the reference after the policy's reduction: if the policy multiplies all references by a
    /// common factor, relative to the reduced reference, otherwise equal to `speed_error_rms`.
    #[serde(default = "not_measured", deserialize_with = "or_nan")] // logs of before do not say it
    pub speed_error_realised_rms: f64,
    /// Standard deviation over driven wheels of velocity over reference, root mean square over time.
    #[serde(deserialize_with = "or_nan")]
    pub speed_ratio_std: f64,
    /// How differently driven wheels slip: root mean square over time of the standard deviation over driven wheels
    /// of rim speed less velocity of the centre ([`WheelObservation`](crate::observation::WheelObservation), each
    /// the way its reference turns), over the root mean square of the speeds that their references ask of them.
    /// What the linkage makes of wheels that roll is not in it, as it is in `speed_ratio_std`.
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub slip_speed_std: f64,
    /// Root mean square over wheels and time of the shape error \[rad/s\]: the part of their velocities that no common
    /// factor on the references explains.
    #[serde(deserialize_with = "or_nan")]
    pub shape_error_rms_rad_s: f64,
    /// Sum over wheels of the time integral of torque squared \[N^2.m^2.s\]: proportional to the motors' heat.
    #[serde(deserialize_with = "or_nan")]
    pub torque_squared_n2m2s: f64,
    /// Work of the motors \[J\].
    #[serde(deserialize_with = "or_nan")]
    pub work_j: f64,
    /// Cost of transport: that work over the weight times the way gone; none if it went less than 1 cm.
    pub cost_of_transport: Option<f64>,
    /// That work over the weight times the height gained; none unless climbed to a higher place.
    pub e_over_mgh: Option<f64>,
    /// Friction that the wheels called for: in 95 of 100 averages of 10 ms over a wheel with load, the force
    /// along the ground was at most this times the normal force. Near the ground's own coefficient, wheels slid.
    #[serde(deserialize_with = "or_nan")]
    pub required_friction: f64,
    /// Energy that the balance cannot place, over all that went through the motors since the start
    /// ([`crate::observation::Energy::residual_j`], `turnover_j`).
    #[serde(deserialize_with = "or_nan")]
    pub energy_residual: f64,
    /// Root mean square over time of the base's distance from its reference position \[m\]; none without a path.
    pub path_error_rms_m: Option<f64>,
    /// Largest such distance \[m\]; none without a path.
    pub path_error_peak_m: Option<f64>,
    /// Since when the base was at the end of its path, and its path over \[s\]; none if it was not there at the run's
    /// end.
    #[serde(default)]
    pub arrived_s: Option<f64>,
    /// Distance of the base's origin from its position by odometry \[m\], at the end of the crossing, or of the run on
    /// flat ground.
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub odometry_error_m: f64,
    /// True x of the base's origin then \[m\], world.
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub final_x_m: f64,
    /// True y then \[m\], world.
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub final_y_m: f64,
    /// True heading then \[rad\], counter-clockwise positive, -pi to pi.
    #[serde(default = "not_measured", deserialize_with = "or_nan")]
    pub final_yaw_rad: f64,
}

impl Outcome {
    /// The outcome of a run of which nothing is known but its scenario: unfinished, nothing measured.
    ///
    /// ```
    /// use omni_sim::{Outcome, Verdict, config::Scenario};
    /// let outcome = Outcome::unfinished(&Scenario::load("flat", &[])?);
    /// assert!(outcome.verdict == Verdict::Unfinished && outcome.wheel_model_valid && outcome.work_j.is_nan());
    /// # Ok::<(), omni_sim::Error>(())
    /// ```
    #[must_use]
    pub fn unfinished(scenario: &Scenario) -> Self {
        Self {
            verdict: Verdict::Unfinished,
            climbed: false,
            engine: scenario.physics.engine,
            wheel_model_valid: scenario.beyond_balls().is_none(),
            crossing_s: None,
            stalled_at_m: None,
            stalled_row: None,
            limited_by: None,
            limited_wheels: None,
            touched_body: None,
            touched_s: None,
            touched_x_m: None,
            touched_y_m: None,
            touched_depth_m: None,
            retries: None,
            stall_s: f64::NAN,
            stall_from_s: None,
            pitch_peak_deg: f64::NAN,
            nose_down_peak_deg: f64::NAN,
            yaw_error_deg: f64::NAN,
            slip_rms: f64::NAN,
            speed_error_rms: f64::NAN,
            speed_error_realised_rms: f64::NAN,
            speed_ratio_std: f64::NAN,
            slip_speed_std: f64::NAN,
            shape_error_rms_rad_s: f64::NAN,
            torque_squared_n2m2s: f64::NAN,
            work_j: f64::NAN,
            cost_of_transport: None,
            e_over_mgh: None,
            required_friction: f64::NAN,
            energy_residual: f64::NAN,
            path_error_rms_m: None,
            path_error_peak_m: None,
            arrived_s: None,
            odometry_error_m: f64::NAN,
            final_x_m: f64::NAN,
            final_y_m: f64::NAN,
            final_yaw_rad: f64::NAN,
        }
    }
}

/// A metric that a file does not have.
fn not_measured() -> f64 {
    f64::NAN
}

/// A metric; JSON contains null if nothing was measured.
fn or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// An outcome as text within binary data: what was not measured is null there, and NaN again.
pub(crate) mod as_json {
    use serde::{Deserialize, Deserializer, Serializer, de, ser};

    use super::Outcome;

    pub(crate) fn serialize<S: Serializer>(outcome: &Outcome, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&serde_json::to_string(outcome).map_err(ser::Error::custom)?)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Outcome, D::Error> {
        serde_json::from_str(&String::deserialize(from)?).map_err(de::Error::custom)
    }
}
