//! A run as ROS 2 messages.
//!
//! | topic | type | rate |
//! |---|---|---|
//! | `/vehicle_state` | `omni_msgs/msg/VehicleState` | every control period |
//! | `/tf` | `tf2_msgs/msg/TFMessage` | 50 Hz |
//! | `/joint_states` | `sensor_msgs/msg/JointState` | 50 Hz |
//! | `/odom` | `nav_msgs/msg/Odometry` | 50 Hz: the true pose and twist, no estimate |
//! | `/cmd_vel` | `geometry_msgs/msg/TwistStamped` | 50 Hz |
//!
//! The scenario as resolved, its vehicle inside, is the attachment `scenario.toml`; policy, seed and version are the metadata `run`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use omni_core::BodyTwist;

use super::ros2::{
    Header, JointState, Odometry, Point, Pose, PoseWithCovariance, Quaternion, TfMessage, Transform,
    TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3, VehicleState, WheelState,
};
use super::{Channel, LogError, LogWriter};
use crate::Outcome;
use crate::config::Scenario;
use crate::controller::ControlSample;
use crate::observation::Observation;

/// Frame of the ground.
const WORLD: &str = "world";
/// Frame of the vehicle's first body, by the name that ROS tools expect.
const BASE: &str = "base_link";
/// Time between messages of the slower topics \[ns\]: 50 Hz.
const SLOW_NS: u64 = 20_000_000;

/// Writes a run while it goes on; the file gets its name when [`RunLog::finish`] has succeeded.
pub struct RunLog {
    writer: LogWriter,
    vehicle_state: Channel<VehicleState>,
    tf: Channel<TfMessage>,
    joint_states: Channel<JointState>,
    odom: Channel<Odometry>,
    cmd_vel: Channel<TwistStamped>,
    scenario: Scenario,
    period_s: f64,
    wheel_angles: Vec<f64>,
    next_slow_ns: u64,
}

impl RunLog {
    /// Starts the log of a scenario's run at `path`.
    ///
    /// # Errors
    /// As [`LogWriter::create`] and [`LogWriter::metadata`].
    pub fn create(path: impl AsRef<Path>, scenario: &Scenario) -> Result<Self, LogError> {
        let mut writer = LogWriter::create(&path)?;
        let vehicle = scenario.vehicle();
        let facts = [
            ("omnistep", env!("CARGO_PKG_VERSION").to_owned()),
            ("scenario", scenario.name.clone()),
            ("vehicle", vehicle.name.clone()),
            ("policy", scenario.control.policy.clone()),
            ("seed", scenario.seed.to_string()),
        ];
        writer.metadata("run", facts.map(|(k, v)| (k.to_owned(), v)).into())?;
        // Whole, with the vehicle inside. Only a seed that TOML's integers cannot hold is refused here.
        let text = toml::to_string(scenario).map_err(|error| LogError::Io {
            path: path.as_ref().to_path_buf(),
            source: std::io::Error::other(format!("the scenario cannot be written as TOML: {error}")),
        })?;
        writer.attachment("scenario.toml", "application/toml", text.as_bytes())?;
        Ok(Self {
            vehicle_state: writer.channel("/vehicle_state")?,
            tf: writer.channel("/tf")?,
            joint_states: writer.channel("/joint_states")?,
            odom: writer.channel("/odom")?,
            cmd_vel: writer.channel("/cmd_vel")?,
            wheel_angles: vec![0.0; vehicle.wheel.len()],
            period_s: scenario.control.period_us as f64 * 1e-6,
            next_slow_ns: 0,
            scenario: scenario.clone(),
            writer,
        })
    }

    /// Adds one control period.
    ///
    /// # Errors
    /// As [`LogWriter::write`].
    pub fn push(&mut self, sample: &ControlSample, seen: &Observation) -> Result<(), LogError> {
        for (angle, wheel) in self.wheel_angles.iter_mut().zip(&sample.wheels) {
            *angle += wheel.measured_rad_s * self.period_s;
        }
        let time = seen.time_ns;
        let state = self.vehicle_state(sample, seen);
        self.writer.write(&self.vehicle_state, time, &state)?;
        if time < self.next_slow_ns {
            return Ok(());
        }
        self.next_slow_ns = time - time % SLOW_NS + SLOW_NS;
        let (tf, joints) = (self.transforms(seen), self.joints(sample, seen));
        self.writer.write(&self.tf, time, &tf)?;
        self.writer.write(&self.joint_states, time, &joints)?;
        let [x, y, z] = seen.pose.position_m;
        let pose = Pose {
            position: Point { x, y, z },
            orientation: quaternion(seen.pose.rotation_xyzw),
        };
        let odom = Odometry {
            header: Header::new(time, WORLD),
            child_frame_id: BASE.into(),
            pose: PoseWithCovariance {
                pose,
                covariance: [[0.0; 6]; 6],
            },
            twist: TwistWithCovariance {
                twist: twist(&seen.twist),
                covariance: [[0.0; 6]; 6],
            },
        };
        self.writer.write(&self.odom, time, &odom)?;
        let command = TwistStamped {
            header: Header::new(time, BASE),
            twist: twist(&sample.command),
        };
        self.writer.write(&self.cmd_vel, time, &command)
    }

