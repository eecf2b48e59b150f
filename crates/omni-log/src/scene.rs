//! The data of a picture of a run as JSON, for the page of a live run, the playground and a report of logs.

use omni_config::{POLICIES, Scenario, WheelSpec};
use omni_sim::Simulation;
use omni_sim::controller::{AnyController, ControlSample};
use omni_sim::ground::{Shape, shapes};
use serde::Serialize;

use crate::frames::placed;
use crate::ground_around::ground_around;
use crate::messages::Messages;
use crate::ros2::TransformStamped;
use crate::urdf::{BASE_LINK, ODOM_LINK, link_frame_m, link_name, wheel_link};

/// How far the ground reaches that is shown \[m\]: beyond what anybody drives in a run.
const FAR_M: f64 = 1e3;
/// Largest number of shown corners of a height field, along each side.
const MOST_CORNERS: usize = 200;
/// Speed that keys ask for where the scenario asks for less than a tenth of it \[m/s\]: a slow walk.
const WALK_M_S: f64 = 0.3;

/// Shows a run to a page that draws it: the JSON that the page of a live run gets, for other pages.
///
/// ```
/// use omni_log::View;
/// use omni_sim::{Simulation, config::Scenario, controller::AnyController};
/// let scenario = Scenario::load("flat", &[])?;
/// let controller = AnyController::new(&scenario)?;
/// let mut view = View::new(&scenario, &controller);
/// let mut simulation = Simulation::with_controller(&scenario, controller)?;
/// simulation.step(&simulation.scenario_command())?;
/// view.push(simulation.sample());
/// assert!(view.scene().starts_with(r#"{"program":"omnistep "#) && view.state(&simulation).starts_with(r#"{"time_s":0.001,"#));
/// # Ok::<(), omni_sim::Error>(())
/// ```
pub struct View {
    messages: Messages,
}

impl View {
    /// Of a scenario's run with a controller that was made for it.
    #[must_use]
    pub fn new(scenario: &Scenario, controller: &AnyController) -> Self {
        Self {
            messages: Messages::new(scenario, controller),
        }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> String {
        json(&scene(self.messages.scenario()))
    }

    /// Adds one control period: wheels turn.
    pub fn push(&mut self, sample: &ControlSample) {
        self.messages.turn_wheels(sample);
    }

    /// The state after the last period.
    #[must_use]
    pub fn state(&self, simulation: &Simulation) -> String {
        json(&state(&self.messages, simulation))
    }
}

/// Plain numbers and texts; a number that is none becomes null.
pub(crate) fn json(what: &impl Serialize) -> String {
    serde_json::to_string(what).unwrap_or_default()
}

/// What keys ask for: forwards and to the left \[m/s\] as fast as the scenario drives, or 0.3 m/s
/// where it hardly does, and to the left \[rad/s\] so that the outermost wheel is as fast.
///
/// ```
/// use omni_config::Scenario;
/// let [ahead, left, turning] = omni_log::driving_pace(&Scenario::load("flat", &[])?);
/// assert_eq!([ahead, left], [0.3, 0.3]);
/// assert!((turning * 0.30_f64.hypot(0.23) - 0.3).abs() < 1e-12); // where its corner wheels are
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn driving_pace(scenario: &Scenario) -> [f64; 3] {
    let asked_m_s = scenario.command.fastest_m_s();
    let speed_m_s = if asked_m_s < WALK_M_S / 10.0 {
        WALK_M_S
    } else {
        asked_m_s
    };
    let wheels = &scenario.vehicle().wheel;
    let reach_m = wheels
        .iter()
        .map(|wheel| libm::hypot(wheel.position_m[0], wheel.position_m[1]));
    let reach_m = reach_m.fold(0.0, f64::max).max(0.01);
    [speed_m_s, speed_m_s, speed_m_s / reach_m]
}

/// Shows a logged run: vehicle and ground as the page of a live run has them, but only so much of
/// the ground as is around the run's way, of boxes and bars, as in the log's URDF.
///
/// ```
/// use omni_config::Scenario;
/// let scene: serde_json::Value = serde_json::from_str(&omni_log::logged_scene(&Scenario::load("stairs", &[])?)).expect("JSON");
/// assert_eq!(scene["ground"].as_array().map(Vec::len), Some(1 + 3)); // the floor and three steps
/// assert_eq!(scene["frames"][0], "base_link");
/// # Ok::<(), omni_config::Error>(())
/// ```
#[must_use]
pub fn logged_scene(scenario: &Scenario) -> String {
    json(&Picture::new(scenario, ground_around(scenario)))
}

/// What there is to see, and what a page says and asks for.
#[derive(Serialize)]
pub(crate) struct Scene<'a> {
    program: &'a str,
    scenario: &'a str,
    vehicle: &'a str,
    policies: [&'a str; POLICIES.len()],
    pace: [f64; 3],
    #[serde(flatten)]
    picture: Picture<'a>,
}

/// What there is to see: places \[m\] and turns in frames, which are numbered as the poses of a state.
#[derive(Serialize)]
struct Picture<'a> {
    /// Their names.
    frames: Vec<String>,
    bodies: Vec<Block>,
    wheels: Vec<Disc<'a>>,
    ground: Vec<Part>,
    patches: Vec<Patch>,
}

