//! Airlight against adaptive Simpson quadrature of the definition, along the ray.

use antumbra_geometry::DVec3;

use super::{Fog, FogError, PointView, Shine};

/// Distance between what is found and what is expected, as a share.
const ERROR: f64 = 1e-9;

/// Integrates by Simpson's rule, halving what is not yet within `tolerance`.
fn simpson(of: &dyn Fn(f64) -> f64, [begin, end]: [f64; 2], tolerance: f64) -> f64 {
    struct Piece {
        ends: [f64; 2],
        values: [f64; 3],
        whole: f64,
        depth: u32,
    }
    let rule = |width: f64, [a, m, b]: [f64; 3]| width / 6.0 * (a + 4.0 * m + b);
    let middle = |[a, b]: [f64; 2]| a + 0.5 * (b - a);
    let values = [of(begin), of(middle([begin, end])), of(end)];
    let mut open = vec![Piece {
        ends: [begin, end],
        values,
        whole: rule(end - begin, values),
        depth: 0,
    }];
    let (mut sum, mut lost) = (0.0, 0.0_f64);
    while let Some(Piece {
        ends: [a, b],
        values: [fa, fm, fb],
        whole,
        depth,
    }) = open.pop()
    {
        let m = middle([a, b]);
        let (first, second) = (of(middle([a, m])), of(middle([m, b])));
        let (left, right) = ([fa, first, fm], [fm, second, fb]);
        let [one, two] = [rule(m - a, left), rule(b - m, right)];
        let off = one + two - whole;
        if depth > 3 && (off.abs() <= tolerance * (b - a) / (end - begin) || depth == 24) {
            // Neumaier's sum: there are many small terms.
            let term = one + two + off / 15.0;
            let more: f64 = sum + term;
            lost += if sum.abs() >= term.abs() {
                (sum - more) + term
            } else {
                (term - more) + sum
            };
            sum = more;
            continue;
        }
        let depth = depth + 1;
        open.push(Piece {
            ends: [a, m],
            values: left,
            whole: one,
            depth,
        });
        open.push(Piece {
            ends: [m, b],
            values: right,
            whole: two,
            depth,
        });
    }
    sum + lost
}

/// Integrates piece by piece around 0, each as long as it is far from there but for a scale.
fn by_pieces(of: &dyn Fn(f64) -> f64, scale: f64, [begin, end]: [f64; 2], more: &[f64]) -> f64 {
    let steps = (0..60).map(|step| scale * f64::from(step - 1).exp2());
    let mut places: Vec<f64> = steps.flat_map(|step| [-step, step]).collect();
    places.extend([begin, end, 0.0]);
    places.extend(more);
    places.retain(|&place| begin <= place && place <= end);
    places.sort_by(f64::total_cmp);
    places.dedup();
    let pieces = || places.windows(2).map(|pair| [pair[0], pair[1]]);
    let coarse = |[a, b]: [f64; 2]| {
        let middles = (0..64).map(|i| a + (b - a) * (f64::from(i) + 0.5) / 64.0);
        middles.map(of).sum::<f64>() * (b - a) / 64.0
    };
    let tolerance = 2e-11 * pieces().map(coarse).sum::<f64>() / places.len() as f64;
    pieces().map(|piece| simpson(of, piece, tolerance)).sum()
}

/// Returns the airlight of a point light, as it is defined, integrated along the ray from the point nearest to the light.
fn defined(fog: &Fog, nearest: f64, distance: f64, falls_off: bool, [begin, end]: [f64; 2]) -> f64 {
    let of = |off: f64| {
        let way = off.hypot(distance);
        let power = if falls_off { 1.0 / (way * way) } else { 1.0 };
        let left = (-fog.extinction() * (off + nearest + way)).exp();
        fog.extinction() * fog.albedo() * fog.phase(-off / way) * power * left
    };
    // What is farther is dark, and would only cost time.
    let dark = begin.max(nearest) + 60.0 / fog.extinction();
    by_pieces(
        &of,
        distance,
        [begin - nearest, end.min(dark) - nearest],
        &[],
    )
}

fn assert_close(found: f64, expected: f64, what: &dyn std::fmt::Debug) {
    let is_close = (found - expected).abs() <= ERROR * expected.abs();
    assert!(
        is_close,
        "{what:?}: {found} is not {expected}: {:e}",
        (found - expected) / expected
    );
}

