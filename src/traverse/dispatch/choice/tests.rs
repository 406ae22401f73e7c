//! Ways that cost what the tests say.

use super::*;
use crate::traverse::dispatch::places::Places;

/// Traces lots of 256 rays, `cost(lot, way)` giving the nanoseconds a ray; how often each way was
/// taken, and the time that all took beside the least that one way could.
fn run<const WAYS: usize>(
    choice: &mut Choice<WAYS>,
    lots: u32,
    mut cost: impl FnMut(u32) -> [f64; WAYS],
) -> ([u32; WAYS], f64) {
    let (mut taken, mut total, mut each) = ([0; WAYS], 0.0, [0.0; WAYS]);
    for lot in 0..lots {
        let cost = cost(lot);
        let way = choice.next();
        taken[way] += 1;
        total += cost[way];
        (0..WAYS).for_each(|way| each[way] += cost[way]);
        choice.record(way, 256, Duration::from_nanos((256.0 * cost[way]) as u64));
    }
    (taken, total / each.into_iter().fold(f64::INFINITY, f64::min))
}

#[test]
fn the_slower_way_costs_little_however_slow() {
    for cost in [[30.0, 36.0], [36.0, 30.0], [30.0, 90.0], [300.0, 30.0], [30.0, 30.0]] {
        let (taken, ratio) = run(&mut Choice::default(), 4000, |_| cost);
        assert!(taken[0] > 0 && taken[1] > 0);
        assert!(ratio < 1.03, "{cost:?}: {ratio}");
    }
    for cost in [[30.0, 36.0, 33.0], [36.0, 30.0, 300.0], [90.0, 60.0, 30.0]] {
        let (taken, ratio) = run(&mut Choice::default(), 4000, |_| cost);
        assert!(!taken.contains(&0));
        assert!(ratio < 1.05, "{cost:?}: {ratio}");
    }
}

#[test]
fn what_lots_hold_is_not_taken_for_the_way() {
    // From lot to lot the work changes by four times; the second way is a sixth slower.
    let (_, ratio) = run(&mut Choice::default(), 8000, |lot| {
        let random = f64::from(lot.wrapping_mul(0x9e37_79b9) >> 8) / f64::from(1 << 24);
        let work = (3.0 + 2.0 * random).exp2();
        [work * 6.0, work * 7.0]
    });
    assert!(ratio < 1.04, "{ratio}");
}

#[test]
fn dear_places_may_have_a_way_of_their_own() {
    // In every other run of 50 lots, packets' price is three times as high and a beam's eight.
    let dear = |lot: u32| lot / 50 % 2 == 1;
    let (_, ratio) =
        run(&mut Choice::default(), 8000, |lot| if dear(lot) { [240.0, 150.0] } else { [30.0, 50.0] });
    assert!(ratio < 0.96, "{ratio}: either way alone would take as long as 1");
}

#[test]
fn a_rise_at_the_start_is_not_taken_for_the_way() {
    // Each lot is a half dearer than the one before, until all ways have been tried.
    let (_, ratio) = run(&mut Choice::default(), 4000, |lot| {
        let work = 1.5f64.powi(lot.min(12) as i32);
        [work * 30.0, work * 60.0, work * 63.0]
    });
    assert!(ratio < 1.03, "{ratio}");
}

#[test]
fn a_change_is_noticed() {
    let mut choice = Choice::default();
    run(&mut choice, 500, |_| [30.0, 45.0]);
    let (taken, _) = run(&mut choice, 500, |_| [60.0, 45.0]);
    assert!(taken[1] > 400, "{taken:?}");
}

#[test]
fn a_kind_of_place_that_is_new_is_taken_to_be_like_the_nearest() {
    let mut choice = Choice::<2>::default();
    run(&mut choice, 200, |_| [300.0, 200.0]);
    choice.pass(700f32.log2());
    assert_eq!(choice.quickest(), 1);
}

#[test]
fn a_spike_is_forgotten() {
    let mut choice = Choice::default();
    run(&mut choice, 100, |_| [30.0, 45.0]);
    choice.record(0, 256, Duration::from_millis(100));
    let (taken, _) = run(&mut choice, 100, |_| [30.0, 45.0]);
    assert!(taken[0] > 60, "{taken:?}");
}

#[test]
fn places_have_ways_of_their_own() {
    // Which of three ways is quickest hangs on the place, and on nothing that the lot before tells.
    let quickest = |place: u32| (place.wrapping_mul(0x9e37_79b9) >> 16) as usize % 3;
    let cost = |place: u32, way: usize| if way == quickest(place) { 30.0 } else { 50.0 + 30.0 * way as f64 };
    let (mut choice, places) = (Choice::<3>::default(), Places::<3>::new(400));
    let mut frame = |_| {
        let mut total = 0.0;
        for place in 0..400 {
            let costs = places.at(place).closest.expect("it is there");
            let way = choice.next_at(&costs.known());
            let cost = cost(place as u32, way);
            total += cost;
            let cost = choice.record(way, 256, Duration::from_nanos((256.0 * cost) as u64));
            costs.record(way, cost.expect("there were rays"));
        }
        total / 400.0
    };
    let first: f64 = frame(0);
    let last = (1..200).map(&mut frame).last().expect("there were frames");
    let best_single = (0..3)
        .map(|way| (0..400).map(|place| cost(place, way)).sum::<f64>() / 400.0)
        .fold(f64::INFINITY, f64::min);
    assert!(first > 45.0, "{first}: nothing tells beforehand");
    // All of the gain is a quarter and more; what trying costs is left over.
    assert!(last < 0.8 * best_single, "{last} beside {best_single}");
}

