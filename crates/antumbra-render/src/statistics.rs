//! The figures of a run: the stable schema of `--stats-json`.
//!
//! In: a [`Tally`] and times. Out: a struct whose JSON form is a promise: fields are added, never
//! renamed or given another meaning, without [`SCHEMA`] going up. Seconds and bytes throughout;
//! what is not known is `null`.
//!
//! Invariant: `shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays`
//! equals `shadow.queries - shadow.facing_away - shadow.out_of_cone`; `light_samples.facing_away + light_samples.umbra +
//! light_samples.penumbra + light_samples.lit` equals `light_samples.points`.

use antumbra::QuickCheckVerdict;
use serde::Serialize;

use crate::integrator::Tally;

/// The version of the schema.
pub const SCHEMA: u32 = 1;

/// Everything that `--stats-json` writes.
#[derive(Clone, Debug, Serialize)]
pub struct Statistics {
    /// [`SCHEMA`].
    pub schema: u32,
    /// The scene file as it was named.
    pub scene: String,
    /// Pictures rendered.
    pub frames: u32,
    /// How often surfaces were gathered and the shadow index built: once, whatever the frames.
    pub preparations: u32,
    /// Whether no tile is missing.
    pub is_complete: bool,
    /// Settings that were asked for.
    pub settings: Settings,
    /// Rays.
    pub rays: Rays,
    /// Shadow queries of lights without size.
    pub shadow: ShadowQueries,
    /// Samples of lights with size.
    pub light_samples: LightSampleCounts,
    /// Shadow queries where the surface has a relief, `null` where none has any.
    pub bumps: Option<BumpCounts>,
    /// Segments of rays in fog, `null` without.
    pub fog: Option<FogCounts>,
    /// Work in the grid and the tree, all rays.
    pub traversal: Traversal,
    /// Wall-clock times.
    pub time: Times,
    /// Memory.
    pub memory: MemoryUse,
    /// The quick check of Paper 7.3, `null` unless asked for.
    pub quick_check: Option<Verdict>,
}

/// Settings that were asked for.
#[derive(Clone, Debug, Serialize)]
pub struct Settings {
    /// `auto`, `voxel`, `voxel-1990`, `grid`, `bvh` or `naive`.
    pub shadows: String,
    /// Whether the answers are the reference's, so that the picture is the same whoever made it: `true` unless a
    /// stand-in answered.
    pub is_exact: bool,
    /// The method in use: another one where the quick check was to be obeyed.
    pub shadows_used: String,
    /// Method that finds nearest hits: `bvh` or `grid`.
    pub rays: String,
    /// Voxels along x, y, z.
    pub grid: [u32; 3],
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub spp: u32,
    /// Samples of each light with size at each hit.
    pub light_samples: u32,
    /// Whether lights with size had their exact visible fraction where that has a closed form.
    pub exact_fractions: bool,
    /// Whether see-through surfaces colored light.
    pub colored_shadows: bool,
    /// Whether surfaces had the reliefs of their materials.
    pub bumps: bool,
    /// Density, albedo and g of the fog, `null` without.
    pub fog: Option<[f64; 3]>,
    /// Whether rays went through pixel corners instead.
    pub corner_rays: bool,
    /// The longest chain of rays.
    pub max_depth: u32,
    /// The jitter's seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// `scene` or `occlusion`.
    pub show: String,
    /// `auto`, `fixed`, or `none` where the file keeps linear values.
    pub exposure: String,
    /// The stops by which the picture was brightened; all frames have the first one's.
    pub exposure_stops: f64,
    /// The layers made beside the picture: `shadow`, `decided`, `fog`.
    pub aovs: Vec<String>,
}

/// Counts of rays.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rays {
    /// From the eye.
    pub primary: u64,
    /// From the eye that hit.
    pub primary_hits: u64,
    /// Mirrored.
    pub reflection: u64,
    /// Refracted.
    pub refraction: u64,
    /// Gone on straight behind a surface that does not cover everything.
    pub passed: u64,
    /// All of them, the shadow rays walked and the samples of lights with size that were asked.
    pub total: u64,
}

/// Counts of shadow queries.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ShadowQueries {
    /// One per shaded hit and light, those not asked included.
    pub queries: u64,
    /// Not asked: the surface faces away.
    pub facing_away: u64,
    /// Not asked: outside the spot's cone.
    pub out_of_cone: u64,
    /// Decided by the start's voxel.
    pub first_pass: u64,
    /// Decided by a voxel on the way.
    pub intermediate: u64,
    /// Decided by a blocker list.
    pub blocker_list: u64,
    /// Decided by a full walk.
    pub rays: u64,
    /// Asked and found blocked.
    pub shadowed: u64,
}

