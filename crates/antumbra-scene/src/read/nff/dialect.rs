//! Keywords that files named `.nff` hold and NFF does not know.
//!
//! In: a keyword. Out: what to do about it. The table restates section 5 of the project's notes
//! on NFF: assimp's additions are skipped, other formats of the same name are refused by name.

/// What a foreign keyword means for the reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Foreign {
    /// Skip to the end of the line, and the numbers that follow.
    Skip(&'static str),
    /// The file is in another format: keyword and name of the format.
    Refuse(&'static str, &'static str),
}

/// Returns what to do about a keyword that is not NFF's, or `None` if nobody is known to use it.
pub(super) fn foreign(keyword: &str) -> Option<Foreign> {
    const ASSIMP: [&str; 7] = ["tess", "hex", "oct", "tet", "dod", "shader", "tpp"];
    const SENSE8: (&str, &[&str]) = ("Sense8's NFF (WorldToolKit)", &["nff", "version"]);
    const BART: (&str, &[&str]) = (
        "BART's AFF (NFF with animation)",
        &["k", "t", "x", "tp", "ft", "fm", "i", "a", "{", "}"],
    );
    const COURSE: (&str, &[&str]) = (
        "a course's variant of NFF (P3F and similar)",
        &[
            "pl", "fp", "box", "camera", "eye", "fov", "aperture", "focal", "bclr", "light", "mat",
        ],
    );
    const OTHER: (&str, &[&str]) = ("an unknown variant of NFF", &["obj", "Q", "Z", "T"]);

    let named = |words: &[&'static str]| words.iter().copied().find(|&word| word == keyword);
    if let Some(word) = named(&ASSIMP) {
        return Some(Foreign::Skip(word));
    }
    [SENSE8, BART, COURSE, OTHER]
        .into_iter()
        .find_map(|(format, words)| Some(Foreign::Refuse(named(words)?, format)))
}
