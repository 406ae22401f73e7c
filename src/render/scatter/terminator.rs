//! Normals that differ from the triangle's: what they would make impossible, and shadows on coarse meshes.

use glam::Vec3;

/// The normal to shade with: `shading`, on the side of `geometric`, bent as far as it takes that a mirror with this
/// normal, looked at from `view`, does not show what is behind the triangle.
///
/// All are unit vectors; `view` leads to where the ray came from, `geometric` is the triangle's normal on that side.
/// If `view` is not there, or `shading` is at right angles to `geometric`, the result is `geometric`.
///
/// As Keller et al. ("The Iray light transport simulation and rendering system", 2017, A.3) do, the mirror's direction
/// is moved along the shading normal until it is above the triangle, and the normal is the one halfway to it.
#[inline]
pub fn consistent_normal(view: Vec3, geometric: Vec3, shading: Vec3) -> Vec3 {
    /// The sine by which a mirror's direction is to clear the triangle at least, where the view does so by twice as
    /// much.
    const CLEARANCE: f32 = 1.0 / 64.0;

    let height = view.dot(geometric);
    let along = shading.dot(geometric);
    if height <= 0.0 || along.abs() < 1e-4 {
        return geometric;
    }
    let (shading, along) = if along < 0.0 { (-shading, -along) } else { (shading, along) };
    let clearance = CLEARANCE.min(0.5 * height);
    if 2.0 * shading.dot(view) * along - height >= clearance {
        return shading;
    }
    let mirrored = shading * ((clearance + height) / along) - view;
    (view + mirrored.normalize_or(geometric)).normalize_or(geometric)
}

