//! Automatic exposure: how bright a picture is, and the stops that make it middling.
//!
//! In: the finished linear pixels. Out: stops. The measure is the log-average luminance
//! (Reinhard, Stark, Shirley and Ferwerda 2002, equation 1), which a few bright spots move little.
//! Pixels that show background only are left out, and so are black ones, whose logarithm says
//! nothing; so the measure scales with the lights. Invariant: the same bits on every platform, for
//! any number of threads and any order of tiles, as sums are integers and logarithms are `libm`'s.

/// The luminance that the log-average is brought to: the photographers' middle grey.
pub const KEY: f64 = 0.18;

/// Parts of a logarithm that are added: 2^-40 of it is far below what a byte of a picture shows.
const PARTS: f64 = (1_u64 << 40) as f64;

/// A light meter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Metering {
    log_sum: i128,
    count: u64,
}

impl Metering {
    /// Measures one pixel, linear RGB (Rec. 709 primaries).
    pub fn add_pixel(&mut self, [red, green, blue]: [f32; 3]) {
        let [red, green, blue] = [red, green, blue].map(f64::from);
        let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        if luminance > 0.0 && luminance.is_finite() {
            // Below 2^50 for any `f64`: 2^64 pixels do not overflow.
            self.log_sum += libm::round(libm::log(luminance) * PARTS) as i128;
            self.count += 1;
        }
    }

    /// Makes a meter of what [`Self::parts`] returned.
    pub fn of_parts(log_sum: i128, count: u64) -> Self {
        Self { log_sum, count }
    }

    /// Returns the sum of the logarithms, in units of 2^-40, and how many there are.
    pub fn parts(&self) -> (i128, u64) {
        (self.log_sum, self.count)
    }

    /// Adds what another meter measured.
    pub fn add(&mut self, other: &Self) {
        self.log_sum += other.log_sum;
        self.count += other.count;
    }

    /// Returns the stops that bring the log-average luminance to [`KEY`]; 0 where nothing shines.
    pub fn stops(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        let log_average = self.log_sum as f64 / PARTS / self.count as f64;
        (libm::log(KEY) - log_average) / std::f64::consts::LN_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_needs_no_stop_and_twice_the_light_one_less() {
        let stops = |values: &[f32]| {
            let mut meter = Metering::default();
            values.iter().for_each(|&value| meter.add_pixel([value; 3]));
            meter.stops()
        };
        assert!(stops(&[0.18]).abs() < 1e-6);
        assert!((stops(&[0.36]) + 1.0).abs() < 1e-6);
        assert!((stops(&[18.0, 1800.0]) + libm::log2(1000.0)).abs() < 1e-6);
        assert_eq!(stops(&[0.0, 0.5, f32::INFINITY]), stops(&[0.5]));
        assert_eq!(stops(&[]), 0.0);
        assert_eq!(stops(&[0.0, f32::NAN]), 0.0);
    }

    #[test]
    fn parts_of_a_picture_add_up_in_any_order() {
        let meter = |values: &[f32]| {
            let mut meter = Metering::default();
            values.iter().for_each(|&value| meter.add_pixel([value; 3]));
            meter
        };
        let [a, b, c] = [meter(&[0.1, 3e30]), meter(&[1e-9]), meter(&[0.7, 0.3])];
        let sum = |meters: [&Metering; 3]| {
            let mut sum = Metering::default();
            meters.iter().for_each(|meter| sum.add(meter));
            sum
        };
        let expected = meter(&[0.1, 3e30, 1e-9, 0.7, 0.3]);
        assert_eq!(sum([&a, &b, &c]), expected);
        assert_eq!(sum([&c, &a, &b]), expected);
        let (log_sum, count) = expected.parts();
        assert_eq!(count, 5);
        assert_eq!(Metering::of_parts(log_sum, count).stops(), expected.stops());
    }
}
