//! Segment and truncated cone or cylinder (EXACTNESS.md, "Tube" and "Closed cone").

use glam::DVec3;

use super::{SignsTaken, near_one, signs_in_quadrant};
use crate::Cone;
use crate::number::{Number, Point4, Sign, Vector, decide};
use crate::segment::{Ends, Segment};

/// The cone's forms over one arithmetic.
struct Forms<N> {
    base: Vector<N>,
    axis: Vector<N>,
    /// `m`: the squared length of the axis.
    m: N,
    /// `r0 m`.
    base_radius_m: N,
    /// `r1 - r0`.
    widening: N,
}

impl<N: Number> Forms<N> {
    fn new(cone: &Cone) -> Self {
        let base = Vector::from_f64(cone.base);
        let axis = Vector::from_f64(cone.apex).minus(&base);
        let m = axis.dot(&axis);
        let base_radius = N::from_f64(cone.base_radius);
        Self {
            base_radius_m: base_radius.times(&m),
            widening: N::from_f64(cone.apex_radius).minus(&base_radius),
            base,
            axis,
            m,
        }
    }

    /// `z(X)`: height over the base plane, times the axis' length.
    fn z(&self, x: &Point4<N>) -> N {
        x.seen_from(&self.base).dot(&self.axis)
    }

    /// `m w - z(X)`: height under the apex plane, times the axis' length.
    fn below_apex(&self, x: &Point4<N>) -> N {
        self.m.times(&x.w).minus(&self.z(x))
    }

    /// `F(X, Y)`.
    fn polar(&self, x: &Point4<N>, y: &Point4<N>) -> N {
        let (zx, zy) = (self.z(x), self.z(y));
        let g = |z: &N, w: &N| self.base_radius_m.times(w).plus(&self.widening.times(z));
        let across = x.seen_from(&self.base).dot(&y.seen_from(&self.base));
        let off_axis = self.m.times(&across).minus(&zx.times(&zy));
        self.m
            .times(&off_axis)
            .minus(&g(&zx, &x.w).times(&g(&zy, &y.w)))
    }

    /// Returns the part of the segment between the end planes as two new ends, `None` inside if it
    /// is empty or one point.
    fn clipped(&self, ends: &Ends<N>) -> Option<Option<Ends<N>>> {
        let mut clipped = ends.clone();
        for is_apex in [false, true] {
            let height = |x: &Point4<N>| {
                if is_apex {
                    self.below_apex(x)
                } else {
                    self.z(x)
                }
            };
            let (at_start, at_light) = (height(&clipped.start), height(&clipped.light));
            let crossing =
                |clipped: &Ends<N>, u: &N, v: &N| clipped.start.blend(u, &clipped.light, v);
            match (at_start.sign()?, at_light.sign()?) {
                // A segment in an end plane keeps all of itself.
                (Sign::Zero, Sign::Zero) => {}
                (Sign::Negative | Sign::Zero, Sign::Negative | Sign::Zero) => return Some(None),
                (Sign::Negative, Sign::Positive) => {
                    clipped.start = crossing(&clipped, &at_light, &at_start.negated());
                }
                (Sign::Positive, Sign::Negative) => {
                    clipped.light = crossing(&clipped, &at_light.negated(), &at_start);
                }
                _ => {}
            }
        }
        Some(Some(clipped))
    }

    fn signs_between_planes(&self, ends: &Ends<N>) -> Option<SignsTaken> {
        let Some(clipped) = self.clipped(ends)? else {
            return Some(SignsTaken {
                negative: false,
                positive: false,
            });
        };
        signs_in_quadrant(
            &self.polar(&clipped.start, &clipped.start),
            &self.polar(&clipped.start, &clipped.light),
            &self.polar(&clipped.light, &clipped.light),
        )
    }

    /// Returns whether the segment goes through an end plane exactly in its rim, or through an apex
    /// from inside: there the other sign lies beyond the plane.
    fn crosses_rim(&self, cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        let towards_light = Point4 {
            x: ends
                .light
                .x
                .scaled(&ends.start.w)
                .minus(&ends.start.x.scaled(&ends.light.w)),
            w: N::from_f64(0.0),
        };
        for (is_apex, radius) in [(false, cone.base_radius), (true, cone.apex_radius)] {
            let height = |x: &Point4<N>| {
                if is_apex {
                    self.below_apex(x)
                } else {
                    self.z(x)
                }
            };
            let (at_start, at_light) = (height(&ends.start), height(&ends.light));
            let (u, v) = match (at_start.sign()?, at_light.sign()?) {
                (Sign::Positive, Sign::Negative) => (at_light.negated(), at_start),
                (Sign::Negative, Sign::Positive) => (at_light, at_start.negated()),
                _ => continue,
            };
            let crossing = ends.start.blend(&u, &ends.light, &v);
            if self.polar(&crossing, &crossing).sign()? != Sign::Zero {
                continue;
            }
            let is_proper = if radius == 0.0 {
                self.polar(&towards_light, &towards_light)
                    .sign()?
                    .is_negative()
            } else {
                self.polar(&crossing, &towards_light).sign()? != Sign::Zero
            };
            if is_proper {
                return Some(true);
            }
        }
        Some(false)
    }

