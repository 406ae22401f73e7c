//! From a file's bytes to glTF's document: the GLB container, JSON, and what must hold before any of it is used.

use super::Notes;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use gltf::json::{Root, Value};
use gltf::{Document, Glb};
use serde::Deserialize;

/// Extensions that are followed wherever they appear.
const FOLLOWED: [&str; 9] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// A checked document, and the buffer that a GLB file carries itself.
pub(super) type Container<'a> = (Document, Option<&'a [u8]>);

/// Takes a `.gltf` or a `.glb` file apart; its first bytes say which it is.
pub(super) fn open<'a>(bytes: &'a [u8], notes: &mut Notes) -> Result<Container<'a>, String> {
    let (json, carried) = match bytes.starts_with(b"glTF") {
        true => split(bytes, notes)?,
        false => (bytes, None),
    };
    // A byte-order mark is forbidden and common.
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    check_version(json)?;
    let mut root: Root = serde_json::from_slice(json).map_err(|e| format!("not glTF 2.0: {e}"))?;
    check_extensions(&mut root, notes)?;
    check_positions(&mut root)?;
    forget_what_is_not_read(&mut root, notes);
    let document = Document::from_json(root).map_err(|error| match error {
        gltf::Error::Validation(faults) => {
            let more = if faults.len() > 1 { format!(" (and {} more faults)", faults.len() - 1) } else { String::new() };
            let fault = faults.first().map(|(path, fault)| format!("{path}: {fault}"));
            format!("invalid glTF: {}{more}", fault.unwrap_or_default().to_lowercase_last())
        }
        other => format!("invalid glTF: {other}"),
    })?;
    Ok((document, carried))
}

/// A GLB file's JSON and buffer.
fn split<'a>(bytes: &'a [u8], notes: &mut Notes) -> Result<(&'a [u8], Option<&'a [u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4)?.first_chunk().map(|word| u32::from_le_bytes(*word));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("a GLB file that is cut short within its header".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version}; only 2 is understood, convert it to glTF 2.0"));
    }
    // The crate subtracts the header's size from this unseen.
    let Some(whole) = bytes.get(..length as usize).filter(|whole| whole.len() >= 12) else {
        return Err(format!("its header announces {length} bytes, but the file has {}: it is cut short", bytes.len()));
    };
    notes.trailing_bytes = (bytes.len() - whole.len()) as u64;
    // What `from_slice` gives borrows from the slice, but for its type.
    let glb = Glb::from_slice(whole).map_err(|e| format!("a GLB file that is cut short or damaged: {e}"))?;
    let json_at = 20;
    let json_end = json_at + glb.json.len();
    let carried = glb.bin.map(|bin| &whole[json_end + 8..][..bin.len()]);
    Ok((&whole[json_at..json_end], carried))
}
