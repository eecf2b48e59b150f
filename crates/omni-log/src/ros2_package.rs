//! The ROS 2 package that defines the messages of this project, for programs on the ROS side that read them.

use std::collections::{BTreeMap, BTreeSet};

use crate::ros2::{ControllerSignals, RosMessage, Sensors, VehicleState};

/// Name of the package.
const PACKAGE: &str = "omnistep_msgs";
/// Between two definitions of a log; the second type's full name follows.
const NEXT: &str = "================================================================================\nMSG: ";

/// The files of the ROS 2 package `omnistep_msgs`: paths within its folder, and texts. The
/// messages are the definitions that are in every log, split into one file per type.
///
/// ```
/// let files = omni_log::ros2_messages();
/// let paths: Vec<_> = files.iter().map(|(path, _)| path.as_str()).collect();
/// assert_eq!(paths[..3], ["CMakeLists.txt", "package.xml", "msg/ControllerSignals.msg"]);
/// assert!(files[0].1.contains("rosidl_generate_interfaces"));
/// ```
#[must_use]
pub fn ros2_messages() -> Vec<(String, String)> {
    let own = definitions();
    let packages = packages(&own);
    let mut files = vec![
        ("CMakeLists.txt".to_owned(), cmake(&own, &packages)),
        ("package.xml".to_owned(), manifest(&packages)),
    ];
    let messages = own.into_iter();
    files.extend(messages.map(|(name, text)| (format!("msg/{name}.msg"), text.to_owned())));
    files
}

/// The definitions of this project's types by their names.
fn definitions() -> BTreeMap<&'static str, &'static str> {
    let schemas = [
        (VehicleState::TYPE, VehicleState::schema()),
        (Sensors::TYPE, Sensors::schema()),
        (ControllerSignals::TYPE, ControllerSignals::schema()),
    ];
    let mut own = BTreeMap::new();
    for (full, schema) in schemas {
        // In a log the types that a message contains are behind it.
        let mut parts = schema.split(NEXT);
        let first = parts.next().map(|text| (full, text));
        let named = first
            .into_iter()
            .chain(parts.filter_map(|part| part.split_once('\n')));
        for (full, text) in named {
            if let (Some(PACKAGE), Some(name)) = (full.split('/').next(), full.rsplit('/').next()) {
                own.insert(name, text);
            }
        }
    }
    own
}

/// Packages of the other types in the definitions.
fn packages(own: &BTreeMap<&str, &str>) -> BTreeSet<String> {
    let types = own
        .values()
        .flat_map(|text| text.lines())
        .filter_map(|line| line.split_whitespace().next());
    let packages = types.filter(|word| !word.starts_with('#'));
    let packages = packages.filter_map(|word| word.split_once('/'));
    packages
        .map(|(package, _)| package.to_owned())
        .filter(|package| package != PACKAGE)
        .collect()
}

fn cmake(own: &BTreeMap<&str, &str>, packages: &BTreeSet<String>) -> String {
    let found: String = packages
        .iter()
        .map(|package| format!("find_package({package} REQUIRED)\n"))
        .collect();
    let messages: String = own.keys().map(|name| format!("  \"msg/{name}.msg\"\n")).collect();
    let names: Vec<_> = packages.iter().map(String::as_str).collect();
    format!(
        "# Written by omnistep export, which replaces this file.
cmake_minimum_required(VERSION 3.8)
project({PACKAGE})

find_package(ament_cmake REQUIRED)
{found}find_package(rosidl_default_generators REQUIRED)

rosidl_generate_interfaces(${{PROJECT_NAME}}
{messages}  DEPENDENCIES {}
)

ament_export_dependencies(rosidl_default_runtime)
ament_package()
",
        names.join(" ")
    )
}

/// Format 3 requires a maintainer with an address. There is none, so it is of the reserved domain `invalid`.
fn manifest(packages: &BTreeSet<String>) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let depends: String = packages
        .iter()
        .map(|package| format!("  <depend>{package}</depend>\n"))
        .collect();
    format!(
        "<?xml version=\"1.0\"?>
<!-- Written by omnistep export, which replaces this file. -->
<package format=\"3\">
  <name>{PACKAGE}</name>
  <version>{version}</version>
  <description>Messages of omnistep: its controller's input, signals and output.</description>
  <maintainer email=\"none@omnistep.invalid\">The omnistep authors</maintainer>
  <license>MIT</license>
  <license>Apache-2.0</license>
  <url type=\"repository\">https://github.com/omnistep/omnistep</url>

  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_definition_of_its_type_from_the_first_line_to_the_last() {
        let own = definitions();
        let names: Vec<_> = own.keys().copied().collect();
        assert_eq!(
            names,
            ["ControllerSignals", "Sensors", "VehicleState", "WheelState"]
        );
        for (full, schema) in [
            (VehicleState::TYPE, VehicleState::schema()),
            (Sensors::TYPE, Sensors::schema()),
            (ControllerSignals::TYPE, ControllerSignals::schema()),
        ] {
            let text = own[full.rsplit_once('/').expect("a name").1];
            let behind = schema.strip_prefix(text).expect("its first lines");
            assert!(behind.starts_with(NEXT), "{full}: {behind}");
        }
        // Of the last definition of its log nothing is behind it.
        assert!(VehicleState::schema().ends_with(&format!("WheelState\n{}", own["WheelState"])));
    }

    #[test]
    fn the_package_depends_on_what_its_messages_contain() {
        let packages = packages(&definitions());
        assert_eq!(
            packages.iter().map(String::as_str).collect::<Vec<_>>(),
            ["geometry_msgs", "std_msgs"]
        );
    }
}
