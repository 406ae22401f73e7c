//! Several meshes made one.

use super::color::{decode, encode};
use super::{Attributes, Colors, MAX_TRIANGLES, Material, Mesh};
use crate::error::{Error, Result};
use glam::Vec3;
use std::collections::HashMap;
use std::mem::discriminant;

impl Mesh {
    /// All triangles of several meshes, mesh after mesh; each keeps its colours, materials, pictures, texture
    /// coordinates and normals.
    ///
    /// Where meshes have colours of different kinds, they become materials, which changes none of them. If a mesh
    /// has them by vertex, and no other a material that is more than a colour, they all have them by vertex: then a
    /// vertex between triangles of several colours is there several times, and materials are rounded to the 8 bits
    /// of a vertex's colour.
    ///
    /// If a mesh has a material that is more than a colour (it shines, lets light through, has a picture), no material
    /// is given up: a mesh with colours by vertex then gets one material for each colour that its triangles have on
    /// average, rounded to 32 steps a channel, so that there are 32768 of them at most.
    ///
    /// # Errors
    /// There are more triangles or vertices than one mesh can have.
    pub fn join(meshes: Vec<Self>) -> Result<Self> {
        let mut meshes = meshes;
        unify(&mut meshes);
        let count = |of: fn(&Self) -> usize| meshes.iter().map(of).sum::<usize>();
        let (triangles, vertices) = (count(|mesh| mesh.triangles.len()), count(|mesh| mesh.positions.len()));
        check_size(triangles, vertices)?;
        let with_attributes = meshes.iter().any(|mesh| !mesh.attributes.is_empty());
        let mut meshes = meshes.into_iter();
        let mut all = meshes.next().unwrap_or_default();
        all.positions.reserve_exact(vertices - all.positions.len());
        all.triangles.reserve_exact(triangles - all.triangles.len());
        if with_attributes {
            all.attributes.reserve_exact(triangles - all.attributes.len());
            all.attributes.resize(all.triangles.len(), Attributes::NONE);
        }
        for mut mesh in meshes {
            let (first, first_image) = (all.positions.len() as u32, all.images.len() as u32);
            all.positions.extend(mesh.positions);
            all.triangles.extend(mesh.triangles.into_iter().map(|corners| corners.map(|i| first + i)));
            if with_attributes {
                all.attributes.extend(mesh.attributes);
                all.attributes.resize(all.triangles.len(), Attributes::NONE);
            }
            if let Colors::PerMaterial { materials, .. } = &mut mesh.colors {
                shift_images(materials, first_image);
            }
            all.images.extend(mesh.images);
            append(&mut all.colors, mesh.colors);
        }
        Ok(all)
    }
}

/// Whether one mesh can have so many triangles and vertices.
///
/// # Errors
/// It cannot.
pub(super) fn check_size(triangles: usize, vertices: usize) -> Result<()> {
    if triangles > MAX_TRIANGLES || vertices > u32::MAX as usize {
        return Err(Error::Mesh(format!(
            "{triangles} triangles with {vertices} vertices are more than one scene can have: leave models out"
        )));
    }
    Ok(())
}

/// Has materials' maps name pictures before which there are so many more now.
pub(super) fn shift_images(materials: &mut [Material], first: u32) {
    let maps = materials.iter_mut().flat_map(|material| material.maps.all_mut());
    maps.for_each(|map| map.image += first);
}

/// Adds colours of the same kind.
fn append(all: &mut Colors, more: Colors) {
    match (all, more) {
        (Colors::PerTriangle(all), Colors::PerTriangle(more))
        | (Colors::PerVertex(all), Colors::PerVertex(more)) => all.extend(more),
        (
            Colors::PerMaterial { materials: all, of_triangle: all_of },
            Colors::PerMaterial { materials: more, of_triangle: more_of },
        ) => {
            let first = all.len() as u32;
            all.extend(more);
            all_of.extend(more_of.into_iter().map(|material| first + material));
        }
        (Colors::Uniform(one), Colors::Uniform(other)) if *one == other => {}
        _ => unreachable!("their kind was made the same"),
    }
}

