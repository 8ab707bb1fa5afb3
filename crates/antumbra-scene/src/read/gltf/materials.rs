//! From glTF's metallic-roughness materials to Whitted's model.
//!
//! In: the document's materials. Out: the scene's. Invariant: weights are finite and not negative;
//! what decides about shadows (alpha, transmission) is taken as it is, only looks are approximate.
//!
//! With the base color `b`, metalness `m`, roughness `r`, transmission `t` and the reflectance
//! seen from the front `F = mix(((n - 1) / (n + 1))^2, b, m)` for the index of refraction `n`:
//! * the mirror's share of `F` is `s = (1 - 2 r)^2` below `r = 1/2` and nothing above, where a
//!   sharp picture would be wrong;
//! * `diffuse = b ((1 - m) (1 - t) + m (1 - s))`: what a rough metal scatters counts as diffuse,
//!   since the model has no light from all around that it could mirror;
//! * the highlight has Blinn's exponent for a GGX lobe of width `a = r^2`, `2 / a^2 - 2`, over 4
//!   for Phong's angle, and the weight that keeps its energy, `F (exponent + 8) / 8`, at most 1;
//! * `transmission = b t`; without a volume there is no refraction (a thin sheet), so the index
//!   is 1.
//!
//! KHR_materials_pbrSpecularGlossiness says the diffuse color and `F` themselves, and `1 - r`: its
//! diffuse color counts times `1 - max F`, as that extension has it.
//!
//! Of the textures, those of the base color and of normals are kept; metal, roughness, transmission and emission
//! are multiplied by the mean of theirs. Normals must lie where the base color does: a mesh has one place in textures for each
//! corner.

use crate::{
    error::{Place, quoted},
    model::{Alpha, Bump, Color, Material},
    opacity::Cause,
    warning::WarningLog,
};

use super::{
    Fault,
    document::{MaterialEntry, SpecularGlossiness, TextureUse},
    images::{Images, Means},
    placing::lie_alike,
    short_name,
};

/// Phong exponents beyond this look like a point.
const LARGEST_SHININESS: f64 = 10_000.0;

/// Normals that lean more by their scale lie flat.
const LARGEST_SCALE: f64 = 1e6;

/// Returns the texture of a material's base color.
pub(super) fn base_texture(material: &MaterialEntry) -> Option<&TextureUse> {
    if let Some(glossy) = glossy(material) {
        return glossy.diffuse_texture.as_ref();
    }
    let metallic = material.pbr_metallic_roughness.as_ref()?;
    metallic.base_color_texture.as_ref()
}

/// Returns the texture that says where on surfaces a material's textures lie.
pub(super) fn placing_texture(material: &MaterialEntry) -> Option<&TextureUse> {
    base_texture(material).or_else(|| Some(&material.normal_texture.as_ref()?.texture))
}

/// Returns the relief of a material, if its picture can be read.
fn bump(
    entry: &MaterialEntry,
    path: &str,
    images: &mut Images<'_, '_>,
    warnings: &mut WarningLog,
) -> Result<Option<Bump>, Fault> {
    let Some(normals) = entry.normal_texture.as_deref() else {
        return Ok(None);
    };
    let texture = &normals.texture;
    if base_texture(entry).is_some_and(|base| !lie_alike(base, texture)) {
        let message = "normals that lie elsewhere than the base color are not read";
        warnings.add(Place::Whole, message);
        return Ok(None);
    }
    let scale = normals.scale.unwrap_or(1.0);
    if scale.is_nan() || scale.abs() > LARGEST_SCALE {
        let problem =
            format!("expected a number from -{LARGEST_SCALE} to {LARGEST_SCALE}, found {scale}");
        return Err(Fault::at(
            format!("{path}.normalTexture.scale"),
            problem,
            "",
        ));
    }
    // Looks alone are not worth a refusal.
    let texture = images.texture(texture, warnings).unwrap_or_else(|over| {
        let message = format!("normals are not read: {}", over.kind);
        warnings.add(Place::Whole, message);
        None
    });
    Ok(texture.map(|texture| Bump::Normals { texture, scale }))
}

/// Returns what KHR_materials_pbrSpecularGlossiness says in place of metal and roughness.
fn glossy(material: &MaterialEntry) -> Option<&SpecularGlossiness> {
    material.extensions.as_ref()?.specular_glossiness.as_ref()
}

