//! What the builder sorts: triangles' parts.

use crate::geometry::Aabb;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

/// The box around a triangle's part in a cell, and which triangle it is: half a cache line, two
/// registers of four.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Reference {
    /// The least corner; in the last lane, the primitive id's bits.
    low: [f32; 4],
    /// The greatest corner; the last lane is nobody's.
    high: [f32; 4],
}

impl Reference {
    /// Fills unused memory.
    pub const NONE: Self = Self { low: [0.0; 4], high: [0.0; 4] };

    pub fn new(primitive: u32, bounds: &Aabb) -> Self {
        let low = bounds.min.extend(f32::from_bits(primitive)).to_array();
        Self { low, high: bounds.max.extend(0.0).to_array() }
    }

    #[inline(always)]
    pub fn primitive(&self) -> u32 {
        self.low[3].to_bits()
    }

    /// The same part of a triangle that goes by another id.
    pub fn renamed(mut self, primitive: u32) -> Self {
        self.low[3] = f32::from_bits(primitive);
        self
    }

    /// The part's least coordinate along an axis.
    #[inline(always)]
    pub fn min(&self, axis: usize) -> f32 {
        self.low[axis]
    }

    /// The part's greatest coordinate along an axis.
    #[inline(always)]
    pub fn max(&self, axis: usize) -> f32 {
        self.high[axis]
    }

    /// The least corner. The last lane may hold anything.
    #[inline(always)]
    pub fn low(&self) -> Vec4 {
        Vec4::from_array(self.low)
    }

    /// The greatest corner. The last lane may hold anything.
    #[inline(always)]
    pub fn high(&self) -> Vec4 {
        Vec4::from_array(self.high)
    }

    /// The least corner and the greatest. The last lane of each may hold anything.
    #[inline(always)]
    pub fn corners(&self) -> &[f32; 8] {
        bytemuck::cast_ref(self)
    }

    pub fn bounds(&self) -> Aabb {
        Aabb { min: Vec3::from_slice(&self.low[..3]), max: Vec3::from_slice(&self.high[..3]) }
    }
}
