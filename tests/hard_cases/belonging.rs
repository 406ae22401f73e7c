//! Which rays of a tile are one beam: those that do not belong leave it to the others, packet by packet and lane by lane.

use crate::meshes::{joined, of_triangles};
use raypack::Vec3;
use raypack::geometry::Ray;
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::simd::Isa;
use raypack::traverse::{Accel, HitPacket, RayPacket, TileCounts};

/// Small triangles side by side, with gaps between them, one above the points under it.
fn ceiling() -> Mesh {
    of_triangles((0..400).map(|i| {
        let corner = Vec3::new((i % 20) as f32 - 10.0, 10.0, (i / 20) as f32 - 10.0) * 0.1;
        [corner, corner + Vec3::X * 0.05, corner + Vec3::Z * 0.05]
    }))
}

/// Sixteen points in a row for each of sixteen packets under a ceiling of small triangles, `spread` apart in one of the
/// packets, as where a square of a picture lies across an edge; what a light above sees of them.
fn one_packet_apart(spread: f32) -> (TileCounts, [u32; 16], [u32; 16]) {
    let light = Vec3::new(0.05, 2.0, 0.05);
    let ceiling = ceiling();
    let rays: Vec<Ray> = (0..256)
        .map(|i: u32| {
            let (packet, lane) = (i / 16, i % 16);
            let step = if packet == 7 { spread } else { 0.004 };
            let point = Vec3::new(lane as f32 * step, 0.0, packet as f32 * 0.01);
            Ray::segment(point, light - point, 0.0, 1.0)
        })
        .collect();
    let accel = Accel::build(&ceiling, &BuildParams::default()).expect("builds");
    let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
    let (mut counts, mut together) = (TileCounts::default(), [0; 16]);
    accel.count_tile(&packets, &[0xffff; 16], true, &mut counts);
    accel.occluded_tile(&packets, &[0xffff; 16], &mut together);
    let alone = std::array::from_fn(|packet| accel.occluded_packet(&packets[packet], 0xffff));
    (counts, together, alone)
}

#[test]
fn a_packet_that_a_light_sees_as_two_places_goes_alone() {
    let (alike, together, alone) = one_packet_apart(0.004);
    assert_eq!(together, alone);
    let (apart, together, alone) = one_packet_apart(0.04);
    assert_eq!(together, alone);
    assert_eq!((alike.beams, apart.beams), (1, 1));
    assert!(apart.alone > alike.alone, "{alike:?} {apart:?}");
    // The others see no more for it.
    assert!(apart.node_packets <= alike.node_packets, "{alike:?} {apart:?}");
}

/// What a tile's packets find together and one by one; how many beams it was.
struct TogetherAndAlone {
    beams: u64,
    hits: [[HitPacket<16>; 16]; 2],
    occluded: [[u32; 16]; 2],
}

fn together_and_alone(accel: &Accel, packets: &[RayPacket<16>]) -> TogetherAndAlone {
    let all = [0xffff; 16];
    let mut counts = TileCounts::default();
    accel.count_tile(packets, &all, false, &mut counts);
    let mut hits = [const { HitPacket::miss() }; 16];
    accel.intersect_tile(packets, &all, &mut hits);
    let hits_alone = std::array::from_fn(|packet| accel.intersect_packet(&packets[packet], 0xffff));
    let mut occluded = [0; 16];
    accel.occluded_tile(packets, &all, &mut occluded);
    let occluded_alone = std::array::from_fn(|packet| accel.occluded_packet(&packets[packet], 0xffff));
    TogetherAndAlone { beams: counts.beams, hits: [hits, hits_alone], occluded: [occluded, occluded_alone] }
}