    /// Returns whether the light is behind the wall at the start, for a wall that is part of a
    /// solid. At an apex and beyond it the polar form says nothing: there it is the light's being
    /// inside the infinite nappe.
    fn is_behind_wall(&self, ends: &Ends<N>) -> Option<bool> {
        let reach = |x: &Point4<N>| {
            self.base_radius_m
                .times(&x.w)
                .plus(&self.widening.times(&self.z(x)))
                .sign()
        };
        if reach(&ends.start)?.is_positive() {
            return Some(self.polar(&ends.start, &ends.light).sign()?.is_negative());
        }
        let light = &ends.light;
        Some(self.polar(light, light).sign()?.is_negative() && reach(light)?.is_positive())
    }

    fn is_outside(&self, x: &Point4<N>) -> Option<bool> {
        Some(
            self.polar(x, x).sign()?.is_positive()
                || self.z(x).sign()?.is_negative()
                || self.below_apex(x).sign()?.is_negative(),
        )
    }
}

/// Returns whether the segment's line surely misses the ball around the cone.
fn is_surely_missed(cone: &Cone, segment: &Segment) -> bool {
    let half = 0.5 * (cone.apex - cone.base);
    let widest = cone.base_radius.max(cone.apex_radius);
    // Rounding of the middle and of the radius, far from the origin too.
    let room = 1e-9 * (half.length() + widest) + 1e-14 * cone.base.abs().max_element();
    let radius = (half.length_squared() + widest * widest).sqrt() + room;
    super::line_surely_misses_ball(cone.base + half, radius, segment)
}

