//! Who is measured, by the names that are typed: our methods, then the rivals of the paper's time.

use antumbra::{Answer, Counters, Method, QueryError, ShadowIndex};
use antumbra_baselines::{Rival, RivalError, RivalKind, RivalOptions, Work};
use antumbra_cli::methods::Shadows;
use antumbra_geometry::{DVec3, ReceiverPoint};
use antumbra_render::prepare::StandIn;
use clap::ValueEnum;
use clap::builder::PossibleValue;

/// A method of ours or a rival.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Contender {
    Ours(Shadows),
    Rival(RivalKind),
}

impl Contender {
    /// Returns the method of our own; for rivals the one that their shadow rays are walked by.
    pub(crate) fn method(self) -> Method {
        match self {
            Self::Ours(shadows) => shadows.method(),
            Self::Rival(_) => Method::Grid,
        }
    }

    /// Returns the name as it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ours(shadows) => shadows.name(),
            Self::Rival(kind) => kind.name(),
        }
    }

    /// Builds the rival over an index, if this is one. `viewpoint` is in world space.
    pub(crate) fn rival(
        self,
        index: &ShadowIndex,
        viewpoint: Option<DVec3>,
        memory_limit: u64,
    ) -> Result<Option<Box<dyn Rival>>, RivalError> {
        let options = RivalOptions {
            viewpoint,
            memory_limit,
            ..RivalOptions::default()
        };
        match self {
            Self::Ours(_) => Ok(None),
            Self::Rival(kind) => kind.build(index, &options).map(Some),
        }
    }
}

impl ValueEnum for Contender {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Ours(Shadows::Auto),
            Self::Ours(Shadows::Voxel),
            Self::Ours(Shadows::Voxel1990),
            Self::Ours(Shadows::Grid),
            Self::Ours(Shadows::Bvh),
            Self::Ours(Shadows::Naive),
            Self::Rival(RivalKind::LightBuffer),
            Self::Rival(RivalKind::Hybrid),
            Self::Rival(RivalKind::ShadowVolumes),
            Self::Rival(RivalKind::ShadowMap),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Ours(shadows) => shadows.to_possible_value(),
            Self::Rival(kind) => Some(PossibleValue::new(kind.name()).help(help(*kind))),
        }
    }
}

fn help(kind: RivalKind) -> &'static str {
    match kind {
        RivalKind::LightBuffer => {
            "Haines and Greenberg 1986: planes of cells round the light, with sorted candidates"
        }
        RivalKind::Hybrid => {
            "Eo and Kyung 1989: shadow polygons in the voxels of the grid, a walk where they are many"
        }
        RivalKind::ShadowVolumes => "Crow 1977: shadow volumes, counted at each point",
        RivalKind::ShadowMap => {
            "Williams 1978: a depth buffer seen from the light. Not exact: answers differ"
        }
    }
}

/// A rival in the place of an index.
#[derive(Debug)]
pub(crate) struct RivalStandIn(pub(crate) Box<dyn Rival>);

impl StandIn for RivalStandIn {
    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        counters: &mut Counters,
        candidates: &mut u64,
    ) -> Result<Answer, QueryError> {
        let mut work = Work::default();
        let answer = self.0.shadow(index, start, light, &mut work);
        counters.add(&work.counters);
        *candidates += work.candidates;
        answer
    }

    fn bytes(&self, light: usize) -> u64 {
        self.0.bytes(light)
    }
}

#[cfg(test)]
mod tests {
    use antumbra::IndexOptions;
    use antumbra_render::camera::View;
    use antumbra_render::film::{self, RenderSettings, Rendered, Watch};
    use antumbra_render::prepare::Prepared;
    use antumbra_task::Task;

    use super::*;

    fn rendered(contender: Contender, threads: usize) -> Rendered {
        let scene = antumbra_scene::generate::by_name("sphereflake", Some(2), None).unwrap();
        let camera = scene.camera.unwrap();
        let options = IndexOptions {
            method: contender.method(),
            ..IndexOptions::default()
        };
        let mut prepared = Prepared::new(scene, &options).unwrap();
        let rival = contender.rival(prepared.index(), Some(camera.eye), u64::MAX);
        if let Some(rival) = rival.unwrap() {
            prepared = prepared.with_stand_in(Box::new(RivalStandIn(rival)));
            assert!(prepared.bytes_per_light() > 0.0);
        }
        let watch = Watch {
            task: &Task::default(),
            progress: &|_| {},
        };
        let view = View::new(&camera, [64, 48]).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let render = || film::render(&prepared, &view, &RenderSettings::default(), watch);
        pool.build().unwrap().install(render)
    }

    #[test]
    fn exact_rivals_make_the_same_picture_and_their_counts_add_up() {
        let naive = rendered(Contender::Ours(Shadows::Naive), 1);
        for kind in RivalKind::ALL.into_iter().filter(|kind| kind.is_exact()) {
            for threads in [1, 3] {
                let found = rendered(Contender::Rival(kind), threads);
                assert!(found.picture == naive.picture, "{}", kind.name());
                let shadow = found.tally.counters.shadow;
                assert_eq!(shadow.shadowed, naive.tally.counters.shadow.shadowed);
                assert_eq!(
                    shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays,
                    found.tally.queries - found.tally.facing_away - found.tally.out_of_cone
                );
                // Where shadow rays cost less than shadow polygons, hybrid sends them all.
                if kind != RivalKind::Hybrid {
                    assert!(shadow.first_pass > 0 && found.tally.candidates > 0);
                }
            }
        }
    }

    #[test]
    fn a_shadow_map_makes_another_picture() {
        let naive = rendered(Contender::Ours(Shadows::Naive), 1);
        let map = rendered(Contender::Rival(RivalKind::ShadowMap), 1);
        assert!(map.picture != naive.picture);
    }

    #[test]
    fn names_are_what_is_typed_and_none_is_forgotten() {
        let all = Contender::value_variants();
        assert_eq!(all.len(), Shadows::ALL.len() + RivalKind::ALL.len());
        for &contender in all {
            assert_eq!(Contender::from_str(contender.name(), false), Ok(contender));
        }
    }
}
