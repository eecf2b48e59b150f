//! Writes the controller's constants from the file that the simulator reads.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

use omni_config::{Language, Scenario, rust_expression};
use omni_core::shaping::{CommandShaper, ShapingConfig};

const SCENARIO: &str = "vehicle/omni4-flat.toml";

/// A command is sent every 10 to 20 ms: five that are lost in a row are no accident.
const COMMAND_TIMEOUT_S: f32 = 0.1;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = Scenario::load(SCENARIO, &[])?;
    let vehicle = scenario.vehicle();
    let limits = vehicle
        .limits
        .ok_or("the vehicle has no [limits]: commands would be followed at once")?;
    let mut shaping = ShapingConfig::none();
    shaping.limits = limits.of_twist();
    shaping.timeout_s = Some(COMMAND_TIMEOUT_S);
    let shaper = CommandShaper::<f32>::new(shaping, scenario.period_s() as f32)?;

    let mut source = scenario.constants(Language::Rust)?;
    source.push_str(&format!(
        "/// The limits of the command, with its time-out.\n\
         pub static SHAPER: omni_core::shaping::CommandShaper<f32> = {};\n\
         /// How old a command may become, in seconds.\n\
         pub const COMMAND_TIMEOUT_S: f32 = {COMMAND_TIMEOUT_S:?};\n",
        rust_expression(&shaper)
    ));
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("no OUT_DIR")?);
    fs::write(out.join("constants.rs"), source)?;

    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    println!("cargo::rerun-if-changed=build.rs");
    for file in Scenario::files(SCENARIO)? {
        println!("cargo::rerun-if-changed={}", file.display());
    }
    Ok(())
}
