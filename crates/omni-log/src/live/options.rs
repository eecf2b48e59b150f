//! Options of a live run.

use std::path::PathBuf;

use super::pilot::Pilot;
#[cfg(feature = "ros2")]
use super::ros::Ros2;

/// Address, rate and permissions of a live run.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Live {
    /// Port on 127.0.0.1 for viewers; 0 for any that is free, none for no port.
    pub port: Option<u16>,
    /// Its place on ROS 2; none for none.
    #[cfg(feature = "ros2")]
    pub ros2: Option<Ros2>,
    /// Path of its log; none for no log. Not with [`Live::allow_control`]: a log has one policy. Until the run's end
    /// the file is called `.part`, and remains so if an error ends the run.
    pub log: Option<PathBuf>,
    /// Simulated seconds per second of the clock, at least 0.001; infinity for as fast as it goes.
    pub real_time_factor: f64,
    /// Starts when the first viewer or the first ROS 2 node subscribes to a topic.
    pub wait: bool,
    /// When it ends.
    pub until: Until,
    /// Stands until it is commanded to drive, whatever the scenario's command is.
    pub stands: bool,
    /// Driver of the run in this program, if any.
    pub pilot: Option<Pilot>,
    /// Viewers may change command, policy and torque limit; else they watch.
    pub allow_control: bool,
    /// Only the run's own web page may connect, and pages of [`Live::origins`]: neither other pages of this machine nor
    /// known viewers.
    pub own_page: bool,
    /// Origins of further web pages that may connect, besides known viewers and pages of this machine, such as
    /// `https://viewer.example`.
    pub origins: Vec<String>,
}

/// When a live run ends, if it is not ended before.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Until {
    /// With the scenario.
    Scenario,
    /// After so many simulated seconds, above 0.
    Seconds(f64),
    /// Not by itself, but where `stop_when_done` is set and the vehicle is across.
    Stopped,
}

impl Live {
    /// A run on that port, 0 for any that is free, as fast as the clock: it starts at once, ends
    /// with its scenario, and others watch.
    ///
    /// ```
    /// let live = omni_log::Live::new(8765);
    /// assert_eq!((live.port, live.real_time_factor, live.allow_control), (Some(8765), 1.0, false));
    /// ```
    #[must_use]
    pub fn new(port: u16) -> Self {
        Self {
            port: Some(port),
            #[cfg(feature = "ros2")]
            ros2: None,
            log: None,
            real_time_factor: 1.0,
            wait: false,
            until: Until::Scenario,
            stands: false,
            pilot: None,
            allow_control: false,
            own_page: false,
            origins: Vec::new(),
        }
    }

    /// Does another run say what time it is?
    pub(super) fn follows_clock(&self) -> bool {
        #[cfg(feature = "ros2")]
        return self.ros2.as_ref().is_some_and(|ros2| ros2.follow_clock);
        #[cfg(not(feature = "ros2"))]
        false
    }

    /// A run on ROS 2, as fast as the clock, without a port for viewers: it starts at once and goes
    /// on until it is stopped.
    ///
    /// ```
    /// use omni_log::{Live, Ros2, Until};
    /// let live = Live::on_ros2(Ros2::new(0));
    /// assert_eq!((live.port, live.until), (None, Until::Stopped));
    /// ```
    #[cfg(feature = "ros2")]
    #[must_use]
    pub fn on_ros2(ros2: Ros2) -> Self {
        Self {
            port: None,
            ros2: Some(ros2),
            until: Until::Stopped,
            ..Self::new(0)
        }
    }
}

/// Addresses of a live run, once it is open.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Opened {
    /// For viewers, at an address such as `ws://127.0.0.1:8765`.
    Port(String),
    /// On ROS 2, in that domain.
    #[cfg(feature = "ros2")]
    Ros2(u16),
}
