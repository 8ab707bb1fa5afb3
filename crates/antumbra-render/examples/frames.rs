use antumbra::*;
use antumbra_geometry::Start;
use antumbra_render::camera::View;
use antumbra_render::integrator::*;
use antumbra_render::orbit::camera_of_frame;
use antumbra_render::prepare::*;
use rayon::prelude::*;
fn cpu() -> f64 {
    let t = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    t.split(' ').next().unwrap().parse::<f64>().unwrap()
}
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let size: u32 = std::env::args().nth(2).map_or(512, |s| s.parse().unwrap());
    let frames: u32 = std::env::args().nth(3).map_or(4, |s| s.parse().unwrap());
    let loaded =
        antumbra_scene::read::read_file(std::path::Path::new(&path), &Default::default()).unwrap();
    let mut scene = loaded.scene;
    scene.lights.truncate(1);
    let camera = scene.camera.clone().unwrap();
    let p = Prepared::new(
        scene,
        &PrepareOptions {
            method: Method::Bvh,
            ..PrepareOptions::default()
        },
    )
    .unwrap();
    let vox = p
        .gathered()
        .index(
            &p.scene().lights,
            &PrepareOptions {
                method: Method::Voxel,
                refinement: Refinement {
                    refine: match std::env::var("REFINE").as_deref() {
                        Ok("asked") => Refine::Asked,
                        Ok("eager") => Refine::Eager,
                        _ => Refine::Lazy,
                    },
                    ..Refinement::default()
                },
                ..PrepareOptions::default()
            },
        )
        .unwrap();
    let (mut tb, mut tv) = (0.0, 0.0);
    for f in 0..frames {
        let view = View::new(&camera_of_frame(&camera, f, 30), [size, size]).unwrap();
        let rows: Vec<Vec<Start>> = (0..size)
            .into_par_iter()
            .map(|y| {
                let integ = Integrator::new(&p, 1);
                let mut tally = Tally::default();
                let mut starts = vec![];
                for x in 0..size {
                    let ray = view.ray(x as f64 + 0.5, y as f64 + 0.5);
                    if let Some(pt) = integ.first_seen(&ray, &mut tally) {
                        if let LightQuery::Asked { .. } = integ.ask(&pt, 0, &mut tally) {
                            starts.push(Start {
                                point: pt.hit.point,
                                surface: Some(pt.hit.surface),
                            });
                        }
                    }
                }
                starts
            })
            .collect();
        let starts: Vec<Start> = rows.into_iter().flatten().collect();
        let mut out = vec![false; starts.len()];
        let mut out2 = out.clone();
        let n = starts.len() as f64;
        let mut c = Counters::default();
        let t = cpu();
        p.index().shadows(&starts, 0, &mut out, &mut c).unwrap();
        let b = (cpu() - t);
        let cb = c;
        let mut c = Counters::default();
        let t = cpu();
        vox.shadows(&starts, 0, &mut out2, &mut c).unwrap();
        let v = (cpu() - t);
        assert!(out == out2);
        tb += b;
        tv += v;
        vox.set_refining(false);
        let t = cpu();
        let mut c2 = Counters::default();
        vox.shadows(&starts, 0, &mut out2, &mut c2).unwrap();
        let w = (cpu() - t);
        vox.set_refining(true);
        println!(
            "frame {f}: {n} q, bvh {:.0} ns (steps {:.1} tests {:.1}; est {:.0}), voxel {:.0} ns = {:.2}, cum {:.2}; frozen again {:.0} ns; v/l/r {:.2} {:.2} {:.2} -> {:.2} {:.2} {:.2}; bytes {} {}; {}",
            b / n,
            cb.steps as f64 / n,
            cb.intersections as f64 / n,
            65.0 + 10.0 * cb.steps as f64 / n + 4.0 * cb.intersections as f64 / n,
            v / n,
            v / b,
            tv / tb,
            w / n,
            c.shadow.first_pass as f64 / n,
            c.shadow.blocker_list as f64 / n,
            c.shadow.rays as f64 / n,
            c2.shadow.first_pass as f64 / n,
            c2.shadow.blocker_list as f64 / n,
            c2.shadow.rays as f64 / n,
            vox.occlusion_bytes(),
            vox.table_bytes(),
            vox.lazy_report()
        );
    }
}
