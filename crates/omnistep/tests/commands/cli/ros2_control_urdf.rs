//! A vehicle as URDF with ros2_control's block.

use std::collections::BTreeMap;

use super::{omnistep, stdout, words};

/// The text of each `<param>` under an element, by name.
fn parameters(block: &str) -> BTreeMap<&str, &str> {
    let parts = block.split("<param name=\"").skip(1);
    parts
        .map(|part| {
            let (name, rest) = part.split_once("\">").unwrap();
            (name, rest.split_once("</param>").unwrap().0)
        })
        .collect()
}

#[test]
fn the_block_has_one_joint_per_wheel_with_its_limits() {
    let folder = tempfile::tempdir().unwrap();
    for (vehicle, command, wheels) in [("mecanum4", "velocity", 4), ("rocker_bogie6", "effort", 6)] {
        let plain = stdout(&omnistep(folder.path(), &["export", vehicle, "--format", "urdf"]));
        let text = stdout(&omnistep(
            folder.path(),
            &["export", vehicle, "--format", "urdf", "--ros2-control", command],
        ));
        let (before, block) = text.split_once("  <ros2_control ").unwrap();
        assert_eq!(format!("{before}</robot>\n"), plain);
        // Readers of URDF pass over the block.
        assert_eq!(
            urdf_rs::read_from_string(&text).unwrap().joints.len(),
            urdf_rs::read_from_string(&plain).unwrap().joints.len()
        );
        assert!(block.starts_with("name=\"omnistep_wheels\" type=\"system\">"));
        let (hardware, joints) = block.split_once("</hardware>").unwrap();
        assert!(
            hardware.contains("<plugin>joint_state_topic_hardware_interface/JointStateTopicSystem</plugin>")
        );
        let expected = BTreeMap::from([
            ("joint_commands_topic", "joint_commands"),
            ("joint_states_topic", "joint_states"),
            ("trigger_joint_command_threshold", "-1"),
        ]);
        assert_eq!(parameters(hardware), expected);

        let robot = urdf_rs::read_from_string(&plain).unwrap();
        let of_wheels = robot.joints.iter().filter(|j| j.name.starts_with("wheel_"));
        let of_wheels: BTreeMap<_, _> = of_wheels.map(|j| (j.name.as_str(), &j.limit)).collect();
        // Only wheels: a command of the component names every joint of the block, with a value only
        // for those with commands.
        let joints = joints.split("<joint name=\"").skip(1);
        let joints: BTreeMap<_, _> = joints.filter_map(|joint| joint.split_once('"')).collect();
        assert!(joints.keys().eq(of_wheels.keys()) && joints.len() == wheels);
        for (name, joint) in joints {
            let count = |what: &str| joint.matches(what).count();
            for state in ["position", "velocity", "effort"] {
                assert_eq!(count(&format!("<state_interface name=\"{state}\">")), 1, "{name}");
            }
            assert_eq!(count("<param name=\"initial_value\">0.0</param>"), 3);
            assert_eq!(
                (
                    count("<command_interface "),
                    count(&format!("<command_interface name=\"{command}\">"))
                ),
                (1, 1)
            );
            let limit = of_wheels[name];
            let most = match command {
                "effort" => limit.effort,
                _ => limit.velocity,
            };
            let given = parameters(joint);
            let [min, max] = ["min", "max"].map(|key| given[key].parse::<f64>().unwrap());
            assert_eq!([min, max], [-most, most], "{name}");
        }
    }
    // Another word is refused.
    let said = omnistep(
        folder.path(),
        &words("export mecanum4 --format urdf --ros2-control position"),
    );
    let said_text = String::from_utf8(said.stderr).unwrap();
    assert_eq!(said.status.code(), Some(2));
    assert!(
        said_text.contains("[possible values: velocity, effort]"),
        "{said_text}"
    );
}
