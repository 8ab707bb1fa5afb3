//! Patches and implicit surfaces by the letter of `EXACTNESS.md`, without any search: every triangle, every sample.
//!
//! In: control points or a field, a start, a light. Out: triangles for the oracle, or whether an implicit surface blocks. No code is
//! shared with the library.

type Point = [f64; 3];

/// Returns the triangles that a bicubic patch stands for, in the order of their numbers.
pub fn patch_triangles(control: &[[Point; 4]; 4], level: u32) -> Vec<[Point; 3]> {
    let cells = 1_usize << level;
    let bernstein = |i: usize| {
        let t = i as f64 / cells as f64;
        let s = 1.0 - t;
        [s * s * s, 3.0 * (s * s * t), 3.0 * (t * t * s), t * t * t]
    };
    let curve =
        |b: [f64; 4], w: [f64; 4]| (b[0] * w[0] + b[3] * w[3]) + (b[1] * w[1] + b[2] * w[2]);
    let vertex = |i: usize, j: usize| -> Point {
        std::array::from_fn(|axis| {
            let rows = control.map(|row| curve(row.map(|point| point[axis]), bernstein(i)));
            curve(rows, bernstein(j))
        })
    };
    let mut triangles = Vec::with_capacity(2 * cells * cells);
    for j in 0..cells {
        for i in 0..cells {
            let [a, b] = [vertex(i, j), vertex(i + 1, j + 1)];
            triangles.push([a, vertex(i + 1, j), b]);
            triangles.push([a, b, vertex(i, j + 1)]);
        }
    }
    triangles
}

/// A field that is negative inside.
#[derive(Clone, Debug)]
pub enum TestField {
    /// A torus: centre, axis, radius of the circle, radius of the tube.
    Torus(Point, Point, f64, f64),
    /// Metaballs: centres, radii and strengths, and the threshold.
    Metaballs(Vec<(Point, f64, f64)>, f64),
    /// A gyroid: centre, period, level.
    Gyroid(Point, f64, f64),
    /// A polynomial: centre, unit, terms of a factor and three exponents.
    Polynomial(Point, f64, Vec<(f64, [u32; 3])>),
}

/// An implicit surface in a box.
#[derive(Clone, Debug)]
pub struct TestImplicit {
    /// The field.
    pub field: TestField,
    /// Smallest coordinates of the box.
    pub low: Point,
    /// Largest coordinates of the box.
    pub high: Point,
}

fn dot(a: Point, b: Point) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - b[1] * a[2],
        a[2] * b[0] - b[2] * a[0],
        a[0] * b[1] - b[0] * a[1],
    ]
}

