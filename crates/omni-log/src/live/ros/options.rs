//! Options of a run on ROS 2.

use super::goals::GoalPlanner;
use crate::Error;
use crate::message_rates::{Pace, Rates};
use crate::topic;
use crate::urdf::JointInterface;

/// Frames that a run sends on `/tf` and `/tf_static`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TfFrames {
    /// The base, the world, hinges, wheels and the inertial measurement unit.
    #[default]
    All,
    /// The same without hinges and wheels: a robot_state_publisher makes these of `/joint_states`.
    Odom,
    /// None: other nodes send all of them.
    None,
}

/// A run's place on ROS 2.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Ros2 {
    /// Its domain, 0 to 232: nodes in other domains do not see it.
    pub domain: u16,
    /// Namespace of all topics but `/clock` and `/diagnostics`, such as `/robot1`; empty for none. With a prefix of
    /// frames `/tf` and `/tf_static` are not in it either.
    pub namespace: String,
    /// What stands before the name of every frame but `map`, such as `robot1/`, so that vehicles share a `/tf`; empty
    /// for nothing.
    pub frame_prefix: String,
    /// Rates other than the usual ones, by topic as it is without a namespace \[Hz\]: 0 to 1000, 0 for never.
    pub topic_rates: Vec<(String, f64)>,
    /// Sends the frame `map`, too, which is the world: as a localisation without error would.
    pub publish_map_frame: bool,
    /// Keeps step with `/clock` of another run or simulator in the domain, instead of publishing it.
    pub follow_clock: bool,
    /// Which frames it sends.
    pub tf: TfFrames,
    /// The wheels are driven one by one, by messages on `/joint_commands`; none: the vehicle by messages on `/cmd_vel`.
    pub joints: Option<JointInterface>,
    /// Plans the way to goals on `/goal_pose`, which the run then drives; none: there is no such topic. Goals are in
    /// the frame `map`, so only with [`Ros2::publish_map_frame`].
    pub goals: Option<GoalPlanner>,
}

/// What an environment names the domain by.
const DOMAIN: &str = "ROS_DOMAIN_ID";
/// Of which the ports of a domain are below 65536.
const HIGHEST_DOMAIN: u16 = 232;
/// Highest rate \[Hz\].
const HIGHEST_RATE: f64 = 1000.0;
/// Rates that can be chosen, with the usual ones \[Hz\].
const RATES: [(&str, f64); 7] = [
    (topic::CLOCK, 100.0),
    (topic::IMU, 100.0),
    (topic::VEHICLE_STATE, 50.0),
    (topic::TF, 50.0),
    (topic::JOINT_STATES, 50.0),
    (topic::ODOM, 50.0),
    (topic::DIAGNOSTICS, 1.0),
];
/// Rate of `/joint_states` if the wheels are driven one by one \[Hz\].
const JOINTS_HZ: f64 = 100.0;

/// Longest prefix of frames \[bytes\].
const LONGEST_PREFIX: usize = 100;

/// Of what only ROS 2 has.
#[derive(Clone, Copy)]
pub(super) struct ExtraRates {
    pub(super) clock: Pace,
    pub(super) imu: Pace,
    pub(super) diagnostics: Pace,
}

impl Ros2 {
    /// In that domain, without a namespace, at the usual rates, driven by `/cmd_vel`.
    ///
    /// ```
    /// let ros2 = omni_log::Ros2::new(42);
    /// assert_eq!((ros2.domain, ros2.namespace.as_str(), ros2.publish_map_frame), (42, "", false));
    /// ```
    #[must_use]
    pub fn new(domain: u16) -> Self {
        Self {
            domain,
            namespace: String::new(),
            frame_prefix: String::new(),
            topic_rates: Vec::new(),
            publish_map_frame: false,
            follow_clock: false,
            tf: TfFrames::default(),
            joints: None,
            goals: None,
        }
    }

    /// The same in the domain that `ROS_DOMAIN_ID` says, 0 if it says nothing.
    ///
    /// # Errors
    /// [`omni_sim::Error::Argument`] if it is not a whole number, 0 to 232.
    ///
    /// ```
    /// let ros2 = omni_log::Ros2::from_domain_id(Some("42"))?;
    /// assert_eq!((ros2.domain, omni_log::Ros2::from_domain_id(None)?.domain), (42, 0));
    /// let said = omni_log::Ros2::from_domain_id(Some("233")).map_err(|error| error.to_string());
    /// assert_eq!(said.err().as_deref(), Some("ROS_DOMAIN_ID = 233, allowed: a whole number, 0 to 232"));
    /// # Ok::<(), omni_log::Error>(())
    /// ```
    pub fn from_domain_id(value: Option<&str>) -> Result<Self, Error> {
        let Some(text) = value.map(str::trim).filter(|text| !text.is_empty()) else {
            return Ok(Self::new(0));
        };
        match text.parse() {
            Ok(domain) if domain <= HIGHEST_DOMAIN => Ok(Self::new(domain)),
            _ => Err(refused(DOMAIN, text, "a whole number, 0 to 232")),
        }
    }

