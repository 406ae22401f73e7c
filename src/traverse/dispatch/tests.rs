use super::duel::Duel;
use super::*;
use crate::geometry::Ray;
use crate::kdtree::BuildParams;
use crate::mesh::generate::shapes;
use glam::Vec3;
use std::time::Duration;

/// Packet `i` of a lot.
fn packet(lot: usize, i: usize) -> RayPacket<16> {
    let ray = |lane: usize| {
        let place = |k: usize| ((lot * 7 + i * 16 + lane) * k % 97) as f32 / 97.0 - 0.5;
        Ray::new(Vec3::new(0.5, 0.5, 3.0), Vec3::new(place(3), place(5), -2.5))
    };
    RayPacket::of_slice(&std::array::from_fn::<_, 16, _>(ray))
}

/// Has a dispatch trace so many packets of a lot, and compares what they find with what each finds by itself.
fn check(dispatch: &mut Dispatch, accel: &Accel, places: &[Place<'_>], lot: usize, count: usize) {
    let rays: Vec<RayPacket<16>> = (0..count).map(|i| packet(lot, i)).collect();
    let active: Vec<u32> = (0..count).map(|i| 0xffff >> (i % 5)).collect();
    let (mut hits, mut occluded) = (vec![HitPacket::miss(); count], vec![0; count]);
    dispatch.intersect(accel, places, &rays, &active, &mut hits);
    dispatch.occluded(accel, places, &rays, &active, &mut occluded);
    for i in 0..count {
        assert_eq!(hits[i], accel.intersect_packet(&rays[i], active[i]), "packet {i} of lot {lot}");
        assert_eq!(occluded[i], accel.occluded_packet(&rays[i], active[i]), "packet {i} of lot {lot}");
    }
}

fn soup() -> Accel {
    Accel::build(&shapes::soup(300, 1), &BuildParams::default()).expect("a soup has a tree")
}

#[test]
fn lots_of_any_size_are_answered_as_their_packets_are() {
    let (accel, places, mut dispatch) = (soup(), Places::new(16), Dispatch::default());
    for lot in 0..60 {
        let at: Vec<Place<'_>> = (0..lot % 17).map(|square| places.at(square)).collect();
        check(&mut dispatch, &accel, &at, lot, [64, 256, 16, 37, 150, 1][lot % 6]);
    }
    assert!(!dispatch.closest.beams.squares.is_beginning() && !dispatch.any.beams.squares.is_beginning());
}

/// Has a choice learn that a way is far quicker than the others.
fn teach<const N: usize>(choice: &mut Choice<N>, quick: usize) {
    for _ in 0..200 {
        let way = choice.next();
        choice.record(way, 256, Duration::from_micros(if way == quick { 3 } else { 300 }));
    }
    assert_eq!(choice.quickest(), quick);
}

/// Has a duel learn that a way is far quicker than the other.
fn teach_both(duel: &mut Duel, quick: usize) {
    for _ in 0..4 {
        duel.record(std::array::from_fn(|way| Duration::from_micros(if way == quick { 3 } else { 300 })));
    }
    assert_eq!(duel.quicker(), quick);
}

/// Has a dispatch learn which ways are quickest.
fn teach_all(dispatch: &mut Dispatch, lists: usize, wide: usize, square: usize) {
    for Learnt { lists: of_lists, beams, .. } in [&mut dispatch.closest, &mut dispatch.any] {
        teach(of_lists, lists);
        teach_both(&mut beams.wide, wide);
        teach(&mut beams.squares, square);
    }
}

#[test]
fn lots_of_any_size_are_answered_likewise_whatever_is_quickest() {
    let pooled = soup();
    pooled.make_pools().expect("a soup has pools");
    for accel in [soup(), pooled] {
        for square in 0..WAYS.len() {
            for (lists, wide) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut dispatch = Dispatch::default();
                teach_all(&mut dispatch, lists, wide, square);
                for (lot, count) in [700, 256, 150, 64, 37, 16, 1].into_iter().enumerate() {
                    check(&mut dispatch, &accel, &[], lot, count);
                }
            }
        }
    }
}

