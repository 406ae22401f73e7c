//! Cornell boxes, and glass, water and mirrors from the text of model files, against theory.

use crate::cornell_box::{
    BLACK, GLASS, LAMP, LIGHT, MIRROR, Model, PERFECT_MIRROR, ROOM, WATER, camera, matt, painted,
};
use crate::scenes::{Shot, assert_light, mean};
use raypack::Vec3;
use raypack::mesh::Mesh;
use raypack::render::Frame;

/// From the origin along -Z, with no light but that of the scene.
fn ahead(fov: f32) -> Shot {
    let mut shot = Shot::new(Vec3::ZERO, Vec3::NEG_Z);
    (shot.camera.fov, shot.samples, shot.environment) = (fov, Some(1), Some(Vec3::ZERO));
    shot
}

/// What unpolarised light is thrown back where the index of refraction becomes `eta` times as high: Fresnel.
fn fresnel(cosine: f64, eta: f64) -> f64 {
    let beyond = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
    let parallel = (eta * cosine - beyond) / (eta * cosine + beyond);
    let across = (cosine - eta * beyond) / (cosine + eta * beyond);
    0.5 * (parallel * parallel + across * across)
}

/// Squares of 8 x 8 pixels, row by row: the mean of each, and its standard error. That is taken from the spread of the
/// pixels, each of which has chance numbers of its own; the picture's own changes add to it.
fn blocks(frame: &Frame) -> Vec<[f32; 2]> {
    let (size, side) = (frame.size.width as usize, 8);
    let block = |top: usize, left: usize| {
        let pixel =
            |i: usize| Vec3::from(frame.color[(top + i / side) * size + left + i % side]).element_sum() / 3.0;
        let count = (side * side) as f32;
        let mean = (0..side * side).map(pixel).sum::<f32>() / count;
        let variance = (0..side * side).map(|i| (pixel(i) - mean).powi(2)).sum::<f32>() / (count - 1.0);
        [mean, (variance / count).sqrt()]
    };
    (0..size).step_by(side).flat_map(|y| (0..size).step_by(side).map(move |x| block(y, x))).collect()
}

/// Asserts that one picture is the other one seen in a mirror and times `part`: each block within four standard errors.
#[track_caller]
fn assert_mirrored(one: &Frame, other: &Frame, part: f32) {
    let (one, other) = (blocks(one), blocks(other));
    let across = (one.len() as f32).sqrt() as usize;
    for (i, [light, error]) in one.iter().enumerate() {
        let [seen, its_error] = other[i / across * across + across - 1 - i % across].map(|x| x * part);
        let most = 4.0 * error.hypot(its_error);
        assert!((light - seen).abs() <= most, "block {i}: {light} is not {seen}, give or take {most}");
    }
}

#[test]
fn in_walls_that_give_off_what_they_take_nothing_can_be_seen() {
    // Radiance 1 everywhere: e + a = 1. Mirrors throw it back, glass and water pass on what they do not throw back.
    let walls = [Vec3::splat(0.75), Vec3::new(0.6, 0.1, 0.05), Vec3::new(0.1, 0.5, 0.1), Vec3::ZERO];
    let walls = walls.map(|color| matt(color, Vec3::ONE - color));
    let mut model = Model::default();
    model.room([&walls[0], &walls[1], &walls[2], &walls[3]]).front(&walls[0]);
    model.material(PERFECT_MIRROR).ball(Vec3::new(4.0, 1.2, 4.0), 1.0, 8, false);
    model.material(GLASS).ball(Vec3::new(1.6, 1.2, 3.2), 1.0, 8, false);
    model.material(WATER).block(Vec3::new(2.0, -0.1, 1.6), Vec3::new(3.6, 0.8, 2.6));
    let mesh = model.mesh();
    // A wall, the mirror, the glass, the water.
    let targets = [
        Vec3::new(5.56, 4.0, 3.0),
        Vec3::new(4.0, 1.2, 4.0),
        Vec3::new(1.6, 1.2, 3.2),
        Vec3::new(2.8, 0.6, 2.0),
    ];
    for target in targets {
        let mut shot = Shot { samples: Some(16), ..Shot::new(Vec3::new(2.78, 2.73, 0.2), target) };
        shot.camera.fov = 10.0;
        // 4096 paths whose light spreads by less than 0.3: four standard errors are 0.02.
        assert_light(shot.mean(&mesh), Vec3::ONE, 0.02);
    }
}

