//! Agreement with Embree's robust mode, on more than a million rays a scene.
//!
//! Embree comes through scripts/get-embree. Without it the tests say so in one line and pass, unless
//! `RAYPACK_REQUIRE_EMBREE=1`, as in CI.

#![cfg(feature = "peers")]

#[path = "../benches/scenes/mod.rs"]
mod scenes;

use raypack::geometry::{Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::mesh::generate::shapes;
use raypack::scene::Camera;
use raypack::simd::Isa;
use raypack::study::bench::agreement::same_hit;
use raypack::study::peers::embree::{Build, Coherence, Device, PacketHits, Prepared, Scene as Embree};
use raypack::study::rays::RayKind;
use raypack::traverse::{Accel, Kernel};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Side of the camera's image: camera and random rays alone are then more than 2^20.
const SIZE: u32 = 768;
/// Rays that every kernel and instruction set traces; one kernel traces them all.
const PART: usize = 1 << 15;
/// The share of rays that must agree.
const AGREEING: f64 = 0.9999;

/// The device; `None`, after a line that says so, if Embree may be and is absent.
fn device() -> Option<Arc<Device>> {
    match Device::new(0, None) {
        Ok(device) => Some(device),
        Err(e) if std::env::var_os("RAYPACK_REQUIRE_EMBREE").is_some_and(|v| v == "1") => {
            panic!("RAYPACK_REQUIRE_EMBREE=1, but {e}")
        }
        Err(e) => {
            eprintln!("not compared with Embree: {e}");
            None
        }
    }
}

/// Why two answers to one ray may differ without either being wrong, as far as can be seen from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Cause {
    /// Both hit, and the hits are apart by no more than the rounding of coordinates, because `t` is small.
    Rounding,
    /// The nearer hit, which one engine has and the other has not, lies on an edge or corner of its
    /// triangle: where it is a silhouette, rounding decides.
    Edge,
    /// The nearer hit's triangle is seen so nearly edge-on that rounding decides whether it is met.
    Grazing,
    /// The nearer hit lies at an end of the ray's interval.
    IntervalEnd,
    /// None of these.
    Unexplained,
}

/// What the causes are measured by.
struct Judge<'a> {
    mesh: &'a Mesh,
    /// A few units in the last place of the scene's largest coordinate or extent.
    ulps: f32,
}

impl<'a> Judge<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let bounds = mesh.bounds();
        let reach = bounds.extent().max(bounds.max.abs()).max(bounds.min.abs()).max_element();
        Self { mesh, ulps: 8.0 * f32::EPSILON * reach }
    }

    fn cause(&self, ray: &Ray, ours: &Hit, theirs: &Hit) -> Cause {
        let nearer = if ours.t <= theirs.t { ours } else { theirs };
        let [p0, p1, p2] = self.mesh.corners(nearer.primitive);
        let longest = p0.distance(p1).max(p1.distance(p2)).max(p2.distance(p0));
        let cosine = nearer.normal.normalize_or_zero().dot(ray.direction.normalize()).abs();
        // From the hit to the nearest edge: in weights, and as far as it looks along the ray.
        let inset = nearer.u.min(nearer.v).min(1.0 - nearer.u - nearer.v);
        let seen_inset = inset * nearer.normal.length() / longest * cosine;
        let near = |end: f32| end.is_finite() && (nearer.t - end).abs() <= 1e-4 * end.abs();
        let apart = (ours.t - theirs.t).abs() * ray.direction.length();
        if ours.is_hit() && theirs.is_hit() && apart <= self.ulps {
            Cause::Rounding
        } else if inset < 1e-4 || seen_inset < self.ulps {
            Cause::Edge
        } else if cosine < 1e-3 {
            Cause::Grazing
        } else if near(ray.tnear) || near(ray.tfar) {
            Cause::IntervalEnd
        } else {
            Cause::Unexplained
        }
    }
}

/// Embree's answers, eight rays at a time.
fn embree_hits(scene: &Embree, rays: &[Ray]) -> Vec<Hit> {
    let prepared = Prepared::<8>::new(rays);
    let mut packets = vec![PacketHits::MISS; prepared.packets()];
    scene.closest(&prepared, Coherence::Incoherent, &mut packets);
    (0..rays.len()).map(|i| packets[i / 8].get(i % 8)).collect()
}

