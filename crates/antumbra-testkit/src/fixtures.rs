//! Named scenes with answers that geometry gives, each a counterexample to some simpler rule.
//!
//! The expected answers were found by thought; a test asserts that the oracle agrees. Where an
//! answer is a matter of convention and not of geometry, `expected` is `None`: then only
//! agreement between implementations is asked for.
//!
//! All faces are triangles, and all triangles come before all other surfaces; closed cones are
//! listed tube, base cap, apex cap. So an index here is the number the library gives the surface
//! when faces and shapes are added in this order.

use crate::build::{cuboid, floor, lerp, nudged, quad};
use crate::oracle::{OracleLight, OracleSurface};

/// One question of a fixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixtureQuery {
    /// Where the start is, in world space.
    pub point: [f64; 3],
    /// The index of the surface it lies on; `None` for a free query.
    pub surface: Option<usize>,
    /// The index of the light.
    pub light: usize,
    /// Whether the segment is blocked, where geometry says so.
    pub expected: Option<bool>,
}

/// A named scene with its questions.
#[derive(Clone, Debug)]
pub struct Fixture {
    /// A name to find it by in a failure message.
    pub name: &'static str,
    /// Triangles first, then the other shapes.
    pub surfaces: Vec<OracleSurface>,
    /// The lights that queries refer to.
    pub lights: Vec<OracleLight>,
    /// The questions.
    pub queries: Vec<FixtureQuery>,
    /// What goes wrong here with simpler rules.
    pub why: &'static str,
}

impl Fixture {
    fn new(
        name: &'static str,
        why: &'static str,
        surfaces: impl Into<Vec<OracleSurface>>,
        lights: impl Into<Vec<OracleLight>>,
    ) -> Self {
        Self {
            name,
            surfaces: surfaces.into(),
            lights: lights.into(),
            queries: Vec::new(),
            why,
        }
    }

    fn ask(
        &mut self,
        light: usize,
        surface: impl Into<Option<usize>>,
        point: [f64; 3],
    ) -> &mut Self {
        let surface = surface.into();
        self.queries.push(FixtureQuery {
            point,
            surface,
            light,
            expected: None,
        });
        self
    }

    fn expect(&mut self, answer: bool) {
        let query = self
            .queries
            .last_mut()
            .expect("a question comes before its answer");
        query.expected = Some(answer);
    }

    fn lit(&mut self, light: usize, surface: impl Into<Option<usize>>, point: [f64; 3]) {
        self.ask(light, surface, point).expect(false);
    }

    fn blocked(&mut self, light: usize, surface: impl Into<Option<usize>>, point: [f64; 3]) {
        self.ask(light, surface, point).expect(true);
    }
}

/// All fixtures.
pub fn all() -> Vec<Fixture> {
    vec![
        valley(),
        grazing_floor(),
        grazing_tilted_floor(),
        piercing_at_shared_vertex(),
        slab_top(),
        closed_room(),
        glass_joined_to_opaque(),
        doubled_faces(),
        light_inside_sphere(),
        touching_spheres(),
        open_tube(),
        open_cone(),
        coplanar_overlap(),
        t_junction_crease(),
        light_on_surface(),
        light_in_plane(),
        start_is_light(),
        cube_edges(),
        utm_coordinates(),
        disk_rim(),
        cylinder_on_floor(),
        cone_under_light_on_axis(),
        degenerate_surfaces(),
        ends_of_the_segment(),
    ]
}

const UP: OracleLight = OracleLight::Direction([0.0, 0.0, 1.0]);

/// Two faces that meet in a crease and are both lit, with starts on and next to the crease.
pub fn valley() -> Fixture {
    let (a, b) = ([0.1, 0.2, 0.3], [0.4, 2.3, 0.7]);
    let (left, right) = ([-2.1, 1.0, 1.2], [2.5, 1.1, 1.4]);
    let mut fixture = Fixture::new(
        "valley",
        "a point of the crease, rounded, may lie a hair behind the other face; lifted along its \
         own normal it lies well behind it",
        [
            OracleSurface::triangle([a, b, left]),
            OracleSurface::triangle([b, a, right]),
        ],
        [
            OracleLight::Point([0.3, 1.2, 9.0]),
            OracleLight::Direction([0.05, -0.02, 1.0]),
        ],
    );
    for light in 0..2 {
        for surface in 0..2 {
            for step in 0..=16 {
                let on_crease = lerp(a, b, f64::from(step) / 16.0);
                fixture.lit(light, surface, on_crease);
                for axis in 0..3 {
                    fixture.lit(light, surface, nudged(on_crease, axis, true));
                    fixture.lit(light, surface, nudged(on_crease, axis, false));
                }
            }
        }
    }
    fixture
}

/// A floor with a low wall, and a light 1e-6 degrees over the floor.
pub fn grazing_floor() -> Fixture {
    let mut surfaces = floor([0.0, -4.0], [9.0, 4.0], 0.0).to_vec();
    surfaces.extend(quad([
        [5.0, -9.0, 0.0],
        [5.0, 9.0, 0.0],
        [5.0, 9.0, 1e-3],
        [5.0, -9.0, 1e-3],
    ]));
    // 9 m from the wall's foot the light is 1.57e-7 m high, about 1e-6 degrees.
    let mut fixture = Fixture::new(
        "grazing floor",
        "an offset along the normal lifts starts over the light, and a tolerance loses the wall",
        surfaces,
        [
            OracleLight::Point([14.0, 0.5, 1.57e-7]),
            OracleLight::Direction([1.0, 0.0, 1.745e-8]),
        ],
    );
    for light in 0..2 {
        for step in 1..32 {
            let y = f64::from(step % 7) - 3.3;
            let x = f64::from(step) * 0.27;
            let surface = if y < -4.0 + x * 8.0 / 9.0 { 0 } else { 1 };
            let point = [x, y, 0.0];
            if x < 5.0 {
                fixture.blocked(light, surface, point);
            } else {
                fixture.lit(light, surface, point);
            }
        }
        // The foot of the wall lies in the plane of the wall, and in the floor's.
        fixture.lit(light, 2, [5.0, 0.0, 0.0]);
        fixture.lit(light, 0, [5.0, -3.5, 0.0]);
    }
    fixture
}

