//! Rays aimed at the corners and edges of closed surfaces.

use crate::meshes::Closed;
use crate::numbers::Numbers;
use raypack::Vec3;
use raypack::geometry::Ray;

/// A ray at a corner or an edge, which a closed surface cannot let pass: it starts inside, or it comes
/// from outside and is on its way through a point deep inside.
pub fn at_seams(closed: &Closed, numbers: &mut Numbers) -> Ray {
    let inside = closed.inside(numbers);
    let triangle = numbers.pick(&closed.mesh.triangles);
    let first = numbers.below(3);
    let [a, b] = [first, (first + 1) % 3].map(|k| closed.mesh.positions[triangle[k] as usize]);
    let on_edge = a + (b - a) * numbers.unit();
    match numbers.below(6) {
        0 => Ray::new(inside, a - inside),
        1 => Ray::new(inside, on_edge - inside),
        2 => from_outside(inside, a, numbers),
        3 => from_outside(inside, on_edge, numbers),
        // Along the edge, at a distance from it.
        4 if a != b => Ray::new(inside, b - a),
        // In the plane of an axis and a corner.
        _ => {
            let mut direction = a - inside;
            direction[numbers.below(3)] = 0.0;
            Ray::new(inside, if direction == Vec3::ZERO { Vec3::X } else { direction })
        }
    }
}

/// A ray from beyond a point of the surface, through it and on to a point inside.
fn from_outside(inside: Vec3, target: Vec3, numbers: &mut Numbers) -> Ray {
    let origin = target + (target - inside) * (0.3 + 3.0 * numbers.unit());
    Ray::new(origin, target - origin)
}
