//! Files broken on purpose: each fault is noticed, and said.

use super::super::VERSION;
use super::super::checksum::{BLOCK, of_block, of_table};
use super::super::out::{Out, length};
use super::super::section::{ENTRY, Entry, Kind};
use super::surfaces::*;
use super::*;
use crate::files::write_whole;
use std::io::{self, Write};

/// The message with which a file is refused when it is opened: one line that begins with its name.
fn refused(place: &Place, bytes: &[u8]) -> String {
    place.set(bytes);
    let message = place.open().expect_err("it is broken").to_string();
    let name = format!("{}: ", place.path.display());
    assert!(message.starts_with(&name) && !message.contains('\n'), "{message}");
    message[name.len()..].to_owned()
}

/// Makes all checksums right again, whatever the bytes.
pub(super) fn reseal(bytes: &mut [u8]) {
    let table = u64::from_le_bytes(bytes[40..48].try_into().expect("eight")) as usize;
    for block in 1..table / BLOCK {
        let sum = of_block(&bytes[block * BLOCK..][..BLOCK]);
        bytes[table + 4 * block..][..4].copy_from_slice(&sum.to_le_bytes());
    }
    let sum = of_table(&bytes[table..]);
    bytes[56..64].copy_from_slice(&sum.to_le_bytes());
    reseal_first(bytes);
}

/// The same for the first block alone.
fn reseal_first(bytes: &mut [u8]) {
    bytes[120..128].fill(0);
    let sum = of_table(&bytes[..BLOCK]);
    bytes[120..128].copy_from_slice(&sum.to_le_bytes());
}

