//! What `info` says about materials and pictures.

use crate::cli::report::{Lines, bytes, counted};
use crate::mesh::{Colors, Image, ImageSource, Material, Mesh};
use serde::Serialize;
use std::fs;

/// Where the triangles' colours come from, and what their materials do with light.
#[derive(Debug, Serialize)]
pub struct ColorReport<'a> {
    kind: &'static str,
    /// Whether triangles have texture coordinates or normals.
    attributes: bool,
    /// Names and how many triangles have them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<MaterialReport<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    images: Vec<ImageReport<'a>>,
}

#[derive(Debug, Serialize)]
struct MaterialReport<'a> {
    name: &'a str,
    triangles: u64,
    diffuse: [f32; 3],
    /// What it does beside scattering light.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    does: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
struct ImageReport<'a> {
    name: &'a str,
    /// Of its file; `None` if it is missing.
    bytes: Option<u64>,
    /// What is wrong, if it is missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    missing: Option<String>,
}

/// What a material may do beside scattering light: what it is called, and whether one does it.
type Deed = (&'static str, fn(&Material) -> bool);

const DEEDS: [Deed; 6] = [
    ("maps", |material| material.maps.all().next().is_some()),
    ("mirrors", |material| material.reflects),
    ("highlights", |material| !material.reflects && material.specular.max_element() > 0.0),
    ("transmission", |material| material.transmission.max_element() > 0.0),
    ("holes", |material| material.opacity < 1.0 || material.maps.opacity.is_some()),
    ("emission", Material::emits),
];

/// More materials are counted, but not listed.
const LISTED: usize = 40;

impl<'a> ColorReport<'a> {
    /// Those of a mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        let kind = match &mesh.colors {
            Colors::Uniform(_) => "uniform",
            Colors::PerTriangle(_) => "per triangle",
            Colors::PerVertex(_) => "per vertex",
            Colors::PerMaterial { .. } => "per material",
        };
        let materials = mesh.colors.materials().iter().zip(mesh.colors.uses());
        let materials = materials.map(|(material, triangles)| MaterialReport {
            name: &material.name,
            triangles,
            diffuse: material.diffuse.to_array(),
            does: DEEDS.iter().filter(|(_, does)| does(material)).map(|(deed, _)| *deed).collect(),
        });
        Self {
            kind,
            attributes: !mesh.attributes.is_empty(),
            materials: materials.collect(),
            images: mesh.images.iter().map(ImageReport::new).collect(),
        }
    }

    /// The same in words: how many materials do what, those that most triangles have, and the pictures.
    pub fn describe(&self, lines: &mut Lines) {
        let attributes = if self.attributes { ", texture coordinates or normals" } else { "" };
        if self.materials.is_empty() {
            lines.add("colors", format!("{}{attributes}", self.kind));
        } else {
            let materials = counted(self.materials.len() as u64, "material");
            lines.add("colors", format!("{}, {materials}{}{attributes}", self.kind, self.deeds()));
            let mut listed: Vec<_> = self.materials.iter().collect();
            if listed.len() > LISTED {
                listed.sort_by_key(|material| std::cmp::Reverse(material.triangles));
            }
            for MaterialReport { name, triangles, diffuse: [r, g, b], does } in listed.iter().take(LISTED) {
                let does: String = does.iter().map(|deed| format!(", {deed}")).collect();
                let triangles = counted(*triangles, "triangle");
                lines.add("", format!("{name} ({r:.3} {g:.3} {b:.3}), {triangles}{does}"));
            }
            if let Some(more) = listed.len().checked_sub(LISTED).filter(|&more| more > 0) {
                lines.add("", format!("and {more} with fewer triangles"));
            }
        }
        if self.images.is_empty() {
            return;
        }
        let all = self.images.iter().filter_map(|image| image.bytes).sum();
        lines.add("pictures", format!("{} of {}", self.images.len(), bytes(all)));
        for ImageReport { name, bytes: length, missing } in &self.images {
            let said = match (length, missing) {
                (Some(length), _) => format!("{:>9} {name}", bytes(*length)),
                (None, why) => format!("{:>9} {name} {}", "missing:", why.as_deref().unwrap_or_default()),
            };
            lines.add("", said);
        }
    }

    /// How many materials do what.
    fn deeds(&self) -> String {
        let count = |deed| self.materials.iter().filter(|material| material.does.contains(&deed)).count();
        let counts = DEEDS.iter().map(|(deed, _)| (count(*deed), deed)).filter(|(count, _)| *count > 0);
        counts.map(|(count, deed)| format!(", {count} with {deed}")).collect()
    }
}

impl<'a> ImageReport<'a> {
    fn new(image: &'a Image) -> Self {
        let length = match &image.source {
            ImageSource::File(path) => fs::metadata(path)
                .map(|about| about.len())
                .map_err(|error| format!("cannot be read: {error}")),
            ImageSource::Bytes(bytes) => Ok(bytes.len() as u64),
            ImageSource::Packed(packed) => Ok(packed.bytes()),
            ImageSource::Missing(why) => Err(why.clone()),
        };
        Self { name: &image.name, bytes: length.as_ref().ok().copied(), missing: length.err() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::shapes;
    use crate::mesh::{Attributes, Channel, Map, Maps};
    use glam::Vec3;

    fn text(mesh: &Mesh) -> String {
        let mut lines = Lines::default();
        ColorReport::new(mesh).describe(&mut lines);
        lines.text().to_owned()
    }

    #[test]
    fn materials_are_counted_by_what_they_do_and_pictures_listed() {
        let mut mesh = shapes::soup(50, 1);
        assert!(text(&mesh).trim_end().ends_with("uniform"), "{}", text(&mesh));
        let maps = Maps { diffuse: Some(Map::whole(0, Channel::Color)), ..Maps::default() };
        let wood = Material { maps, ..Material::matt("wood", Vec3::X) };
        let lamp = Material { emission: Vec3::ONE, ..Material::matt("lamp", Vec3::ZERO) };
        let mut materials = vec![Material::matt("chalk", Vec3::ONE), wood, lamp.clone()];
        let of_triangle: Vec<u32> = (0..50).map(|i| i % 3).collect();
        mesh.colors = Colors::PerMaterial { materials: materials.clone(), of_triangle: of_triangle.clone() };
        mesh.attributes = vec![Attributes::NONE; 50];
        let image = |name: &str, source| Image { name: name.into(), source };
        mesh.images = vec![
            image("wood.png", ImageSource::Bytes(vec![0; 2048].into())),
            image("lost.png", ImageSource::Missing("is not there".into())),
        ];
        let said = text(&mesh);
        for expected in [
            "per material, 3 materials, 1 with maps, 1 with emission, texture coordinates or normals\n",
            "chalk (1.000 1.000 1.000), 17 triangles\n",
            "wood (1.000 0.000 0.000), 17 triangles, maps\n",
            "lamp (0.000 0.000 0.000), 16 triangles, emission\n",
            "2 of 2.00 KiB\n",
            "2.00 KiB wood.png\n",
            "missing: lost.png is not there\n",
        ] {
            assert!(said.contains(expected), "\"{expected}\" is not in:\n{said}");
        }
        // Of many, those that most triangles have.
        materials.splice(0..0, vec![lamp; LISTED]);
        let of_triangle = of_triangle.into_iter().map(|material| material + LISTED as u32).collect();
        mesh.colors = Colors::PerMaterial { materials, of_triangle };
        let said = text(&mesh);
        assert!(said.contains("and 3 with fewer triangles") && said.contains("chalk"), "{said}");
        assert!(said.contains("43 materials, 1 with maps, 41 with emission"), "{said}");
    }
}