/// Turns one material into the scene's.
pub(super) fn convert(
    entry: &MaterialEntry,
    path: &str,
    images: &mut Images<'_, '_>,
    warnings: &mut WarningLog,
) -> Result<Material, Fault> {
    note_unread(entry, warnings);
    let pbr = entry.pbr_metallic_roughness.as_deref();
    let glossy = glossy(entry);
    let extensions = entry.extensions.as_deref();
    // Before any means, which can do with what has been decoded.
    let diffuse_texture = match base_texture(entry) {
        Some(texture) => images.texture(texture, warnings)?,
        None => None,
    };
    let bump = bump(entry, path, images, warnings)?;
    let mut mean = |texture: Option<&TextureUse>, decides| match texture {
        Some(texture) => Ok(images
            .means(texture, decides, warnings)?
            .unwrap_or(Means::WHITE)),
        None => Ok(Means::WHITE),
    };
    // Factors and means.
    let (base, name) = match glossy {
        Some(glossy) => (glossy.diffuse_factor, "diffuseFactor"),
        None => (pbr.and_then(|p| p.base_color_factor), "baseColorFactor"),
    };
    let base = checked(base.unwrap_or([1.0; 4]), 1.0, || format!("{path}.{name}"))?;
    let base_color = Color::new(base[0], base[1], base[2]);
    let base_mean = mean(base_texture(entry), true)?.linear;
    let base_mean = base_color * Color::new(base_mean[0], base_mean[1], base_mean[2]);
    let factor = |factor: Option<f64>, name: &str| {
        let [factor] = checked([factor.unwrap_or(1.0)], 1.0, || format!("{path}.{name}"))?;
        Ok(factor)
    };
    // Specular color and glossiness, or metal and roughness: what is not given plays no part.
    let (metalness, roughness, specular) = match glossy {
        Some(glossy) => {
            let factors = glossy.specular_factor.unwrap_or([1.0; 3]);
            let factors = checked(factors, 1.0, || format!("{path}.specularFactor"))?;
            let Means { linear, stored } =
                mean(glossy.specular_glossiness_texture.as_ref(), false)?;
            let gloss = stored[3] * factor(glossy.glossiness_factor, "glossinessFactor")?;
            let specular = Color::new(linear[0], linear[1], linear[2]);
            (
                0.0,
                1.0 - gloss,
                Some(specular * Color::from_array(factors)),
            )
        }
        None => {
            let texture = pbr.and_then(|p| p.metallic_roughness_texture.as_ref());
            let [_, rough, metal, _] = mean(texture, false)?.stored;
            let metal = metal * factor(pbr.and_then(|p| p.metallic_factor), "metallicFactor")?;
            let rough = rough * factor(pbr.and_then(|p| p.roughness_factor), "roughnessFactor")?;
            (metal, rough, None)
        }
    };
    let transmission = match extensions.and_then(|e| e.transmission.as_ref()) {
        None => 0.0,
        Some(glass) => {
            let share = factor(Some(glass.transmission_factor), "transmissionFactor")?;
            // A place that transmits makes the whole surface one that blocks no shadow ray.
            share * mean(glass.transmission_texture.as_ref(), true)?.stored[0]
        }
    };
    let emissive = checked(entry.emissive_factor.unwrap_or([0.0; 3]), f64::MAX, || {
        format!("{path}.emissiveFactor")
    })?;
    let strength = extensions.and_then(|e| e.emissive_strength.as_ref()?.emissive_strength);
    let [strength] = checked([strength.unwrap_or(1.0)], 1e100, || {
        format!("{path}.emissiveStrength")
    })?;
    let mut emission = Color::from_array(emissive) * strength;
    if emission != Color::ZERO {
        let [red, green, blue, _] = mean(entry.emissive_texture.as_deref(), false)?.linear;
        emission *= Color::new(red, green, blue);
    }
    let ior = extensions.and_then(|e| e.ior.as_ref()?.ior).unwrap_or(1.5);
    let [ior] = checked([ior], 1e6, || format!("{path}.ior"))?;
    let volume = extensions.and_then(|e| e.volume.as_ref());
    let is_thin = volume.is_none_or(|volume| volume.thickness_factor <= 0.0);

    // Whitted's weights.
    let dielectric = ((ior - 1.0) / (ior + 1.0)) * ((ior - 1.0) / (ior + 1.0));
    let front =
        specular.unwrap_or(Color::splat(dielectric) * (1.0 - metalness) + base_mean * metalness);
    let smoothness = (1.0 - 2.0 * roughness).max(0.0);
    let mirror = smoothness * smoothness;
    let width = (roughness * roughness * roughness * roughness).max(1e-12);
    let shininess = ((2.0 / width - 2.0) / 4.0).clamp(1.0, LARGEST_SHININESS);
    let scattered = match specular {
        // What is reflected is not scattered.
        Some(specular) => (1.0 - specular.max_element()) * (1.0 - transmission),
        None => (1.0 - metalness) * (1.0 - transmission) + metalness * (1.0 - mirror),
    };
    let mut material = Material {
        name: short_name(&entry.name),
        diffuse: base_color * scattered,
        diffuse_texture,
        alpha: alpha(entry, path)?,
        opacity: base[3],
        is_double_sided: entry.double_sided,
        specular: (front * ((shininess + 8.0) / 8.0)).min(Color::ONE),
        shininess,
        reflection: front * mirror,
        transmission: base_mean * (transmission * (1.0 - metalness)),
        // An index of 0 means a mirror in KHR_materials_ior.
        ior: if is_thin || ior == 0.0 { 1.0 } else { ior },
        emission,
        bump,
    };
    if extensions.is_some_and(|e| e.unlit.is_some()) {
        unlit(&mut material, base_color, warnings);
    }
    Ok(material)
}