#[test]
fn what_is_slow_at_a_place_is_hardly_ever_tried_there() {
    let mut choice = Choice::<2>::default();
    run(&mut choice, 100, |_| [30.0, 240.0]);
    let tried = (0..10_000).filter(|_| {
        let way = choice.next_at(&[Some(5.0), Some(8.0)]);
        choice.record(way, 256, Duration::from_nanos([256 * 32, 256 * 256][way]));
        way == 1
    });
    let tried = tried.count();
    assert!((1..40).contains(&tried), "{tried}");
}

#[test]
fn what_was_traced_some_other_way_says_where_the_next_lot_is() {
    let mut choice = Choice::<2>::default();
    // Every other run of 20 lots is dear, and there the second way is quicker.
    run(&mut choice, 2000, |lot| if lot / 20 % 2 == 1 { [900.0, 300.0] } else { [8.0, 12.0] });
    for _ in 0..3 {
        choice.pass(300f32.log2());
        assert_eq!(choice.quickest(), 1);
        assert_eq!(choice.last(), 300f32.log2());
        choice.pass(8f32.log2());
        assert_eq!(choice.quickest(), 0);
    }
    let mut new = Choice::<2>::default();
    new.pass(10.0);
    assert!(new.is_beginning() && new.next() == 0, "and teaches nothing about ways");
}

#[test]
fn lots_that_are_taken_to_be_one_leave_room_for_trials() {
    let mut choice = Choice::<2>::default();
    assert!(!choice.settles_on(0, 4, 0.0), "nothing is known yet");
    run(&mut choice, 100, |_| [30.0, 60.0]);
    let (mut lots, mut tried) = (0, 0);
    while lots < 4000 {
        assert!(!choice.settles_on(1, 4, 0.0), "the other one is quicker");
        assert!(!choice.settles_on(1, 4, 0.5), "by a doubling");
        if choice.settles_on(0, 4, 0.0) {
            choice.record(0, 1024, Duration::from_nanos(30 * 1024));
            lots += 4;
        } else {
            let way = choice.next();
            tried += way;
            choice.record(way, 256, Duration::from_nanos([30, 60][way] * 256));
            lots += 1;
        }
    }
    // Three times slower, squared: one in 260 or so.
    assert!((8..40).contains(&tried), "{tried}");
}

#[test]
fn a_way_that_is_hardly_slower_may_be_settled_on() {
    let mut choice = Choice::<2>::default();
    run(&mut choice, 400, |_| [30.0, 31.0]);
    assert!((0.0..0.15).contains(&choice.behind(1)) && choice.behind(0) == 0.0);
    let settles = |behind| {
        let mut choice = choice;
        choice.settles_on(1, 1, behind)
    };
    assert_eq!([0.0, 0.2].map(settles), [choice.quickest() == 1, true]);
}

#[test]
fn places_that_have_the_same_way_are_asked_one_by_one_now_and_then() {
    let mut choice = Choice::<2>::default();
    assert!(!choice.settles_there(), "all ways are tried first");
    run(&mut choice, 100, |_| [30.0, 60.0]);
    let asked = (0..1000).filter(|_| {
        choice.record(0, 256, Duration::from_nanos(30 * 256));
        !choice.settles_there()
    });
    let asked = asked.count();
    assert!((60..250).contains(&asked), "{asked}");
}

#[test]
fn what_is_left_out_is_never_taken() {
    for out in 0..3 {
        let mut choice = Choice::<3>::default();
        choice.leave_out(out);
        choice.leave_out(out);
        // From lot to lot the work changes by ten times, so that kinds of place are new now and then.
        let (taken, _) = run(&mut choice, 4000, |lot| {
            let mut cost = [6.0, 7.0, 8.0].map(|cost| cost * 10f64.powi(lot as i32 / 50 % 3));
            cost[out] = 1.0;
            cost
        });
        assert_eq!(taken.map(|taken| taken > 0), std::array::from_fn(|way| way != out), "{taken:?}");
        let known = std::array::from_fn(|way| (way != out).then_some(5.0));
        for _ in 0..1000 {
            let way = choice.next_at(&known);
            assert_ne!(way, out);
            choice.record(way, 256, Duration::from_nanos(256 * 32));
        }
    }
}

#[test]
fn nothing_is_learnt_from_no_rays() {
    let mut choice = Choice::<2>::default();
    assert_eq!(choice.record(0, 0, Duration::from_secs(1)), None);
    assert_eq!(choice.next(), 0);
}

#[test]
fn a_lead_is_what_sets_the_quickest_way_apart_from_the_next() {
    for cost in [[30.0, 60.0, 45.0], [60.0, 45.0, 30.0]] {
        let mut choice = Choice::default();
        run(&mut choice, 2000, |_| cost);
        assert!((choice.lead() - 1.5_f32.log2()).abs() < 0.1, "{cost:?}: {}", choice.lead());
        // One that is left out is no other way.
        choice.leave_out(if cost[1] == 45.0 { 1 } else { 2 });
        assert!((choice.lead() - 1.0).abs() < 0.1, "{cost:?}: {}", choice.lead());
    }
}
