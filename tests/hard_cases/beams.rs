//! Rays from one point, in the order in which a picture's are: what the tile kernel takes together.
//! (Elsewhere most rays come from everywhere, and it hands them on to packets.)

use crate::meshes::{cube, floor, globe, joined, mapped, of_triangles, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::Scene;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::simd::Isa;
use raypack::traverse::{Accel, HitPacket, Kernel, RayPacket, TileCounts};

/// Rays from a point, sorted by where they go: neighbours go nearly the same way.
fn sorted(eye: Vec3, targets: impl IntoIterator<Item = Vec3>) -> Vec<Ray> {
    let mut rays: Vec<Ray> = targets
        .into_iter()
        .map(|target| Ray::new(eye, target - eye))
        .filter(|ray| ray.direction != Vec3::ZERO)
        .collect();
    rays.sort_by_cached_key(|ray| {
        let d = ray.direction;
        let axis =
            if d.x.abs() >= d.y.abs().max(d.z.abs()) { 0 } else { 1 + usize::from(d.z.abs() > d.y.abs()) };
        let along = d[axis];
        let cell = |i: usize| (d[(axis + i) % 3] / along.abs() * 4.0).floor() as i32;
        (axis, along < 0.0, cell(1), cell(2), (d[(axis + 2) % 3] / along.abs() * 16.0).floor() as i32)
    });
    rays
}

/// A square picture, in blocks of 16 x 16.
fn picture(eye: Vec3, at: Vec3, size: u32, fov: f32) -> Vec<Ray> {
    let forward = (at - eye).normalize();
    let right = forward.any_orthogonal_vector().normalize();
    let up = right.cross(forward);
    let step = 2.0 * (fov.to_radians() * 0.5).tan() / size as f32;
    let ray = |i: u32| {
        let (block, pixel) = (i / 256, i % 256);
        let (x, y) = (block % (size / 16) * 16 + pixel % 16, block / (size / 16) * 16 + pixel / 16);
        let place = |i: u32| (i as f32 + 0.5 - size as f32 * 0.5) * step;
        Ray::new(eye, forward + right * place(x) + up * place(y))
    };
    (0..size * size).map(ray).collect()
}

/// How many lots of 256 rays are beams, if they ask for their closest hits or for any.
fn beams(mesh: &Mesh, rays: &[Ray], any_hit: bool) -> u64 {
    let accel = Accel::build(mesh, &BuildParams::default()).expect("builds");
    let mut counts = TileCounts::default();
    for rays in rays.chunks_exact(256) {
        let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
        accel.count_tile(&packets, &[0xffff; 16], any_hit, &mut counts);
    }
    counts.beams
}

#[test]
fn beams_at_the_seams_of_closed_surfaces_do_not_pass() {
    let far = Vec3::new(148_376.0, 1234.0, -223_423.0);
    let ring = twisted_ring(48, 6, 1);
    for closed in [
        sphere(3),
        cube(8),
        globe(12, 30),
        sphere(3).placed("far", 100.0, far),
        ring.placed("small", 1e-3, Vec3::ONE),
    ] {
        let mut scene = Scene::new(&closed.name, 0, closed.mesh.clone());
        for seed in seeds() {
            scene.seed = seed;
            let mut numbers = Numbers::new(seed, 40);
            let eye = closed.inside(&mut numbers);
            let targets: Vec<Vec3> = (0..2560)
                .map(|_| {
                    let triangle = numbers.pick(&closed.mesh.triangles);
                    let first = numbers.below(3);
                    let [a, b] =
                        [first, (first + 1) % 3].map(|k| closed.mesh.positions[triangle[k] as usize]);
                    if numbers.below(2) == 0 { a } else { a + (b - a) * numbers.unit() }
                })
                .collect();
            let rays = sorted(eye, targets);
            assert!(beams(&closed.mesh, &rays, false) > 0, "{}: hardly a beam", closed.name);
            scene.check_closed(&rays);
        }
    }
}

#[test]
fn pictures_of_all_sorts_are_the_same_by_every_kernel() {
    let walls = |seed| {
        // Large and small, crossing each other: walls that reach past the eye, needles, dust.
        let mut numbers = Numbers::new(seed, 41);
        of_triangles((0..400).map(|i| {
            let size = [30.0, 3.0, 0.3, 0.01][i % 4];
            let (a, b) = (numbers.vector() * 10.0, numbers.vector() * size);
            let c =
                if i % 5 == 0 { b * 0.5 + numbers.vector() * size * 1e-5 } else { numbers.vector() * size };
            [a, a + b, a + c]
        }))
    };
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 42);
        let ball = sphere(3).mesh;
        let lines = of_triangles((0..200).map(|_| {
            let (a, b) = (numbers.vector() * 3.0, numbers.vector());
            [a, a + b, a + b * 2.0]
        }));
        let meshes = [
            ("walls", walls(seed)),
            ("balls in a hall", joined([&ball, &mapped(&ball, |p| p * 40.0), &mapped(&ball, |p| p * 0.01)])),
            ("two floors in one", joined([&floor(8), &floor(8), &floor(3)])),
            ("lines", joined([&lines, &ball])),
        ];
        for (name, mesh) in meshes {
            let mut scene = Scene::new(name, seed, mesh);
            let corner = numbers.pick(&scene.mesh.positions);
            let views = [
                // Straight along an axis, zeros in the directions.
                (Vec3::new(0.25, 0.5, 3.0), Vec3::new(0.25, 0.5, 0.0), 60.0),
                // From a corner's own place, and so on planes that split.
                (corner, Vec3::splat(0.1), 80.0),
                (numbers.vector() * 5.0, numbers.vector(), 20.0),
                // So that all rays meet next to nothing.
                (numbers.vector() * 4000.0, numbers.vector(), 0.02),
            ];
            for (eye, at, fov) in views {
                let rays = picture(eye, at, 32, fov);
                scene.trace(&rays);
            }
            let rays = picture(Vec3::new(0.25, 0.5, 3.0), Vec3::new(0.25, 0.5, 0.0), 32, 60.0);
            assert_eq!(beams(&scene.mesh, &rays, false), 4, "{name}");
        }
    }
}

