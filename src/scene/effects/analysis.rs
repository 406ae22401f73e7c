//! What a scene calls for.

use super::effect::{Effect, EffectSet};
use super::request::Request;
use crate::mesh::{Maps, Material};
use crate::scene::{Camera, Surface};
use serde::Serialize;

/// What is known beside the surfaces.
#[derive(Clone, Copy, Debug)]
pub struct Around<'a> {
    /// The camera.
    pub camera: &'a Camera,
    /// What the key light is, in words; `None` if there is none.
    pub key_light: Option<&'a str>,
    /// Whether surfaces that give off light are all the light that there is.
    pub lit_by_surfaces: bool,
    /// The picture all around, if there is one.
    pub environment: Option<&'a str>,
    /// The error at which a pixel has samples enough; 0 if it takes all in any case.
    pub error: f32,
}

/// The effects of a scene, and what each was called for by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Analysis {
    /// All effects there are, in their order.
    pub effects: Vec<Call>,
}

/// An effect, and whether it runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Call {
    /// Which.
    pub name: Effect,
    /// Whether it runs.
    pub on: bool,
    /// What in the scene calls for it: materials with the place where they are defined, lights, the camera.
    pub called_for_by: Vec<String>,
    /// What the user says, whatever the scene calls for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub asked: Option<bool>,
}

/// Surfaces that are smoother than this are mirrors.
pub const SMOOTH: f32 = 1e-3;

/// Callers that are named; others are counted.
const NAMED: usize = 3;

impl Analysis {
    /// Looks at all materials that any triangle has, at the lights and at the camera.
    pub fn new(surface: &impl Surface, around: &Around<'_>, request: &Request) -> Self {
        let uses = surface.uses();
        let used: Vec<&Material> = used(surface.materials(), &uses).collect();
        let mut effects: Vec<Call> = Vec::with_capacity(Effect::ALL.len());
        let by_materials = |calls: &dyn Fn(&Material) -> bool| -> Vec<String> {
            let callers: Vec<&Material> = used.iter().copied().filter(|material| calls(material)).collect();
            named(&callers)
        };
        for &effect in Effect::ALL {
            let called_for_by = match effect {
                Effect::SmoothNormals if surface.has_normals() => {
                    vec!["normals of the model's vertices".into()]
                }
                Effect::Shadows => around.key_light.map(|light| vec![light.into()]).unwrap_or_default(),
                Effect::Interreflection if around.lit_by_surfaces => {
                    vec!["all light comes from surfaces or from around".into()]
                }
                Effect::Environment => around
                    .environment
                    .map(|picture| vec![format!("environment {picture}")])
                    .unwrap_or_default(),
                Effect::DepthOfField if around.camera.aperture > 0.0 => {
                    vec![format!("camera: aperture {}", around.camera.aperture)]
                }
                Effect::Antialiasing if around.error > 0.0 => {
                    vec![format!("samples until the error is {}", around.error)]
                }
                _ => by_materials(&|material| calls_for(material, effect)),
            };
            let asked = request.of(effect);
            let on = asked.unwrap_or(!called_for_by.is_empty());
            effects.push(Call { name: effect, on, called_for_by, asked });
        }
        Self { effects }
    }

    /// Leaves materials out of those that call for holes which have none, now that their pictures are known. The effects
    /// that run then.
    pub(crate) fn without_false_holes(
        &mut self,
        surface: &impl Surface,
        has_holes: impl Fn(&Material) -> bool,
    ) -> EffectSet {
        let call = &mut self.effects[Effect::CutOuts as usize];
        if call.on && call.asked.is_none() {
            let uses = surface.uses();
            let callers: Vec<&Material> = used(surface.materials(), &uses)
                .filter(|material| calls_for(material, Effect::CutOuts) && has_holes(material))
                .collect();
            call.called_for_by = named(&callers);
            call.on = !callers.is_empty();
        }
        self.set()
    }

    /// The effects that run.
    pub fn set(&self) -> EffectSet {
        self.effects.iter().fold(EffectSet::NONE, |set, call| set.with(call.name, call.on))
    }

    /// What calls for an effect.
    pub fn call(&self, effect: Effect) -> &Call {
        &self.effects[effect as usize]
    }
}

/// The materials that any triangle has: `uses` says how many have each.
pub(crate) fn used<'m, 'u>(
    materials: &'m [Material],
    uses: &'u [u64],
) -> impl Iterator<Item = &'m Material> + use<'m, 'u> {
    materials.iter().zip(uses).filter(|(_, uses)| **uses > 0).map(|(material, _)| material)
}

/// All effects that a material calls for by itself.
pub(crate) fn calls_of(material: &Material) -> EffectSet {
    Effect::ALL.iter().fold(EffectSet::NONE, |calls, &effect| calls.with(effect, calls_for(material, effect)))
}

/// Whether a material calls for an effect by itself.
pub fn calls_for(material: &Material, effect: Effect) -> bool {
    let Material { maps, .. } = material;
    let is_specular = material.specular.max_element() > 0.0;
    let is_mirror = is_specular && material.reflects;
    let lets_light_in = material.transmission.max_element() > 0.0;
    match effect {
        Effect::Textures => {
            let Maps { diffuse, specular, roughness, emission, .. } = maps;
            [diffuse, specular, roughness, emission].into_iter().any(Option::is_some)
        }
        Effect::Bump => maps.bump.is_some() || maps.normal.is_some(),
        Effect::CutOuts => material.cutoff.is_some() && (maps.opacity.is_some() || material.opacity < 1.0),
        Effect::Transparency => {
            material.cutoff.is_none() && (maps.opacity.is_some() || material.opacity < 1.0)
        }
        Effect::Emission | Effect::SoftShadows => material.emission.max_element() > 0.0,
        Effect::Highlights => is_specular && !material.reflects && !lets_light_in,
        Effect::Reflection => {
            (is_mirror || lets_light_in && material.ior != 1.0) && material.roughness < SMOOTH
        }
        Effect::Glossy => is_mirror && material.roughness >= SMOOTH,
        Effect::Fresnel => material.fresnel && (is_mirror || lets_light_in),
        Effect::Refraction => lets_light_in,
        Effect::Absorption => lets_light_in && material.absorption.max_element() > 0.0,
        Effect::SmoothNormals
        | Effect::Shadows
        | Effect::AmbientOcclusion
        | Effect::Interreflection
        | Effect::Environment
        | Effect::DepthOfField
        | Effect::Antialiasing => false,
    }
}

