use antumbra::*;
use antumbra_render::prepare::*;
fn main() {
    for path in std::env::args().skip(1) {
        let loaded =
            antumbra_scene::read::read_file(std::path::Path::new(&path), &Default::default())
                .unwrap();
        let mut scene = loaded.scene;
        scene.lights.truncate(1);
        let p = Prepared::new(
            scene,
            &PrepareOptions {
                method: Method::Grid,
                rays: RayMethod::Grid,
                ..PrepareOptions::default()
            },
        )
        .unwrap();
        let oc = p.gathered().occluders();
        let n = oc.surface_count() as f64;
        let t = std::time::Instant::now();
        let mesh = antumbra_geometry::Mesh::new(oc);
        println!(
            "{path} n {n}: mesh {:.0} ns/surface",
            t.elapsed().as_secs_f64() * 1e9 / n
        );
        let light = p.index().lights()[0];
        let t = std::time::Instant::now();
        let s = oc.light_sides(&light);
        println!(
            "  sides {:.0} ns/surface {}",
            t.elapsed().as_secs_f64() * 1e9 / n,
            s.len()
        );
        let c = mesh
            .edges()
            .iter()
            .filter(|e| mesh.is_contour(e, &s))
            .count();
        println!("  edges {} contours {}", mesh.edges().len(), c);
        for refine in [Refine::Lazy, Refine::Asked, Refine::Asked] {
            let t = std::time::Instant::now();
            p.gathered()
                .index(
                    &p.scene().lights,
                    &PrepareOptions {
                        method: Method::Voxel,
                        rays: RayMethod::Bvh,
                        refinement: Refinement {
                            refine,
                            ..Refinement::default()
                        },
                        ..PrepareOptions::default()
                    },
                )
                .unwrap();
            println!(
                "  {refine:?} {:.0} ns/surface",
                t.elapsed().as_secs_f64() * 1e9 / n
            );
        }
    }
}