/// A body: a box.
#[derive(Serialize)]
struct Block {
    frame: usize,
    at_m: [f32; 3],
    edges_m: [f32; 3],
}

/// A wheel: a disc, its axle to the left of the rolling direction, the axes of its rollers out of the axle's direction.
#[derive(Serialize)]
struct Disc<'a> {
    frame: usize,
    name: &'a str,
    radius_m: f64,
    width_m: f64,
    axle: [f64; 3],
    roller_angle_rad: f64,
}

/// A part of the ground; `shapes` says what of it is what.
#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Part {
    Box {
        half_m: [f64; 3],
        at_m: [f64; 3],
        turn_y_rad: f64,
    },
    Bar {
        radius_m: f64,
        half_length_m: f64,
        at_m: [f64; 3],
    },
    Field {
        from_m: f64,
        extent_m: [f64; 2],
        rows: usize,
        columns: usize,
        heights_m: Vec<f32>,
    },
}

/// Ground of another friction.
#[derive(Serialize)]
struct Patch {
    x_m: [f64; 2],
    y_m: [f64; 2],
    friction: f64,
}

pub(crate) fn scene(scenario: &Scenario) -> Scene<'_> {
    Scene {
        program: concat!("omnistep ", env!("CARGO_PKG_VERSION")),
        scenario: &scenario.name,
        vehicle: &scenario.vehicle().name,
        policies: POLICIES,
        pace: driving_pace(scenario),
        picture: Picture::new(scenario, shapes(scenario, FAR_M)),
    }
}

impl<'a> Picture<'a> {
    fn new(scenario: &'a Scenario, ground: Vec<Shape>) -> Self {
        let vehicle = scenario.vehicle();
        // As the frames are sent: base, odometry, what hinges carry, wheels.
        let hinged = vehicle
            .hinge
            .iter()
            .map(|hinge| link_name(vehicle, &hinge.child).to_owned());
        let frames = [BASE_LINK, ODOM_LINK].map(String::from).into_iter();
        let frames = frames
            .chain(hinged)
            .chain(vehicle.wheel.iter().map(|wheel| wheel_link(&wheel.name)));
        let of_body = |name: &str| {
            let hinge = vehicle.hinge.iter().position(|hinge| hinge.child == name);
            hinge.map_or(0, |k| 2 + k)
        };
        let bodies = vehicle.body.iter().map(|body| {
            let origin = link_frame_m(vehicle, &body.name);
            Block {
                frame: of_body(&body.name),
                at_m: [0, 1, 2].map(|k| (body.com_m[k] - origin[k]) as f32),
                edges_m: body.inertia_box_m.map(|edge| edge as f32),
            }
        });
        let wheels = vehicle.wheel.iter().enumerate().map(|(k, wheel)| Disc {
            frame: 2 + vehicle.hinge.len() + k,
            name: &wheel.name,
            radius_m: wheel.radius_m,
            width_m: wheel.width_m(),
            axle: axle(wheel),
            roller_angle_rad: wheel.roller_angle_rad,
        });
        let patches = scenario.friction_patch.iter().map(|patch| Patch {
            x_m: patch.x_m,
            y_m: patch.y_m,
            friction: patch.friction,
        });
        Self {
            frames: frames.collect(),
            bodies: bodies.collect(),
            wheels: wheels.collect(),
            ground: ground.into_iter().map(part).collect(),
            patches: patches.collect(),
        }
    }
}