    /// The namespace, with a slash before and none behind; "/" for none.
    pub(super) fn namespace(&self) -> Result<String, Error> {
        let parts: Vec<&str> = self.namespace.trim_matches('/').split('/').collect();
        let fits = |part: &&str| {
            let plain = part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            plain && part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        };
        if parts == [""] {
            return Ok("/".into());
        }
        if parts.iter().all(fits) {
            return Ok(format!("/{}", parts.join("/")));
        }
        Err(refused(
            "--namespace",
            &self.namespace,
            "names of letters, digits and _ separated by /, none with a digit first, such as robot1",
        ))
    }

    /// The prefix, if names of frames may begin with it.
    pub(super) fn frame_prefix(&self) -> Result<&str, Error> {
        let prefix = self.frame_prefix.as_str();
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-/".contains(c);
        if prefix.chars().all(plain) && !prefix.starts_with('/') && prefix.len() <= LONGEST_PREFIX {
            return Ok(prefix);
        }
        Err(refused(
            "--frame-prefix",
            prefix,
            "up to 100 letters, digits, _, - and /, not / at first, such as robot1/",
        ))
    }

    /// Goals are in the frame `map`, and the vehicle is driven as a whole.
    pub(super) fn check_goals(&self) -> Result<(), Error> {
        if self.goals.is_some() && !self.publish_map_frame {
            return Err(refused(
                "--chart",
                "a chart",
                "only with --publish-map-frame: goals are in the frame map",
            ));
        }
        if self.goals.is_some() && self.joints.is_some() {
            return Err(refused(
                "--chart",
                "a chart",
                "only where no client drives single wheels",
            ));
        }
        Ok(())
    }

    /// Rates of all topics.
    pub(super) fn rates(&self) -> Result<(Rates, ExtraRates), Error> {
        let mut usual = RATES;
        if self.tf == TfFrames::None {
            if self.publish_map_frame {
                let allowed = "only with --tf all and odom, which send frames";
                return Err(refused("--publish-map-frame", "true", allowed));
            }
            usual[3].1 = 0.0;
        }
        if self.follow_clock {
            usual[0].1 = 0.0;
        }
        if self.joints.is_some() {
            usual[4].1 = JOINTS_HZ;
        }
        for (name, rate) in &self.topic_rates {
            let named = format!("/{}", name.trim_start_matches('/'));
            let Some(known) = usual.iter_mut().find(|(known, _)| *known == named) else {
                return Err(refused(
                    "--topic-rate",
                    &format!("{name}={rate}"),
                    "one of the topics clock, imu, vehicle_state, tf, joint_states, odom, diagnostics",
                ));
            };
            if known.0 == topic::CLOCK && self.follow_clock && *rate != 0.0 {
                let allowed = "0 with --follow-clock";
                return Err(refused("--topic-rate", &format!("{name}={rate}"), allowed));
            }
            if known.0 == topic::TF && self.tf == TfFrames::None && *rate != 0.0 {
                let allowed = "0 with --tf none";
                return Err(refused("--topic-rate", &format!("{name}={rate}"), allowed));
            }
            if !(0.0..=HIGHEST_RATE).contains(rate) {
                return Err(refused("--topic-rate", &format!("{name}={rate}"), "0 to 1000 Hz"));
            }
            known.1 = *rate;
        }
        let paces = usual.map(|(_, rate)| Pace::hz(rate));
        let [clock, imu, vehicle_state, tf, joint_states, odom, diagnostics] = paces;
        let rates = Rates {
            vehicle_state,
            tf,
            joint_states,
            odom,
            // A node that commands would receive its own messages; markers are for viewers without a robot model.
            cmd_vel: Pace::hz(0.0),
            markers: Pace::hz(0.0),
        };
        let extra = ExtraRates {
            clock,
            imu,
            diagnostics,
        };
        Ok((rates, extra))
    }

    /// The error of an operation that the system rejected.
    pub(super) fn failed(&self, reason: impl std::fmt::Display) -> Error {
        Error::Ros2 {
            domain: self.domain,
            reason: reason.to_string(),
        }
    }
}

