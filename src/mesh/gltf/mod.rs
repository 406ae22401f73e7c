//! glTF 2.0, as JSON (`.gltf`) or in one piece (`.glb`), through the `gltf` crate.
//!
//! The crate reads the document. What it does not promise is done here: that no file makes it panic or ask for memory
//! that it cannot fill (`container`, `elements`), and that buffers and pictures come from the model's folder alone
//! (`uri`). Pictures are not opened.
//!
//! The scene becomes one mesh: every mesh once for each node that shows it, with the vertices that its triangles use, in
//! their order, in the scene's coordinates, computed in double precision. Where a transform mirrors, corners change places, so that fronts stay
//! fronts. A primitive without a material is matt and grey, not the white metal that glTF's defaults describe; if no
//! primitive has one, vertices have their own colours where the file gives any.

mod buffers;
mod container;
mod corners;
mod count;
mod elements;
mod materials;
mod nodes;
mod primitives;
mod scene;
#[cfg(test)]
mod tests;
mod textures;
mod uri;
mod view;

use super::lists::{InMemory, Lists, no_room};
use super::{Attributes, Colors, Image, Material, Mesh, ReadReport};
use buffers::Buffers;
pub(super) use count::count;
use glam::Vec3;
use primitives::Part;
use scene::Builder;
use std::collections::{HashMap, HashSet};
use std::path::Path;
use textures::Textures;

/// What a glTF file's scene holds.
pub(super) struct Raw<L: Lists> {
    pub positions: L::Of<Vec3>,
    pub triangles: L::Of<[u32; 3]>,
    /// By triangle, if any has some.
    pub attributes: Option<L::Of<Attributes>>,
    /// Vertices' colours, if they count.
    pub of_vertices: Option<L::Of<[u8; 3]>>,
    /// Materials, if they count, and that of each triangle.
    pub of_materials: Option<(Vec<Material>, L::Of<u32>)>,
    /// The pictures that materials name.
    pub images: Vec<Image>,
}

/// Parses a glTF file's bytes; files that it names are looked up beside `path`.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let raw = parse_to(&InMemory, bytes, path, report, progress, None)?;
    let colors = match (raw.of_materials, raw.of_vertices) {
        (Some((materials, of_triangle)), _) => Colors::PerMaterial { materials, of_triangle },
        (None, Some(of_vertices)) => Colors::PerVertex(of_vertices),
        (None, None) => Colors::default(),
    };
    let attributes = raw.attributes.unwrap_or_default();
    Ok(Mesh { positions: raw.positions, triangles: raw.triangles, colors, attributes, images: raw.images })
}

/// Parses a glTF file's bytes, to lists of a kind. `let_go` lets go of what is in memory of them: with it, it is called
/// again and again, and not much of buffers is in memory at any time.
pub(super) fn parse_to<L: Lists>(
    lists: &L,
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
    let_go: Option<&dyn Fn()>,
) -> Result<Raw<L>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let (document, carried) = container::open(bytes, report)?;
    let buffers = Buffers::open(&document, carried, folder, let_go)?;
    let keep = |bytes: &[u8]| lists.picture(bytes);
    let mut textures = Textures::new(&document, &buffers, folder, &keep);
    let surfaces = document.materials().map(|source| materials::read(&source, &file, &mut textures, report));
    let surfaces = surfaces.collect::<Result<Vec<_>, _>>()?;
    let images = textures.finish().map_err(no_room)?;

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
    let mut builder = Builder::new(lists, &placed, materials, report)?;
    for (parts, transform) in &placed {
        for part in *parts {
            builder.add(part, transform, progress)?;
        }
    }
    Ok(builder.finish(images, report))
}
