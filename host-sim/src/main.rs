//! The command `rowtone`. All of it lives in the library, so that tests and benches can call it.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_sim::commands::main(std::env::args_os())
}
