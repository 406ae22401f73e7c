//! What a MTL file's words mean for a surface.
//!
//! The format describes Phong shading and a Whitted ray tracer; [`Material`] describes shares of light. This is the
//! translation, in which `illum` picks what counts:
//!
//! | `illum` | is | counts |
//! |---|---|---|
//! | 0 | one colour whatever the light | `Kd` |
//! | 1 | matt | `Kd` |
//! | 2, 10 or none | with highlights (10's shadows on nothing are not drawn) | `Kd Ks Ns` |
//! | 3, 8 | the scene is seen in it; of 8, highlights alone | the same |
//! | 5 | the same as 3, brighter at grazing angles | the same |
//! | 4, 9 | a thin pane: light goes straight on; of 9, highlights alone | `Tf` too |
//! | 6, 7 | glass or water: light is refracted; 7 by Fresnel's equations | `Tf Ni` too |
//!
//! | words | become |
//! |---|---|
//! | `Kd`, `Ks` | [`diffuse`](Material::diffuse) and [`specular`](Material::specular), clamped to 0 to 1 |
//! | `Ke` | [`emission`](Material::emission), as bright as it is written |
//! | `Ns` | [`roughness`](Material::roughness) `sqrt(2 / (Ns + 2))` (Walter et al. 2007); of what the scene is seen in, 1000 and more is a mirror, and so is none given. Of what light goes through: smooth, as the format's rays know no other refraction |
//! | `Pr`, `map_Pr` | roughness `Pr²`, times the picture |
//! | `Pm` | `specular` between 0.04 and `Kd`, `diffuse` the rest; the scene is seen in it from a third of metal on, or below a `Pr` of 0.3. Of metal, `map_Kd` is the specular's picture too |
//! | `d`, `Tr` | [`opacity`](Material::opacity) `d`, or else `1 - Tr`; a `Tr` of 1 alone, which old exporters write for what is whole, counts for nothing unless `illum` is one of light that goes through |
//! | `Tf` | of 4 and 9: [`transmission`](Material::transmission); of 6 and 7 its square root: the format means light that has gone through a body, thus through its surface twice |
//! | `Ni` | [`ior`](Material::ior) of 6 and 7, 1.5 if none; 1 of all others |
//! | `map_Kd`, `map_Ks`, `map_Ke`, `norm` | pictures of the same |
//! | `map_d`, `map_Tr` | a cut-out: a hole where it is darker than a half, unless `illum` or `d` say that light goes through |
//! | `map_Bump`, `bump` | heights; a normal map if the file's name says `normal` |
//! | `Ka sharpness Ps Pc Pcr aniso`, `map_Ka map_Ns map_Pm disp decal refl` | nothing: no such light, no such layer, or a scale that a picture cannot be multiplied with |
//!
//! Where a file leaves it open whether light goes through:
//!
//! - 4 and 9 with a `d` below 1 or a `map_d` are dissolved by that much, and `Tf` does not count.
//! - 4 and 9 with a white `Tf` or none, and a colour, are opaque: Maya and others write that for every surface.
//! - 6 and 7 with a `d` below 1 let `1 - d` through, refracted; with a `d` of 1 and no `Tf`, nothing.
//! - 7 that lets nothing through, with a `Ni`, is a coat: it throws back `Ks ((Ni - 1) / (Ni + 1))²` straight on.
//!
//! A picture that would be multiplied with nothing (`Kd`, `Ke` or `d` of 0) is multiplied with 1: a file that names it
//! wants it to be seen. Without `d`, `Tr` and `map_d`, the alpha channel of `map_Kd` is a cut-out too, if its kind of
//! file can have one; if the picture turns out to have none, [`Channel::Alpha`] is 1 everywhere.

use super::mtl::Definition;
use super::texture::Texture;
use crate::mesh::material::DEFAULT_DIFFUSE;
use crate::mesh::{Channel, Map, Maps, Material};
use glam::Vec3;

/// From this exponent on, a reflection is sharp: Blender and others write 1000 for no roughness at all.
const MIRROR_EXPONENT: f32 = 1000.0;

/// What glass and water have if the file does not say: common glass.
const GLASS: f32 = 1.5;

/// What dielectrics throw back straight on, in metal-and-roughness terms.
const DIELECTRIC: f32 = 0.04;

