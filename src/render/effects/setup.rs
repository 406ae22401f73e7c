//! From a scene to what is to be shown of it.

use super::appearance::{Appearance, Limits};
use super::holes::has_holes;
use super::task::EffectScratch;
use crate::mesh::{Image, Map, Material};
use crate::scene::effects::{Analysis, Around, Effect, EffectSet, Request, calls_of, used};
use crate::scene::texture::{Problem, Textures};
use crate::scene::{Camera, Emitters, Environment, Light, Lighting, Lights, Surface};
use crate::traverse::Accel;
use glam::Vec3;

/// What is asked of a picture, beside the scene.
#[derive(Debug)]
pub struct Wishes<'a> {
    /// What to make of the effects that the scene calls for.
    pub request: Request,
    /// Light for scenes that do not say where theirs comes from.
    pub lighting: Lighting,
    /// A picture all around, and its name.
    pub environment: Option<(Environment, &'a str)>,
    /// Samples per pixel, at most; `None`: one, or [`MANY`] where some effect shows chance values.
    pub samples: Option<u32>,
    /// How far accuracy goes, but for the error.
    pub limits: Limits,
    /// See [`Limits::error`]; `None` takes all samples that were asked for, and stops at [`FINE`] where none were.
    pub error: Option<f32>,
}

/// Samples at most, where effects show chance values and nobody says how many.
pub const MANY: u32 = 64;

/// The error at which samples are enough in that case.
pub const FINE: f32 = 0.02;

/// What a scene calls for, and what is needed to show it.
#[derive(Debug)]
pub struct Staged {
    /// What calls for what.
    pub analysis: Analysis,
    /// What the renderer needs; `None` if the scene calls for nothing that the plain renderer lacks.
    pub appearance: Option<Appearance>,
    /// Samples per pixel, at most.
    pub samples: u32,
    /// Pictures that cannot be had.
    pub problems: Vec<Problem>,
}

/// What the plain renderer does: matt surfaces under one light.
const PLAIN: EffectSet = EffectSet::of(&[Effect::Shadows]);

impl Staged {
    /// Finds out what a scene calls for, as seen by a camera, and opens the pictures that are needed for it.
    ///
    /// Panics if a scene that is not all in memory cannot be read: see [`Cached::or_error`](crate::cache::Cached).
    pub fn new(accel: &Accel, surface: &impl Surface, camera: &Camera, wishes: Wishes<'_>) -> Self {
        let Wishes { request, lighting, environment, samples, limits, error } = wishes;
        let is_off = |effect| request.of(effect) == Some(false);
        let (environment, name) = match environment.filter(|_| !is_off(Effect::Environment)) {
            Some((environment, name)) => (Some(environment), Some(name)),
            None => (None, None),
        };
        let emitters =
            if is_off(Effect::SoftShadows) || is_off(Effect::Emission) { None } else { emitters(surface) };
        let lets_pass = |primitive| {
            let material = surface.materials().get(surface.material(primitive) as usize);
            material.is_some_and(|material| material.transmission != Vec3::ZERO)
        };
        let lights = Lights::for_view(camera, accel, &lets_pass, &lighting, emitters, environment);

        let key_light = lights.key.map(|light| match light {
            Light::Sun { .. } => "key light: a sun",
            Light::Point { .. } => "key light: a lamp",
        });
        let mut around = Around {
            camera,
            key_light,
            lit_by_surfaces: lights.ambient.is_none(),
            environment: name,
            error: error.unwrap_or(0.0),
        };
        let mut analysis = Analysis::new(surface, &around, &request);
        let is_sampled = analysis.set().iter().any(Effect::is_sampled);
        let error = error.unwrap_or(if is_sampled && samples.is_none() { FINE } else { 0.0 });
        if error != around.error {
            around.error = error;
            analysis = Analysis::new(surface, &around, &request);
        }
        let set = analysis.set();
        let error = if set.has(Effect::Antialiasing) { error } else { 0.0 };
        let samples = samples.unwrap_or(if is_sampled || error > 0.0 { MANY } else { 1 });

        let (textures, problems) = Textures::open(surface.images(), maps(surface, set));
        // Files say that pictures may cut holes; whether they do is known now.
        let set = analysis.without_false_holes(surface, |material| has_holes(material, &textures));
        if PLAIN.or(set) == PLAIN && lights.ambient.is_some() {
            return Self { analysis, appearance: None, samples, problems };
        }
        let limits = Limits { error, ..limits };
        let appearance = Some(Appearance { set, lights, textures, limits });
        Self { analysis, appearance, samples, problems }
    }
}