#[test]
fn intervals_are_kept_by_beams_too() {
    let ball = sphere(3).mesh;
    let mesh = joined([&ball, &mapped(&ball, |p| p * 1.5), &mapped(&ball, |p| p * 2.0)]);
    let mut scene = Scene::new("three shells", 0, mesh);
    for seed in seeds() {
        scene.seed = seed;
        let mut numbers = Numbers::new(seed, 43);
        let mut rays = picture(Vec3::ZERO, numbers.direction(), 32, 50.0);
        for ray in &mut rays {
            let length = ray.direction.length();
            // From within one shell to within another, to nowhere, or the wrong way round.
            let [from, to] = [numbers.unit(), numbers.unit()].map(|x| x * 2.5 / length);
            match numbers.below(4) {
                0 => (ray.tnear, ray.tfar) = (from.min(to), from.max(to)),
                1 => ray.tfar = to,
                2 => ray.tnear = from,
                _ => (ray.tnear, ray.tfar) = (from, to),
            }
        }
        scene.trace(&rays);
        for any_hit in [false, true] {
            assert!(beams(&scene.mesh, &rays, any_hit) > 0);
        }
    }
}

/// Where rays to a light start: on what a picture shows, on it to a rounding, or a little off it.
fn surfaces(mesh: &Mesh, eye: Vec3, at: Vec3, numbers: &mut Numbers) -> Vec<Vec3> {
    let rays = picture(eye, at, 32, 60.0);
    let mut hits = vec![Hit::MISS; rays.len()];
    let accel = Accel::build(mesh, &BuildParams::default()).expect("builds");
    accel.intersect_many(Kernel::Packet16, &rays, &mut hits);
    let off = if numbers.below(2) == 0 { 0.0 } else { 1e-4 };
    rays.iter()
        .zip(&hits)
        .filter(|(_, hit)| hit.is_hit())
        .map(|(ray, hit)| ray.at(hit.t * (1.0 - off)))
        .collect()
}

