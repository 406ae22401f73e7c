//! A picture at its own size, at half of it, at a quarter, down to one texel.

use super::texel::Texel;
use rayon::prelude::*;

/// What maps make of a picture: which pyramids it needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Uses {
    /// Something reads it as a colour.
    pub(super) color: bool,
    /// Something reads its channels as numbers.
    pub(super) data: bool,
    /// Something reads how much of it is there.
    pub(super) alpha: bool,
}

/// A picture and its reductions.
///
/// Each level has half of the texels of the one above it both ways, rounded down, and each of its texels is the
/// mean over the part of the picture that it covers: of colours the mean of their light, of numbers that of
/// the numbers. The two differ for pictures that are not linear, so there is a set of levels for each that is used.
#[derive(Debug)]
pub(super) struct Pyramid<T> {
    /// 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha.
    pub(super) channels: usize,
    pub(super) base: Level<T>,
    color: Vec<Level<T>>,
    data: Vec<Level<T>>,
}

/// One picture, the top row first, the channels of a texel side by side.
#[derive(Debug)]
pub(super) struct Level<T> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Vec<T>,
}

impl<T: Texel> Pyramid<T> {
    /// The levels of a picture of at least one texel. An alpha channel that is full everywhere is left out.
    pub(super) fn new(channels: usize, mut base: Level<T>, uses: Uses) -> Self {
        let is_full = |texel: &[T]| texel[channels - 1] == T::FULL;
        let kept = if channels.is_multiple_of(2) && base.texels.chunks_exact(channels).all(is_full) {
            base.drop_alpha(channels);
            channels - 1
        } else {
            channels
        };
        let wants_color = uses.color && !T::LINEAR;
        let mut pyramid = Self { channels: kept, base, color: Vec::new(), data: Vec::new() };
        if wants_color {
            pyramid.color = pyramid.reductions(true, uses.alpha);
        }
        if uses.data || !wants_color {
            pyramid.data = pyramid.reductions(false, T::LINEAR && uses.color && uses.alpha);
        }
        pyramid
    }

    /// The levels below the base.
    pub(super) fn levels(&self, color: bool) -> &[Level<T>] {
        match (color, self.color.is_empty(), self.data.is_empty()) {
            (true, false, _) | (_, _, true) => &self.color,
            _ => &self.data,
        }
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        let levels = [&self.base].into_iter().chain(&self.color).chain(&self.data);
        levels.map(|level| level.texels.capacity() * size_of::<T>() + size_of::<Level<T>>()).sum()
    }

    fn reductions(&self, color: bool, weigh: bool) -> Vec<Level<T>> {
        let weigh = weigh && self.channels.is_multiple_of(2);
        let mut levels: Vec<Level<T>> = Vec::new();
        loop {
            let last = levels.last().unwrap_or(&self.base);
            if last.width == 1 && last.height == 1 {
                return levels;
            }
            let next = match self.channels {
                1 => last.half::<1>(color, weigh),
                2 => last.half::<2>(color, weigh),
                3 => last.half::<3>(color, weigh),
                _ => last.half::<4>(color, weigh),
            };
            levels.push(next);
        }
    }
}

impl<T: Texel> Level<T> {
    /// Moves texels together over their last channel.
    fn drop_alpha(&mut self, channels: usize) {
        for i in 0..self.width * self.height {
            self.texels.copy_within(i * channels..(i + 1) * channels - 1, i * (channels - 1));
        }
        self.texels.truncate(self.width * self.height * (channels - 1));
        self.texels.shrink_to_fit();
    }

    /// The next level. With `weigh` a texel counts for the mean colour as much as there is of it, so that what is
    /// hidden behind no alpha does not come out at the edges of what is there.
    ///
    /// The mean of alpha keeps the share of light that goes by. Where alpha is compared with a cutoff, thin parts
    /// vanish in it: such maps are best asked for with no footprint.
    fn half<const N: usize>(&self, color: bool, weigh: bool) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let across: Vec<Taps> = (0..width).map(|x| taps(x, self.width, width)).collect();
        let has_alpha = N.is_multiple_of(2);
        let is_light = |channel: usize| color && !(has_alpha && channel == N - 1);
        let mut texels = vec![T::default(); width * height * N];
        texels.par_chunks_exact_mut(width * N).enumerate().for_each(|(y, row)| {
            let down = taps(y, self.height, height);
            for (taps, texel) in across.iter().zip(row.as_chunks_mut::<N>().0) {
                // The mean, and the one in which texels count by their alpha.
                let (mut mean, mut weighed) = ([0.0f32; N], [0.0f32; N]);
                for (y, share_y) in down {
                    for (x, share_x) in taps {
                        let (at, share) = ((y * self.width + x) * N, share_x * share_y);
                        let source = &self.texels[at..at + N];
                        let alpha = if weigh { source[N - 1].number() } else { 0.0 };
                        for channel in 0..N {
                            let value = source[channel];
                            let value = if is_light(channel) { value.light() } else { value.number() };
                            mean[channel] += share * value;
                            weighed[channel] += share * alpha * value;
                        }
                    }
                }
                let there = mean[N - 1];
                for channel in 0..N {
                    let by_alpha = weigh && channel < N - 1 && there > 0.0;
                    let value = if by_alpha { weighed[channel] / there } else { mean[channel] };
                    texel[channel] =
                        if is_light(channel) { T::from_light(value) } else { T::from_number(value) };
                }
            }
        });
        Self { width, height, texels }
    }
}

