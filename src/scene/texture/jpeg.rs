//! Whether a JPEG file is all there: its decoder fills up with grey what is missing, and says nothing.

use std::io::{self, BufRead, ErrorKind, Read as _};

/// Whether the picture's end is marked.
pub(super) fn is_whole(input: &mut impl BufRead) -> io::Result<bool> {
    match find_end(input) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        found => found.map(|()| true),
    }
}

/// Reads on to there, from segment to segment: what is inside of them, such as a small picture of the picture, may
/// have an end of its own (ITU-T T.81, annex B).
fn find_end(input: &mut impl BufRead) -> io::Result<()> {
    loop {
        input.skip_until(0xff)?;
        let mut marker = [0xff];
        while marker == [0xff] {
            input.read_exact(&mut marker)?;
        }
        match marker[0] {
            0xd9 => return Ok(()),
            // A byte of the picture itself, or a marker that stands alone.
            0x00 | 0x01 | 0xd0..=0xd8 => {}
            _ => {
                let mut length = [0; 2];
                input.read_exact(&mut length)?;
                let rest = u64::from(u16::from_be_bytes(length)).saturating_sub(2);
                io::copy(&mut input.take(rest), &mut io::sink())?;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_pictures_own_end_counts() {
        let is_whole = |bytes: &[u8]| is_whole(&mut &bytes[..]).expect("read");
        // A segment that holds an end, a scan with a stuffed byte and a restart, fill bytes before the end.
        let whole = b"\xff\xd8\xff\xe1\x00\x05\xff\xd9.\xff\xda\x00\x02ab\xff\x00c\xff\xd0d\xff\xff\xff\xd9";
        assert!(is_whole(whole));
        assert!(is_whole(&[&whole[..], b"what follows"].concat()));
        for length in 0..whole.len() {
            assert!(!is_whole(&whole[..length]), "{length}");
        }
    }
}
