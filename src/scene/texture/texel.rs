//! What pictures keep their channels in.

use crate::mesh::srgb_to_linear;
use std::sync::LazyLock;

/// One channel of one texel.
///
/// As a number it is 0 to 1 over its range. As light it is what the sRGB transfer function makes of that; floats
/// are linear already.
pub(super) trait Texel: Copy + Default + PartialEq + Send + Sync + 'static {
    /// The number 1.
    const FULL: Self;
    /// Whether numbers are light as they are.
    const LINEAR: bool;

    fn number(self) -> f32;
    fn light(self) -> f32;
    /// The nearest to a number; of the integers, what lies outside 0 to 1 is clamped.
    fn from_number(number: f32) -> Self;
    /// The nearest to an amount of light.
    fn from_light(light: f32) -> Self;
}

impl Texel for u8 {
    const FULL: Self = u8::MAX;
    const LINEAR: bool = false;

    #[inline]
    fn number(self) -> f32 {
        f32::from(self) / 255.0
    }

    #[inline]
    fn light(self) -> f32 {
        srgb_to_linear(self)
    }

    #[inline]
    fn from_number(number: f32) -> Self {
        (number * 255.0 + 0.5) as u8
    }

    /// By a table over steps of 1/65535, twenty of which are in the smallest step between two bytes.
    #[inline]
    fn from_light(light: f32) -> Self {
        static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
            let bytes: [f32; 256] = std::array::from_fn(|byte| srgb_to_linear(byte as u8));
            (0..=u16::MAX).map(|step| nearest(&bytes, f32::from(step) / 65535.0) as u8).collect()
        });
        ENCODED[(light * 65535.0 + 0.5) as u16 as usize]
    }
}

impl Texel for u16 {
    const FULL: Self = u16::MAX;
    const LINEAR: bool = false;

    #[inline]
    fn number(self) -> f32 {
        f32::from(self) / 65535.0
    }

    #[inline]
    fn light(self) -> f32 {
        words()[self as usize]
    }

    #[inline]
    fn from_number(number: f32) -> Self {
        (number * 65535.0 + 0.5) as u16
    }

    fn from_light(light: f32) -> Self {
        nearest(words(), light) as u16
    }
}

impl Texel for f32 {
    const FULL: Self = 1.0;
    const LINEAR: bool = true;

    #[inline]
    fn number(self) -> f32 {
        self
    }

    #[inline]
    fn light(self) -> f32 {
        self
    }

    #[inline]
    fn from_number(number: f32) -> Self {
        number
    }

    #[inline]
    fn from_light(light: f32) -> Self {
        light
    }
}

/// The light of every 16-bit number.
fn words() -> &'static [f32] {
    static LINEAR: LazyLock<Vec<f32>> = LazyLock::new(|| {
        let light = |s: f64| if s <= 0.04045 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) };
        (0..=u16::MAX).map(|word| light(f64::from(word) / 65535.0) as f32).collect()
    });
    &LINEAR
}

/// The place in an ascending list of the value that is nearest to `light`; 0 for a NaN.
fn nearest(values: &[f32], light: f32) -> usize {
    let above = values.partition_point(|&value| value < light);
    match above {
        0 => 0,
        _ if above == values.len() => above - 1,
        _ if light - values[above - 1] < values[above] - light => above - 1,
        _ => above,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_comes_back() {
        for byte in 0..=u8::MAX {
            assert_eq!(u8::from_light(byte.light()), byte);
            assert_eq!(u8::from_number(byte.number()), byte);
        }
        for word in 0..=u16::MAX {
            assert_eq!(u16::from_light(word.light()), word);
            assert_eq!(u16::from_number(word.number()), word);
        }
    }

    #[test]
    fn both_widths_stand_for_the_same_light() {
        for byte in 0..=u8::MAX {
            let word = u16::from(byte) * 257;
            assert_eq!(byte.number(), word.number());
            assert!((byte.light() - word.light()).abs() <= f32::EPSILON * byte.light());
        }
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        for light in [-1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!((u8::from_light(light), u16::from_light(light)), (0, 0), "{light}");
            assert_eq!((u8::from_number(light), u16::from_number(light)), (0, 0), "{light}");
        }
        for light in [1.5, f32::INFINITY] {
            assert_eq!((u8::from_light(light), u16::from_light(light)), (255, 65535), "{light}");
        }
    }
}