/// A kind of colours, and what of them has a part in what they become.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind<'a> {
    Uniform(Vec3),
    PerTriangle,
    PerVertex,
    PerMaterial(&'a [Material]),
}

impl<'a> Kind<'a> {
    fn of(colors: &'a Colors) -> Self {
        match colors {
            Colors::Uniform(color) => Self::Uniform(*color),
            Colors::PerTriangle(_) => Self::PerTriangle,
            Colors::PerVertex(_) => Self::PerVertex,
            Colors::PerMaterial { materials, .. } => Self::PerMaterial(materials),
        }
    }
}

/// What colours of several meshes become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Common {
    /// What they are: they are of one kind.
    Same,
    Vertices,
    Materials,
}

impl Common {
    /// What colours of these kinds become.
    pub fn of(kinds: &[Kind<'_>]) -> Self {
        let alike = |pair: &[Kind<'_>]| match (&pair[0], &pair[1]) {
            (Kind::Uniform(one), Kind::Uniform(other)) => one == other,
            (one, other) => discriminant(one) == discriminant(other),
        };
        let more = |kind: &Kind<'_>| match kind {
            Kind::PerMaterial(materials) => materials.iter().any(is_more_than_a_color),
            _ => false,
        };
        if kinds.windows(2).all(alike) {
            Self::Same
        } else if kinds.iter().any(|kind| matches!(kind, Kind::PerVertex)) && !kinds.iter().any(more) {
            Self::Vertices
        } else {
            Self::Materials
        }
    }
}

/// Gives all meshes colours of one kind.
fn unify(meshes: &mut [Mesh]) {
    let kinds: Vec<_> = meshes.iter().map(|mesh| Kind::of(&mesh.colors)).collect();
    let common = Common::of(&kinds);
    let change: fn(&mut Mesh) = match common {
        Common::Same => return,
        Common::Vertices => to_vertices,
        Common::Materials => to_materials,
    };
    meshes.iter_mut().for_each(change);
}

/// Whether a matt surface of its diffuse colour would look different.
fn is_more_than_a_color(material: &Material) -> bool {
    let Material { unlit, specular, transmission, opacity, emission, maps, .. } = material;
    *unlit
        || *opacity < 1.0
        || [specular, transmission, emission].iter().any(|light| **light != Vec3::ZERO)
        || maps.all().next().is_some()
}

/// Makes colours materials, a material for each colour.
fn to_materials(mesh: &mut Mesh) {
    let (materials, of_triangle) = match &mesh.colors {
        Colors::Uniform(color) => (vec![Material::matt("", *color)], vec![0; mesh.triangles.len()]),
        Colors::PerTriangle(colors) => by_color(colors.iter().copied()),
        Colors::PerVertex(colors) => by_color(mesh.triangles.iter().map(|corners| average(corners, colors))),
        Colors::PerMaterial { .. } => return,
    };
    mesh.colors = Colors::PerMaterial { materials, of_triangle };
}

/// A material for each of the triangles' colours, named after it, and which of them each has.
fn by_color(colors: impl Iterator<Item = [u8; 3]>) -> (Vec<Material>, Vec<u32>) {
    let mut by_color = ByColor::default();
    let of_triangle = colors.map(|color| by_color.number(color)).collect();
    (by_color.materials, of_triangle)
}

/// A material for each of some colours, in the order in which they were met.
#[derive(Default)]
pub(super) struct ByColor {
    numbers: HashMap<[u8; 3], u32>,
    pub materials: Vec<Material>,
}

impl ByColor {
    /// Which of them a colour's is, which is named after it.
    pub fn number(&mut self, color: [u8; 3]) -> u32 {
        *self.numbers.entry(color).or_insert_with(|| {
            let [r, g, b] = color;
            self.materials.push(Material::matt(format!("#{r:02x}{g:02x}{b:02x}"), decode(color)));
            self.materials.len() as u32 - 1
        })
    }
}

