//! Small checks of the kernels; the large ones are in `tests/`.

use super::*;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::BuildParams;
use crate::mesh::generate::shapes;
use crate::mesh::{Colors, Mesh};
use crate::simd::Isa;
use glam::Vec3;

/// A unit square in the plane z = 0, as two triangles.
fn square() -> Accel {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
    let mesh = Mesh {
        positions,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        colors: Colors::default(),
        ..Mesh::default()
    };
    Accel::build(&mesh, &BuildParams::default()).expect("builds")
}

fn for_every_kernel(check: impl Fn(&Accel, Kernel, &str)) {
    for isa in Isa::available() {
        let accel = square().with_isa(isa);
        for kernel in Kernel::ALL {
            check(&accel, kernel, &format!("{kernel} on {isa}"));
        }
    }
}

fn intersect(accel: &Accel, kernel: Kernel, ray: Ray) -> Hit {
    let mut hits = [Hit::MISS; 19];
    accel.intersect_many(kernel, &[ray; 19], &mut hits);
    assert!(hits.iter().all(|h| *h == hits[0]));
    let mut occluded = [false; 19];
    accel.occluded_many(kernel, &[ray; 19], &mut occluded);
    assert!(occluded.iter().all(|&o| o == hits[0].is_hit()));
    hits[0]
}

#[test]
fn a_hit_is_what_its_fields_say() {
    for_every_kernel(|accel, kernel, name| {
        let ray = Ray::new(Vec3::new(0.75, 0.25, 2.0), Vec3::new(0.0, 0.0, -4.0));
        let hit = intersect(accel, kernel, ray);
        assert_eq!(hit, Hit { t: 0.5, u: 0.5, v: 0.25, primitive: 0, normal: Vec3::Z }, "{name}");
    });
}

#[test]
fn both_ends_of_the_interval_count() {
    for_every_kernel(|accel, kernel, name| {
        let shot = |tnear, tfar| {
            let ray = Ray::segment(Vec3::new(0.25, 0.75, 1.0), Vec3::new(0.0, 0.0, -1.0), tnear, tfar);
            intersect(accel, kernel, ray).is_hit()
        };
        assert!(shot(1.0, 1.0), "{name}");
        assert!(shot(0.0, 1.0) && shot(1.0, 9.0), "{name}");
        assert!(!shot(0.0, 1.0f32.next_down()) && !shot(1.0f32.next_up(), 9.0), "{name}");
        assert!(!shot(2.0, 0.5), "an empty interval, {name}");
    });
}

#[test]
fn the_lower_id_wins_on_the_shared_edge() {
    for_every_kernel(|accel, kernel, name| {
        let hit = intersect(accel, kernel, Ray::new(Vec3::new(0.5, 0.5, 1.0), -Vec3::Z));
        assert_eq!((hit.primitive, hit.t), (0, 1.0), "{name}");
    });
}

#[test]
fn what_is_no_ray_hits_nothing() {
    for_every_kernel(|accel, kernel, name| {
        let good = Ray::new(Vec3::new(0.5, 0.25, 1.0), -Vec3::Z);
        assert!(intersect(accel, kernel, good).is_hit());
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let mut ray = good;
                ray.origin[axis] = bad;
                assert!(!intersect(accel, kernel, ray).is_hit(), "{name}: {ray:?}");
                ray = good;
                ray.direction[axis] = bad;
                assert!(!intersect(accel, kernel, ray).is_hit(), "{name}: {ray:?}");
            }
        }
        let nan = f32::NAN;
        assert!(!intersect(accel, kernel, Ray { tnear: nan, ..good }).is_hit(), "{name}");
        assert!(!intersect(accel, kernel, Ray { tfar: nan, ..good }).is_hit(), "{name}");
        assert!(!intersect(accel, kernel, Ray { direction: Vec3::ZERO, ..good }).is_hit(), "{name}");
    });
}

