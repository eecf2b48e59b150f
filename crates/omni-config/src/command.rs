//! The command of a scenario, and its start.

use garde::Validate;
use omni_core::BodyTwist;
use omni_core::geometry::{PlanarPose, WorldTwist};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::command_file::CommandFile;
use crate::path::{PathChoice, PathFollow, PathPlan};
use crate::ranges::{self, LENGTH_M, PLACE_M, TIME_S, TURN_RAD, VELOCITY_M_S, VELOCITY_RAD_S};

/// Start pose of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Start {
    /// World x \[m\], -100 to 100. It sets at which angle of their rotation the wheels meet the obstacle.
    #[garde(adapt(ranges), range(min = PLACE_M.min, max = PLACE_M.max))]
    pub x_m: f64,
    /// World y \[m\], -100 to 100 (left is +).
    #[garde(adapt(ranges), range(min = PLACE_M.min, max = PLACE_M.max))]
    pub y_m: f64,
    /// Heading \[rad\], counter-clockwise from world x, -3.2 to 3.2: 0 meets the obstacle head-on.
    #[garde(adapt(ranges), range(min = TURN_RAD.min, max = TURN_RAD.max))]
    pub heading_rad: f64,
}

/// The axes of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CommandFrame {
    /// The vehicle's axes: forward is along its heading.
    #[default]
    Body,
    /// The world's axes: forward is towards the obstacle, whatever the heading. The command is
    /// rotated by the true heading.
    World,
}

/// A twist that is reached on a ramp, with later twists; or a path to follow; or a table of twists.
/// With a path or a table the twist is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Command {
    /// Forward \[m/s\], -100 to 100; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max))]
    pub vx_m_s: f64,
    /// Left \[m/s\], -100 to 100; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max))]
    pub vy_m_s: f64,
    /// Counter-clockwise \[rad/s\], -1000 to 1000; 0 if left out.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = VELOCITY_RAD_S.min, max = VELOCITY_RAD_S.max))]
    pub wz_rad_s: f64,
    /// Time from rest to the whole twist \[s\], 0 to 3600; 0.3 if left out.
    #[serde(default = "soft_start")]
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub ramp_s: f64,
    /// Axes of forward and left: the vehicle's or the world's.
    #[serde(default)]
    #[garde(skip)]
    pub frame: CommandFrame,
    /// Later twists, in the order of their times.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[garde(adapt(ranges), length(max = 1000), dive)]
    pub then: Vec<Then>,
    /// A path to follow instead of the twist: `square`, `figure_eight`, or waypoints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(dive)]
    pub path: Option<PathChoice>,
    /// Side of the square, diameter of the figure of eight's circles \[m\], 0.01 to 100; 1 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(adapt(ranges), range(min = LENGTH_M.min, max = LENGTH_M.max))]
    pub path_size_m: Option<f64>,
    /// Limits for the planning of the path.
    #[serde(default, skip_serializing_if = "is_default")]
    #[garde(dive)]
    pub plan: PathPlan,
    /// Controller that follows the path.
    #[serde(default, skip_serializing_if = "is_default")]
    #[garde(dive)]
    pub follow: PathFollow,
    /// A CSV file with columns `time_s`, `vx_m_s`, `vy_m_s`, `wz_rad_s`, relative to this file. Its
    /// twists are commanded instead, each from its time until the next time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[garde(skip)]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub file: Option<CommandFile>,
}

fn soft_start() -> f64 {
    0.3
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// The keys of a twist, which a path or a table of twists stands for.
const TWIST: [&str; 4] = ["vx_m_s", "vy_m_s", "wz_rad_s", "ramp_s"];

/// A twist that replaces the one before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Then {
    /// When it begins \[s\], 0 to 3600; after the one before it.
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub at_s: f64,
    /// Forward \[m/s\], -100 to 100.
    #[garde(adapt(ranges), range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max))]
    pub vx_m_s: f64,
    /// Left \[m/s\], -100 to 100.
    #[garde(adapt(ranges), range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max))]
    pub vy_m_s: f64,
    /// Counter-clockwise \[rad/s\], -1000 to 1000.
    #[garde(adapt(ranges), range(min = VELOCITY_RAD_S.min, max = VELOCITY_RAD_S.max))]
    pub wz_rad_s: f64,
    /// Time from the twist at `at_s` to this one \[s\], 0 to 3600.
    #[serde(default)]
    #[garde(adapt(ranges), range(min = TIME_S.min, max = TIME_S.max))]
    pub ramp_s: f64,
}

impl Command {
    /// Gives a command with a path or a table the twist that it leaves out: none.
    pub(crate) fn complete(scenario: &mut Table) {
        let command = scenario.get_mut("command").and_then(Value::as_table_mut);
        if let Some(command) =
            command.filter(|command| command.contains_key("path") || command.contains_key("file"))
        {
            for key in TWIST {
                command.entry(key).or_insert(Value::Float(0.0));
            }
        }
    }

    /// Whether it has a path or a table of twists.
    pub(crate) fn comes_by_itself(&self) -> bool {
        self.path.is_some() || self.file.is_some()
    }

