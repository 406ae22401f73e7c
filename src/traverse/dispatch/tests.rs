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
    assert!(!dispatch.closest.is_beginning() && !dispatch.any.is_beginning());
}

/// Has a choice learn that a way is far quicker than the others.
fn teach<const N: usize>(choice: &mut Choice<N>, quick: usize) {
    for _ in 0..200 {
        let way = choice.next();
        choice.record(way, 256, Duration::from_micros(if way == quick { 3 } else { 300 }));
    }
    assert_eq!(choice.quickest(), quick);
}

#[test]
fn lots_of_any_size_are_answered_likewise_whatever_is_quickest() {
    let accel = soup();
    for way in 0..WAYS.len() {
        for lots in 0..2 {
            let mut dispatch = Dispatch::default();
            teach(&mut dispatch.closest, way);
            teach(&mut dispatch.any, way);
            teach(&mut dispatch.lots, lots);
            teach(&mut dispatch.any_lots, lots);
            for (lot, count) in [256, 150, 64, 37, 16, 1].into_iter().enumerate() {
                check(&mut dispatch, &accel, &[], lot, count);
            }
        }
    }
}
