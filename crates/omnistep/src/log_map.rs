//! A map for `omnistep import`: which columns of a vehicle's own log are which signals.

use omni_config::Vehicle;

use crate::Error;

/// The text of a map for a vehicle that its own file or name stands for. What it names has to be changed to what the log has.
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
# [hinges]                      # their angles
# names = [{hinges}]
# unit = \"rad\"                  # rad, deg

# [hinge_rates]                 # and velocities
# names = [{hinges}]
# unit = \"rad/s\"                # rad/s, deg/s
"
        ),
    };
    let quoted = serde_json::Value::from(given); // JSON quotes as TOML does
    Ok(format!(
        "# Which columns of a table (CSV, Parquet), or with `topic` which topics of a bag, are which signals, and in what units.
# Only [wheels] has to be there. Without # in front, a table is read; take off what your log has, and write its own names.
schema_version = 1
vehicle = {quoted}
# scenario = \"flat\"             # ground and controller of a simulation of the log
period_s = 0.005                # control period of the log that is made
# max_gap_s = 0.05              # between samples further apart nothing is known; three times their median distance if left out

[time]
column = \"time\"
unit = \"s\"                      # s, ms, us, ns
# from_s = 0.0                  # cut, in seconds after the first sample
# until_s = 60.0

[wheels]                        # encoders, in the order of the vehicle file's wheels
names = [{encoders}]
unit = \"count\"                  # rad, deg, turn, count; of velocities rad/s, deg/s, rpm, turn/s
counts_per_turn = 4096          # with count only: counts a turn of the side that is counted, all edges
# wrap_bits = 16                # the counter begins again after 2^16 counts
at = \"actuator\"                 # or \"wheel\", behind the gear
# scale = -1.0                  # of every table: a factor, as of an encoder that counts the other way; or one number a name
# offset = 0.0                  # of every table: taken off before

# [torques]                     # what acted on the actuators
# names = [{currents}]
# unit = \"A\"                    # N.m, A, mA
# n_m_per_a = 0.5               # with A and mA only

# [commanded_torques]           # what the controller told the actuators: omnistep identify needs these, or [duty]
# names = [{torques}]
# unit = \"N.m\"                  # N.m; or A, mA, and then n_m_per_a too

# [duty]                        # duty cycles of the PWM as commanded, -1 to 1
# names = [{duties}]
# unit = \"1\"                    # 1, percent; scale = 0.00392 of a PWM of 255

# [references]                  # velocities that the robot's controller asked of its wheels
# names = [{references}]
# unit = \"rad/s\"                # rad/s, deg/s, rpm, turn/s

# [command]                     # forward, left [m/s], counter-clockwise
# names = [\"vx\", \"vy\", \"wz\"]
# unit = \"rad\"                  # of the turn: rad, deg
# max_gap_s = inf               # holds until the next one, however late that is

# [gyro]                        # z alone, or x, y, z
# names = [\"gyro_z\"]
# unit = \"rad/s\"                # rad/s, deg/s

# [accelerometer]               # x, y, z
# names = [\"accel_x\", \"accel_y\", \"accel_z\"]
# unit = \"m/s2\"                 # m/s2, g

# [attitude]
# names = [\"roll\", \"pitch\"]
# unit = \"rad\"                  # rad, deg

# [pose]                        # where somebody saw it from outside
# names = [\"x\", \"y\", \"heading\"] # m, m
# unit = \"rad\"                  # of the heading: rad, deg

# [odometry]                    # where it took itself to be; made of the wheels if left out
# names = [\"odom_x\", \"odom_y\", \"odom_heading\"]
# unit = \"rad\"                  # of the heading: rad, deg
{hinges}"
    ))
}
