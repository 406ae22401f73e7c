//! The header of a `.npy` file (NEP 1, "A Simple File Format for NumPy Arrays").
//!
//! ```text
//! 93 4E 55 4D 50 59      the magic: \x93NUMPY
//! major minor            the version: 1.0, 2.0 or 3.0
//! length                 of what follows: u16 in version 1, u32 in later ones; little-endian
//! text                   {'descr': '<f4', 'fortran_order': False, 'shape': (3, 8), } and spaces
//! items                  from here on
//! ```
//!
//! The text is a Python dictionary of three keys. Of the types that `descr` can name, those of plain
//! numbers are strings; a list stands for a structure, which is refused here.

use std::io::{self, Read};
use std::str::FromStr;

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// The longest text that is parsed, as in NumPy. One for plain numbers takes some hundred bytes.
const MAX_TEXT: u32 = 10_000;

/// What a `.npy` file says of its array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// The items' type, such as `<f4`.
    pub descr: String,
    /// Whether the first index runs fastest.
    pub fortran_order: bool,
    /// Items along each axis; nothing for a single number.
    pub shape: Vec<u64>,
}

impl Header {
    /// Reads a header, and says how many bytes it took. An error of the outer kind is the source's, one
    /// of the inner kind says what is wrong with the bytes.
    pub fn read(source: &mut impl Read) -> io::Result<Result<(Self, u64), String>> {
        let mut start = [0; 12];
        let got = read_up_to(source, &mut start[..8])?;
        if start[..got].starts_with(b"PK") {
            return Ok(Err("an archive of arrays; save the rays alone, with np.save".into()));
        }
        if got < 8 || !start.starts_with(MAGIC) {
            return Ok(Err("not a .npy file; write one with np.save(FILE, rays)".into()));
        }
        let size = match start[6] {
            1 => 2,
            2 | 3 => 4,
            version => return Ok(Err(format!("its header is of version {version}, which is not known"))),
        };
        if read_up_to(source, &mut start[8..8 + size])? < size {
            return Ok(Err("truncated: the file ends in its header".into()));
        }
        let length = u32::from_le_bytes([start[8], start[9], start[10], start[11]]);
        if length > MAX_TEXT {
            return Ok(Err(format!("its header of {length} bytes is too long for an array of numbers")));
        }
        let mut text = vec![0; length as usize];
        if read_up_to(source, &mut text)? < text.len() {
            return Ok(Err("truncated: the file ends in its header".into()));
        }
        let header = std::str::from_utf8(&text).ok().and_then(parse);
        let header =
            header.ok_or("its header is not that of an array of numbers; save rays as N x 8 float32");
        Ok(header.map(|header| (header, 8 + size as u64 + u64::from(length))).map_err(str::to_owned))
    }

    /// The header as NumPy writes it, filled up with spaces so that the items are aligned.
    pub fn bytes(&self) -> Vec<u8> {
        let Self { descr, fortran_order, shape } = self;
        let order = if *fortran_order { "True" } else { "False" };
        let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
        let sides = if shape.len() == 1 { sides.trim_end() } else { sides.trim_end_matches(", ") };
        let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': ({sides}), }}");
        let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend(u16::try_from(length).expect("shapes are short").to_le_bytes());
        bytes.extend(format!("{text:0$}\n", length - 1).bytes());
        bytes
    }
}

