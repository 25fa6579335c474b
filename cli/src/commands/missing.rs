//! Commands that this build leaves out: each says how to have it.

use std::ffi::OsString;

use crate::failure::Failure;

/// Whatever stands behind a command that is left out, its `--help` too.
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
pub(super) struct Args {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<OsString>,
}

/// Says how to build `rowtone` with `command`, which the feature `feature` brings.
///
/// # Errors
/// [`Failure::Usage`], always.
pub(super) fn run(_: &Args, command: &str, feature: &str) -> Result<(), Failure> {
    Err(Failure::usage(format!(
        "{command} is left out of this build: `cargo run --release -p rowtone-cli --features {feature} -- {command}` has it"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(clap::Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn it_says_how_to_have_the_command_whatever_was_asked_of_it() {
        for given in [
            &["gateway"][..],
            &["gateway", "--config", "x.toml"],
            &["gateway", "--help"],
        ] {
            let command = <Command as clap::Parser>::try_parse_from(given).expect("anything goes");
            let failure = run(&command.args, "gateway", "gateway").expect_err("it is left out");
            assert_eq!(failure.status(), 2);
            let text = failure.to_string();
            assert!(text.contains("--features gateway -- gateway"), "{text}");
        }
    }
}
