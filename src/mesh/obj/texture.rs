//! What a `map_` line of a MTL file says: options, and the name of a picture.

use super::lines::{parse_f32, split_keyword};
use crate::mesh::{Channel, Map};

/// A picture as a line names it, before it is looked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Texture {
    /// Its file's name as written, without quotes.
    pub name: String,
    /// `-s`: texture coordinates are multiplied by this.
    scale: [f32; 2],
    /// `-o`: and then this is added.
    offset: [f32; 2],
    /// `-clamp on`.
    clamp: bool,
    /// `-bm`, times the gain of `-mm`.
    pub strength: f32,
    /// `-imfchan`, unless it names a depth.
    pub channel: Option<Channel>,
}

/// How many numbers follow an option.
enum Takes {
    /// At least one, at most three.
    UpToThree,
    /// So many words.
    Words(usize),
}

impl Texture {
    /// What follows a keyword; `None` if an option's value makes no sense, or there is no name.
    ///
    /// Options stand before the name, which may have spaces in it and be in quotes. A word that begins with `-`
    /// and is no option begins the name.
    pub fn parse(rest: &[u8]) -> Option<Self> {
        let mut texture = Self {
            name: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamp: false,
            strength: 1.0,
            channel: None,
        };
        let mut rest = rest.trim_ascii();
        while let Some(taken) = texture.option(rest) {
            rest = taken?;
        }
        texture.name = String::from_utf8_lossy(rest).trim_matches(['"', '\'']).trim().to_owned();
        (!texture.name.is_empty() && texture.strength.is_finite()).then_some(texture)
    }

    /// The picture at a place in the list of pictures; `channel` counts.
    pub fn map(&self, image: u32, channel: Channel) -> Map {
        let Self { scale, offset, clamp, strength, .. } = *self;
        Map { image, channel, scale, offset, clamp, strength }
    }

    /// Takes in the option that a line goes on with, if it does: what is left, or `None` inside if its value makes
    /// no sense.
    fn option<'a>(&mut self, line: &'a [u8]) -> Option<Option<&'a [u8]>> {
        let (word, rest) = split_keyword(line);
        let word = word.to_ascii_lowercase();
        let takes = match word.as_slice() {
            b"-s" | b"-o" | b"-t" => Takes::UpToThree,
            b"-mm" => Takes::Words(2),
            b"-bm" | b"-boost" | b"-texres" | b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-imfchan"
            | b"-type" => Takes::Words(1),
            _ => return None,
        };
        Some(match takes {
            Takes::UpToThree => self.coordinates(&word, rest),
            Takes::Words(count) => {
                let (first, mut left) = split_keyword(rest);
                let mut last = first;
                for _ in 1..count {
                    (last, left) = split_keyword(left);
                }
                self.value(&word, first, last).map(|()| left)
            }
        })
    }

    /// `-s`, `-o` and `-t`: the second and third number may be left out.
    fn coordinates<'a>(&mut self, word: &[u8], mut rest: &'a [u8]) -> Option<&'a [u8]> {
        let mut numbers = [None; 3];
        for number in &mut numbers {
            let (word, left) = split_keyword(rest);
            // A number that nothing follows is the picture's name.
            *number = parse_f32(word).filter(|_| !left.is_empty());
            if number.is_none() {
                break;
            }
            rest = left;
        }
        let u = numbers[0]?;
        let finite = numbers.iter().flatten().all(|x| x.is_finite());
        match word {
            b"-s" => self.scale = [u, numbers[1].unwrap_or(1.0)],
            b"-o" => self.offset = [u, numbers[1].unwrap_or(0.0)],
            _ => {} // Turbulence.
        }
        finite.then_some(rest)
    }

    fn value(&mut self, word: &[u8], first: &[u8], last: &[u8]) -> Option<()> {
        let number = |word: &[u8]| parse_f32(word).filter(|x| x.is_finite());
        let switch = |word: &[u8]| match word.to_ascii_lowercase().as_slice() {
            b"on" => Some(true),
            b"off" => Some(false),
            _ => None,
        };
        match word {
            b"-mm" => {
                number(first)?;
                self.strength *= number(last)?;
            }
            b"-bm" => self.strength *= number(first)?,
            b"-boost" | b"-texres" => drop(number(first)?),
            b"-clamp" => self.clamp = switch(first)?,
            b"-imfchan" => {
                self.channel = match first.to_ascii_lowercase().as_slice() {
                    b"r" => Some(Channel::Red),
                    b"g" => Some(Channel::Green),
                    b"b" => Some(Channel::Blue),
                    b"m" => Some(Channel::Alpha),
                    b"l" => Some(Channel::Grey),
                    b"z" => None,
                    _ => return None,
                }
            }
            b"-type" => drop((!first.is_empty()).then_some(())?),
            _ => drop(switch(first)?),
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn parsed(line: &str) -> Texture {
        Texture::parse(line.as_bytes()).unwrap_or_else(|| panic!("{line} is understood"))
    }

    #[test]
    fn names_have_spaces_quotes_and_dashes() {
        for (line, name) in [
            ("wood.png", "wood.png"),
            ("  two words.png \t", "two words.png"),
            ("\"in quotes.png\"", "in quotes.png"),
            ("C:\\maps\\old wood.bmp", "C:\\maps\\old wood.bmp"),
            ("-wood.png", "-wood.png"),
            ("-clamp on -s 2 1 1 two words.png", "two words.png"),
            ("-s 2 2", "2"),
            ("-o 0.5 0.25 007 bond.png", "bond.png"),
            ("-s 1 1 1 1.png", "1.png"),
        ] {
            assert_eq!(parsed(line).name, name, "{line}");
        }
    }

    #[test]
    fn options_count_and_others_are_passed_over() {
        let line = "-blendu off -BlendV on -boost 2 -cc on -texres 512 -t 0 0 0 -type sphere -mm 0.25 2 -bm 3 \
                    -s 4 5 6 -o 0.5 -imfchan m -clamp ON a b.png";
        let expected = Texture {
            name: "a b.png".into(),
            scale: [4.0, 5.0],
            offset: [0.5, 0.0],
            clamp: true,
            strength: 6.0,
            channel: Some(Channel::Alpha),
        };
        assert_eq!(parsed(line), expected);
        assert_eq!(parsed("-s 2 a.png").scale, [2.0, 1.0]);
        assert_eq!(parsed("-clamp on -clamp off a.png"), parsed("a.png"));
        assert_eq!(parsed("-imfchan z a.png").channel, None);
    }

    #[test]
    fn nonsense_is_refused() {
        for line in [
            "",
            "\"\"",
            "-s a.png",
            "-s nan a.png",
            "-o 1 inf a.png",
            "-bm high a.png",
            "-bm 1e39 a.png",
            "-bm 1e30 -bm 1e30 a.png",
            "-mm 0 a.png",
            "-clamp maybe a.png",
            "-imfchan q a.png",
            "-bm",
            "-clamp on",
        ] {
            assert_eq!(Texture::parse(line.as_bytes()), None, "{line}");
        }
    }
}
