//! Choosing a cell of a picture as often as there is light in it.

use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// The rows of a latitude-longitude picture and the columns of each, by the light that comes from them.
///
/// After the two-dimensional distribution of Pharr, Jakob & Humphreys, "Physically Based Rendering", 4th edition,
/// 2023, section A.5. But within a cell it is solid angle that is uniform, not latitude: so the density is one number
/// in each cell, and nothing becomes infinite at the poles.
#[derive(Debug)]
pub(super) struct Table {
    width: usize,
    /// The chance that a row or one before it is chosen: increasing, the last is 1.
    rows: Vec<f64>,
    /// The same for the columns of each row, row after row.
    columns: Vec<f64>,
    /// The cosines of the angle from the top at which rows begin and the last one ends: 1 to -1.
    cosines: Vec<f64>,
}

/// Of the light in a place that is blended from texels, the share that is from its own and from each neighbour: the
/// integral of their tents over a texel.
const TENT: [f64; 3] = [0.125, 0.75, 0.125];

impl Table {
    /// Of a picture of radiance, all finite and no less than 0.
    ///
    /// What counts for a cell is the mean of the radiance that is blended in it, which is not 0 where a neighbour
    /// shines in: every direction that light comes from has a chance.
    pub(super) fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Self {
        let cosines: Vec<f64> = (0..=height).map(|row| libm::cos(PI * row as f64 / height as f64)).collect();
        let luminance = |x: usize, y: usize| {
            let [r, g, b] = texels[y * width + x].map(f64::from);
            DVec3::new(0.2126, 0.7152, 0.0722).dot(DVec3::new(r, g, b))
        };
        let mut columns = vec![0.0; width * height];
        let sums = columns.par_chunks_exact_mut(width).enumerate().map(|(y, row)| {
            let [above, below] = [y.saturating_sub(1), (y + 1).min(height - 1)];
            let blurred = |x: usize| {
                let [a, b, c] = [above, y, below].map(|y| luminance(x, y));
                TENT[0] * a + TENT[1] * b + TENT[2] * c
            };
            for (x, cell) in row.iter_mut().enumerate() {
                let [left, right] = [(x + width - 1) % width, (x + 1) % width];
                *cell = TENT[0] * blurred(left) + TENT[1] * blurred(x) + TENT[2] * blurred(right);
            }
            accumulate(row) * (cosines[y] - cosines[y + 1])
        });
        let mut rows: Vec<f64> = sums.collect();
        if rows.iter().all(|&sum| sum == 0.0) {
            // All rows are even already: alike in solid angle.
            rows = cosines.windows(2).map(|pair| pair[0] - pair[1]).collect();
        }
        accumulate(&mut rows);
        Self { width, rows, columns, cosines }
    }

    /// A place in the picture: 0 to 1 from left to right, the cosine of the angle from the top; and the density of
    /// such places in solid angle, never 0.
    pub(super) fn sample(&self, random: [f32; 2]) -> (f64, f64, f32) {
        let (row, down) = choose(&self.rows, random[1]);
        let (column, across) = choose(self.columns(row), random[0]);
        let cosine = self.cosines[row] + (self.cosines[row + 1] - self.cosines[row]) * down;
        let u = (column as f64 + across) / self.width as f64;
        (u, cosine, self.pdf(column, row).max(f32::MIN_POSITIVE))
    }

    /// The density in a cell.
    pub(super) fn pdf(&self, column: usize, row: usize) -> f32 {
        let solid_angle = TAU / self.width as f64 * (self.cosines[row] - self.cosines[row + 1]);
        (chance(&self.rows, row) * chance(self.columns(row), column) / solid_angle) as f32
    }

    pub(super) fn bytes(&self) -> usize {
        (self.rows.capacity() + self.columns.capacity() + self.cosines.capacity()) * size_of::<f64>()
    }

    fn columns(&self, row: usize) -> &[f64] {
        &self.columns[row * self.width..][..self.width]
    }
}

/// Turns weights into the chance of each or one before it; returns their sum. If there is none, all are alike.
fn accumulate(weights: &mut [f64]) -> f64 {
    let sum: f64 = weights.iter().sum();
    if sum == 0.0 {
        weights.fill(1.0);
    }
    let mut so_far = 0.0;
    for weight in &mut *weights {
        so_far += *weight;
        *weight = so_far;
    }
    // Divided by itself, the last is 1 exactly; so are those after which nothing has a weight.
    weights.iter_mut().for_each(|weight| *weight /= so_far);
    sum
}

/// The one in whose part of 0 to 1 `random` lies, and how far within it. Never one without a chance.
fn choose(chances: &[f64], random: f32) -> (usize, f64) {
    const BELOW_ONE: f64 = 1.0 - f64::EPSILON;
    // A NaN is 0.
    let random = if random >= 0.0 { f64::from(random).min(BELOW_ONE) } else { 0.0 };
    let i = chances.partition_point(|&chance| chance <= random);
    let before = if i == 0 { 0.0 } else { chances[i - 1] };
    (i, (random - before) / (chances[i] - before))
}

fn chance(chances: &[f64], i: usize) -> f64 {
    chances[i] - if i == 0 { 0.0 } else { chances[i - 1] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_weight_is_never_chosen() {
        let mut weights = [0.0, 1.0, 0.0, 3.0, 0.0];
        assert_eq!(accumulate(&mut weights), 4.0);
        for (random, expected) in [
            (f32::NAN, (1, 0.0)),
            (-1.0, (1, 0.0)),
            (0.0, (1, 0.0)),
            (0.125, (1, 0.5)),
            (0.25, (3, 0.0)),
            (0.625, (3, 0.5)),
        ] {
            assert_eq!(choose(&weights, random), expected, "{random}");
        }
        for random in [1.0, 7.0, f32::INFINITY] {
            assert_eq!(choose(&weights, random).0, 3);
        }
        assert_eq!([0, 1, 2, 3, 4].map(|i| chance(&weights, i)), [0.0, 0.25, 0.0, 0.75, 0.0]);
    }

    #[test]
    fn nothing_at_all_is_chosen_alike() {
        let table = Table::new(4, 2, &[[0.0; 3]; 8]);
        for (column, row) in [(0, 0), (3, 0), (1, 1)] {
            assert!((f64::from(table.pdf(column, row)) - 1.0 / (2.0 * TAU)).abs() < 1e-7);
        }
    }
}
