//! The command line: see [`omnistep::main`].

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(omnistep::main(std::env::args_os()))
}
