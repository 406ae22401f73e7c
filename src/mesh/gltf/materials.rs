//! glTF's materials as ours.
//!
//! | glTF | becomes |
//! |---|---|
//! | base colour, metalness `m` | diffuse `base (1 - m)`; specular from 0.04, or what `KHR_materials_ior` and `KHR_materials_specular` say, at `m = 0` to `base` at `m = 1` |
//! | roughness | its square, the `alpha` of GGX; its map multiplies that, where glTF squares the product |
//! | `m` above 0.3, or roughness below 0.3 | [`reflects`](Material::reflects): others show lights' highlights alone |
//! | `KHR_materials_transmission` | transmission of base colour, without a bend where `KHR_materials_volume` gives no thickness |
//! | attenuation | absorption `-ln(colour) / distance` |
//! | alpha mode `MASK`, `BLEND`, `OPAQUE` | [`cutoff`](Material::cutoff), a share, 1 |
//! | emission and its strength | emission |
//! | `KHR_materials_unlit` | [`unlit`](Material::unlit) |
//! | `KHR_materials_pbrSpecularGlossiness` | diffuse and specular colours, roughness `1 - glossiness` |
//! | double-sided | nothing: all surfaces have two sides |
//! | occlusion | nothing: rays find it |
//!
//! A metalness map cannot be followed, as a material is either metal or not here; most materials with one are not,
//! in most places. So they are taken as none, and the report says so.

use super::textures::{Picture, Textures};
use crate::mesh::{Channel, Map, Material, ReadReport};
use glam::Vec3;
use gltf::material::AlphaMode;

/// What a primitive needs of its material.
pub(super) struct Surface {
    /// The material.
    pub material: Material,
    /// The set of texture coordinates that its maps go by.
    pub set: u32,
}

/// From which metalness up, and to which roughness, the scene is seen in a surface.
const MIRRORS: (f32, f32) = (0.3, 0.3);

/// The least share of light that is taken to be left after the attenuation distance: none at all would need an
/// absorption without bounds.
const DARKEST: f32 = 1e-4;

/// A material of the model `file`.
///
/// # Errors
/// A value in it is NaN or infinite.
pub(super) fn read(
    source: &gltf::Material<'_>,
    file: &str,
    textures: &mut Textures<'_>,
    report: &mut ReadReport,
) -> Result<Surface, String> {
    let number = source.index().unwrap_or_default();
    let mut reader = Reader { source, textures, report, sets: Vec::new() };
    let mut material = match source.pbr_specular_glossiness() {
        Some(_) => reader.specular_glossiness(),
        None => reader.metallic_roughness(),
    };
    material.name = source.name().map_or_else(|| format!("material {number}"), String::from);
    material.place = format!("{file}: material {number}");
    if source.unlit() {
        material.unlit = true;
        material.specular = Vec3::ZERO;
        material.reflects = false;
        (material.maps.specular, material.maps.roughness) = (None, None);
    } else {
        reader.normal(&mut material);
    }
    reader.emission(&mut material);
    let set = reader.sets.first().copied().unwrap_or(0);
    let same = reader.sets.iter().all(|&other| other == set);
    if !same {
        report.note("materials with several sets of texture coordinates go by the first".into());
    }
    match material.fault() {
        None => Ok(Surface { material, set: if same { set } else { 0 } }),
        Some(fault) => Err(format!("material {number}: its {fault} is no number or out of range; repair it")),
    }
}

struct Reader<'a, 'b> {
    source: &'a gltf::Material<'a>,
    textures: &'a mut Textures<'b>,
    report: &'a mut ReadReport,
    /// The sets of texture coordinates that maps go by.
    sets: Vec<u32>,
}

impl Reader<'_, '_> {
    fn metallic_roughness(&mut self) -> Material {
        let source = self.source;
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor().map(share);
        let base = Vec3::new(r, g, b);
        let base_map = pbr.base_color_texture().map(Picture::from);
        let rough_map = pbr.metallic_roughness_texture().map(Picture::from);
        let mut metallic = share(pbr.metallic_factor());
        if rough_map.is_some() && metallic > 0.0 {
            metallic = 0.0;
            self.report.note("metalness maps ignored: surfaces that have one are taken as no metal".into());
        }
        let rough = share(pbr.roughness_factor());
        let ior = source.ior().unwrap_or(1.5);
        let dielectric = self.dielectric(ior);
        let mut material = Material {
            diffuse: base * (1.0 - metallic),
            specular: dielectric.lerp(base, metallic),
            roughness: rough * rough,
            reflects: metallic > MIRRORS.0 || rough < MIRRORS.1,
            fresnel: true,
            ..Material::default()
        };
        self.transmit(&mut material, base, metallic, ior);
        if let Some(picture) = &base_map {
            material.maps.diffuse = Some(self.map(picture, Channel::Color));
            // A metal's colour is that of its mirror.
            if metallic > 0.5 {
                material.maps.specular = material.maps.diffuse.clone();
            }
            if material.transmission != Vec3::ZERO {
                self.report.note("pictures do not colour the light that goes through".into());
            }
        }
        material.maps.roughness = rough_map.map(|picture| self.map(&picture, Channel::Green));
        self.opacity(&mut material, alpha, base_map);
        material
    }