/// The memory that a picture may need beside what its scene and its pixels take: the pictures that are opened for it,
/// and what each of `workers` keeps. They are opened to know. What an environment's own picture takes is not in it.
pub fn memory_beside(
    materials: &[Material],
    uses: &[u64],
    images: &[Image],
    request: &Request,
    has_environment: bool,
    workers: usize,
) -> usize {
    let may_run = Effect::ALL.iter().filter(|&&effect| request.of(effect) != Some(false));
    let set = may_run.fold(EffectSet::NONE, |set, &effect| set.with(effect, true));
    let is_forced = |effect: &Effect| request.of(*effect) == Some(true);
    let called_for = used(materials, uses).fold(EffectSet::NONE, |all, material| all.or(calls_of(material)));
    if !set.iter().any(|effect| is_forced(&effect)) && !called_for.has_any(set) && !has_environment {
        return 0;
    }
    // What is called for by lights and cameras follows from emission and environments, or makes no more paths.
    let run = set.iter().filter(|effect| called_for.has(*effect) || is_forced(effect));
    let run = run.fold(EffectSet::NONE, |run, effect| run.with(effect, true));
    let run = run.with(Effect::Environment, has_environment);
    let (textures, _) =
        Textures::open(images, used(materials, uses).flat_map(|material| needed(material, set)));
    // Surfaces that give off light may call for light by way of others, whatever else is turned off.
    let run = run.with(Effect::Emission, called_for.has(Effect::Emission));
    textures.bytes() + workers * EffectScratch::bytes(run)
}

/// The surfaces that give off light.
fn emitters(surface: &impl Surface) -> Option<Emitters> {
    let materials = surface.materials();
    let light = |primitive: u32| {
        let radiance = materials.get(surface.material(primitive) as usize).map_or(Vec3::ZERO, |m| m.emission);
        (primitive, surface.corners(primitive), radiance)
    };
    Emitters::new(surface.emitters().into_iter().map(light))
}

/// The maps that a set of effects looks at, of materials that triangles have.
fn maps(surface: &impl Surface, set: EffectSet) -> Vec<&Map> {
    let uses = surface.uses();
    used(surface.materials(), &uses).flat_map(|material| needed(material, set)).collect()
}

