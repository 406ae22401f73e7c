//! From a file's bytes to a glTF document: the GLB container, the JSON, and what must hold before any of it is used.

use crate::mesh::ReadReport;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use gltf::json::{self, Root};
use gltf::{Document, Glb};
use serde::Deserialize;
use std::borrow::Cow;

/// Extensions that are followed.
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

/// Takes a `.gltf` or a `.glb` file apart, whichever it is by its first bytes: a document whose indices all lead
/// somewhere, and the buffer that a GLB file carries.
pub(super) fn open<'a>(
    bytes: &'a [u8],
    report: &mut ReadReport,
) -> Result<(Document, Option<&'a [u8]>), String> {
    let (json, carried) = if bytes.starts_with(b"glTF") { split(bytes, report)? } else { (bytes, None) };
    // A byte-order mark is forbidden, and common.
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    check_version(json)?;
    let mut root: Root = serde_json::from_slice(json).map_err(|e| format!("no glTF 2.0: {e}"))?;
    check_extensions(&mut root, report)?;
    forget_what_is_not_read(&mut root, report);
    check_positions(&mut root)?;
    let document = Document::from_json(root).map_err(|error| match error {
        gltf::Error::Validation(faults) if !faults.is_empty() => {
            let (place, fault) = &faults[0];
            let more = match faults.len() - 1 {
                0 => String::new(),
                more => format!(", and {more} more such faults"),
            };
            format!("invalid glTF: {place}: {}{more}", fault.to_string().to_lowercase())
        }
        other => format!("invalid glTF: {other}"),
    })?;
    Ok((document, carried))
}

/// A GLB file's JSON and buffer.
fn split<'a>(bytes: &'a [u8], report: &mut ReadReport) -> Result<(&'a [u8], Option<&'a [u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4)?.first_chunk().map(|word| u32::from_le_bytes(*word));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("a GLB file that is cut short within its header".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version}, only 2 is understood; convert it to glTF 2.0"));
    }
    // The crate takes the header's 12 bytes from this without a look.
    let Some(whole) = bytes.get(..length as usize).filter(|whole| whole.len() >= 12) else {
        return Err(format!(
            "its header announces {length} bytes, but the file has {}: it is cut short",
            bytes.len()
        ));
    };
    report.trailing_bytes = (bytes.len() - whole.len()) as u64;
    let glb = Glb::from_slice(whole).map_err(|e| format!("a GLB file that is cut short or damaged: {e}"))?;
    let borrowed = |part: Cow<'a, [u8]>| match part {
        Cow::Borrowed(part) => part,
        Cow::Owned(_) => unreachable!("a slice's parts are not copied"),
    };
    Ok((borrowed(glb.json), glb.bin.map(borrowed)))
}

/// An error for other versions, whose JSON would fail in ways that say nothing.
fn check_version(json: &[u8]) -> Result<(), String> {
    #[derive(Deserialize)]
    struct Head {
        asset: Asset,
    }
    #[derive(Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Asset {
        version: String,
        min_version: Option<String>,
    }
    let Head { asset } = serde_json::from_slice(json).map_err(|e| format!("no glTF: {e}"))?;
    // What minor versions add can be left out, unless the file says that it needs them.
    let needed = asset.min_version.filter(|needed| needed != "2.0");
    match needed.or((asset.version.split('.').next() != Some("2")).then_some(asset.version)) {
        None => Ok(()),
        Some(other) => Err(format!("glTF version {other:?}, only 2.0 is understood; convert it")),
    }
}

/// Notes the extensions that are ignored; an error if one of them cannot be.
fn check_extensions(root: &mut Root, report: &mut ReadReport) -> Result<(), String> {
    // What changes looks, not shapes, may be left out even if the file requires it.
    let looks = |name: &str| {
        name.starts_with("KHR_materials_") || ["KHR_lights_punctual", "KHR_xmp_json_ld"].contains(&name)
    };
    let ignored = |name: &&String| !FOLLOWED.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().filter(ignored).find(|name| !looks(name)) {
        return Err(format!("needs the extension {name}, which is not supported; export it without"));
    }
    for name in root.extensions_required.iter().chain(&root.extensions_used).filter(ignored) {
        report.note(format!("extension {name} ignored"));
    }
    // The crate knows fewer.
    root.extensions_required.clear();
    Ok(())
}

/// Takes out what no mesh comes of, so that faults in it are none.
fn forget_what_is_not_read(root: &mut Root, report: &mut ReadReport) {
    if root.nodes.iter().any(|node| node.skin.is_some() && node.mesh.is_some()) {
        report.note("skins ignored: meshes are as before they were posed".into());
    }
    if root.meshes.iter().flat_map(|mesh| &mesh.primitives).any(|primitive| primitive.targets.is_some()) {
        report.note("morph targets ignored".into());
    }
    root.animations.clear();
    root.cameras.clear();
    root.skins.clear();
    for node in &mut root.nodes {
        node.skin = None;
        node.camera = None;
    }
    for primitive in root.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.targets = None;
        primitive.attributes.retain(|name, _| match name {
            Checked::Valid(name) => {
                use Semantic::{Colors, Normals, Positions, TexCoords};
                matches!(name, Positions | Normals | TexCoords(_) | Colors(0))
            }
            Checked::Invalid => false,
        });
    }
}

/// An error for primitives whose positions are nowhere, on which the crate's validation panics.
///
/// It also insists on their bounds, which nothing here reads and which many files lack: any will do.
fn check_positions(root: &mut Root) -> Result<(), String> {
    let Root { meshes, accessors, .. } = root;
    for (mesh, number) in meshes.iter().zip(0..) {
        for (primitive, part) in mesh.primitives.iter().zip(0..) {
            let index = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let Some(accessor) = index.and_then(|index| accessors.get_mut(index.value())) else {
                return Err(format!("mesh {number}: primitive {part} has no positions; export it again"));
            };
            let zeros = || Some(json::Value::from(vec![0.0; 3]));
            (accessor.min, accessor.max) = (zeros(), zeros());
        }
    }
    Ok(())
}