/// Counts of samples of lights with size.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LightSampleCounts {
    /// One per shaded hit and light with size.
    pub points: u64,
    /// Points of which no sample was asked: the surface or the light faces away.
    pub facing_away: u64,
    /// Points that no sample reaches that was asked.
    pub umbra: u64,
    /// Points that some samples reach that were asked.
    pub penumbra: u64,
    /// Points that all samples reach that were asked.
    pub lit: u64,
    /// Samples of all points.
    pub samples: u64,
    /// Samples asked.
    pub asked: u64,
    /// Samples asked and found blocked.
    pub blocked: u64,
    /// Points that the exact visible fraction answered, without samples.
    pub exact: u64,
}

/// Counts of shadow queries where the surface has a relief; all count under [`ShadowQueries`], too.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BumpCounts {
    /// One for each of them about a light in front of the surface.
    pub queries: u64,
    /// Of `queries`, those that took no perturbed test: all that it may have asked is known to be lit.
    pub known_lit: u64,
    /// Of `queries`, those that took no perturbed test: all that it may have asked is known to be in shadow.
    pub known_shadowed: u64,
    /// Of `queries`, those that took the perturbed test.
    pub perturbed: u64,
}

/// Counts of segments of rays in fog.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FogCounts {
    /// One for each ray and light, or sample of a light with size, whose lit stretches were asked.
    pub segments: u64,
    /// Lit stretches of all segments.
    pub intervals: u64,
    /// Of `segments`, those whose lit stretches have no closed form: points between were asked.
    pub by_parts: u64,
}

/// Work in the grid and the tree.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Traversal {
    /// Voxels entered and nodes visited.
    pub steps: u64,
    /// Surfaces tested; by stand-ins also what they test in place of surfaces.
    pub intersections: u64,
    /// Number of candidates that stand-ins found listed where their queries looked; 0 for the index's own methods.
    pub candidates: u64,
}

/// Wall-clock times in seconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Times {
    /// Reading the scene.
    pub load_s: f64,
    /// Gathering surfaces, building grid and values.
    pub prepare_s: f64,
    /// Rendering all frames, writing files left out.
    pub render_s: f64,
}

/// Memory in bytes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct MemoryUse {
    /// Occlusion values, without lists and tables.
    pub occlusion_bytes: u64,
    /// Bytes kept for shadow queries, beside surfaces, grid and tree, mean over the lights: values, lists
    /// and tables, or all that a stand-in keeps.
    pub bytes_per_light: f64,
    /// Bytes that all that lights know has taken of the memory that it may take.
    pub knowledge_bytes: u64,
    /// How often some of it was dropped, since it had taken all of that.
    pub evictions: u64,
    /// Lights for which something was not made for want of room: rays answer in its place.
    pub lights_without_room: usize,
    /// Bytes that the program expected to take at its height, before it took them: scene, surfaces, picture, grid, tree,
    /// values and what lights know.
    pub predicted_bytes: u64,
    /// The process at its largest; `null` where the system does not say.
    pub peak_bytes: Option<u64>,
}

/// Verdict of the quick check.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Verdict {
    /// Mean share of the voxels that an element occupies, 0..1.
    pub occupied_share: f64,
    /// The share below which the check advises against.
    pub threshold: f64,
    /// Whether voxel occlusion testing is advised.
    pub is_advised: bool,
}

impl From<QuickCheckVerdict> for Verdict {
    fn from(verdict: QuickCheckVerdict) -> Self {
        Self {
            occupied_share: verdict.occupied_share,
            threshold: verdict.threshold,
            is_advised: verdict.is_advised,
        }
    }
}

impl From<&Tally> for Rays {
    fn from(tally: &Tally) -> Self {
        let secondary = tally.reflection + tally.refraction + tally.passed;
        Self {
            primary: tally.primary,
            primary_hits: tally.primary_hits,
            reflection: tally.reflection,
            refraction: tally.refraction,
            passed: tally.passed,
            total: tally.primary + secondary + tally.counters.shadow.rays + tally.area.asked,
        }
    }
}

impl From<&Tally> for ShadowQueries {
    fn from(tally: &Tally) -> Self {
        let shadow = &tally.counters.shadow;
        Self {
            queries: tally.queries,
            facing_away: tally.facing_away,
            out_of_cone: tally.out_of_cone,
            first_pass: shadow.first_pass,
            intermediate: shadow.intermediate,
            blocker_list: shadow.blocker_list,
            rays: shadow.rays,
            shadowed: shadow.shadowed,
        }
    }
}