/// Callers by name, with the places where they are defined.
fn named(callers: &[&Material]) -> Vec<String> {
    let name = |material: &&Material| match (material.name.as_str(), material.place.as_str()) {
        ("", "") => "a material without a name".to_owned(),
        ("", place) => format!("the material at {place}"),
        (name, "") => format!("material {name}"),
        (name, place) => format!("material {name} ({place})"),
    };
    let mut names: Vec<String> = callers.iter().take(NAMED).map(name).collect();
    if callers.len() > NAMED {
        names.push(format!("{} more", callers.len() - NAMED));
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Channel, Colors, Map, Mesh};
    use glam::Vec3;

    const CAMERA: Camera = Camera::new(Vec3::ZERO, Vec3::NEG_Z);

    const AROUND: Around<'static> = Around {
        camera: &CAMERA,
        key_light: Some("key light: a sun"),
        lit_by_surfaces: false,
        environment: None,
        error: 0.0,
    };

    fn scene(materials: Vec<Material>, of_triangle: Vec<u32>) -> Mesh {
        let triangles = vec![[0, 1, 2]; of_triangle.len()];
        let colors = Colors::PerMaterial { materials, of_triangle };
        Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles, colors, ..Mesh::default() }
    }

    fn on(mesh: &Mesh, around: &Around<'_>, request: &str) -> Vec<Effect> {
        Analysis::new(mesh, around, &request.parse().expect(request)).set().iter().collect()
    }

    #[test]
    fn matt_surfaces_call_for_shadows_alone() {
        let mesh = scene(vec![Material::matt("paint", Vec3::X)], vec![0]);
        assert_eq!(on(&mesh, &AROUND, "auto"), [Effect::Shadows]);
        assert_eq!(on(&mesh, &AROUND, "none"), []);
        assert_eq!(on(&mesh, &AROUND, "-shadows,+bump"), [Effect::Bump]);
        assert_eq!(on(&mesh, &Around { key_light: None, ..AROUND }, "auto"), []);
    }

    #[test]
    fn each_material_calls_for_its_own() {
        let glass = Material {
            transmission: Vec3::ONE,
            ior: 1.5,
            fresnel: true,
            reflects: true,
            roughness: 0.0,
            ..Material::matt("glass", Vec3::ZERO)
        };
        let image = Some(Map::whole(0, Channel::Color));
        let mut leaf = Material { cutoff: Some(0.5), ..Material::matt("leaf", Vec3::Y) };
        leaf.maps.diffuse = image.clone();
        leaf.maps.opacity = image;
        let called = |material: &Material| -> Vec<Effect> {
            Effect::ALL.iter().copied().filter(|&effect| calls_for(material, effect)).collect()
        };
        assert_eq!(called(&glass), [Effect::Reflection, Effect::Fresnel, Effect::Refraction]);
        assert_eq!(called(&leaf), [Effect::Textures, Effect::CutOuts]);
        let steel = Material { specular: Vec3::ONE, reflects: true, roughness: 0.3, ..Material::default() };
        assert_eq!(called(&steel), [Effect::Glossy]);
        let varnish = Material { specular: Vec3::ONE, roughness: 0.3, ..Material::default() };
        assert_eq!(called(&varnish), [Effect::Highlights]);
        let lamp = Material { emission: Vec3::ONE, ..Material::default() };
        assert_eq!(called(&lamp), [Effect::Emission, Effect::SoftShadows]);
        let thin = Material { transmission: Vec3::splat(0.4), ..Material::default() };
        assert_eq!(called(&thin), [Effect::Refraction], "nothing is thrown back where nothing is bent");
        let veil = Material { opacity: 0.5, ..Material::default() };
        assert_eq!(called(&veil), [Effect::Transparency]);
    }

    #[test]
    fn materials_that_no_triangle_has_call_for_nothing() {
        let mirror = Material { specular: Vec3::ONE, reflects: true, roughness: 0.0, ..Material::default() };
        let mesh = scene(vec![Material::default(), mirror], vec![0, 0]);
        assert_eq!(on(&mesh, &AROUND, "auto"), [Effect::Shadows]);
    }

    #[test]
    fn callers_are_named_with_their_places() {
        let mirrors: Vec<Material> = (0..5)
            .map(|i| Material {
                place: format!("room.mtl:{i}"),
                specular: Vec3::ONE,
                reflects: true,
                roughness: 0.0,
                ..Material::matt(format!("m{i}"), Vec3::ZERO)
            })
            .collect();
        let mesh = scene(mirrors, vec![0, 1, 2, 3, 4]);
        let analysis = Analysis::new(&mesh, &AROUND, &Request::default());
        let call = analysis.call(Effect::Reflection);
        assert_eq!(
            call.called_for_by,
            ["material m0 (room.mtl:0)", "material m1 (room.mtl:1)", "material m2 (room.mtl:2)", "2 more"]
        );
        assert!(call.on && call.asked.is_none());
    }
}