/// Rays compared, and those that differ by their cause.
#[derive(Default)]
struct Tally {
    rays: usize,
    causes: BTreeMap<Cause, usize>,
}

impl Tally {
    /// Compares, and lists what differs: all that is unexplained, the rest up to twenty.
    fn compare(&mut self, what: &str, judge: &Judge<'_>, rays: &[Ray], ours: &[Hit], theirs: &[Hit]) {
        let differ = |&i: &usize| !same_hit(&ours[i], &theirs[i]);
        for (listed, i) in (0..rays.len()).filter(differ).enumerate() {
            let cause = judge.cause(&rays[i], &ours[i], &theirs[i]);
            *self.causes.entry(cause).or_default() += 1;
            if listed < 20 || cause == Cause::Unexplained {
                eprintln!(
                    "{what}: {cause:?}\n  {:?}\n  raypack {:?}\n  embree  {:?}",
                    rays[i], ours[i], theirs[i]
                );
            }
        }
        self.rays += rays.len();
    }

    /// Panics when too many differ, or one for no reason.
    fn verdict(&self, what: &str) {
        let differing: usize = self.causes.values().sum();
        eprintln!("{what}: {differing} of {} rays differ {:?}", self.rays, self.causes);
        let allowed = (1.0 - AGREEING) * self.rays as f64;
        assert!((differing as f64) < allowed, "{what}: {differing} of {} rays differ", self.rays);
        assert_eq!(self.causes.get(&Cause::Unexplained), None, "{what}: differences without a reason");
    }
}

/// All rays by one kernel, a part of each kind by every kernel and instruction set.
fn agrees(name: &str) {
    let Some(device) = device() else { return };
    let scene = scenes::generated().into_iter().find(|s| s.name == name).expect("a scene of that name");
    let mut accel = Accel::build(&scene.mesh, &BuildParams::default()).unwrap();
    let embree = Embree::new(&device, &scene.mesh, Build::RobustHigh).unwrap();
    let judge = Judge::new(&scene.mesh);
    let sets = scene.rays(&accel, SIZE);
    let ways = || Isa::available().into_iter().flat_map(|isa| Kernel::ALL.map(|kernel| (isa, kernel)));
    let mut whole = Tally::default();
    let mut parts: Vec<Tally> = ways().map(|_| Tally::default()).collect();
    for kind in [RayKind::Camera, RayKind::Diffuse, RayKind::Random, RayKind::Ao] {
        let rays = sets.rays(kind);
        let theirs = embree_hits(&embree, &rays);
        let mut ours = vec![Hit::MISS; rays.len()];
        accel.set_isa(Isa::detect());
        accel.intersect_many(Kernel::Packet8, &rays, &mut ours);
        whole.compare(&format!("{name}, {}", kind.name()), &judge, &rays, &ours, &theirs);

        let n = rays.len().min(PART);
        for ((isa, kernel), tally) in ways().zip(&mut parts) {
            accel.set_isa(isa);
            accel.intersect_many(kernel, &rays[..n], &mut ours[..n]);
            let what = format!("{name}, {}, {kernel}, {isa}", kind.name());
            tally.compare(&what, &judge, &rays[..n], &ours[..n], &theirs[..n]);
        }
        if kind == RayKind::Ao {
            any_hits_agree(&accel, &embree, &rays, &theirs);
        }
    }
    assert!(whole.rays >= 1 << 20, "{} rays are too few", whole.rays);
    whole.verdict(name);
    ways().zip(&parts).for_each(|((isa, kernel), tally)| tally.verdict(&format!("{name}, {kernel}, {isa}")));
}

/// Any hit is a closest hit that exists, for both.
fn any_hits_agree(accel: &Accel, embree: &Embree, rays: &[Ray], theirs: &[Hit]) {
    let prepared = Prepared::<16>::new(rays);
    let mut packets = vec![0; prepared.packets()];
    embree.any(&prepared, Coherence::Incoherent, &mut packets);
    let mut ours = vec![false; rays.len()];
    accel.occluded_many(Kernel::Packet16, rays, &mut ours);
    let differ =
        |i: &usize| (packets[i / 16] >> (i % 16) & 1 == 1) != ours[*i] && ours[*i] != theirs[*i].is_hit();
    let differing = (0..rays.len()).filter(differ).count();
    assert!(differing as f64 <= (1.0 - AGREEING) * rays.len() as f64, "{differing} any hits differ");
}