/// Returns whether the segment crosses the wall properly between the closed end planes.
pub(crate) fn tube_blocks(cone: &Cone, segment: &Segment) -> bool {
    if is_surely_missed(cone, segment) {
        return false;
    }
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        let forms = Forms::new(cone);
        let signs = forms.signs_between_planes(ends)?;
        Some((signs.negative && signs.positive) || forms.crosses_rim(cone, ends)?)
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// Returns whether the segment meets the inside of the cone with its ends closed.
pub(crate) fn cone_meets_interior(cone: &Cone, segment: &Segment) -> bool {
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        Some(Forms::new(cone).signs_between_planes(ends)?.negative)
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// Returns on which side of the wall's tangent plane at the start the light is; positive is
/// outside.
pub(crate) fn tube_side(cone: &Cone, segment: &Segment) -> Sign {
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<Sign> {
        Forms::new(cone).polar(&ends.start, &ends.light).sign()
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// Returns whether the light is behind the wall of a solid at the start.
pub(crate) fn is_behind_wall(cone: &Cone, segment: &Segment) -> bool {
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        Forms::new(cone).is_behind_wall(ends)
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// Returns whether the light is strictly outside the cone with its ends closed.
pub(crate) fn cone_is_outside(cone: &Cone, segment: &Segment) -> bool {
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        Forms::new(cone).is_outside(&ends.light)
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// The own rule of an open tube: the segment goes inwards and meets the wall again.
pub(crate) fn own_tube_blocks(cone: &Cone, segment: &Segment) -> bool {
    fn rule<N: Number>(cone: &Cone, ends: &Ends<N>) -> Option<bool> {
        let forms = Forms::new(cone);
        let b = forms.polar(&ends.start, &ends.light);
        let c = forms.polar(&ends.light, &ends.light);
        if !b.sign()?.is_negative() || !c.sign()?.is_positive() {
            return Some(false);
        }
        // F vanishes at the start; the other root of 2 B u v + C v^2 is u : v = C : -2B.
        let minus_two_b = b.plus(&b).negated();
        let second = ends.start.blend(&c, &ends.light, &minus_two_b);
        let is_between = !forms.z(&second).sign()?.is_negative()
            && !forms.below_apex(&second).sign()?.is_negative();
        Some(is_between)
    }
    decide(rule(cone, &segment.approximate()), || {
        rule(cone, segment.exact())
    })
}

/// A cone and a segment's line, with lengths and direction brought near 1.
struct Line {
    cone: Cone,
    axis: DVec3,
    axis_length: f64,
    from_base: DVec3,
    direction: DVec3,
    /// What distances are to be multiplied with.
    unit: f64,
}

impl Line {
    fn new(cone: &Cone, segment: &Segment) -> Self {
        let (along, from_base) = (cone.apex - cone.base, segment.origin() - cone.base);
        let direction = segment.direction();
        let widest = cone.base_radius.max(cone.apex_radius);
        let largest = along.abs().max(from_base.abs()).max_element().max(widest);
        let length_scale = near_one(largest);
        let direction_scale = near_one(direction.abs().max_element());
        let along = along * length_scale;
        Self {
            cone: Cone {
                base_radius: cone.base_radius * length_scale,
                apex_radius: cone.apex_radius * length_scale,
                ..*cone
            },
            axis: along / along.length(),
            axis_length: along.length(),
            from_base: from_base * length_scale,
            direction: direction * direction_scale,
            unit: direction_scale / length_scale,
        }
    }
}

/// Returns where a segment that goes into a closed cone, from its wall or from a cap, leaves the
/// infinite cone; infinity if it stays in it.
pub(crate) fn wall_exit(cone: &Cone, segment: &Segment, is_from_wall: bool) -> f64 {
    let Line {
        cone,
        axis,
        axis_length,
        from_base,
        direction,
        unit,
    } = Line::new(cone, segment);
    let slope = (cone.apex_radius - cone.base_radius) / axis_length;
    // As in `cone_distance`: the form a t^2 + 2 b t + c is negative inside.
    let (z, dz) = (from_base.dot(axis), direction.dot(axis));
    let (off_axis, across): (DVec3, DVec3) = (from_base - axis * z, direction - axis * dz);
    let radius = cone.base_radius + slope * z;
    let a = across.length_squared() - (slope * dz) * (slope * dz);
    let half_b = off_axis.dot(across) - radius * slope * dz;
    if is_from_wall {
        // One root is the start itself.
        return if a > 0.0 {
            (-2.0 * half_b / a).max(0.0) * unit
        } else {
            f64::INFINITY
        };
    }
    let c = (off_axis.length_squared() - radius * radius).min(0.0);
    let discriminant = half_b * half_b - a * c;
    if discriminant < 0.0 {
        f64::INFINITY
    } else if half_b > 0.0 {
        -c / (half_b + discriminant.sqrt()) * unit
    } else if a > 0.0 {
        (discriminant.sqrt() - half_b) / a * unit
    } else {
        f64::INFINITY
    }
}

/// Returns the distance of the nearest crossing with the wall, in lengths of the segment's
/// direction, once the rule has found one; for the own surface the start itself does not count.
pub(crate) fn cone_distance(cone: &Cone, segment: &Segment, is_own: bool) -> f64 {
    let Line {
        cone,
        axis,
        axis_length,
        from_base,
        direction,
        unit,
    } = Line::new(cone, segment);
    let slope = (cone.apex_radius - cone.base_radius) / axis_length;
    // |q_perp + t d_perp|^2 = (r(z) + t slope d_z)^2
    let (z, dz) = (from_base.dot(axis), direction.dot(axis));
    let (off_axis, across): (DVec3, DVec3) = (from_base - axis * z, direction - axis * dz);
    let radius = cone.base_radius + slope * z;
    let a = across.length_squared() - (slope * dz) * (slope * dz);
    let half_b = off_axis.dot(across) - radius * slope * dz;
    let c = off_axis.length_squared() - radius * radius;
    if is_own {
        return (-2.0 * half_b / a).max(0.0) * unit;
    }
    let root = (half_b * half_b - a * c).max(0.0).sqrt();
    let q = -(half_b + root.copysign(half_b));
    let roots = [c / q, q / a];
    // The rule says that a crossing exists: take the nearest that lies best between the planes.
    let outside_by = |t: f64| {
        let height = z + t * dz;
        let beyond = (-height).max(height - axis_length).max(0.0) / axis_length;
        if t.is_finite() {
            beyond + (-t).max(0.0)
        } else {
            f64::INFINITY
        }
    };
    let is_fine = |t: f64| outside_by(t) <= 1e-9;
    let [near, far] = if roots[0] <= roots[1] {
        roots
    } else {
        [roots[1], roots[0]]
    };
    let best = if is_fine(near) || outside_by(near) <= outside_by(far) {
        near
    } else {
        far
    };
    if best.is_finite() {
        best.max(0.0) * unit
    } else {
        0.0
    }
}
