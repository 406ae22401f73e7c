//! What triangles' corners have beside their places.

use super::primitives::{Part, Vertices};
use crate::mesh::{Attributes, Normal};
use glam::{DMat3, DVec3};

/// Triangles whose corners are looked at together.
pub(super) const TOGETHER: usize = 1 << 16;

/// What a vertex has.
#[derive(Clone, Copy)]
struct Look {
    uv: [f32; 2],
    /// Whether its texture coordinates are none.
    is_bad: bool,
    normal: Normal,
}

/// Gives what the corners of some triangles of a primitive have, triangle by triangle, and counts corners whose texture
/// coordinates are none. `turn` takes normals to the scene.
///
/// Each vertex is looked at once, in the order of its buffer, however far apart the corners of triangles lie there: of
/// a buffer that is not in memory, little comes and goes twice.
pub(super) fn attributes(
    part: &Part<'_>,
    triangles: &[[u32; 3]],
    turn: &DMat3,
    mut give: impl FnMut(Attributes),
) -> u64 {
    let Some(vertices) = Vertices::of(triangles.as_flattened().iter().copied()) else { return 0 };
    let looks: Vec<Look> = vertices.in_order().map(|vertex| look(part, vertex, turn)).collect();
    let numbers = vertices.numbers();
    let mut bad = 0;
    for corners in triangles {
        let looks = corners.map(|vertex| looks[numbers.of(vertex) as usize]);
        bad += looks.iter().filter(|look| look.is_bad).count() as u64;
        give(Attributes { uv: looks.map(|look| look.uv), normals: looks.map(|look| look.normal) });
    }
    bad
}

fn look(part: &Part<'_>, vertex: u32, turn: &DMat3) -> Look {
    let Attributes { uv: [uv, ..], normals: [normal, ..] } = Attributes::NONE;
    let mut look = Look { uv, is_bad: false, normal };
    if let Some(uv) = &part.uv {
        let [u, v] = uv.numbers(vertex);
        look.is_bad = !(u.is_finite() && v.is_finite());
        if !look.is_bad {
            // Ours runs upward.
            look.uv = [u, 1.0 - v];
        }
    }
    if let Some(normals) = &part.normals {
        let normal = *turn * DVec3::from_array(normals.numbers(vertex).map(f64::from));
        look.normal = normal.try_normalize().map_or(Normal::NONE, |normal| Normal::encode(normal.as_vec3()));
    }
    look
}
