//! Where a secondary ray starts, so that it does not hit the surface that it leaves.
//!
//! A hit point is rounded, so it lies a little before or behind its triangle, and a ray that
//! starts there may hit that triangle again. Wächter & Binder ("A Fast and Robust Method for
//! Avoiding Self-Intersection", Ray Tracing Gems, 2019, chapter 6) compute the point from the
//! barycentrics, where its error is a few ulps, and move it along the geometric normal by a
//! multiple of that error. So do we; but where they count ulps of each coordinate of the point,
//! and go over to a fixed length near the coordinate planes (which ties the method to scenes of
//! metres), we count ulps of the triangle's greatest coordinate and of its extent. Those bound the errors
//! of the point and of the intersection test, and have no scale built in.

use crate::geometry::triangle::Corners;
use glam::Vec3;

/// The step in units of the triangle's greatest coordinate: 24 roundings of 2^-24.
///
/// The point is off by some 3 roundings, and by one more once it has moved; a plane through it is
/// computed to some 4 roundings of the distance to its corners, which is at most twice the greatest
/// coordinate.
const PLACE: f32 = 24.0 / (1 << 24) as f32;

/// The step in units of the triangle's extent: the test is off by up to 32 roundings of the distance
/// to its corners.
const EXTENT: f32 = 104.0 / (1 << 24) as f32;