/// Places in a row and their shares of a mean, which add up to 1.
type Taps = [(usize, f32); 3];

/// What the texel `i` of a row of `to` texels covers of a row of `from`, which has twice as many, or one more, or
/// is one long.
fn taps(i: usize, from: usize, to: usize) -> Taps {
    if from == 1 {
        return [(0, 1.0), (0, 0.0), (0, 0.0)];
    }
    let first = 2 * i;
    if from == 2 * to {
        return [(first, 0.5), (first + 1, 0.5), (first, 0.0)];
    }
    let share = |parts: usize| parts as f32 / from as f32;
    [(first, share(to - i)), (first + 1, share(to)), (first + 2, share(i + 1))]
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLOR: Uses = Uses { color: true, data: false, alpha: false };
    const DATA: Uses = Uses { color: false, data: true, alpha: false };

    fn level<T: Texel>(width: usize, texels: &[T], channels: usize) -> Level<T> {
        Level { width, height: texels.len() / channels / width, texels: texels.to_vec() }
    }

    #[test]
    fn taps_cover_every_texel_alike() {
        for from in 2..40 {
            let to = from / 2;
            let mut shares = vec![0.0; from];
            for i in 0..to {
                let taps = taps(i, from, to);
                assert!((taps.iter().map(|tap| tap.1).sum::<f32>() - 1.0).abs() < 1e-6);
                taps.iter().for_each(|&(place, share)| shares[place] += share);
            }
            let expected = to as f32 / from as f32;
            assert!(shares.iter().all(|share| (share - expected).abs() < 1e-6), "{from}: {shares:?}");
        }
    }

    #[test]
    fn colours_are_halved_in_linear_light_and_numbers_as_they_are() {
        let board = level(2, &[0u8, 255, 255, 0], 1);
        let both = Pyramid::new(1, board, Uses { color: true, data: true, alpha: false });
        // Half of the light is sRGB's 188.
        assert_eq!(both.levels(true)[0].texels, [188]);
        assert_eq!(both.levels(false)[0].texels, [128]);
    }

    #[test]
    fn a_pyramid_ends_in_one_texel_that_is_the_mean() {
        for (width, height) in [(1, 1), (1, 9), (7, 5), (64, 3), (33, 65)] {
            let texels: Vec<f32> = (0..width * height).map(|i| (i * 7919 % 101) as f32).collect();
            let mean = texels.iter().sum::<f32>() / texels.len() as f32;
            let pyramid = Pyramid::new(1, Level { width, height, texels }, DATA);
            let last = pyramid.levels(false).last().unwrap_or(&pyramid.base);
            assert_eq!((last.width, last.height), (1, 1));
            assert!((last.texels[0] - mean).abs() < 1e-4 * mean.max(1.0), "{width} x {height}");
        }
    }

    #[test]
    fn what_is_not_there_does_not_colour_what_is() {
        // A red texel, and three green ones that are not there.
        let texels = [[255u8, 0, 0, 255], [0, 255, 0, 0], [0, 255, 0, 0], [0, 255, 0, 0]].concat();
        let uses = Uses { alpha: true, ..COLOR };
        let pyramid = Pyramid::new(4, level(2, &texels, 4), uses);
        assert_eq!(pyramid.levels(true)[0].texels, [255, 0, 0, 64]);
        // Numbers are not colours: they count alike.
        let pyramid = Pyramid::new(4, level(2, &texels, 4), Uses { data: true, ..uses });
        assert_eq!(pyramid.levels(false)[0].texels, [64, 191, 0, 64]);
        // Where alpha means nothing to anyone, it does not count.
        let pyramid = Pyramid::new(4, level(2, &texels, 4), COLOR);
        assert_eq!(pyramid.levels(true)[0].texels, [137, 225, 0, 64]);
    }

    #[test]
    fn an_alpha_channel_that_is_full_is_left_out() {
        let pyramid = Pyramid::new(2, level(2, &[1u8, 255, 2, 255], 2), COLOR);
        assert_eq!((pyramid.channels, &pyramid.base.texels[..]), (1, &[1, 2][..]));
        let pyramid = Pyramid::new(2, level(2, &[1u8, 255, 2, 254], 2), COLOR);
        assert_eq!(pyramid.channels, 2);
    }

    #[test]
    fn only_what_is_used_is_made() {
        let made = |uses| {
            let pyramid = Pyramid::new(1, level(2, &[0u8; 4], 1), uses);
            (pyramid.color.len(), pyramid.data.len())
        };
        assert_eq!((made(COLOR), made(DATA)), ((1, 0), (0, 1)));
        assert_eq!(made(Uses { data: true, ..COLOR }), (1, 1));
        let float = Pyramid::new(1, level(2, &[0.0f32; 4], 1), Uses { data: true, ..COLOR });
        assert_eq!((float.color.len(), float.data.len()), (0, 1));
        assert_eq!(float.levels(true).len(), 1);
    }
}
