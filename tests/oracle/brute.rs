//! Tracing without a tree.

use glam::DVec3;
use raypack::geometry::triangle::fast::Projected;
use raypack::geometry::triangle::{Exact, Fast, Mode, Test, Triangle, Watertight, normal};
use raypack::geometry::{Aabb, Accuracy, Hit, NO_PRIMITIVE, Ray};
use raypack::mesh::Mesh;

/// The closest hit by the library's own triangle test, lowest id first among equals.
pub fn same_test(mesh: &Mesh, ray: &Ray, accuracy: Accuracy) -> Hit {
    match accuracy {
        Accuracy::Fast => by_test::<Fast>(mesh, ray, Projected::new),
        Accuracy::Watertight => by_test::<Watertight>(mesh, ray, |&corners| Triangle::new(corners)),
        Accuracy::Exact => by_test::<Exact>(mesh, ray, |&corners| Triangle::new(corners)),
    }
}

fn by_test<M: Mode>(mesh: &Mesh, ray: &Ray, record: impl Fn(&[[f32; 3]; 3]) -> M::Record) -> Hit {
    let test = M::Test::<1, f32>::new(&ray.origin.to_array(), &ray.direction.to_array(), 1);
    let mut best = Hit::MISS;
    for primitive in 0..mesh.triangles.len() as u32 {
        let corners = mesh.corners(primitive).map(|corner| corner.to_array());
        let record = record(&corners);
        let found = test.test(&record, true);
        if found.inside && found.t >= ray.tnear && found.t <= ray.tfar && found.t < best.t {
            let [u, v] = M::Test::<1, f32>::weights(&record, found.u, found.v);
            // As the kernels do: a zero is given out without a sign.
            let (t, u, v) = (found.t + 0.0, u + 0.0, v + 0.0);
            best = Hit { t, u, v, primitive, normal: normal(&corners) };
        }
    }
    // A zero is given out without a sign.
    (best.t, best.u, best.v) = (best.t + 0.0, best.u + 0.0, best.v + 0.0);
    best
}

/// What double precision says of a hit.
pub enum Verdict {
    /// It is right.
    Right,
    /// The ray passes an edge, or the end of its interval, within the rounding of single precision.
    Unsure,
    /// It is wrong.
    Wrong(String),
}

/// A mesh in double precision.
pub struct Double {
    triangles: Vec<[DVec3; 3]>,
    bounds: Aabb,
}

/// How far beyond an edge, relative to the distance of the farthest corner, single precision may
/// still see a hit: some ulps for rounded differences of coordinates.
const EDGE: f64 = 4e-6;

/// Relative error of `t` that single precision may make.
const T: f64 = 1e-4;

impl Double {
    pub fn new(mesh: &Mesh) -> Self {
        let triangles =
            (0..mesh.triangles.len() as u32).map(|i| mesh.corners(i).map(|c| c.as_dvec3())).collect();
        Self { triangles, bounds: mesh.bounds() }
    }

    /// Where the ray's line meets a triangle's plane, and by how much it is inside, as a distance
    /// (negative: outside). `None` if they are parallel, as far as can be said.
    fn meet(&self, ray: &Ray, primitive: usize) -> Option<(f64, f64)> {
        let [p0, p1, p2] = self.triangles[primitive];
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let n = (p1 - p0).cross(p2 - p0);
        // Seen at less than about a hundredth of a degree, or hardly a triangle: no verdict.
        let longest = (p1 - p0).length().max((p2 - p0).length()).max((p2 - p1).length());
        if n.length() < 1e-6 * longest * longest || n.dot(d).abs() < 2e-4 * n.length() * d.length() {
            return None;
        }
        let t = n.dot(p0 - o) / n.dot(d);
        let p = o + d * t;
        let inside = |a: DVec3, b: DVec3| n.dot((b - a).cross(p - a)) / (n.length() * (b - a).length());
        Some((t, inside(p0, p1).min(inside(p1, p2)).min(inside(p2, p0))))
    }

    /// Judges the closest hit that a kernel gave.
    pub fn judge(&self, ray: &Ray, hit: &Hit) -> Verdict {
        let (origin, bounds) = (ray.origin, &self.bounds);
        let reach = (bounds.min - origin).abs().max((bounds.max - origin).abs()).max_element();
        let margin = EDGE * f64::from(reach);
        let (tnear, tfar) = (f64::from(ray.tnear), f64::from(ray.tfar));
        let slack = |t: f64| T * t.abs() + margin / f64::from(ray.direction.length());
        let mut unsure = false;

        // What was hit must be there.
        if hit.primitive != NO_PRIMITIVE {
            match self.meet(ray, hit.primitive as usize) {
                None => unsure = true,
                Some((t, inside)) => {
                    if inside < -20.0 * margin {
                        return Verdict::Wrong(format!("the ray passes the triangle {inside} outside"));
                    }
                    unsure |= inside < margin;
                    let steep = self.steepness(ray, hit.primitive as usize);
                    let allowed = slack(t) * steep + self.smear(ray, hit.primitive as usize, margin);
                    if (t - f64::from(hit.t)).abs() > allowed {
                        return Verdict::Wrong(format!("t should be {t}"));
                    }
                }
            }
        }

        // Nothing that is surely there may lie in front of it.
        for primitive in 0..self.triangles.len() {
            let Some((t, inside)) = self.meet(ray, primitive) else { continue };
            let steep = self.steepness(ray, primitive);
            let allowed = slack(t) * steep + self.smear(ray, primitive, margin);
            let before = if hit.is_hit() { f64::from(hit.t) } else { tfar } - allowed;
            let sure = inside > margin * steep;
            if t > tnear + allowed && t < before {
                if sure {
                    return Verdict::Wrong(format!("triangle {primitive} lies before it, at {t}"));
                }
                unsure |= inside > -margin * steep;
            }
        }
        if unsure { Verdict::Unsure } else { Verdict::Right }
    }

    /// How far `t` may be off because the barycentric weights are: a hit's `t` is the corners'
    /// depths, weighted, and the weights of a sliver are as uncertain as its width is small.
    fn smear(&self, ray: &Ray, primitive: usize, margin: f64) -> f64 {
        let corners = self.triangles[primitive];
        let [p0, p1, p2] = corners;
        let d = ray.direction.as_dvec3();
        let depths = corners.map(|p| (p - ray.origin.as_dvec3()).dot(d) / d.length_squared());
        let extent = depths.iter().fold(0f64, |m, a| depths.iter().fold(m, |m, b| m.max(a - b)));
        let longest = (p1 - p0).length().max((p2 - p0).length()).max((p2 - p1).length());
        let height = (p1 - p0).cross(p2 - p0).length() / longest;
        extent * (margin / height).min(1.0)
    }

    /// By how much an error across the ray is magnified along it: 1 for a triangle seen squarely.
    fn steepness(&self, ray: &Ray, primitive: usize) -> f64 {
        let [p0, p1, p2] = self.triangles[primitive];
        let (n, d) = ((p1 - p0).cross(p2 - p0), ray.direction.as_dvec3());
        n.length() * d.length() / n.dot(d).abs()
    }
}
