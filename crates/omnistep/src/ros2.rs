//! The settings of `omnistep run --ros2`, from arguments and environment.

use std::env;
use std::path::Path;

use omni_config::{Override, PlannedPath, Scenario};
use omni_core::geometry::PlanarPose;
use omni_log::{GoalPlanner, Live, Ros2, TfFrames};
use omni_plan::{Chart, Goal, Pose};

use crate::Error;
use crate::args::{Ros2Args, TfChoice};
use crate::output::say;
use crate::plan;
use crate::routes::{RouteRequest, driven, planner_from};

/// The run's place on ROS 2.
pub(super) fn ros2(args: Ros2Args) -> Result<Ros2, Error> {
    // What is not Unicode is no number either.
    let domain = env::var_os("ROS_DOMAIN_ID").map(|value| value.to_string_lossy().into_owned());
    let mut ros2 = Ros2::from_domain_id(domain.as_deref())?;
    ros2.namespace = args.namespace;
    ros2.frame_prefix = args.frame_prefix;
    ros2.follow_clock = args.follow_clock;
    ros2.publish_map_frame = args.publish_map_frame;
    ros2.tf = match args.tf {
        TfChoice::All => TfFrames::All,
        TfChoice::Odom => TfFrames::Odom,
        TfChoice::None => TfFrames::None,
    };
    ros2.topic_rates = args
        .topic_rates
        .iter()
        .map(|text| rate(text))
        .collect::<Result<_, _>>()?;
    ros2.joints = args.ros2_control.map(Into::into);
    Ok(ros2)
}

/// The run, which drives to goals by that chart.
pub(super) fn with_goals(mut live: Live, scenario: &Scenario, chart: &Path) -> Result<Live, Error> {
    let (chart, scenario) = (plan::charted(scenario, Some(chart))?, scenario.clone());
    let plan = move |from: &PlanarPose<f64>, to: &PlanarPose<f64>| {
        way(&scenario, &chart, from, to).map_err(|error| error.to_string())
    };
    if let Some(ros2) = &mut live.ros2 {
        ros2.goals = Some(GoalPlanner::new(plan));
    }
    // Where clients say where to go, the scenario does not.
    live.stands = true;
    Ok(live)
}

/// The way from a pose to a goal over the scenario's ground, with times.
fn way(
    scenario: &Scenario,
    chart: &Chart,
    from: &PlanarPose<f64>,
    to: &PlanarPose<f64>,
) -> Result<PlannedPath, Error> {
    let start = Pose::new(from.x_m, from.y_m, from.yaw_rad);
    let request = RouteRequest::new(Goal::pose(to.x_m, to.y_m, to.yaw_rad), chart);
    let route = planner_from(scenario, &start, &request)?
        .plan(&start, &request.goal)
        .map_err(Error::NoRoute)?;
    let here = || Error::Argument {
        name: "goal",
        value: format!("{}, {}", to.x_m, to.y_m),
        allowed: "another place than the vehicle's",
    };
    if route.points.len() < 2 {
        return Err(here());
    }
    // A path knows nothing of the ground, on which no scenario could start anywhere; nor of the scenario's own command.
    let level = [
        Override::new("start.x_m", from.x_m),
        Override::new("start.y_m", from.y_m),
        Override::new("start.heading_rad", from.yaw_rad),
        Override::parse(&format!(
            "terrain={{ kind = \"flat\", friction = {:?} }}",
            scenario.terrain.friction()
        ))?,
        Override::parse("block=[]")?,
        Override::parse("command={}")?,
    ];
    let level = scenario.with(&scenario.name, &level)?;
    let mut path = driven(&route, &level)?.planned_path()?.ok_or_else(here)?;
    // It is driven by the true pose.
    path.rest_s = 0.0;
    Ok(path)
}

fn rate(text: &str) -> Result<(String, f64), Error> {
    let parts = text.split_once('=');
    let parts = parts.and_then(|(topic, rate)| Some((topic.into(), rate.parse().ok()?)));
    parts.ok_or_else(|| Error::Argument {
        name: "--topic-rate",
        value: text.into(),
        allowed: "TOPIC=HZ, such as odom=100",
    })
}

/// Says where the run is, and what in the environment keeps the user's own nodes from finding it.
pub(super) fn announce(domain: u16, live: &Live) {
    let joints = live.ros2.as_ref().and_then(|ros2| ros2.joints);
    let driven = joints.map_or_else(String::new, |interface| {
        format!(", driven by {} on joint_commands", interface.name())
    });
    let follows = live.ros2.as_ref().is_some_and(|ros2| ros2.follow_clock);
    let clock = if follows { ", in step with /clock" } else { "" };
    say(&format!(
        "publishing on ROS 2, domain {domain} (DDS){driven}{clock}; Ctrl-C ends it"
    ));
    for (name, hides) in [
        ("ROS_LOCALHOST_ONLY", &["1"][..]),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", &["LOCALHOST", "OFF"]),
        ("RMW_IMPLEMENTATION", &["rmw_zenoh_cpp"]),
    ] {
        if let Ok(value) = env::var(name)
            && hides.contains(&value.as_str())
        {
            say(&format!(
                "{name}={value}: other nodes with this variable cannot find this one; unset it for them"
            ));
        }
    }
}
