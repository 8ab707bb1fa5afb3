//! Numbers as text.
//!
//! In: a finite `f64`. Out: decimal text, the same on every platform and in every locale.

/// How many digits a writer gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// As C's `%g`: six significant digits, as SPD's programs write. Reading it back gives
    /// nearby numbers.
    SixDigits,
    /// The fewest digits that read back as exactly the same number.
    #[default]
    Exact,
}

impl Precision {
    /// Returns the text of a finite number.
    pub(super) fn text(self, number: f64) -> String {
        match self {
            Self::SixDigits => six_digits(number),
            Self::Exact => {
                let text = format!("{number:?}");
                text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
            }
        }
    }
}

/// C's `%g`: no trailing zeros; an exponent below 1e-4 and from 1e6 on.
fn six_digits(number: f64) -> String {
    let scientific = format!("{number:.5e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = usize::try_from(5 - exponent).unwrap_or(0);
        return without_trailing_zeros(&format!("{number:.decimals$}")).to_owned();
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!(
        "{}e{sign}{:02}",
        without_trailing_zeros(mantissa),
        exponent.unsigned_abs()
    )
}

fn without_trailing_zeros(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_digits_are_those_of_printf() {
        for (number, text) in [
            (0.0, "0"),
            (-0.0, "-0"),
            (1.0, "1"),
            (100_000.0, "100000"),
            (1_000_000.0, "1e+06"),
            (999_999.5, "1e+06"),
            (123_456.7, "123457"),
            (-4.440_892_098_500_626e-16, "-4.44089e-16"),
            (0.0001, "0.0001"),
            (0.000_099_999_96, "0.0001"),
            (0.000_012_345_678, "1.23457e-05"),
            (1.0 / 3.0, "0.333333"),
            (2.0 / 3.0, "0.666667"),
            (1e-300, "1e-300"),
            (1.5e300, "1.5e+300"),
            // Exact ties go to the even digit.
            (0.976_562_5, "0.976562"),
            (0.992_187_5, "0.992188"),
        ] {
            assert_eq!(six_digits(number), text, "{number:e}");
        }
    }

    #[test]
    fn exact_text_reads_back_as_the_same_bits() {
        for number in [
            0.1,
            -0.0,
            1e300,
            5e-324,
            1.0 / 3.0,
            f64::MAX,
            123_456_789.0,
            1e-7,
        ] {
            let text = Precision::Exact.text(number);
            assert_eq!(
                text.parse::<f64>().unwrap().to_bits(),
                number.to_bits(),
                "{text}"
            );
            assert!(text.len() < 26, "{text}");
        }
        assert_eq!(Precision::Exact.text(3.0), "3");
    }
}