    /// Adds the outcome and completes the file; returns its path.
    ///
    /// # Errors
    /// As [`LogWriter::finish`].
    pub fn finish(mut self, outcome: &Outcome) -> Result<PathBuf, LogError> {
        let table: BTreeMap<String, String> = match serde_json::to_value(outcome) {
            Ok(serde_json::Value::Object(fields)) => {
                fields.into_iter().map(|(k, v)| (k, v.to_string())).collect()
            }
            _ => BTreeMap::new(),
        };
        self.writer.metadata("outcome", table)?;
        self.writer.finish()
    }

    fn vehicle_state(&self, sample: &ControlSample, seen: &Observation) -> VehicleState {
        let wheels = self
            .scenario
            .vehicle()
            .wheel
            .iter()
            .zip(sample.wheels.iter().zip(&seen.wheels));
        VehicleState {
            header: Header::new(seen.time_ns, BASE),
            policy: self.scenario.control.policy.clone(),
            common_factor: sample.common_factor,
            estimated_twist: twist(&sample.estimated),
            wheels: wheels
                .map(|(spec, (s, o))| WheelState {
                    name: spec.name.clone(),
                    reference_rad_s: s.reference_rad_s,
                    measured_rad_s: s.measured_rad_s,
                    p_n_m: s.p_n_m,
                    i_n_m: s.i_n_m,
                    d_n_m: s.d_n_m,
                    requested_n_m: s.requested_n_m,
                    applied_n_m: s.applied_n_m,
                    limit_lower_n_m: s.limit_lower_n_m,
                    limit_upper_n_m: s.limit_upper_n_m,
                    saturated: s.saturated,
                    slip_ratio: o.slip_ratio(),
                    disturbed_ratio: s.disturbed_ratio(),
                    contact_normal_n: o.force_normal_n,
                    contact_along_n: o.force_along_n,
                })
                .collect(),
        }
    }

    /// World to base, parent to child of every hinge, carrier to every wheel.
    fn transforms(&self, seen: &Observation) -> TfMessage {
        let vehicle = self.scenario.vehicle();
        let frame = |name: &str| {
            if name == vehicle.body[0].name {
                BASE.to_owned()
            } else {
                name.to_owned()
            }
        };
        let link = |parent: String, child: String, at: [f64; 3], turn: Quaternion| TransformStamped {
            header: Header::new(seen.time_ns, parent),
            child_frame_id: child,
            transform: Transform {
                translation: vector(at),
                rotation: turn,
            },
        };
        let mut transforms = vec![link(
            WORLD.into(),
            BASE.into(),
            seen.pose.position_m,
            quaternion(seen.pose.rotation_xyzw),
        )];
        for (hinge, o) in vehicle.hinge.iter().zip(&seen.hinges) {
            // Every body's frame is the vehicle's frame on flat ground: turn about the anchor, not about the origin.
            let turn = about(hinge.axis, o.angle_rad);
            let moved = rotate(turn, hinge.anchor_m);
            let at = [0, 1, 2].map(|k| hinge.anchor_m[k] - moved[k]);
            transforms.push(link(
                frame(&hinge.parent),
                frame(&hinge.child),
                at,
                quaternion(turn),
            ));
        }
        for (wheel, angle) in vehicle.wheel.iter().zip(&self.wheel_angles) {
            let [x, y] = wheel.position_m;
            let [dx, dy] = wheel.rolling_direction;
            let turn = quaternion(about([-dy, dx, 0.0], angle * wheel.gear));
            transforms.push(link(
                frame(&wheel.body),
                format!("wheel_{}", wheel.name),
                [x, y, wheel.radius_m],
                turn,
            ));
        }
        TfMessage { transforms }
    }