/// A tilted quad of two triangles, whose points are rounded off its plane, lit at 1e-6 degrees.
pub fn grazing_tilted_floor() -> Fixture {
    // z = 0.1 x + 0.3 y, rounded
    let at = |x: f64, y: f64| [x, y, 0.1 * x + 0.3 * y];
    let corners = [at(-1.1, -1.3), at(2.3, -0.7), at(2.1, 2.9), at(-1.7, 2.3)];
    let [x, y, z] = at(40.0, 1.0);
    let mut fixture = Fixture::new(
        "grazing tilted floor",
        "starts are rounded to either side of their own plane, more than the light is over it",
        quad(corners),
        [
            OracleLight::Point([x, y, z + 7e-7]),
            OracleLight::Direction([1.0, 0.2, 0.16 + 1.75e-8]),
        ],
    );
    for light in 0..2 {
        for step in 0..40 {
            let t = f64::from(step) / 39.0;
            fixture.lit(
                light,
                0,
                lerp(corners[0], lerp(corners[1], corners[2], t), 0.7),
            );
            fixture.lit(
                light,
                1,
                lerp(corners[0], lerp(corners[2], corners[3], t), 0.6),
            );
            // on the diagonal, from both triangles
            fixture.lit(light, 0, lerp(corners[0], corners[2], t));
            fixture.lit(light, 1, lerp(corners[0], corners[2], t));
        }
    }
    fixture
}

/// Two triangles that share a vertex and pierce each other.
pub fn piercing_at_shared_vertex() -> Fixture {
    let mut fixture = Fixture::new(
        "piercing at a shared vertex",
        "a rule that exempts neighbours round a vertex misses that they pierce each other",
        [
            OracleSurface::triangle([[0.0, 0.0, 0.0], [4.0, -2.0, 0.0], [4.0, 2.0, 0.0]]),
            OracleSurface::triangle([[0.0, 0.0, 0.0], [4.0, 0.0, -1.0], [4.0, 0.0, 1.0]]),
        ],
        [OracleLight::Point([2.0, 5.0, 3.0])],
    );
    // Light is at y > 0 and z > 0. The first lies in z = 0, the second in y = 0.
    fixture.blocked(0, 0, [3.0, -0.5, 0.0]);
    fixture.blocked(0, 0, [3.0, -0.01, 0.0]);
    fixture.blocked(0, 0, [3.0, -f64::MIN_POSITIVE, 0.0]);
    fixture.lit(0, 0, [3.0, 0.5, 0.0]);
    fixture.lit(0, 0, [3.0, 0.0, 0.0]);
    fixture.lit(0, 0, [0.0, 0.0, 0.0]);
    fixture.lit(0, 1, [3.0, 0.0, 0.3]);
    fixture.blocked(0, 1, [3.0, 0.0, -0.3]);
    fixture.blocked(0, 1, [3.0, 0.0, -1e-30]);
    fixture.lit(0, 1, [3.0, 0.0, 0.0]);
    fixture.lit(0, 1, [0.0, 0.0, 0.0]);
    fixture
}

/// A slab, with points over and under its top.
pub fn slab_top() -> Fixture {
    let mut fixture = Fixture::new(
        "slab top",
        "a voxel that straddles the top is covered by the rest of the slab, yet its top is lit",
        cuboid([0.0, 0.0, 0.0], [4.0, 4.0, 1.0]),
        [OracleLight::Point([2.5, 1.5, 10.0]), UP],
    );
    for light in 0..2 {
        for (x, y) in [(2.0, 1.0), (3.0, 1.0), (0.5, 0.25), (3.75, 0.5)] {
            fixture.lit(light, 10, [x, y, 1.0]);
            fixture.lit(light, None, [x, y, 1.0]);
            fixture.lit(light, None, [x, y, 1.0f64.next_up()]);
            fixture.blocked(light, None, [x, y, 1.0f64.next_down()]);
            fixture.blocked(light, None, [x, y, 0.5]);
            fixture.blocked(light, 9, [x, y, 0.0]);
            fixture.blocked(light, None, [x, y, -3.0]);
        }
        fixture.lit(light, None, [-30.0, 2.0, 0.5]);
    }
    fixture
}

/// A closed room with outward winding, a block in it, and the light inside.
pub fn closed_room() -> Fixture {
    let mut surfaces = cuboid([0.0; 3], [4.0; 3]);
    surfaces.extend(cuboid([1.5, 1.5, 0.5], [2.5, 2.5, 1.0]));
    let mut fixture = Fixture::new(
        "closed room",
        "all faces of the room look away from the light; leaving out back faces lights \
         everything, or darkens everything",
        surfaces,
        [OracleLight::Point([2.0, 2.0, 3.0]), UP],
    );
    for (surface, point) in [
        (8, [0.5, 1.0, 0.0]),
        (9, [1.0, 0.5, 0.0]),
        (0, [0.0, 2.0, 3.0]),
        (2, [4.0, 2.0, 1.0]),
        (10, [2.0, 1.0, 4.0]),
        (22, [2.0, 1.75, 1.0]),
    ] {
        fixture.lit(0, surface, point);
        // the ceiling is between everything and the sky, but not between itself and the sky
        fixture.ask(1, surface, point).expect(surface != 10);
    }
    fixture.blocked(0, 8, [1.75, 2.0, 0.0]);
    fixture.blocked(0, 8, [2.0, 2.0, 0.0]);
    fixture.blocked(0, None, [2.0, 2.0, 0.75]);
    fixture.blocked(0, None, [-1.0, 2.0, 2.0]);
    fixture.blocked(0, None, [2.0, 2.0, 5.0]);
    fixture.lit(0, None, [2.0, 2.0, 2.0]);
    fixture.lit(1, None, [2.0, 2.0, 5.0]);
    fixture.blocked(1, None, [2.0, 2.0, 3.5]);
    fixture
}