/// The colour between those of three vertices, in 32 steps a channel.
fn average(corners: &[u32; 3], colors: &[[u8; 3]]) -> [u8; 3] {
    average_of(corners.map(|vertex| colors[vertex as usize]))
}

/// The colour between three, in 32 steps a channel.
pub(super) fn average_of(colors: [[u8; 3]; 3]) -> [u8; 3] {
    let sum: Vec3 = colors.iter().map(|&color| decode(color)).sum();
    encode(sum / 3.0).map(|byte| ((u32::from(byte) * 31 + 127) / 255 * 255 / 31) as u8)
}

/// Gives vertices the colours of their triangles.
fn to_vertices(mesh: &mut Mesh) {
    let colors: Vec<[u8; 3]> = match &mesh.colors {
        Colors::PerVertex(_) => return,
        Colors::Uniform(color) => vec![encode(*color); mesh.triangles.len()],
        Colors::PerTriangle(colors) => colors.clone(),
        Colors::PerMaterial { materials, of_triangle } => {
            let of_material: Vec<_> = materials.iter().map(|material| encode(material.diffuse)).collect();
            of_triangle.iter().map(|&material| of_material[material as usize]).collect()
        }
    };
    let mut numbers = HashMap::new();
    let mut vertices: Vec<(Vec3, [u8; 3])> = Vec::with_capacity(mesh.positions.len());
    for (corners, color) in mesh.triangles.iter_mut().zip(colors) {
        for vertex in corners {
            let position = mesh.positions[*vertex as usize];
            *vertex = *numbers.entry((*vertex, color)).or_insert_with(|| {
                vertices.push((position, color));
                vertices.len() as u32 - 1
            });
        }
    }
    let (positions, colors) = vertices.into_iter().unzip();
    mesh.positions = positions;
    mesh.colors = Colors::PerVertex(colors);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Channel, Image, ImageSource, Map, Maps};

    /// Two triangles of a square at a height.
    fn square(height: f32, colors: Colors) -> Mesh {
        let corner = |x, y| Vec3::new(x, y, height);
        Mesh {
            positions: vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            colors,
            ..Mesh::default()
        }
    }

    fn named(name: &str, diffuse: Vec3) -> Material {
        Material::matt(name, diffuse)
    }

    fn kinds() -> [Colors; 4] {
        [
            Colors::Uniform(Vec3::new(1.0, 0.0, 1.0)),
            Colors::PerTriangle(vec![[255, 0, 0], [0, 255, 255]]),
            Colors::PerVertex(vec![[255, 0, 0], [0, 0, 255], [0, 255, 0], [9, 8, 7]]),
            Colors::PerMaterial {
                materials: vec![named("spare", Vec3::ZERO), named("sky", Vec3::Z), named("sun", Vec3::ONE)],
                of_triangle: vec![1, 2],
            },
        ]
    }

    #[test]
    fn triangles_keep_their_corners_and_colors() {
        // Channels of these colours are 0 or 1, which 8 bits hold; but for [9, 8, 7], which stay bytes.
        for a in kinds() {
            for b in kinds() {
                for c in kinds() {
                    let parts = [(0.0, &a), (1.0, &b), (2.0, &c)].map(|(z, kind)| square(z, kind.clone()));
                    let all = Mesh::join(parts.to_vec()).expect("fits");
                    assert_eq!(all.triangles.len(), 6);
                    for primitive in 0..6 {
                        let (part, own) = (&parts[primitive as usize / 2], primitive % 2);
                        assert_eq!(all.corners(primitive), part.corners(own));
                        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
                            assert_eq!(all.color(primitive, u, v), part.color(own, u, v));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn kinds_change_only_where_they_differ() {
        for colors in kinds() {
            let [one, two] = [0.0, 1.0].map(|z| square(z, colors.clone()));
            let all = Mesh::join(vec![one, two]).expect("fits");
            assert_eq!((discriminant(&all.colors), all.positions.len()), (discriminant(&colors), 8));
        }
        let alone = square(0.0, kinds()[3].clone());
        assert_eq!(Mesh::join(vec![alone.clone()]).expect("fits"), alone);
        assert_eq!(Mesh::join(Vec::new()).expect("fits"), Mesh::default());
    }

    #[test]
    fn materials_that_are_more_than_a_color_are_kept_whole() {
        let [uniform, _, by_vertex, _] = kinds();
        let image = |name: &str| Image { name: name.into(), source: ImageSource::Missing("a test".into()) };
        let painted = |name: &str| {
            let maps = Maps { diffuse: Some(Map::whole(0, Channel::Color)), ..Maps::default() };
            let lamp = Material { emission: Vec3::splat(20.0), maps, ..named(name, Vec3::ONE) };
            let colors = Colors::PerMaterial { materials: vec![lamp], of_triangle: vec![0, 0] };
            Mesh { images: vec![image(name)], ..square(0.0, colors) }
        };
        let (one, two) = (painted("one"), painted("two"));
        let parts = [square(0.0, by_vertex), one.clone(), square(0.0, uniform), two.clone()];
        let all = Mesh::join(parts.to_vec()).expect("fits");
        assert_eq!(all.images, [image("one"), image("two")]);
        let Colors::PerMaterial { materials, of_triangle } = all.colors else { panic!("materials") };
        assert_eq!(of_triangle, [0, 1, 2, 2, 3, 3, 4, 4]);
        assert_eq!(
            Colors::PerMaterial { materials: vec![materials[2].clone()], of_triangle: vec![0, 0] },
            one.colors
        );
        let image_of = |material: &Material| material.maps.diffuse.as_ref().map(|map| map.image);
        assert_eq!((image_of(&materials[2]), image_of(&materials[4])), (Some(0), Some(1)));
        // A third of red, green and blue each; and of red, green and next to black.
        let average = |primitive: usize| materials[of_triangle[primitive] as usize].diffuse;
        assert!((average(0) - 1.0 / 3.0).abs().max_element() < 0.03, "{}", average(0));
        assert!(
            (average(1) - Vec3::new(1.0 / 3.0, 1.0 / 3.0, 0.0)).abs().max_element() < 0.03,
            "{}",
            average(1)
        );
    }

    #[test]
    fn averages_take_32_steps() {
        let steps: std::collections::BTreeSet<u8> =
            (0..=255).map(|byte| average(&[0, 0, 0], &[[byte; 3]])[0]).collect();
        assert_eq!((steps.len(), steps.first(), steps.last()), (32, Some(&0), Some(&255)));
    }

    #[test]
    fn attributes_stay_with_their_triangles() {
        let some = Attributes { uv: [[0.5; 2]; 3], ..Attributes::NONE };
        let with = Mesh { attributes: vec![Attributes::NONE, some], ..square(0.0, Colors::default()) };
        let without = square(0.0, kinds()[2].clone());
        let none = Attributes::NONE;
        let joined = |parts: &[&Mesh]| {
            let parts = parts.iter().map(|&mesh| mesh.clone()).collect();
            Mesh::join(parts).expect("fits").attributes
        };
        assert_eq!(joined(&[&with, &without, &with]), [none, some, none, none, none, some]);
        assert_eq!(joined(&[&without, &with]), [none, none, none, some]);
        assert_eq!(joined(&[&without, &without]), []);
    }

    #[test]
    fn materials_keep_their_names() {
        let [uniform, by_triangle, _, by_material] = kinds();
        let parts = [uniform, by_material, by_triangle].map(|colors| square(0.0, colors));
        let Colors::PerMaterial { materials, of_triangle } = Mesh::join(parts.to_vec()).expect("fits").colors
        else {
            panic!("colours of several kinds become materials")
        };
        let names: Vec<&str> = materials.iter().map(|material| &*material.name).collect();
        assert_eq!(names, ["", "spare", "sky", "sun", "#ff0000", "#00ffff"]);
        assert_eq!(of_triangle, [0, 0, 2, 3, 4, 5]);
    }
}