fn refused(name: &'static str, value: &str, allowed: &'static str) -> Error {
    let value = value.into();
    omni_sim::Error::Argument { name, value, allowed }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said<T>(result: Result<T, Error>) -> String {
        result.err().map_or_else(String::new, |error| error.to_string())
    }

    #[test]
    fn namespaces_are_taken_with_and_without_slashes_and_refused_in_a_line() {
        let of = |namespace: &str| Ros2 {
            namespace: namespace.into(),
            ..Ros2::new(0)
        };
        for (given, expected) in [
            ("", "/"),
            ("/", "/"),
            ("robot1", "/robot1"),
            ("/a/b_2/", "/a/b_2"),
        ] {
            assert_eq!(of(given).namespace().ok().as_deref(), Some(expected));
        }
        for given in ["1st", "a b", "a//b", "ü", "a/~"] {
            let line = said(of(given).namespace());
            assert!(
                line.starts_with(&format!("--namespace = {given}, allowed: ")),
                "{line}"
            );
        }
    }

    #[test]
    fn a_prefix_of_frames_is_a_name_that_begins_with_no_slash() {
        let of = |prefix: &str| Ros2 {
            frame_prefix: prefix.into(),
            ..Ros2::new(0)
        };
        for prefix in ["", "robot1/", "a/b_2-", "7/"] {
            assert_eq!(of(prefix).frame_prefix().ok(), Some(prefix));
        }
        for prefix in ["/robot1/", "a b", "ü", &"x".repeat(101)] {
            let line = said(of(prefix).frame_prefix());
            assert!(
                line.starts_with("--frame-prefix = ") && line.contains("such as robot1/"),
                "{line}"
            );
        }
    }

    #[test]
    fn rates_are_those_of_known_topics_within_their_range() {
        let of = |name: &str, rate| Ros2 {
            topic_rates: vec![(name.into(), rate)],
            ..Ros2::new(0)
        };
        let (mut rates, mut extra) = of("/odom", 10.0).rates().expect("a topic");
        let in_a_second = |pace: &mut Pace| (0..1000).filter(|ms| pace.due(ms * 1_000_000)).count();
        assert_eq!(
            (
                in_a_second(&mut rates.odom),
                in_a_second(&mut rates.tf),
                in_a_second(&mut extra.clock)
            ),
            (10, 50, 100)
        );
        assert_eq!(in_a_second(&mut of("imu", 0.0).rates().expect("never").1.imu), 0);
        for (name, rate, part) in [
            ("cmd_vel", 5.0, "allowed: one of the topics clock, "),
            ("odom", -1.0, "allowed: 0 to 1000 Hz"),
            ("odom", f64::NAN, "allowed: 0 to 1000 Hz"),
            ("odom", 1001.0, "--topic-rate = odom=1001, "),
        ] {
            let line = said(of(name, rate).rates());
            assert!(line.contains(part), "{line}");
        }
    }

    #[test]
    fn without_frames_neither_their_rate_nor_a_map_can_be_chosen() {
        let of = |rates: &[(&str, f64)], publish_map_frame| Ros2 {
            topic_rates: rates.iter().map(|(name, rate)| ((*name).into(), *rate)).collect(),
            publish_map_frame,
            tf: TfFrames::None,
            ..Ros2::new(0)
        };
        for rates in [&[][..], &[("tf", 0.0), ("odom", 10.0)]] {
            let mut rates = of(rates, false).rates().expect("no frames").0;
            assert!(!rates.tf.due(0));
        }
        assert_eq!(
            said(of(&[("tf", 20.0)], false).rates()),
            "--topic-rate = tf=20, allowed: 0 with --tf none"
        );
        assert_eq!(
            said(of(&[], true).rates()),
            "--publish-map-frame = true, allowed: only with --tf all and odom, which send frames"
        );
    }

    #[test]
    fn who_follows_a_clock_publishes_none() {
        let of = |rates: &[(&str, f64)]| Ros2 {
            topic_rates: rates.iter().map(|(name, rate)| ((*name).into(), *rate)).collect(),
            follow_clock: true,
            ..Ros2::new(0)
        };
        for rates in [&[][..], &[("clock", 0.0), ("odom", 10.0)]] {
            let mut extra = of(rates).rates().expect("no clock").1;
            assert!(!extra.clock.due(0));
        }
        assert_eq!(
            said(of(&[("clock", 100.0)]).rates()),
            "--topic-rate = clock=100, allowed: 0 with --follow-clock"
        );
    }

    #[test]
    fn goals_are_in_a_map_and_of_the_whole_vehicle() {
        let of = |publish_map_frame, joints| Ros2 {
            goals: Some(GoalPlanner::new(|_, _| Err("no way".into()))),
            publish_map_frame,
            joints,
            ..Ros2::new(0)
        };
        assert!(of(true, None).check_goals().is_ok());
        let without_map = said(of(false, None).check_goals());
        assert!(
            without_map.contains("only with --publish-map-frame"),
            "{without_map}"
        );
        let by_wheel = said(of(true, Some(JointInterface::Velocity)).check_goals());
        assert!(by_wheel.contains("no client drives single wheels"), "{by_wheel}");
    }

    #[test]
    fn a_domain_is_a_whole_number_up_to_232() {
        for (text, domain) in [("0", 0), (" 232 ", 232), ("", 0)] {
            let ros2 = Ros2::from_domain_id(Some(text)).expect("a domain");
            assert_eq!(ros2.domain, domain);
        }
        for text in ["-1", "x", "1.5", "99999999999"] {
            assert!(said(Ros2::from_domain_id(Some(text))).starts_with("ROS_DOMAIN_ID = "));
        }
    }
}
