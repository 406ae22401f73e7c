//! The lines of a MTL file.

use super::lines::{parse_f32, split_keyword};
use super::texture::Texture;
use glam::Vec3;
use std::collections::HashMap;

/// What a file says of one material; `None` where it says nothing. Numbers are finite, and otherwise as written.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Definition {
    /// Its name.
    pub name: String,
    /// The line of its `newmtl`, counted from 1.
    pub line: u64,
    /// `illum`, 0 to 10.
    pub illum: Option<u8>,
    /// `Kd`.
    pub diffuse: Option<Vec3>,
    /// `Ks`.
    pub specular: Option<Vec3>,
    /// `Ke`.
    pub emission: Option<Vec3>,
    /// `Tf`.
    pub filter: Option<Vec3>,
    /// `Ns`.
    pub exponent: Option<f32>,
    /// `Ni`.
    pub ior: Option<f32>,
    /// `d`.
    pub dissolve: Option<f32>,
    /// `Tr`.
    pub transparency: Option<f32>,
    /// `Pr`.
    pub roughness: Option<f32>,
    /// `Pm`.
    pub metal: Option<f32>,
    /// The pictures.
    pub maps: Textures,
}

/// The pictures of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Textures {
    /// `map_Kd`.
    pub diffuse: Option<Texture>,
    /// `map_Ks`.
    pub specular: Option<Texture>,
    /// `map_Ke`.
    pub emission: Option<Texture>,
    /// `map_Pr`.
    pub roughness: Option<Texture>,
    /// `map_d`, or `map_Tr`.
    pub opacity: Option<Texture>,
    /// `map_Bump` or `bump`.
    pub bump: Option<Texture>,
    /// `norm`.
    pub normal: Option<Texture>,
}

/// A file's materials in the order of their first definitions, and how many lines were not understood.
///
/// Of a name that is defined twice the last definition counts, whole, and takes the first one's place in the order.
pub(super) fn parse(bytes: &[u8]) -> (Vec<Definition>, u64) {
    let mut definitions: Vec<Definition> = Vec::new();
    let mut places: HashMap<String, usize> = HashMap::new();
    let mut current = None;
    let mut bad_lines = 0;
    for (number, line) in (1..).zip(lines(bytes)) {
        let (keyword, rest) = split_keyword(line.trim_ascii());
        let understood = match keyword {
            [] | [b'#', ..] => true,
            _ if keyword.eq_ignore_ascii_case(b"newmtl") => {
                let name = String::from_utf8_lossy(rest).into_owned();
                let definition = Definition { name: name.clone(), line: number, ..Definition::default() };
                // What follows a nameless one belongs to nothing.
                current = (!name.is_empty()).then(|| {
                    let place = *places.entry(name).or_insert(definitions.len());
                    if place == definitions.len() {
                        definitions.push(definition);
                    } else {
                        definitions[place] = definition;
                    }
                    place
                });
                current.is_some()
            }
            _ => match current {
                Some(place) => definitions[place].line(keyword, rest).is_some(),
                None => false,
            },
        };
        bad_lines += u64::from(!understood);
    }
    (definitions, bad_lines)
}

/// Lines that end in LF, CR and LF, or CR, after a byte order mark, if there is one.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    std::iter::from_fn(move || {
        let text = rest?;
        let Some(end) = text.iter().position(|&b| b == b'\n' || b == b'\r') else {
            rest = None;
            return Some(text);
        };
        let length = if text[end..].starts_with(b"\r\n") { 2 } else { 1 };
        rest = Some(&text[end + length..]);
        Some(&text[..end])
    })
}

impl Definition {
    /// Takes in a line; `None` if it is not understood, and then it changes nothing.
    fn line(&mut self, keyword: &[u8], rest: &[u8]) -> Option<()> {
        let maps = &mut self.maps;
        match keyword.to_ascii_lowercase().as_slice() {
            b"illum" => self.illum = Some(model(rest)?),
            b"kd" => self.diffuse = Some(color(rest)?),
            b"ks" => self.specular = Some(color(rest)?),
            b"ke" => self.emission = Some(color(rest)?),
            b"tf" => self.filter = Some(color(rest)?),
            b"ns" => self.exponent = Some(number(rest)?),
            b"ni" => self.ior = Some(number(rest)?),
            b"d" => {
                // How much of a halo is there depends on where it is seen from: in the middle, this much.
                let (first, after) = split_keyword(rest);
                let is_halo = first.eq_ignore_ascii_case(b"-halo");
                self.dissolve = Some(number(if is_halo { after } else { rest })?);
            }
            b"tr" => self.transparency = Some(number(rest)?),
            b"pr" => self.roughness = Some(number(rest)?),
            b"pm" => self.metal = Some(number(rest)?),
            b"map_kd" => maps.diffuse = Some(Texture::parse(rest)?),
            b"map_ks" => maps.specular = Some(Texture::parse(rest)?),
            b"map_ke" => maps.emission = Some(Texture::parse(rest)?),
            b"map_pr" => maps.roughness = Some(Texture::parse(rest)?),
            b"map_d" | b"map_tr" => maps.opacity = Some(Texture::parse(rest)?),
            b"map_bump" | b"bump" => maps.bump = Some(Texture::parse(rest)?),
            b"norm" => maps.normal = Some(Texture::parse(rest)?),
            // Known, and without a part in what is drawn: `material` says why.
            b"ka" | b"map_ka" | b"sharpness" | b"map_ns" | b"ps" | b"pc" | b"pcr" | b"aniso" | b"anisor"
            | b"map_pm" | b"map_ps" | b"map_pc" | b"map_pcr" | b"disp" | b"map_disp" | b"decal"
            | b"map_decal" | b"refl" | b"map_refl" | b"map_aat" => {}
            _ => return None,
        }
        Some(())
    }
}