#[test]
fn rays_to_a_light_go_together_and_see_the_same() {
    let ball = sphere(3).mesh;
    let hall = joined([&ball, &mapped(&ball, |p| p * 40.0), &mapped(&ball, |p| p * 0.2 + Vec3::Y * 2.0)]);
    let far = Vec3::new(148_376.0, 1234.0, -223_423.0);
    let lattice = of_triangles((0..300).map(|i| {
        let corner = Vec3::new((i % 10) as f32, (i / 10 % 5) as f32, (i / 50) as f32) - 2.5;
        [corner, corner + Vec3::X * 0.9, corner + Vec3::new(0.1, 0.9, 0.0)]
    }));
    for (name, mesh, center, size) in [
        ("a hall", hall, Vec3::ZERO, 1.0),
        ("a lattice", lattice, Vec3::ZERO, 1.0),
        ("far away", sphere(3).placed("far", 100.0, far).mesh, far, 100.0),
        ("a small ring", mapped(&twisted_ring(48, 6, 1).mesh, |p| p * 1e-3), Vec3::ZERO, 1e-3),
    ] {
        let mut scene = Scene::new(name, 0, mesh);
        let (mut meeting, mut parallel, mut diagonal) = (0, 0, 0);
        for seed in seeds() {
            scene.seed = seed;
            let mut numbers = Numbers::new(seed, 45);
            let eye = center + numbers.direction() * size * 3.0;
            let points = surfaces(&scene.mesh, eye, center, &mut numbers);
            let lights = [
                eye + numbers.vector() * size,
                center + numbers.vector() * size * 0.3,
                center + numbers.direction() * size * 3000.0,
                // In the very surface.
                numbers.pick(&scene.mesh.positions),
            ];
            for light in lights {
                let toward = |&point: &Vec3| Ray::segment(point, light - point, 0.0, 1.0);
                let short = |&point: &Vec3| {
                    let way = light - point;
                    Ray::segment(point, way.normalize_or(Vec3::X), 0.0, way.length() * (1.0 - 1e-4))
                };
                let rays: Vec<Ray> = points.iter().map(toward).chain(points.iter().map(short)).collect();
                scene.trace(&rays);
                meeting += beams(&scene.mesh, &rays, true);
            }
            // Slanting, straight along an axis, in a coordinate plane, and as fast along one axis as along others.
            let plain = [numbers.direction(), Vec3::Y, -Vec3::Z, Vec3::new(0.5, 0.0, 2.0)];
            let diagonals = [Vec3::ONE, Vec3::new(0.0, -2.0, 2.0), Vec3::new(-3.0, 1.0, 3.0)];
            for way in plain.into_iter().chain(diagonals) {
                let rays: Vec<Ray> = points
                    .iter()
                    .map(|&point| Ray::new(point, way))
                    .chain(points.iter().map(|&point| Ray::segment(point, way, size * 0.01, size * 0.7)))
                    .collect();
                scene.trace(&rays);
                let found = beams(&scene.mesh, &rays, true);
                if diagonals.contains(&way) {
                    diagonal += found;
                } else {
                    parallel += found;
                }
                // One that starts nowhere among them.
                let mut rays = rays[..rays.len().min(512)].to_vec();
                for (place, coordinate) in [(40, f32::NAN), (300, f32::NEG_INFINITY)] {
                    if let Some(ray) = rays.get_mut(place) {
                        ray.origin.y = coordinate;
                    }
                }
                scene.trace(&rays);
            }
        }
        assert!(
            meeting > 0 && parallel > 0 && diagonal > 0,
            "{name}: {meeting} beams toward lights, {parallel} parallel, {diagonal} along diagonals"
        );
    }
}

/// Rays from one point all over a surface of many triangles, in no order: no packet's rays are alike.
#[test]
fn beams_that_do_not_pay_are_given_up() {
    let closed = sphere(5);
    let mut scene = Scene::new("sprayed", 0, closed.mesh.clone());
    // From most places no beam begins, and from some it is done before its patience ends. From these it is given up.
    let known = [2, 4, 10, 20];
    for seed in known.into_iter().chain(seeds()) {
        scene.seed = seed;
        let mut numbers = Numbers::new(seed, 44);
        let eye = closed.inside(&mut numbers);
        let along = numbers.direction();
        let spray: Vec<Vec3> = (0..1024).map(|_| along + numbers.vector() * 0.3).collect();
        let rays: Vec<Ray> = spray.iter().map(|&direction| Ray::new(eye, direction)).collect();
        scene.check_closed(&rays);

        let accel = Accel::build(&scene.mesh, &BuildParams::default()).expect("builds");
        let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
        let mut counts = TileCounts::default();
        for packets in packets.chunks(16) {
            accel.count_tile(packets, &[0xffff; 16], false, &mut counts);
        }
        // Patience is for 2048 tests at most, and ends between blocks: the last one's sixteen triangles may be tested against
        // all sixteen packets still.
        assert!(counts.tests <= (2048 + 16 * 16) * counts.beams.max(1), "seed {seed}: {counts:?}");
        if known.contains(&seed) {
            assert!(counts.beams == 4 && counts.alone >= 16 * counts.beams, "{counts:?}");
        }
    }
}