/// An opaque quad joined to a pane of glass.
pub fn glass_joined_to_opaque() -> Fixture {
    let mut surfaces = floor([-1.0, -1.0], [3.0, 3.0], 0.0).to_vec();
    surfaces.extend(floor([0.0, 0.0], [1.0, 2.0], 1.0));
    surfaces.extend(floor([1.0, 0.0], [2.0, 2.0], 1.0).map(OracleSurface::transparent));
    let mut fixture = Fixture::new(
        "glass joined to an opaque edge",
        "by adjacency the common edge is no contour, yet it casts a shadow edge",
        surfaces,
        [UP],
    );
    fixture.blocked(0, 0, [0.5, 0.25, 0.0]);
    fixture.lit(0, 0, [1.5, 0.25, 0.0]);
    fixture.blocked(0, 0, [1.0, 0.25, 0.0]); // a face is closed
    fixture.lit(0, 0, [1f64.next_up(), 0.25, 0.0]);
    fixture.blocked(0, 0, [1f64.next_down(), 0.25, 0.0]);
    fixture.lit(0, 4, [1.5, 0.25, 1.0]);
    fixture.lit(0, 4, [1.0, 0.0, 1.0]);
    fixture.lit(0, 2, [1.0, 0.5, 1.0]);
    fixture
}

/// The same triangle three times, in both windings.
pub fn doubled_faces() -> Fixture {
    let [a, b, c] = [[0.1, 0.2, 1.3], [4.3, 0.4, 1.7], [0.7, 3.9, 2.1]];
    let mut fixture = Fixture::new(
        "doubled faces",
        "a face hides its twin, and its edges become non-manifold",
        [
            OracleSurface::triangle([a, b, c]),
            OracleSurface::triangle([c, b, a]),
            OracleSurface::triangle([b, c, a]),
        ],
        [
            UP,
            OracleLight::Direction([0.0, 0.0, -1.0]),
            OracleLight::Point([1.0, 1.0, 2.5]),
        ],
    );
    for surface in 0..3 {
        for step in 0..12 {
            let point = lerp(a, lerp(b, c, f64::from(step) / 11.0), 0.37);
            for light in 0..3 {
                fixture.lit(light, surface, point);
            }
        }
    }
    fixture.blocked(0, None, [1.0, 1.0, 0.0]);
    fixture.blocked(2, None, [1.0, 1.0, 0.0]);
    fixture.lit(1, None, [1.0, 1.0, 0.0]);
    fixture
}

/// A sphere with a light and a smaller sphere inside.
pub fn light_inside_sphere() -> Fixture {
    let mut fixture = Fixture::new(
        "light inside a sphere",
        "the umbra of a convex object is convex only for lights outside it",
        [
            OracleSurface::sphere([0.0; 3], 2.0),
            OracleSurface::sphere([1.25, 0.0, 0.0], 0.25),
        ],
        [
            OracleLight::Point([0.5, 0.0, 0.0]),
            OracleLight::Direction([1.0, 0.0, 0.0]),
        ],
    );
    fixture.blocked(0, 0, [2.0, 0.0, 0.0]); // the small sphere is between
    fixture.lit(0, 0, [-2.0, 0.0, 0.0]);
    fixture.lit(0, 1, [1.0, 0.0, 0.0]);
    fixture.blocked(0, 1, [1.5, 0.0, 0.0]);
    fixture.lit(0, None, [0.0, 1.0, 0.0]);
    fixture.blocked(0, None, [0.0, 3.0, 0.0]);
    fixture.lit(1, 0, [2.0, 0.0, 0.0]);
    fixture.blocked(1, 0, [-2.0, 0.0, 0.0]);
    fixture.blocked(1, None, [0.0, 1.0, 0.0]);
    fixture.lit(1, None, [0.0, 2.0, 0.0]); // a tangent
    fixture.blocked(1, None, [-1.0, 2f64.next_down(), 0.0]);
    fixture.lit(1, None, [0.0, 2f64.next_up(), 0.0]);
    // points of the sphere as a renderer rounds them; the small sphere is far from their segments
    for step in 0..24u8 {
        let z = f64::from(step) / 23.0 * 3.0 - 1.5;
        let r = (4.0 - z * z).sqrt();
        for (x, y) in [(-0.6, 0.8), (-0.8, -0.6), (0.0, 1.0)] {
            fixture.lit(0, 0, [r * x, r * y, z]);
        }
    }
    fixture
}

/// Two spheres that touch, one of them twice in the scene.
pub fn touching_spheres() -> Fixture {
    let mut fixture = Fixture::new(
        "touching spheres",
        "a coincident twin must not shade, and a touching neighbour must not shade the touch",
        [
            OracleSurface::sphere([0.0; 3], 1.0),
            OracleSurface::sphere([0.0; 3], 1.0),
            OracleSurface::sphere([2.0, 0.0, 0.0], 1.0),
        ],
        [
            OracleLight::Point([0.0, 5.0, 0.0]),
            OracleLight::Point([9.0, 0.0, 0.0]),
            OracleLight::Point([1.0, 4.0, 0.0]),
        ],
    );
    for twin in 0..2 {
        fixture.lit(0, twin, [0.0, 1.0, 0.0]);
        fixture.lit(0, twin, [0.6, 0.8, 0.0]);
        fixture.blocked(0, twin, [0.6, -0.8, 0.0]);
        fixture.blocked(1, twin, [1.0, 0.0, 0.0]);
        fixture.blocked(1, twin, [0.8, 0.6, 0.0]);
        // at the touch, along the common tangent plane
        fixture.lit(2, twin, [1.0, 0.0, 0.0]);
    }
    fixture.lit(2, 2, [1.0, 0.0, 0.0]);
    fixture.lit(1, 2, [3.0, 0.0, 0.0]);
    fixture
}