#[test]
fn lanes_that_are_not_active_stay_misses() {
    let accel = square();
    let rays = RayPacket::<16>::of_slice(&[Ray::new(Vec3::new(0.5, 0.25, 1.0), -Vec3::Z); 16]);
    let hits = accel.intersect_packet(&rays, 0b1010_0000_0000_0110);
    for lane in 0..16 {
        assert_eq!(hits.get(lane).is_hit(), [1, 2, 13, 15].contains(&lane));
    }
    assert_eq!(accel.occluded_packet(&rays, 0b101), 0b101);
    assert_eq!(accel.occluded_packet(&rays, 0), 0);
}

/// Rays down onto the square and beside it, in packets whose lanes are not all active.
fn packets_onto_the_square() -> ([RayPacket<16>; 20], [u32; 20]) {
    let packet = |i: usize| {
        let ray = |lane: usize| {
            let origin = Vec3::new(lane as f32 * 0.11 - 0.3, i as f32 * 0.07 - 0.2, 1.0);
            Ray::new(origin, Vec3::NEG_Z)
        };
        RayPacket::of_slice(&std::array::from_fn::<_, 16, _>(ray))
    };
    let lanes = |i: usize| (i as u32).wrapping_mul(0x9e37_79b9) >> 16;
    (std::array::from_fn(packet), std::array::from_fn(|i| if i == 4 { 0 } else { lanes(i) }))
}

#[test]
fn packets_that_follow_one_another_are_what_each_is_alone() {
    let accel = square();
    let (rays, active) = packets_onto_the_square();
    let alone = rays.iter().zip(active).map(|(rays, active)| accel.intersect_packet(rays, active));
    let alone: Vec<HitPacket<16>> = alone.collect();
    let occluded: Vec<u32> =
        rays.iter().zip(active).map(|(rays, active)| accel.occluded_packet(rays, active)).collect();
    let hit: u32 =
        alone.iter().map(|hits| (0..16).filter(|&lane| hits.get(lane).is_hit()).count() as u32).sum();
    assert!(hit > 50 && hit == occluded.iter().map(|lanes| lanes.count_ones()).sum::<u32>(), "{hit}");
    let before = || std::array::from_fn::<_, 20, _>(|_| HitPacket { t: [7.0; 16], ..HitPacket::miss() });
    let (mut hits, mut halves) = (before(), before());
    accel.intersect_packets(&rays, &active, &mut hits);
    accel.intersect_halves(&rays, &active, &mut halves);
    for (i, alone) in alone.iter().enumerate() {
        for lane in 0..16 {
            assert_eq!([hits[i].get(lane), halves[i].get(lane)], [alone.get(lane); 2], "{i} {lane}");
        }
    }
    let (mut found, mut in_halves) = ([u32::MAX; 20], [u32::MAX; 20]);
    accel.occluded_packets(&rays, &active, &mut found);
    accel.occluded_halves(&rays, &active, &mut in_halves);
    assert_eq!([found, in_halves].map(Vec::from), [occluded.clone(), occluded]);
}

#[test]
#[should_panic(expected = "no lanes beyond 16")]
fn lanes_that_are_not_there_are_refused() {
    let (rays, _) = packets_onto_the_square();
    square().occluded_packets(&rays[..2], &[1, 1 << 16], &mut [0; 2]);
}

#[test]
#[should_panic(expected = "as many lanes and answers as packets")]
fn each_packet_has_an_answer() {
    let (rays, active) = packets_onto_the_square();
    square().intersect_packets(&rays, &active, &mut [const { HitPacket::miss() }; 19]);
}

