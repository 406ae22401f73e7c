//! Rough surfaces: facets whose normals are spread as GGX says (Trowbridge & Reitz, "Average irregularity
//! representation of a rough surface for ray reflection", 1975; Walter et al., "Microfacet models for refraction
//! through rough surfaces", 2007), the same in all directions along the surface.
//!
//! Light meets one facet and is gone: what would be thrown from facet to facet is lost. That makes rough surfaces
//! darker, of white ones in light from everywhere by 8 % for an `alpha` of 0.2, 30 % for 0.5 and 59 % for 1. The terms'
//! names are those of Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs" (2014): `D` is
//! the density of facets' normals, `G1` the share of facets that is seen from one direction, `G2` from two, where what
//! is high is seen from both.
//!
//! All directions are in local coordinates. With an `alpha` below [`SMOOTH`] nothing here may be asked: that is a
//! mirror.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Surfaces whose `alpha` is less than this are mirrors: their highlights are smaller than `f32` directions tell
/// apart well.
pub use crate::scene::effects::SMOOTH;

/// Directions nearer to the surface than this see nothing, so that quotients stay finite.
const GRAZING: f32 = 1e-6;

/// A direction that light is thrown in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    /// Where it goes: above the surface.
    pub wi: Vec3,
    /// The cosine between either direction and the facet's normal: what Fresnel's equations ask for.
    pub cos_facet: f32,
    /// What the light is to be multiplied with, beside Fresnel's share: [`evaluate`] times the cosine, by the density;
    /// at most 1.
    pub weight: f32,
    /// The density by solid angle with which this direction comes up: [`density`].
    pub density: f32,
}

/// `D`: the density by solid angle of facets whose normal is `facet`, a unit vector, on each unit of the surface's
/// area. Its product with the cosine has the integral 1 over the hemisphere. 0 below the surface.
#[inline]
pub fn distribution(facet: Vec3, alpha: f32) -> f32 {
    if facet.z <= 0.0 {
        return 0.0;
    }
    // The sine from x and y: one from z would have no digits left where the highlight of a small alpha is.
    let (x, y) = (facet.x / alpha, facet.y / alpha);
    let spread = x * x + y * y + facet.z * facet.z;
    1.0 / (PI * (alpha * alpha) * (spread * spread))
}

/// `G1`: the share of what is turned to a direction `w` above the surface, or below it, that is seen from there.
#[inline]
pub fn masking(w: Vec3, alpha: f32) -> f32 {
    let cos = w.z.abs();
    2.0 * cos / (cos + stretched(w, alpha))
}

/// The share of light from `wi` that goes to `wo`, by solid angle (the BRDF): `D G2 F / (4 cos cos)`. The cosine at
/// the surface that light from `wi` is to be multiplied with is not in it. `fresnel` gives the share that a facet
/// throws back for the cosine between its normal and either direction. 0 if one of the directions is below the
/// surface.
#[inline]
pub fn evaluate(wo: Vec3, wi: Vec3, alpha: f32, fresnel: impl FnOnce(f32) -> Vec3) -> Vec3 {
    if wo.z < GRAZING || wi.z < GRAZING {
        return Vec3::ZERO;
    }
    let facet = (wo + wi).normalize();
    // `G2 / (4 cos cos)` in one: neither small cosine is divided by.
    let visible = 0.5 / (wi.z * stretched(wo, alpha) + wo.z * stretched(wi, alpha));
    fresnel(wo.dot(facet).clamp(0.0, 1.0)) * (distribution(facet, alpha) * visible)
}

/// The density by solid angle with which [`sample`] gives `wi`; 0 if one of the directions is below the surface.
///
/// Over all `wi` it adds up to less than 1: some samples end below the surface.
#[inline]
pub fn density(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
    if wo.z < GRAZING || wi.z < GRAZING {
        return 0.0;
    }
    // `G1 D / (4 cos)`.
    distribution((wo + wi).normalize(), alpha) * 0.5 / (wo.z + stretched(wo, alpha))
}

/// Throws light that came to `wo` back from one of the facets that are seen from there. `None` if it would go below
/// the surface, to be lost, or if `wo` is there.
#[inline]
pub fn sample(wo: Vec3, alpha: f32, uv: [f32; 2]) -> Option<Reflection> {
    if wo.z < GRAZING {
        return None;
    }
    let facet = sample_facet(wo, alpha, uv);
    let cos_facet = wo.dot(facet).clamp(0.0, 1.0);
    let wi = facet * (2.0 * cos_facet) - wo;
    if wi.z < GRAZING {
        return None;
    }
    let (out, into) = (stretched(wo, alpha), stretched(wi, alpha));
    // `G2 / G1`.
    let weight = wi.z * (wo.z + out) / (wi.z * out + wo.z * into);
    let density = distribution(facet, alpha) * 0.5 / (wo.z + out);
    Some(Reflection { wi, cos_facet, weight, density })
}

