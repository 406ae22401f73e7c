//! Several meshes in files made one, as [`Mesh::join`](crate::mesh::Mesh::join) makes one of meshes in memory: the same to
//! the byte.
//!
//! Lists are copied one behind the other. Where colours by vertex ask for a vertex of its own for each colour that its
//! triangles have, these are found as corners of an STL file are ([`Weld`]), whose keys are a vertex with a colour.

use super::{SpooledColors, SpooledMesh};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::mesh::check::is_flat;
use crate::mesh::color::encode;
use crate::mesh::join::{ByColor, Common, Kind, average_of, check_size, shift_images};
use crate::mesh::lists::InFiles;
use crate::mesh::stl::Weld;
use crate::mesh::{Attributes, Material};
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use std::io;
use std::path::Path;

impl SpooledMesh {
    /// All triangles of several meshes, mesh after mesh, in files in `folder`, which vanish with them. What becomes of
    /// their colours, see [`Mesh::join`](crate::mesh::Mesh::join).
    ///
    /// # Errors
    /// There are more triangles or vertices than one mesh can have, there is no room in `folder`, or no mesh.
    pub fn join(meshes: Vec<Self>, folder: &Path) -> Result<Self> {
        let cannot = |source| Error::Write { path: folder.into(), source };
        let common = Common::of(&meshes.iter().map(|mesh| mesh.colors.kind()).collect::<Vec<_>>());
        let mut meshes = meshes;
        for mesh in &mut meshes {
            match common {
                Common::Same => {}
                Common::Vertices => to_vertices(mesh, folder).map_err(cannot)?,
                Common::Materials => to_materials(mesh, folder).map_err(cannot)?,
            }
        }
        let count = |of: fn(&Self) -> usize| meshes.iter().map(of).sum::<usize>();
        check_size(count(|mesh| mesh.triangles.len()), count(|mesh| mesh.positions.len()))?;
        joined(meshes, folder).map_err(cannot)
    }

    /// How many triangles have corners that lie on one line: as a reader counts them that has all in memory.
    ///
    /// # Errors
    /// The files cannot be read.
    pub fn zero_area_triangles(&self) -> io::Result<u64> {
        let mut count = 0;
        self.triangles.each(|_, some| {
            let corners = self.positions.of_corners(some)?;
            count += corners.into_iter().filter(|&corners| is_flat(corners)).count() as u64;
            Ok::<(), io::Error>(())
        })?;
        Ok(count)
    }
}

impl SpooledColors {
    fn kind(&self) -> Kind<'_> {
        match self {
            Self::Uniform(color) => Kind::Uniform(*color),
            Self::PerTriangle(_) => Kind::PerTriangle,
            Self::PerVertex(_) => Kind::PerVertex,
            Self::PerMaterial { materials, .. } => Kind::PerMaterial(materials),
        }
    }
}

/// Colours of one kind, growing.
enum Growing {
    Uniform(glam::Vec3),
    PerTriangle(Spool<[u8; 3]>),
    PerVertex(Spool<[u8; 3]>),
    PerMaterial { materials: Vec<Material>, of_triangle: Spool<u32> },
}

