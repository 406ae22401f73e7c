//! What plants are made of, and how they are handed over.

use super::*;
use std::collections::HashMap;

/// How many times longer a triangle's longest edge is than the height over it.
pub(super) fn elongation(part: &Part<'_>, triangle: usize) -> f32 {
    let [a, b, c] = part.triangles[triangle].map(|i| part.positions[i as usize]);
    let longest = [a - b, b - c, c - a].map(Vec3::length_squared).into_iter().fold(0.0, f32::max);
    longest / (b - a).cross(c - a).length()
}

/// How many triangles have the corners of one before them, either way round.
pub(super) fn coincident(part: &Part<'_>) -> usize {
    let mut seen = HashMap::new();
    for t in part.triangles {
        let mut corners = t.map(|i| part.positions[i as usize].to_array().map(f32::to_bits));
        corners.sort_unstable();
        *seen.entry(corners).or_insert(0) += 1;
    }
    seen.values().map(|times| times - 1).sum()
}

/// More than any cell has, at any quality.
const LARGEST_PART: u64 = 400_000;

#[test]
fn parts_are_small_however_large_the_plant_is() {
    for triangles in [10_000, 300_000, 2_000_000] {
        let mut parts_seen = 0;
        let Ok(()) = parts::<Infallible>(PlantParams { triangles, seed: 4 }, |part| {
            let size = part.size();
            assert!(size.triangles <= LARGEST_PART && size.vertices <= LARGEST_PART, "{size:?}");
            assert!(part.triangles.iter().flatten().all(|&i| u64::from(i) < size.vertices));
            parts_seen += 1;
            Ok(())
        });
        assert!(parts_seen as u64 >= 2 + triangles / LARGEST_PART, "{parts_seen} for {triangles}");
    }
}

#[test]
fn the_finest_cells_are_small_too() {
    // The quality is that of the largest plants; the cells that come first are drawn, and no others.
    let mut left = 30;
    let outcome = parts(PlantParams { triangles: *TRIANGLES.end(), seed: 9 }, |part| {
        assert!(part.size().triangles <= LARGEST_PART, "{:?}", part.size());
        left -= 1;
        if left == 0 { Err("enough") } else { Ok(()) }
    });
    assert_eq!((outcome, left), (Err("enough"), 0));
}

#[test]
fn a_part_that_is_not_taken_ends_it() {
    let mut calls = 0;
    let outcome = parts(PlantParams { triangles: 200_000, seed: 1 }, |_| {
        calls += 1;
        Err("full")
    });
    assert_eq!((outcome, calls), (Err("full"), 1));
}

#[test]
fn cells_have_what_models_of_plants_have() {
    for triangles in [10_000, 100_000, 300_000, 2_000_000] {
        let mut first = true;
        let outcome = parts(PlantParams { triangles, seed: 1 }, |part| {
            if !std::mem::take(&mut first) {
                return Err(());
            }
            let all = part.triangles.len();
            let share = |n: usize| n as f64 / all as f64;
            let doubles = share(coincident(&part));
            assert!((0.002..0.2).contains(&doubles), "{doubles} of {all} coincide");
            let thin = (0..all).filter(|&i| elongation(&part, i) > 30.0).count();
            assert!(share(thin) > 0.05, "{thin} of {all} are elongated");
            let area = |i: usize| {
                let [a, b, c] = part.triangles[i].map(|i| part.positions[i as usize]);
                (b - a).cross(c - a).length()
            };
            let (least, most) =
                (0..all).map(area).fold((f32::MAX, 0.0_f32), |(l, m), a| (l.min(a), m.max(a)));
            assert!(least > 0.0 && most > 1e5 * least, "areas from {least} to {most}");
            Ok(())
        });
        assert_eq!(outcome, Err(()));
    }
}
