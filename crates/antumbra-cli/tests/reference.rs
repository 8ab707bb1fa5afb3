//! The reference of the program in docs/cli.md, which is written from what the program says of itself.
//!
//! `cargo xtask cli` writes it again: it sets `ANTUMBRA_WRITE`, with which this test writes and does not compare.

use std::fmt::Write as _;
use std::path::Path;

use antumbra_cli::typed::Typed;
use clap::{Arg, Command, CommandFactory as _};

const BEGIN: &str = "<!-- Written by `cargo xtask cli`: change the program's help instead. -->\n";
const END: &str = "<!-- End of what `cargo xtask cli` writes. -->\n";

#[test]
fn the_reference_is_what_the_program_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cli.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("docs/cli.md has a begin");
    let (found, after) = rest.split_once(END).expect("docs/cli.md has an end");
    let expected = reference();
    if std::env::var_os("ANTUMBRA_WRITE").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{expected}{END}{after}")).unwrap();
        return;
    }
    assert!(
        found == expected,
        "docs/cli.md is not what the program says: run `cargo xtask cli`"
    );
}

/// Returns the Markdown of all commands.
fn reference() -> String {
    let mut program = Typed::command();
    program.build();
    let mut text = String::from("\n| command | does |\n|---|---|\n");
    let commands = || program.get_subcommands().filter(|c| c.get_name() != "help");
    for command in commands() {
        let name = command.get_name();
        let about = words(&command.get_about().unwrap_or_default().to_string());
        writeln!(text, "| [`antumbra {name}`](#antumbra-{name}) | {about} |").unwrap();
    }
    text += "\n### Options of all commands\n\n";
    options(
        &mut text,
        program.get_arguments().filter(|a| a.is_global_set()),
    );
    for command in commands() {
        of_command(&mut text, command);
    }
    text
}

fn of_command(text: &mut String, command: &Command) {
    let name = command.get_name();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    write!(text, "\n### antumbra {name}\n\n```text\n{usage}\n```\n").unwrap();
    let mut headings: Vec<&str> = Vec::new();
    let own = || {
        let all = command.get_arguments();
        all.filter(|arg| !arg.is_hide_set() && !arg.is_global_set() && arg.get_id() != "help")
    };
    for arg in own() {
        let heading = arg.get_help_heading().unwrap_or("Options");
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    for heading in headings {
        write!(text, "\n**{heading}**\n\n").unwrap();
        let of_heading = |arg: &&Arg| arg.get_help_heading().unwrap_or("Options") == heading;
        options(text, own().filter(of_heading));
    }
}

fn options<'a>(text: &mut String, args: impl Iterator<Item = &'a Arg>) {
    *text += "| option | meaning |\n|---|---|\n";
    for arg in args {
        let values = arg.get_value_names().unwrap_or_default().join(" ");
        let takes_value = arg.get_action().takes_values();
        let mut name = match (arg.get_long(), takes_value) {
            (Some(long), true) => format!("--{long} {values}"),
            (Some(long), false) => format!("--{long}"),
            (None, _) => values.clone(),
        };
        if let Some(short) = arg.get_short() {
            name = format!("-{short}, {name}");
        }
        let help = arg.get_long_help().or(arg.get_help());
        let mut meaning = words(&help.map(ToString::to_string).unwrap_or_default());
        let possible: Vec<String> = arg
            .get_possible_values()
            .iter()
            .filter(|value| takes_value && !value.is_hide_set())
            .map(|value| match value.get_help() {
                Some(help) => format!("`{}` ({})", value.get_name(), words(&help.to_string())),
                None => format!("`{}`", value.get_name()),
            })
            .collect();
        if !possible.is_empty() {
            write!(meaning, ". One of: {}", possible.join("; ")).unwrap();
        }
        let default: Vec<_> = arg
            .get_default_values()
            .iter()
            .map(|v| v.to_string_lossy())
            .collect();
        if takes_value && !default.is_empty() {
            write!(meaning, " [default: {}]", default.join(",")).unwrap();
        }
        if arg.is_required_set() {
            meaning += " [required]";
        }
        let (name, meaning) = (name.replace('|', "\\|"), meaning.replace('|', "\\|"));
        writeln!(text, "| `{name}` | {meaning} |").unwrap();
    }
}

/// Returns a text in one line.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
