//! Arguments of `completions` and `man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS_EXAMPLES)]
pub struct CompletionsArguments {
    /// The shell that reads the script
    pub shell: Shell,
}

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  ldi-ops completions bash > ldi-ops.bash
  ldi-ops completions zsh > _ldi-ops
  ldi-ops completions fish > ldi-ops.fish

bash reads the script from ~/.local/share/bash-completion/completions/ldi-ops, fish from
~/.config/fish/completions/ldi-ops.fish, zsh from the file _ldi-ops in a folder of $fpath.";

#[derive(Debug, Args)]
#[command(after_help = MAN_EXAMPLES)]
pub struct ManArguments {
    /// The folder for a page of each command: ldi-ops.1, ldi-ops-volume.1 and so on; the program makes it if there is
    /// none. Without it the page of the program goes to stdout
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

const MAN_EXAMPLES: &str = "\
Examples:
  ldi-ops man > ldi-ops.1
  ldi-ops man man1

`man` finds the pages in a folder man1 of its path, such as ~/.local/share/man/man1. If one page cannot
be written, none is.";
