//! A run as ROS 2 messages.
//!
//! | topic | type | rate unless the scenario's `[log]` says otherwise |
//! |---|---|---|
//! | `/vehicle_state` | `omnistep_msgs/msg/VehicleState` | every control period |
//! | `/sensors` | `omnistep_msgs/msg/Sensors` | as `/vehicle_state`: the controller's input |
//! | `/controller_signals` | `omnistep_msgs/msg/ControllerSignals` | as `/vehicle_state`; only of a controller with signals of its own |
//! | `/tf` | `tf2_msgs/msg/TFMessage` | 50 Hz |
//! | `/joint_states` | `sensor_msgs/msg/JointState` | 50 Hz |
//! | `/odom` | `nav_msgs/msg/Odometry` | 50 Hz: odometry, with its covariance |
//! | `/ground_truth/odom` | `nav_msgs/msg/Odometry` | as `/odom`: the true pose and twist |
//! | `/cmd_vel` | `geometry_msgs/msg/TwistStamped` | 50 Hz |
//! | `/markers` | `visualization_msgs/msg/MarkerArray` | 50 Hz: an arrow a wheel for the ground's force, 1 m for 200 N; at once: an arrow for an edge that odometry in three dimensions found, as high as the edge |
//! | `/robot_description`, `/terrain/robot_description` | `std_msgs/msg/String` | once: URDF of vehicle and ground |

use omni_config::Scenario;
use omni_core::estimate::{EdgeEvent, EdgeKind};
use omni_sim::controller::{AnyController, ControlSample};
use omni_sim::observation::Observation;
use omni_sim::{GroundReport, Period, ReportColumns, WheelSignal};

use crate::base_pose;
use crate::message_rates::Rates;
use crate::ros2::{
    ColorRgba, ControllerSignals, Header, JointState, Marker, MarkerArray, RosMessage, Sensors,
    StringMessage, TfMessage, TwistStamped, VehicleState, WheelState,
};
use crate::topic;
use crate::tree::{Placement, Roots, transforms};
use crate::twist_covariance::TwistCovariance;
use crate::urdf::{
    BASE_LINK, JointInterface, ODOM_LINK, WORLD_LINK, ground_urdf, ros2_control_urdf, vehicle_urdf,
    wheel_link,
};

/// Length of the arrow of a force \[m/N\].
const ARROW_M_PER_N: f64 = 0.005;

/// Destination of messages.
pub(crate) trait Sink {
    /// Why one could not go there.
    type Error;

    /// Takes a message of `time_ns` \[ns\] of simulated time.
    fn send<M: RosMessage>(
        &mut self,
        topic: &'static str,
        time_ns: u64,
        message: &M,
    ) -> Result<(), Self::Error>;
}

/// Makes the messages of a scenario's run while it goes on.
pub(crate) struct Messages {
    scenario: Scenario,
    policy: String,
    /// The controller's report.
    report: ReportColumns,
    period_s: f64,
    wheel_angles: Vec<f64>,
    rates: Rates,
    roots: Roots,
    /// Hinges and wheels are among the frames.
    joint_frames: bool,
    twist_covariance: TwistCovariance,
    /// Edges shown.
    edges: i32,
}

impl Messages {
    pub(crate) fn new(scenario: &Scenario, controller: &AnyController) -> Self {
        let control_period_ns = scenario.control.period_us * 1000;
        let rates = Rates::of_log(&scenario.log, control_period_ns);
        Self::at_rates(scenario, controller, rates, Roots::World)
    }

    /// The same messages at other rates, with another frame at the top.
    pub(crate) fn at_rates(
        scenario: &Scenario,
        controller: &AnyController,
        rates: Rates,
        roots: Roots,
    ) -> Self {
        // A twist is sent once per control period at most; without messages any time will do.
        let between_s = rates.odom.period_s().unwrap_or_default();
        let between_s = between_s.max(scenario.period_s());
        Self {
            twist_covariance: TwistCovariance::new(scenario, between_s),
            wheel_angles: vec![0.0; scenario.vehicle().wheel.len()],
            period_s: scenario.period_s(),
            rates,
            roots,
            joint_frames: true,
            edges: 0,
            policy: controller.policy().into(),
            report: controller.columns().clone(),
            scenario: scenario.clone(),
        }
    }

    /// The same without the frames of hinges and wheels, which another node makes of `/joint_states`.
    #[cfg(feature = "ros2")]
    pub(crate) fn without_joint_frames(mut self) -> Self {
        self.joint_frames = false;
        self
    }

    /// The scenario as it is now.
    pub(crate) fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Switches to another scenario of the same vehicle: another policy or torque limit.
    #[cfg(feature = "live")]
    pub(crate) fn set_scenario(&mut self, scenario: &Scenario) {
        self.policy = scenario.control.law();
        self.scenario = scenario.clone();
    }