/// A tube without caps, lit along its axis and from the side, with starts inside and outside.
pub fn open_tube() -> Fixture {
    let tube = |base: [f64; 3], apex| OracleSurface::open_tube(base, 1.0, apex, 1.0);
    let (base, apex) = ([0.0; 3], [0.0, 0.0, 3.0]);
    let mut fixture = Fixture::new(
        "open tube",
        "it is not convex: light goes through its ends, and its inside sees and shades itself",
        [tube(base, apex), tube(base, apex)],
        [
            OracleLight::Point([0.0, 0.0, 10.0]),
            OracleLight::Point([10.0, 0.0, 1.0]),
            OracleLight::Point([10.0, 0.0, 10.0]),
            UP,
        ],
    );
    for twin in 0..2 {
        // down the axis: the inside is lit, and seen from outside the wall faces away
        fixture.lit(0, twin, [1.0, 0.0, 1.0]);
        fixture.lit(0, twin, [0.6, 0.8, 0.25]);
        fixture.lit(3, twin, [0.6, 0.8, 0.25]);
        // from the side
        fixture.lit(1, twin, [1.0, 0.0, 1.0]);
        fixture.blocked(1, twin, [-1.0, 0.0, 1.0]);
        fixture.blocked(1, twin, [0.0, 1.0, 1.0]);
        // over the rim: at x = 1 the heights are 4.19 and 2.64
        fixture.lit(2, twin, [-1.0, 0.0, 2.9]);
        fixture.blocked(2, twin, [-1.0, 0.0, 1.0]);
    }
    fixture.lit(0, None, [0.0, 0.0, 1.0]);
    fixture.lit(0, None, [0.0, 0.0, -5.0]);
    fixture.lit(3, None, [0.5, 0.5, -5.0]);
    fixture.lit(3, None, [0.5, 5.0, -5.0]);
    fixture.blocked(1, None, [0.0, 0.0, 1.0]);
    fixture.blocked(1, None, [-3.0, 0.0, 1.0]);
    fixture.lit(1, None, [-3.0, 3.0, 1.0]);
    fixture.lit(2, None, [-3.0, 0.0, 2.9]);
    fixture.blocked(2, None, [-3.0, 0.0, 1.0]);
    // in through the wall at height 2.94, out through the open top
    fixture.blocked(2, None, [-3.0, 0.0, 1.7]);
    // in through the open base, out through the wall
    fixture.blocked(1, None, [-3.0, 0.0, -0.15]);
    fixture
}

/// An open cone with its point up: a paper hat.
pub fn open_cone() -> Fixture {
    let mut fixture = Fixture::new(
        "open cone",
        "the quadric has a second nappe beyond the apex that is not there",
        [OracleSurface::open_tube(
            [0.0; 3],
            2.0,
            [0.0, 0.0, 2.0],
            0.0,
        )],
        [
            OracleLight::Point([0.0, 0.0, 10.0]),
            OracleLight::Point([0.0, 0.0, -10.0]),
            OracleLight::Point([5.0, 0.0, 1.0]),
        ],
    );
    fixture.lit(0, 0, [1.0, 0.0, 1.0]);
    fixture.lit(0, 0, [0.0, -0.5, 1.5]);
    fixture.lit(0, 0, [0.0, 0.0, 2.0]);
    // from below the light falls in through the open base
    fixture.lit(1, 0, [1.0, 0.0, 1.0]);
    fixture.lit(1, 0, [0.0, 0.0, 2.0]);
    fixture.lit(1, None, [0.0, 0.0, 1.0]);
    fixture.blocked(1, None, [0.0, 0.0, 3.0].map(|x| x + 0.125));
    fixture.blocked(0, None, [0.5, 0.25, 0.0]);
    fixture.blocked(0, None, [0.5, 0.25, -1.0]);
    fixture.lit(2, 0, [1.0, 0.0, 1.0]);
    fixture.blocked(2, 0, [-1.0, 0.0, 1.0]);
    fixture.blocked(2, None, [-3.0, 0.0, 1.0]);
    fixture.lit(2, None, [-3.0, 0.0, 3.5]); // through the other nappe
    fixture.lit(2, None, [-3.0, 0.0, -9.0]); // under the base
    fixture
}

/// Faces that overlap in one plane.
pub fn coplanar_overlap() -> Fixture {
    let mut surfaces = floor([0.0, 0.0], [4.0, 4.0], 1.0).to_vec();
    surfaces.extend(floor([1.0, 1.0], [3.0, 5.0], 1.0));
    surfaces.push(OracleSurface::triangle([
        [0.5, 0.5, 1.0],
        [1.0, 6.0, 1.0],
        [6.0, 1.0, 1.0],
    ]));
    surfaces.push(OracleSurface::opaque(crate::oracle::OracleShape::Disk {
        center: [2.0, 2.0, 1.0],
        normal: [0.0, 0.0, -3.0],
        radius: 1.0,
    }));
    let mut fixture = Fixture::new(
        "coplanar overlap",
        "faces in one plane hide each other as soon as starts move off it",
        surfaces,
        [
            OracleLight::Point([2.0, 2.0, 3.0]),
            OracleLight::Point([9.0, 2.0, 1.0 + 1e-9]),
        ],
    );
    for light in 0..2 {
        for surface in [0, 1, 2, 3, 4, 5] {
            fixture.lit(light, surface, [2.0, 2.0, 1.0]);
            // off the plane by rounding: the start is put back
            fixture.lit(light, surface, [2.25, 2.5, 1f64.next_down()]);
            fixture.lit(light, surface, [2.25, 2.5, 1f64.next_up()]);
        }
    }
    fixture.blocked(0, None, [2.0, 2.0, 0.0]);
    fixture.blocked(0, None, [2.0, 2.0, 1f64.next_down()]);
    fixture.lit(0, None, [2.0, 2.0, 1f64.next_up()]);
    fixture
}

/// A box that stands in the middle of a floor tile, with starts where they meet.
///
/// The starts a hair under the floor have no expected answer: as points they are under it, as
/// rounded points of the crease they are lit.
pub fn t_junction_crease() -> Fixture {
    let mut surfaces = floor([-4.0, -4.0], [4.0, 4.0], 0.3).to_vec();
    surfaces.extend(cuboid([-1.0, -1.0, 0.3], [1.0, 1.0, 1.7]));
    let mut fixture = Fixture::new(
        "T-junction crease",
        "wall and floor meet in a crease that is no edge of the floor, which goes on behind it",
        surfaces,
        [OracleLight::Point([9.0, 0.3, 5.0])],
    );
    // The wall x = 1 is triangles 4 and 5 of the scene.
    for step in 0..=8 {
        let y = f64::from(step) / 4.0 - 1.0;
        fixture.lit(0, 4, [1.0, y, 0.3]);
        fixture.lit(0, 4, [1.0, y, 0.3f64.next_up()]);
        fixture.ask(0, 4, [1.0, y, 0.3f64.next_down()]);
        fixture.lit(0, 0, [1.0, y, 0.3]);
        fixture.lit(0, 0, [1f64.next_up(), y, 0.3]);
        if step != 0 && step != 8 {
            // under the box
            fixture.blocked(0, 0, [1f64.next_down(), y, 0.3]);
        }
    }
    fixture.blocked(0, 0, [0.0, 0.0, 0.3]);
    fixture.blocked(0, 1, [-1.5, 0.0, 0.3]);
    fixture.lit(0, 1, [-3.5, 3.5, 0.3]);
    fixture
}