/// KHR_materials_unlit: shines in its own color. A texture needs light in this model.
fn unlit(material: &mut Material, base_color: Color, warnings: &mut WarningLog) {
    material.specular = Color::ZERO;
    material.reflection = Color::ZERO;
    material.bump = None;
    if material.diffuse_texture.is_some() {
        let message = "an unlit material has a texture: it is lit like others";
        warnings.add(Place::Whole, message);
        material.diffuse = base_color;
    } else {
        material.diffuse = Color::ZERO;
        material.emission = base_color;
    }
}

fn alpha(entry: &MaterialEntry, path: &str) -> Result<Alpha, Fault> {
    match entry.alpha_mode.as_deref() {
        None | Some("OPAQUE") => Ok(Alpha::Opaque),
        Some("BLEND") => Ok(Alpha::Blend),
        Some("MASK") => {
            let cutoff = [entry.alpha_cutoff.unwrap_or(0.5)];
            let [cutoff] = checked(cutoff, f64::MAX, || format!("{path}.alphaCutoff"))?;
            Ok(Alpha::Mask { cutoff })
        }
        Some(other) => {
            let problem = format!("expected OPAQUE, MASK or BLEND, found {}", quoted(other));
            Err(Fault::at(format!("{path}.alphaMode"), problem, ""))
        }
    }
}

/// Says why surfaces of a material let light through.
pub(super) fn cause(material: &Material) -> Cause {
    let (what, advice) = if material.transmission != Color::ZERO {
        ("KHR_materials_transmission lets light through", "")
    } else if material.alpha == Alpha::Blend {
        (
            "`alphaMode` BLEND with an alpha below 1",
            "`alphaMode` OPAQUE or MASK would make them block",
        )
    } else {
        (
            "`alphaMode` MASK with an alpha below the cutoff everywhere",
            "",
        )
    };
    Cause {
        what: what.into(),
        advice,
    }
}

/// Says once what of a material is not used.
fn note_unread(entry: &MaterialEntry, warnings: &mut WarningLog) {
    if entry.occlusion_texture.is_some() {
        warnings.add(Place::Whole, "occlusion textures are not read");
    }
    let extensions = entry.extensions.as_ref();
    let volume = extensions.and_then(|e| e.volume.as_ref());
    if volume.is_some_and(|volume| volume.attenuation_distance.is_some()) {
        let message = "attenuation inside volumes (KHR_materials_volume) is not read";
        warnings.add(Place::Whole, message);
    }
}

/// Checks that factors are between 0 and `largest`.
fn checked<const N: usize>(
    factors: [f64; N],
    largest: f64,
    path: impl Fn() -> String,
) -> Result<[f64; N], Fault> {
    match factors.iter().find(|f| !(0.0..=largest).contains(*f)) {
        None => Ok(factors),
        Some(factor) => {
            let problem = if largest == f64::MAX {
                format!("expected a number that is not negative, found {factor}")
            } else {
                format!("expected a number between 0 and {largest}, found {factor}")
            };
            Err(Fault::at(path(), problem, ""))
        }
    }
}