fn unit(a: Point) -> Point {
    let factor = 1.0 / dot(a, a).sqrt();
    a.map(|x| x * factor)
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `x` to a whole power, by squares.
fn power(x: f64, exponent: u32) -> f64 {
    match (exponent, exponent % 2) {
        (0, _) => 1.0,
        (1, _) => x,
        (_, 0) => power(x, exponent / 2).powi(2),
        _ => x * power(x, exponent - 1),
    }
}

impl TestImplicit {
    /// Axes, origin, factor.
    fn frame(&self) -> ([Point; 3], Point, f64) {
        let world = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        match &self.field {
            TestField::Torus(center, axis, _, minor) => {
                let largest = axis.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                let z = unit(axis.map(|x| x / largest));
                let mut least = 0;
                for i in 1..3 {
                    if z[i].abs() < z[least].abs() {
                        least = i;
                    }
                }
                let x = unit(cross(world[least], z));
                ([x, cross(z, x), z], *center, 1.0 / minor)
            }
            TestField::Metaballs(balls, _) => {
                let largest = balls.iter().fold(0.0_f64, |most, ball| most.max(ball.1));
                (world, balls[0].0, 1.0 / largest)
            }
            TestField::Gyroid(center, period, _) => {
                (world, *center, std::f64::consts::TAU / period)
            }
            TestField::Polynomial(center, unit, _) => (world, *center, 1.0 / unit),
        }
    }

    fn local(&self, v: Point) -> Point {
        let (axes, _, factor) = self.frame();
        axes.map(|axis| dot(axis, v) * factor)
    }

    fn local_point(&self, p: Point) -> Point {
        self.local(minus(p, self.frame().1))
    }

    fn value(&self, [x, y, z]: Point) -> f64 {
        match &self.field {
            TestField::Torus(_, _, major, minor) => {
                let off = (x * x + y * y).sqrt() - major * (1.0 / minor);
                (off * off + z * z) - 1.0
            }
            TestField::Metaballs(balls, threshold) => {
                let factor = self.frame().2;
                balls.iter().fold(1.0, |left, &(center, radius, strength)| {
                    let q = minus([x, y, z], self.local_point(center));
                    let radius = radius * factor;
                    let share = dot(q, q) * (1.0 / (radius * radius));
                    let near = (1.0 - share).max(0.0);
                    left - (near * near * near) * (strength / threshold)
                })
            }
            TestField::Gyroid(_, _, level) => {
                let (sine, cosine) = ([x, y, z].map(libm::sin), [x, y, z].map(libm::cos));
                ((sine[0] * cosine[1] + sine[1] * cosine[2]) + sine[2] * cosine[0]) - level
            }
            TestField::Polynomial(_, _, terms) => {
                terms.iter().fold(0.0, |sum, (factor, [i, j, k])| {
                    sum + (power(x, *i) * power(y, *j) * power(z, *k)) * factor
                })
            }
        }
    }

    fn scale(&self) -> f64 {
        match &self.field {
            TestField::Torus(..) | TestField::Gyroid(..) => 1.0,
            TestField::Metaballs(balls, threshold) => balls
                .iter()
                .fold(1.0, |most, ball| most.max(ball.2.abs() / threshold)),
            TestField::Polynomial(_, _, terms) => {
                let mut extent = 0.0_f64;
                for corner in 0..8 {
                    let p = std::array::from_fn(|i| [self.low[i], self.high[i]][corner >> i & 1]);
                    extent = self
                        .local_point(p)
                        .iter()
                        .fold(extent, |most, x| most.max(x.abs()));
                }
                terms.iter().fold(0.0, |most: f64, (factor, exponents)| {
                    most.max(factor.abs() * extent.powi(exponents.iter().sum::<u32>() as i32))
                })
            }
        }
    }

    /// Returns whether the surface blocks a segment: from a start, rounded, by a direction, to its end if it has one.
    /// `own_side` is the side of the light for starts on this surface.
    pub fn is_blocked(
        &self,
        start: Point,
        direction: Point,
        is_finite: bool,
        own_side: Option<f64>,
    ) -> bool {
        let end = if is_finite { 1.0 } else { f64::INFINITY };
        let mut shares = [0.0_f64, end];
        for i in 0..3 {
            if direction[i] == 0.0 {
                if start[i] < self.low[i] || start[i] > self.high[i] {
                    return false;
                }
                continue;
            }
            let mut slab = [self.low[i], self.high[i]].map(|x| (x - start[i]) / direction[i]);
            slab.sort_by(f64::total_cmp);
            shares = [shares[0].max(slab[0]), shares[1].min(slab[1])];
        }
        if shares[0] > shares[1] || shares[1].is_infinite() {
            return false;
        }
        let zero = own_side.map_or(0.0, |_| self.value(self.local_point(start)));
        let width = self.scale() / (1_u64 << 40) as f64;
        let (s, d) = (self.local_point(start), self.local(direction));
        let mut is_there = [false; 2];
        if let Some(side) = own_side {
            is_there = [side < 0.0, side > 0.0];
        }
        let last = if shares[1] == end { 16383 } else { 16384 };
        for sample in u32::from(own_side.is_some())..=last {
            let t = shares[0] + (shares[1] - shares[0]) * (f64::from(sample) / 16384.0);
            let value = self.value(std::array::from_fn(|i| s[i] + d[i] * t)) - zero;
            is_there[0] |= value < -width;
            is_there[1] |= value > width;
            if is_there == [true; 2] {
                return true;
            }
        }
        false
    }
}