/// Numbers between 0 and 1 that look random and are not.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 0_u64;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn point_lights_agree_with_adaptive_quadrature() {
    let mut number = numbers();
    let mut between = |low: f64, high: f64| low + (high - low) * number();
    for case in 0..400 {
        let fog = Fog::new(
            between(-7.0, 5.0).exp2(),
            between(0.1, 1.0),
            between(-0.95, 0.95),
        )
        .unwrap();
        let nearest = between(-4.0, 8.0);
        let distance = between(-20.0, 3.0).exp2();
        let begin = between(0.0, 6.0);
        let end = begin + between(-12.0, 4.0).exp2();
        let falls_off = case % 2 == 0;
        let view = PointView::of_lengths(nearest, distance, falls_off);
        let found = view.airlight(&fog, begin, end);
        let expected = defined(&fog, nearest, distance, falls_off, [begin, end]);
        if expected > 1e-290 {
            assert_close(found, expected, &(fog, view, begin, end));
        }
    }
}

#[test]
fn nasty_rays_agree_with_adaptive_quadrature() {
    for g in [-0.95, 0.0, 0.95] {
        for extinction in [1e-9, 0.3, 200.0] {
            let fog = Fog::new(extinction, 1.0, g).unwrap();
            for falls_off in [false, true] {
                for (nearest, distance, ends) in [
                    // Nearly through the light; up to it; from it on; away from it.
                    (2.0, 1e-7, [0.0, 5.0]),
                    (2.0, 1e-7, [0.0, 2.0]),
                    (2.0, 1e-7, [2.0, 5.0]),
                    (-1.0, 1e-7, [0.0, 5.0]),
                    // Nearly without end, from near and from far.
                    (1.0, 0.5, [0.0, 1e6]),
                    (-1e4, 3.0, [0.0, 1e5]),
                    (1e-3, 1e3, [0.0, 1e5]),
                    // Hardly any length.
                    (0.5, 0.25, [0.4, 0.4 + 1e-6]),
                ] {
                    let view = PointView::of_lengths(nearest, distance, falls_off);
                    let found = view.airlight(&fog, ends[0], ends[1]);
                    let expected = defined(&fog, nearest, distance, falls_off, ends);
                    if expected > 1e-290 {
                        assert_close(found, expected, &(fog, view, ends));
                    } else {
                        assert!(found <= 1e-280, "{found}");
                    }
                }
            }
        }
    }
}

#[test]
fn cones_and_surfaces_that_shine_agree_with_adaptive_quadrature() {
    let direction = DVec3::new(0.6, 0.0, 0.8);
    let light = DVec3::new(1.0, 0.5, 2.0);
    let origin = DVec3::new(0.1, -0.2, -0.3);
    let mut number = numbers();
    for case in 0..120 {
        let mut turned = || number() * 2.0 - 1.0;
        let axis = DVec3::new(turned(), turned(), turned()).normalize();
        let inner_cosine = 0.2 + 0.7 * number();
        let shine = match case % 4 {
            0 => Shine::Cone {
                axis,
                inner_cosine,
                outer_cosine: inner_cosine - 0.15,
            },
            1 => Shine::Cone {
                axis,
                inner_cosine,
                outer_cosine: inner_cosine,
            },
            2 => Shine::Cosine {
                normal: axis,
                is_two_sided: case % 8 < 4,
            },
            _ => Shine::Sine { axis },
        };
        let share = |point: DVec3| {
            let cosine = axis.dot((point - light).normalize());
            match shine {
                Shine::Cone {
                    inner_cosine,
                    outer_cosine,
                    ..
                } => {
                    let t = (cosine - outer_cosine) / (inner_cosine - outer_cosine);
                    let t = if inner_cosine == outer_cosine {
                        f64::from(cosine >= inner_cosine)
                    } else {
                        t.clamp(0.0, 1.0)
                    };
                    t * t * (3.0 - 2.0 * t)
                }
                Shine::Cosine {
                    is_two_sided: true, ..
                } => cosine.abs(),
                Shine::Cosine { .. } => cosine.max(0.0),
                _ => (1.0 - cosine * cosine).sqrt(),
            }
        };
        let fog = Fog::new(0.2, 0.8, 0.5).unwrap();
        let view = PointView::new([origin, direction], 6.0, light, shine, true);
        let nearest = (light - origin).dot(direction);
        let distance = (light - origin - direction * nearest).length();
        let of = |off: f64| {
            let t = off + nearest;
            let point = origin + direction * t;
            let way = (point - light).length();
            let left = (-0.2 * (t + way)).exp();
            let phase = fog.phase((point - light).dot(-direction) / way);
            0.2 * 0.8 * phase * share(point) * left / (way * way)
        };
        // The borders of cones, found by halving; without them Simpson's rule loses its order.
        let mut borders = Vec::new();
        for cosine in match shine {
            Shine::Cone {
                inner_cosine,
                outer_cosine,
                ..
            } => vec![inner_cosine, outer_cosine],
            _ => vec![0.0],
        } {
            let height = |t: f64| axis.dot((origin + direction * t - light).normalize()) - cosine;
            for step in 0..600 {
                let [mut a, mut b] = [f64::from(step), f64::from(step + 1)].map(|n| n / 100.0);
                if (height(a) < 0.0) != (height(b) < 0.0) {
                    for _ in 0..60 {
                        let m = 0.5 * (a + b);
                        if (height(a) < 0.0) == (height(m) < 0.0) {
                            a = m
                        } else {
                            b = m
                        }
                    }
                    borders.extend([a - nearest, b - nearest]);
                }
            }
        }
        let expected = by_pieces(&of, distance, [-nearest, 6.0 - nearest], &borders);
        let found = view.airlight(&fog, 0.0, 6.0);
        assert_eq!(view.is_dark(6.0), found == 0.0, "{shine:?}");
        let off = (found - expected).abs();
        assert!(
            off <= 3e-9 * expected.abs() + 1e-13,
            "{shine:?}: {found} is not {expected}"
        );
    }
}