#[test]
fn plant_agrees() {
    agrees("plant");
}

#[test]
fn sphere_agrees() {
    agrees("sphere");
}

#[test]
fn voxels_agree() {
    agrees("voxels");
}

#[test]
fn soup_agrees() {
    agrees("soup");
}

/// The whole record, not only `t`: both libraries mean the same by u, v and the normal. Every width, flag
/// and build of Embree goes through its own entry point and layout, so each is looked at.
#[test]
fn every_mode_of_embree_gives_the_same_record() {
    let Some(device) = device() else { return };
    let mesh = shapes::sphere(4);
    let accel = Accel::build(&mesh, &BuildParams::default()).unwrap();
    // 1003 is no multiple of any width: the last packets are partly empty.
    let camera = Camera::framing(&mesh.bounds(), 1.0);
    let scene = scenes::Scene { name: "sphere".into(), mesh, camera };
    let rays = scene.rays(&accel, 64).rays(RayKind::Camera)[..1003].to_vec();
    let mesh = scene.mesh;
    let mut ours = vec![Hit::MISS; rays.len()];
    accel.intersect_many(Kernel::Single, &rays, &mut ours);
    assert!(ours.iter().any(Hit::is_hit) && !ours.iter().all(Hit::is_hit));
    for build in Build::ALL {
        let scene = Embree::new(&device, &mesh, build).unwrap();
        assert!(scene.bytes() > 0 && scene.build_seconds() > 0.0);
        for coherence in Coherence::ALL {
            same_records::<1>(&scene, coherence, &rays, &ours);
            same_records::<4>(&scene, coherence, &rays, &ours);
            same_records::<8>(&scene, coherence, &rays, &ours);
            same_records::<16>(&scene, coherence, &rays, &ours);
        }
    }
}

fn same_records<const N: usize>(scene: &Embree, coherence: Coherence, rays: &[Ray], ours: &[Hit]) {
    let prepared = Prepared::<N>::new(rays);
    let mut hits = vec![PacketHits::MISS; prepared.packets()];
    let mut flags = vec![0; prepared.packets()];
    scene.closest(&prepared, coherence, &mut hits);
    scene.any(&prepared, coherence, &mut flags);
    let mode = format!("{N}-wide {} {}", coherence.name(), scene.build().name());
    let mut different_triangles = 0;
    for (i, ours) in ours.iter().enumerate() {
        let theirs = hits[i / N].get(i % N);
        assert_eq!(ours.is_hit(), flags[i / N] >> (i % N) & 1 == 1, "{mode}, ray {i}");
        assert!(same_hit(ours, &theirs), "{mode}, ray {i}: {ours:?}, {theirs:?}");
        if ours.primitive != theirs.primitive {
            different_triangles += 1; // On an edge that they share.
        } else if ours.is_hit() {
            let apart = (ours.u - theirs.u).abs().max((ours.v - theirs.v).abs());
            assert!(apart < 1e-3, "{mode}, ray {i}: {ours:?}, {theirs:?}");
            let length = ours.normal.length();
            assert!(
                (ours.normal - theirs.normal).length() < 1e-4 * length,
                "{mode}, ray {i}: {ours:?}, {theirs:?}"
            );
        }
    }
    assert!(different_triangles < 5, "{mode}: {different_triangles} rays hit another triangle");
}

#[test]
fn the_version_is_four_and_its_memory_is_given_back() {
    let Some(device) = device() else { return };
    assert_eq!(device.version().major, 4);
    let before = device.bytes();
    let scene = Embree::new(&device, &shapes::soup(1000, 1), Build::High).unwrap();
    assert!(device.bytes() > before);
    assert_eq!(device.bytes() - before, scene.bytes() as i64);
    drop(scene);
    assert_eq!(device.bytes(), before);
}

#[test]
fn a_mesh_without_triangles_is_an_error() {
    let Some(device) = device() else { return };
    let error = Embree::new(&device, &Mesh::default(), Build::High).unwrap_err();
    assert!(error.to_string().contains("no triangles"), "{error}");
}