/// To the left of the rolling direction, which a file gives in any length; 1 long, for the pages draw along it.
fn axle(wheel: &WheelSpec) -> [f64; 3] {
    let [dx, dy] = wheel.rolling_direction;
    let length = libm::hypot(dx, dy);
    [0.0 - dy / length, dx / length, 0.0] // no -0
}

fn part(shape: Shape) -> Part {
    match shape {
        Shape::Box {
            half_m,
            centre_m,
            turn_y_rad,
        } => Part::Box {
            half_m,
            at_m: centre_m,
            turn_y_rad,
        },
        Shape::Bar {
            half_length_m,
            radius_m,
            centre_m,
        } => Part::Bar {
            radius_m,
            half_length_m,
            at_m: centre_m,
        },
        Shape::Field {
            from_m,
            extent_m,
            rows,
            columns,
            heights_m,
        } => {
            // The corners nearest to an even grid, the outer ones among them.
            let (shown_rows, shown_columns) = (rows.min(MOST_CORNERS), columns.min(MOST_CORNERS));
            let nearest =
                |k: usize, shown: usize, all: usize| (k * (all - 1) + (shown - 1) / 2) / (shown - 1).max(1);
            let corners = (0..shown_rows).flat_map(|i| (0..shown_columns).map(move |j| (i, j)));
            let heights = corners.map(|(i, j)| {
                let place = nearest(i, shown_rows, rows) * columns + nearest(j, shown_columns, columns);
                heights_m.get(place).map_or(0.0, |height| *height as f32)
            });
            Part::Field {
                from_m,
                extent_m,
                rows: shown_rows,
                columns: shown_columns,
                heights_m: heights.collect(),
            }
        }
    }
}

/// The state after a control period, with numbers rounded for display.
#[derive(Serialize)]
pub(crate) struct State {
    time_s: f64,
    policy: String,
    /// Present torque limit of the motors \[N.m\].
    stall_torque_n_m: f64,
    /// vx, vy \[m/s\] and wz \[rad/s\]: as asked for, as it is.
    asked: [f32; 3],
    twist: [f32; 3],
    common_factor: f32,
    /// Frames in the world: x, y, z \[m\] and a unit quaternion x, y, z, w.
    poses: Vec<[f32; 7]>,
    wheels: Vec<Wheel>,
}

#[derive(Serialize)]
struct Wheel {
    speed_rad_s: f32,
    reference_rad_s: f32,
    torque_n_m: f32,
    limits_n_m: [f32; 2],
    slip: f32,
    load_n: f32,
    /// The ground's force \[N\] and where it pushes \[m\]; none in the air.
    push: Option<[[f32; 3]; 2]>,
}