/// `r g b`, or one number for a grey. Spectral curves and CIE XYZ are not understood.
fn color(rest: &[u8]) -> Option<Vec3> {
    let mut numbers = [0.0; 3];
    let mut count = 0;
    let words = rest.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
    // A comment may follow.
    for word in words.take_while(|w| !w.starts_with(b"#")).take(3) {
        numbers[count] = finite(word)?;
        count += 1;
    }
    match count {
        1 => Some(Vec3::splat(numbers[0])),
        3 => Some(Vec3::from_array(numbers)),
        _ => None,
    }
}

/// The first word as a number.
fn number(rest: &[u8]) -> Option<f32> {
    finite(split_keyword(rest).0)
}

fn finite(word: &[u8]) -> Option<f32> {
    parse_f32(word).filter(|x| x.is_finite())
}

/// The number of an illumination model: there are eleven.
fn model(rest: &[u8]) -> Option<u8> {
    let number = number(rest)?;
    ((0.0..=10.0).contains(&number) && number.fract() == 0.0).then_some(number as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn one(text: &str) -> Definition {
        let (mut definitions, bad_lines) = parse(text.as_bytes());
        assert_eq!((definitions.len(), bad_lines), (1, 0), "{text}");
        definitions.remove(0)
    }

    #[test]
    fn every_value_is_read_in_any_case() {
        let text = "\u{feff}# by hand\r\nNEWMTL a b\r\n\tillum 7\r\nkd 0.1 0.2 0.3 # red\r\nKS 0.5\r\nKe 9 8 7\r\n\
                    TF .1 .2 .3\r\nns 20\r\nNI 1.5\r\nD 0.25\r\nTR 0.5\r\nPR 0.125\r\nPm 1\r\nKa spectral x.rfl\r\n\
                    map_ka a.png\r\nsharpness 60\r\naniso 0";
        let expected = Definition {
            name: "a b".into(),
            line: 2,
            illum: Some(7),
            diffuse: Some(Vec3::new(0.1, 0.2, 0.3)),
            specular: Some(Vec3::splat(0.5)),
            emission: Some(Vec3::new(9.0, 8.0, 7.0)),
            filter: Some(Vec3::new(0.1, 0.2, 0.3)),
            exponent: Some(20.0),
            ior: Some(1.5),
            dissolve: Some(0.25),
            transparency: Some(0.5),
            roughness: Some(0.125),
            metal: Some(1.0),
            maps: Textures::default(),
        };
        assert_eq!(one(text), expected);
        assert_eq!(one("newmtl a\nd -halo 0.5\n").dissolve, Some(0.5));
    }

    #[test]
    fn every_picture_has_its_place() {
        type Place = fn(&Textures) -> &Option<Texture>;
        let places: [(&str, Place); 10] = [
            ("map_Kd", |maps| &maps.diffuse),
            ("map_Ks", |maps| &maps.specular),
            ("map_Ke", |maps| &maps.emission),
            ("map_Pr", |maps| &maps.roughness),
            ("map_d", |maps| &maps.opacity),
            ("MAP_TR", |maps| &maps.opacity),
            ("map_Bump", |maps| &maps.bump),
            ("map_bump", |maps| &maps.bump),
            ("bump", |maps| &maps.bump),
            ("norm", |maps| &maps.normal),
        ];
        for (keyword, place) in places {
            let definition = one(&format!("newmtl a\n{keyword} -bm 2 a b.png\n"));
            let texture = place(&definition.maps).as_ref().expect(keyword);
            assert_eq!((&*texture.name, texture.strength), ("a b.png", 2.0));
        }
        for keyword in ["map_Ka", "map_Ns", "disp", "decal", "refl", "map_Pm"] {
            assert_eq!(one(&format!("newmtl a\n{keyword} -type sphere a.png\n")).maps, Textures::default());
        }
    }

    #[test]
    fn what_is_not_understood_is_counted_and_left_out() {
        for line in [
            "Kd",
            "Kd 1 2",
            "Kd nan 0 0",
            "Kd 1e39",
            "Kd 0 x 0",
            "Kd spectral a.rfl 1",
            "Ks xyz 1 1 1",
            "Ns",
            "Ns inf",
            "illum 11",
            "illum -1",
            "illum 1.5",
            "illum x",
            "d -halo",
            "d",
            "map_Kd",
            "map_Kd -s",
            "gloss 7",
            "newmtl",
        ] {
            let (definitions, bad_lines) = parse(format!("newmtl a\n{line}\n").as_bytes());
            let nothing = Definition { name: "a".into(), line: 1, ..Definition::default() };
            assert_eq!((definitions, bad_lines), (vec![nothing], 1), "{line}");
        }
        assert_eq!(parse(b"Kd 1 1 1\nillum 2\n"), (Vec::new(), 2), "of no material");
        assert_eq!(parse(b"newmtl\nKd 1 1 1\n"), (Vec::new(), 2), "of one without a name");
    }

    #[test]
    fn the_last_of_two_definitions_counts_in_the_first_ones_place() {
        let text = "newmtl a\nKd 1\nNs 7\rnewmtl b\r\n\r\nnewmtl a\nKd 0\n";
        let (definitions, bad_lines) = parse(text.as_bytes());
        assert_eq!(bad_lines, 0);
        let [a, b] = &definitions[..] else { panic!("{definitions:?}") };
        assert_eq!((&*a.name, a.line, a.diffuse, a.exponent), ("a", 6, Some(Vec3::ZERO), None));
        assert_eq!((&*b.name, b.line), ("b", 4));
    }
}
