//! One picture by one method, from nothing.
//!
//! In: a scene, a view, a method. Out: how long preparing and rendering took on one core, what was counted, and
//! the pixels. Eye rays and mirrored rays go through the uniform grid, whatever the method.

use std::time::Duration;

use antumbra::{
    GridResolution, IndexOptions, QuickCheck, QuickCheckVerdict, RayMethod, Refine, Refinement,
};
use antumbra_baselines::rival::formulas::{self, PaperMemory};
use antumbra_render::camera::View;
use antumbra_render::film::{self, Picture, RenderSettings, Show, Watch};
use antumbra_render::integrator::Tally;
use antumbra_render::prepare::Prepared;
use antumbra_scene::model::Scene;

use super::{GRID, VOXEL_1990};
use crate::contender::{Contender, RivalStandIn};
use crate::measure::Stopwatch;
use crate::methods::failure;
use antumbra_cli::failure::Failure;

/// What is taken a picture of.
pub(super) struct Subject {
    pub(super) scene: Scene,
    pub(super) view: View,
    /// Voxels along each axis.
    pub(super) grid: u32,
}

/// A picture and what it took.
pub(super) struct Shot {
    pub(super) prepare: Duration,
    pub(super) render: Duration,
    pub(super) tally: Tally,
    pub(super) picture: Picture,
    /// What is kept for shadow queries, mean over the lights.
    pub(super) bytes_per_light: f64,
    /// What the paper expects it to keep for one light, where it says.
    pub(super) paper_memory: Option<PaperMemory>,
}

impl Shot {
    pub(super) fn total(&self) -> Duration {
        self.prepare + self.render
    }
}

impl Subject {
    pub(super) fn new(scene: Scene, size: [u32; 2], grid: u32) -> Result<Self, Failure> {
        let camera = scene.camera.ok_or_else(|| {
            Failure::input("the scene has no camera", "take one of the paper's scenes")
        })?;
        let view =
            View::new(&camera, size).map_err(|error| Failure::input(error.to_string(), ""))?;
        Ok(Self { scene, view, grid })
    }

    /// Returns the same without lights: what a picture costs before any shadow query.
    pub(super) fn without_lights(&self) -> Self {
        let mut scene = self.scene.clone();
        scene.lights.clear();
        Self { scene, ..*self }
    }

    fn options(&self, method: Contender) -> IndexOptions {
        IndexOptions {
            method: method.method(),
            rays: RayMethod::Grid,
            grid: GridResolution::Fixed([self.grid; 3]),
            ..IndexOptions::default()
        }
    }

    /// The same with all values of `voxel` made before.
    fn eager_options(&self, method: Contender) -> IndexOptions {
        IndexOptions {
            refinement: Refinement {
                refine: Refine::Eager,
                ..Refinement::default()
            },
            ..self.options(method)
        }
    }

    /// Prepares the scene, and the rival where it answers. Returns what the paper expects a rival to keep for one
    /// light, too, where it says.
    fn prepare(
        &self,
        method: Contender,
        options: &IndexOptions,
    ) -> Result<(Prepared, Option<PaperMemory>), Failure> {
        let prepared = Prepared::new(self.scene.clone(), options)?;
        // `hybrid` counts from the eye.
        let eye = self.scene.camera.map(|camera| camera.eye);
        let rival = method.rival(prepared.index(), eye, options.memory_limit);
        Ok(match rival.map_err(failure)? {
            Some(rival) => {
                let memory = rival.paper_memory(prepared.index());
                (
                    prepared.with_stand_in(Box::new(RivalStandIn(rival))),
                    memory,
                )
            }
            None => (prepared, None),
        })
    }

    /// Prepares and renders; then renders once more with all values made before, if `eagerly`.
    pub(super) fn shoot(
        &self,
        method: Contender,
        eagerly: bool,
        stopwatch: Stopwatch,
    ) -> Result<(Shot, Option<Shot>), Failure> {
        let options = self.options(method);
        let (prepared, prepare) = stopwatch.time(|| self.prepare(method, &options));
        let (prepared, rival_memory) = prepared?;
        let shoot = |prepared: &Prepared, prepare| {
            let (rendered, render) = stopwatch.time(|| self.render(prepared, Show::Scene));
            let own_memory = (method == VOXEL_1990)
                .then(|| formulas::voxel_occlusion(prepared.index().grid_resolution()));
            Shot {
                prepare,
                render,
                tally: rendered.tally,
                picture: rendered.picture,
                bytes_per_light: prepared.bytes_per_light(),
                paper_memory: own_memory.or(rival_memory),
            }
        };
        let first = shoot(&prepared, prepare);
        if !eagerly {
            return Ok((first, None));
        }
        let options = self.eager_options(method);
        let (prepared, prepare) = stopwatch.time(|| self.prepare(method, &options));
        let second = shoot(&prepared?.0, prepare);
        Ok((first, Some(second)))
    }

    /// Prepares and renders by settings.
    pub(super) fn shoot_with(
        &self,
        method: Contender,
        settings: &RenderSettings,
        stopwatch: Stopwatch,
    ) -> Result<Shot, Failure> {
        let (prepared, prepare) = stopwatch.time(|| self.prepare(method, &self.options(method)));
        let (prepared, paper_memory) = prepared?;
        let (rendered, render) = stopwatch.time(|| self.render_with(&prepared, settings));
        Ok(Shot {
            prepare,
            render,
            tally: rendered.tally,
            picture: rendered.picture,
            bytes_per_light: prepared.bytes_per_light(),
            paper_memory,
        })
    }

    /// Returns how the queries of what each pixel shows first are decided, in false colors: by values that are made
    /// meanwhile, or all before.
    pub(super) fn decided_by(&self, method: Contender, eagerly: bool) -> Result<Picture, Failure> {
        let options = if eagerly {
            self.eager_options(method)
        } else {
            self.options(method)
        };
        let (prepared, _) = self.prepare(method, &options)?;
        Ok(self.render(&prepared, Show::Occlusion).picture)
    }

    /// Returns what the quick check of Paper 7.3 says.
    pub(super) fn quick_check(&self) -> Result<Option<QuickCheckVerdict>, Failure> {
        let options = IndexOptions {
            quick_check: QuickCheck::Report,
            ..self.options(GRID)
        };
        let prepared = Prepared::new(self.scene.clone(), &options)?;
        Ok(prepared.index().quick_check())
    }

    fn render(&self, prepared: &Prepared, show: Show) -> film::Rendered {
        let settings = RenderSettings {
            show,
            ..RenderSettings::default()
        };
        self.render_with(prepared, &settings)
    }

    fn render_with(&self, prepared: &Prepared, settings: &RenderSettings) -> film::Rendered {
        // A picture that is stopped with the task that it is taken for counts as none.
        let (task, whole) = (antumbra_task::Task::default(), antumbra_task::current());
        let watch = Watch {
            task: &task,
            progress: &|_| whole.check(),
        };
        film::render(prepared, &self.view, settings, watch)
    }
}
