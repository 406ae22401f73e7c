//! Frames that are there in time: what has not come from the file is drawn as boxes, and completed later.

use super::frame::Frame;
use super::frame::TilePixels;
use super::shade::Shader;
use super::tile::{SQUARE, Scratch};
use crate::cache::Cached;
use crate::scene::{Surface, View};
use crate::traverse::first_page;
use serde::Serialize;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A frame as it was when its time was over.
#[derive(Clone, Debug)]
pub struct First {
    /// The picture. Where scenes have not come yet, pages are boxes in grey.
    pub frame: Frame,
    /// When, and how much of it.
    pub stats: FirstStats,
}

/// When the first picture was there, and how much of it was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FirstStats {
    /// Seconds from the frame's beginning.
    pub seconds: f64,
    /// The part of the pixels that are drawn as boxes.
    pub stand_ins: f64,
}

/// What it takes to draw pixels as boxes, from frame to frame.
#[derive(Debug)]
pub(super) struct StandInCost {
    /// Nanoseconds a pixel.
    nanos: AtomicU64,
}

impl Default for StandInCost {
    fn default() -> Self {
        Self { nanos: AtomicU64::new(400) }
    }
}

impl StandInCost {
    /// When a frame has to stop waiting so that it is there within `limit`, if so many pixels may be left then
    /// to so many threads.
    pub fn deadline(&self, limit: Duration, pixels: u64, threads: usize) -> Instant {
        let all = Duration::from_nanos(self.nanos.load(Ordering::Relaxed) * pixels / threads as u64);
        Instant::now() + (limit - all.min(limit / 2))
    }

    fn add(&self, pixels: u64, time: Duration) {
        let nanos = (time.as_nanos() as u64 / pixels.max(1)).clamp(10, 10_000);
        let before = self.nanos.load(Ordering::Relaxed);
        self.nanos.store((7 * before + nanos) / 8, Ordering::Relaxed);
    }
}

/// Draws squares as boxes.
pub(super) struct StandIn<'a> {
    pub cached: &'a Cached,
    pub view: View,
    pub cost: &'a StandInCost,
}

impl StandIn<'_> {
    /// Draws the square of a tile at (`x`, `y`): a ray through the middle of each pixel.
    pub fn draw<S: Surface, const W: usize>(
        &self,
        shader: &Shader<'_, S>,
        scratch: &mut Scratch<W>,
        pixels: &mut TilePixels<'_>,
        (x, y): (u32, u32),
    ) {
        let start = Instant::now();
        let tile = pixels.tile;
        let (columns, rows) = (x..tile.width.min(x + SQUARE), y..tile.height.min(y + SQUARE));
        let count = u64::from((columns.end - x) * (rows.end - y));
        for y in rows {
            for x in columns.clone() {
                let ray = self.view.ray(tile.x + x, tile.y + y, [0.5, 0.5]);
                let entry = first_page(self.cached, &ray);
                let shade = shader.stand_in(&ray, entry);
                pixels.color.put(x, y, shade.base.to_array());
                pixels.depth.put(x, y, shade.depth);
                pixels.normal.put(x, y, shade.normal.to_array());
            }
        }
        scratch.stand_ins += count;
        self.cost.add(count, start.elapsed());
    }
}
