//! Writes the controller's constants, what the randomised steps come to on this computer, and the memory map.

use std::env;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

use omni_config::{Language, Override, Scenario, rust_expression};
use omni_core::drive::{FaultConfig, SlipConfig};
use omni_core::estimate::{Estimator, EstimatorConfig, Odometry, OdometryNoise};
use omni_core::geometry::{Desaturation, SpeedLimits};
use omni_core::loops::Rest;
use omni_core::shaping::{AxisLimits, EmergencyDeceleration, TwistLimits};
use omni_core::{Drive, DriveConfig, Kinematics, WheelLayout};

#[path = "src/randomised.rs"]
mod randomised;

/// A drive with every option on, to see what all of it costs: limits with jerk, speed limits, faults, slip, covariance,
/// a shared path, a command point, discretisation.
fn everything(scenario: &Scenario) -> Result<Drive<f32, 7>, Box<dyn Error>> {
    let axis = AxisLimits::symmetric(1.0, 1.0, 2.0, 20.0);
    let mut config = DriveConfig::new(scenario.vehicle().layout()?, scenario.wheel_control()?);
    config.rest = Rest::hold(10.0, 100.0);
    config.shaping.limits = TwistLimits::PerAxis {
        vx: axis,
        vy: axis,
        wz: axis,
    };
    config.shaping.timeout_s = Some(0.1);
    config.shaping.emergency_deceleration = Some(EmergencyDeceleration {
        linear_m_s2: 4.0,
        yaw_rad_s2: 8.0,
    });
    config.command_point_m = [0.1, 0.0];
    config.discretize = true;
    config.unobservable_periods = 10;
    config.speed_limits = Some(SpeedLimits::new([20.0; 7], Desaturation::Uniform)?);
    let period_s = scenario.period_s() as f32;
    config.slip = Some(SlipConfig::usual(period_s));
    config.faults = Some(FaultConfig {
        jump_rad_s: 20.0,
        ..FaultConfig::usual(period_s)
    });
    config.noise = Some(OdometryNoise {
        wheel_rad_per_sqrt_rad: 0.02,
        residual_gain: 1.0,
    });
    Ok(Drive::new(config)?)
}

/// The drive of a `[drive]` in which every key has its default: what it costs at least.
fn defaults(name: &str, keys: &[Override]) -> Result<Drive<f32, 7>, Box<dyn Error>> {
    let keys = [keys, &[Override::parse("drive.discretize=false")?]].concat();
    let scenario = Scenario::load(name, &keys)?;
    Ok(scenario
        .drive()?
        .ok_or("no [drive] although a key of it was set")?)
}

/// An estimator with its defaults, for four mecanum wheels.
fn estimator(scenario: &Scenario) -> Result<Estimator<f32, 4>, Box<dyn Error>> {
    let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.5, 0.4, 0.076)?)?;
    Ok(Estimator::new(
        EstimatorConfig::new(scenario.period_s() as f32),
        &kinematics,
    )?)
}

/// A constant of the vehicle under traction control, as source.
fn traction(name: &str) -> Result<String, Box<dyn Error>> {
    let scenario = Scenario::load(name, &[Override::parse("control.policy=traction")?])?;
    let source = scenario.constants(Language::Rust)?;
    let start = source
        .find("/// Traction control.")
        .ok_or("no traction control although that is the policy")?;
    Ok(source[start..].to_owned())
}

/// Where this computer says that the scenario's path leads; of one without a path, a figure of
/// eight and who follows it as well.
fn path(scenario: &Scenario) -> Result<String, Box<dyn Error>> {
    let Some(path) = scenario.planned_path()? else {
        let eight = Scenario::load("figure_eight", &[])?;
        let source = eight.constants(Language::Rust)?;
        let start = source
            .find("/// The planned trajectory.")
            .ok_or("no path although the command is one")?;
        return Ok(source[start..].to_owned() + &path(&eight)?);
    };
    let trajectory = path.trajectory();
    let poses = [0.1, 0.3, 0.5, 0.7, 0.9, 1.0].map(|part| {
        let time_s = part * trajectory.duration_s();
        let pose = trajectory.at(time_s).pose;
        [time_s, pose.x_m, pose.y_m, pose.yaw_rad].map(|value| value as f32)
    });
    Ok(format!(
        "/// Times and where it is then: x, y, yaw.\npub static ON_THE_WAY: [[f32; 4]; {}] = {};\n",
        poses.len(),
        rust_expression(&poses)
    ))
}

