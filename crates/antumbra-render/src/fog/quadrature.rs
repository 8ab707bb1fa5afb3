//! Gauss and Legendre's rule with 12 points.

/// Places on `[-1, 1]` above 0, and their weights; those below mirror them.
const HALF_RULE: [[f64; 2]; 6] = [
    [0.125_233_408_511_468_9, 0.249_147_045_813_402_8],
    [0.367_831_498_998_180_2, 0.233_492_536_538_354_8],
    [0.587_317_954_286_617_4, 0.203_167_426_723_065_92],
    [0.769_902_674_194_304_7, 0.160_078_328_543_346_23],
    [0.904_117_256_370_474_9, 0.106_939_325_995_318_43],
    [0.981_560_634_246_719_3, 0.047_175_336_386_511_83],
];

/// Integrates a function from `begin` to `end`; exact, up to rounding, for polynomials up to degree 23.
pub(super) fn integral(begin: f64, end: f64, of: impl Fn(f64) -> f64) -> f64 {
    let half = 0.5 * (end - begin);
    let middle = begin + half;
    let pairs = HALF_RULE.map(|[place, weight]| {
        let off = half * place;
        weight * (of(middle - off) + of(middle + off))
    });
    half * pairs.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_up_to_degree_23_are_exact_and_no_further() {
        let error = |degree: i32| {
            let exact = (1.0 - f64::from(degree % 2)) * 2.0 / f64::from(degree + 1);
            (integral(-1.0, 1.0, |x| x.powi(degree)) - exact).abs()
        };
        for degree in 0..24 {
            assert!(error(degree) < 1e-15, "{degree}: {}", error(degree));
        }
        assert!(error(24) > 1e-8);
    }
}