#[test]
fn the_light_of_a_closed_box_is_the_lamps_over_what_is_taken() {
    // What is given off is taken somewhere: E A(lamp) = (1 - a) L A, where L is the mean over all of the surface. Each
    // channel has an albedo of its own.
    let albedo = Vec3::new(0.2, 0.5, 0.8);
    let grey = matt(albedo, Vec3::ZERO);
    let mut model = Model::default();
    model.room([&grey, &grey, &grey, &matt(albedo, Vec3::ONE)]).front(&grey);
    let mesh = model.mesh();
    let (mut light, mut area) = (Vec3::ZERO, 0.0);
    let size = 8;
    for toward in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        let middle = ROOM * 0.5;
        let mut shot = Shot { size, samples: Some(64), ..Shot::new(middle, middle + toward) };
        (shot.camera.fov, shot.camera.up) = (90.0, if toward.y == 0.0 { Vec3::Y } else { Vec3::X });
        shot.environment = Some(Vec3::ZERO);
        let accel = raypack::traverse::Accel::build(&mesh, &Default::default()).expect("builds");
        let (frame, _) = shot.with(&accel, &mesh, |settings| {
            (settings.aovs.depth, settings.aovs.normal) = (true, true);
        });
        let (depth, normals) = (frame.depth.expect("asked for"), frame.normal.expect("asked for"));
        let view = shot.camera.view(size, size);
        for pixel in 0..(size * size) as usize {
            let at = [pixel as u32 % size, pixel as u32 / size];
            let direction = view.ray(at[0], at[1], [0.5; 2]).direction.normalize();
            // The pixel's solid angle, and the surface that is seen in it.
            let angle = 4.0 / (size * size) as f32 * direction.dot(toward).powi(3);
            let seen = angle * depth[pixel].powi(2) / -direction.dot(normals[pixel].into());
            light += seen * Vec3::from(frame.color[pixel]);
            area += seen;
        }
    }
    let surface = 2.0 * (ROOM.x * ROOM.y + ROOM.y * ROOM.z + ROOM.z * ROOM.x);
    assert!((area / surface - 1.0).abs() < 0.01, "{area} {surface}");
    let lamp = (LAMP[1].x - LAMP[0].x) * (LAMP[1].z - LAMP[0].z);
    // 24576 paths whose light spreads by less than twice its mean: four standard errors are 0.05.
    assert_light(light / area, lamp / surface / (Vec3::ONE - albedo), 0.05);
}

#[test]
fn a_floor_is_redder_beside_a_red_wall() {
    let mesh = painted(15.0).mesh();
    let red = |x: f32, bounces: u32| {
        let eye = Vec3::new(2.78, 2.7, 1.0);
        let mut shot = Shot { bounces, samples: Some(32), ..Shot::new(eye, Vec3::new(x, 0.0, 2.8)) };
        (shot.camera.fov, shot.environment) = (3.0, Some(Vec3::ZERO));
        let light = shot.mean(&mesh);
        light.x / light.y
    };
    let [left, middle, right] = [5.3, 2.78, 0.26].map(|x| red(x, 4));
    assert!(left > 1.15 && (0.95..1.1).contains(&middle) && right < 0.95, "{left} {middle} {right}");
    // The lamp and the floor have no colour: without light by way of walls nor has the picture.
    assert!([5.3, 2.78, 0.26].iter().all(|&x| (red(x, 0) - 1.0).abs() < 1e-6));
}

#[test]
fn a_symmetric_box_gives_a_symmetric_picture() {
    let white = matt(Vec3::splat(0.7), Vec3::ZERO);
    let mut model = Model::default();
    model.room([&white, &white, &white, &matt(Vec3::ZERO, Vec3::splat(10.0))]);
    model.material(MIRROR).ball(Vec3::new(0.5 * ROOM.x, 1.5, 3.5), 1.2, 16, true);
    let shot = Shot { camera: camera(), size: 32, samples: Some(16), bounces: 3, ..ahead(0.0) };
    let (frame, _) = shot.of(&model.mesh());
    assert!(mean(&frame).x > 0.1);
    assert_mirrored(&frame, &frame, 1.0);
}

