//! glTF 2.0, as JSON (`.gltf`) or in one piece (`.glb`), through the `gltf` crate.
//!
//! The crate reads the document. What it does not promise is done here: that no file makes it panic or ask for memory
//! that it cannot fill (`container`, `elements`), and that buffers and pictures come from the model's folder alone
//! (`uri`). Pictures are not opened.
//!
//! The scene becomes one mesh: every mesh once for each node that shows it, with its vertices in the scene's
//! coordinates, computed in double precision. Where a transform mirrors, corners change places, so that fronts stay
//! fronts. A primitive without a material is matt and grey, not the white metal that glTF's defaults describe; if no
//! primitive has one, vertices have their own colours where the file gives any.

mod buffers;
mod container;
mod elements;
mod materials;
mod nodes;
mod primitives;
mod scene;
#[cfg(test)]
mod tests;
mod textures;
mod uri;

use super::{Mesh, ReadReport};
use buffers::Buffers;
use primitives::Part;
use scene::Builder;
use std::collections::{HashMap, HashSet};
use std::path::Path;
use textures::Textures;

/// Parses a glTF file's bytes; files that it names are looked up beside `path`.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let (document, carried) = container::open(bytes, report)?;
    let buffers = Buffers::open(&document, carried, folder)?;
    let mut textures = Textures::new(&document, &buffers, folder);
    let surfaces = document.materials().map(|source| materials::read(&source, &file, &mut textures, report));
    let surfaces = surfaces.collect::<Result<Vec<_>, _>>()?;
    let images = textures.images;

    let instances = nodes::instances(&document)?;
    let shown: HashSet<usize> = instances.iter().map(|instance| instance.mesh).collect();
    let mut parts: HashMap<usize, Vec<Part<'_>>> = HashMap::new();
    for (number, mesh) in document.meshes().enumerate() {
        if shown.contains(&number) {
            let set = |material: usize| surfaces[material].set;
            let read = mesh.primitives().map(|p| Part::read(&p, &document, &buffers, set, report));
            let read = read.filter_map(Result::transpose).collect::<Result<_, _>>();
            parts.insert(number, read.map_err(|e| format!("mesh {number}: {e}"))?);
        }
    }
    let placed: Vec<_> =
        instances.iter().map(|instance| (&*parts[&instance.mesh], instance.transform)).collect();
    let materials = surfaces.into_iter().map(|surface| surface.material).collect();
    let mut builder = Builder::new(&placed, materials, report)?;
    for (i, (parts, transform)) in placed.iter().enumerate() {
        progress(i as f32 / placed.len() as f32);
        for part in *parts {
            builder.add(part, transform)?;
        }
    }
    Ok(Mesh { images, ..builder.finish(report) })
}
