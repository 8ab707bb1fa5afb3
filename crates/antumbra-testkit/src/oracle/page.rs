//! The formulas of `EXACTNESS.md`, letter by letter in homogeneous coordinates, against the
//! oracle's own ones. A difference is a slip in one of the two.

use std::array;

use super::*;
use crate::{fixtures, nasty};

/// A homogeneous point.
#[derive(Clone)]
struct Point {
    x: Vec3,
    w: Exact,
}

impl Point {
    fn new(x: [f64; 3]) -> Self {
        Self {
            x: Vec3::new(x),
            w: Exact::ONE,
        }
    }

    fn combine(u: &Exact, s: &Self, v: &Exact, l: &Self) -> Self {
        Self {
            x: &s.x.scale(u) + &l.x.scale(v),
            w: u * &s.w + v * &l.w,
        }
    }
}

/// The direction from `s` to `l`: `w_S l - w_L s`.
fn direction(s: &Point, l: &Point) -> Point {
    Point::combine(&s.w, l, &-&l.w, s)
}

/// Where the line through two points on strictly opposite sides of a plane meets it.
fn crossing(s: &Point, height_s: &Exact, l: &Point, height_l: &Exact) -> Point {
    Point::combine(&height_l.abs(), s, &height_s.abs(), l)
}

fn det3(rows: [[&Exact; 3]; 3]) -> Exact {
    let [[a, b, c], [d, e, f], [g, h, i]] = rows;
    a * &(e * i - f * h) - b * &(d * i - f * g) + c * &(d * h - e * g)
}

/// Sign of the determinant with the four points as rows.
fn det(points: [&Point; 4]) -> i8 {
    let mut sum = Exact::ZERO;
    for row in 0..4 {
        let others: Vec<&Point> = (0..4).filter(|&r| r != row).map(|r| points[r]).collect();
        let minor = det3(array::from_fn(|r| array::from_fn(|c| &others[r].x.0[c])));
        let term = &points[row].w * &minor;
        sum = if row % 2 == 1 {
            &sum + &term
        } else {
            &sum - &term
        };
    }
    sum.sign()
}

/// The axis of the largest component, the lowest on ties.
fn dominant_axis(normal: &Vec3) -> usize {
    let mut k = 0;
    for axis in 1..3 {
        if normal.0[axis].abs().compare(&normal.0[k].abs()).is_gt() {
            k = axis;
        }
    }
    k
}

fn plane_start(normal: &Vec3, anchor: &Vec3, p: [f64; 3]) -> Point {
    let k = dominant_axis(normal);
    let p = Vec3::new(p);
    let mut value = normal.dot(anchor);
    for axis in (0..3).filter(|&axis| axis != k) {
        value = &value - &(&normal.0[axis] * &p.0[axis]);
    }
    let mut x = p.scale(&normal.0[k]);
    x.0[k] = value;
    let w = normal.0[k].clone();
    if w.sign() < 0 {
        Point {
            x: x.scale(&-&Exact::ONE),
            w: -&w,
        }
    } else {
        Point { x, w }
    }
}

/// The nearest point of the closed triangle: `p` itself where it lies over the triangle, else the
/// nearest of the nearest points of the edges, the first of `ab`, `bc`, `ca` on ties.
fn triangle_start(corners: [[f64; 3]; 3], p: [f64; 3]) -> Point {
    let normal = normal_of(corners);
    let k = dominant_axis(&normal);
    let seen = |x: [f64; 3]| {
        let mut x = Point::new(x);
        x.x.0[k] = Exact::ZERO;
        x
    };
    let flat = seen(p);
    let [a, b, c] = corners.map(seen);
    let sides = [(&a, &b), (&b, &c), (&c, &a)]
        .map(|(e, f)| (&f.x - &e.x).cross(&(&flat.x - &e.x)).0[k].sign());
    if sides.iter().all(|&x| x >= 0) || sides.iter().all(|&x| x <= 0) {
        return plane_start(&normal, &Vec3::new(corners[0]), p);
    }
    let mut nearest: Option<(Point, Exact)> = None;
    for i in 0..3 {
        let [e, f] = [i, (i + 1) % 3].map(|i| Vec3::new(corners[i]));
        let [e_seen, f_seen] = [i, (i + 1) % 3].map(|i| seen(corners[i]).x);
        let edge = &f_seen - &e_seen;
        // The foot of the perpendicular is e + (v / w) (f - e), v held between 0 and w.
        let w = edge.norm_squared();
        let mut v = edge.dot(&(&flat.x - &e_seen));
        if v.sign() < 0 {
            v = Exact::ZERO;
        } else if v.compare(&w).is_gt() {
            v = w.clone();
        }
        let x = &e.scale(&w) + &(&f - &e).scale(&v);
        let mut away = &x - &flat.x.scale(&w);
        away.0[k] = Exact::ZERO;
        let distance = away.norm_squared();
        let is_nearer = nearest.as_ref().is_none_or(|(other, least)| {
            // distance / w^2 < least / other.w^2
            (&distance * &other.w.square())
                .compare(&(least * &w.square()))
                .is_lt()
        });
        if is_nearer {
            nearest = Some((Point { x, w }, distance));
        }
    }
    nearest.unwrap().0
}