    /// What no metal throws back at normal incidence.
    fn dielectric(&mut self, ior: f32) -> Vec3 {
        // KHR_materials_ior keeps 0 for "all of it".
        let plain = if ior == 0.0 { 1.0 } else { ((ior - 1.0) / (ior + 1.0)).powi(2) };
        let Some(specular) = self.source.specular() else { return Vec3::splat(share(plain)) };
        if specular.specular_texture().is_some() || specular.specular_color_texture().is_some() {
            self.report.note("maps of KHR_materials_specular ignored".into());
        }
        let color = plain * Vec3::from_array(specular.specular_color_factor());
        Vec3::from_array(color.to_array().map(share)) * share(specular.specular_factor())
    }

    fn transmit(&mut self, material: &mut Material, base: Vec3, metallic: f32, ior: f32) {
        let Some(transmission) = self.source.transmission() else { return };
        if transmission.transmission_texture().is_some() {
            self.report.note("transmission maps ignored".into());
        }
        let through = share(transmission.transmission_factor()) * (1.0 - metallic);
        material.transmission = through * base;
        // glTF scatters (1 - through) of what enters; ours is a share of what does not go through.
        let left = (Vec3::ONE - material.transmission).max(Vec3::splat(f32::MIN_POSITIVE));
        material.diffuse = (material.diffuse * (1.0 - through) / left).min(Vec3::ONE);
        let volume = self.source.volume().filter(|volume| volume.thickness_factor() > 0.0);
        let Some(volume) = volume else {
            // A thin sheet, as of glass: it bends nothing, so what it throws back cannot come from its index.
            material.ior = 1.0;
            material.fresnel = false;
            return;
        };
        if volume.thickness_texture().is_some() {
            self.report.note("thickness maps ignored: rays find how thick things are".into());
        }
        material.ior = if ior < 1.0 { 1.0 } else { ior };
        let distance = volume.attenuation_distance();
        if distance > 0.0 && distance.is_finite() {
            let color = volume.attenuation_color().map(|color| share(color).max(DARKEST));
            material.absorption = Vec3::from_array(color.map(|color| -color.ln() / distance)).max(Vec3::ZERO);
        }
    }

    fn specular_glossiness(&mut self) -> Material {
        let Some(pbr) = self.source.pbr_specular_glossiness() else { return Material::default() };
        let [r, g, b, alpha] = pbr.diffuse_factor().map(share);
        let specular = Vec3::from_array(pbr.specular_factor().map(share));
        let rough = 1.0 - share(pbr.glossiness_factor());
        let mut material = Material {
            diffuse: Vec3::new(r, g, b),
            specular,
            roughness: rough * rough,
            reflects: specular.max_element() > MIRRORS.0 || rough < MIRRORS.1,
            fresnel: true,
            ..Material::default()
        };
        let base_map = pbr.diffuse_texture().map(Picture::from);
        material.maps.diffuse = base_map.as_ref().map(|picture| self.map(picture, Channel::Color));
        if let Some(info) = pbr.specular_glossiness_texture() {
            material.maps.specular = Some(self.map(&info.into(), Channel::Color));
            self.report.note("glossiness maps ignored".into());
        }
        self.opacity(&mut material, alpha, base_map);
        material
    }

    fn opacity(&mut self, material: &mut Material, alpha: f32, base_map: Option<Picture<'_>>) {
        material.cutoff = match self.source.alpha_mode() {
            AlphaMode::Opaque => return,
            AlphaMode::Blend => None,
            AlphaMode::Mask => Some(self.source.alpha_cutoff().unwrap_or(0.5)),
        };
        material.opacity = alpha;
        material.maps.opacity = base_map.map(|picture| self.map(&picture, Channel::Alpha));
    }

    fn emission(&mut self, material: &mut Material) {
        let strength = self.source.emissive_strength().unwrap_or(1.0).max(0.0);
        material.emission = Vec3::from_array(self.source.emissive_factor()).max(Vec3::ZERO) * strength;
        if let Some(info) = self.source.emissive_texture()
            && material.emission != Vec3::ZERO
        {
            material.maps.emission = Some(self.map(&info.into(), Channel::Color));
        }
    }

    fn normal(&mut self, material: &mut Material) {
        if let Some(normal) = self.source.normal_texture() {
            let strength = normal.scale();
            let map = self.map(&normal.into(), Channel::Data);
            material.maps.normal = Some(Map { strength, ..map });
        }
    }

    fn map(&mut self, picture: &Picture<'_>, channel: Channel) -> Map {
        self.sets.push(picture.set);
        self.textures.map(picture, channel, self.report)
    }
}

/// A share of light; NaN stays what it is, to be found out.
fn share(x: f32) -> f32 {
    x.clamp(0.0, 1.0)
}
