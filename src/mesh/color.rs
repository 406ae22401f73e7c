//! Surface colours, and the sRGB transfer function between bytes and light.

use super::material::{DEFAULT_DIFFUSE, Material};
use glam::Vec3;
use std::sync::LazyLock;

/// Where a triangle's colour comes from. Colours are linear RGB reflectances, 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Colors {
    /// One colour for everything.
    Uniform(Vec3),
    /// One sRGB-encoded colour a triangle.
    PerTriangle(Vec<[u8; 3]>),
    /// One sRGB-encoded colour a vertex, interpolated in linear light.
    PerVertex(Vec<[u8; 3]>),
    /// Named materials, and for each triangle an index into them.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
        /// One index a triangle.
        of_triangle: Vec<u32>,
    },
}

impl Default for Colors {
    fn default() -> Self {
        Self::Uniform(DEFAULT_DIFFUSE)
    }
}

impl Colors {
    /// The materials; none if colours are of another kind.
    pub fn materials(&self) -> &[Material] {
        match self {
            Self::PerMaterial { materials, .. } => materials,
            _ => &[],
        }
    }

    /// How many triangles each of the materials has. Panics if a triangle has one that is not there.
    pub fn uses(&self) -> Vec<u64> {
        let Self::PerMaterial { materials, of_triangle } = self else { return Vec::new() };
        let mut uses = vec![0; materials.len()];
        of_triangle.iter().for_each(|&material| uses[material as usize] += 1);
        uses
    }

    /// The triangles whose material gives off light, in the order of their numbers. Panics likewise.
    pub fn emitters(&self) -> Vec<u32> {
        let Self::PerMaterial { materials, of_triangle } = self else { return Vec::new() };
        let emits: Vec<bool> = materials.iter().map(Material::emits).collect();
        if !emits.contains(&true) {
            return Vec::new();
        }
        (0..).zip(of_triangle).filter(|&(_, &material)| emits[material as usize]).map(|(i, _)| i).collect()
    }

    /// Bytes of memory that the colours take up.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Uniform(_) => 0,
            Self::PerTriangle(colors) | Self::PerVertex(colors) => colors.capacity() * 3,
            Self::PerMaterial { materials, of_triangle } => {
                let names: usize = materials.iter().map(|m| m.name.capacity() + m.place.capacity()).sum();
                of_triangle.capacity() * 4 + materials.capacity() * size_of::<Material>() + names
            }
        }
    }
}

/// The light, 0 to 1, that an sRGB-encoded byte stands for.
#[inline]
pub fn srgb_to_linear(byte: u8) -> f32 {
    linear()[byte as usize]
}

/// The same for all bytes. To ask whether the table is there yet is more work than to look into it: who decodes several
/// bytes asks once.
#[inline]
fn linear() -> &'static [f32; 256] {
    static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let s = i as f64 / 255.0;
            let light = if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            light as f32
        })
    });
    &LINEAR
}

/// The sRGB-encoded byte for an amount of light, at most 0.55 of a step away; what lies outside 0 to 1 is clamped,
/// and NaN is 0.
#[inline]
pub fn linear_to_srgb(light: f32) -> u8 {
    fast_srgb8::f32_to_srgb8(light)
}

/// A triangle's colours, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaceColor {
    /// One for all of it.
    One(Vec3),
    /// One at each corner.
    Corners([Vec3; 3]),
}

impl FaceColor {
    /// Of a triangle whose corners have these sRGB-encoded colours.
    #[inline]
    pub(crate) fn of_corners(corners: [[u8; 3]; 3]) -> Self {
        let linear = linear();
        Self::Corners(
            corners.map(|[r, g, b]| Vec3::new(linear[r as usize], linear[g as usize], linear[b as usize])),
        )
    }

    /// The colour where a hit's barycentrics are `u` and `v`: those of corners blend as `(1 - u - v) c0 + u c1 + v c2`.
    #[inline(always)]
    pub fn at(&self, u: f32, v: f32) -> Vec3 {
        match *self {
            Self::One(color) => color,
            Self::Corners([c0, c1, c2]) => (1.0 - u - v) * c0 + u * c1 + v * c2,
        }
    }
}

/// An sRGB triple in linear light.
#[inline]
pub(crate) fn decode([r, g, b]: [u8; 3]) -> Vec3 {
    let linear = linear();
    Vec3::new(linear[r as usize], linear[g as usize], linear[b as usize])
}

/// Linear light as an sRGB triple.
pub(super) fn encode(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(linear_to_srgb)
}

/// sRGB-encoded floats as bytes. They run from 0 to 1, but some tools write 0 to 255 all the
/// same: so one value above 1 says that all of them are meant so.
pub(super) fn quantize(colors: &[[f32; 3]]) -> Vec<[u8; 3]> {
    quantize_to(colors.iter().flatten().copied().fold(0.0, f32::max), colors)
}

/// The same for some of a list's colours, of which the greatest value of all is known.
pub(super) fn quantize_to(greatest: f32, colors: &[[f32; 3]]) -> Vec<[u8; 3]> {
    let scale = if greatest > 1.0 { 1.0 } else { 255.0 };
    colors.iter().map(|c| c.map(|c| (c * scale + 0.5) as u8)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_round_trip() {
        for byte in 0..=255 {
            assert_eq!(linear_to_srgb(srgb_to_linear(byte)), byte);
        }
    }

    #[test]
    fn light_outside_the_range_is_clamped() {
        assert_eq!(
            [-1.0, 0.0, 1.0, 7.0, f32::INFINITY, f32::NAN].map(linear_to_srgb),
            [0, 0, 255, 255, 255, 0]
        );
    }

    #[test]
    fn float_colors_may_run_to_one_or_to_255() {
        assert_eq!(quantize(&[[0.0, 0.5, 1.0]]), [[0, 128, 255]]);
        assert_eq!(quantize(&[[0.0, 1.0, 255.0]]), [[0, 1, 255]]);
        assert_eq!(quantize(&[[f32::NAN, -1.0, 300.0]]), [[0, 0, 255]]);
    }
}