fn height(normal: &Vec3, anchor: &Vec3, point: &Point) -> Exact {
    normal.dot(&point.x) - &point.w * &normal.dot(anchor)
}

fn sphere_form(center: &Vec3, radius: &Exact, x: &Point, y: &Point) -> Exact {
    let [p, q] = [x, y].map(|z| &z.x - &center.scale(&z.w));
    p.dot(&q) - radius.square() * &x.w * &y.w
}

struct TubeForm {
    b: Vec3,
    a: Vec3,
    m: Exact,
    r0: Exact,
    r1: Exact,
}

impl TubeForm {
    fn of(shape: OracleShape) -> Option<Self> {
        let OracleShape::Tube {
            base,
            base_radius,
            apex,
            apex_radius,
        } = shape
        else {
            return None;
        };
        let b = Vec3::new(base);
        let a = &Vec3::new(apex) - &b;
        let m = a.norm_squared();
        Some(Self {
            b,
            a,
            m,
            r0: Exact::new(base_radius),
            r1: Exact::new(apex_radius),
        })
    }

    fn q(&self, x: &Point) -> Vec3 {
        &x.x - &self.b.scale(&x.w)
    }

    fn z(&self, x: &Point) -> Exact {
        self.q(x).dot(&self.a)
    }

    /// The heights over the base's plane and under the apex's.
    fn rooms(&self, x: &Point) -> [Exact; 2] {
        let z = self.z(x);
        [z.clone(), &self.m * &x.w - z]
    }

    fn is_between_ends(&self, x: &Point) -> bool {
        self.rooms(x).iter().all(|room| room.sign() >= 0)
    }

    fn g(&self, x: &Point) -> Exact {
        &self.r0 * &(&self.m * &x.w) + (&self.r1 - &self.r0) * self.z(x)
    }

    fn f(&self, x: &Point, y: &Point) -> Exact {
        let inner = &self.m * &self.q(x).dot(&self.q(y)) - self.z(x) * self.z(y);
        &self.m * &inner - self.g(x) * self.g(y)
    }
}

fn disk_data(shape: OracleShape) -> Option<(Vec3, Vec3, Exact)> {
    match shape {
        OracleShape::Disk {
            center,
            normal,
            radius,
        } => Some((Vec3::new(center), Vec3::new(normal), Exact::new(radius))),
        OracleShape::Cap {
            base,
            apex,
            radius,
            at_apex,
        } => {
            let (b, e) = (Vec3::new(base), Vec3::new(apex));
            let a = &e - &b;
            let (c, n) = if at_apex {
                (e, a)
            } else {
                (b, a.scale(&-&Exact::ONE))
            };
            Some((c, n, Exact::new(radius)))
        }
        _ => None,
    }
}

fn normal_of(corners: [[f64; 3]; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::new);
    (&b - &a).cross(&(&c - &a))
}

fn is_degenerate(shape: OracleShape) -> bool {
    match shape {
        OracleShape::Triangle(corners) => normal_of(corners).is_zero(),
        OracleShape::Sphere { radius, .. } => radius == 0.0,
        OracleShape::Disk { normal, radius, .. } => radius == 0.0 || normal == [0.0; 3],
        OracleShape::Cap {
            base, apex, radius, ..
        } => radius == 0.0 || base == apex,
        OracleShape::Tube {
            base,
            base_radius,
            apex,
            apex_radius,
        } => base == apex || (base_radius == 0.0 && apex_radius == 0.0),
    }
}

struct Page<'a> {
    oracle: &'a Oracle,
    s: Option<usize>,
    start: Point,
    light: Point,
}

impl<'a> Page<'a> {
    fn new(oracle: &'a Oracle, p: [f64; 3], s: Option<usize>, light: OracleLight) -> Self {
        let light = match light {
            OracleLight::Point(x) => Point::new(x),
            OracleLight::Direction(x) => Point {
                x: Vec3::new(x),
                w: Exact::ZERO,
            },
        };
        let shape = s
            .map(|s| oracle.surfaces[s].shape)
            .filter(|&shape| !is_degenerate(shape));
        let start = match shape {
            Some(OracleShape::Triangle(corners)) => triangle_start(corners, p),
            Some(shape) => match disk_data(shape) {
                Some((c, n, _)) => plane_start(&n, &c, p),
                None => Point::new(p),
            },
            None => Point::new(p),
        };
        Self {
            oracle,
            s,
            start,
            light,
        }
    }