/// Lights that stand on a triangle, on a sphere and on a tube.
pub fn light_on_surface() -> Fixture {
    let mut fixture = Fixture::new(
        "light on a surface",
        "the segment ends before the light, so the light's own surface is not in its way",
        [
            OracleSurface::triangle([[0.0, 0.0, 2.0], [4.0, 0.0, 2.0], [0.0, 4.0, 2.0]]),
            OracleSurface::triangle([[0.5, 0.5, 1.0], [1.5, 0.5, 1.0], [0.5, 1.5, 1.0]]),
            OracleSurface::sphere([20.0, 0.0, 0.0], 1.0),
            OracleSurface::open_tube([40.0, 0.0, 0.0], 1.0, [40.0, 0.0, 2.0], 1.0),
        ],
        [
            OracleLight::Point([1.0, 1.0, 2.0]),
            OracleLight::Point([21.0, 0.0, 0.0]),
            OracleLight::Point([41.0, 0.0, 1.0]),
        ],
    );
    fixture.lit(0, None, [3.0, 3.0, 0.0]);
    fixture.lit(0, None, [3.0, 3.0, 4.0]);
    fixture.blocked(0, None, [0.75, 0.75, 0.0]);
    fixture.lit(0, 1, [0.75, 0.75, 1.0]);
    fixture.lit(0, 0, [2.0, 1.0, 2.0]);
    fixture.lit(1, None, [25.0, 0.0, 0.0]);
    fixture.lit(1, None, [21.0, 3.0, 0.0]);
    fixture.blocked(1, None, [15.0, 0.0, 0.0]);
    fixture.lit(1, None, [20.0, 0.0, 0.0]);
    fixture.lit(1, 2, [19.0, 0.0, 0.0]); // all of the chord is inside
    fixture.lit(1, 2, [21.0, 0.0, 0.0]);
    fixture.lit(2, None, [45.0, 0.0, 1.0]);
    fixture.blocked(2, None, [35.0, 0.0, 1.0]);
    fixture.lit(2, 3, [39.0, 0.0, 1.0]);
    fixture.lit(2, None, [40.0, 0.0, 5.0]);
    fixture
}

/// A light in the plane of a wall.
pub fn light_in_plane() -> Fixture {
    let mut surfaces = floor([-4.0, -4.0], [4.0, 4.0], 0.0).to_vec();
    surfaces.extend(quad([
        [0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 1.0],
        [0.0, -1.0, 1.0],
    ]));
    let mut fixture = Fixture::new(
        "light in the plane of a face",
        "edge-on faces have no shadow, and their own points are neither in front nor behind",
        surfaces,
        [
            OracleLight::Point([0.0, 0.25, 5.0]),
            UP,
            OracleLight::Point([0.0, 3.0, 0.5]),
        ],
    );
    for light in 0..3 {
        for x in [-1.0, -1e-300, 0.0, 1e-300, 1.0] {
            for y in [-0.5, 0.0, 0.75] {
                let surface = if y < x { 0 } else { 1 };
                fixture.lit(light, surface, [x, y, 0.0]);
            }
        }
        fixture.lit(light, 2, [0.0, 0.5, 0.25]);
        fixture.lit(light, 3, [0.0, -0.5, 0.75]);
    }
    fixture
}

/// Starts that are where the light is.
pub fn start_is_light() -> Fixture {
    let light = [0.5, 0.25, 1.0];
    let mut surfaces = vec![
        OracleSurface::triangle([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]]),
        OracleSurface::sphere([0.5, 0.25, 0.0], 1.0),
        OracleSurface::sphere(light, 1.0),
        OracleSurface::open_tube([0.5, 0.0, 0.0], 0.25, [0.5, 0.0, 2.0], 0.25),
    ];
    surfaces.extend(OracleSurface::closed_cone(
        0,
        [0.0, 0.25, 0.0],
        0.5,
        [0.0, 0.25, 1.0],
        0.5,
    ));
    let count = surfaces.len();
    let mut fixture = Fixture::new(
        "start is the light",
        "the segment has no points",
        surfaces,
        [OracleLight::Point(light)],
    );
    fixture.lit(0, None, light);
    for surface in 0..count {
        fixture.lit(0, surface, light);
    }
    fixture
}

/// The corners and edges of a cube, from each face that has them.
pub fn cube_edges() -> Fixture {
    let surfaces = cuboid([0.0; 3], [1.0; 3]);
    let mut fixture = Fixture::new(
        "edges and corners of a cube",
        "starts lie in the planes of two and three faces at once",
        surfaces.clone(),
        [
            OracleLight::Point([3.0, 4.0, 5.0]),
            OracleLight::Direction([1.0, 2.0, 3.0]),
            OracleLight::Point([0.5, 0.25, 0.75]),
        ],
    );
    for (surface, face) in surfaces.iter().enumerate() {
        let crate::oracle::OracleShape::Triangle([a, b, c]) = face.shape else {
            continue;
        };
        for point in [a, b, c, lerp(a, b, 0.5), lerp(b, c, 0.5), lerp(c, a, 0.5)] {
            // From outside, a point of the cube is hidden unless a face towards the light has it.
            let hidden = point.iter().all(|&x| x < 1.0);
            fixture.ask(0, surface, point).expect(hidden);
            fixture.ask(1, surface, point).expect(hidden);
            fixture.lit(2, surface, point);
        }
    }
    fixture
}

