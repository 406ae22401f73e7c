//! Light against theory.

use crate::scenes::{Builder, Shot, assert_light};
use raypack::Vec3;
use raypack::mesh::{Material, Mesh};
use raypack::scene::effects::Effect;

/// No light but that of the scene.
const BLACK: Option<Vec3> = Some(Vec3::ZERO);

fn lamp(radiance: Vec3) -> Material {
    Material { emission: radiance, ..Material::matt("lamp", Vec3::ZERO) }
}

fn mirror(specular: Vec3) -> Material {
    Material { specular, reflects: true, roughness: 0.0, ..Material::matt("mirror", Vec3::ZERO) }
}

fn glass(ior: f32) -> Material {
    Material {
        transmission: Vec3::ONE,
        ior,
        fresnel: true,
        reflects: true,
        specular: Vec3::ONE,
        roughness: 0.0,
        ..Material::matt("glass", Vec3::ZERO)
    }
}

/// A square lamp 10 before the origin, seen along -Z, and what is put between.
fn before_a_lamp(radiance: Vec3, between: impl FnOnce(&mut Builder)) -> Mesh {
    let mut scene = Builder::default();
    let lamp = scene.material(lamp(radiance));
    scene.square(lamp, Vec3::new(-50.0, -50.0, -10.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    between(&mut scene);
    scene.mesh()
}

/// From the origin along -Z, through hardly any angle.
fn ahead() -> Shot {
    let mut shot = Shot::new(Vec3::ZERO, Vec3::NEG_Z);
    shot.camera.fov = 0.5;
    shot.samples = Some(1);
    shot.environment = BLACK;
    shot
}

#[test]
fn in_a_box_that_glows_light_adds_up_to_the_geometric_series() {
    // Everything sees the same everywhere: L = e + a L.
    let mut scene = Builder::default();
    let wall = Material { emission: Vec3::splat(1.0), ..Material::matt("wall", Vec3::new(0.5, 0.25, 0.0)) };
    let wall = scene.material(wall);
    scene.cube(wall, Vec3::splat(-1.0), Vec3::splat(1.0));
    let mesh = scene.mesh();
    let shot = Shot { samples: Some(256), ..Shot::new(Vec3::ZERO, Vec3::new(0.3, 0.2, -1.0)) };
    assert_light(shot.mean(&mesh), Vec3::new(2.0, 4.0 / 3.0, 1.0), 0.02);
    // However many rays look for the light, it is the same.
    let shot = Shot { shadow_samples: 3, ..shot };
    assert_light(shot.mean(&mesh), Vec3::new(2.0, 4.0 / 3.0, 1.0), 0.02);
    // One surface before the one that is seen: e + a e.
    let shot = Shot { bounces: 0, ..shot };
    assert_light(shot.mean(&mesh), Vec3::new(1.5, 1.25, 1.0), 0.02);
}

#[test]
fn a_white_ball_in_white_light_cannot_be_seen() {
    // Convex, so nothing of it lights itself: the furnace.
    let mut scene = Builder::default();
    let white = scene.material(Material::matt("white", Vec3::ONE));
    scene.cube(white, Vec3::splat(-1.0), Vec3::splat(1.0));
    let shot = Shot {
        environment: Some(Vec3::new(1.0, 0.5, 2.0)),
        samples: Some(64),
        ..Shot::new(Vec3::new(3.0, 4.0, 5.0), Vec3::ZERO)
    };
    assert_light(shot.mean(&scene.mesh()), Vec3::new(1.0, 0.5, 2.0), 0.02);
}

#[test]
fn a_metal_ball_in_white_light_cannot_be_seen_however_rough() {
    for roughness in [0.0, 0.05, 0.2] {
        let mut scene = Builder::default();
        let metal = scene.material(Material { roughness, ..mirror(Vec3::ONE) });
        scene.cube(metal, Vec3::splat(-1.0), Vec3::splat(1.0));
        let shot = Shot {
            environment: Some(Vec3::ONE),
            samples: Some(64),
            ..Shot::new(Vec3::new(3.0, 4.0, 5.0), Vec3::ZERO)
        };
        // Light that facets throw at one another is lost: a little at these roughnesses.
        let light = shot.mean(&scene.mesh()).x;
        let least = if roughness == 0.0 { 1.0 } else { 0.9 };
        assert!((least..=1.0 + 1e-6).contains(&light), "{roughness}: {light}");
    }
}

#[test]
fn a_mirror_shows_what_is_before_it_in_its_own_colour() {
    // The lamp is behind the eye, the mirror ahead.
    let mut scene = Builder::default();
    let lamp = scene.material(lamp(Vec3::new(2.0, 3.0, 4.0)));
    let mirror = scene.material(mirror(Vec3::new(1.0, 0.5, 0.25)));
    scene.square(lamp, Vec3::new(-9.0, -9.0, 5.0), Vec3::Y * 18.0, Vec3::X * 18.0);
    scene.square(mirror, Vec3::new(-9.0, -9.0, -5.0), Vec3::X * 18.0, Vec3::Y * 18.0);
    let (frame, stats) = ahead().of(&scene.mesh());
    assert!(frame.color.iter().all(|&c| c == [2.0, 1.5, 1.0]));
    let reflected = stats.costs.iter().find(|(effect, _)| *effect == Effect::Reflection).expect("it ran").1;
    assert_eq!(reflected.rays, 256);
}

#[test]
fn mirrors_that_face_each_other_are_followed_as_far_as_asked() {
    let mut scene = Builder::default();
    let glowing = Material { emission: Vec3::ONE, ..mirror(Vec3::splat(0.5)) };
    let glowing = scene.material(glowing);
    scene.square(glowing, Vec3::new(-9.0, -9.0, -1.0), Vec3::X * 18.0, Vec3::Y * 18.0);
    scene.square(glowing, Vec3::new(-9.0, -9.0, 1.0), Vec3::Y * 18.0, Vec3::X * 18.0);
    let mesh = scene.mesh();
    for bounces in [0, 1, 4] {
        let shot = Shot { bounces, ..ahead() };
        let expected = 2.0 - 0.5f32.powi(bounces as i32);
        assert_light(shot.mean(&mesh), Vec3::splat(expected), 1e-5);
    }
}

#[test]
fn a_pane_lets_through_what_fresnel_says() {
    // Light goes to and fro in it: (1 - R) / (1 + R) comes out in the end.
    for ior in [1.33f32, 1.5, 2.4] {
        let mesh = before_a_lamp(Vec3::ONE, |scene| {
            let glass = scene.material(glass(ior));
            scene.cube(glass, Vec3::new(-20.0, -20.0, -6.0), Vec3::new(20.0, 20.0, -5.0));
        });
        let reflected = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let through = (1.0 - reflected) / (1.0 + reflected);
        assert_light(ahead().mean(&mesh), Vec3::splat(through), 2e-3);
    }
}

#[test]
fn what_glass_absorbs_follows_beer_and_lambert() {
    let absorption = Vec3::new(0.1, 0.7, 0.0);
    let mesh = before_a_lamp(Vec3::ONE, |scene| {
        // As much as air bends light, so that nothing is thrown back at its surfaces; but not thin.
        let glass = scene.material(Material { absorption, fresnel: false, ..glass(1.000_001) });
        scene.cube(glass, Vec3::new(-20.0, -20.0, -8.0), Vec3::new(20.0, 20.0, -5.0));
    });
    let expected = (-3.0 * absorption.as_dvec3()).to_array().map(|x| x.exp() as f32);
    assert_light(ahead().mean(&mesh), Vec3::from(expected), 1e-3);
    // Turned off, it costs nothing and takes nothing.
    let shot = Shot { effects: "-absorption", ..ahead() };
    assert_light(shot.mean(&mesh), Vec3::ONE, 1e-3);
}

#[test]
fn what_is_lost_on_the_way_is_lost_before_plain_surfaces_too() {
    let mut scene = Builder::default();
    let poster = scene.material(Material { unlit: true, ..Material::matt("poster", Vec3::ONE) });
    let absorption = Vec3::new(0.2, 0.0, 0.4);
    let glass = scene.material(Material { absorption, fresnel: false, ..glass(1.000_001) });
    scene.square(poster, Vec3::new(-50.0, -50.0, -10.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    // The poster is inside: nothing else is met on the way.
    scene.cube(glass, Vec3::new(-20.0, -20.0, -12.0), Vec3::new(20.0, 20.0, -5.0));
    let expected = (-5.0 * absorption.as_dvec3()).to_array().map(|x| x.exp() as f32);
    assert_light(ahead().mean(&scene.mesh()), Vec3::from(expected), 1e-3);
}

#[test]
fn from_under_water_the_surface_is_a_mirror_beyond_the_critical_angle() {
    // The eye is in water and looks up at 60 degrees from the vertical: 48.6 is as far as light comes out.
    let mut scene = Builder::default();
    let water = scene.material(glass(1.33));
    let sky = scene.material(lamp(Vec3::X));
    let ground = scene.material(lamp(Vec3::Y));
    scene.cube(water, Vec3::new(-100.0, -10.0, -100.0), Vec3::new(100.0, 0.0, 100.0));
    scene.square(sky, Vec3::new(-500.0, 50.0, -500.0), Vec3::X * 1000.0, Vec3::Z * 1000.0);
    scene.square(ground, Vec3::new(-90.0, -9.0, -90.0), Vec3::Z * 180.0, Vec3::X * 180.0);
    let mesh = scene.mesh();
    let up = |degrees: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let eye = Vec3::new(0.0, -5.0, 0.0);
        let mut shot =
            Shot { samples: Some(1), environment: BLACK, ..Shot::new(eye, eye + Vec3::new(0.0, cos, -sin)) };
        shot.camera.fov = 0.5;
        shot.mean(&mesh)
    };
    assert_light(up(60.0), Vec3::Y, 1e-6);
    let steep = up(10.0);
    assert!(steep.x > 0.95 && steep.y < 0.05, "{steep}");
}

#[test]
fn a_lamp_lights_a_floor_by_its_form_factor() {
    // A parallel square, seen from below its middle: F = 4 F(corner).
    let (half, height) = (1.0f64, 2.0f64);
    let mut scene = Builder::default();
    let lamp = scene.material(lamp(Vec3::splat(5.0)));
    let floor = scene.material(Material::matt("floor", Vec3::splat(0.5)));
    scene.square(lamp, Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
    scene.square(floor, Vec3::new(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0);
    let mesh = scene.mesh();
    let r = (half * half + height * height).sqrt();
    let corner = (2.0 * half / r) * (half / r).atan() / std::f64::consts::TAU;
    let expected = 0.5 * 5.0 * 4.0 * corner;
    let mut shot =
        Shot { samples: Some(64), environment: BLACK, ..Shot::new(Vec3::new(0.0, 1.0, 0.01), Vec3::ZERO) };
    shot.camera.fov = 0.5;
    // Nothing but the lamp is there for the floor's light to come back from, and the lamp is black.
    assert_light(shot.mean(&mesh), Vec3::splat(expected as f32), 0.01);

    // Behind a board, there is none of it.
    let mut scene = Builder::default();
    let lamp = scene.material(Material { emission: Vec3::splat(5.0), ..Material::matt("lamp", Vec3::ZERO) });
    let black = scene.material(Material::matt("black", Vec3::ZERO));
    let floor = scene.material(Material::matt("floor", Vec3::splat(0.5)));
    scene.square(lamp, Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
    scene.square(black, Vec3::new(-9.0, 1.5, -9.0), Vec3::X * 18.0, Vec3::Z * 18.0);
    scene.square(floor, Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0);
    let dark = Shot { bounces: 0, ..shot };
    assert_eq!(dark.mean(&scene.mesh()), Vec3::ZERO);
}

#[test]
fn half_a_veil_shows_half_of_what_is_behind() {
    let mesh = before_a_lamp(Vec3::splat(3.0), |scene| {
        let veil = scene.material(Material { opacity: 0.25, ..Material::matt("veil", Vec3::ZERO) });
        scene.square(veil, Vec3::new(-9.0, -9.0, -5.0), Vec3::X * 18.0, Vec3::Y * 18.0);
        scene.square(veil, Vec3::new(-9.0, -9.0, -6.0), Vec3::X * 18.0, Vec3::Y * 18.0);
    });
    assert_light(ahead().mean(&mesh), Vec3::splat(3.0 * 0.75 * 0.75), 1e-6);
}

#[test]
fn a_lens_blurs_what_it_is_not_focused_to_and_nothing_else() {
    // A lamp's edge through the middle of the picture, in focus and out of it.
    let mut scene = Builder::default();
    let lamp = scene.material(lamp(Vec3::ONE));
    scene.square(lamp, Vec3::new(0.0, -50.0, -10.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    let mesh = scene.mesh();
    let between = |aperture: f32, focus: f32| {
        let mut shot =
            Shot { samples: Some(64), size: 32, environment: BLACK, ..Shot::new(Vec3::ZERO, Vec3::NEG_Z) };
        (shot.camera.aperture, shot.camera.focus, shot.camera.fov) = (aperture, Some(focus), 20.0);
        let (frame, _) = shot.of(&mesh);
        frame.color.iter().filter(|c| c[0] > 0.02 && c[0] < 0.98).count()
    };
    assert!(between(0.0, 10.0) <= 32, "sharp without a lens");
    assert!(between(1.0, 10.0) <= 32, "sharp in focus");
    assert!(between(1.0, 5.0) > 200, "blurred behind it");
}