#[test]
fn packets_that_do_not_belong_to_a_beam_leave_it_to_the_others() {
    let ceiling = ceiling();
    let eye = Vec3::new(0.1, 0.2, 0.3);
    for strange in 0..=16 {
        // Packets that start elsewhere, look back, or look aside, spread over the tile.
        let rays: Vec<Ray> = (0..256u32)
            .map(|i| {
                let (packet, lane) = (i / 16, i % 16);
                let slope = Vec3::new(packet as f32 * 0.02 - 0.15, 1.0, lane as f32 * 0.02 - 0.15);
                match (packet * 11 + 9) % 16 {
                    place if place >= strange => Ray::new(eye, slope),
                    place if place % 3 == 0 => Ray::new(eye + Vec3::X * 0.3, slope),
                    place if place % 3 == 1 => Ray::new(eye, -slope),
                    _ => Ray::new(eye, Vec3::new(slope.y, slope.x, slope.z)),
                }
            })
            .collect();
        let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
        for isa in Isa::available() {
            let accel = Accel::build(&ceiling, &BuildParams::default()).expect("builds").with_isa(isa);
            let TogetherAndAlone { beams, hits, occluded } = together_and_alone(&accel, &packets);
            for packet in 0..16 {
                for lane in 0..16 {
                    let [together, alone] = [0, 1].map(|way: usize| hits[way][packet].get(lane));
                    assert_eq!(together, alone, "{strange} on {isa}: packet {packet}, lane {lane}");
                }
            }
            assert_eq!(occluded[0], occluded[1], "{strange} on {isa}");
            assert!(occluded[0].iter().any(|&lanes| lanes != 0), "some hit");
            if strange <= 4 {
                assert_eq!(beams, 1, "{strange} on {isa}");
            }
        }
    }
}

#[test]
fn a_ray_that_does_not_belong_hides_nothing_from_its_packet() {
    // A low ceiling over the first half of each packet, and a high one over all.
    let [low, high] = [1.0f32, 2.0].map(|height| {
        of_triangles((0..400).map(|i| {
            let corner = Vec3::new((i % 20) as f32 - 10.0, 10.0, (i / 20) as f32 - 10.0) * 0.1;
            [corner, corner + Vec3::X * 0.2, corner + Vec3::Z * 0.2].map(|p| p * height)
        }))
    });
    let eye = Vec3::new(0.1, 0.2, 0.3);
    let half = of_triangles(
        low.triangles.iter().map(|t| t.map(|i| low.positions[i as usize])).filter(|t| t[0].z < eye.z - 0.05),
    );
    let first_of_high = half.triangles.len() as u32;
    let mesh = joined(&[half, high]);
    // Along another axis altogether, and no rays at all.
    let strangers = [Vec3::X, Vec3::ZERO, Vec3::NAN, Vec3::new(1.0, f32::INFINITY, 0.0)];
    for isa in Isa::available() {
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds").with_isa(isa);
        for (stranger, place) in strangers.iter().flat_map(|stranger| (0..16).map(move |i| (stranger, i))) {
            let rays: Vec<Ray> = (0..256)
                .map(|i: usize| {
                    let slope = Vec3::new((i / 16) as f32 * 0.02 - 0.15, 1.0, (i % 16) as f32 * 0.1 - 0.75);
                    Ray::new(eye, if i % 16 == place { *stranger } else { slope })
                })
                .collect();
            let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
            let TogetherAndAlone { beams, hits: [together, alone], occluded } =
                together_and_alone(&accel, &packets);
            let mut ceilings = [0, 0];
            for (packet, lane) in (0..16).flat_map(|packet| (0..16).map(move |lane| (packet, lane))) {
                let [together, alone] = [&together, &alone].map(|hits| hits[packet].get(lane));
                assert_eq!(together, alone, "{stranger} at {place} on {isa}: packet {packet}, lane {lane}");
                if together.is_hit() {
                    ceilings[usize::from(together.primitive >= first_of_high)] += 1;
                }
            }
            assert_eq!(occluded[0], occluded[1], "{stranger} at {place} on {isa}");
            assert!(ceilings.iter().all(|&hits| hits >= 16), "{ceilings:?}");
            // The first lane tells where a beam goes; and what runs along its axis, infinitely fast, seems to belong.
            assert!(beams > 0 || place == 0 || stranger.y.is_infinite(), "{stranger} at {place} on {isa}");
        }
    }
}