#[test]
fn a_plane_mirror_shows_what_an_eye_behind_it_would_see() {
    let room = |has_mirror: bool| {
        let [white, red, green] = [Vec3::splat(0.7), Vec3::X, Vec3::Y].map(|color| matt(color, Vec3::ZERO));
        let mut model = Model::default();
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * ROOM);
        model.material(&white).square(Vec3::ZERO, z, x).square(y, x, z).square(Vec3::ZERO, x, y);
        model.block(Vec3::new(3.0, 0.0, 0.4), Vec3::new(4.4, 3.2, 1.2));
        model.material(&red).square(x, z, y);
        model.material(&green).square(Vec3::ZERO, y, z);
        let lamp = [Vec3::new(2.0, 5.4, 2.0), Vec3::X * 1.5, Vec3::Z * 1.5];
        model.material(&matt(Vec3::ZERO, Vec3::splat(15.0))).square(lamp[0], lamp[1], lamp[2]);
        if has_mirror {
            model.material(MIRROR).square(z, y, x);
        }
        model.mesh()
    };
    let (eye, at) = (Vec3::new(2.0, 2.5, 1.6), Vec3::new(2.6, 2.9, ROOM.z));
    let behind = Vec3::new(eye.x, eye.y, 2.0 * ROOM.z - eye.z);
    // Light straight from the lamp alone, which is the same with a mirror and without.
    let picture = |eye: Vec3, bounces: u32| {
        let mut shot = Shot { size: 32, samples: Some(16), bounces, ..Shot::new(eye, at) };
        (shot.camera.fov, shot.environment) = (30.0, Some(Vec3::ZERO));
        shot.of(&room(bounces == 1)).0
    };
    let (seen, expected) = (picture(eye, 1), picture(behind, 0));
    let [left, right] = [0, 31].map(|x| Vec3::from(expected.color[16 * 32 + x]));
    assert!((left - right).abs().max_element() > 0.1, "there is something to tell left from right by");
    assert_mirrored(&seen, &expected, 0.9);
}

/// The tangent of the angle at which the left edge of a light is seen, by how much of the picture is lit.
fn edge(fov: f32, mesh: &Mesh) -> f64 {
    let shot = Shot { size: 64, samples: Some(16), effects: "-reflection", ..ahead(fov) };
    let (frame, _) = shot.of(mesh);
    let row = &frame.color[32 * 64..33 * 64];
    let lit: f64 = row.iter().map(|c| f64::from(c[0] / row[63][0])).sum();
    (1.0 - lit / 32.0) * f64::from(fov / 2.0).to_radians().tan()
}

/// A light from `x` on to the right, at a distance, behind something clear that begins at `near`.
fn light_behind(material: &str, x: f32, distance: f32, [near, far]: [f32; 2]) -> Mesh {
    let mut model = Model::default();
    model.material(LIGHT).square(Vec3::new(x, -50.0, -distance), Vec3::X * 100.0, Vec3::Y * 100.0);
    model.material(material).block(Vec3::new(-40.0, -40.0, -far), Vec3::new(40.0, 40.0, -near));
    model.mesh()
}

#[test]
fn a_slab_moves_what_is_behind_it_as_snells_law_says() {
    let mesh = light_behind(GLASS, 4.0, 10.0, [4.0, 6.0]);
    // Eight of air and two of glass are 4 to the side together: by bisection.
    let aside = |tangent: f64| {
        let sine = tangent / tangent.hypot(1.0) / 1.5;
        8.0 * tangent + 2.0 * sine / (1.0 - sine * sine).sqrt()
    };
    let (mut least, mut greatest) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (least + greatest);
        *if aside(middle) < 4.0 { &mut least } else { &mut greatest } = middle;
    }
    let seen = edge(60.0, &mesh);
    // A fifth of a pixel; without glass the tangent would be 0.4.
    let pixel = 2.0 * 30.0f64.to_radians().tan() / 64.0;
    assert!((seen - least).abs() < 0.2 * pixel, "{seen} is not {least}");
    assert!(least - 0.4 > pixel, "{least} and 0.4 can be told apart");
}

#[test]
fn water_is_less_deep_than_it_is_by_its_index() {
    // Three of air and four of water: seen straight on as if it were 4 / 1.33.
    let mesh = light_behind(WATER, 0.6, 7.0, [3.0, 20.0]);
    let depth = 0.6 / edge(20.0, &mesh) - 3.0;
    assert!((depth / (4.0 / 1.33) - 1.0).abs() < 0.02, "{depth}");
}

#[test]
fn what_deep_water_takes_follows_beer_and_lambert() {
    // The same floor at two depths: what else happens to the light is the same.
    let absorption = Vec3::new(0.45, 0.06, 0.02);
    let light = |depth: f32| {
        let mut mesh = light_behind(WATER, -50.0, 3.0 + depth, [3.0, 20.0]);
        let raypack::mesh::Colors::PerMaterial { materials, .. } = &mut mesh.colors else {
            panic!("materials")
        };
        materials.iter_mut().filter(|material| material.ior != 1.0).for_each(|m| m.absorption = absorption);
        Shot { effects: "-reflection", ..ahead(0.5) }.mean(&mesh)
    };
    let expected = (absorption * -5.0).map(f32::exp);
    assert_light(light(6.0) / light(1.0), expected, 1e-3);
}