/// The normal of one of the facets that are seen from `wo`, which is above the surface: each as often as the area
/// that it covers as seen from there. Density by solid angle: `G1 D cos(wo, facet) / cos(wo)`.
///
/// Light that goes through the facet instead of being thrown back, and comes from `wi` below the surface, has the
/// weight [`masking`] of `wi`, beside the share that a facet lets through (Walter et al. 2007: `G2` is `G1 G1`).
///
/// The facets are those of a ball that was flattened; seen from `wo`, the visible ones of the ball reflect parallel
/// light evenly into a cap of the sphere (Dupuy & Benyoub, "Sampling visible GGX normals with spherical caps", 2023).
#[inline]
pub fn sample_facet(wo: Vec3, alpha: f32, [u, v]: [f32; 2]) -> Vec3 {
    let from = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let z = (1.0 - v) * (1.0 + from.z) - from.z;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(TAU * u);
    let half = Vec3::new(radius * cos, radius * sin, z) + from;
    // Rounding aside, none is turned away from the surface's normal; none at all if `half` vanishes.
    Vec3::new(alpha * half.x, alpha * half.y, half.z.max(0.0)).normalize_or(Vec3::Z)
}

/// The length of `w` when the surface is stretched so that its facets become those of a ball:
/// `cos sqrt(1 + alpha² tan²)`. The usual `Lambda` is `(stretched / cos - 1) / 2`.
#[inline]
fn stretched(w: Vec3, alpha: f32) -> f32 {
    (w.z * w.z + alpha * alpha * (w.x * w.x + w.y * w.y)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::Sequence;
    use super::*;

    const ALPHAS: [f32; 5] = [SMOOTH, 0.03, 0.2, 0.5, 1.0];

    fn direction(cos: f32, phi: f32) -> Vec3 {
        let sin = (1.0 - cos * cos).sqrt();
        Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    }

    /// The integral of `f` over the hemisphere, by the midpoint rule. Steps crowd at the pole if `crowd` is large.
    fn integral(steps: u32, crowd: i32, f: impl Fn(Vec3) -> f32) -> f64 {
        let mut sum = 0.0;
        for i in 0..steps {
            let x = (f64::from(i) + 0.5) / f64::from(steps);
            let theta = x.powi(crowd) * std::f64::consts::FRAC_PI_2;
            let width = f64::from(crowd) * x.powi(crowd - 1) * std::f64::consts::FRAC_PI_2;
            for j in 0..steps {
                let phi = (f64::from(j) + 0.5) / f64::from(steps) * std::f64::consts::TAU;
                let (sin, cos) = theta.sin_cos();
                let w = Vec3::new((sin * phi.cos()) as f32, (sin * phi.sin()) as f32, cos as f32);
                sum += f64::from(f(w)) * sin * width;
            }
        }
        sum * std::f64::consts::TAU / f64::from(steps * steps)
    }

    /// The mean over samples from `wo`; lost ones count as `None`.
    fn mean(wo: Vec3, alpha: f32, f: impl Fn(Option<Reflection>) -> f32) -> f64 {
        const COUNT: u32 = 1 << 14;
        let samples = (0..COUNT).map(|i| sample(wo, alpha, Sequence::of([3, 5], i).pair(0)));
        samples.map(|s| f64::from(f(s))).sum::<f64>() / f64::from(COUNT)
    }

    fn white(wo: Vec3, wi: Vec3, alpha: f32) -> f32 {
        evaluate(wo, wi, alpha, |_| Vec3::ONE).x
    }

    #[test]
    fn facets_cover_the_surface_once() {
        for alpha in ALPHAS {
            let covered = integral(400, 4, |facet| distribution(facet, alpha) * facet.z);
            assert!((covered - 1.0).abs() < 1e-3, "{alpha}: {covered}");
        }
    }

    #[test]
    fn the_visible_ones_fill_the_view() {
        // Of Heitz 2014, equation 14: what is seen is as large as the surface looks from there.
        for alpha in [0.2, 0.5, 1.0] {
            for cos in [0.1, 0.5, 1.0] {
                let wo = direction(cos, 0.7);
                let seen =
                    integral(300, 2, |facet| distribution(facet, alpha) * wo.dot(facet).max(0.0)) as f32;
                assert!((seen * masking(wo, alpha) - cos).abs() < 2e-3, "{alpha} {cos}: {seen}");
            }
        }
    }

    #[test]
    fn no_more_light_goes_than_came_and_all_of_it_from_a_mirror() {
        for alpha in [0.2, 0.5, 1.0] {
            for cos in [0.1, 0.5, 0.9, 1.0] {
                let wo = direction(cos, 0.3);
                let thrown = integral(300, 1, |wi| white(wo, wi, alpha) * wi.z);
                let sampled = mean(wo, alpha, |s| s.map_or(0.0, |s| s.weight));
                assert!(thrown < 1.0 && thrown > 0.3, "{alpha} {cos}: {thrown}");
                assert!((thrown - sampled).abs() < 3e-3, "{alpha} {cos}: {thrown} {sampled}");
            }
        }
        for cos in [0.1, 0.5, 1.0] {
            let left =
                [0.1, 0.03, SMOOTH].map(|a| mean(direction(cos, 1.0), a, |s| s.map_or(0.0, |s| s.weight)));
            assert!(left[0] < left[1] && left[1] < left[2] && left[2] > 0.9999, "{cos}: {left:?}");
        }
    }

    #[test]
    fn seen_from_above_the_roughest_throws_back_what_it_should() {
        // For `alpha` = 1 the sine² of the facets' angle, s, is spread evenly, up to 1/2 light goes up, and its weight
        // is (1 - 2s) / (1 - s): that adds up to 1 - ln 2.
        let thrown = mean(Vec3::Z, 1.0, |s| s.map_or(0.0, |s| s.weight));
        assert!((thrown - (1.0 - std::f64::consts::LN_2)).abs() < 1e-3, "{thrown}");
    }

    #[test]
    fn samples_come_as_often_as_the_density_says() {
        for alpha in [0.2, 0.6, 1.0] {
            for cos in [0.15, 0.6, 1.0] {
                let wo = direction(cos, -1.1);
                let arrive = mean(wo, alpha, |s| f32::from(u8::from(s.is_some())));
                let expected = integral(300, 1, |wi| density(wo, wi, alpha));
                assert!((arrive - expected).abs() < 3e-3, "{alpha} {cos}: {arrive} {expected}");
                // A part of the hemisphere that is cut out of it askew.
                let inside = |wi: Vec3| f32::from(u8::from(wi.dot(Vec3::new(0.48, 0.6, 0.64)) > 0.7));
                let arrive = mean(wo, alpha, |s| s.map_or(0.0, |s| inside(s.wi)));
                let expected = integral(300, 1, |wi| density(wo, wi, alpha) * inside(wi));
                assert!((arrive - expected).abs() < 5e-3, "{alpha} {cos}: {arrive} {expected}");
            }
        }
    }

    #[test]
    fn a_sample_agrees_with_what_can_be_asked_of_it() {
        for alpha in ALPHAS {
            for i in 0..500 {
                let wo = direction(0.02 + 0.98 * i as f32 / 500.0, i as f32);
                let Some(s) = sample(wo, alpha, Sequence::of([0, 0], i).pair(1)) else { continue };
                assert!(s.wi.is_normalized() && s.wi.z > 0.0 && s.weight <= 1.0 + 1e-6, "{s:?}");
                let close = |a: f32, b: f32| (a - b).abs() <= 2e-3 * b.abs();
                assert!(close(s.density, density(wo, s.wi, alpha)), "{alpha} {wo} {s:?}");
                let weight = white(wo, s.wi, alpha) * s.wi.z / density(wo, s.wi, alpha);
                assert!(close(s.weight, weight), "{alpha} {wo} {s:?} {weight}");
                let cos = (wo + s.wi).normalize().dot(wo);
                assert!((s.cos_facet - cos).abs() < 1e-3, "{s:?} {cos}");
            }
        }
    }

    #[test]
    fn light_goes_either_way_alike() {
        for alpha in ALPHAS {
            for i in 0..200 {
                let [a, b] = Sequence::of([1, 1], i).pair(0);
                let [c, d] = Sequence::of([1, 1], i).pair(1);
                let (wo, wi) = (direction(a.max(0.01), 6.0 * b), direction(c.max(0.01), 6.0 * d));
                let fresnel = |cos: f32| Vec3::new(cos, 1.0, 1.0 - cos);
                let there = evaluate(wo, wi, alpha, fresnel);
                let back = evaluate(wi, wo, alpha, fresnel);
                assert!(there.distance(back) <= 1e-4 * there.length(), "{alpha}: {there} {back}");
            }
        }
    }

    #[test]
    fn below_the_surface_there_is_nothing_and_at_its_edge_there_are_numbers() {
        let up = direction(0.5, 0.0);
        for below in [direction(-0.5, 0.0), Vec3::X, -up] {
            assert_eq!(white(up, below, 0.5) + white(below, up, 0.5), 0.0);
            assert_eq!(density(up, below, 0.5) + density(below, up, 0.5), 0.0);
            assert_eq!(sample(below, 0.5, [0.1, 0.9]), None);
        }
        for alpha in ALPHAS {
            for cos in [1e-20, 2e-6, 1e-4] {
                let edge = direction(cos, 2.0);
                assert!(white(edge, edge, alpha).is_finite() && white(edge, up, alpha).is_finite());
                for uv in [[0.0, 0.0], [0.25, 0.999_999_94], [0.999_999_94, 0.999_999_94]] {
                    let s = sample(edge, alpha, uv);
                    assert!(s.is_none_or(|s| s.weight.is_finite() && s.density.is_finite()), "{s:?}");
                }
            }
        }
    }
}
