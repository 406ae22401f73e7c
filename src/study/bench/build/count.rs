//! What rays do in a tree, counted: the measured side of what the SAH expects.

use crate::geometry::{Hit, Ray};
use crate::kdtree::Tree;
use crate::traverse::{Accel, Kernel};
use rayon::prelude::*;
use serde::Serialize;

/// What a ray does in a tree on average, one ray at a time, front to back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Counts {
    /// Inner nodes.
    pub steps: f64,
    /// Leaves, empty ones among them.
    pub leaves: f64,
    /// Triangles of these leaves, as often as a ray meets them.
    pub tests: f64,
}

/// Walks every ray through the tree, as far as its closest hit. A ray that asks for any hit could end
/// earlier only inside of a leaf.
pub fn count(accel: &Accel, rays: &[Ray]) -> Counts {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.intersect_many(Kernel::Packet8, rays, &mut hits);
    let zero = || [0u64; 3];
    let add = |a: [u64; 3], b: [u64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let walked = |(ray, hit): (&Ray, &Hit)| walk(accel, ray, if hit.is_hit() { hit.t } else { ray.tfar });
    let sum = rays.par_iter().zip(&hits).map(walked).reduce(zero, add);
    let [steps, leaves, tests] = sum.map(|number| number as f64 / rays.len().max(1) as f64);
    Counts { steps, leaves, tests }
}

/// Inner nodes, leaves and triangles on the way of a ray up to `end`.
pub fn walk(accel: &Accel, ray: &Ray, end: f32) -> [u64; 3] {
    let tree = accel.tree();
    let [origin, direction] = [ray.origin, ray.direction].map(|v| v.as_dvec3() * tree.scale().factor());
    let bounds = tree.bounds();
    let (mut near, mut far) = (f64::from(ray.tnear), f64::from(end));
    for axis in 0..3 {
        let (low, high) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
        let (o, d) = (origin[axis], direction[axis]);
        if d == 0.0 {
            if o < low || o > high {
                return [0; 3];
            }
            continue;
        }
        let (a, b) = ((low - o) / d, (high - o) / d);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    let [mut steps, mut leaves, mut tests] = [0; 3];
    if near > far {
        return [0; 3];
    }
    let mut stack = vec![(tree.root(), near, far)];
    while let Some((node, near, far)) = stack.pop() {
        if node.is_leaf() {
            leaves += 1;
            tests += tree.primitives(node).len() as u64;
            continue;
        }
        steps += 1;
        let axis = node.axis();
        let (o, d, plane) = (origin[axis], direction[axis], f64::from(node.split()));
        let children = tree.children(node);
        // From a point in the plane the ray goes to one side only, the one that it looks at.
        let first = usize::from(if o == plane { d > 0.0 } else { o > plane });
        let crossing = if d == 0.0 { f64::INFINITY } else { (plane - o) / d };
        if crossing <= 0.0 || crossing > far {
            stack.push((children[first], near, far));
        } else if crossing < near {
            stack.push((children[1 - first], near, far));
        } else {
            stack.push((children[1 - first], crossing, far));
            stack.push((children[first], near, crossing));
        }
    }
    [steps, leaves, tests]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use crate::scene::Camera;
    use crate::study::rays::{RayKind, RaySets, Setup};

    #[test]
    fn random_rays_do_what_the_sah_expects() {
        // Triangles so few and small that hardly any ray ends early: then measured is expected, but for
        // rays that begin inside of the box, which see about half of it.
        let mesh = shapes::soup(300, 1);
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let bounds = mesh.bounds();
        let camera = Camera::framing(&bounds, 1.0);
        let sets = RaySets::new(Setup::new(camera, 96, bounds, 1), &mesh, |rays| vec![Hit::MISS; rays.len()]);
        let counts = count(&accel, &sets.rays(RayKind::Random));
        let stats = accel.stats();
        for (measured, expected) in [
            (counts.steps, stats.expected_steps),
            (counts.leaves, stats.expected_leaves),
            (counts.tests, stats.expected_tests),
        ] {
            assert!(measured > 0.2 * expected && measured < 1.0 * expected, "{counts:?}, {stats:?}");
        }
        // In a binary tree a ray meets one leaf more than it meets nodes with both children before it.
        assert!(counts.leaves <= counts.steps + 1.0);
    }

    #[test]
    fn a_ray_that_misses_the_box_does_nothing() {
        let mesh = shapes::soup(300, 1);
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let beyond = mesh.bounds().max + 1.0;
        let ray = Ray::new(beyond, glam::Vec3::ONE);
        assert_eq!(count(&accel, &[ray]), Counts::default());
    }
}