    fn side(&self, s: usize) -> i8 {
        let shape = self.oracle.surfaces[s].shape;
        if is_degenerate(shape) {
            return 0;
        }
        let (start, light) = (&self.start, &self.light);
        match shape {
            OracleShape::Triangle(corners) => {
                height(&normal_of(corners), &Vec3::new(corners[0]), light).sign()
            }
            OracleShape::Sphere { center, radius } => {
                sphere_form(&Vec3::new(center), &Exact::new(radius), start, light).sign()
            }
            OracleShape::Tube { .. } => TubeForm::of(shape).unwrap().f(start, light).sign(),
            _ => {
                let (c, n, _) = disk_data(shape).unwrap();
                height(&n, &c, light).sign()
            }
        }
    }

    /// Whether the light is behind part `s` of the closed cone with the given wall.
    fn is_behind(&self, s: usize, wall: &TubeForm) -> bool {
        let (start, light) = (&self.start, &self.light);
        if !matches!(self.oracle.surfaces[s].shape, OracleShape::Tube { .. }) {
            self.side(s) < 0
        } else if wall.g(start).sign() > 0 {
            wall.f(start, light).sign() < 0
        } else {
            wall.f(light, light).sign() < 0 && wall.g(light).sign() > 0
        }
    }

    fn blocks(&self, t: usize) -> bool {
        let surface = self.oracle.surfaces[t];
        if !surface.opaque || is_degenerate(surface.shape) {
            return false;
        }
        let (start, light) = (&self.start, &self.light);
        let own_shape = self.s.map(|s| self.oracle.surfaces[s].shape);
        // own rules
        if let Some(s) = self.s {
            let closed =
                |i: usize| self.oracle.closed_tube[i].map(|i| self.oracle.surfaces[i].shape);
            if let (Some(own), Some(other)) = (closed(s), closed(t))
                && own == other
            {
                let form = TubeForm::of(own).unwrap();
                let is_outside = form.f(light, light).sign() > 0
                    || form.rooms(light).iter().any(|room| room.sign() < 0);
                let has_points = !direction(start, light).x.is_zero();
                return self.is_behind(s, &form) && is_outside && has_points;
            }
            if closed(s).is_none() && closed(t).is_none() && own_shape == Some(surface.shape) {
                match surface.shape {
                    OracleShape::Sphere { center, radius } => {
                        let (c, r) = (Vec3::new(center), Exact::new(radius));
                        return self.side(s) < 0 && sphere_form(&c, &r, light, light).sign() > 0;
                    }
                    OracleShape::Tube { .. } => {
                        let form = TubeForm::of(surface.shape).unwrap();
                        let (b, c) = (form.f(start, light), form.f(light, light));
                        let y = Point::combine(&c, start, &-&b.double(), light);
                        return b.sign() < 0 && c.sign() > 0 && form.is_between_ends(&y);
                    }
                    _ => {}
                }
            }
            if s == t {
                return false;
            }
        }
        match surface.shape {
            OracleShape::Triangle(corners) => self.triangle(corners),
            OracleShape::Sphere { center, radius } => {
                let (center, r) = (Vec3::new(center), Exact::new(radius));
                let a = sphere_form(&center, &r, start, start);
                let b = sphere_form(&center, &r, start, light);
                let c = sphere_form(&center, &r, light, light);
                let between = b.sign() < 0 && b.square().compare(&(&a * &c)).is_gt();
                (a.sign() > 0 || c.sign() > 0) && (a.sign() < 0 || c.sign() < 0 || between)
            }
            OracleShape::Tube { .. } => self.tube(&TubeForm::of(surface.shape).unwrap()),
            OracleShape::Disk { .. } | OracleShape::Cap { .. } => {
                let (c, n, r) = disk_data(surface.shape).unwrap();
                let (hs, hl) = (height(&n, &c, start), height(&n, &c, light));
                let y = crossing(start, &hs, light, &hl);
                let off = &y.x - &c.scale(&y.w);
                hs.sign() * hl.sign() < 0
                    && off
                        .norm_squared()
                        .compare(&(r.square() * y.w.square()))
                        .is_le()
            }
        }
    }

