//! Faces that coincide, as models have them that were put together from parts.

use super::palette::DARK_STEEL;
use crate::mesh::generate::sketch::Sketch;
use glam::{Vec2, Vec3};

/// A connection plate that both of the members it joins bring with them: it is there twice, all
/// corners alike. A ray that meets it has a tie, which the lower primitive id decides.
pub(super) fn shared_plate(sketch: &mut Sketch, min: Vec3, max: Vec3) {
    sketch.paint = DARK_STEEL;
    for _ in 0..2 {
        sketch.cuboid(min, max);
    }
}

/// Two discs that touch at `at`, `height` thick each: their faces there are the same triangles, turned
/// round. Fine models have raised faces, which leave a slit between the rims.
pub(super) fn touching_discs(
    sketch: &mut Sketch,
    at: Vec3,
    axis: Vec3,
    radius: f32,
    height: f32,
    raised: bool,
) {
    // Both profiles go through heights of exactly 0, where rounding makes the same of both.
    let (rim, face) = if raised { (height * 0.1, radius * 0.75) } else { (0.0, radius) };
    let half = [(0.0, 0.0), (face, 0.0), (face, rim), (radius, rim), (radius, height), (0.0, height)];
    let upper: Vec<Vec2> = half.iter().map(|&p| Vec2::from(p)).collect();
    let upper = if raised { upper } else { [&upper[..2], &upper[4..]].concat() };
    let lower: Vec<Vec2> = upper.iter().rev().map(|p| Vec2::new(p.x, -p.y)).collect();
    sketch.revolve(at, axis, &lower);
    sketch.revolve(at, axis, &upper);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::plant::tests::coincident;

    #[test]
    fn plates_and_discs_coincide_where_they_should() {
        let mut sketch = Sketch::new(1.0);
        sketch.origin = Vec3::new(812.0, 0.0, -1176.0);
        shared_plate(&mut sketch, Vec3::splat(0.1), Vec3::splat(0.7));
        assert_eq!(coincident(&sketch.part()), 12);
        for raised in [false, true] {
            sketch.clear();
            let at = Vec3::new(1.7, 3.3, -0.4);
            touching_discs(&mut sketch, at, Vec3::new(0.6, 0.0, 0.8), 0.3, 0.05, raised);
            assert_eq!(coincident(&sketch.part()), sketch.sides(0.3));
        }
    }
}
