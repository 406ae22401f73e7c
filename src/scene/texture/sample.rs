//! What a picture has at a place: bilinear within a level, linear between two.

use super::mix;
use super::pyramid::{Level, Pyramid};
use super::texel::Texel;
use glam::Vec4;

/// Where a picture is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// From the left border to the right one and from the **top** one to the bottom: 0 to 1.
    at: [f64; 2],
    /// Width of what is looked at, where that of the picture is 1.
    footprint: f32,
    clamp: bool,
}

impl Spot {
    /// Of texture coordinates, v upward. What is not finite is taken for 0.
    pub(super) fn new(uv: [f64; 2], footprint: f32, clamp: bool) -> Self {
        let inside = |x: f64| match x {
            x if !x.is_finite() => 0.0,
            x if clamp => x.clamp(0.0, 1.0),
            // In double precision, so that tiles far from the first are as sharp as it.
            x => x - x.floor(),
        };
        Self { at: [inside(uv[0]), 1.0 - inside(uv[1])], footprint, clamp }
    }
}

impl<T: Texel> Pyramid<T> {
    /// The filtered value at a place: RGB, and alpha, which is 1 in pictures without. Colours are decoded to light,
    /// texel by texel, before they are blended.
    pub(super) fn sample(&self, spot: Spot, color: bool) -> Vec4 {
        let size = (self.base.width as f32) * (self.base.height as f32);
        let (level, toward_next) = level(spot.footprint * size.sqrt());
        let levels = self.levels(color);
        let bilinear = |level: &Level<T>| match color {
            true => self
                .bilinear(level, spot, |[r, g, b, a]| Vec4::new(r.light(), g.light(), b.light(), a.number())),
            false => self.bilinear(level, spot, |texel| Vec4::from_array(texel.map(T::number))),
        };
        let of = |level: usize| if level == 0 { &self.base } else { &levels[level - 1] };
        if level >= levels.len() {
            return bilinear(of(levels.len()));
        }
        let finer = bilinear(of(level));
        if toward_next == 0.0 { finer } else { mix(finer, bilinear(of(level + 1)), toward_next) }
    }

    #[inline]
    fn bilinear(&self, level: &Level<T>, spot: Spot, decode: impl Fn([T; 4]) -> Vec4) -> Vec4 {
        let [(left, right, x), (top, bottom, y)] =
            [between(spot.at[0], level.width, spot.clamp), between(spot.at[1], level.height, spot.clamp)];
        let texel = |x: usize, y: usize| decode(self.texel(level, x, y));
        let above = mix(texel(left, top), texel(right, top), x);
        let below = mix(texel(left, bottom), texel(right, bottom), x);
        mix(above, below, y)
    }

    /// RGB and alpha of a texel.
    #[inline]
    fn texel(&self, level: &Level<T>, x: usize, y: usize) -> [T; 4] {
        let at = (y * level.width + x) * self.channels;
        match level.texels[at..at + self.channels] {
            [grey] => [grey, grey, grey, T::FULL],
            [grey, alpha] => [grey, grey, grey, alpha],
            [r, g, b] => [r, g, b, T::FULL],
            [r, g, b, a] => [r, g, b, a],
            _ => unreachable!("pictures have one to four channels"),
        }
    }
}

/// The two texels of a row between whose middles a place (0 to 1) is, and how far it is from the first.
#[inline]
fn between(at: f64, size: usize, clamp: bool) -> (usize, usize, f32) {
    let place = at * size as f64 - 0.5;
    let below = place.floor();
    let (first, share) = (below as isize, (place - below) as f32);
    let last = size as isize - 1;
    let texel = |i: isize| match i {
        i if (0..=last).contains(&i) => i as usize,
        // Past one border there is the other, or the same texel again. A place is at most one texel outside.
        i if (i < 0) == clamp => 0,
        _ => last as usize,
    };
    (texel(first), texel(first + 1), share)
}

