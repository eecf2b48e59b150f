//! The command line: see [`omni_sim::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(omni_sim::cli::main(std::env::args_os()))
}