/// How high a bump map's white is above its black with `-bm 1`, in texture coordinates' units. The format has no
/// unit for it; with this, the joints of a brick wall's picture are as deep as they look.
const BUMP_HEIGHT: f32 = 0.01;

/// The material that a definition describes. `image` finds a picture's place in the list of pictures.
pub(super) fn material(
    definition: &Definition,
    place: String,
    image: &mut dyn FnMut(&str) -> u32,
) -> Material {
    let illum = definition.illum.filter(|&illum| illum != 10).unwrap_or(2);
    let (transmission, opacity) = let_through(definition, illum);
    let clear = transmission != Vec3::ZERO;
    let mut material = Material {
        name: definition.name.clone(),
        place,
        diffuse: seen(definition.diffuse, &definition.maps.diffuse, DEFAULT_DIFFUSE)
            .clamp(Vec3::ZERO, Vec3::ONE),
        unlit: illum == 0,
        specular: specular(definition, illum, clear),
        reflects: matches!(illum, 3..=7),
        fresnel: matches!(illum, 5 | 7),
        transmission,
        ior: if clear && matches!(illum, 6 | 7) { ior(definition).unwrap_or(GLASS) } else { 1.0 },
        opacity,
        emission: seen(definition.emission, &definition.maps.emission, Vec3::ZERO).max(Vec3::ZERO),
        ..Material::default()
    };
    if let Some(metal) = definition.metal.filter(|_| illum != 0 && !clear) {
        let metal = metal.clamp(0.0, 1.0);
        material.specular = Vec3::splat(DIELECTRIC).lerp(material.diffuse, metal);
        material.diffuse *= 1.0 - metal;
        material.fresnel = true;
        material.reflects |= metal > 0.3 || definition.roughness.is_some_and(|roughness| roughness < 0.3);
    }
    material.reflects &= material.specular != Vec3::ZERO;
    material.roughness = roughness(definition, clear, material.reflects);
    if !lets_through(illum) && opacity >= 1.0 {
        material.cutoff = definition.maps.opacity.as_ref().map(|_| 0.5);
    }
    material.maps = maps(definition, &mut material, image);
    material
}

/// A value, or 1 if it is nothing and has a picture.
fn seen(value: Option<Vec3>, picture: &Option<Texture>, otherwise: Vec3) -> Vec3 {
    match (value, picture) {
        (None | Some(Vec3::ZERO), Some(_)) => Vec3::ONE,
        (value, _) => value.unwrap_or(otherwise),
    }
}

/// Whether a model of illumination is one of light that goes through.
fn lets_through(illum: u8) -> bool {
    matches!(illum, 4 | 6 | 7 | 9)
}

/// What goes through a surface, and how much of it is there.
fn let_through(definition: &Definition, illum: u8) -> (Vec3, f32) {
    let transparency = definition.transparency.filter(|&tr| lets_through(illum) || tr < 1.0);
    let dissolve = definition.dissolve.or(transparency.map(|transparency| 1.0 - transparency));
    let dissolve = dissolve.map(|dissolve| dissolve.clamp(0.0, 1.0));
    let filter = definition.filter.map(|filter| filter.clamp(Vec3::ZERO, Vec3::ONE));
    let picture = definition.maps.opacity.is_some();
    let opacity = match dissolve {
        Some(0.0) if picture => 1.0,
        dissolve => dissolve.unwrap_or(1.0),
    };
    match illum {
        6 | 7 if !picture => {
            let gone = match dissolve {
                None => 1.0,
                Some(1.0) if filter.is_some() => 1.0,
                Some(dissolve) => 1.0 - dissolve,
            };
            (gone * filter.unwrap_or(Vec3::ONE).map(f32::sqrt), 1.0)
        }
        4 | 9 if !picture && opacity >= 1.0 => {
            let colored = definition.diffuse.is_none_or(|diffuse| diffuse != Vec3::ZERO)
                || definition.maps.diffuse.is_some();
            let opaque = match filter {
                Some(filter) => filter == Vec3::ONE && colored,
                None => colored || dissolve.is_some(),
            };
            // What is thrown back cannot go through as well.
            let rest = Vec3::ONE - specular(definition, illum, true);
            (if opaque { Vec3::ZERO } else { filter.unwrap_or(Vec3::ONE).min(rest) }, 1.0)
        }
        _ => (Vec3::ZERO, opacity),
    }
}