#[test]
fn the_quickest_kernel_is_named() {
    let named = |lists, wide, square| {
        let mut dispatch = Dispatch::default();
        teach_all(&mut dispatch, lists, wide, square);
        dispatch.quickest()
    };
    assert_eq!(named(0, 1, 1), [Kernel::Filter; 2]);
    assert_eq!(named(1, 1, 0), [Kernel::Tile; 2]);
    assert_eq!(named(1, 0, 1), [Kernel::Packet16; 2]);
    assert_eq!(named(1, 0, 0)[0], Kernel::WideTile);
}

/// Whether squares go in beams that cost so much by each way, in nanoseconds a ray.
fn beams_are_taken(cost: [f64; 3]) -> bool {
    let mut squares = Choice::default();
    for _ in 0..400 {
        let way = squares.next();
        squares.record(way, 256, Duration::from_nanos((256.0 * cost[way]) as u64));
    }
    learnt::go_in_beams(&squares)
}

#[test]
fn beams_are_taken_where_there_is_next_to_nothing_unless_others_are_clearly_quicker() {
    // As quick, a little slower, and much slower, in the sky.
    assert!(beams_are_taken([7.0, 7.0, 9.0]) && beams_are_taken([7.0, 6.7, 9.0]));
    assert!(!beams_are_taken([7.0, 5.0, 9.0]) && !beams_are_taken([7.0, 9.0, 5.0]));
    // Elsewhere.
    assert!(beams_are_taken([60.0, 70.0, 80.0]) && !beams_are_taken([70.0, 60.0, 80.0]));
}

/// While beams and packets are being found out, they look slower than they are.
#[test]
fn lists_are_not_compared_before_beams_and_packets_are_known() {
    let (accel, mut dispatch) = (soup(), Dispatch::default());
    // Packets are quicker than beams, or lists would not be thought of.
    let squares = &mut dispatch.any.beams.squares;
    while !squares.has_seen(learnt::MATURE - 28) {
        let way = squares.next();
        squares.record(way, 256, Duration::from_micros(if way == 1 { 30 } else { 300 }));
    }
    for lot in 0.. {
        check(&mut dispatch, &accel, &[], lot, 64);
        let Learnt { beams, have_gone_as_lists, .. } = &dispatch.any;
        if beams.squares.has_seen(learnt::MATURE) {
            break;
        }
        assert!(!have_gone_as_lists, "lot {lot}");
    }
}

/// What is told of where rays went adds up.
#[test]
fn every_ray_is_counted_with_a_kernel_that_traced_it() {
    for pools in [false, true] {
        let (accel, mut dispatch, mut rays) = (soup(), Dispatch::default(), 0);
        if pools {
            accel.make_pools().expect("a soup has pools");
        }
        for lot in 0..60 {
            let count = [64, 256, 16, 37][lot % 4];
            check(&mut dispatch, &accel, &[], lot, count);
            rays += (0..count).map(|i| u64::from((0xffff_u32 >> (i % 5)).count_ones())).sum::<u64>();
        }
        for learnt in [&dispatch.closest, &dispatch.any] {
            let traced: u64 = learnt.beams.traced.0.iter().sum();
            assert!(rays <= traced && traced < 2 * rays, "{traced} of {rays}");
        }
        let told: u64 = dispatch.traced().map(|(_, rays)| rays).sum();
        assert!(2 * rays <= told && told < 4 * rays, "{told} of {rays}");
    }
}

/// Lists go through what has been made for them: through the tree, closest hits are looked for without them.
#[test]
fn closest_hits_are_looked_for_in_lists_through_pools_alone() {
    let lists_taken = |accel: &Accel| {
        let mut dispatch = Dispatch::default();
        // Packets are quicker than beams, or lists would not be thought of.
        teach(&mut dispatch.closest.beams.squares, 1);
        for lot in 0..40 {
            check(&mut dispatch, accel, &[], lot, 64);
        }
        dispatch.closest.have_gone_as_lists
    };
    let accel = soup();
    assert!(!lists_taken(&accel));
    accel.make_pools().expect("a soup has pools");
    assert!(lists_taken(&accel));
}