/// Meshes with colours of one kind, one behind the other. Each one's files go when it has been copied.
fn joined(meshes: Vec<SpooledMesh>, folder: &Path) -> io::Result<SpooledMesh> {
    let mut attributes = None;
    if meshes.iter().any(|mesh| mesh.attributes.is_some()) {
        attributes = Some(Spool::new(folder)?);
    }
    let mut colors = match meshes.first().map(|mesh| &mesh.colors) {
        None => return Err(io::Error::new(io::ErrorKind::InvalidInput, "there is no mesh")),
        Some(SpooledColors::Uniform(color)) => Growing::Uniform(*color),
        Some(SpooledColors::PerTriangle(_)) => Growing::PerTriangle(Spool::new(folder)?),
        Some(SpooledColors::PerVertex(_)) => Growing::PerVertex(Spool::new(folder)?),
        Some(SpooledColors::PerMaterial { .. }) => {
            Growing::PerMaterial { materials: Vec::new(), of_triangle: Spool::new(folder)? }
        }
    };
    let (mut positions, mut triangles) = (Spool::new(folder)?, Spool::new(folder)?);
    let (mut images, mut bounds) = (Vec::new(), Aabb::EMPTY);
    for mesh in meshes {
        let first = positions.len() as u32;
        copy(&mesh.positions, &mut positions)?;
        mesh.triangles.each(|_, some| {
            some.iter().for_each(|corners| triangles.push(corners.map(|vertex| first + vertex)));
            Ok::<(), io::Error>(())
        })?;
        if let Some(all) = &mut attributes {
            match &mesh.attributes {
                Some(list) => copy(list, all)?,
                None => (0..mesh.triangles.len()).for_each(|_| all.push(Attributes::NONE)),
            }
        }
        match (&mut colors, mesh.colors) {
            (Growing::Uniform(_), SpooledColors::Uniform(_)) => {}
            (Growing::PerTriangle(all), SpooledColors::PerTriangle(more))
            | (Growing::PerVertex(all), SpooledColors::PerVertex(more)) => copy(&more, all)?,
            (
                Growing::PerMaterial { materials, of_triangle },
                SpooledColors::PerMaterial { materials: mut more, of_triangle: more_of },
            ) => {
                let first = materials.len() as u32;
                shift_images(&mut more, images.len() as u32);
                materials.extend(more);
                more_of.each(|_, some| {
                    some.iter().for_each(|&material| of_triangle.push(first + material));
                    Ok::<(), io::Error>(())
                })?;
            }
            _ => unreachable!("their kind was made the same"),
        }
        images.extend(mesh.images);
        bounds = bounds.union(mesh.bounds);
    }
    let colors = match colors {
        Growing::Uniform(color) => SpooledColors::Uniform(color),
        Growing::PerTriangle(list) => SpooledColors::PerTriangle(list.finish()?),
        Growing::PerVertex(list) => SpooledColors::PerVertex(list.finish()?),
        Growing::PerMaterial { materials, of_triangle } => {
            SpooledColors::PerMaterial { materials, of_triangle: of_triangle.finish()? }
        }
    };
    let attributes = attributes.map(Spool::finish).transpose()?;
    let (positions, triangles) = (positions.finish()?, triangles.finish()?);
    Ok(SpooledMesh { positions, triangles, colors, attributes, images, bounds })
}

/// Adds a list to another.
fn copy<T: Pod>(list: &Spooled<T>, to: &mut Spool<T>) -> io::Result<()> {
    list.each(|_, some| {
        to.extend_from_slice(some);
        Ok::<(), io::Error>(())
    })
}

/// Makes colours materials, a material for each colour.
fn to_materials(mesh: &mut SpooledMesh, folder: &Path) -> io::Result<()> {
    let mut of_triangle = Spool::new(folder)?;
    let mut by_color = ByColor::default();
    match &mesh.colors {
        SpooledColors::PerMaterial { .. } => return Ok(()),
        SpooledColors::Uniform(color) => {
            by_color.materials.push(Material::matt("", *color));
            (0..mesh.triangles.len()).for_each(|_| of_triangle.push(0));
        }
        SpooledColors::PerTriangle(colors) => colors.each(|_, some| {
            some.iter().for_each(|&color| of_triangle.push(by_color.number(color)));
            Ok::<(), io::Error>(())
        })?,
        SpooledColors::PerVertex(colors) => mesh.triangles.each(|_, some| {
            let colors = colors.of_corners(some)?;
            colors.into_iter().for_each(|colors| of_triangle.push(by_color.number(average_of(colors))));
            Ok::<(), io::Error>(())
        })?,
    }
    let of_triangle = of_triangle.finish()?;
    mesh.colors = SpooledColors::PerMaterial { materials: by_color.materials, of_triangle };
    Ok(())
}