pub(crate) fn state(messages: &Messages, simulation: &Simulation) -> State {
    let (sample, seen) = (simulation.sample(), simulation.observation());
    let scenario = messages.scenario();
    let wheels = sample
        .wheels
        .iter()
        .zip(&seen.wheels)
        .map(|(signals, wheel)| Wheel {
            speed_rad_s: signals.measured_rad_s as f32,
            reference_rad_s: signals.reference_rad_s as f32,
            torque_n_m: wheel.torque_n_m as f32,
            limits_n_m: [signals.limit_lower_n_m as f32, signals.limit_upper_n_m as f32],
            slip: wheel.slip_ratio() as f32,
            load_n: wheel.force_normal_n as f32,
            push: wheel
                .touches()
                .then(|| [wheel.force_n, wheel.contact_m].map(|of| of.map(|value| value as f32))),
        });
    State {
        time_s: simulation.time_ns() as f64 * 1e-9,
        policy: scenario.control.policy.clone(),
        stall_torque_n_m: scenario.vehicle().motor.peak_torque_n_m(),
        asked: sample.asked.to_array().map(|value| value as f32),
        twist: seen.twist.to_array().map(|value| value as f32),
        common_factor: sample.common_factor as f32,
        poses: in_the_world(&messages.transforms(simulation.period()).transforms),
        wheels: wheels.collect(),
    }
}