#[test]
fn a_tile_that_looks_two_ways_is_two_beams() {
    let ceiling = ceiling();
    // As rays toward a light do that is near: half of them run fastest upward, half of them aside.
    let rays: Vec<Ray> = (0..256u32)
        .map(|i| {
            let (packet, lane) = (i / 16, i % 16);
            let aside = 0.9 + (packet as f32 - 7.5) * 0.02;
            let rest = Vec3::new(0.0, 1.0, lane as f32 * 0.004 - 0.03);
            Ray::new(
                Vec3::new(-0.3, 0.2, 0.3),
                rest + Vec3::X * (aside + if packet < 8 { 0.0 } else { 0.15 }),
            )
        })
        .collect();
    let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
    let accel = Accel::build(&ceiling, &BuildParams::default()).expect("builds");
    for any_hit in [false, true] {
        let count = |first: usize, last: usize| {
            let active: [u32; 16] =
                std::array::from_fn(|packet| if (first..last).contains(&packet) { 0xffff } else { 0 });
            let mut counts = TileCounts::default();
            accel.count_tile(&packets, &active, any_hit, &mut counts);
            (counts.nodes, counts.blocks, counts.tests)
        };
        let (up, aside, all) = (count(0, 8), count(8, 16), count(0, 16));
        assert!(up.0 > 0 && aside.0 > 0, "both are beams");
        assert_eq!(all, (up.0 + aside.0, up.1 + aside.1, up.2 + aside.2));
    }
    let found = together_and_alone(&accel, &packets);
    for packet in 0..16 {
        for lane in 0..16 {
            assert_eq!(found.hits[0][packet].get(lane), found.hits[1][packet].get(lane));
        }
    }
    assert_eq!(found.occluded[0], found.occluded[1]);
}

#[test]
fn a_packet_that_looks_two_ways_is_part_of_two_beams() {
    let ceiling = ceiling();
    // Of each packet, the first rays run fastest upward, then some as fast upward as aside, the last ones aside.
    let eye = Vec3::new(-0.3, 0.2, 0.3);
    let rays: Vec<Ray> = (0..1024u32)
        .map(|i| {
            let (packet, lane) = (i / 16 % 16, i % 16);
            let aside = [0.9, 1.0, 1.1][((lane + packet / 4) / 6) as usize % 3];
            let along = (packet as f32 - 7.5) * 0.01 + (i / 256) as f32 * 0.003;
            Ray::new(eye, Vec3::new(aside, 1.0, along + lane as f32 * 0.001))
        })
        .collect();
    let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
    // Lanes that are not there, in packets of which some are and in others.
    let some: Vec<u32> = (0..64).map(|i| [0xffff, 0x7ff3, 0xffff, 0, 0x00ff][i % 5]).collect();
    let nonsense = HitPacket { t: [-7.0; 16], ..HitPacket::miss() };
    for isa in Isa::available() {
        let accel = Accel::build(&ceiling, &BuildParams::default()).expect("builds").with_isa(isa);
        for (count, active) in
            [(16, [0xffff; 64].to_vec()), (64, [0xffff; 64].to_vec()), (16, some.clone()), (64, some.clone())]
        {
            let (packets, active) = (&packets[..count], &active[..count]);
            let (mut hits, mut occluded) = (vec![nonsense.clone(); count], vec![!0; count]);
            accel.intersect_tile(packets, active, &mut hits);
            accel.occluded_tile(packets, active, &mut occluded);
            let mut found = 0;
            for packet in 0..count {
                let alone = accel.intersect_packet(&packets[packet], active[packet]);
                for lane in 0..16 {
                    assert_eq!(hits[packet].get(lane), alone.get(lane), "{isa}, {count}: {packet}, {lane}");
                    found += usize::from(alone.get(lane).is_hit());
                }
                assert_eq!(occluded[packet], accel.occluded_packet(&packets[packet], active[packet]));
            }
            assert!(found > count, "{found} rays hit anything");
        }
        // Both halves are beams: only those are left that run as fast one way as the other.
        for any_hit in [false, true] {
            let count = |keep: fn(f32) -> bool| {
                let kept = |packet: &RayPacket<16>| {
                    (0..16).filter(|&lane| keep(packet.get(lane).direction.x)).map(|lane| 1 << lane).sum()
                };
                let active: [u32; 16] = std::array::from_fn(|packet| kept(&packets[packet]));
                let mut counts = TileCounts::default();
                accel.count_tile(&packets[..16], &active, any_hit, &mut counts);
                (counts.nodes, counts.blocks, counts.tests)
            };
            let (up, aside, all) = (count(|x| x < 1.0), count(|x| x > 1.0), count(|_| true));
            assert!(up.0 > 0 && aside.0 > 0, "both are beams");
            assert_eq!(all, (up.0 + aside.0, up.1 + aside.1, up.2 + aside.2));
        }
    }
}