    fn joints(&self, sample: &ControlSample, seen: &Observation) -> JointState {
        let vehicle = self.scenario.vehicle();
        let mut joints = JointState {
            header: Header::new(seen.time_ns, BASE),
            ..JointState::default()
        };
        let mut add = |name: String, position: f64, velocity: f64, effort: f64| {
            joints.name.push(name);
            joints.position.push(position);
            joints.velocity.push(velocity);
            joints.effort.push(effort);
        };
        for (hinge, o) in vehicle.hinge.iter().zip(&seen.hinges) {
            add(
                hinge.name.clone(),
                o.angle_rad,
                o.rate_rad_s,
                -hinge.damping_n_m_s_rad * o.rate_rad_s,
            );
        }
        for ((wheel, s), angle) in vehicle.wheel.iter().zip(&sample.wheels).zip(&self.wheel_angles) {
            add(
                format!("wheel_{}", wheel.name),
                angle * wheel.gear,
                s.measured_rad_s * wheel.gear,
                s.applied_n_m / wheel.gear,
            );
        }
        joints
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn quaternion([x, y, z, w]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

fn twist(t: &BodyTwist<f64>) -> Twist {
    Twist {
        linear: vector([t.vx_m_s, t.vy_m_s, 0.0]),
        angular: vector([0.0, 0.0, t.wz_rad_s]),
    }
}

/// Quaternion x, y, z, w of a turn by `angle` about `axis` (any length but zero).
fn about(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let (sin, cos) = (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
    [
        sin * axis[0] / length,
        sin * axis[1] / length,
        sin * axis[2] / length,
        cos,
    ]
}

/// A vector turned by a unit quaternion: v + 2 u x (u x v + w v).
fn rotate([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let u = [x, y, z];
    let inner = cross(u, v);
    let outer = cross(u, [0, 1, 2].map(|k| inner[k] + w * v[k]));
    [0, 1, 2].map(|k| v[k] + 2.0 * outer[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use crate::config::{Override, Source};

    #[test]
    fn a_turn_about_an_axis_follows_the_right_hand_rule() {
        let nose_down = rotate(about([0.0, 2.0, 0.0], 0.1), [1.0, 0.0, 0.0]);
        let expected = [0.1_f64.cos(), 0.0, -(0.1_f64.sin())];
        for (got, expected) in nose_down.iter().zip(expected) {
            assert!((got - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn transforms_put_every_wheel_where_the_simulation_has_it_while_the_front_row_climbs() {
        let scenario = Scenario::load("step", &[]).expect("built-in");
        let mut simulation = Simulation::new(&scenario).expect("valid");
        for _ in 0..1600 {
            let command = scenario.command.at(simulation.time_ns() as f64 * 1e-9);
            simulation.step(&command).expect("finite");
        }
        let seen = simulation.observation();
        assert!(
            seen.hinges[0].angle_rad.abs() > 0.1,
            "the front row is on its way up: {:?}",
            seen.hinges
        );
        let folder = tempfile::tempdir().expect("a folder");
        let log = RunLog::create(folder.path().join("x.mcap"), &scenario).expect("writable");
        let tf = log.transforms(seen);
        let place = |frame: &str| {
            let (mut at, mut frame) = ([0.0; 3], frame.to_owned());
            while frame != WORLD {
                let link = tf
                    .transforms
                    .iter()
                    .find(|t| t.child_frame_id == frame)
                    .expect("a parent for every frame");
                let (t, q) = (&link.transform.translation, &link.transform.rotation);
                let turned = rotate([q.x, q.y, q.z, q.w], at);
                at = [turned[0] + t.x, turned[1] + t.y, turned[2] + t.z];
                frame.clone_from(&link.header.frame_id);
            }
            at
        };
        for (wheel, o) in scenario.vehicle().wheel.iter().zip(&seen.wheels) {
            for (got, expected) in place(&format!("wheel_{}", wheel.name)).iter().zip(o.centre_m) {
                // Hinges are springs of a solver: their anchors part by some micrometres under an impact.
                assert!(
                    (got - expected).abs() < 1e-4,
                    "wheel {}: {got} {expected}",
                    wheel.name
                );
            }
        }
    }

    #[test]
    fn a_logged_scenario_reads_back_as_it_was_with_its_overrides() {
        let stronger = Override::new("vehicle.motor.stall_torque_n_m", 2.5);
        let scenario = Scenario::load("step", &[stronger]).expect("built-in");
        assert_eq!(scenario.vehicle().motor.stall_torque_n_m, 2.5);
        let text = toml::to_string(&scenario).expect("plain data");
        assert_eq!(
            Scenario::from_source(&Source::text("log", text), &[]).expect("valid"),
            scenario
        );
    }
}