/// Gives vertices the colours of their triangles: a vertex for each colour that one has.
fn to_vertices(mesh: &mut SpooledMesh, folder: &Path) -> io::Result<()> {
    if let SpooledColors::PerVertex(_) = mesh.colors {
        return Ok(());
    }
    let lists = InFiles::new(folder);
    let mut weld = Weld::new(&lists, mesh.triangles.len())?;
    let of_material: Vec<[u8; 3]> = match &mesh.colors {
        SpooledColors::PerMaterial { materials, .. } => {
            materials.iter().map(|material| encode(material.diffuse)).collect()
        }
        SpooledColors::Uniform(color) => vec![encode(*color)],
        SpooledColors::PerTriangle(_) | SpooledColors::PerVertex(_) => Vec::new(),
    };
    mesh.triangles.each(|first, some| {
        let colors = match &mesh.colors {
            SpooledColors::PerTriangle(colors) => {
                let mut these = vec![[0; 3]; some.len()];
                colors.read(first, &mut these)?;
                these
            }
            SpooledColors::PerMaterial { of_triangle, .. } => {
                let mut these = vec![0; some.len()];
                of_triangle.read(first, &mut these)?;
                these.into_iter().map(|material| of_material[material as usize]).collect()
            }
            _ => vec![of_material[0]; some.len()],
        };
        for (corners, [r, g, b]) in some.iter().zip(colors) {
            let color = u32::from_le_bytes([r, g, b, 0]);
            weld.add_keys(corners.map(|vertex| [vertex, color, 0]));
        }
        Ok::<(), io::Error>(())
    })?;
    let (keys, triangles) = weld.finish_keys(&lists, &|_| ())?;
    let (mut positions, mut colors) = (Spool::new(folder)?, Spool::new(folder)?);
    keys.each(|_, some| {
        let vertices: Vec<[u32; 1]> = some.iter().map(|&[vertex, ..]| [vertex]).collect();
        positions.extend_from_slice(mesh.positions.of_places(&vertices)?.as_flattened());
        for &[_, color, _] in some {
            let [r, g, b, _] = color.to_le_bytes();
            colors.push([r, g, b]);
        }
        Ok::<(), io::Error>(())
    })?;
    mesh.positions = positions.finish()?;
    mesh.triangles = triangles;
    mesh.colors = SpooledColors::PerVertex(colors.finish()?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::shapes;
    use crate::mesh::{Channel, Colors, Image, ImageSource, Map, Maps, Mesh};
    use glam::Vec3;

    /// Some triangles, each with a vertex that another one has too, with colours of a kind.
    fn mesh(triangles: usize, kind: usize) -> Mesh {
        let mut mesh = shapes::soup(triangles, kind as u64 + 1);
        let vertices = mesh.positions.len() as u32;
        for (i, corners) in mesh.triangles.iter_mut().enumerate() {
            corners[i % 3] = (i as u32).wrapping_mul(2_654_435_761) % vertices;
        }
        let color = |i: usize| [[255, 0, 0], [3, 200, 9], [17, 18, 19]][i * 7 % 11 % 3];
        let materials = |names: &[&str]| {
            let diffuse = |i: usize| Vec3::new(0.1, 0.3, 0.2 * i as f32);
            let named = names.iter().enumerate();
            named.map(|(i, name)| Material::matt(*name, diffuse(i))).collect::<Vec<_>>()
        };
        let of_triangle = |count: usize| (0..triangles).map(|i| (i * 5 % 7 % count) as u32).collect();
        mesh.colors = match kind {
            0 => Colors::Uniform(Vec3::new(0.2, 0.4, 0.6)),
            1 => Colors::PerTriangle((0..triangles).map(color).collect()),
            2 => Colors::PerVertex((0..mesh.positions.len()).map(color).collect()),
            _ => Colors::PerMaterial { materials: materials(&["a", "b", "c"]), of_triangle: of_triangle(3) },
        };
        if kind > 3 {
            let some = Attributes { uv: [[0.5; 2], [0.25; 2], [kind as f32; 2]], ..Attributes::NONE };
            mesh.attributes = vec![some; triangles];
            let source = ImageSource::Missing("a test".into());
            mesh.images = vec![Image { name: format!("picture {kind}"), source }];
            if let Colors::PerMaterial { materials, .. } = &mut mesh.colors {
                let diffuse = Some(Map::whole(0, Channel::Color));
                materials[1].maps = Maps { diffuse, ..Maps::default() };
            }
        }
        mesh
    }

    #[test]
    fn what_is_joined_in_files_is_what_is_joined_in_memory() {
        let folder = std::env::temp_dir();
        for kinds in [
            &[0, 0][..],
            &[1, 1],
            &[2, 2, 2],
            &[3, 3],
            &[0, 1],
            &[2, 0, 1, 3],
            &[1, 2],
            &[4, 2, 5],
            &[3, 4, 0, 5],
            &[3],
        ] {
            let meshes: Vec<Mesh> = kinds.iter().enumerate().map(|(i, &k)| mesh(500 + 90 * i, k)).collect();
            let spooled =
                meshes.iter().map(|mesh| SpooledMesh::of_mesh(mesh, &folder).expect("room")).collect();
            let joined = SpooledMesh::join(spooled, &folder).expect("fits");
            let whole = Mesh::join(meshes).expect("fits");
            assert!(joined.to_mesh().expect("readable") == whole, "{kinds:?}");
            assert_eq!(joined.bounds, whole.bounds(), "{kinds:?}");
        }
        assert!(SpooledMesh::join(Vec::new(), &folder).is_err());
    }
}
