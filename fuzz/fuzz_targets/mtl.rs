//! MTL: whatever the bytes of a material library are, the reader of the OBJ that names it ends
//! in order; what it reads is written and read back equal.
#![no_main]

use std::path::Path;

use antumbra_scene::read::read_obj;
use libfuzzer_sys::fuzz_target;

const SCENE: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\nusemtl n\n\
    f 1 3 2\nusemtl\nf 2 3 1\n";

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("a.obj");
    let open = &mut |_: &str| Ok(bytes.to_vec());
    let Ok(first) = read_obj(file, SCENE, &Default::default(), open) else {
        return;
    };
    antumbra_fuzz::check(&first);
    antumbra_fuzz::check_obj(&first.scene);
    for material in &first.scene.materials {
        for color in [
            material.diffuse,
            material.specular,
            material.reflection,
            material.transmission,
            material.emission,
        ] {
            assert!(
                color.is_finite() && color.min_element() >= 0.0,
                "{material:?}"
            );
        }
        assert!(material.ior > 0.0 && material.shininess >= 0.0);
        assert!(material.ior.is_finite() && material.shininess.is_finite());
    }
});