    fn triangle(&self, corners: [[f64; 3]; 3]) -> bool {
        let (start, light) = (&self.start, &self.light);
        // Signs at the start, or where they are zero at the middle of its own triangle.
        let own = self.s.map(|s| self.oracle.surfaces[s].shape);
        let middle = match own.filter(|&shape| !is_degenerate(shape)) {
            Some(OracleShape::Triangle([a, b, c])) => Some(Point {
                x: &(&Vec3::new(a) + &Vec3::new(b)) + &Vec3::new(c),
                w: Exact::new(3.0),
            }),
            _ => None,
        };
        let sign = |form: &dyn Fn(&Point) -> i8| match (form(start), &middle) {
            (0, Some(middle)) => form(middle),
            (sign, _) => sign,
        };
        let normal = normal_of(corners);
        let anchor = Vec3::new(corners[0]);
        let start_side = sign(&|x| height(&normal, &anchor, x).sign());
        if start_side * height(&normal, &anchor, light).sign() >= 0 {
            return false;
        }
        let t = corners.map(Point::new);
        let turns = [0, 1, 2].map(|i| sign(&|x| det([x, light, &t[i], &t[(i + 1) % 3]])));
        turns.iter().all(|&x| x >= 0) || turns.iter().all(|&x| x <= 0)
    }

    fn tube(&self, form: &TubeForm) -> bool {
        self.has_both_signs_between_ends(form)
            || (0..2).any(|end| self.crosses_end_of_wall(form, end))
    }

    /// All candidates for extreme values of the form: both ends of the part between the end
    /// planes, and where `F` is stationary along the segment.
    fn has_both_signs_between_ends(&self, form: &TubeForm) -> bool {
        let (start, light) = (&self.start, &self.light);
        let (room_s, room_l) = (form.rooms(start), form.rooms(light));
        let mut candidates = vec![start.clone(), light.clone()];
        for i in 0..2 {
            if room_s[i].sign() * room_l[i].sign() < 0 {
                candidates.push(crossing(start, &room_s[i], light, &room_l[i]));
            }
        }
        // In homogeneous coordinates the sign of F changes at roots only; between two roots
        // (-B/C twice) the middle one is u : v = C : -B, and also u : v = -B : A.
        let (a, b, c) = (
            form.f(start, start),
            form.f(start, light),
            form.f(light, light),
        );
        for (u, v) in [(c.clone(), -&b), (-&b, a)] {
            for (u, v) in [(u.clone(), v.clone()), (-&u, -&v)] {
                if u.sign() > 0 && v.sign() > 0 {
                    candidates.push(Point::combine(&u, start, &v, light));
                }
            }
        }
        let signs: Vec<i8> = candidates
            .iter()
            .filter(|x| form.is_between_ends(x))
            .map(|x| form.f(x, x).sign())
            .collect();
        signs.contains(&1) && signs.contains(&-1)
    }

    /// Whether the segment goes through an end plane exactly in its rim or apex, from inside to
    /// outside or the other way round.
    fn crosses_end_of_wall(&self, form: &TubeForm, end: usize) -> bool {
        let (start, light) = (&self.start, &self.light);
        let radius = [&form.r0, &form.r1][end];
        let [hs, hl] = [start, light].map(|x| form.rooms(x)[end].clone());
        if hs.sign() * hl.sign() >= 0 {
            return false;
        }
        let y = crossing(start, &hs, light, &hl);
        let d = direction(start, light);
        form.f(&y, &y).is_zero()
            && if radius.is_zero() {
                form.f(&d, &d).sign() < 0
            } else {
                !form.f(&y, &d).is_zero()
            }
    }
}

fn compare(oracle: &Oracle, p: [f64; 3], s: Option<usize>, light: OracleLight, label: &str) {
    let page = Page::new(oracle, p, s, light);
    let start = oracle.segment(p, s, light).start;
    let step = &start.scaled.scale(&page.start.w) - &page.start.x.scale(&start.scale);
    assert!(step.is_zero(), "{label}: start {p:?} {s:?}");
    if let Some(s) = s {
        assert_eq!(
            page.side(s),
            oracle.light_side(p, s, light),
            "{label}: side {p:?} {s} {light:?}"
        );
    }
    for t in 0..oracle.surfaces().len() {
        assert_eq!(
            page.blocks(t),
            oracle.blocks(t, p, s, light),
            "{label}: does {t} block {p:?} of {s:?} from {light:?}?"
        );
    }
}

#[test]
fn the_page_gives_the_oracles_answer_in_nasty_scenes() {
    for seed in 0..180 {
        let scene = nasty::scene(seed);
        let label = scene.label();
        let oracle = Oracle::new(scene.surfaces);
        for query in scene.queries.iter().take(16) {
            for &light in &scene.lights {
                compare(&oracle, query.point, query.surface, light, &label);
            }
        }
    }
}

#[test]
fn the_page_gives_the_oracles_answer_in_fixtures() {
    for fixture in fixtures::all() {
        let oracle = Oracle::new(fixture.surfaces);
        for query in fixture.queries {
            let light = fixture.lights[query.light];
            compare(&oracle, query.point, query.surface, light, fixture.name);
        }
    }
}
