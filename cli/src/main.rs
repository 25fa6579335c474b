//! The command `rowtone`. All of it lives in the library, so that tests and benches can call it.

use std::process::ExitCode;

fn main() -> ExitCode {
    rowtone_cli::commands::main(std::env::args_os())
}
