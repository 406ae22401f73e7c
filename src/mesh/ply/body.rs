//! The body's numbers, one after the other, from text or from bytes.

use super::header::{Kind, Property, Scalar};

/// A stream of numbers. All integer types of PLY fit into an `f64` exactly.
pub(super) trait Source {
    /// The next number.
    fn number(&mut self, kind: Scalar) -> Result<f64, String>;

    /// Passes over numbers.
    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), String>;

    /// Bytes not read yet.
    fn remaining(&self) -> usize;

    /// The fewest bytes that a number takes.
    fn least_number(&self, kind: Scalar) -> u64;

    /// Bytes after the last element that mean something.
    fn trailing(&self) -> u64;

    /// " (line 12)" where there are lines.
    fn place(&self) -> String;

    /// The fewest bytes that a property takes: of a list, its length.
    fn least_size(&self, property: &Property) -> u64 {
        match property.kind {
            Kind::Scalar(kind) | Kind::List { count: kind, .. } => self.least_number(kind),
        }
    }

    /// The length of a list, which is checked against what is left of the file.
    fn length(&mut self, count: Scalar, item: Scalar) -> Result<usize, String> {
        let length = self.number(count)?;
        if length < 0.0 || length.fract() != 0.0 {
            return Err(format!("a list of length {length}"));
        }
        // The last number of a text needs no separator after it.
        if length * self.least_number(item) as f64 > self.remaining() as f64 + 1.0 {
            return Err(format!("truncated: a list of {length} goes beyond the end of the file"));
        }
        Ok(length as usize)
    }
}

/// Bytes in one order or the other.
pub(super) struct Binary<'a, const BIG: bool> {
    rest: &'a [u8],
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (bytes, rest) = self.rest.split_first_chunk::<N>().ok_or_else(truncated)?;
        self.rest = rest;
        let mut bytes = *bytes;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

#[cold]
fn truncated() -> String {
    "truncated: the file ends here".into()
}

impl<const BIG: bool> Source for Binary<'_, BIG> {
    #[inline]
    fn number(&mut self, kind: Scalar) -> Result<f64, String> {
        Ok(match kind {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    #[inline]
    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), String> {
        let size = kind.size().checked_mul(count).ok_or_else(truncated)?;
        self.rest = self.rest.get(size..).ok_or_else(truncated)?;
        Ok(())
    }

    fn remaining(&self) -> usize {
        self.rest.len()
    }

    fn least_number(&self, kind: Scalar) -> u64 {
        kind.size() as u64
    }

    fn trailing(&self) -> u64 {
        self.rest.len() as u64
    }

    fn place(&self) -> String {
        String::new()
    }
}

/// Numbers with white space between them. Line ends are white space like any other: files that
/// break an element over two lines, or put two on one, are read all the same.
pub(super) struct Ascii<'a> {
    rest: &'a [u8],
    line: u64,
}

impl<'a> Ascii<'a> {
    /// The text after a header of so many lines.
    pub fn new(bytes: &'a [u8], header_lines: u64) -> Self {
        Self { rest: bytes, line: header_lines + 1 }
    }

    #[inline]
    fn word(&mut self) -> Result<&'a [u8], String> {
        let mut start = 0;
        while let Some(b) = self.rest.get(start)
            && b.is_ascii_whitespace()
        {
            self.line += u64::from(*b == b'\n');
            start += 1;
        }
        let rest = &self.rest[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.rest = &rest[length..];
        if length == 0 { Err(truncated()) } else { Ok(&rest[..length]) }
    }
}

impl Source for Ascii<'_> {
    #[inline]
    fn number(&mut self, kind: Scalar) -> Result<f64, String> {
        let word = self.word()?;
        let text = std::str::from_utf8(word).ok();
        // A float is rounded once, not by way of double precision.
        let number = match kind {
            Scalar::F32 => text.and_then(|t| t.parse::<f32>().ok()).map(f64::from),
            _ => text.and_then(|t| t.parse().ok()),
        };
        number.ok_or_else(|| {
            let shown = String::from_utf8_lossy(&word[..word.len().min(24)]).escape_debug().to_string();
            format!("\"{shown}\" is no number")
        })
    }

    fn skip(&mut self, _kind: Scalar, count: usize) -> Result<(), String> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn remaining(&self) -> usize {
        self.rest.len()
    }

    fn least_number(&self, _kind: Scalar) -> u64 {
        2 // a digit and a separator
    }

    fn trailing(&self) -> u64 {
        self.rest.trim_ascii().len() as u64
    }

    fn place(&self) -> String {
        format!(" (line {})", self.line)
    }
}
