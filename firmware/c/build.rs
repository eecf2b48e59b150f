//! `include/omnistep.h` from the sources. The header is part of the repository, so that who reads
//! it needs no Rust: here it is only compared, and written where OMNISTEP_WRITE_HEADER is set.

use std::env;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use omni_core::DriveState;
use omni_core::drive::TractionDriveState;
use omni_core::estimate::EstimatorState;
use omni_core::linkage::MAX_HINGES;

const HEADER: &str = "include/omnistep.h";
const TEMPLATE: &str = "src/wheels.rs.in";
/// What is below it in the template is of both kinds of drive.
const OF_BOTH: &str = "// Of both kinds of drive.\n";
/// The kinds: their name in functions, and the type of their state.
const KINDS: [(&str, &str); 2] = [
    ("drive", "DriveMemory<N, DRIVE_WORDS>"),
    ("traction_drive", "TractionMemory<N, TRACTION_WORDS>"),
];

/// A wheel count.
struct Count {
    n: usize,
    name: &'static str,
    /// States: the name of their size in the template, their name in Rust and behind `omniN_` in C, and words
    /// of 32 bits. On a 32-bit processor these are as many as here, which `FITS` of `src/memory.rs` checks.
    words: [(&'static str, &'static str, &'static str, usize); 3],
}

impl Count {
    const fn of<const N: usize>(name: &'static str) -> Self {
        const fn words<T>() -> usize {
            size_of::<T>().div_ceil(size_of::<u32>())
        }
        Self {
            n: N,
            name,
            words: [
                (
                    "DRIVE_WORDS",
                    "DriveMemory",
                    "drive_state",
                    words::<DriveState<f32, N>>(),
                ),
                (
                    "TRACTION_WORDS",
                    "TractionMemory",
                    "traction_drive_state",
                    words::<TractionDriveState<f32, N>>(),
                ),
                (
                    "ESTIMATOR_WORDS",
                    "EstimatorMemory",
                    "estimator_state",
                    words::<EstimatorState<f32, N>>(),
                ),
            ],
        }
    }

    /// A text of the template for this count.
    fn written(&self, template: &str) -> String {
        let named = template
            .replace("omniN", &format!("omni{}", self.n))
            .replace("COUNT", self.name)
            .replace("<N", &format!("<{}", self.n))
            .replace(", N>", &format!(", {}>", self.n));
        let put = |text: String, (name, _, _, words): &(&str, &str, &str, usize)| {
            text.replace(name, &words.to_string())
        };
        self.words.iter().fold(named, put)
    }
}

const COUNTS: [Count; 6] = [
    Count::of::<3>("three"),
    Count::of::<4>("four"),
    Count::of::<5>("five"),
    Count::of::<6>("six"),
    Count::of::<7>("seven"),
    Count::of::<8>("eight"),
];

/// Names of the types of N wheels: in Rust, and behind `omniN_` in C.
const TYPES: [(&str, &str); 22] = [
    ("Controller_f32__", "controller"),
    ("ControlState_f32__", "state"),
    ("ControlSample_f32__", "sample"),
    ("WheelVelocities_f32__", "velocities"),
    ("WheelTorques_f32__", "torques"),
    ("WheelSample_f32__", "wheel_sample"),
    ("WheelController_f32__", "loops"),
    ("Kinematics_f32__", "kinematics"),
    ("TorqueLimits_f32__", "torque_limits"),
    ("TorqueRanges_f32__", "torque_ranges"),
    ("Drive_f32__", "drive"),
    ("SpeedLimits_f32__", "speed_limits"),
    ("Odometry_f32__", "odometry"),
    ("TractionDrive_f32__", "traction_drive"),
    ("Traction_f32__", "traction"),
    ("Supervisor_f32__", "supervisor"),
    ("Linkage_f32__", "linkage"),
    ("Estimator_f32__", "estimator"),
    ("Input_", "drive_input"),
    ("Output_", "drive_output"),
    ("TractionOutput_", "traction_drive_output"),
    ("PoseInput_", "estimator_input"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-env-changed=OMNISTEP_WRITE_HEADER");
    for source in ["src", "cbindgen.toml", HEADER, "../../crates/omni-core/src"] {
        println!("cargo::rerun-if-changed={source}");
    }
    let folder = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or("no CARGO_MANIFEST_DIR")?);
    let wheels = PathBuf::from(env::var_os("OUT_DIR").ok_or("no OUT_DIR")?).join("wheels.rs");
    fs::write(
        &wheels,
        of_each_count(&fs::read_to_string(folder.join(TEMPLATE))?, &version()?)?,
    )?;
    let bindings = cbindgen::Builder::new()
        .with_config(config(&folder, &version()?)?)
        .with_src(&wheels)
        .with_crate(&folder)
        .generate()?;
    let mut raw = Vec::new();
    bindings.write(&mut raw);
    let header = for_c(&String::from_utf8(raw)?, &version()?);
    let path = folder.join(HEADER);
    if env::var_os("OMNISTEP_WRITE_HEADER").is_some() {
        fs::write(path, header)?;
    } else if fs::read_to_string(&path).ok().as_deref() != Some(&header) {
        return Err(format!("{HEADER} is not what the sources say: make generated").into());
    }
    Ok(())
}

/// The version as a part of a symbol, `0_1_0`.
fn version() -> Result<String, Box<dyn Error>> {
    Ok(env::var("CARGO_PKG_VERSION")?.replace(|c: char| !c.is_ascii_alphanumeric(), "_"))
}

/// The functions of N wheels, written out for each wheel count.
fn of_each_count(template: &str, version: &str) -> Result<String, Box<dyn Error>> {
    let (once, of_both) = template
        .split_once(OF_BOTH)
        .ok_or("no functions of both kinds of drive")?;
    let of_both = KINDS.map(|(kind, memory)| of_both.replace("KIND", kind).replace("MEMORY", memory));
    let template = (once.to_owned() + &of_both.concat()).replace("VERSION", version);
    Ok(COUNTS.map(|count| count.written(&template)).concat())
}

/// What the header has before all types.
fn preface(version: &str) -> Result<String, Box<dyn Error>> {
    let mut numbers = Vec::<u32>::new();
    for part in ["MAJOR", "MINOR", "PATCH"] {
        numbers.push(env::var(format!("CARGO_PKG_VERSION_{part}"))?.parse()?);
    }
    let number = numbers.iter().fold(0, |number, part| 1000 * number + part);
    let kinds = ["", "_drive", "_traction_drive", "_estimator"];
    let inits = COUNTS.map(|Count { n, .. }| {
        kinds
            .map(|kind| format!("#define omni{n}{kind}_init omni{n}{kind}_init_{version}\n"))
            .concat()
    });
    Ok(format!(
        "\n#define OMNISTEP_VERSION \"{}\"\n\
         /* 1000000 major + 1000 minor + patch; constants.h of another version is an error. */\n\
         #define OMNISTEP_VERSION_NUMBER {number}\n\n\
         /* Structures differ from version to version: a library of another one does not link. */\n{}\n\
         /* Hinges that a vehicle under traction control may have. */\n#define OMNI_MAX_HINGES {MAX_HINGES}\n\n\
         /* Constants of another kind of drive or number of wheels are an error, as they are in C++ and to newer compilers. */\n\
         #if defined(__GNUC__) && !defined(__cplusplus)\n#pragma GCC diagnostic error \"-Wincompatible-pointer-types\"\n#endif\n\n\
         /* Infinity and NaN, without <math.h> where the compiler has them by itself. */\n\
         #ifdef __GNUC__\n#define OMNI_INFINITY __builtin_inff()\n#define OMNI_NAN __builtin_nanf(\"\")\n\
         #else\n#include <math.h>\n#define OMNI_INFINITY INFINITY\n#define OMNI_NAN NAN\n#endif",
        env::var("CARGO_PKG_VERSION")?,
        inits.concat()
    ))
}

/// The configuration, with the names of the types of each wheel count.
fn config(folder: &Path, version: &str) -> Result<cbindgen::Config, Box<dyn Error>> {
    let mut config = cbindgen::Config::from_file(folder.join("cbindgen.toml"))?;
    config.after_includes = Some(preface(version)?);
    for Count { n, words, .. } in COUNTS {
        let types = TYPES.map(|(rust, c)| (format!("{rust}{n}"), c.to_owned()));
        let states = words.map(|(_, memory, c, words)| (format!("{memory}_{n}__{words}"), c.to_owned()));
        for (rust, c) in types.into_iter().chain(states) {
            config.export.rename.insert(rust, format!("omni{n}_{c}"));
        }
    }
    Ok(config)
}

/// Leaves out the examples, which are in Rust, and the traces of Rust's generics and links.
fn for_c(text: &str, version: &str) -> String {
    let mut lines = Vec::<String>::new();
    let mut in_example = false;
    for line in text.lines() {
        let comment = line.trim_start().strip_prefix("//").map(str::trim);
        if let Some(comment) = comment {
            if comment.starts_with("```") {
                in_example = !in_example;
                continue;
            }
            if in_example
                || comment == "A torque is not a velocity:"
                || comment.ends_with("does not compile:")
            {
                continue;
            }
        } else {
            // A comment's empty last lines say nothing.
            while lines.last().is_some_and(|last| last.trim() == "//") {
                lines.pop();
            }
        }
        let plain = line
            .replace("\\[", "[")
            .replace("\\]", "]")
            .replace("super::", "")
            .replace("[`", "`")
            .replace("`]", "`");
        let plain = without_links(&plain);
        let plain = plain
            .replace("_F32,", ",")
            .replace("_Body_f32", "_body")
            .replace("_Tag", "_tag")
            .replace("[MAX_HINGES]", "[OMNI_MAX_HINGES]")
            .replace(&format!("_{version}("), "(");
        let repeats = plain.trim() == "//" && lines.last().is_some_and(|last| last.trim() == "//");
        if !repeats {
            lines.push(plain);
        }
    }
    lines.join("\n") + "\n"
}

/// `Name(crate::path::Name)`, a link of Rust's documentation, as `Name`.
fn without_links(line: &str) -> String {
    let mut parts = line.split("(crate::");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once(')').map_or(part, |(_, rest)| rest));
    }
    plain
}
