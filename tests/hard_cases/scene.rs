//! A scene under trial: what is checked of every ray, whatever the case.

use crate::brute;
use crate::numbers::Numbers;
use rayon::prelude::*;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::simd::Isa;
use raypack::traverse::{Accel, Kernel};

/// The modes in which closed surfaces are closed.
pub const CLOSED: [Accuracy; 2] = [Accuracy::Watertight, Accuracy::Exact];

/// Rays times triangles up to which a brute force is run too.
const BRUTE: usize = 2_000_000;

/// Larger meshes' trees are not validated: their builder is the same.
const VALIDATED: usize = 4_000;

/// The places of the fine tree among a scene's trees, and of the same with pools.
const FINE: usize = 1;
const POOLED: usize = 2;

/// A mesh and its trees.
pub struct Scene {
    pub name: String,
    pub seed: u64,
    pub mesh: Mesh,
    trees: [Accel; 3],
}

/// Hits of each mode, in the order of `Accuracy::ALL`.
pub struct Answers(Vec<Vec<Hit>>);

impl Answers {
    /// The hits of a mode, in the rays' order.
    pub fn of(&self, accuracy: Accuracy) -> &[Hit] {
        &self.0[accuracy as usize]
    }
}

/// Which way of tracing gave an answer.
#[derive(Clone, Copy)]
struct Way {
    accuracy: Accuracy,
    kernel: Kernel,
    isa: Isa,
    what: &'static str,
}

impl Scene {
    /// Builds three trees: as a user would, and with as many planes and as small leaves as it will
    /// give, which has the most ways to lose a hit; that one with pools, too.
    pub fn new(name: impl Into<String>, seed: u64, mesh: Mesh) -> Self {
        let name = name.into();
        let fine = BuildParams { traversal_cost: 0.1, min_leaf: 1, exact_below: 64, ..Default::default() };
        let trees = [BuildParams::default(), fine.clone(), fine].map(|params| {
            let accel = Accel::build(&mesh, &params)
                .unwrap_or_else(|error| panic!("{name}, RAYPACK_SEED={seed}: {error}"));
            if mesh.triangles.len() <= VALIDATED {
                let fault = accel.tree().validate().err();
                assert_eq!(fault, None, "{name}, RAYPACK_SEED={seed}");
            }
            accel
        });
        trees[POOLED].make_pools().unwrap_or_else(|error| panic!("{name}, RAYPACK_SEED={seed}: {error}"));
        Self { name, seed, mesh, trees }
    }

    /// Traces rays in every way and gives the hits of each mode.
    ///
    /// Panics, with all that is needed to run it again, if two ways disagree about a ray, if any-hit
    /// disagrees with closest-hit, if an interval of a hit's `t` alone loses the hit, or if a brute
    /// force with the same test gives something else.
    pub fn trace(&mut self, rays: &[Ray]) -> Answers {
        let answers = Accuracy::ALL.map(|accuracy| {
            let expected = self.reference(accuracy, rays);
            self.agree(accuracy, rays, &expected);
            expected
        });
        Answers(answers.into())
    }

    /// Traces rays and panics if `fault` finds one with a hit.
    pub fn check(&mut self, rays: &[Ray], fault: impl Fn(Accuracy, usize, &Hit) -> Option<String>) {
        let answers = self.trace(rays);
        for accuracy in Accuracy::ALL {
            for (i, hit) in answers.of(accuracy).iter().enumerate() {
                if let Some(fault) = fault(accuracy, i, hit) {
                    self.blame(accuracy, &rays[i], &format!("{fault}: {hit:?}"));
                }
            }
        }
    }

    /// Traces rays and panics if one of them hits nothing in a mode that has no gaps.
    pub fn check_closed(&mut self, rays: &[Ray]) {
        self.check(rays, |accuracy, _, hit| {
            (CLOSED.contains(&accuracy) && !hit.is_hit()).then(|| "a closed surface is missed".into())
        });
    }

    /// Fails for a ray.
    pub fn blame(&self, accuracy: Accuracy, ray: &Ray, fault: &str) -> ! {
        panic!("{}, {accuracy}, RAYPACK_SEED={}: {} : {fault}", self.name, self.seed, show(ray))
    }

    /// The hits that all ways are compared with: by brute force, or from the plainest kernel.
    fn reference(&mut self, accuracy: Accuracy, rays: &[Ray]) -> Vec<Hit> {
        if rays.len() * self.mesh.triangles.len() <= BRUTE && self.is_ordinary(rays) {
            rays.par_iter().map(|ray| brute::same_test(&self.mesh, ray, accuracy)).collect()
        } else {
            let accel = &mut self.trees[0];
            accel.set_accuracy(accuracy);
            accel.set_isa(Isa::Portable);
            rays.par_iter().map(|ray| accel.intersect(ray)).collect()
        }
    }