/// Fills `buffer` as far as the source goes.
fn read_up_to(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while got < buffer.len() {
        match source.read(&mut buffer[got..]) {
            Ok(0) => break,
            Ok(more) => got += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(got)
}

/// The dictionary, with its keys in any order; nothing if it is not one of a plain array.
fn parse(text: &str) -> Option<Header> {
    let mut scanner = Scanner(text);
    let (mut descr, mut fortran_order, mut shape) = (None, None, None);
    scanner.eat("{")?;
    while scanner.eat("}").is_none() {
        let key = scanner.string()?;
        scanner.eat(":")?;
        match key {
            "descr" => descr = Some(scanner.string()?.to_owned()),
            "fortran_order" => fortran_order = Some(scanner.boolean()?),
            "shape" => shape = Some(scanner.tuple()?),
            _ => return None,
        }
        if scanner.eat(",").is_none() {
            scanner.eat("}")?;
            break;
        }
    }
    scanner.0.trim().is_empty().then_some(())?;
    Some(Header { descr: descr?, fortran_order: fortran_order?, shape: shape? })
}

/// What is left of a text.
struct Scanner<'a>(&'a str);

impl<'a> Scanner<'a> {
    /// Passes over `token` and the white space before it, if that is what comes.
    fn eat(&mut self, token: &str) -> Option<()> {
        self.0 = self.0.trim_start().strip_prefix(token)?;
        Some(())
    }

    /// A string without escapes.
    fn string(&mut self) -> Option<&'a str> {
        let quote = if self.eat("'").is_some() { '\'' } else { self.eat("\"").map(|()| '"')? };
        let (string, rest) = self.0.split_once(quote)?;
        self.0 = rest;
        (!string.contains('\\')).then_some(string)
    }

    fn boolean(&mut self) -> Option<bool> {
        self.eat("True").map(|()| true).or_else(|| self.eat("False").map(|()| false))
    }

    /// Whole numbers in parentheses, with commas between them and perhaps after the last.
    fn tuple(&mut self) -> Option<Vec<u64>> {
        let mut items = Vec::new();
        self.eat("(")?;
        while self.eat(")").is_none() {
            items.push(self.number()?);
            if self.eat(",").is_none() {
                self.eat(")")?;
                break;
            }
        }
        Some(items)
    }

    /// A whole number. Python 2 wrote an L after long ones.
    fn number(&mut self) -> Option<u64> {
        self.0 = self.0.trim_start();
        let digits = self.0.bytes().take_while(u8::is_ascii_digit).count();
        let number = u64::from_str(&self.0[..digits]).ok()?;
        self.0 = self.0[digits..].trim_start_matches('L');
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_read_as_they_are_written() {
        for shape in [vec![], vec![5], vec![0, 8], vec![1_000_000, 3], vec![u64::MAX, 1, 2]] {
            for (descr, fortran_order) in [("<f4", false), (">i8", true)] {
                let header = Header { descr: descr.into(), fortran_order, shape: shape.clone() };
                let bytes = header.bytes();
                assert!(bytes.len().is_multiple_of(64) && bytes.ends_with(b"\n"));
                let (read, size) = Header::read(&mut &bytes[..]).expect("in memory").expect("a header");
                assert_eq!((read, size), (header, bytes.len() as u64));
            }
        }
        let one = Header { descr: "|b1".into(), fortran_order: false, shape: vec![7] };
        let text = "{'descr': '|b1', 'fortran_order': False, 'shape': (7,), }";
        assert_eq!(String::from_utf8_lossy(&one.bytes()[10..]).trim_end(), text);
    }

    #[test]
    fn python_has_more_than_one_way_to_say_it() {
        let plain = parse("{'descr': '<f4', 'fortran_order': True, 'shape': (3, 8), }  \n");
        assert!(plain.is_some());
        for text in [
            "{\"shape\":(3,8),\"fortran_order\":True,\"descr\":\"<f4\"}",
            " { 'fortran_order' : True , 'shape' : ( 3L , 8L , ) , 'descr' : '<f4' }",
        ] {
            assert_eq!(parse(text), plain, "{text}");
        }
    }

    #[test]
    fn what_is_no_header_is_none() {
        let nested = |open: &str| open.repeat(3000);
        for text in [
            "",
            "{",
            "{}",
            "}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (3, 8)",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (3, 8)} x",
            "{'descr': '<f4', 'fortran_order': 1, 'shape': (3, 8)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': 3}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (-3, 8)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (3 8)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (,)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (18446744073709551616, 8)}",
            "{'descr': '<f4', 'fortran_order': True}",
            "{'descr': [('x', '<f4')], 'fortran_order': True, 'shape': (3,)}",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (3,), 'more': 1}",
            &nested("("),
            &nested("["),
            &nested("{'a':"),
            &nested("{'shape':("),
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