/// How far from a triangle that is shaded as part of a smooth surface a shadow ray starts, so that the triangle's
/// neighbours do not cut straight edges into the light on it: a vector to be added to the point with the barycentric
/// weights `u` (of the second corner) and `v` (of the third). It does not replace the step that keeps rays from
/// hitting the triangle itself.
///
/// Where the surface bulges to the side of `geometric`, a unit normal of the triangle on the side of the light, the
/// point is moved out toward it: to the mean, by the weights, of its projections onto the planes through the corners at
/// right angles to their `normals` (Hanika, "Hacking the shadow terminator", Ray Tracing Gems II, 2021, chapter 4).
/// Where it is hollow, and if the three normals are the same, the result is zero; it never leads below the triangle.
/// `normals` are unit vectors and may be on either side, all of them.
#[inline]
pub fn terminator_offset(corners: [Vec3; 3], normals: [Vec3; 3], u: f32, v: f32, geometric: Vec3) -> Vec3 {
    let [p0, p1, p2] = corners;
    let [n0, n1, n2] = normals;
    if n0 == n1 && n0 == n2 {
        return Vec3::ZERO;
    }
    let side = if (n0 + n1 + n2).dot(geometric) < 0.0 { -1.0 } else { 1.0 };
    // Along the edges, so that a small triangle far away is rounded once only.
    let (e1, e2) = (p1 - p0, p2 - p0);
    let from_first = e1 * u + e2 * v;
    let away = |from: Vec3, normal: Vec3| {
        let normal = normal * side;
        // What is above a corner's plane stays. A normal beyond the triangle's plane says nothing about its surface.
        let below = if normal.dot(geometric) > 0.0 { (-from.dot(normal)).max(0.0) } else { 0.0 };
        normal * below
    };
    away(from_first, n0) * (1.0 - u - v) + away(from_first - e1, n1) * u + away(from_first - e2, n2) * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit(x: f32, y: f32, z: f32) -> Option<Vec3> {
        let v = Vec3::new(x, y, z);
        (v.length() > 0.05).then(|| v.normalize())
    }

    proptest! {
        #[test]
        fn mirrors_do_not_show_what_is_behind(
            v in [-1.0f32..1.0, -1.0f32..1.0, 0.001f32..1.0],
            s in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0],
        ) {
            let (Some(view), Some(shading)) = (unit(v[0], v[1], v[2]), unit(s[0], s[1], s[2])) else {
                return Ok(());
            };
            let normal = consistent_normal(view, Vec3::Z, shading);
            prop_assert!(normal.is_normalized() && normal.z > 0.0, "{normal}");
            let mirrored = (-view).reflect(normal);
            prop_assert!(mirrored.z > 0.0, "{view} {shading}: {normal} {mirrored}");
            if shading.z.abs() < 1e-4 {
                // There is no side of the triangle to bend such a normal to.
                prop_assert_eq!(normal, Vec3::Z);
                return Ok(());
            }
            let faces_view = normal.dot(view) > 0.0;
            let kept = shading * 1.0f32.copysign(shading.z);
            prop_assert!(faces_view || normal == kept, "{view} {shading}: {normal}");
            // It is between the two, in their plane: nothing turns sideways.
            prop_assert!(normal.dot(view.cross(kept)).abs() < 1e-4, "{view} {shading}: {normal}");
        }
    }

    #[test]
    fn what_is_consistent_is_kept_to_the_bit() {
        let view = Vec3::new(0.3, 0.1, 0.9).normalize();
        for tilt in [0.0, 0.1, 0.3] {
            let shading = Vec3::new(tilt, -0.1, 1.0).normalize();
            assert_eq!(consistent_normal(view, Vec3::Z, shading), shading);
            assert_eq!(consistent_normal(view, Vec3::Z, -shading), shading, "flipped");
        }
    }

    #[test]
    fn it_changes_without_a_jump() {
        let view = Vec3::new(0.9, 0.0, 0.3).normalize();
        let normal = |i: u32| {
            let angle = i as f32 * 1e-4;
            consistent_normal(view, Vec3::Z, Vec3::new(-angle.sin(), 0.0, angle.cos()))
        };
        let steps = (1..15_000).map(|i| normal(i).distance(normal(i - 1)));
        assert!(steps.fold(0.0, f32::max) < 2e-4);
        assert!(normal(5000).distance(Vec3::new(-0.5f32.sin(), 0.0, 0.5f32.cos())) > 0.1, "it was bent");
    }

    #[test]
    fn without_a_side_it_is_the_triangles() {
        assert_eq!(consistent_normal(Vec3::NEG_Z, Vec3::Z, Vec3::X), Vec3::Z);
        assert_eq!(consistent_normal(Vec3::Z, Vec3::Z, Vec3::X), Vec3::Z);
        let (low, aside) = (Vec3::new(0.0, -0.39, 0.001), Vec3::new(-0.5273632, -0.95091915, 0.0));
        assert_eq!(consistent_normal(low.normalize(), Vec3::Z, aside.normalize()), Vec3::Z);
    }

    /// A triangle of a unit ball.
    const BALL: [Vec3; 3] =
        [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8), Vec3::new(-0.48, -0.36, 0.8)];
    const WEIGHTS: [[f32; 2]; 6] = [[0.3, 0.3], [0.1, 0.2], [0.5, 0.5], [0.0, 0.5], [0.8, 0.1], [0.25, 0.0]];

    fn point(corners: [Vec3; 3], [u, v]: [f32; 2]) -> Vec3 {
        corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v
    }

    #[test]
    fn a_flat_triangle_is_where_it_is() {
        let tilted = Vec3::new(0.1, 0.2, 0.9).normalize();
        for normal in [Vec3::Z, Vec3::NEG_Z, tilted] {
            for [u, v] in WEIGHTS {
                assert_eq!(terminator_offset(BALL, [normal; 3], u, v, Vec3::Z), Vec3::ZERO);
            }
        }
    }

    #[test]
    fn on_a_ball_points_move_out_to_about_its_surface() {
        for weights @ [u, v] in WEIGHTS {
            let flat = point(BALL, weights);
            let offset = terminator_offset(BALL, BALL, u, v, Vec3::Z);
            assert!(offset.z > 0.0);
            // Each projection is beyond the ball, so is their mean. By no more than the farthest of them.
            let reach = (flat + offset).length();
            assert!((1.0 - 1e-6..1.25).contains(&reach), "{weights:?}: {} to {reach}", flat.length());
            // From the inside it is hollow; normals on the other side of the triangle mean the same surface.
            assert_eq!(terminator_offset(BALL, BALL, u, v, Vec3::NEG_Z), Vec3::ZERO);
            assert_eq!(terminator_offset(BALL, BALL.map(|n| -n), u, v, Vec3::Z), offset);
        }
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            assert!(terminator_offset(BALL, BALL, u, v, Vec3::Z).length() < 1e-6, "corners stay");
        }
    }

    #[test]
    fn neighbours_agree_on_their_edge() {
        // Both move a point of the edge by what its two corners say.
        let other = [BALL[1], BALL[0], Vec3::new(0.7, 0.7, 0.2).normalize()];
        for u in [0.1, 0.5, 0.7] {
            let ours = terminator_offset(BALL, BALL, u, 0.0, Vec3::Z);
            let theirs = terminator_offset(other, other, 1.0 - u, 0.0, Vec3::new(0.5, 0.5, 0.7).normalize());
            assert!(ours.distance(theirs) < 1e-6, "{u}: {ours} {theirs}");
        }
    }

    proptest! {
        #[test]
        fn never_below_the_triangle(
            n in prop::array::uniform9(-1.0f32..1.0), a in 0.0f32..1.0, b in 0.0f32..1.0,
        ) {
            let corner = |i: usize| unit(n[i], n[i + 1], n[i + 2]).unwrap_or(Vec3::Z);
            let (u, v) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let offset = terminator_offset(BALL, [corner(0), corner(3), corner(6)], u, v, Vec3::Z);
            prop_assert!(offset.z >= 0.0 && offset.is_finite(), "{offset}");
        }
    }
}