fn set_u64(bytes: &mut [u8], at: usize, value: u64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn what_is_no_scene_file_is_told_so() {
    let place = Place::new();
    let message = place.open().expect_err("nothing there").to_string();
    assert!(message.starts_with(&format!("cannot read {}: ", place.path.display())), "{message}");
    assert!(refused(&place, b"").starts_with("it is empty"));
    for foreign in ["ply\nformat ascii 1.0\n".as_bytes(), &[0; 5000], b"x", b"\x89PNG\r\n\x1a\n and so on"] {
        assert!(refused(&place, foreign).starts_with("it is no raypack scene file"));
    }
    assert!(File::open(place.folder.path()).expect_err("a folder").to_string().starts_with("cannot read "));
}

#[test]
fn a_transfer_as_text_is_recognised() {
    let place = Place::with(&meshes()[0]);
    let bytes = place.bytes();
    let mut stripped = bytes.clone();
    stripped[0] &= 0x7f;
    let unix: Vec<u8> = bytes.iter().copied().filter(|&byte| byte != b'\r').collect();
    let utf8: Vec<u8> = [&[0xc2], &bytes[..]].concat();
    for text in [stripped, unix, utf8] {
        assert!(refused(&place, &text).starts_with("its first bytes are damaged, as by a transfer as text"));
    }
}

#[test]
fn other_versions_and_the_other_byte_order_are_named() {
    let place = Place::with(&meshes()[0]);
    let mut bytes = place.bytes();
    bytes[12..16].copy_from_slice(&(VERSION + 1).to_le_bytes());
    let newer = format!("it has version {} of the format, and this raypack reads", VERSION + 1);
    assert!(refused(&place, &bytes).starts_with(&newer));
    bytes[12..16].copy_from_slice(&1u32.to_le_bytes());
    assert!(
        refused(&place, &bytes).starts_with("it has version 1 of the format, of an older raypack, and this")
    );
    bytes[12..16].copy_from_slice(&1u32.to_be_bytes());
    bytes[8..12].reverse();
    assert!(refused(&place, &bytes).starts_with("it was written in the other byte order"));
}

#[test]
fn truncation_is_noticed_wherever_it_happens() {
    let place = Place::with(&meshes()[2]);
    let bytes = place.bytes();
    let total = bytes.len();
    let places = (0..=200).map(|i| total * i / 201).chain([1, 7, 8, 127, BLOCK - 1, BLOCK, total - 1]);
    for length in places.filter(|&length| length > 0) {
        let message = refused(&place, &bytes[..length]);
        assert!(message.starts_with("it is cut short"), "{length}: {message}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(refused(&place, &longer).starts_with("1 bytes follow its end"));
}

#[test]
fn every_flipped_bit_is_noticed() {
    flip_bits(&meshes()[3]);
    let folder = tempfile::tempdir().expect("a folder");
    flip_bits(&rich_meshes(folder.path())[2]);
    flip_bits(&rich_meshes(folder.path())[3]);
}

fn flip_bits(mesh: &Mesh) {
    let place = Place::with(mesh);
    let mut bytes = place.bytes();
    let sections = place.open().expect("opens").sections().to_vec();
    let table = place.open().expect("opens").checksums().len() * BLOCK;
    // All of the header and some of everything: in sections, between them, and in the checksum table.
    let mut places: Vec<usize> = (0..160).collect();
    places.extend((0..300).map(|i| bytes.len() * i / 300 + i % 7));
    places.extend(sections.iter().flat_map(|s| [s.range().start, s.range().end - 1, s.range().end]));
    places.extend([table - 1, table, bytes.len() - 1]);
    places.retain(|&at| at < bytes.len());
    for (number, &at) in places.iter().enumerate() {
        let bit = 1 << (number % 8);
        bytes[at] ^= bit;
        place.set(&bytes);
        match place.open() {
            Err(error) => {
                let inside = sections.iter().find(|s| s.blocks().contains(&(at / BLOCK)));
                let meta = inside.is_some_and(|section| section.kind == Kind::Meta);
                assert!(at < BLOCK || at >= table || meta, "byte {at}: {error}");
            }
            Ok(file) => {
                let message = file.verify(&|_| ()).expect_err("a bit was flipped").to_string();
                let first = at / BLOCK * BLOCK;
                let range = format!("bytes {first} to {} ", first + BLOCK - 1);
                assert!(message.contains(&range), "byte {at}: {message}");
                if let Some(section) = sections.iter().find(|s| s.blocks().contains(&(at / BLOCK))) {
                    assert!(message.contains(section.kind.name()), "byte {at}: {message}");
                    let unread = [file.tree().is_ok(), file.mesh().is_ok(), file.stored().is_ok()];
                    assert!(unread.contains(&false), "{} is handed out damaged", section.kind);
                }
            }
        }
        bytes[at] ^= bit;
    }
    place.set(&bytes);
    place.open().expect("opens").verify(&|_| ()).expect("is whole again");
}

#[test]
fn a_section_table_that_lies_is_refused() {
    let place = Place::with(&meshes()[1]);
    let (bytes, sections) = (place.bytes(), place.open().expect("opens").sections().to_vec());
    let lie = |kind: Kind, change: fn(&mut Entry), expected: &str| {
        let mut bytes = bytes.clone();
        let at = 128 + ENTRY * sections.iter().position(|section| section.kind == kind).expect("there");
        let mut entry: Entry = bytemuck::pod_read_unaligned(&bytes[at..at + ENTRY]);
        change(&mut entry);
        bytes[at..at + ENTRY].copy_from_slice(bytemuck::bytes_of(&entry));
        reseal_first(&mut bytes);
        let message = refused(&place, &bytes);
        assert!(message.contains(expected), "\"{message}\" does not say {expected}");
    };
    lie(Kind::Nodes, |e| e.kind = 99, "there is no kind 99");
    lie(Kind::Nodes, |e| e.element = 4, "nodes has elements of 8 bytes, not 4");
    lie(Kind::Nodes, |e| e.count += 1, "nodes cannot have");
    lie(Kind::Nodes, |e| e.count += 1 << 61, "nodes cannot have");
    lie(Kind::Nodes, |e| e.offset += 8, "between two pages");
    lie(Kind::Triangles, |e| e.offset = 65_536, "inside of what is before it");
    lie(Kind::Triangles, |e| e.offset = 0, "inside of what is before it");
    lie(Kind::Triangles, |e| e.offset = 1 << 40, "goes beyond");
    lie(Kind::Triangles, |e| e.offset = u64::MAX - 65_535, "goes beyond");
    lie(Kind::Triangles, |e| (e.count, e.bytes) = (1 << 30, 48 << 30), "goes beyond");
    lie(Kind::Nodes, |e| (e.kind, e.element, e.count) = (1, 1, e.bytes), "meta is there twice");
    lie(Kind::Meta, |e| (e.kind, e.element, e.count) = (14, 4, 0), "cannot have");
    lie(Kind::Meta, |e| (e.kind, e.element, e.count, e.bytes) = (14, 4, 1, 4), "there is no meta section");
    lie(Kind::Triangles, |e| (e.count, e.bytes) = (299, 299 * 48), "299 elements of triangles, 300 expected");
    lie(Kind::TriangleColors, |e| (e.count, e.bytes) = (0, 0), "0 elements of triangle-colors, 300 expected");
    lie(Kind::TriangleColors, |e| e.kind = 12, "elements of triangle-colors, 300 expected");
}

#[test]
fn a_header_that_lies_is_refused() {
    let place = Place::with(&meshes()[0]);
    let bytes = place.bytes();
    let lie = |at: usize, value: u64, expected: &str| {
        let mut bytes = bytes.clone();
        set_u64(&mut bytes, at, value);
        reseal_first(&mut bytes);
        let message = refused(&place, &bytes);
        assert!(message.contains(expected), "\"{message}\" does not say {expected}");
    };
    let senseless = "its header makes no sense";
    lie(24, 256, senseless);
    lie(32, 32 << 32 | 1 << 20, senseless);
    lie(32, 16 << 32 | 10, senseless);
    lie(40, 0, senseless);
    lie(40, BLOCK as u64 - 4, senseless);
    lie(40, u64::MAX - 4095, senseless);
    lie(48, 3, senseless);
    lie(48, 1 << 62, senseless);
    lie(64, 512, senseless);
    lie(72, 1, senseless);
    lie(12, (bytes.len() as u64) << 32, senseless);
    lie(56, 0, "its checksum table is damaged");
    lie(16, u64::MAX, "it is cut short");
    lie(16, 100, "bytes follow its end");
}

/// What puts something else into the meta section of a scene, and expects the file to be refused.
pub(super) fn liar(place: &Place) -> impl Fn(&str, &str, &str) {
    let (bytes, section) = (place.bytes(), *place.open().expect("opens").section(Kind::Meta).expect("there"));
    // Without the white space, so that there is room for lies.
    let json: serde_json::Value = serde_json::from_slice(&bytes[section.range()]).expect("JSON");
    let json = json.to_string();
    move |from, to, expected| {
        assert!(json.contains(from), "there is no {from} in {json}");
        let mut lying = json.replace(from, to).into_bytes();
        lying.resize(section.bytes as usize, b' ');
        let mut bytes = bytes.clone();
        bytes[section.range()].copy_from_slice(&lying);
        reseal(&mut bytes);
        let message = refused(place, &bytes);
        assert!(message.contains(expected), "\"{message}\" does not say {expected}");
    }
}

#[test]
fn a_meta_section_without_sense_is_refused() {
    let place = Place::with(&meshes()[3]);
    let lie = liar(&place);
    let senseless = "its meta section makes no sense: ";
    lie("{", "[", senseless);
    lie("\"source\"", "\"sauces\"", senseless);
    lie("\"bins\":32", "\"bins\":1", "build.bins");
    lie("\"scale_exponent\":0", "\"scale_exponent\":9999", "2^9999");
    lie("\"vertices\":900", "\"vertices\":901", "900 elements of positions, 901 expected");
    lie("\"triangles\":300", "\"triangles\":-1", senseless);
    lie("per-material", "per-mineral", senseless);
    lie("\"uses\":[150,150]", "\"uses\":[150,151]", "its uses of materials are not those of its triangles");
    lie("\"uses\":[150,150]", "\"uses\":[300]", "its uses of materials are not those of its triangles");
    lie("\"attributes\":false", "\"attributes\":true", "elements of material-of-triangle, 0 expected");
}

#[test]
fn what_checksums_cannot_know_is_looked_at() {
    let mesh = &meshes()[3];
    let place = Place::with(mesh);
    let (bytes, sections) = (place.bytes(), place.open().expect("opens").sections().to_vec());
    // A first word that no such section may have, with checksums made right for it.
    let forged = |kind: Kind, word: u32| {
        let mut bytes = bytes.clone();
        let at = sections.iter().find(|section| section.kind == kind).expect("there").range().start;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        if kind == Kind::Nodes {
            bytes[at + 4..at + 8].copy_from_slice(&(u32::MAX - 1).to_le_bytes());
        }
        reseal(&mut bytes);
        place.set(&bytes);
        place.open().expect("opens")
    };
    let message = |result: Result<()>| result.expect_err("it makes no sense").to_string();
    let tree = forged(Kind::Nodes, 0).tree().map(drop);
    assert!(message(tree).contains("its tree is none: the tree has a root with children at"));
    let mesh = forged(Kind::Positions, f32::NAN.to_bits()).mesh().map(drop);
    assert!(message(mesh).contains("a vertex of its mesh is not finite"));
    let mesh = forged(Kind::Indices, 900).mesh().map(drop);
    assert!(message(mesh).contains("names a vertex that is not there"));
    let file = forged(Kind::MaterialOfTriangle, 2);
    for result in [file.mesh().map(drop), file.stored().map(drop)] {
        assert!(message(result).contains("a material that is not there"));
    }
    let file = forged(Kind::MaterialOfTriangle, 1);
    for result in [file.mesh().map(drop), file.stored().map(drop)] {
        assert!(message(result).contains("other numbers of triangles than it says"));
    }
}

/// A disk with room for so many bytes.
struct Disk<W>(W, usize);

impl<W: Write> Write for Disk<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let room = bytes.len().min(self.1);
        if room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.1 -= room;
        self.0.write(&bytes[..room])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl<W: io::Seek> io::Seek for Disk<W> {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_full_disk_leaves_the_old_file_and_nothing_else() {
    let place = Place::with(&meshes()[0]);
    let before = place.bytes();
    let array = vec![7; 100_000];
    let sections: [(Kind, &[u8]); 2] = [(Kind::Meta, &array), (Kind::Indices, &[])];
    let write = |room| {
        write_whole(&place.path, |file| {
            let mut out = Out::new(Disk(file, room), &|_| ())?;
            sections.iter().try_for_each(|(kind, bytes)| out.section(*kind, bytes).map(drop))?;
            out.finish().map(drop)
        })
    };
    // The first block is written twice.
    let all = length(sections.iter().map(|(_, bytes)| bytes.len())) as usize + BLOCK;
    for room in [0, 100, BLOCK, 65_536, 150_000, all - BLOCK, all - 1] {
        let full = write(room);
        let message = full.expect_err("there is no room").to_string();
        assert!(message.starts_with(&format!("cannot write {}: ", place.path.display())), "{message}");
        assert_eq!((place.files(), place.bytes() == before), (1, true));
    }
    write(all).expect("just enough");
    assert_eq!(place.bytes().len(), all - BLOCK);
}
