//! The `raypack` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    raypack::cli::main()
}