/// Boxes of a hand's size at coordinates of a map.
pub fn utm_coordinates() -> Fixture {
    let [ox, oy, oz] = [5e5, 5e6, 100.0];
    let at = |x: f64, y: f64, z: f64| [ox + x, oy + y, oz + z];
    let mut surfaces = floor([ox - 4.0, oy - 4.0], [ox + 4.0, oy + 4.0], oz).to_vec();
    surfaces.extend(cuboid(at(0.0, 0.0, 0.0), at(0.125, 0.125, 0.25)));
    // a valley beside it, with a crease that is not parallel to an axis
    let (a, b) = (at(2.0, 2.0, 1.0), at(2.3, 2.7, 1.1));
    surfaces.push(OracleSurface::triangle([a, b, at(1.7, 2.5, 1.3)]));
    surfaces.push(OracleSurface::triangle([b, a, at(2.8, 2.1, 1.35)]));
    let mut fixture = Fixture::new(
        "map coordinates",
        "an ulp is 1e-9 m here; differences cancel, and a tolerance is never the right one",
        surfaces,
        [
            OracleLight::Point(at(6.0, 1.0, 12.0)),
            OracleLight::Direction([0.5, 0.125, 1.0]),
        ],
    );
    for light in 0..2 {
        for step in 0..16 {
            let t = f64::from(step) / 15.0;
            fixture.lit(light, 14, lerp(a, b, t));
            fixture.lit(light, 15, lerp(a, b, t));
        }
        fixture.lit(light, 0, at(0.25, 0.0625, 0.0));
        fixture.blocked(light, 0, at(0.0625, 0.0625, 0.0)); // under the box
        fixture.lit(light, 4, at(0.125, 0.0625, 0.0));
        fixture.lit(light, 4, at(0.125, 0.0625, 0.125));
        fixture.lit(light, 12, at(0.0625, 0.0, 0.25));
        // on the lit wall's foot, and an ulp under the box
        let foot = at(0.125, 0.0625, 0.0);
        fixture.lit(light, 0, foot);
        fixture.blocked(light, 0, nudged(foot, 0, false));
        fixture.lit(light, 0, nudged(foot, 0, true));
    }
    fixture.blocked(1, 1, at(-0.0625, 0.0625, 0.0));
    fixture.lit(1, 1, at(-0.25, 0.0625, 0.0));
    fixture
}

/// The rim of a disk, hit exactly.
pub fn disk_rim() -> Fixture {
    let mut fixture = Fixture::new(
        "rim of a disk",
        "a disk is closed: its rim blocks, an ulp beyond it does not",
        [OracleSurface::opaque(crate::oracle::OracleShape::Disk {
            center: [0.0, 0.0, 1.0],
            normal: [0.0, 0.0, 0.1],
            radius: 5.0,
        })],
        [UP, OracleLight::Point([0.0, 0.0, 2.0])],
    );
    fixture.blocked(0, None, [3.0, 4.0, 0.0]);
    fixture.blocked(0, None, [3.0, -4.0, 0.0]);
    fixture.lit(0, None, [3.0, 4f64.next_up(), 0.0]);
    fixture.blocked(0, None, [3.0, 4f64.next_down(), 0.0]);
    fixture.lit(0, None, [3.0, 4.0, 1.0]);
    fixture.lit(0, 0, [3.0, 4.0, 1.0]);
    fixture.blocked(1, None, [6.0, 8.0, 0.0]); // crosses at (3, 4, 1)
    fixture.lit(1, None, [6.0, 8f64.next_up(), 0.0]);
    fixture
}

/// A closed cylinder on a floor, with starts on its rims.
pub fn cylinder_on_floor() -> Fixture {
    let mut surfaces = floor([-9.0, -9.0], [9.0, 9.0], 0.0).to_vec();
    surfaces.extend(OracleSurface::closed_cone(
        7,
        [0.0; 3],
        1.0,
        [0.0, 0.0, 2.0],
        1.0,
    ));
    let mut fixture = Fixture::new(
        "closed cylinder on a floor",
        "the base cap lies in the floor, and the rims belong to a wall and a cap at once",
        surfaces,
        [
            OracleLight::Point([5.0, 0.0, 3.0]),
            UP,
            OracleLight::Point([0.25, 0.0, 1.0]),
        ],
    );
    let (floor, wall, base, top) = (0, 2, 3, 4);
    // on the floor, where it touches the rim and elsewhere
    fixture.lit(0, floor, [1.0, 0.0, 0.0]);
    fixture.blocked(0, floor, [-1.0, 0.0, 0.0]);
    fixture.blocked(0, floor, [0.0, 1.0, 0.0]);
    fixture.blocked(0, floor, [-0.6, -0.8, 0.0]);
    fixture.blocked(0, floor, [-2.0, 0.0, 0.0]);
    fixture.lit(0, floor, [2.0, 0.0, 0.0]);
    fixture.blocked(0, floor, [-8.0, 0.0, 0.0]);
    fixture.blocked(0, floor, [0.0, 0.0, 0.0]); // under it
    fixture.blocked(1, floor, [0.5, 0.0, 0.0]);
    fixture.lit(1, floor, [1.5, 0.0, 0.0]);
    // the wall
    fixture.lit(0, wall, [1.0, 0.0, 0.0]);
    fixture.lit(0, wall, [1.0, 0.0, 1.0]);
    fixture.lit(0, wall, [1.0, 0.0, 2.0]);
    fixture.lit(0, wall, [0.6, 0.8, 1.0]);
    fixture.blocked(0, wall, [-1.0, 0.0, 1.0]);
    fixture.blocked(0, wall, [0.0, 1.0, 1.0]);
    fixture.ask(0, wall, [-1.0, 0.0, 2.0]); // faces away, but the rim itself sees the light
    fixture.lit(1, wall, [1.0, 0.0, 1.0]); // edge-on
    // the caps
    fixture.lit(0, top, [0.0, 0.0, 2.0]);
    fixture.lit(0, top, [-1.0, 0.0, 2.0]);
    fixture.lit(0, top, [0.0, 1.0, 2.0]);
    fixture.blocked(0, base, [0.0, 0.0, 0.0]);
    fixture.blocked(1, base, [0.5, 0.5, 0.0]);
    fixture.lit(1, top, [0.5, 0.5, 2.0]);
    // the light inside: lit within, dark without
    for (surface, point) in [
        (wall, [1.0, 0.0, 1.0]),
        (wall, [0.0, -1.0, 0.5]),
        (base, [0.0; 3]),
        (top, [0.0, 0.5, 2.0]),
    ] {
        fixture.lit(2, surface, point);
    }
    fixture.blocked(2, floor, [3.0, 0.0, 0.0]);
    fixture.blocked(2, None, [0.0, 0.0, 3.0]);
    fixture.lit(2, None, [0.0, 0.0, 1.5]);
    fixture
}

