//! `omnistep export`.

use std::io::Write;
use std::path::PathBuf;

use omni_config::{Language, Scenario, Source, Vehicle};
use omni_log::{JointInterface, mjcf, ros2_control_urdf, ros2_controllers, vehicle_urdf};

use crate::Error;
use crate::args::{CommandInterface, ExportArgs, Format, parse_overrides, with_vehicle};
use crate::notices::announce_assumed;
use crate::output::{print, say, warn, write_file};
use crate::ros2_package;
use crate::scenario_or_vehicle::scenario_or_vehicle;

/// The scenario of a vehicle that is named alone.
const LEVEL: &str = "flat";

/// Writes a vehicle, or a scenario with its own vehicle or another, into a file or to standard output.
pub(super) fn export(args: &ExportArgs, out: &mut dyn Write) -> Result<(), Error> {
    check(args)?;
    let text = match args.format {
        Format::Mjcf => mjcf(&scenario(args)?)? + "\n",
        Format::Urdf => match args.ros2_control {
            None => vehicle_urdf(&vehicle(args)?) + "\n",
            Some(interface) => ros2_control_urdf(&vehicle(args)?, interface.into()) + "\n",
        },
        Format::Ros2Control => ros2_controllers(&vehicle(args)?)?,
        Format::Ros2Msgs => return ros2_package::write(args.out.as_deref()),
        Format::Rust => constants(args, Language::Rust)?,
        Format::C => constants(args, Language::C)?,
    };
    match &args.out {
        None => print(out, &text),
        Some(path) => write_file(path, &text, &read_for(args)?),
    }
}

/// Options of one format are rejected with another.
fn check(args: &ExportArgs) -> Result<(), Error> {
    if let (Some(vehicle), Format::Urdf | Format::Ros2Control) = (&args.vehicle, args.format) {
        return Err(Error::Argument {
            name: "--vehicle",
            value: vehicle.clone(),
            allowed: "only with --format mjcf, rust and c; for urdf and ros2-control NAME is the vehicle",
        });
    }
    if args.format == Format::Ros2Msgs {
        let given = [
            ("NAME", args.name.as_ref()),
            ("--vehicle", args.vehicle.as_ref()),
            ("--set", args.overrides.first()),
        ];
        if let Some((name, Some(value))) = given.into_iter().find(|(_, value)| value.is_some()) {
            return Err(Error::Argument {
                name,
                value: value.clone(),
                allowed: "nothing with --format ros2-msgs, which is of no vehicle",
            });
        }
    }
    match args.ros2_control {
        Some(interface) if args.format != Format::Urdf => Err(Error::Argument {
            name: "--ros2-control",
            value: JointInterface::from(interface).name().to_owned(),
            allowed: "only with --format urdf",
        }),
        _ => Ok(()),
    }
}

/// A scenario's controller as constants for firmware, with notes on what its vehicle's file leaves open.
fn constants(args: &ExportArgs, language: Language) -> Result<String, Error> {
    let scenario = scenario(args)?;
    if scenario.name == LEVEL && args.name() != LEVEL {
        say(&format!(
            "{0}: a vehicle, so its commands, sensors and actuators are those of the scenario {LEVEL}; those of another: omnistep export SCENARIO --vehicle {0}",
            args.name()
        ));
    }
    announce_assumed(scenario.vehicle(), scenario.period_s(), scenario.derived_gains());
    if let Some(text) = scenario.unseen_encoders() {
        warn(&format!("{}: {text}", scenario.name));
    }
    let (policy, simulated) = (scenario.for_firmware().control.policy, &scenario.control.policy);
    if policy != *simulated {
        say(&format!(
            "{}: no policy is named, so this is {policy}, which needs encoders only; what is simulated: --set control.policy={simulated}",
            scenario.name
        ));
    }
    Ok(scenario.constants(language)?)
}

impl From<CommandInterface> for JointInterface {
    fn from(interface: CommandInterface) -> Self {
        match interface {
            CommandInterface::Velocity => Self::Velocity,
            CommandInterface::Effort => Self::Effort,
        }
    }
}

/// The files that were read for a scenario or a vehicle, with another vehicle and some keys replaced.
fn read_for(args: &ExportArgs) -> Result<Vec<PathBuf>, Error> {
    let mut files = Scenario::files(args.name()).unwrap_or_default();
    // Built-in items name no file; if such a file exists nevertheless, it is also kept, as is every text of an
    // override.
    let overrides = parse_overrides(&args.overrides)?;
    let replaced = overrides.iter().filter_map(|each| each.value().as_str());
    let named = [args.name()].into_iter().chain(args.vehicle.as_deref());
    files.extend(named.chain(replaced).map(PathBuf::from));
    Ok(files)
}

fn vehicle(args: &ExportArgs) -> Result<Vehicle, Error> {
    let overrides = parse_overrides(&args.overrides)?;
    Ok(Vehicle::from_source(
        &Source::vehicle(args.name(), None)?,
        &overrides,
    )?)
}

/// A scenario by its name, or a vehicle by its name on level ground.
fn scenario(args: &ExportArgs) -> Result<Scenario, Error> {
    let overrides = with_vehicle(args.vehicle.as_deref(), &args.overrides)?;
    scenario_or_vehicle(args.name(), overrides, || Ok((LEVEL, Vec::new())))
        .map_err(|error| error.to_command("export").into())
}
