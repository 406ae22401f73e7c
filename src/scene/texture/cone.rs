//! How wide a ray is where it arrives, and how much of a picture it sees there.

use glam::{DVec2, DVec3, Vec3};

/// The cone around a ray that its pixel sees through.
///
/// Source: Akenine-Möller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", Ray Tracing Gems,
/// 2019, chapter 20.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// How wide it is where its ray starts, in the scene's units.
    pub width: f32,
    /// By how much it widens with each unit of length: its angle, for angles this small.
    pub spread: f32,
}

impl Cone {
    /// Of a camera's ray: a point that opens by [`View::pixel_spread`](crate::scene::View::pixel_spread).
    pub fn new(spread: f32) -> Self {
        Self { width: 0.0, spread }
    }

    /// How wide it is after a way of length `distance` (for directions that are not unit vectors: `t` times
    /// their length).
    #[inline]
    pub fn width_at(self, distance: f32) -> f32 {
        // A narrowing cone, as a hollow mirror's, widens again behind its focus.
        (self.width + self.spread * distance).abs()
    }

    /// The cone of what goes on from there. A surface that scatters adds to the `spread`.
    #[inline]
    #[must_use]
    pub fn propagate(self, distance: f32) -> Self {
        Self { width: self.width + self.spread * distance, ..self }
    }
}

/// How wide a ray is on a triangle in units of its texture coordinates, to give to
/// [`Textures`](super::Textures): `width` is that of the cone where it arrives, `cosine` that between the
/// ray and the triangle's normal, of either sign.
///
/// The triangle says how much of the picture lies on how much of the surface, on average over both directions. At
/// grazing angles the footprint is taken as long as it is in its longer direction. 0 on triangles whose texture
/// coordinates span no area.
pub fn footprint(corners: &[Vec3; 3], uv: &[[f32; 2]; 3], width: f32, cosine: f32) -> f32 {
    // Double precision holds the squares of every float.
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let surface: DVec3 = (b - a).cross(c - a);
    let [p, q, r] = uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)));
    let picture = (q - p).perp_dot(r - p).abs();
    if picture == 0.0 {
        return 0.0;
    }
    let across = f64::from(width.abs()) / f64::from(cosine.abs());
    let footprint = ((picture / surface.length()).sqrt() * across) as f32;
    if footprint.is_nan() { 0.0 } else { footprint }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];
    const UV: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn a_cone_widens_as_it_goes() {
        let cone = Cone::new(0.01);
        assert_eq!(cone.width_at(0.0), 0.0);
        assert!((cone.width_at(50.0) - 0.5).abs() < 1e-6);
        let mirrored = cone.propagate(50.0).propagate(20.0);
        assert!((mirrored.width - 0.7).abs() < 1e-6);
        assert_eq!(mirrored.spread, cone.spread);
        assert!((Cone { width: 1.0, spread: -0.1 }.width_at(15.0) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn a_picture_of_one_unit_on_one_unit_is_seen_as_wide_as_the_ray() {
        assert_eq!(footprint(&CORNERS, &UV, 0.25, 1.0), 0.25);
        assert_eq!(footprint(&CORNERS, &UV, 0.25, -1.0), 0.25, "from behind as well");
        assert_eq!(footprint(&CORNERS, &UV, 0.25, 0.5), 0.5, "half as steep, twice as long");
    }

    #[test]
    fn sizes_count_by_the_root_of_their_areas() {
        let tiled = UV.map(|uv| uv.map(|x| 8.0 * x));
        assert_eq!(footprint(&CORNERS, &tiled, 0.25, 1.0), 2.0);
        let large = CORNERS.map(|corner| 10.0 * corner);
        assert!((footprint(&large, &UV, 0.25, 1.0) - 0.025).abs() < 1e-8);
        let stretched = UV.map(|[u, v]| [4.0 * u, v]);
        assert_eq!(footprint(&CORNERS, &stretched, 0.25, 1.0), 0.5);
    }

    #[test]
    fn degenerate_triangles_have_one_too() {
        assert_eq!(footprint(&CORNERS, &[[0.5, 0.5]; 3], 0.25, 1.0), 0.0);
        assert_eq!(footprint(&[Vec3::ONE; 3], &UV, 0.25, 1.0), f32::INFINITY);
        assert_eq!(footprint(&CORNERS, &UV, 0.25, 0.0), f32::INFINITY);
        assert_eq!(footprint(&[Vec3::ONE; 3], &UV, 0.0, 0.0), 0.0);
        let vast = CORNERS.map(|corner| 1e30 * corner);
        assert!(footprint(&vast, &UV, 1e25, 1.0) > 0.9e-5);
    }
}