    /// Messages that are sent once, at the start; with the block of ros2_control, if it drives the wheels.
    pub(crate) fn describe<S: Sink>(
        &self,
        driven: Option<JointInterface>,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        let text = |data| StringMessage { data };
        let vehicle = self.scenario.vehicle();
        let vehicle = match driven {
            None => vehicle_urdf(vehicle),
            Some(interface) => ros2_control_urdf(vehicle, interface),
        };
        sink.send(topic::ROBOT_DESCRIPTION, 0, &text(vehicle))?;
        sink.send(topic::TERRAIN, 0, &text(ground_urdf(&self.scenario)))
    }

    /// The messages of a control period that are due.
    pub(crate) fn push<S: Sink>(&mut self, period: &Period, sink: &mut S) -> Result<(), S::Error> {
        let (sample, seen) = (&period.control, &period.observed);
        self.turn_wheels(sample);
        let time = seen.time_ns;
        if self.rates.vehicle_state.due(time) {
            sink.send(topic::VEHICLE_STATE, time, &self.vehicle_state(sample, seen))?;
            sink.send(topic::SENSORS, time, &Sensors::new(time, &period.sensed))?;
            if !self.report.names().is_empty() {
                sink.send(
                    topic::CONTROLLER_SIGNALS,
                    time,
                    &self.controller_signals(sample, time),
                )?;
            }
        }
        if self.rates.tf.due(time) {
            sink.send(topic::TF, time, &self.transforms(period))?;
        }
        if self.rates.joint_states.due(time) {
            sink.send(topic::JOINT_STATES, time, &self.joints(sample, seen))?;
        }
        if self.rates.odom.due(time) {
            sink.send(
                topic::ODOM,
                time,
                &base_pose::odometry(period, self.twist_covariance.of(period)),
            )?;
            sink.send(topic::GROUND_TRUTH, time, &base_pose::ground_truth(seen))?;
        }
        if self.rates.cmd_vel.due(time) {
            let command = TwistStamped {
                header: Header::new(time, BASE_LINK),
                twist: sample.command.into(),
            };
            sink.send(topic::CMD_VEL, time, &command)?;
        }
        let mut markers = Vec::new();
        if self.rates.markers.period_s().is_some() {
            let edges = period.control.report.ground.iter().flat_map(GroundReport::edges);
            let edges = edges.filter(|edge| edge.kind != EdgeKind::Met);
            markers.extend(edges.filter_map(|edge| self.edge(period, edge)));
        }
        if self.rates.markers.due(time) {
            markers.extend(forces(seen));
        }
        if !markers.is_empty() {
            sink.send(topic::MARKERS, time, &MarkerArray { markers })?;
        }
        Ok(())
    }

    /// An arrow from the ground before an edge to that beyond it, up or down; none if neither is known.
    fn edge(&mut self, period: &Period, edge: &EdgeEvent<f64>) -> Option<Marker> {
        let ground = period.control.report.ground.as_ref()?;
        let beyond_m = ground.wheels.get(edge.wheel)?.z_m;
        let [x, y] = edge.place_m;
        let ends = [beyond_m - edge.height_m, beyond_m].map(|z| [x, y, z]);
        self.edges = self.edges.wrapping_add(1);
        let is_known = ends.iter().flatten().all(|each| each.is_finite());
        is_known.then(|| Marker {
            header: Header::new(period.observed.time_ns, ODOM_LINK),
            ns: "edges".into(),
            id: self.edges,
            kind: Marker::ARROW,
            action: Marker::ADD,
            scale: [0.01, 0.02, 0.01].into(),
            color: ColorRgba {
                r: 0.9,
                g: 0.4,
                b: 0.1,
                a: 1.0,
            },
            points: ends.map(Into::into).into(),
            ..Marker::default()
        })
    }

    /// Integrates the measured velocities over a control period; part of [`Messages::push`]. A
    /// stuck encoder stops its wheel in `/tf`.
    pub(crate) fn turn_wheels(&mut self, sample: &ControlSample) {
        for (angle, wheel) in self.wheel_angles.iter_mut().zip(&sample.wheels) {
            // A wheel without a measurement is shown where it was: NaN would stay.
            if wheel.measured_rad_s.is_finite() {
                *angle += wheel.measured_rad_s * self.period_s;
            }
        }
    }

    fn controller_signals(&self, sample: &ControlSample, time_ns: u64) -> ControllerSignals {
        ControllerSignals {
            header: Header::new(time_ns, ""),
            name: self.report.names().to_vec(),
            value: self.report.values(&sample.report),
        }
    }

