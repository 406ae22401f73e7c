//! What each pixel costs: pictures of where a tree is good, and where it is not.

use super::bench::build::count::walk;
use crate::error::{Error, Result};
use crate::geometry::Ray;
use crate::render::Size;
use crate::scene::Camera;
use crate::traverse::Accel;
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;
use std::str::FromStr;
use std::time::Instant;

/// What is counted of a pixel's ray, which is traced by itself, through the pixel's middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cost {
    /// Inner nodes on its way to the hit.
    Steps,
    /// Triangles in the leaves on its way, as often as it meets them.
    Tests,
    /// Leaves on its way, empty ones among them.
    Leaves,
    /// Nanoseconds: the least of some runs.
    Time,
}

/// Runs of a ray of which the least counts.
const RUNS: usize = 5;

impl Cost {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Steps, Self::Tests, Self::Leaves, Self::Time];

    /// `steps`, `tests`, `leaves` or `time`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Steps => "steps",
            Self::Tests => "tests",
            Self::Leaves => "leaves",
            Self::Time => "time",
        }
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Cost {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|cost| cost.name() == name).ok_or_else(|| {
            Error::option(
                "--heatmap",
                format!("\"{name}\" is not one of steps, tests, leaves, time, nor an effect"),
            )
        })
    }
}

/// The costs of a picture's pixels, row by row from the top. `row_done` is called after each row.
pub fn map(accel: &Accel, camera: &Camera, size: Size, cost: Cost, row_done: impl Fn() + Sync) -> Vec<f32> {
    let view = camera.view(size.width, size.height);
    let mut costs = vec![0.0; size.width as usize * size.height as usize];
    costs.par_chunks_mut(size.width as usize).zip(0..size.height).for_each(|(row, y)| {
        for (pixel, x) in row.iter_mut().zip(0..) {
            let ray = view.ray(x, y, [0.5, 0.5]);
            *pixel = match cost {
                Cost::Steps => walk_to_hit(accel, &ray)[0] as f32,
                Cost::Leaves => walk_to_hit(accel, &ray)[1] as f32,
                Cost::Tests => walk_to_hit(accel, &ray)[2] as f32,
                Cost::Time => nanoseconds(accel, &ray),
            };
        }
        row_done();
    });
    costs
}

/// Inner nodes, leaves and triangles on a ray's way to its hit.
fn walk_to_hit(accel: &Accel, ray: &Ray) -> [u64; 3] {
    let hit = accel.intersect(ray);
    walk(accel, ray, if hit.is_hit() { hit.t } else { ray.tfar })
}

/// The time that a ray takes in its quickest run.
fn nanoseconds(accel: &Accel, ray: &Ray) -> f32 {
    let run = |_| {
        let start = Instant::now();
        std::hint::black_box(accel.intersect(ray));
        start.elapsed().as_nanos() as f32
    };
    (0..RUNS).map(run).fold(f32::INFINITY, f32::min)
}

/// How costs are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// The average.
    pub mean: f32,
    /// Half of the pixels cost no more.
    pub median: f32,
    /// 99 of 100 pixels cost no more.
    pub percentile_99: f32,
    /// The dearest pixel.
    pub greatest: f32,
}

impl Spread {
    /// Of at least one pixel.
    pub fn of(costs: &[f32]) -> Self {
        let mut sorted = costs.to_vec();
        sorted.sort_by(f32::total_cmp);
        let at = |part: f64| sorted[((sorted.len() - 1) as f64 * part) as usize];
        let sum: f64 = costs.iter().map(|&cost| f64::from(cost)).sum();
        Self {
            mean: (sum / costs.len() as f64) as f32,
            median: at(0.5),
            percentile_99: at(0.99),
            greatest: at(1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;

    #[test]
    fn pixels_that_see_nothing_cost_nothing_and_others_something() {
        let mesh = shapes::sphere(4);
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let camera = Camera::framing(&mesh.bounds(), 1.0);
        let size = Size::new(32, 32).expect("a size");
        for cost in [Cost::Steps, Cost::Tests, Cost::Leaves] {
            let costs = map(&accel, &camera, size, cost, || ());
            assert_eq!(costs[0], 0.0, "{cost} in the corner");
            assert!(costs[16 * 32 + 16] > 0.0, "{cost} in the middle");
            let spread = Spread::of(&costs);
            assert!(spread.median <= spread.percentile_99 && spread.percentile_99 <= spread.greatest);
            assert!(spread.mean > 0.0 && spread.mean < spread.greatest);
        }
        assert!(map(&accel, &camera, size, Cost::Time, || ()).iter().all(|&ns| ns > 0.0));
    }

    #[test]
    fn names_are_understood() {
        for cost in Cost::ALL {
            assert_eq!(cost.name().parse::<Cost>().expect("a name"), cost);
        }
        let message = "heat".parse::<Cost>().expect_err("no name").to_string();
        assert!(message.starts_with("--heatmap: \"heat\""), "{message}");
    }
}