/// A picture of 32 x 32 rays as packets in Morton order.
fn wide_picture(eye: Vec3, at: Vec3, fov: f32) -> Vec<RayPacket<16>> {
    let every_second_bit = |i: usize| (0..5).fold(0, |bits, k| bits | (i >> (2 * k) & 1) << k);
    let rays = picture(eye, at, 32, fov);
    let ray = |x: usize, y: usize| rays[(y / 16 * 2 + x / 16) * 256 + y % 16 * 16 + x % 16];
    let rays: Vec<Ray> = (0..1024).map(|i| ray(every_second_bit(i), every_second_bit(i >> 1))).collect();
    rays.chunks(16).map(RayPacket::of_slice).collect()
}

#[test]
fn wide_beams_find_what_packets_do_alone() {
    let ball = sphere(4).mesh;
    let hall = joined([&ball, &mapped(&ball, |p| p * 40.0), &mapped(&ball, |p| p * 0.2 + Vec3::Y * 2.0)]);
    let tree = Accel::build(&hall, &BuildParams::default()).expect("builds");
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 46);
        let eye = numbers.direction() * 3.0;
        // One wide enough for packets to go alone, and for triangles to be smaller than packets.
        for fov in [3.0, 50.0, 110.0] {
            let whole = wide_picture(eye, numbers.vector() * 0.3, fov);
            let mut parts = whole.clone();
            let other = wide_picture(-eye, numbers.vector(), fov);
            parts[16..32].clone_from_slice(&other[16..32]);
            parts[40] = other[3].clone();
            for packet in &mut parts[45..50] {
                packet.tnear = [numbers.unit() * 4.0; 16];
                packet.tfar = [numbers.unit() * 8.0; 16];
            }
            let active: Vec<u32> = (0..64)
                .map(|i| match i % 7 {
                    0 => 0,
                    1 => numbers.below(1 << 16) as u32,
                    _ => 0xffff,
                })
                .collect();
            for isa in Isa::available() {
                for accuracy in Accuracy::ALL {
                    let accel = tree.clone().with_isa(isa).with_accuracy(accuracy);
                    for (packets, lanes) in
                        [(&whole, &[0xffff; 64][..]), (&whole, &active), (&parts, &active)]
                    {
                        for count in [17, 32, 49, 64] {
                            let (packets, lanes) = (&packets[..count], &lanes[..count]);
                            let mut hits = vec![HitPacket { t: [7.0; 16], ..HitPacket::miss() }; count];
                            accel.intersect_tile(packets, lanes, &mut hits);
                            let mut occluded = vec![u32::MAX; count];
                            accel.occluded_tile(packets, lanes, &mut occluded);
                            for (i, packet) in packets.iter().enumerate() {
                                let what = format!("{isa}, {accuracy}, {fov}, packet {i} of {count}");
                                let alone = accel.intersect_packet(packet, lanes[i]);
                                assert_eq!(hits[i], alone, "{what}");
                                assert_eq!(occluded[i], accel.occluded_packet(packet, lanes[i]), "{what}");
                            }
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn beams_that_see_nothing_but_sky_miss_in_their_own_lanes() {
    let tree = Accel::build(&sphere(3).mesh, &BuildParams::default()).expect("builds");
    let eye = Vec3::new(0.0, 0.3, 5.0);
    // Away from everything, and past it; some lanes are not there, and some packets.
    for at in [Vec3::new(0.0, 0.3, 9.0), Vec3::new(4.0, 0.3, 0.0)] {
        let packets = wide_picture(eye, at, 20.0);
        let active: Vec<u32> = (0..64).map(|i| [0xffff, 0x0ff3, 0, 0x8000][i % 4]).collect();
        let mut counts = TileCounts::default();
        tree.count_tile(&packets[..16], &[0xffff; 16], false, &mut counts);
        assert_eq!((counts.beams, counts.nodes), (1, 0), "it is a beam, and comes to no node");
        for isa in Isa::available() {
            let accel = tree.clone().with_isa(isa);
            for (count, lanes) in
                [16, 17, 64].into_iter().flat_map(|count| [(count, &[0xffff; 64][..]), (count, &active)])
            {
                let mut hits =
                    vec![HitPacket { t: [7.0; 16], primitive: [3; 16], ..HitPacket::miss() }; count];
                accel.intersect_tile(&packets[..count], &lanes[..count], &mut hits);
                assert!(hits.iter().all(|hits| *hits == HitPacket::miss()), "{isa}, {count} packets");
            }
        }
    }
}
