//! What surfaces do with light, in terms that every format's materials come down to.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A surface. Colours are linear RGB; shares of light are 0 to 1.
///
/// Of the light that meets it, the share `1 - opacity` goes straight on as if nothing were there. Of the rest, some
/// is thrown back as by a mirror ([`specular`](Self::specular)), some enters ([`transmission`](Self::transmission)),
/// and [`diffuse`](Self::diffuse) of what is left is scattered to all sides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Where it is defined, as `kitchen.mtl:12`; empty if nowhere.
    pub place: String,
    /// Diffuse reflectance.
    pub diffuse: Vec3,
    /// Whether it has its diffuse colour whatever light falls on it.
    pub unlit: bool,
    /// Light that is thrown back in the mirror's direction, or near it, at normal incidence.
    pub specular: Vec3,
    /// How far from the mirror's direction: 0 is a mirror, 1 nearly matt. The `alpha` of the GGX distribution
    /// (Walter et al., "Microfacet models for refraction through rough surfaces", 2007).
    pub roughness: f32,
    /// Whether the scene is seen in it. Of other surfaces, what is thrown back is seen as lights' highlights alone.
    pub reflects: bool,
    /// Whether it throws back more at grazing angles: by Fresnel's equations if light enters it, by Schlick's
    /// approximation if not.
    pub fresnel: bool,
    /// Light that goes through the surface, refracted, each time it does: 0 for what is opaque.
    pub transmission: Vec3,
    /// Index of refraction of what is behind the surface's front; 1 bends nothing.
    pub ior: f32,
    /// Light that is lost inside, by unit of length: `exp(-absorption * length)` is left (Beer and Lambert).
    pub absorption: Vec3,
    /// The share of the surface that is there at all.
    pub opacity: f32,
    /// Where opacity, its map's included, is below this, there is a hole; all else is whole. `None`: opacity is a
    /// share.
    pub cutoff: Option<f32>,
    /// Radiance that it gives off, on both sides.
    pub emission: Vec3,
    /// Pictures in place of, or multiplied with, the values above.
    pub maps: Maps,
}

/// The pictures of a surface. Each is multiplied with the value that it is named after.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Maps {
    /// Of [`Material::diffuse`].
    pub diffuse: Option<Map>,
    /// Of [`Material::specular`].
    pub specular: Option<Map>,
    /// Of [`Material::roughness`].
    pub roughness: Option<Map>,
    /// Of [`Material::opacity`].
    pub opacity: Option<Map>,
    /// Of [`Material::emission`].
    pub emission: Option<Map>,
    /// Normals in the tangent space of the texture coordinates, `0.5 + 0.5 n` in each channel.
    pub normal: Option<Map>,
    /// Heights, along the normal.
    pub bump: Option<Map>,
}

/// A picture on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Its place in [`Mesh::images`](super::Mesh::images).
    pub image: u32,
    /// What of the picture counts.
    pub channel: Channel,
    /// The texture coordinates are multiplied by this first,
    pub scale: [f32; 2],
    /// and then this is added.
    pub offset: [f32; 2],
    /// Whether the picture ends at its border; otherwise it is repeated.
    pub clamp: bool,
    /// How high a [`Maps::bump`] is (white above black, in texture coordinates' units), or how strong a
    /// [`Maps::normal`].
    pub strength: f32,
}

/// What of a picture counts. Colours are sRGB, all single channels are taken as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// All three, as a colour that is decoded to linear light.
    Color,
    /// All three, as numbers.
    Data,
    /// The first alone.
    Red,
    /// The second.
    Green,
    /// The third.
    Blue,
    /// How much is there; 1 for pictures without.
    Alpha,
    /// The average of the three.
    Grey,
}

/// The reflectance of what no file gives a colour.
pub(super) const DEFAULT_DIFFUSE: Vec3 = Vec3::splat(0.7);

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            place: String::new(),
            diffuse: DEFAULT_DIFFUSE,
            unlit: false,
            specular: Vec3::ZERO,
            roughness: 1.0,
            reflects: false,
            fresnel: false,
            transmission: Vec3::ZERO,
            ior: 1.0,
            absorption: Vec3::ZERO,
            opacity: 1.0,
            cutoff: None,
            emission: Vec3::ZERO,
            maps: Maps::default(),
        }
    }
}

impl Material {
    /// A matt surface.
    pub fn matt(name: impl Into<String>, diffuse: Vec3) -> Self {
        Self { name: name.into(), diffuse, ..Self::default() }
    }

    /// Whether it gives off light.
    pub fn emits(&self) -> bool {
        self.emission != Vec3::ZERO
    }

    /// What in it is no material, if anything: a NaN, a share of light that is less than nothing or more than all.
    pub fn fault(&self) -> Option<&'static str> {
        let shares = |v: Vec3| v.is_finite() && v.min_element() >= 0.0 && v.max_element() <= 1.0;
        let amounts = |v: Vec3| v.is_finite() && v.min_element() >= 0.0;
        let share = |x: f32| (0.0..=1.0).contains(&x);
        let maps_are_finite = self
            .maps
            .all()
            .all(|map| map.scale.iter().chain(&map.offset).chain([&map.strength]).all(|x| x.is_finite()));
        [
            (shares(self.diffuse), "diffuse"),
            (shares(self.specular), "specular"),
            (share(self.roughness), "roughness"),
            (shares(self.transmission), "transmission"),
            (self.ior.is_finite() && self.ior >= 1e-3, "ior"),
            (amounts(self.absorption), "absorption"),
            (share(self.opacity), "opacity"),
            (self.cutoff.is_none_or(f32::is_finite), "cutoff"),
            (amounts(self.emission), "emission"),
            (maps_are_finite, "maps"),
        ]
        .into_iter()
        .find_map(|(fine, what)| (!fine).then_some(what))
    }
}

impl Maps {
    /// Those that there are.
    pub fn all(&self) -> impl Iterator<Item = &Map> {
        let Self { diffuse, specular, roughness, opacity, emission, normal, bump } = self;
        [diffuse, specular, roughness, opacity, emission, normal, bump].into_iter().flatten()
    }

    /// The same, to be changed.
    pub fn all_mut(&mut self) -> impl Iterator<Item = &mut Map> {
        let Self { diffuse, specular, roughness, opacity, emission, normal, bump } = self;
        [diffuse, specular, roughness, opacity, emission, normal, bump].into_iter().flatten()
    }
}

impl Map {
    /// A whole picture, repeated.
    pub fn whole(image: u32, channel: Channel) -> Self {
        Self { image, channel, scale: [1.0; 2], offset: [0.0; 2], clamp: false, strength: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_material_is_named() {
        assert_eq!(Material::default().fault(), None);
        let fault = |change: fn(&mut Material)| {
            let mut material = Material::default();
            change(&mut material);
            material.fault()
        };
        assert_eq!(fault(|m| m.diffuse.y = f32::NAN), Some("diffuse"));
        assert_eq!(fault(|m| m.specular.x = 1.5), Some("specular"));
        assert_eq!(fault(|m| m.emission.z = 20.0), None, "lights may be bright");
        assert_eq!(fault(|m| m.ior = 0.0), Some("ior"));
        assert_eq!(
            fault(|m| m.maps.bump = Some(Map { strength: f32::INFINITY, ..Map::whole(0, Channel::Grey) })),
            Some("maps")
        );
    }
}
