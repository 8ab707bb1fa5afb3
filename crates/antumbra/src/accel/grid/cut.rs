//! Which voxels a triangle meets, found by cutting it.
//!
//! In: a triangle and the voxels around its box. Out: each voxel that the triangle meets once the voxel is inflated
//! by the margin, once. The triangle is cut into layers of voxels, each layer into rows along the longest side of the
//! block, and what is left of a row is a range of voxels: a long thin triangle costs as many steps as it has rows.
//!
//! Cuts are rounded by some roundings of the largest coordinate. Layers and rows are twice the margin wider than
//! their voxels, and so are ranges, which covers that and the margin.

use antumbra_geometry::DVec3;

use super::{Block, Layout};

/// Calls `visit` with each voxel of a block that a triangle may meet. The block is that around the triangle's box.
pub(super) fn for_each_voxel(
    layout: &Layout,
    block: &Block,
    corners: [DVec3; 3],
    mut visit: impl FnMut([u32; 3]),
) {
    let side = |axis: &usize| block.to[*axis] - block.from[*axis];
    let mut axes = [0, 1, 2];
    axes.sort_unstable_by_key(side);
    let [layers, rows, along] = axes;
    let room = 2.0 * layout.margin;
    let slab = |axis: usize, number: u32| {
        [
            layout.plane(axis, number) - room,
            layout.plane(axis, number + 1) + room,
        ]
    };
    let numbers = |axis: usize, [low, high]: [f64; 2]| {
        layout.voxel_along(axis, low - room)..=layout.voxel_along(axis, high + room)
    };
    let corners = corners.map(|corner| axes.map(|axis| corner[axis]));
    for layer in block.from[layers]..block.to[layers] {
        antumbra_task::check();
        // The outline of what lies in the layer: each of three sides may begin in it, come in and go out.
        let mut outline = [[0.0; 2]; 9];
        let mut count = 0;
        let mut of_rows = EMPTY;
        let slab_of_layer = slab(layers, layer);
        let sides = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| [corners[a], corners[b]]);
        for [[a, rest_of_a @ ..], [b, rest_of_b @ ..]] in sides {
            cut([a, b], slab_of_layer, |share| {
                let point = [0, 1].map(|i| between(rest_of_a[i], rest_of_b[i], share));
                outline[count] = point;
                count += 1;
                grow(&mut of_rows, point[0]);
            });
        }
        if count == 0 {
            continue;
        }
        let outline = &outline[..count];
        for row in numbers(rows, of_rows) {
            let slab_of_row = slab(rows, row);
            let mut range = EMPTY;
            for (number, &[a, x]) in outline.iter().enumerate() {
                let [b, y] = outline[if number + 1 < count { number + 1 } else { 0 }];
                cut([a, b], slab_of_row, |share| {
                    grow(&mut range, between(x, y, share));
                });
            }
            if range[0] > range[1] {
                continue;
            }
            for number in numbers(along, range) {
                let mut voxel = [0; 3];
                voxel[layers] = layer;
                voxel[rows] = row;
                voxel[along] = number;
                visit(voxel);
            }
        }
    }
}

const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn grow([low, high]: &mut [f64; 2], coordinate: f64) {
    *low = low.min(coordinate);
    *high = high.max(coordinate);
}

/// Calls `visit` with shares of the way from `a` to `b`: zero if `a` is in the slab, and where the way enters and
/// leaves it, in order.
#[inline(always)]
fn cut([a, b]: [f64; 2], [low, high]: [f64; 2], mut visit: impl FnMut(f64)) {
    // The difference of two numbers is rounded by a share of itself, and so is the quotient: it is right to a few
    // roundings also where the way hardly rises, and at most one.
    let share_at = |plane: f64| (plane - a) / (b - a);
    let (is_rising, is_falling) = (a < b, b < a);
    if a < low {
        if b >= low {
            visit(share_at(low));
        }
    } else if a > high {
        if b <= high {
            visit(share_at(high));
        }
    } else {
        visit(0.0);
    }
    if is_rising && a <= high && b > high {
        visit(share_at(high));
    }
    if is_falling && a >= low && b < low {
        visit(share_at(low));
    }
}

#[inline(always)]
fn between(x: f64, y: f64, share: f64) -> f64 {
    if share == 0.0 { x } else { x + (y - x) * share }
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, Occluders, Opacity, SurfaceId};

    use super::*;

    /// A generator of numbers that is the same everywhere (Knuth's constants).
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn no_voxel_is_forgotten_or_told_twice_and_few_are_told_in_vain() {
        let random = &mut Random(9);
        let (mut told_count, mut met_count) = (0, 0);
        for number in 0..600 {
            let scale = [1.0, 1e-30, 1e12][number % 3];
            let far = [0.0, 0.0, 1e3][number / 3 % 3] * scale;
            let thickness = [1.0, 1e-3, 1e-12][number / 9 % 3];
            // Often on a lattice, where corners and sides lie in planes of voxels.
            let lattice = [0.0, 4.0, 1.0][number / 27 % 3];
            let mut coordinate = || {
                let x = 2.0 * random.unit() - 1.0;
                if lattice > 0.0 {
                    (lattice * x).round() / lattice
                } else {
                    x
                }
            };
            let mut point = || DVec3::new(coordinate(), coordinate(), coordinate());
            let (a, b, c) = (point(), point(), point());
            let corners = [a, b, a + (b - a) * 0.3 + (c - a) * thickness];
            let corners = corners.map(|corner| corner * scale + DVec3::splat(far));
            let bounds = Bounds {
                min: DVec3::splat(far - scale),
                max: DVec3::splat(far + scale),
            };
            let mut builder = Occluders::builder();
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
            let occluders = builder.build();
            let resolution = [[8; 3], [1, 16, 5], [31, 2, 9]][number / 81 % 3];
            let layout = Layout::new(bounds, resolution);
            let mut told = vec![0; layout.voxel_count()];
            let block = layout.block_around(&Bounds::of_points(corners));
            for_each_voxel(&layout, &block, corners, |voxel| {
                told[layout.index(voxel)] += 1;
            });
            for voxel in layout.whole().voxels() {
                let told = told[layout.index(voxel)];
                let is_met =
                    occluders.may_meet_box(SurfaceId(0), &layout.inflated(&Block::from(voxel)));
                assert!(told <= 1, "{number}: {voxel:?} is told {told} times");
                assert!(told == 1 || !is_met, "{number}: {voxel:?} is forgotten");
                told_count += told;
                met_count += i32::from(is_met);
            }
        }
        assert!(
            told_count <= met_count + met_count / 8,
            "{told_count} {met_count}"
        );
    }
}