/// The square enlarged by `place`, and directions of the length `speed`.
#[test]
fn powers_of_two_change_nothing_but_exponents() {
    for place in [-149 + 24, -100, -60, -31, -30, -1, 0, 1, 39, 40, 41, 90, 120] {
        let place = f64::powi(2.0, place) as f32;
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y].into_iter().map(|p| p * place);
        let mesh = Mesh {
            positions: positions.collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            colors: Colors::default(),
            ..Mesh::default()
        };
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        assert_eq!(accel.bounds().max, Vec3::new(place, place, 0.0));
        for accuracy in Accuracy::ALL {
            for isa in Isa::available() {
                let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
                let accel = accel.with_isa(isa).with_accuracy(accuracy);
                for kernel in Kernel::ALL {
                    for speed in [f32::from_bits(1 << 10), 1e-38, 2e-10, 1.0, 1e9, 3e9, 1e38] {
                        let origin = Vec3::new(0.75, 0.25, 2.0) * place;
                        let direction = Vec3::new(0.0, 0.0, -speed);
                        let t = f64::from(place) * 2.0 / f64::from(speed);
                        let name = format!("{accuracy} {kernel} on {isa}: {place:e}, {speed:e}");
                        if t > f64::from(f32::MAX) {
                            assert!(
                                !intersect(&accel, kernel, Ray::new(origin, direction)).is_hit(),
                                "{name}"
                            );
                            continue;
                        }
                        let t = t as f32;
                        let hit = intersect(&accel, kernel, Ray::new(origin, direction));
                        assert_eq!((hit.primitive, hit.u, hit.v), (0, 0.5, 0.25), "{name}");
                        assert!(hit.t.to_bits().abs_diff(t.to_bits()) <= 1, "{name}: {} for {t}", hit.t);
                        assert!(hit.normal.z > 0.0 && hit.normal.x == 0.0, "{name}");
                        // The unit of the interval is the ray's.
                        if t > 1e-30 && t < 1e30 {
                            let beyond = Ray::segment(origin, direction, t * 1.5, f32::INFINITY);
                            assert!(!intersect(&accel, kernel, beyond).is_hit(), "{name}");
                            let before = Ray::segment(origin, direction, 0.0, t * 0.5);
                            assert!(!intersect(&accel, kernel, before).is_hit(), "{name}");
                        }
                    }
                }
            }
        }
    }
}

/// Many small triangles with room between them, and a tile of rays toward a point behind them: so many triangles lie between
/// one ray and the next that no beam pays.
fn through_a_cloud() -> (Accel, [RayPacket<16>; 16]) {
    let mut mesh = shapes::soup(60_000, 5);
    for corners in &mesh.triangles {
        let center = corners.map(|i| mesh.positions[i as usize]).into_iter().sum::<Vec3>() / 3.0;
        for i in corners {
            mesh.positions[*i as usize] = center + (mesh.positions[*i as usize] - center) * 0.3;
        }
    }
    let light = Vec3::new(0.5, 0.5, 1.5);
    let packet = |packet: usize| {
        let ray = |lane: usize| {
            let (x, y) = (packet % 4 * 4 + lane % 4, packet / 4 * 4 + lane / 4);
            let origin = Vec3::new(0.35 + x as f32 * 0.02, 0.35 + y as f32 * 0.02, -0.5);
            Ray::segment(origin, light - origin, 0.0, 1.0)
        };
        RayPacket::of_slice(&std::array::from_fn::<_, 16, _>(ray))
    };
    (Accel::build(&mesh, &BuildParams::default()).expect("builds"), std::array::from_fn(packet))
}

#[test]
fn a_tile_that_is_given_up_answers_for_every_ray() {
    let (accel, rays) = through_a_cloud();
    let mut counts = TileCounts::default();
    accel.count_tile(&rays, &[0xffff; 16], true, &mut counts);
    assert!(counts.beams == 1 && counts.alone >= 16, "{counts:?}");
    for isa in Isa::available() {
        for accuracy in Accuracy::ALL {
            let accel = accel.clone().with_isa(isa).with_accuracy(accuracy);
            let (mut found, mut alone) = ([0; 16], [0; 16]);
            accel.occluded_tile(&rays, &[0xffff; 16], &mut found);
            accel.occluded_packets(&rays, &[0xffff; 16], &mut alone);
            assert_eq!(found, alone, "{accuracy} on {isa}");
            let hit: u32 = found.iter().map(|lanes| lanes.count_ones()).sum();
            assert!((32..224).contains(&hit), "{hit} of 256 rays hit anything");
        }
    }
}