/// A closed cone on a floor under a light on its axis: segments through the apex exactly.
pub fn cone_under_light_on_axis() -> Fixture {
    let mut surfaces = floor([-9.0, -9.0], [9.0, 9.0], 0.0).to_vec();
    surfaces.extend(OracleSurface::closed_cone(
        1,
        [0.0; 3],
        2.0,
        [0.0, 0.0, 2.0],
        0.0,
    ));
    let mut fixture = Fixture::new(
        "cone under a light on its axis",
        "the segment leaves through the apex, where the form has no sign and no gradient",
        surfaces,
        [
            OracleLight::Point([0.0, 0.0, 10.0]),
            UP,
            OracleLight::Point([0.0, 0.0, -10.0]),
        ],
    );
    let (floor, wall, base) = (0, 2, 3);
    for light in 0..2 {
        fixture.blocked(light, floor, [0.0, -0.5, 0.0]);
        fixture.blocked(light, floor, [1e-300, 0.0, 0.0]);
        fixture.lit(light, floor, [3.0, 0.0, 0.0]);
        fixture.lit(light, wall, [1.0, 0.0, 1.0]);
        fixture.lit(light, wall, [0.0, 0.0, 2.0]);
        fixture.blocked(light, base, [0.0, -0.5, 0.0]);
        fixture.blocked(light, base, [0.0, 0.0, 0.0]);
        fixture.blocked(light, None, [0.0, 0.0, -1.0]);
    }
    // Through the apex from inside. Geometry says blocked; the page's rule sees no point outside.
    fixture.ask(0, floor, [0.0, 0.0, 0.0]);
    fixture.ask(1, floor, [0.0, 0.0, 0.0]);
    fixture.ask(0, None, [0.0, 0.0, 1.0]);
    // From the apex down through the body. Geometry says blocked; the form is 0 for every light.
    fixture.ask(2, wall, [0.0, 0.0, 2.0]);
    fixture.blocked(2, wall, [0.0, 0.5, 1.5]);
    fixture
}

