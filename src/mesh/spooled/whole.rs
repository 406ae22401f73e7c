//! What a file held, in files of its own, whatever its format.

use super::SpooledColors;
use crate::mesh::lists::{InFiles, Lists};
use crate::mesh::ply::Shades;
use crate::mesh::{Attributes, Colors, Image, ReadReport, color, gltf, obj, ply, stl};
use crate::spool::{Spool, Spooled};
use glam::Vec3;
use std::io;

/// What a file held, not checked yet.
pub(in crate::mesh) struct Whole {
    pub positions: Spooled<Vec3>,
    pub triangles: Spooled<[u32; 3]>,
    pub colors: SpooledColors,
    pub attributes: Option<Spooled<Attributes>>,
    pub images: Vec<Image>,
}

impl Whole {
    /// What a PLY file held; says what was bad of it.
    pub fn of_ply(raw: ply::Raw<InFiles>, lists: &InFiles, report: &mut ReadReport) -> io::Result<Self> {
        let colors = match (bytes_of(raw.of_faces, lists)?, bytes_of(raw.of_vertices, lists)?) {
            (Some(of_faces), _) => SpooledColors::PerTriangle(of_faces),
            (None, Some(of_vertices)) => SpooledColors::PerVertex(of_vertices),
            (None, None) => default_color(),
        };
        let triangles = raw.triangles.finish()?;
        let attributes = raw.looks.of_spooled(&triangles, lists, report)?;
        Ok(Self { positions: raw.positions.finish()?, triangles, colors, attributes, images: Vec::new() })
    }

    /// What an OBJ file held.
    pub fn of_obj(raw: obj::Raw<InFiles>, lists: &InFiles) -> io::Result<Self> {
        let attributes = raw.corners.attributes(raw.triangles.len(), lists)?;
        let (colors, images) = if let Some(colors) = raw.of_vertices {
            (SpooledColors::PerVertex(quantized(colors, lists)?), Vec::new())
        } else if let Some((mut materials, of_triangle)) = raw.of_materials {
            let mut of_triangle = of_triangle.finish()?;
            if raw.any_unknown {
                let known = obj::known(&mut materials);
                let mut all: Spool<u32> = lists.list()?;
                of_triangle.each(|_, some| {
                    some.iter().for_each(|&material| all.push(known(material)));
                    Ok::<(), io::Error>(())
                })?;
                of_triangle = all.finish()?;
            }
            (SpooledColors::PerMaterial { materials, of_triangle }, raw.images)
        } else {
            (default_color(), Vec::new())
        };
        let (positions, triangles) = (raw.positions.finish()?, raw.triangles.finish()?);
        Ok(Self { positions, triangles, colors, attributes, images })
    }

    /// What a glTF file's scene held.
    pub fn of_gltf(raw: gltf::Raw<InFiles>) -> io::Result<Self> {
        let colors = match (raw.of_materials, raw.of_vertices) {
            (Some((materials, of_triangle)), _) => {
                SpooledColors::PerMaterial { materials, of_triangle: of_triangle.finish()? }
            }
            (None, Some(of_vertices)) => SpooledColors::PerVertex(of_vertices.finish()?),
            (None, None) => default_color(),
        };
        let (positions, triangles) = (raw.positions.finish()?, raw.triangles.finish()?);
        let attributes = raw.attributes.map(Spool::finish).transpose()?;
        Ok(Self { positions, triangles, colors, attributes, images: raw.images })
    }

    /// What an STL file held. `progress` is told now and then what part (0 to 1) is behind.
    pub fn of_stl(raw: stl::Weld, lists: &InFiles, progress: &dyn Fn(f32)) -> io::Result<Self> {
        let (positions, triangles) = raw.finish(lists, progress)?;
        Ok(Self { positions, triangles, colors: default_color(), attributes: None, images: Vec::new() })
    }
}

/// The colour of a mesh that has none.
fn default_color() -> SpooledColors {
    let Colors::Uniform(color) = Colors::default() else { unreachable!("it is one colour") };
    SpooledColors::Uniform(color)
}

/// Colours as bytes; nothing if no element had any.
fn bytes_of(shades: Shades<InFiles>, lists: &InFiles) -> io::Result<Option<Spooled<[u8; 3]>>> {
    match shades {
        Shades::None => Ok(None),
        Shades::Bytes(colors) => colors.finish().map(Some),
        Shades::Floats(colors) => quantized(colors, lists).map(Some),
    }
}

/// Colours as bytes.
fn quantized(colors: Spool<[f32; 3]>, lists: &InFiles) -> io::Result<Spooled<[u8; 3]>> {
    let colors = colors.finish()?;
    let mut greatest = 0.0_f32;
    colors.each(|_, some| {
        greatest = some.iter().flatten().fold(greatest, |greatest, &c| greatest.max(c));
        Ok::<(), io::Error>(())
    })?;
    let mut bytes = lists.list()?;
    colors.each(|_, some| {
        bytes.extend_from_slice(&color::quantize_to(greatest, some));
        Ok::<(), io::Error>(())
    })?;
    bytes.finish()
}