    /// The twist commanded at a time \[s\], in the command's own frame: at rest up to 0, the whole
    /// of it from `ramp_s` on, then the others, each from where the one before was; or the row of the table of twists.
    /// None for a path, whose command depends on the vehicle's pose.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let stop = Override::parse("command.then=[{ at_s = 2.0, vx_m_s = 0.0, vy_m_s = 0.0, wz_rad_s = 0.0, ramp_s = 0.4 }]")?;
    /// let command = Scenario::load("step", &[stop])?.command; // 0.3 m/s after a ramp of 0.3 s
    /// let vx = |time_s| command.at(time_s).vx_m_s;
    /// assert_eq!((vx(0.0), vx(0.15), vx(1.0), vx(2.5)), (0.0, 0.15, 0.3, 0.0));
    /// assert!((vx(2.2) - 0.15).abs() < 1e-12);
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn at(&self, time_s: f64) -> BodyTwist<f64> {
        if let Some(file) = &self.file {
            return file.at(time_s);
        }
        let mut twist = [0.0; 3];
        let own = Then {
            at_s: 0.0,
            vx_m_s: self.vx_m_s,
            vy_m_s: self.vy_m_s,
            wz_rad_s: self.wz_rad_s,
            ramp_s: self.ramp_s,
        };
        let all = || std::iter::once(&own).chain(&self.then);
        let ends = all().skip(1).map(|next| next.at_s).chain([f64::INFINITY]);
        for (now, end_s) in all().zip(ends) {
            // How far this one had come when the next took over, or has come by now.
            let since_s = time_s.min(end_s) - now.at_s;
            let part = if now.ramp_s > 0.0 {
                (since_s / now.ramp_s).clamp(0.0, 1.0)
            } else {
                1.0
            };
            let whole = [now.vx_m_s, now.vy_m_s, now.wz_rad_s];
            twist = [0, 1, 2].map(|k| {
                if part < 1.0 {
                    twist[k] + part * (whole[k] - twist[k])
                } else {
                    whole[k]
                }
            });
            if time_s < end_s {
                break;
            }
        }
        BodyTwist::from_array(twist)
    }

    /// The twist for the vehicle at a time \[s\], while it looks along `heading_rad`.
    ///
    /// ```
    /// use omni_config::{Override, Scenario};
    /// let across = Scenario::load("step", &[Override::new("command.frame", "world")])?.command;
    /// let turned_left = across.for_heading(1.0, std::f64::consts::FRAC_PI_2);
    /// assert!((turned_left.vy_m_s + 0.3).abs() < 1e-12); // the world's forward is on its right
    /// # Ok::<(), omni_config::Error>(())
    /// ```
    #[must_use]
    pub fn for_heading(&self, time_s: f64, heading_rad: f64) -> BodyTwist<f64> {
        let twist = self.at(time_s);
        match self.frame {
            CommandFrame::Body => twist,
            CommandFrame::World => WorldTwist {
                vx_m_s: twist.vx_m_s,
                vy_m_s: twist.vy_m_s,
                wz_rad_s: twist.wz_rad_s,
            }
            .to_body(&PlanarPose {
                x_m: 0.0,
                y_m: 0.0,
                yaw_rad: heading_rad,
            }),
        }
    }

    /// Largest speed over the ground that is ever commanded \[m/s\]; of a path 0.
    #[must_use]
    pub fn fastest_m_s(&self) -> f64 {
        if let Some(file) = &self.file {
            return file
                .rows()
                .iter()
                .map(|[_, vx, vy, _]| libm::hypot(*vx, *vy))
                .fold(0.0, f64::max);
        }
        let own = libm::hypot(self.vx_m_s, self.vy_m_s);
        let later = self.then.iter().map(|then| libm::hypot(then.vx_m_s, then.vy_m_s));
        later.fold(own, f64::max)
    }

    /// Largest commanded components, forward, lateral \[m/s\] and yaw \[rad/s\], in either direction; 0 for a path.
    pub(crate) fn largest(&self) -> [f64; 3] {
        self.twists().fold([0.0; 3], |most, twist| {
            [0, 1, 2].map(|axis| twist[axis].abs().max(most[axis]))
        })
    }

    /// Every twist that it names.
    pub(crate) fn twists(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let rows = self
            .file
            .iter()
            .flat_map(|file| file.rows())
            .map(|[_, vx, vy, wz]| [*vx, *vy, *wz]);
        let later = self
            .then
            .iter()
            .map(|then| [then.vx_m_s, then.vy_m_s, then.wz_rad_s]);
        rows.chain(later)
            .chain([[self.vx_m_s, self.vy_m_s, self.wz_rad_s]])
    }

    /// The key and what is wrong with it, where the times do not ascend, or if there is more than one of a twist, a
    /// path and a table.
    pub(crate) fn refusal(&self) -> Option<(String, String)> {
        if self.path.is_some() && self.file.is_some() {
            let message = "a table of twists, allowed: only without command.path".to_owned();
            return Some(("command.file".into(), message));
        }
        if self.comes_by_itself() {
            let other = if self.path.is_some() { "path" } else { "file" };
            let twist = [self.vx_m_s, self.vy_m_s, self.wz_rad_s, self.ramp_s];
            if let Some((key, value)) = TWIST.iter().zip(twist).find(|(_, value)| *value != 0.0) {
                let message =
                    format!("{value}, allowed: 0 or left out with command.{other}, which sets the twist");
                return Some((format!("command.{key}"), message));
            }
            if !self.then.is_empty() {
                let message = format!("twists, allowed: none with command.{other}, which sets the twist");
                return Some(("command.then".into(), message));
            }
            if self.path.is_some() && self.frame != CommandFrame::Body {
                let message =
                    "\"world\", allowed: left out with command.path, which is always in the world frame"
                        .to_owned();
                return Some(("command.frame".into(), message));
            }
        }
        if let Some(refusal) = self.path_refusal() {
            return Some(refusal);
        }
        let mut before_s = 0.0;
        for (i, then) in self.then.iter().enumerate() {
            if then.at_s < before_s {
                let message = format!(
                    "{}, allowed: at least {before_s}, the time of the twist before",
                    then.at_s
                );
                return Some((format!("command.then[{i}].at_s"), message));
            }
            before_s = then.at_s;
        }
        None
    }
}
