//! How large a mesh's triangles are, and of what shape: what a tuner looks at first.

use super::Mesh;
use serde::Serialize;

/// Triangles by area and by aspect, in powers of ten.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Shapes {
    /// Triangles whose area is 10^-1 to 1 of the largest one's, 10^-2 to 10^-1, and so on; the last entry
    /// counts all smaller ones.
    pub by_area: [u64; DECADES],
    /// Triangles whose longest edge is 1 to 10 times their least height, 10 to 100 times, and so on; the
    /// last entry counts all slimmer ones.
    pub by_aspect: [u64; DECADES],
    /// Triangles without area, in neither list.
    pub without_area: u64,
    /// The largest area.
    pub largest_area: f64,
    /// The average area.
    pub mean_area: f64,
}

/// Powers of ten that are told apart.
pub const DECADES: usize = 9;

impl Shapes {
    /// Those of a mesh whose indices are in range.
    pub fn of(mesh: &Mesh) -> Self {
        let measured: Vec<[f64; 2]> =
            mesh.triangles.iter().map(|&triangle| measure(mesh, triangle)).collect();
        let largest = measured.iter().fold(0.0, |largest: f64, [area, _]| largest.max(*area));
        let sum: f64 = measured.iter().map(|[area, _]| area).sum();
        let mean_area = sum / measured.len().max(1) as f64;
        let mut shapes = Self { largest_area: largest, mean_area, ..Self::default() };
        for [area, aspect] in measured {
            if area > 0.0 {
                shapes.by_area[decade(largest / area)] += 1;
                shapes.by_aspect[decade(aspect)] += 1;
            } else {
                shapes.without_area += 1;
            }
        }
        shapes
    }
}

/// Area, and longest edge beside least height.
fn measure(mesh: &Mesh, triangle: [u32; 3]) -> [f64; 2] {
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
    let area = 0.5 * (b - a).cross(c - a).length();
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    [area, longest / (2.0 * area)]
}

/// The power of ten of a number from 1 on.
fn decade(x: f64) -> usize {
    (x.log10().max(0.0) as usize).min(DECADES - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Colors;
    use glam::Vec3;

    #[test]
    fn sizes_and_shapes_are_told_apart() {
        let positions = vec![
            Vec3::ZERO,
            Vec3::new(10.0, 0.0, 0.0),
            Vec3::new(0.0, 10.0, 0.0),
            Vec3::new(10.0, 0.05, 0.0),
            Vec3::new(5.0, 0.0, 0.0),
        ];
        let triangles = vec![[0, 1, 2], [0, 1, 3], [0, 4, 1], [2, 2, 1]];
        let shapes = Shapes::of(&Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() });
        assert_eq!(shapes.largest_area, 50.0);
        // 0.25 is 200 times less; 10 long, 0.05 high.
        assert_eq!(shapes.by_area, [1, 0, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(shapes.by_aspect, [1, 0, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(shapes.without_area, 2);
    }
}