/// The maps of a material that a set of effects looks at.
fn needed(material: &Material, set: EffectSet) -> Vec<&Map> {
    let maps = &material.maps;
    let opacity = if material.cutoff.is_some() { Effect::CutOuts } else { Effect::Transparency };
    [
        (&maps.diffuse, Effect::Textures),
        (&maps.specular, Effect::Textures),
        (&maps.roughness, Effect::Textures),
        (&maps.emission, Effect::Textures),
        (&maps.opacity, opacity),
        (&maps.normal, Effect::Bump),
        (&maps.bump, Effect::Bump),
    ]
    .into_iter()
    .filter(|(_, effect)| set.has(*effect))
    .filter_map(|(map, _)| map.as_ref())
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::{Channel, Colors, ImageSource, Mesh};

    fn scene(materials: Vec<Material>) -> Mesh {
        let triangles: Vec<[u32; 3]> = materials.iter().map(|_| [0, 1, 2]).collect();
        let of_triangle = (0..materials.len() as u32).collect();
        let missing =
            |name: &str| Image { name: name.into(), source: ImageSource::Missing("is not there".into()) };
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles,
            colors: Colors::PerMaterial { materials, of_triangle },
            images: vec![missing("bark.png"), missing("rough.png")],
            ..Mesh::default()
        }
    }

    fn staged(mesh: &Mesh, request: &str, samples: Option<u32>) -> Staged {
        let accel = Accel::build(mesh, &BuildParams::default()).expect("builds");
        let camera = Camera::new(Vec3::new(0.3, 0.3, 4.0), Vec3::new(0.3, 0.3, 0.0));
        let wishes = Wishes {
            request: request.parse().expect(request),
            lighting: Lighting::outdoors(Vec3::Y, Vec3::new(0.0, 0.6, 0.8)),
            environment: None,
            samples,
            limits: Limits::default(),
            error: None,
        };
        Staged::new(&accel, mesh, &camera, wishes)
    }

    #[test]
    fn memory_beside_is_what_may_run_takes() {
        let beside = |material: Material, request: &str, has_environment: bool| {
            let request = request.parse().expect(request);
            memory_beside(&[material], &[1], &[], &request, has_environment, 16)
        };
        let plain = Material::default();
        let mirror = Material { specular: Vec3::ONE, reflects: true, roughness: 0.0, ..Material::default() };
        let lamp = Material { emission: Vec3::ONE, ..Material::default() };
        let varnish = Material { specular: Vec3::ONE, roughness: 0.3, ..Material::default() };
        assert_eq!(beside(plain.clone(), "auto", false), 0);
        let few = beside(varnish.clone(), "auto", false);
        assert!(few > 0);
        assert_eq!(beside(mirror.clone(), "-reflection,+textures", false), few);
        let many = beside(mirror, "auto", false);
        assert!(many > 2 * few, "{many} and {few}");
        assert_eq!(beside(plain.clone(), "+ambient-occlusion", false), many);
        assert_eq!(beside(plain, "auto", true), many);
        assert_eq!(beside(varnish, "auto", true), many);
        // Its light may come by way of other surfaces.
        assert_eq!(beside(lamp, "-soft-shadows,-emission,+textures", false), many);
    }

    #[test]
    fn matt_scenes_need_nothing() {
        let staged = staged(&scene(vec![Material::default()]), "auto", None);
        assert!(staged.appearance.is_none());
        assert_eq!((staged.samples, staged.problems.len()), (1, 0));
    }

    #[test]
    fn pictures_that_nothing_calls_for_are_not_opened() {
        let mut bark = Material::default();
        bark.maps.diffuse = Some(Map::whole(0, Channel::Color));
        bark.maps.bump = Some(Map::whole(1, Channel::Grey));
        let mesh = scene(vec![bark]);
        let opened = |request: &str| -> Vec<String> {
            staged(&mesh, request, None).problems.into_iter().map(|problem| problem.image).collect()
        };
        assert_eq!(opened("auto"), ["bark.png", "rough.png"]);
        assert_eq!(opened("-bump"), ["bark.png"]);
        assert_eq!(opened("none"), [""; 0]);
    }

    #[test]
    fn effects_of_chance_get_many_samples_unless_their_number_is_given() {
        let mesh = scene(vec![Material::default()]);
        let error = |staged: &Staged| staged.appearance.as_ref().map(|appearance| appearance.limits.error);
        let auto = staged(&mesh, "+ambient-occlusion", None);
        assert_eq!((auto.samples, error(&auto)), (MANY, Some(FINE)));
        let given = staged(&mesh, "+ambient-occlusion", Some(5));
        assert_eq!((given.samples, error(&given)), (5, Some(0.0)));
    }

    #[test]
    fn a_lamp_that_lights_the_scene_takes_the_key_lights_place() {
        let lamp = Material { emission: Vec3::splat(30.0), ..Material::default() };
        let mut mesh = scene(vec![Material::default(), lamp]);
        // A lamp the size of the wall, before it and off to the side.
        mesh.positions.extend([
            Vec3::new(-3.0, 0.0, 2.0),
            Vec3::new(-3.0, 2.0, 2.0),
            Vec3::new(-3.0, 0.0, 0.5),
        ]);
        mesh.triangles[1] = [3, 4, 5];
        let lit = staged(&mesh, "auto", None);
        let set = lit.analysis.set();
        assert!(
            set.has(Effect::SoftShadows) && set.has(Effect::Interreflection) && !set.has(Effect::Shadows)
        );
        let lights = lit.appearance.expect("effects").lights;
        assert!(lights.key.is_none() && lights.ambient.is_none() && lights.emitters.is_some());

        let Colors::PerMaterial { materials, .. } = &mut mesh.colors else { panic!("it has materials") };
        materials[1].emission = Vec3::splat(1e-4);
        let dim = staged(&mesh, "auto", None).analysis.set();
        assert!(dim.has(Effect::Shadows) && !dim.has(Effect::Interreflection), "too dim to see by");
    }
}
