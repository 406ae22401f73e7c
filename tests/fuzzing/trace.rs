//! Any triangles, any rays: a clean error, or a whole tree over which all kernels agree.

use raypack::Vec3;
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::simd::Isa;
use raypack::traverse::{Accel, Kernel};

/// Builds a tree of the triangles that `bytes` describe, and traces the rays that they describe.
///
/// | bytes | |
/// |---|---|
/// | 1 | how coordinates are written: see [`Bytes::coordinate`] |
/// | 1, 1, 1 | how many vertices, triangles and rays |
/// | 3 a vertex | coordinates |
/// | 3 bytes a triangle | indices |
/// | 8 a ray | numbers as coordinates |
pub fn build_and_trace(bytes: &[u8]) {
    let mut bytes = Bytes { rest: bytes, style: 0 };
    bytes.style = bytes.byte();
    let [vertices, triangles, rays] = [bytes.byte(), bytes.byte(), bytes.byte()].map(usize::from);
    // Miri takes a minute for what takes a hundredth of a second.
    let most = if cfg!(miri) { [12, 12, 6] } else { [48, 64, 40] };
    let (vertices, triangles, rays) = (vertices % most[0] + 3, triangles % most[1], rays % most[2]);
    let positions: Vec<Vec3> = (0..vertices).map(|_| bytes.vector()).collect();
    // Wild indices now and then, so that most meshes get as far as the builder.
    let index = |byte: u8| if byte == 255 { u32::MAX } else { u32::from(byte) % vertices as u32 };
    let triangles = (0..triangles).map(|_| [index(bytes.byte()), index(bytes.byte()), index(bytes.byte())]);
    let mesh = Mesh { triangles: triangles.collect(), positions, ..Mesh::default() };

    let params = BuildParams {
        min_leaf: 1,
        exact_below: if mesh.triangles.len().is_multiple_of(2) { 1 } else { 1024 },
        ..Default::default()
    };
    let Ok(accel) = Accel::build(&mesh, &params) else { return };
    accel.tree().validate().expect("the tree is whole");
    // All triangles in one leaf: nothing there is left out.
    let one_leaf = BuildParams { min_leaf: 1 << 20, ..Default::default() };
    let all = Accel::build(&mesh, &one_leaf).expect("as before");
    let pooled = Accel::build(&mesh, &params).expect("as before");
    pooled.make_pools().expect("there are not too many leaves");
    let rays: Vec<Ray> = (0..rays).map(|_| bytes.ray(&mesh)).collect();
    compare(accel, all, pooled, &rays);
}

/// Compares every instruction set, accuracy and kernel with single rays in the plainest instruction set: portable SIMD
/// but in a fuzzer's build, which has no other than the best.
fn compare(mut accel: Accel, mut all: Accel, mut pooled: Accel, rays: &[Ray]) {
    for accuracy in Accuracy::ALL {
        accel.set_accuracy(accuracy);
        pooled.set_accuracy(accuracy);
        accel.set_isa(Isa::available()[0]);
        let expected: Vec<Hit> = rays.iter().map(|ray| accel.intersect(ray)).collect();
        for isa in Isa::available() {
            accel.set_isa(isa);
            pooled.set_isa(isa);
            let ways = Kernel::ALL.iter().map(|&kernel| (kernel, &accel, ""));
            // Those that go through pools, in modes that have them.
            let through_pools = [Kernel::Single, Kernel::Stream, Kernel::Filter];
            let has_pools = accuracy != Accuracy::Fast;
            let with_pools =
                through_pools.iter().filter(|_| has_pools).map(|&kernel| (kernel, &pooled, " with pools"));
            for (kernel, accel, with) in ways.chain(with_pools) {
                let mut hits = vec![Hit::MISS; rays.len()];
                accel.intersect_many(kernel, rays, &mut hits);
                let mut occluded = vec![false; rays.len()];
                accel.occluded_many(kernel, rays, &mut occluded);
                for (i, ray) in rays.iter().enumerate() {
                    let at = || format!("{accuracy}, {kernel}{with} on {isa}, ray {i}: {ray:?}");
                    assert_eq!(
                        bits(&hits[i]),
                        bits(&expected[i]),
                        "{}\n{:?} {:?}",
                        at(),
                        hits[i],
                        expected[i]
                    );
                    assert_eq!(occluded[i], expected[i].is_hit(), "any hit, {}", at());
                }
            }
        }
        // The fast test's error is not bounded, so a cell may lie beside a hit that it would find.
        if accuracy != Accuracy::Fast {
            all.set_accuracy(accuracy);
            for (i, ray) in rays.iter().enumerate() {
                let hit = all.intersect(ray);
                assert_eq!(
                    bits(&hit),
                    bits(&expected[i]),
                    "{accuracy}, one leaf, ray {i}: {ray:?}\n{hit:?} {:?}",
                    expected[i]
                );
            }
        }
        for (ray, hit) in rays.iter().zip(&expected).filter(|(_, hit)| hit.is_hit()) {
            assert!(
                ray.tnear <= hit.t && hit.t <= ray.tfar && hit.t.is_finite(),
                "{accuracy}: {ray:?} {hit:?}"
            );
        }
    }
}

fn bits(hit: &Hit) -> [u32; 7] {
    let [x, y, z] = hit.normal.to_array();
    let [t, u, v, x, y, z] = [hit.t, hit.u, hit.v, x, y, z].map(f32::to_bits);
    [t, u, v, hit.primitive, x, y, z]
}

/// Bytes that run out into zeros.
struct Bytes<'a> {
    rest: &'a [u8],
    style: u8,
}

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        self.rest.split_off_first().copied().unwrap_or(0)
    }

    /// A number, by the style: the bits of any float; small whole numbers, for ties; halves around 1000;
    /// a sign, a power of two and three bits of fraction.
    fn coordinate(&mut self) -> f32 {
        let byte = |bytes: &mut Self| f32::from(bytes.byte().cast_signed());
        match self.style % 4 {
            0 => f32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()]),
            1 => byte(self) / 16.0,
            2 => 1000.0 + byte(self) / 2.0,
            _ => {
                let (scale, fraction) = (self.byte(), byte(self));
                fraction * f32::from_bits(u32::from(scale).min(254) << 23)
            }
        }
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }

    /// A ray that is aimed, by the first byte: anywhere; at a vertex; at the middle of an edge.
    fn ray(&mut self, mesh: &Mesh) -> Ray {
        let (kind, which) = (self.byte(), usize::from(self.byte()));
        let origin = self.vector();
        let [a, b, c] = mesh.corners((which % mesh.triangles.len()) as u32);
        let direction = match kind % 4 {
            0 => self.vector(),
            1 => a - origin,
            2 => a.midpoint(b) - origin,
            _ => (a + b + c) / 3.0 - origin,
        };
        let (tnear, tfar) = match kind / 4 % 4 {
            0 => (self.coordinate().abs(), self.coordinate()),
            1 => (0.0, 1.0),
            _ => (0.0, f32::INFINITY),
        };
        Ray { origin, tnear, direction, tfar }
    }
}
