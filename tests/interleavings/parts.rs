//! Scenes like those of `scenes`, of what blocks are made of: epochs, what threads know, the gate, the quota.

use crate::epoch::Epochs;
use crate::gate::Gate;
use crate::known::Known;
use crate::quota::Quota;
use crate::sync::{Arc, AtomicBool, AtomicU32, AtomicUsize, Mutex, Ordering, thread};
use crate::words::{Notes, Words};

/// What readers keep in mind.
const LIST: usize = 1;

/// A list of one block that is used in one tick and the next, and goes, twice: readers keep in mind what they saw, and
/// whoever reads next does. Eras begin anew now and then.
pub fn known_lists_hold() {
    let (epochs, words) = (Epochs::new(4), Arc::new(Words::new(1, 0)));
    let (tick, freed) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicBool::new(false)));
    let all_known = Arc::new(Mutex::new(vec![Known::new(128), Known::new(128)]));
    words.arrive(0, 0);
    let readers: Vec<_> = (0..2)
        .map(|_| {
            let reader = epochs.reader().expect("room");
            let (words, tick) = (Arc::clone(&words), Arc::clone(&tick));
            let (all_known, freed) = (Arc::clone(&all_known), Arc::clone(&freed));
            thread::spawn(move || {
                let mut old = 0;
                for round in 0..4 {
                    let known = all_known.lock().expect("no panic").pop().expect("one for each reader");
                    reader.enter();
                    known.begin(words.eras.now());
                    // A view has the tick with which it was made, however long it goes on.
                    let now = if round == 2 { old } else { tick.load(Ordering::Relaxed) };
                    old = now;
                    let is_known = known.has(LIST, now);
                    if is_known || words.use_in(0, now, &Notes::default()) {
                        if !is_known {
                            known.add(LIST, now);
                        }
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                        thread::yield_now();
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                    }
                    reader.leave();
                    all_known.lock().expect("no panic").push(known);
                }
            })
        })
        .collect();
    for round in 1..3 {
        tick.store(round, Ordering::Relaxed);
        words.eras.begin(round);
        thread::yield_now();
        words.leave(0);
        let retired = epochs.retire();
        while epochs.earliest() <= retired {
            thread::yield_now();
        }
        freed.store(true, Ordering::SeqCst);
        thread::yield_now();
        if round == 1 {
            freed.store(false, Ordering::SeqCst);
            words.arrive(0, round);
        }
    }
    readers.into_iter().for_each(|reader| reader.join().expect("no panic"));
}

/// Something that is there, declared gone, retired and freed, and two readers that may have found it.
pub fn epochs_hold() {
    let epochs = Epochs::new(4);
    let (here, freed) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicBool::new(false)));
    let readers: Vec<_> = (0..2)
        .map(|_| {
            let reader = epochs.reader().expect("room");
            let (here, freed) = (Arc::clone(&here), Arc::clone(&freed));
            thread::spawn(move || {
                for _ in 0..2 {
                    reader.enter();
                    if here.load(Ordering::SeqCst) {
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                        thread::yield_now();
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                    }
                    reader.leave();
                }
            })
        })
        .collect();
    here.store(false, Ordering::SeqCst);
    let retired = epochs.retire();
    while epochs.earliest() <= retired {
        thread::yield_now();
    }
    freed.store(true, Ordering::SeqCst);
    readers.into_iter().for_each(|reader| reader.join().expect("no panic"));
}

pub fn the_gate_holds() {
    let (gate, inside) = (Arc::new(Gate::new(1)), Arc::new(AtomicUsize::new(0)));
    let threads: Vec<_> = (0..3)
        .map(|i| {
            let (gate, inside) = (Arc::clone(&gate), Arc::clone(&inside));
            thread::spawn(move || {
                gate.begin();
                for waits in 0..=i % 2 {
                    if waits > 0 {
                        gate.leave();
                        thread::yield_now();
                        gate.resume();
                    }
                    assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0, "two at one place");
                    thread::yield_now();
                    inside.fetch_sub(1, Ordering::SeqCst);
                }
                gate.leave();
            })
        })
        .collect();
    threads.into_iter().for_each(|thread| thread.join().expect("no panic"));
}

pub fn the_quota_comes_round() {
    let (quota, out) = (Arc::new(Quota::new(3)), Arc::new(AtomicUsize::new(0)));
    let threads: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|size| {
            let (quota, out) = (Arc::clone(&quota), Arc::clone(&out));
            thread::spawn(move || {
                for _ in 0..2 {
                    let taken = quota.take(size);
                    assert!(out.fetch_add(taken, Ordering::SeqCst) + taken <= 3, "more than there is");
                    out.fetch_sub(taken, Ordering::SeqCst);
                    quota.give(taken);
                }
            })
        })
        .collect();
    threads.into_iter().for_each(|thread| thread.join().expect("no panic"));
}