impl From<&Tally> for LightSampleCounts {
    fn from(tally: &Tally) -> Self {
        let area = &tally.area;
        Self {
            points: area.points,
            facing_away: area.facing_away,
            umbra: area.umbra,
            penumbra: area.penumbra,
            lit: area.lit,
            samples: area.samples,
            asked: area.asked,
            blocked: area.blocked,
            exact: area.exact,
        }
    }
}

impl From<&Tally> for BumpCounts {
    fn from(tally: &Tally) -> Self {
        let bumps = &tally.bumps;
        Self {
            queries: bumps.queries,
            known_lit: bumps.known_lit,
            known_shadowed: bumps.known_shadowed,
            perturbed: bumps.perturbed,
        }
    }
}

impl From<&Tally> for FogCounts {
    fn from(tally: &Tally) -> Self {
        let air = &tally.air;
        Self {
            segments: air.segments,
            intervals: air.intervals,
            by_parts: air.by_parts,
        }
    }
}

impl From<&Tally> for Traversal {
    fn from(tally: &Tally) -> Self {
        Self {
            steps: tally.counters.steps,
            intersections: tally.counters.intersections,
            candidates: tally.candidates,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_names_are_the_promised_ones() {
        let statistics = Statistics {
            schema: SCHEMA,
            scene: "tetra.nff".into(),
            frames: 1,
            preparations: 1,
            is_complete: true,
            settings: Settings {
                shadows: "grid".into(),
                is_exact: true,
                shadows_used: "grid".into(),
                rays: "bvh".into(),
                grid: [1, 2, 3],
                size: [4, 5],
                spp: 1,
                light_samples: 16,
                exact_fractions: false,
                colored_shadows: true,
                bumps: true,
                fog: Some([0.5, 1.0, 0.0]),
                corner_rays: false,
                max_depth: 5,
                seed: 0,
                threads: 2,
                show: "scene".into(),
                exposure: "auto".into(),
                exposure_stops: -1.5,
                aovs: vec!["shadow".into()],
            },
            rays: (&Tally {
                primary: 2,
                reflection: 3,
                refraction: 4,
                passed: 5,
                ..Tally::default()
            })
                .into(),
            shadow: (&Tally::default()).into(),
            light_samples: (&Tally::default()).into(),
            bumps: Some((&Tally::default()).into()),
            fog: Some((&Tally::default()).into()),
            traversal: (&Tally::default()).into(),
            time: Times::default(),
            memory: MemoryUse::default(),
            quick_check: None,
        };
        let json = serde_json::to_value(&statistics).unwrap();
        for path in [
            "/rays/primary",
            "/rays/primary_hits",
            "/rays/reflection",
            "/rays/refraction",
            "/rays/passed",
            "/rays/total",
            "/shadow/queries",
            "/shadow/facing_away",
            "/shadow/out_of_cone",
            "/shadow/first_pass",
            "/shadow/intermediate",
            "/shadow/blocker_list",
            "/shadow/rays",
            "/shadow/shadowed",
            "/light_samples/points",
            "/light_samples/facing_away",
            "/light_samples/umbra",
            "/light_samples/penumbra",
            "/light_samples/lit",
            "/light_samples/samples",
            "/light_samples/asked",
            "/light_samples/blocked",
            "/light_samples/exact",
            "/bumps/queries",
            "/bumps/known_lit",
            "/bumps/known_shadowed",
            "/bumps/perturbed",
            "/settings/bumps",
            "/fog/segments",
            "/fog/intervals",
            "/fog/by_parts",
            "/settings/fog",
            "/settings/exact_fractions",
            "/settings/colored_shadows",
            "/settings/light_samples",
            "/traversal/steps",
            "/traversal/intersections",
            "/traversal/candidates",
            "/memory/bytes_per_light",
            "/settings/is_exact",
            "/time/load_s",
            "/time/prepare_s",
            "/time/render_s",
            "/memory/occlusion_bytes",
            "/memory/predicted_bytes",
            "/memory/peak_bytes",
            "/frames",
            "/preparations",
            "/quick_check",
            "/settings/rays",
            "/settings/grid",
            "/settings/exposure",
            "/settings/exposure_stops",
            "/settings/aovs",
        ] {
            assert!(json.pointer(path).is_some(), "{path} is missing");
        }
        assert_eq!(json["rays"]["total"], 14);
    }
}
