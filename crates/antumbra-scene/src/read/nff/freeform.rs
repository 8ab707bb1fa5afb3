//! Patches and implicit surfaces: antumbra's own addition to NFF.
//!
//! In: the words after `bezier`, `bspline`, `torus`, `metaballs`, `gyroid` or `polynomial`. Out: shapes. Invariant: what is accepted
//! has a meaning; counts are backed by bytes of the file.

use antumbra_geometry::{
    Ball, BezierPatch, DVec3, Field, Implicit, MAX_PATCH_LEVEL, MAX_TERMS, Term,
};

use super::Reader;
use crate::error::ReadError;
use crate::model::Shape;

const POINTS: &str = "3 numbers for each control point";

impl Reader<'_> {
    /// Reads what follows one of our own keywords.
    pub(super) fn read_freeform(
        &mut self,
        entity: &'static str,
        line: u32,
    ) -> Result<(), ReadError> {
        match entity {
            "bezier" => self.read_bezier(),
            "bspline" => self.read_b_spline(line),
            "torus" => {
                const EXPECTED: &str = "8 numbers (centre, axis, radius, radius of the tube)";
                let [cx, cy, cz, ax, ay, az, major, minor] = self.coordinates("torus", EXPECTED)?;
                let (center, axis) = (DVec3::new(cx, cy, cz), DVec3::new(ax, ay, az));
                self.push_implicit(line, entity, Implicit::torus(center, axis, major, minor))
            }
            "metaballs" => self.read_metaballs(line),
            "gyroid" => {
                const EXPECTED: &str = "11 numbers (centre, period, level, two corners of its box)";
                let [x, y, z, period, level] = self.coordinates("gyroid", EXPECTED)?;
                let [low, high] = self.corners("gyroid", EXPECTED)?;
                let field = Field::Gyroid {
                    center: DVec3::new(x, y, z),
                    period,
                    level,
                };
                self.push_implicit(line, entity, Implicit { field, low, high })
            }
            _ => self.read_polynomial(line),
        }
    }

    fn read_bezier(&mut self) -> Result<(), ReadError> {
        let level = self.count("bezier", "a level, 0 to 12", 0, MAX_PATCH_LEVEL)?;
        let mut control = [[DVec3::ZERO; 4]; 4];
        for point in control.as_flattened_mut() {
            *point = self.point("bezier", POINTS)?;
        }
        self.push(Shape::Patch(Box::new(BezierPatch { control, level })));
        Ok(())
    }

    fn read_b_spline(&mut self, line: u32) -> Result<(), ReadError> {
        const EXPECTED: &str =
            "control points of a row and rows, 4 or more each, and a level, 0 to 12";
        const MOST: u32 = 1 << 16;
        let columns = self.count("bspline", EXPECTED, 4, MOST)? as usize;
        let rows = self.count("bspline", EXPECTED, 4, MOST)? as usize;
        let level = self.count("bspline", EXPECTED, 0, MAX_PATCH_LEVEL)?;
        // Every number takes a digit and something before it.
        if columns * rows * 6 > self.lexer.bytes_left() {
            let problem = format!(
                "{columns} times {rows} control points are announced, but the file ends before"
            );
            return Err(self.invalid(
                line,
                "bspline",
                problem,
                "the numbers are followed by that many points",
            ));
        }
        let mut net = Vec::with_capacity(columns * rows);
        for _ in 0..columns * rows {
            net.push(self.point("bspline", POINTS)?);
        }
        for j in 0..rows - 3 {
            for i in 0..columns - 3 {
                let at = |y: usize, x: usize| net[(j + y) * columns + i + x];
                let points = std::array::from_fn(|y| std::array::from_fn(|x| at(y, x)));
                let patch = BezierPatch::from_b_spline(&points, level);
                self.push(Shape::Patch(Box::new(patch)));
            }
        }
        Ok(())
    }

    fn read_metaballs(&mut self, line: u32) -> Result<(), ReadError> {
        const EXPECTED: &str = "a number of balls, a threshold, and two corners of their box";
        const BALL: &str = "5 numbers for each ball (centre, radius, strength)";
        let count = self.count("metaballs", EXPECTED, 1, MAX_TERMS as u32)?;
        let [threshold] = self.coordinates("metaballs", EXPECTED)?;
        let [low, high] = self.corners("metaballs", EXPECTED)?;
        let mut balls = Vec::new();
        for _ in 0..count {
            let [x, y, z, radius, strength] = self.coordinates("metaballs", BALL)?;
            let center = DVec3::new(x, y, z);
            balls.push(Ball {
                center,
                radius,
                strength,
            });
        }
        let field = Field::Metaballs { balls, threshold };
        self.push_implicit(line, "metaballs", Implicit { field, low, high })
    }

    fn read_polynomial(&mut self, line: u32) -> Result<(), ReadError> {
        const EXPECTED: &str = "a number of terms, a centre, a unit, and two corners of its box";
        const TERM: &str = "4 numbers for each term (factor, exponents of x, y and z)";
        let count = self.count("polynomial", EXPECTED, 1, MAX_TERMS as u32)?;
        let [x, y, z, unit] = self.coordinates("polynomial", EXPECTED)?;
        let [low, high] = self.corners("polynomial", EXPECTED)?;
        let mut terms = Vec::new();
        for _ in 0..count {
            let [factor] = self.coordinates("polynomial", TERM)?;
            let mut exponents = [0; 3];
            for exponent in &mut exponents {
                *exponent = self.count("polynomial", TERM, 0, antumbra_geometry::MAX_DEGREE)?;
            }
            terms.push(Term { factor, exponents });
        }
        let center = DVec3::new(x, y, z);
        let field = Field::Polynomial {
            center,
            unit,
            terms,
        };
        self.push_implicit(line, "polynomial", Implicit { field, low, high })
    }

    fn corners(
        &mut self,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<[DVec3; 2], ReadError> {
        Ok([self.point(entity, expected)?, self.point(entity, expected)?])
    }

    /// Reads a whole number within bounds.
    fn count(
        &mut self,
        entity: &'static str,
        expected: &'static str,
        least: u32,
        most: u32,
    ) -> Result<u32, ReadError> {
        let word = self.lexer.peek();
        let number = word.and_then(|word| word.text.parse::<u32>().ok());
        match number.filter(|number| (least..=most).contains(number)) {
            Some(number) => {
                self.lexer.next();
                Ok(number)
            }
            None => Err(self.expected(word, entity, expected)),
        }
    }

    fn push_implicit(
        &mut self,
        line: u32,
        entity: &'static str,
        implicit: Implicit,
    ) -> Result<(), ReadError> {
        if let Err(error) = implicit.check() {
            return Err(self.invalid(line, entity, error.to_string(), ""));
        }
        self.push(Shape::Implicit(Box::new(implicit)));
        Ok(())
    }
}