fn specular(definition: &Definition, illum: u8, clear: bool) -> Vec3 {
    if illum < 2 {
        return Vec3::ZERO;
    }
    let pictured = definition.maps.specular.is_some();
    let specular = definition.specular.unwrap_or(if pictured { Vec3::ONE } else { Vec3::ZERO });
    let specular = specular.clamp(Vec3::ZERO, Vec3::ONE);
    match ior(definition) {
        Some(ior) if illum == 7 && !clear && ior > 1.0 => specular * ((ior - 1.0) / (ior + 1.0)).powi(2),
        _ => specular,
    }
}

/// `Ni`; 0 is written for none.
fn ior(definition: &Definition) -> Option<f32> {
    definition.ior.filter(|&ior| ior > 0.0).map(|ior| ior.clamp(1e-3, 1e3))
}

fn roughness(definition: &Definition, clear: bool, reflects: bool) -> f32 {
    if let Some(roughness) = definition.roughness {
        return roughness.clamp(0.0, 1.0).powi(2);
    }
    if definition.maps.roughness.is_some() {
        return 1.0;
    }
    match definition.exponent {
        _ if clear => 0.0,
        None if reflects => 0.0,
        Some(exponent) if reflects && exponent >= MIRROR_EXPONENT => 0.0,
        exponent => (2.0 / (exponent.unwrap_or(0.0).max(0.0) + 2.0)).sqrt(),
    }
}

/// The pictures. An alpha channel of the colour's picture makes the material a cut-out.
fn maps(definition: &Definition, material: &mut Material, image: &mut dyn FnMut(&str) -> u32) -> Maps {
    let textures = &definition.maps;
    let mut map = |texture: &Texture, channel| texture.map(image(&texture.name), channel);
    let diffuse = textures.diffuse.as_ref().map(|texture| map(texture, Channel::Color));
    let mut maps = Maps { diffuse, ..Maps::default() };
    if material.specular != Vec3::ZERO {
        let metal = definition.metal.is_some_and(|metal| metal > 0.5);
        let texture = textures.specular.as_ref().or(textures.diffuse.as_ref().filter(|_| metal));
        maps.specular = texture.map(|texture| map(texture, Channel::Color));
    }
    maps.emission = textures.emission.as_ref().map(|texture| map(texture, Channel::Color));
    let single = |texture: &Texture| texture.channel.unwrap_or(Channel::Grey);
    maps.roughness = textures.roughness.as_ref().map(|texture| map(texture, single(texture)));
    maps.normal = textures.normal.as_ref().map(|texture| map(texture, Channel::Data));
    if let Some(texture) = &textures.bump {
        if texture.name.to_ascii_lowercase().contains("normal") {
            maps.normal.get_or_insert_with(|| map(texture, Channel::Data));
        } else {
            let bump = map(texture, single(texture));
            maps.bump = Some(Map { strength: bump.strength * BUMP_HEIGHT, ..bump });
        }
    }
    if let Some(texture) = &textures.opacity {
        maps.opacity = Some(map(texture, Channel::Grey));
        // The same picture as the colour's: its alpha is meant. Grey pictures are their own.
        let is_colors =
            maps.diffuse.as_ref().map(|map| map.image) == maps.opacity.as_ref().map(|map| map.image);
        let channel = texture.channel.unwrap_or(if is_colors { Channel::Alpha } else { Channel::Grey });
        maps.opacity.iter_mut().for_each(|map| map.channel = channel);
    } else if definition.dissolve.is_none()
        && definition.transparency.is_none()
        && material.transmission == Vec3::ZERO
        && let Some(texture) = textures.diffuse.as_ref().filter(|texture| can_have_alpha(&texture.name))
    {
        maps.opacity = Some(map(texture, Channel::Alpha));
        material.cutoff = Some(0.5);
    }
    maps
}

/// Whether a picture file of this name can have an alpha channel that is not by accident.
fn can_have_alpha(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    matches!(ending.as_deref(), Some("png" | "tga" | "tif" | "tiff" | "webp" | "gif" | "dds" | "exr"))
}

#[cfg(test)]
mod tests;
