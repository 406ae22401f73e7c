//! Gratings: floors of upright bars, which light falls through.

use super::palette::GALVANISED;
use crate::mesh::generate::sketch::Sketch;
use glam::Vec3;

/// The quality from which walkways are gratings, and that from which floors and treads are. Below, a
/// plate stands for the bars: so few as a coarse model affords would not cover the floor.
const WALKWAYS_FROM: f32 = 0.8;
const FLOORS_FROM: f32 = 1.2;

/// How a panel's bars stand: their distance, their width and that of the rods across, in metres.
struct Bars {
    pitch: f32,
    width: f32,
    rods: f32,
}

impl Bars {
    /// The finer the model, the nearer to the 30 mm by 100 mm of real gratings.
    fn of(quality: f32) -> Self {
        match quality {
            ..1.2 => Self { pitch: 0.15, width: 0.06, rods: 2.8 },
            1.2..1.6 => Self { pitch: 0.12, width: 0.03, rods: 0.7 },
            _ => Self { pitch: 0.06, width: 0.01, rods: 0.35 },
        }
    }
}

/// A walkway of grating between two opposite corners, the upper of which is in the plane walked on.
pub(super) fn walkway(sketch: &mut Sketch, min: Vec3, max: Vec3) {
    sketch.paint = GALVANISED;
    if sketch.quality < WALKWAYS_FROM { sketch.cuboid(min, max) } else { panel(sketch, min, max) }
}

/// The same for floors, which are gratings in fine models alone.
pub(super) fn floor(sketch: &mut Sketch, min: Vec3, max: Vec3) {
    sketch.paint = GALVANISED;
    if sketch.quality < FLOORS_FROM { sketch.cuboid(min, max) } else { panel(sketch, min, max) }
}

/// A stair's tread around `center`, between the stringers at both ends of `across`.
pub(super) fn tread(sketch: &mut Sketch, center: Vec3, across: Vec3, depth: f32, height: f32) {
    let bar = |sketch: &mut Sketch, at: Vec3, width: f32| {
        sketch.bar(at - across, at + across, width, height, Vec3::Y);
    };
    if sketch.quality < FLOORS_FROM {
        return bar(sketch, center, depth);
    }
    let forward = Vec3::Y.cross(across).normalize();
    let bars = 6;
    for i in 0..=bars {
        let off = depth * (i as f32 / bars as f32 - 0.5);
        bar(sketch, center + forward * off, if i == 0 { 0.03 } else { 0.008 });
    }
}

/// Bars along the longer side, from end to end, and rods across that hold them.
fn panel(sketch: &mut Sketch, min: Vec3, max: Vec3) {
    let Bars { pitch, width, rods } = Bars::of(sketch.quality);
    let size = max - min;
    let (along, across) = if size.x >= size.z { (Vec3::X, Vec3::Z) } else { (Vec3::Z, Vec3::X) };
    let (length, breadth) = (size.dot(along), size.dot(across));
    let bars = (breadth / pitch).ceil().max(1.0) as usize;
    for i in 0..=bars {
        let off = min + across * ((breadth - width) * i as f32 / bars as f32);
        sketch.cuboid(off, off + along * length + across * width + Vec3::Y * size.y);
    }
    let rods = (length / rods).ceil().max(1.0) as usize;
    for i in 0..=rods {
        // Half as high as the bars, and within them.
        let off = min + along * ((length - width) * i as f32 / rods as f32) + Vec3::Y * (size.y * 0.45);
        sketch.cuboid(off, off + along * width + across * breadth + Vec3::Y * (size.y * 0.5));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::plant::tests::elongation;

    #[test]
    fn bars_are_long_and_thin_and_within_the_panel() {
        for quality in [1.0, 1.4, 1.8] {
            let mut sketch = Sketch::new(quality);
            let (min, max) = (Vec3::new(-14.0, 6.0, 1.0), Vec3::new(14.0, 6.04, 1.9));
            walkway(&mut sketch, min, max);
            let part = sketch.part();
            assert!(
                part.positions
                    .iter()
                    .all(|p| { (*p - min).min_element() >= -1e-4 && (max - *p).min_element() >= -1e-4 })
            );
            let longest = (0..part.triangles.len()).map(|i| elongation(&part, i)).fold(0.0, f32::max);
            assert!(longest > 400.0, "{longest}");
        }
    }

    #[test]
    fn coarse_models_have_plates() {
        let mut sketch = Sketch::new(0.4);
        walkway(&mut sketch, Vec3::ZERO, Vec3::ONE);
        floor(&mut sketch, Vec3::ZERO, Vec3::ONE);
        tread(&mut sketch, Vec3::ZERO, Vec3::X, 0.26, 0.04);
        assert_eq!(sketch.len(), 3 * 12);
    }
}