#[test]
fn directions_agree_with_adaptive_quadrature() {
    let mut number = numbers();
    for _ in 0..100 {
        let fog = Fog::new(
            (number() * 20.0 - 12.0).exp2(),
            number(),
            number() * 1.9 - 0.95,
        )
        .unwrap();
        let cosine = 2.0 * number() - 1.0;
        let begin = 3.0 * number();
        let end = begin + (number() * 12.0 - 10.0).exp2();
        let scattered = fog.extinction() * fog.albedo() * fog.phase(cosine);
        let of = |off: f64| scattered * fog.transmittance(begin + off);
        let cut = (end - begin).min(60.0 / fog.extinction());
        let expected = by_pieces(&of, 1.0 / fog.extinction(), [0.0, cut], &[]);
        assert_close(
            fog.airlight_of_direction(cosine, begin, end),
            expected,
            &fog,
        );
    }
}

#[test]
fn a_ray_right_through_a_light_is_bright_and_finite() {
    let fog = Fog::new(0.1, 1.0, 0.0).unwrap();
    let ray = [DVec3::ZERO, DVec3::X];
    for (light, length) in [(DVec3::X, 2.0), (DVec3::ZERO, 1.0), (DVec3::X * 2.0, 2.0)] {
        let view = PointView::new(ray, length, light, Shine::Even, true);
        let found = view.airlight(&fog, 0.0, length);
        assert!(found.is_finite() && found > 1e5, "{light}: {found}");
        let even = PointView::new(ray, length, light, Shine::Even, false);
        assert!(even.airlight(&fog, 0.0, length) < 0.1);
    }
}

#[test]
fn air_that_is_thin_or_thick_without_measure_gives_no_nan() {
    for extinction in [0.0, 1e-300, 1e300, f64::MAX] {
        for g in [-0.999_999, 0.0, 0.999_999] {
            let fog = Fog::new(extinction, 1.0, g).unwrap();
            for distance in [1e-30, 1.0, 1e30] {
                let view = PointView::of_lengths(0.5, distance, true);
                for end in [0.0, 1e-30, 1.0, 1e30] {
                    let found = view.airlight(&fog, 0.0, end);
                    assert!(found >= 0.0, "{extinction} {distance} {end}: {found}");
                    assert!(fog.airlight_of_direction(1.0, 0.0, end) >= 0.0);
                }
            }
        }
    }
}

#[test]
fn the_phase_function_has_the_integral_1_and_the_mean_cosine_g() {
    for g in [-0.95, -0.3, 0.0, 0.6, 0.95] {
        let fog = Fog::new(1.0, 1.0, g).unwrap();
        let of = |power: i32| {
            // From the peak on.
            let peak = g.signum();
            let of = |off: f64| {
                let cosine = peak - peak * off;
                2.0 * std::f64::consts::PI * fog.phase(cosine) * (1.0 + cosine).powi(power)
            };
            by_pieces(&of, 1e-3, [0.0, 2.0], &[])
        };
        assert!(
            (of(0) - 1.0).abs() < 1e-10 && (of(1) - 1.0 - g).abs() < 1e-10,
            "{g}"
        );
    }
}

#[test]
fn numbers_out_of_range_are_refused_and_named() {
    for (numbers, error) in [
        ([-1.0, 1.0, 0.0], FogError::BadExtinction(-1.0)),
        (
            [f64::INFINITY, 1.0, 0.0],
            FogError::BadExtinction(f64::INFINITY),
        ),
        ([1.0, 1.5, 0.0], FogError::BadAlbedo(1.5)),
        ([1.0, 1.0, 1.0], FogError::BadG(1.0)),
        ([1.0, 1.0, -1.0], FogError::BadG(-1.0)),
    ] {
        let [extinction, albedo, g] = numbers;
        assert_eq!(Fog::new(extinction, albedo, g), Err(error));
    }
    let nan = Fog::new(f64::NAN, 1.0, 0.0).unwrap_err();
    assert!(
        nan.to_string()
            .contains("the density is NaN: expected a finite number"),
        "{nan}"
    );
}