/// What a processor in the loop runs: the scenario's drive where it has one, else its loops.
fn served(scenario: &Scenario) -> &'static str {
    if scenario.drive.is_some() && scenario.has_traction() {
        "/// What the loop serves.\npub use self::DRIVE as SERVED;\n\
         /// Its state.\npub type ServedState = omni_core::drive::TractionDriveState<f32, 7>;\n"
    } else if scenario.drive.is_some() {
        "/// What the loop serves.\npub use self::DRIVE as SERVED;\n\
         /// Its state.\npub type ServedState = omni_core::DriveState<f32, 7>;\n"
    } else {
        "/// What the loop serves.\npub static SERVED: omni_link::Loops<'static, 7> = \
         omni_link::Loops { controller: &CONTROLLER, limiter: &LIMITER };\n\
         /// Its state.\npub type ServedState = omni_link::LoopsState<7>;\n"
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("no OUT_DIR")?);
    // A built-in scenario or a .toml file; its vehicle, policy and control period are what the image gets.
    println!("cargo::rerun-if-env-changed=OMNISTEP_SCENARIO");
    let named = env::var("OMNISTEP_SCENARIO").ok();
    // The built-in step is driven by traction control; these images are of the wheels' loops.
    let keys = match named {
        Some(_) => Vec::new(),
        None => vec![Override::parse("control.policy=scale_references")?],
    };
    let name = named.unwrap_or_else(|| "step".into());
    for file in Scenario::files(&name)? {
        println!("cargo::rerun-if-changed={}", file.display());
    }
    let scenario = Scenario::load(&name, &keys)?;
    let mut source = scenario.constants(Language::Rust)?;
    if scenario.vehicle().wheel.len() == 7 {
        // The randomised steps take any controller; the self-test is of the seven-wheel vehicle's size.
        let (controller, limiter) = (scenario.controller()?, scenario.limiter()?);
        let odometry = Odometry::new(scenario.period_s() as f32)?;
        let hash = randomised::hash(randomised::STEPS, |memory, command, measured| {
            randomised::step(&controller, &limiter, memory, command, measured);
            randomised::pose(&controller, &odometry, memory);
        });
        if !scenario.has_traction() && scenario.drive.is_none() {
            source.push_str(&traction(&name)?);
        }
        source.push_str(&path(&scenario)?);
        source.push_str(&format!(
            "/// Hash of the randomised steps on the computer that built this.\npub const HASH: u32 = {hash:#010x};\n\
             /// An estimator of four mecanum wheels.\npub static ESTIMATOR: omni_core::estimate::Estimator<f32, 4> = {};\n\
             /// A drive with every option on.\npub static EVERYTHING: omni_core::Drive<f32, 7> = {};\n\
             /// A drive as a `[drive]` of defaults makes it.\npub static DEFAULTS: omni_core::Drive<f32, 7> = {};\n{}",
            rust_expression(&estimator(&scenario)?),
            rust_expression(&everything(&scenario)?),
            rust_expression(&defaults(&name, &keys)?),
            served(&scenario)
        ));
    } else {
        return Err(Box::new(omni_config::Error::Key {
            file: format!("vehicle {}", scenario.vehicle().name),
            key: "wheel".into(),
            message: format!(
                "{} wheels, allowed in these images: 7",
                scenario.vehicle().wheel.len()
            ),
        }));
    }
    fs::write(out.join("constants.rs"), source)?;
    let three = Scenario::load("scenarios/three.toml", &[])?;
    for file in Scenario::files("scenarios/three.toml")? {
        println!("cargo::rerun-if-changed={}", file.display());
    }
    fs::write(out.join("three.rs"), three.constants(Language::Rust)?)?;
    let eight = Scenario::load("figure_eight", &[])?;
    fs::write(
        out.join("figure_eight.rs"),
        format!(
            "{}/// Of pose and velocity.\npub static ESTIMATOR: omni_core::estimate::Estimator<f32, 4> = {};\n",
            eight.constants(Language::Rust)?,
            rust_expression(&eight.estimator::<f32, 4>()?)
        ),
    )?;

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