    fn vehicle_state(&self, sample: &ControlSample, seen: &Observation) -> VehicleState {
        let wheels = self
            .scenario
            .vehicle()
            .wheel
            .iter()
            .zip(sample.wheels.iter().zip(&seen.wheels));
        VehicleState {
            header: Header::new(seen.time_ns, BASE_LINK),
            policy: self.policy.clone(),
            asked_twist: sample.asked.into(),
            common_factor: sample.common_factor,
            estimated_twist: sample.estimated.into(),
            wheels: wheels
                .map(|(spec, (signals, wheel))| WheelState {
                    name: spec.name.clone(),
                    signals: WheelSignal::logged().map(|signal| signal.value(signals, wheel)),
                })
                .collect(),
        }
    }

    /// The frames that observation, odometry and wheels amount to.
    pub(crate) fn transforms(&self, period: &Period) -> TfMessage {
        let (seen, ground) = (&period.observed, period.control.report.ground.as_ref());
        let (hinges, wheels) = if self.joint_frames {
            (&seen.hinges[..], &self.wheel_angles[..])
        } else {
            (&[][..], &[][..])
        };
        let placement = Placement {
            base: (seen.pose.position_m, seen.pose.rotation_xyzw),
            odometry: base_pose::by_odometry(seen, ground),
            hinges_rad: &mut hinges.iter().map(|hinge| hinge.angle_rad),
            wheels_rad: wheels,
        };
        transforms(self.scenario.vehicle(), seen.time_ns, self.roots, placement)
    }

    fn joints(&self, sample: &ControlSample, seen: &Observation) -> JointState {
        let vehicle = self.scenario.vehicle();
        let mut joints = JointState {
            header: Header::new(seen.time_ns, BASE_LINK),
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
        let wheels = sample.wheels.iter().zip(&seen.wheels).zip(&self.wheel_angles);
        for (wheel, ((s, o), angle)) in vehicle.wheel.iter().zip(wheels) {
            add(
                wheel_link(&wheel.name),
                angle * wheel.gear,
                s.measured_rad_s * wheel.gear,
                o.torque_n_m / wheel.gear,
            );
        }
        joints
    }
}

/// An arrow from each wheel's point of contact along the total force; none in the air.
fn forces(seen: &Observation) -> impl Iterator<Item = Marker> + '_ {
    let arrow = |(id, wheel): (usize, &omni_sim::observation::WheelObservation)| {
        let [from, force] = [wheel.contact_m, wheel.force_n];
        let end = [0, 1, 2].map(|k| from[k] + ARROW_M_PER_N * force[k]);
        Marker {
            header: Header::new(seen.time_ns, WORLD_LINK),
            ns: "ground_force".into(),
            id: id as i32, // a vehicle has at most eight wheels
            kind: Marker::ARROW,
            action: if wheel.touches() {
                Marker::ADD
            } else {
                Marker::DELETE
            },
            scale: [0.01, 0.02, 0.03].into(),
            color: ColorRgba {
                r: 0.1,
                g: 0.6,
                b: 0.9,
                a: 1.0,
            },
            points: vec![from.into(), end.into()],
            ..Marker::default()
        }
    };
    seen.wheels.iter().enumerate().map(arrow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::rotate;
    use omni_sim::Simulation;

    #[test]
    fn transforms_place_every_wheel_as_the_simulation_while_the_front_row_climbs() {
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
        let tf = Messages::new(&scenario, simulation.controller()).transforms(simulation.period());
        let place = |frame: &str| {
            let (mut at, mut frame) = ([0.0; 3], frame.to_owned());
            while frame != WORLD_LINK {
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

    #[cfg(feature = "ros2")]
    #[test]
    fn frames_without_joints_are_the_base_and_what_is_above_it_bit_for_bit() {
        let scenario = Scenario::load("step", &[]).expect("built-in");
        let mut simulation = Simulation::new(&scenario).expect("valid");
        for _ in 0..200 {
            simulation.step(&simulation.scenario_command()).expect("finite");
        }
        for (roots, expected) in [
            (Roots::Odometry, &[("odom", "base_link"), ("odom", "world")][..]),
            (
                Roots::Map,
                &[("odom", "base_link"), ("odom", "world"), ("map", "odom")],
            ),
        ] {
            let rates = Rates::of_log(&scenario.log, 1_000_000);
            let all = Messages::at_rates(&scenario, simulation.controller(), rates, roots);
            let sent = |messages: &Messages| messages.transforms(simulation.period()).transforms;
            let whole = sent(&all);
            let alone = sent(&all.without_joint_frames());
            let names: Vec<_> = alone
                .iter()
                .map(|one| (one.header.frame_id.as_str(), one.child_frame_id.as_str()))
                .collect();
            assert_eq!(names, expected);
            let vehicle = scenario.vehicle();
            assert_eq!(
                whole.len(),
                alone.len() + vehicle.hinge.len() + vehicle.wheel.len()
            );
            assert_eq!(whole[..alone.len()], alone);
        }
    }
}