/// The level whose texels are as wide as a footprint, measured in the base's texels, and how far the footprint is
/// on the way to the next.
///
/// The logarithm to base 2 is drawn straight between the powers of two, off by 0.09 at most: the same on every
/// machine, continuous, and exact where a level alone is read.
fn level(texels: f32) -> (usize, f32) {
    if texels.is_nan() || texels <= 1.0 {
        return (0, 0.0);
    }
    let bits = texels.to_bits();
    let exponent = (bits >> 23) - 127;
    let mantissa = f32::from_bits(bits & 0x007f_ffff | 1.0f32.to_bits());
    (exponent as usize, mantissa - 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::pyramid::Uses;
    use super::*;

    const DATA: Uses = Uses { color: false, data: true, alpha: false };

    fn grey(width: usize, texels: &[f32]) -> Pyramid<f32> {
        let level = Level { width, height: texels.len() / width, texels: texels.to_vec() };
        Pyramid::new(1, level, DATA)
    }

    fn at(pyramid: &Pyramid<f32>, u: f64, v: f64, footprint: f32, clamp: bool) -> f32 {
        pyramid.sample(Spot::new([u, v], footprint, clamp), false).x
    }

    #[test]
    fn v_grows_upward_from_the_lower_left_corner() {
        let picture = grey(2, &[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(at(&picture, 0.25, 0.25, 0.0, false), 3.0);
        assert_eq!(at(&picture, 0.75, 0.25, 0.0, false), 4.0);
        assert_eq!(at(&picture, 0.25, 0.75, 0.0, false), 1.0);
        assert_eq!(at(&picture, 0.5, 0.5, 0.0, false), 2.5);
    }

    #[test]
    fn pictures_are_repeated_or_end() {
        let picture = grey(4, &[0.0, 1.0, 2.0, 3.0]);
        for turn in [-3.0, 0.0, 1.0, 1e6] {
            assert_eq!(at(&picture, 0.375 + turn, 0.5, 0.0, false), 1.0);
            assert_eq!(at(&picture, turn, 0.5, 0.0, false), 1.5, "between the last and the first");
        }
        assert_eq!(at(&picture, 0.0, 0.5, 0.0, true), 0.0);
        assert_eq!(at(&picture, -7.0, 0.5, 0.0, true), 0.0);
        assert_eq!(at(&picture, 1.0, 0.5, 0.0, true), 3.0);
        assert_eq!(at(&picture, 8.0, 0.5, 0.0, true), 3.0);
    }

    #[test]
    fn no_coordinates_or_footprints_are_too_wild() {
        let picture = grey(3, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let wild =
            [f64::NAN, f64::INFINITY, -f64::INFINITY, f64::MAX, -f64::MAX, 1e300, -1e-300, 5e-324, 0.0, 1.0];
        for u in wild {
            for v in wild {
                for footprint in [f32::NAN, f32::INFINITY, -1.0, f32::MAX, 0.0, 1e-40, 0.3] {
                    for clamp in [false, true] {
                        let value = at(&picture, u, v, footprint, clamp);
                        assert!((0.0..=5.0).contains(&value), "{u} {v} {footprint} {clamp}: {value}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_footprint_picks_its_level() {
        assert_eq!(level(0.5), (0, 0.0));
        assert_eq!(level(1.0), (0, 0.0));
        assert_eq!(level(2.0), (1, 0.0));
        assert_eq!(level(3.0), (1, 0.5));
        assert_eq!(level(64.0), (6, 0.0));
        assert!(level(f32::INFINITY).0 > 40);

        // Stripes two texels wide: there one texel wide is sharp, at four all is grey.
        let stripes: Vec<f32> = (0..16 * 16).map(|i| (i / 2 % 2) as f32).collect();
        let stripes = grey(16, &stripes);
        let middle = 2.5 / 16.0;
        assert_eq!(at(&stripes, middle, middle, 1.0 / 16.0, false), 1.0);
        assert_eq!(at(&stripes, middle, middle, 4.0 / 16.0, false), 0.5);
        assert_eq!(at(&stripes, middle, middle, 1e9, false), 0.5);
        let between = at(&stripes, middle, middle, 3.0 / 16.0, false);
        assert!(between > 0.5 && between < 1.0, "{between}");
    }

    #[test]
    fn light_is_blended_not_bytes() {
        let level = Level { width: 2, height: 1, texels: vec![0u8, 255] };
        let pyramid = Pyramid::new(1, level, Uses { color: true, data: true, alpha: false });
        let spot = Spot::new([0.5, 0.5], 0.0, true);
        assert_eq!(pyramid.sample(spot, true).x, 0.5);
        assert_eq!(pyramid.sample(spot, false), Vec4::new(0.5, 0.5, 0.5, 1.0));
        let far = Spot { footprint: 1e3, ..spot };
        assert!((pyramid.sample(far, true).x - 0.5).abs() < 0.005);
    }
}
