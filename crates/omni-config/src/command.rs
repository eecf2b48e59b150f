//! What the vehicle is told to do, and where it starts.

use garde::Validate;
use omni_core::{BodyTwist, PlanarPose, WorldTwist};
#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ranges::{PLACE_M, TIME_S, TURN_RAD, VELOCITY_M_S, VELOCITY_RAD_S, counted, within};

/// Where the vehicle stands at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Start {
    /// World x \[m\], -100 to 100: the phase at which wheels meet the obstacle.
    #[garde(custom(within(PLACE_M)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub x_m: f64,
    /// World y \[m\], -100 to 100 (left is +).
    #[garde(custom(within(PLACE_M)))]
    #[cfg_attr(feature = "schema", schemars(range(min = PLACE_M.min, max = PLACE_M.max)))]
    pub y_m: f64,
    /// Heading \[rad\], counter-clockwise from world x, -3.2 to 3.2: 0 meets the obstacle head-on.
    #[garde(custom(within(TURN_RAD)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TURN_RAD.min, max = TURN_RAD.max)))]
    pub heading_rad: f64,
}

/// The axes of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CommandFrame {
    /// The vehicle's: forward is where it looks.
    #[default]
    Body,
    /// The world's: forward is across the obstacle, wherever the vehicle looks. The command is turned by the true heading.
    World,
}

/// A twist, reached on a ramp, and others after it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Command {
    /// Forward \[m/s\], -100 to 100.
    #[garde(custom(within(VELOCITY_M_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max)))]
    pub vx_m_s: f64,
    /// Left \[m/s\], -100 to 100.
    #[garde(custom(within(VELOCITY_M_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max)))]
    pub vy_m_s: f64,
    /// Counter-clockwise \[rad/s\], -1000 to 1000.
    #[garde(custom(within(VELOCITY_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_RAD_S.min, max = VELOCITY_RAD_S.max)))]
    pub wz_rad_s: f64,
    /// Time from rest to the whole twist \[s\], 0 to 3600.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub ramp_s: f64,
    /// Axes that forward and left mean.
    #[serde(default)]
    #[garde(skip)]
    pub frame: CommandFrame,
    /// Later twists, in the order of their times.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[garde(custom(counted(0, 1000)), dive)]
    #[cfg_attr(feature = "schema", schemars(length(max = 1000)))]
    pub then: Vec<Then>,
}

/// A twist that takes over from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Validate)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Then {
    /// When it begins \[s\], 0 to 3600; after the one before it.
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub at_s: f64,
    /// Forward \[m/s\], -100 to 100.
    #[garde(custom(within(VELOCITY_M_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max)))]
    pub vx_m_s: f64,
    /// Left \[m/s\], -100 to 100.
    #[garde(custom(within(VELOCITY_M_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_M_S.min, max = VELOCITY_M_S.max)))]
    pub vy_m_s: f64,
    /// Counter-clockwise \[rad/s\], -1000 to 1000.
    #[garde(custom(within(VELOCITY_RAD_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = VELOCITY_RAD_S.min, max = VELOCITY_RAD_S.max)))]
    pub wz_rad_s: f64,
    /// Time from the twist at `at_s` to this one \[s\], 0 to 3600.
    #[serde(default)]
    #[garde(custom(within(TIME_S)))]
    #[cfg_attr(feature = "schema", schemars(range(min = TIME_S.min, max = TIME_S.max)))]
    pub ramp_s: f64,
}

impl Command {
    /// The twist commanded at a time \[s\], in the command's own frame: at rest up to 0, the whole of it from `ramp_s` on, then
    /// the others, each from where the one before was.
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

    /// Largest speed over the ground that is ever commanded \[m/s\].
    #[must_use]
    pub fn fastest_m_s(&self) -> f64 {
        let own = self.vx_m_s.hypot(self.vy_m_s);
        let later = self.then.iter().map(|then| then.vx_m_s.hypot(then.vy_m_s));
        later.fold(own, f64::max)
    }

    /// The key and what is wrong with it, where the times do not ascend.
    pub(crate) fn refusal(&self) -> Option<(String, String)> {
        let mut before_s = 0.0;
        for (i, then) in self.then.iter().enumerate() {
            if then.at_s < before_s {
                let message = format!("{}, allowed: at least the one before, {before_s}", then.at_s);
                return Some((format!("command.then[{i}].at_s"), message));
            }
            before_s = then.at_s;
        }
        None
    }
}