    /// Whether the triangle tests can take the numbers as they are. Near the ends of the floats' range
    /// a kernel scales them first, which a brute force with the bare test does not do.
    fn is_ordinary(&self, rays: &[Ray]) -> bool {
        let scale = |v: Vec3| v.abs().max_element();
        let widest = self.mesh.positions.iter().map(|&p| scale(p)).fold(0.0, f32::max);
        let ordinary = |ray: &Ray| (1e-9..1e9).contains(&scale(ray.direction)) && scale(ray.origin) < 1e12;
        (1e-9..1e12).contains(&widest) && rays.iter().all(ordinary)
    }

    fn agree(&mut self, accuracy: Accuracy, rays: &[Ray], expected: &[Hit]) {
        let mut order: Vec<usize> = (0..rays.len()).collect();
        Numbers::new(self.seed, 99).shuffle(&mut order);
        let mixed: Vec<Ray> = order.iter().map(|&i| rays[i]).collect();
        let mixed_expected: Vec<Hit> = order.iter().map(|&i| expected[i]).collect();
        let ordinary = self.is_ordinary(rays);
        let pin = |(ray, hit)| pinned(ray, hit, ordinary);
        let pinned: Vec<Ray> = mixed.iter().zip(&mixed_expected).map(pin).collect();

        for tree in 0..self.trees.len() {
            self.trees[tree].set_accuracy(accuracy);
            for isa in Isa::available() {
                self.trees[tree].set_isa(isa);
                for kernel in kernels_of(tree, accuracy) {
                    let way = Way { accuracy, kernel, isa, what: "the rays" };
                    self.compare(tree, way, rays, expected);
                    // The fine tree has the most ways to go wrong.
                    if tree == FINE || tree == POOLED {
                        self.compare(tree, Way { what: "shuffled", ..way }, &mixed, &mixed_expected);
                        self.compare(tree, Way { what: "from t to t", ..way }, &pinned, &mixed_expected);
                    }
                }
            }
        }
    }

    fn compare(&self, tree: usize, way: Way, rays: &[Ray], expected: &[Hit]) {
        let hits = closest(&self.trees[tree], way.kernel, rays);
        let occluded = any(&self.trees[tree], way.kernel, rays);
        for (i, ray) in rays.iter().enumerate() {
            if bits(&hits[i]) != bits(&expected[i]) || occluded[i] != expected[i].is_hit() {
                panic!(
                    "{}, {}, {} on {}, {}, {} tree, RAYPACK_SEED={}:\n  {}\n  gives {:?}, occluded: {}\n  instead of {:?}",
                    self.name,
                    way.accuracy,
                    way.kernel,
                    way.isa,
                    way.what,
                    ["default", "fine", "pooled"][tree],
                    self.seed,
                    show(ray),
                    hits[i],
                    occluded[i],
                    expected[i]
                );
            }
        }
    }
}

/// The kernels that trace through a tree as through no other.
fn kernels_of(tree: usize, accuracy: Accuracy) -> Vec<Kernel> {
    match (tree, accuracy) {
        (POOLED, Accuracy::Fast) => vec![],
        (POOLED, _) => vec![Kernel::Single, Kernel::Stream, Kernel::Filter],
        _ => Kernel::ALL.into(),
    }
}

/// Rays that go to one task: whole packets.
const TASK: usize = 512;

/// Closest hits by a kernel, on all cores.
pub fn closest(accel: &Accel, kernel: Kernel, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    hits.par_chunks_mut(TASK)
        .zip(rays.par_chunks(TASK))
        .for_each(|(hits, rays)| accel.intersect_many(kernel, rays, hits));
    hits
}

/// Any-hits by a kernel, on all cores.
fn any(accel: &Accel, kernel: Kernel, rays: &[Ray]) -> Vec<bool> {
    let mut occluded = vec![false; rays.len()];
    occluded
        .par_chunks_mut(TASK)
        .zip(rays.par_chunks(TASK))
        .for_each(|(occluded, rays)| accel.occluded_many(kernel, rays, occluded));
    occluded
}

/// The same ray with nothing but its hit's `t` in its interval. A `t` that is denormal, or was rounded
/// to the least that is not, lost bits when it was given out; so may have a zero where numbers are not
/// ordinary.
fn pinned(ray: &Ray, hit: &Hit, ordinary: bool) -> Ray {
    if hit.is_hit() && (hit.t > f32::MIN_POSITIVE || (hit.t == 0.0 && ordinary)) {
        Ray { tnear: hit.t, tfar: hit.t, ..*ray }
    } else {
        *ray
    }
}

/// A hit as bits, so that equality means identity.
pub fn bits(hit: &Hit) -> [u32; 7] {
    let n = hit.normal.to_array().map(f32::to_bits);
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive, n[0], n[1], n[2]]
}

/// A ray with the bits of its numbers.
pub fn show(ray: &Ray) -> String {
    let bits: &[u32] = &[
        ray.origin.to_array().map(f32::to_bits).as_slice(),
        &[ray.tnear.to_bits()],
        ray.direction.to_array().map(f32::to_bits).as_slice(),
        &[ray.tfar.to_bits()],
    ]
    .concat();
    format!("{ray:?} (bits {bits:08x?})")
}
