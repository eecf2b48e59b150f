//! The map for `omnistep import`: which columns of a vehicle's own log are which signals.

use omni_config::Vehicle;

use crate::Error;

/// The text of a map for a vehicle that its own file or name stands for. What it names has to be
/// changed to what the log has.
pub(crate) fn text(given: &str) -> Result<String, Error> {
    let vehicle = Vehicle::load(given)?;
    let names = |before: &str, names: &mut dyn Iterator<Item = &String>| {
        let quoted: Vec<_> = names.map(|name| format!("\"{before}{name}\"")).collect();
        quoted.join(", ")
    };
    let wheels = |before: &str| names(before, &mut vehicle.wheel.iter().map(|wheel| &wheel.name));
    let [encoders, currents, torques, duties, references] =
        ["encoder_", "current_", "torque_", "duty_", "reference_"].map(wheels);
    let hinges = match names("hinge_", &mut vehicle.hinge.iter().map(|hinge| &hinge.name)) {
        none if none.is_empty() => String::new(),
        hinges => format!(
            "
# [hinges]                      # angles of the hinges
# names = [{hinges}]
# unit = \"rad\"                  # rad, deg

# [hinge_rates]                 # velocities of the hinges
# names = [{hinges}]
# unit = \"rad/s\"                # rad/s, deg/s
"
        ),
    };
    let quoted = serde_json::Value::from(given); // JSON quotes as TOML does
    Ok(format!(
        "# This map says which column of a table (CSV, Parquet), or with `topic` which topic of a bag, is which signal, in which unit.
# Only [wheels] is required. Remove the # in front of the tables that your log has, and write the names in your log.
schema_version = 1
vehicle = {quoted}
# scenario = \"flat\"             # ground and controller for a simulation of the log
period_s = 0.005                # control period of the new log
# max_gap_s = 0.05              # longer gaps between samples stay unknown; three times their median distance if left out

[time]
column = \"time\"
unit = \"s\"                      # s, ms, us, ns
# from_s = 0.0                  # cut, in seconds after the first sample
# until_s = 60.0

[wheels]                        # encoders, in the order of the wheels in the vehicle file
names = [{encoders}]
unit = \"count\"                  # rad, deg, turn, count; for velocities rad/s, deg/s, rpm, turn/s
counts_per_turn = 4096          # only with count: counts per turn of the side that is counted, all edges
# wrap_bits = 16                # the counter overflows after 2^16 counts
at = \"actuator\"                 # or \"wheel\", behind the gear
# scale = -1.0                  # in any table: a factor, such as -1 for a reversed encoder; or one number for each name
# offset = 0.0                  # in any table: subtracted before scaling

# [torques]                     # measured torques of the actuators
# names = [{currents}]
# unit = \"A\"                    # N.m, A, mA
# n_m_per_a = 0.5               # only with A and mA

# [commanded_torques]           # torques that the controller commanded: omnistep identify needs these, or [duty]
# names = [{torques}]
# unit = \"N.m\"                  # N.m; or A, mA together with n_m_per_a

# [duty]                        # commanded duty cycles of the PWM, -1 to 1
# names = [{duties}]
# unit = \"1\"                    # 1, percent; scale = 0.00392 for a PWM of 255
# zero = \"coast\"                # what the bridges do at 0: coast or brake; omnistep identify tries both if left out

# [references]                  # reference velocities of the robot's own controller
# names = [{references}]
# unit = \"rad/s\"                # rad/s, deg/s, rpm, turn/s

# [command]                     # forward, left [m/s], counter-clockwise
# names = [\"vx\", \"vy\", \"wz\"]
# unit = \"rad\"                  # of the yaw rate, per second: rad, deg
# max_gap_s = inf               # each command holds until the next one

# [gyro]                        # z alone, or x, y, z
# names = [\"gyro_z\"]
# unit = \"rad/s\"                # rad/s, deg/s

# [accelerometer]               # x, y, z
# names = [\"accel_x\", \"accel_y\", \"accel_z\"]
# unit = \"m/s2\"                 # m/s2, g

# [attitude]
# names = [\"roll\", \"pitch\"]
# unit = \"rad\"                  # rad, deg

# [pose]                        # true pose, measured from outside
# names = [\"x\", \"y\", \"heading\"] # m, m
# unit = \"rad\"                  # of the heading: rad, deg

# [odometry]                    # the robot's own odometry; computed from the wheels if left out
# names = [\"odom_x\", \"odom_y\", \"odom_heading\"]
# unit = \"rad\"                  # of the heading: rad, deg
{hinges}"
    ))
}