/// Poses of frames, each of which comes behind the one that carries it.
fn in_the_world(links: &[TransformStamped]) -> Vec<[f32; 7]> {
    let mut poses: Vec<[f64; 7]> = Vec::with_capacity(links.len());
    for (k, link) in links.iter().enumerate() {
        let (at, turn) = (&link.transform.translation, &link.transform.rotation);
        let local = [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w];
        let carrier = links[..k]
            .iter()
            .position(|before| before.child_frame_id == link.header.frame_id);
        poses.push(carrier.map_or(local, |carrier| placed(poses[carrier], local)));
    }
    poses
        .into_iter()
        .map(|pose| pose.map(|value| value as f32))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use omni_config::Override;
    use omni_core::BodyTwist;
    use omni_sim::controller::AnyController;

    #[test]
    fn wheels_are_where_the_simulation_has_them_whatever_carries_them() {
        let scenario = Scenario::load("step", &[]).expect("built in");
        let controller = AnyController::new(&scenario).expect("its controller");
        let messages = Messages::new(&scenario, &controller);
        let mut simulation = Simulation::new(&scenario).expect("a simulation");
        // Until the first row has climbed: hinges are bent then.
        for _ in 0..3000 {
            let command = simulation.scenario_command();
            simulation.step(&command).expect("it goes on");
        }
        let bent = simulation
            .observation()
            .hinges
            .iter()
            .map(|hinge| hinge.angle_rad.abs());
        assert!(
            bent.fold(0.0, f64::max) > 0.05,
            "no hinge is bent: nothing is tested"
        );
        let (scene, state) = (scene(&scenario), state(&messages, &simulation));
        for (disc, wheel) in scene.picture.wheels.iter().zip(&simulation.observation().wheels) {
            for k in 0..3 {
                // Singles, and joints of rapier that give a little.
                let off = f64::from(state.poses[disc.frame][k]) - wheel.centre_m[k];
                assert!(off.abs() < 1e-3, "wheel {}: {off} m", disc.name);
            }
        }
    }

    #[test]
    fn frames_are_numbered_as_the_poses_of_a_state() {
        let scenario = Scenario::load("step", &[]).expect("built in");
        let controller = AnyController::new(&scenario).expect("its controller");
        let messages = Messages::new(&scenario, &controller);
        let simulation = Simulation::new(&scenario).expect("a simulation");
        let sent = messages.transforms(simulation.period()).transforms;
        let picture = scene(&scenario).picture;
        assert!(sent.iter().map(|link| &link.child_frame_id).eq(&picture.frames));
        assert_eq!(picture.frames.len(), 2 + 2 + 7);
    }

    #[test]
    fn the_axle_of_a_wheel_at_45_degrees_is_1_long() {
        let vehicle = Override::new("vehicle", "rocker_bogie6");
        let scenario = Scenario::load("flat", &[vehicle]).expect("built in");
        let picture = scene(&scenario).picture;
        // It rolls along [1, -1]: to the left of that is [1, 1].
        let half = std::f64::consts::FRAC_1_SQRT_2;
        for (along, right) in picture.wheels[0].axle.into_iter().zip([half, half, 0.0]) {
            assert!((along - right).abs() < 1e-15, "{:?}", picture.wheels[0].axle);
        }
    }

    #[test]
    fn a_logged_scene_has_the_vehicle_of_the_pages_and_the_ground_of_the_urdf() {
        for name in ["step", "ramp", "bumps", "rough", "height_map", "ice"] {
            let scenario = Scenario::load(name, &[]).expect("built in");
            let [all, own] = [json(&scene(&scenario)), logged_scene(&scenario)]
                .map(|text| serde_json::from_str::<serde_json::Value>(&text).expect("JSON"));
            for key in ["frames", "bodies", "wheels", "patches"] {
                assert_eq!(own[key], all[key], "{name}: {key}");
            }
            let urdf = urdf_rs::read_from_string(&crate::ground_urdf(&scenario)).expect("a URDF");
            let (parts, visuals) = (own["ground"].as_array().expect("a list"), &urdf.links[0].visual);
            assert_eq!(parts.len(), visuals.len(), "{name}");
            for (part, visual) in parts.iter().zip(visuals) {
                assert_eq!(part["at_m"], serde_json::json!(*visual.origin.xyz), "{name}");
                match &visual.geometry {
                    urdf_rs::Geometry::Box { size } => {
                        assert_eq!(part["half_m"], serde_json::json!(size.map(|edge| edge / 2.0)));
                        assert_eq!(part["turn_y_rad"], visual.origin.rpy[1]);
                    }
                    urdf_rs::Geometry::Cylinder { radius, length } => {
                        assert_eq!(part["radius_m"], *radius);
                        assert_eq!(part["half_length_m"], length / 2.0);
                    }
                    other => panic!("{name}: {other:?}"),
                }
            }
        }
    }

    #[test]
    fn what_is_not_a_number_is_null_and_wheels_in_the_air_have_no_push() {
        let scenario = Scenario::load("flat", &[]).expect("built in");
        let controller = AnyController::new(&scenario).expect("its controller");
        let messages = Messages::new(&scenario, &controller);
        let mut simulation = Simulation::new(&scenario).expect("a simulation");
        simulation.step(&BodyTwist::ZERO).expect("it goes on");
        let mut state = state(&messages, &simulation);
        state.wheels[0].slip = f32::NAN;
        state.wheels[0].push = None;
        let json = serde_json::to_value(&state).expect("JSON");
        assert!(json["wheels"][0]["slip"].is_null() && json["wheels"][0]["push"].is_null());
        assert!(
            json["wheels"][1]["push"][0][2]
                .as_f64()
                .is_some_and(|up_n| up_n > 0.0)
        );
    }

    #[test]
    fn keys_are_as_fast_as_the_scenario_and_a_walk_where_it_stands() {
        let at = |vx_m_s: f64| {
            driving_pace(
                &Scenario::load("flat", &[Override::new("command.vx_m_s", vx_m_s)]).expect("a scenario"),
            )
        };
        assert_eq!(
            (at(0.5)[..2].to_vec(), at(0.0)[..2].to_vec()),
            (vec![0.5; 2], vec![0.3; 2])
        );
        // The outermost wheels are at (0.30, 0.23) m.
        assert!((at(0.5)[2] - 0.5 / 0.30_f64.hypot(0.23)).abs() < 1e-12);
    }

    #[test]
    fn a_large_field_of_heights_keeps_its_corners() {
        let (rows, columns) = (1001, 3);
        let heights_m = (0..rows * columns).map(|k| k as f64).collect();
        let extent_m = [10.0, 1.0];
        let from_m = 0.0;
        let Part::Field {
            rows,
            columns,
            heights_m,
            ..
        } = part(Shape::Field {
            from_m,
            extent_m,
            rows,
            columns,
            heights_m,
        })
        else {
            panic!("a field");
        };
        assert_eq!((rows, columns, heights_m.len()), (200, 3, 600));
        assert_eq!(
            [heights_m[0], heights_m[2], heights_m[597], heights_m[599]],
            [0.0, 2.0, 3000.0, 3002.0]
        );
    }
}
