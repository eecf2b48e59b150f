//! Writes the controller's constants, what the randomised steps come to on this computer, and the memory map.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

use omni_config::{Language, Scenario};

#[path = "src/randomised.rs"]
mod randomised;

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("no OUT_DIR")?);
    // A built-in scenario or a .toml file; its vehicle, policy and control period are what the image gets.
    println!("cargo::rerun-if-env-changed=OMNISTEP_SCENARIO");
    let name = env::var("OMNISTEP_SCENARIO").unwrap_or_else(|_| "step".into());
    if name.ends_with(".toml") {
        println!("cargo::rerun-if-changed={name}");
    }
    let scenario = Scenario::load(&name, &[]).map_err(|error| error.to_string())?;
    let mut source = scenario.constants(Language::Rust)?;
    if scenario.vehicle().wheel.len() == 7 {
        // The randomised steps take any controller; the self-test is of the seven-wheel vehicle's size.
        let hash = randomised::hash(
            &scenario.controller()?,
            &scenario.limiter()?,
            scenario.period_s() as f32,
        );
        source.push_str(&format!(
            "/// Hash of the randomised steps on the computer that built this.\npub const HASH: u32 = {hash:#010x};\n"
        ));
    } else {
        return Err(format!(
            "{name}: {} wheels, allowed in these images: 7",
            scenario.vehicle().wheel.len()
        )
        .into());
    }
    fs::write(out.join("constants.rs"), source)?;

    let memory = match env::var("CARGO_CFG_TARGET_ARCH")?.as_str() {
        "riscv32" => "memory/riscv32.x",
        _ => "memory/arm.x",
    };
    fs::copy(memory, out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    for file in ["build.rs", "src/randomised.rs", memory] {
        println!("cargo::rerun-if-changed={file}");
    }
    Ok(())
}
