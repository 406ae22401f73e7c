//! What a scene does not call for costs nothing.

use crate::scenes::{Builder, Shot, counts};
use raypack::Vec3;
use raypack::mesh::{Material, Mesh};
use raypack::scene::effects::Effect;

fn scene(material: Material) -> Mesh {
    let mut scene = Builder::default();
    let ground = scene.material(Material::matt("ground", Vec3::splat(0.5)));
    let thing = scene.material(material);
    scene.square(ground, Vec3::new(-9.0, 0.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0);
    scene.cube(thing, Vec3::new(-1.0, 0.5, -1.0), Vec3::new(1.0, 2.5, 1.0));
    scene.mesh()
}

/// The effects that ran, and how many rays each cast.
fn rays(mesh: &Mesh, effects: &'static str) -> Vec<(Effect, u64)> {
    let shot = Shot { effects, samples: Some(2), ..Shot::new(Vec3::new(3.0, 4.0, 5.0), Vec3::Y) };
    counts(&shot.of(mesh).1)
}

fn shiny() -> Material {
    Material {
        specular: Vec3::splat(0.5),
        reflects: true,
        roughness: 0.0,
        ..Material::matt("shiny", Vec3::X)
    }
}

#[test]
fn a_matt_scene_is_left_to_the_plain_renderer() {
    assert_eq!(rays(&scene(Material::matt("matt", Vec3::X)), "auto"), []);
}

#[test]
fn effects_that_are_off_cast_no_rays() {
    let mesh = scene(shiny());
    let on = rays(&mesh, "auto");
    let names: Vec<Effect> = on.iter().map(|(effect, _)| *effect).collect();
    assert_eq!(names, [Effect::Shadows, Effect::Reflection]);
    assert!(on.iter().all(|(_, rays)| *rays > 0), "{on:?}");
    assert_eq!(rays(&mesh, "-reflection"), [], "nothing is left that the plain renderer lacks");
    let without_shadows = rays(&mesh, "-shadows");
    assert!(matches!(without_shadows[..], [(Effect::Reflection, 1..)]), "{without_shadows:?}");
}

#[test]
fn what_is_not_asked_for_has_no_place_in_a_list() {
    let glass = Material {
        transmission: Vec3::splat(0.9),
        ior: 1.5,
        fresnel: true,
        absorption: Vec3::ONE,
        ..shiny()
    };
    let mesh = scene(glass);
    let ran = rays(&mesh, "refraction,shadows");
    assert_eq!(
        ran.iter().map(|(effect, _)| *effect).collect::<Vec<_>>(),
        [Effect::Shadows, Effect::Refraction]
    );
}

#[test]
fn a_matt_scene_looks_the_same_through_the_renderer_of_effects() {
    // Forced on, an effect that nothing calls for changes no pixel: what is plain is shaded plainly.
    let mesh = scene(Material::matt("matt", Vec3::X));
    let shot = |effects| Shot { effects, samples: Some(1), ..Shot::new(Vec3::new(3.0, 4.0, 5.0), Vec3::Y) };
    let (plain, _) = shot("auto").of(&mesh);
    let (through, stats) = shot("+reflection,+textures").of(&mesh);
    assert!(!stats.costs.is_empty(), "it went the other way");
    for (one, other) in plain.color.iter().zip(&through.color) {
        assert!((Vec3::from(*one) - Vec3::from(*other)).abs().max_element() < 1e-6, "{one:?} {other:?}");
    }
}
