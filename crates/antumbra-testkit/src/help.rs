//! Rules for the help of every program of the project: short lines, headings, and where north is.

/// Widest line of help, in characters.
const WIDTH: usize = 100;

/// A command, and the words that its help must have; those that end with a colon are headings, and stand in the short help, too.
pub type Expected<'a> = (&'a [&'a str], &'a [&'a str]);

/// Asserts that no line is too long, and that every command has its words. `help` returns what a program prints when
/// it gets these arguments.
pub fn assert_fits(help: impl Fn(&[&str]) -> String, commands: &[Expected<'_>]) {
    for (command, words) in commands {
        for flag in ["--help", "-h"] {
            let text = help(&[command, &[flag][..]].concat());
            for line in text.lines() {
                let width = line.chars().count();
                assert!(
                    width <= WIDTH,
                    "{command:?} {flag}: {width} columns: {line}"
                );
            }
            for word in words
                .iter()
                .filter(|word| flag == "--help" || word.ends_with(':'))
            {
                assert!(text.contains(word), "{command:?} {flag}: {word}\n{text}");
            }
        }
    }
}

/// Asserts that the help of commands that take a sun says where north is.
pub fn assert_states_north(help: impl Fn(&[&str]) -> String, commands: &[&str]) {
    for command in commands {
        let text = help(&[command, "--help"]);
        let words: Vec<&str> = text.split_whitespace().collect();
        let text = words.join(" ");
        for part in [
            "With z up, north is +y and east is +x",
            "with y up, north is -z and east is +x",
        ] {
            assert!(text.contains(part), "{command}: {part}");
        }
    }
}
