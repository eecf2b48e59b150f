//! `omnistep export`, and `omnistep urdf`.

use std::io::Write;
use std::path::{Path, PathBuf};

use omni_config::{Override, Scenario, Source, Vehicle};
use omni_log::{JointInterface, mjcf, ros2_control_urdf, ros2_controllers, vehicle_urdf};

use crate::Error;
use crate::args::{CommandInterface, Format, parse_overrides, with_vehicle};
use crate::output::{print, write_file};
use crate::scenario_or_vehicle::scenario_or_vehicle;

/// Writes a vehicle, or a scenario with its own vehicle or another `instead`, into a file or to standard output.
pub(super) fn export(
    name: &str,
    format: Format,
    instead: Option<&str>,
    overrides: &[String],
    file: Option<&Path>,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let text = match format {
        Format::Mjcf => mjcf(&scenario(name, with_vehicle(instead, overrides)?)?)? + "\n",
        Format::Urdf => vehicle_urdf(&vehicle(instead.unwrap_or(name), overrides)?) + "\n",
        Format::Ros2Control => ros2_controllers(&vehicle(instead.unwrap_or(name), overrides)?)?,
    };
    match file {
        None => print(out, &text),
        Some(path) => write_file(
            path,
            &text,
            &read_for(name, instead, &parse_overrides(overrides)?),
        ),
    }
}

/// Prints a vehicle as URDF, with a block for ros2_control where it is commanded by something.
pub(super) fn urdf(
    name: &str,
    commanded: Option<CommandInterface>,
    overrides: &[String],
    out: &mut dyn Write,
) -> Result<(), Error> {
    let vehicle = vehicle(name, overrides)?;
    let text = match commanded {
        None => vehicle_urdf(&vehicle),
        Some(interface) => ros2_control_urdf(&vehicle, interface.into()),
    };
    print(out, &(text + "\n"))
}

impl From<CommandInterface> for JointInterface {
    fn from(interface: CommandInterface) -> Self {
        match interface {
            CommandInterface::Velocity => Self::Velocity,
            CommandInterface::Effort => Self::Effort,
        }
    }
}

/// The files that were read for a scenario or a vehicle, with another vehicle `instead` and some keys replaced.
fn read_for(name: &str, instead: Option<&str>, overrides: &[Override]) -> Vec<PathBuf> {
    let mut files = Scenario::files(name).unwrap_or_default();
    // What is built in names no file; where such a file is all the same, it is kept too. So is every text of an override.
    let replaced = overrides.iter().filter_map(|each| each.value().as_str());
    files.extend(
        [name]
            .into_iter()
            .chain(instead)
            .chain(replaced)
            .map(PathBuf::from),
    );
    files
}

fn vehicle(name: &str, overrides: &[String]) -> Result<Vehicle, Error> {
    let overrides = parse_overrides(overrides)?;
    Ok(Vehicle::from_source(&Source::vehicle(name, None)?, &overrides)?)
}

/// A scenario by its name, or a vehicle by its name on level ground.
fn scenario(name: &str, overrides: Vec<Override>) -> Result<Scenario, Error> {
    scenario_or_vehicle(name, overrides, || Ok(("flat", Vec::new())))
        .map_err(|error| error.to_command("export").into())
}
