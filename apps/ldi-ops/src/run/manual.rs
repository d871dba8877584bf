//! `completions` and `man`: scripts and pages made from the help texts.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use ldi_ops::{Error, output};

use super::{Finished, Outcome};
use crate::args::Arguments;
use crate::exit::Exit;
use crate::resolve::Report;

/// Returns the completion script of a shell.
pub fn completions(shell: Shell) -> Finished {
    let mut command = Arguments::command();
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, name, &mut script);
    finished(text_of(script))
}

/// Returns the page of the program, or writes the pages of all commands into a folder.
pub fn man(folder: Option<&Path>) -> Result<Finished, Error> {
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let Some(folder) = folder else { return Ok(finished(text_of(page(&command).1))) };
    let mut pages = Vec::new();
    add_pages(&command, folder, &mut pages);
    let is_new = !folder.exists();
    fs::create_dir_all(folder).map_err(|error| Error::output(folder, &error))?;
    if let Some((path, _)) = pages.iter().find(|(path, _)| path.is_dir()) {
        return Err(Error::input(format!("{}: is a folder, and a file is to be written", path.display())));
    }
    if let Err(error) = write_all(&pages) {
        if is_new {
            // If the folder cannot be removed, it stays empty.
            let _ = fs::remove_dir(folder);
        }
        return Err(Error::output(folder, &error));
    }
    Ok(finished(format!("written     {} pages in {}\n", pages.len(), folder.display())))
}

fn finished(text: String) -> Finished {
    Finished { outcome: Outcome::Text(text), report: Report::Text, exit: Exit::Done }
}

fn text_of(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).expect("scripts and pages are UTF-8, as help texts are")
}

/// Adds the pages of a command and of all commands in it that the help lists.
fn add_pages(command: &clap::Command, folder: &Path, pages: &mut Vec<(PathBuf, Vec<u8>)>) {
    let (name, text) = page(command);
    pages.push((folder.join(name), text));
    command.get_subcommands().filter(|inner| !inner.is_hide_set()).for_each(|inner| add_pages(inner, folder, pages));
}

/// Returns the name of the file and the text of a command's page.
fn page(command: &clap::Command) -> (String, Vec<u8>) {
    let after = command.get_after_long_help().or(command.get_after_help()).map(ToString::to_string);
    let without_after = command.clone().after_help(None::<&str>).after_long_help(None::<&str>);
    let man = Man::new(without_after).source(concat!("ldi-ops ", env!("CARGO_PKG_VERSION")));
    let mut text = Vec::new();
    man.render(&mut text).expect("memory takes all that is written");
    if let Some(after) = after {
        text.extend(sections(&after).render().into_bytes());
    }
    (man.get_filename(), text)
}

/// Returns the text below the options of a help text as the sections EXAMPLES and NOTES: indented lines stay as they are,
/// others are filled.
fn sections(after: &str) -> Roff {
    let mut roff = Roff::new();
    let (mut is_verbatim, mut has_notes, mut is_apart) = (false, false, false);
    for line in after.lines() {
        let indented = line.strip_prefix("  ");
        if is_verbatim && indented.is_none() {
            roff.control("fi", []);
            is_verbatim = false;
        }
        match (line, indented) {
            ("", _) => is_apart = true,
            ("Examples:", _) => {
                roff.control("SH", ["EXAMPLES"]);
                is_apart = false;
            }
            _ => {
                if indented.is_none() && !has_notes {
                    roff.control("SH", ["NOTES"]);
                    (has_notes, is_apart) = (true, false);
                }
                if is_apart {
                    roff.control("PP", []);
                    is_apart = false;
                }
                if indented.is_some() && !is_verbatim {
                    roff.control("nf", []);
                    is_verbatim = true;
                }
                roff.text([roman(indented.unwrap_or(line))]);
            }
        }
    }
    if is_verbatim {
        roff.control("fi", []);
    }
    roff
}

/// Writes files, all of which are complete before the first appears in its place.
fn write_all(files: &[(PathBuf, Vec<u8>)]) -> io::Result<()> {
    let Some(((path, text), rest)) = files.split_first() else { return Ok(()) };
    output::replace(path, |file| {
        file.write_all(text)?;
        file.flush()?;
        write_all(rest)
    })
}