/// The point of a triangle with the barycentric weights `u` (of the second corner) and `v` (of
/// the third), moved off the surface along the unit vector `normal`.
///
/// The result is the same for either direction in which a ray came; `normal` says which side is
/// meant. It moves by no more than `2^-16` of the greatest coordinate of the triangle and of its
/// extent, whichever is more.
///
/// Where two surfaces meet at less than a right angle, a point that is about that near to their edge
/// may come out behind the other one: no step along one normal can help that.
#[inline(always)]
pub fn offset_point([p0, p1, p2]: &Corners, u: f32, v: f32, normal: Vec3) -> Vec3 {
    let [p0, p1, p2] = [*p0, *p1, *p2].map(Vec3::from_array);
    // Along the edges, so that a small triangle far away is rounded once only.
    let (e1, e2) = (p1 - p0, p2 - p0);
    let point = p0 + (e1 * u + e2 * v);
    let greatest = p0.abs().max(p1.abs()).max(p2.abs()).max_element();
    let extent = e1.abs().max(e2.abs()).max_element();
    point + normal * (greatest * PLACE + extent * EXTENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Ray;
    use crate::geometry::triangle;
    use crate::kdtree::BuildParams;
    use crate::mesh::{Colors, Mesh};
    use crate::traverse::Accel;

    fn accel(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> (Accel, Mesh) {
        let mesh = Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() };
        (Accel::build(&mesh, &BuildParams::default()).expect("builds"), mesh)
    }

    /// A ball of `n` x `2n` patches.
    fn ball(n: u32, radius: f32, center: Vec3) -> (Accel, Mesh) {
        let columns = 2 * n;
        let mut positions = Vec::new();
        for row in 0..=n {
            for column in 0..columns {
                let (theta, phi) = (
                    std::f32::consts::PI * row as f32 / n as f32,
                    std::f32::consts::TAU * column as f32 / columns as f32,
                );
                let direction = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                positions.push(center + direction * radius);
            }
        }
        let mut triangles = Vec::new();
        for row in 0..n {
            for column in 0..columns {
                let at = |r, c| r * columns + c % columns;
                let [a, b] = [at(row, column), at(row, column + 1)];
                let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        accel(positions, triangles)
    }

    /// Low-discrepancy directions.
    fn directions(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(move |i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let phi = i as f32 * 2.399_963_2;
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * phi.cos(), z, r * phi.sin())
        })
    }

    /// From each hit of rays at the middle, how many rays outward hit something again.
    fn shadowed(accel: &Accel, mesh: &Mesh, eye: Vec3, target: Vec3, outward: impl Fn(Vec3) -> Vec3) -> u32 {
        let mut wrong = 0;
        for aim in directions(400) {
            let ray = Ray::new(eye, target - eye + aim);
            let hit = accel.intersect(&ray);
            if !hit.is_hit() {
                continue;
            }
            let corners = mesh.corners(hit.primitive).map(|p| p.to_array());
            let mut normal = triangle::normal(&corners).normalize_or_zero();
            if normal.dot(ray.direction) > 0.0 {
                normal = -normal;
            }
            let origin = offset_point(&corners, hit.u, hit.v, normal);
            let way = outward(normal);
            for grazing in [0.0, 0.9, 0.999, 0.999_99] {
                let direction = normal * (1.0 - grazing) + way * grazing;
                wrong += u32::from(accel.occluded(&Ray::new(origin, direction)));
            }
        }
        wrong
    }

    #[test]
    fn a_ball_does_not_shadow_itself_at_any_scale() {
        for scale in [1e-3, 1.0, 1e3, 1e6] {
            for center in [Vec3::ZERO, Vec3::new(3.0, -7.0, 1.0)] {
                let center = center * scale;
                let (accel, mesh) = ball(24, scale, center);
                let eye = center + Vec3::new(2.0, 1.5, 1.0) * scale;
                let aims = |normal: Vec3| normal.any_orthonormal_vector();
                let mut wrong = 0;
                for aim in directions(50) {
                    wrong += shadowed(&accel, &mesh, eye, center + aim * (scale * 0.5), aims);
                }
                assert_eq!(wrong, 0, "scale {scale}, center {center}");
            }
        }
    }

    #[test]
    fn a_plane_does_not_shadow_itself_at_any_scale() {
        // A tilted floor of large triangles that passes by the coordinate planes.
        for scale in [1e-3, 1.0, 1e3, 1e6] {
            let across = Vec3::new(1.0, 0.31, 0.17) * scale;
            let along = Vec3::new(-0.29, 0.13, 1.0) * scale;
            let corner = -(across + along) * 0.437;
            let (accel, mesh) = accel(
                vec![corner, corner + across, corner + across + along, corner + along],
                vec![[0, 1, 2], [0, 2, 3]],
            );
            let normal = across.cross(along).normalize();
            let eye = normal * (scale * 0.8);
            let mut wrong = 0;
            for aim in directions(200) {
                let target = across * (aim.x * 0.4) + along * (aim.z * 0.4);
                wrong += shadowed(&accel, &mesh, eye, target, |n| n.any_orthonormal_vector());
            }
            assert_eq!(wrong, 0, "scale {scale}");
        }
    }

    #[test]
    fn without_the_offset_the_test_would_fail() {
        let scale = 1.0;
        let (accel, mesh) = ball(24, scale, Vec3::ZERO);
        let mut wrong = 0;
        for aim in directions(500) {
            let ray = Ray::new(aim * 3.0, -aim * 1.1 + Vec3::new(0.1, 0.2, 0.3));
            let hit = accel.intersect(&ray);
            if hit.is_hit() {
                let corners = mesh.corners(hit.primitive).map(|p| p.to_array());
                let mut normal = triangle::normal(&corners).normalize_or_zero();
                if normal.dot(ray.direction) > 0.0 {
                    normal = -normal;
                }
                wrong += u32::from(accel.occluded(&Ray::new(ray.at(hit.t), normal)));
            }
        }
        assert!(wrong > 0);
    }

    #[test]
    fn the_step_is_small() {
        let corners = [[1.0, 2.0, 3.0], [1.0, 2.0, 8.0], [5.0, -2.0, 3.0]];
        let normal = triangle::normal(&corners).normalize();
        let on = offset_point(&corners, 0.25, 0.25, Vec3::ZERO);
        let off = offset_point(&corners, 0.25, 0.25, normal);
        let step = (off - on).length();
        assert!(step > 0.0 && step < 8.0 / 65536.0, "{step}");
    }
}