/// Degenerate surfaces in a row between start and light.
pub fn degenerate_surfaces() -> Fixture {
    use crate::oracle::OracleShape::{Disk, Sphere, Tube};
    let mut surfaces = vec![
        // a point, a needle, a needle with a doubled corner
        OracleSurface::triangle([[0.0, 0.0, 1.0]; 3]),
        OracleSurface::triangle([[-1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]),
        OracleSurface::triangle([[-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]]),
    ];
    surfaces.extend(
        [
            Sphere {
                center: [0.0, 0.0, 1.0],
                radius: 0.0,
            },
            Disk {
                center: [0.0, 0.0, 1.0],
                normal: [0.0; 3],
                radius: 1.0,
            },
            Disk {
                center: [0.0, 0.0, 1.0],
                normal: [0.0, 0.0, 1.0],
                radius: 0.0,
            },
            Tube {
                base: [0.0, 0.0, 1.0],
                base_radius: 1.0,
                apex: [0.0, 0.0, 1.0],
                apex_radius: 2.0,
            },
            Tube {
                base: [-1.0, 0.0, 1.0],
                base_radius: 0.0,
                apex: [1.0, 0.0, 1.0],
                apex_radius: 0.0,
            },
        ]
        .map(OracleSurface::opaque),
    );
    let mut fixture = Fixture::new(
        "degenerate surfaces",
        "they have no normal and no inside, so they neither block nor receive",
        surfaces,
        [
            UP,
            OracleLight::Point([0.0, 0.0, 5.0]),
            OracleLight::Point([0.5, 0.0, 1.0]),
        ],
    );
    for light in 0..3 {
        fixture.lit(light, None, [0.0, 0.0, 0.0]);
        fixture.lit(light, None, [-0.5, 0.0, 1.0]);
        for surface in 0..8 {
            fixture.lit(light, surface, [0.0, 0.0, 1.0]);
        }
    }
    fixture
}

/// Surfaces before the start and beyond the light.
pub fn ends_of_the_segment() -> Fixture {
    let layer = |z: f64| OracleSurface::triangle([[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]]);
    let mut fixture = Fixture::new(
        "ends of the segment",
        "nothing behind the start and nothing beyond the light counts",
        [layer(0.0), layer(1.0), layer(3.0)],
        [
            OracleLight::Point([0.0, 0.0, 2.0]),
            OracleLight::Point([0.0, 0.0, 1.0]),
            OracleLight::Point([0.0, 0.0, 1f64.next_up()]),
            UP,
        ],
    );
    fixture.blocked(0, 0, [0.0, 0.0, 0.0]);
    fixture.lit(1, 0, [0.0, 0.0, 0.0]);
    fixture.blocked(2, 0, [0.0, 0.0, 0.0]);
    fixture.blocked(3, 0, [0.0, 0.0, 0.0]);
    fixture.lit(0, 1, [0.0, 0.0, 1.0]);
    fixture.lit(0, None, [0.5, 0.0, 1.0]);
    fixture.lit(0, None, [0.5, 0.0, 2.5]);
    fixture.lit(0, 2, [0.5, 0.0, 0.5]); // far off its plane: put back into it, beyond the light
    fixture.blocked(3, 1, [0.0, 0.0, 1.0]);
    fixture.lit(3, 2, [0.0, 0.0, 3.0]);
    fixture.lit(3, None, [0.0, 0.0, 4.0]);
    fixture
}

/// Scenes in which the page's rules part with geometry. They are not part of [`all`].
///
/// Here, other than elsewhere, `expected` is geometry's answer, and the page's is the opposite;
/// a test asserts that. When the contract closes a gap, the test fails and names the fixture,
/// which then belongs into [`all`].
pub fn contract_gaps() -> Vec<Fixture> {
    let point = OracleLight::Point;
    let solid = |base, apex| OracleSurface::closed_cone(0, base, 1.0, apex, 1.0);
    let hat = || OracleSurface::closed_cone(0, [0.0; 3], 2.0, [0.0, 0.0, 2.0], 0.0);
    let tube = |z: f64| OracleSurface::open_tube([0.0, 0.0, z], 1.0, [0.0, 0.0, z + 1.0], 1.0);
    let mut gaps = Vec::new();

    let mut gap = Fixture::new(
        "gap: out through the apex",
        "between the end planes the form is negative up to the apex, where it is 0; the caps do \
         not help, for the start is in the plane of the only one",
        [floor([-9.0, -9.0], [9.0, 9.0], 0.0).to_vec(), hat()].concat(),
        [point([0.0, 0.0, 10.0]), UP, point([1.0, 0.0, 4.0])],
    );
    for light in 0..2 {
        gap.blocked(light, 0, [0.0, 0.0, 0.0]);
        gap.blocked(light, None, [0.0, 0.0, 1.0]);
    }
    gap.blocked(2, None, [-0.25, 0.0, 1.5]);
    gaps.push(gap);

    let mut gap = Fixture::new(
        "gap: from the apex down through the body",
        "at the apex the polar form is 0 for every light, and beyond it it belongs to the other \
         nappe; so the light never counts as behind",
        hat(),
        [
            point([0.0, 0.0, -10.0]),
            OracleLight::Direction([0.1, 0.0, -1.0]),
        ],
    );
    for light in 0..2 {
        gap.blocked(light, 0, [0.0, 0.0, 2.0]);
        gap.blocked(light, 0, [0.0, 0.0, 2f64.next_up()]);
    }
    gaps.push(gap);

    let mut gap = Fixture::new(
        "gap: a pipe leaks at the rim its two tubes share",
        "neither tube has points of both signs in its own half; and in the plane of the rim \
         neither is asked. The own rule, in contrast, counts the rim as wall",
        [tube(0.0), tube(1.0)],
        [point([4.0, 0.0, 2.5]), point([4.0, 0.0, 1.0])],
    );
    gap.blocked(0, None, [0.0, 0.0, 0.5]);
    gap.blocked(1, None, [0.0, 0.0, 1.0]);
    gaps.push(gap);

    let mut surfaces = floor([-4.0, -4.0], [4.0, 4.0], 0.3).to_vec();
    surfaces.extend(cuboid([-1.0, -1.0, 0.3], [1.0, 1.0, 1.7]));
    let mut gap = Fixture::new(
        "gap: a wall's foot, rounded under a floor that goes on behind the wall",
        "wall and floor overlap seen from the light, because of the part of the floor that is \
         behind the wall; that part cannot block the wall",
        surfaces,
        [point([9.0, 0.3, 5.0])],
    );
    gap.lit(0, 4, [1.0, 0.25, 0.3f64.next_down()]);
    gap.lit(0, 5, [1.0, -0.25, 0.3f64.next_down()]);
    gaps.push(gap);

    let mut gap = Fixture::new(
        "gap: a curved wall's foot, rounded under the floor",
        "no rule for creases protects starts on curved surfaces or on disks",
        [
            floor([-9.0, -9.0], [9.0, 9.0], 0.3).to_vec(),
            solid([0.0, 0.0, 0.3], [0.0, 0.0, 2.0]),
        ]
        .concat(),
        [point([5.0, 0.0, 3.0])],
    );
    gap.lit(0, 2, [1.0, 0.0, 0.3f64.next_down()]);
    gaps.push(gap);

    let mut surfaces = solid([0.0; 3], [0.0, 0.0, 2.0]);
    surfaces.push(OracleSurface::open_tube(
        [0.0; 3],
        1.0,
        [0.0, 0.0, 2.0],
        1.0,
    ));
    surfaces.push(OracleSurface::open_tube(
        [0.0, 0.0, 2.0],
        1.0,
        [0.0; 3],
        1.0,
    ));
    let mut gap = Fixture::new(
        "gap: coincident walls that are not identical",
        "an open tube on a closed one, or with base and apex exchanged, shades its twin's points \
         where these are rounded inwards; the table says coincident cones count as one",
        surfaces,
        [point([5.0, 0.0, 1.0])],
    );
    for surface in [0, 3, 4] {
        gap.lit(0, surface, [1f64.next_down(), 0.0, 1.0]);
    }
    gaps.push(gap);

    let under_rim = [1f64.next_down(), 0.0, -1e-20];
    let mut gap = Fixture::new(
        "gap: start = light on a closed cone",
        "the own rule of closed cones does not ask whether the segment has points; the table \
         says lit",
        solid([0.0; 3], [0.0, 0.0, 2.0]),
        [point(under_rim)],
    );
    gap.lit(0, 0, under_rim);
    gaps.push(gap);
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::{Oracle, OracleShape};

    #[test]
    fn the_oracle_agrees_with_geometry() {
        let mut failures = Vec::new();
        for fixture in all() {
            let oracle = Oracle::new(fixture.surfaces.clone());
            for query in &fixture.queries {
                let FixtureQuery {
                    point,
                    surface,
                    light,
                    expected,
                } = *query;
                let light = fixture.lights[light];
                let blocked = oracle.is_blocked(point, surface, light);
                if expected.is_some_and(|expected| expected != blocked) {
                    let blockers = oracle.blockers(point, surface, light);
                    failures.push(format!(
                        "{}: {query:?}, blocked by {blockers:?}",
                        fixture.name
                    ));
                }
            }
        }
        assert!(failures.is_empty(), "{}", failures.join("\n"));
    }

    #[test]
    fn the_page_parts_with_geometry_in_the_gaps() {
        for fixture in contract_gaps() {
            let oracle = Oracle::new(fixture.surfaces);
            for query in fixture.queries {
                let FixtureQuery {
                    point,
                    surface,
                    light,
                    expected,
                } = query;
                let blocked = oracle.is_blocked(point, surface, fixture.lights[light]);
                assert_ne!(
                    Some(blocked),
                    expected,
                    "{} is closed: {query:?}",
                    fixture.name
                );
            }
        }
    }

    #[test]
    fn names_are_unique_and_triangles_come_first() {
        let fixtures = all();
        for (i, fixture) in fixtures.iter().enumerate() {
            assert!(fixtures[..i].iter().all(|other| other.name != fixture.name));
            assert!(fixture.surfaces.is_sorted_by_key(|surface| {
                !matches!(surface.shape, OracleShape::Triangle(_))
            }));
            let asserted = fixture
                .queries
                .iter()
                .filter(|query| query.expected.is_some());
            assert!(
                asserted.count() * 2 > fixture.queries.len(),
                "{}",
                fixture.name
            );
        }
    }
}