#[test]
fn water_is_a_mirror_at_grazing_angles_as_fresnel_says() {
    let mut model = Model::default();
    model.material(LIGHT).square(Vec3::new(-900.0, 50.0, -900.0), Vec3::X * 1800.0, Vec3::Z * 1800.0);
    model.material(WATER).block(Vec3::new(-100.0, -50.0, -100.0), Vec3::new(100.0, 0.0, 100.0));
    // Nothing is seen below.
    model.material(BLACK).square(Vec3::new(-99.0, -1.0, -99.0), Vec3::Z * 198.0, Vec3::X * 198.0);
    let mesh = model.mesh();
    for degrees in [1.0f64, 30.0, 53.06, 75.0, 85.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let mut shot = ahead(0.02);
        shot.camera.eye = Vec3::Y;
        shot.camera.at = Vec3::new(0.0, 1.0 - cos as f32, -sin as f32);
        // Reflections fainter than a 64th go on by chance.
        shot.samples = Some(64);
        let expected = fresnel(cos, 1.33) as f32;
        assert_light(shot.mean(&mesh), Vec3::splat(expected), if expected < 0.05 { 0.05 } else { 0.01 });
    }
}

#[test]
fn a_prism_turns_light_by_total_internal_reflection() {
    let turned = |index: f32| {
        let mut model = Model::default();
        let glass = format!("illum 7\nKd 0 0 0\nKs 1 1 1\nNi {index}\nTf 1 1 1");
        let edge = |y: f32, z: f32| [-1.0, 1.0].map(|x| Vec3::new(x, y, z - 5.0));
        let [a, b, c] = [edge(-1.0, 0.0), edge(1.0, 0.0), edge(1.0, -2.0)];
        model.material(&glass).face(&[a[0], a[1], b[1], b[0]]).face(&[b[0], b[1], c[1], c[0]]);
        model.face(&[c[0], c[1], a[1], a[0]]).face(&[a[0], b[0], c[0]]).face(&[c[1], b[1], a[1]]);
        model.material(LIGHT).square(Vec3::new(-3.0, 5.0, -9.0), Vec3::X * 6.0, Vec3::Z * 6.0);
        Shot { samples: Some(4), ..ahead(0.2) }.mean(&model.mesh())
    };
    // In by one leg, out by the other, straight on; what is thrown back there comes by a second time.
    let once = fresnel(1.0, 1.5);
    let expected = (1.0 - once).powi(2) / (1.0 - once * once);
    assert_light(turned(1.5), Vec3::splat(expected as f32), 2e-3);
    // Below the index of 1.414 most of it goes out by the long side.
    let (once, there) = (fresnel(1.0, 1.3), fresnel(0.5f64.sqrt(), 1.0 / 1.3));
    assert_light(turned(1.3), Vec3::splat(((1.0 - once).powi(2) * there) as f32), 0.02);
}

#[test]
fn a_glass_ball_is_a_lens() {
    // Its focal length is n r / (2 (n - 1)) from its middle: 1.5. From 3 away, all light goes through a point 3 behind.
    let lit = |distance: f32| {
        let mut model = Model::default();
        let half = 0.02;
        let at = Vec3::new(-half, -half, -3.0 - distance);
        model.material(LIGHT).square(at, Vec3::X * 2.0 * half, Vec3::Y * 2.0 * half);
        model.material(GLASS).ball(Vec3::NEG_Z * 3.0, 1.0, 64, true);
        Shot { effects: "-reflection", ..ahead(4.0) }.mean(&model.mesh()).x
    };
    let through = (1.0 - fresnel(1.0, 1.5)).powi(2) as f32;
    assert_light(Vec3::splat(lit(3.0)), Vec3::splat(through), 0.05);
    // Elsewhere, the lamp is a part of what is seen: at half the way, rays are half as far from the axis as at the ball.
    assert!(lit(1.5) < 0.3 * through, "{}", lit(1.5));

    // What is on the right behind it is seen on the left.
    let mut model = Model::default();
    model.material(LIGHT).square(Vec3::new(0.0, -50.0, -30.0), Vec3::X * 100.0, Vec3::Y * 100.0);
    model.material(GLASS).ball(Vec3::NEG_Z * 3.0, 1.0, 64, true);
    let (frame, _) = Shot { effects: "-reflection", ..ahead(8.0) }.of(&model.mesh());
    let [left, right] = [2, 13].map(|x| frame.color[8 * 16 + x][0]);
    assert!(left > 0.9 * through && right == 0.0, "{left} {right}");
}
