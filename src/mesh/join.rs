//! Several meshes made one.

use super::color::{decode, encode};
use super::{Colors, MAX_TRIANGLES, Material, Mesh};
use crate::error::{Error, Result};
use glam::Vec3;
use std::collections::HashMap;
use std::mem::discriminant;

impl Mesh {
    /// All triangles of several meshes, mesh after mesh; each keeps its colours.
    ///
    /// Where meshes have colours of different kinds, they become materials, which changes none of them. If a mesh
    /// has them by vertex, they all do: then a vertex between triangles of several colours is there several
    /// times, and materials are rounded to the 8 bits of a vertex's colour.
    ///
    /// # Errors
    /// There are more triangles or vertices than one mesh can have.
    pub fn join(meshes: Vec<Self>) -> Result<Self> {
        let mut meshes = meshes;
        unify(&mut meshes);
        let count = |of: fn(&Self) -> usize| meshes.iter().map(of).sum::<usize>();
        let (triangles, vertices) = (count(|mesh| mesh.triangles.len()), count(|mesh| mesh.positions.len()));
        if triangles > MAX_TRIANGLES || vertices > u32::MAX as usize {
            return Err(Error::Mesh(format!(
                "{triangles} triangles with {vertices} vertices are more than one scene can have: leave models out"
            )));
        }
        let mut meshes = meshes.into_iter();
        let mut all = meshes.next().unwrap_or_default();
        all.positions.reserve_exact(vertices - all.positions.len());
        all.triangles.reserve_exact(triangles - all.triangles.len());
        for mesh in meshes {
            let first = all.positions.len() as u32;
            all.positions.extend(mesh.positions);
            all.triangles.extend(mesh.triangles.into_iter().map(|corners| corners.map(|i| first + i)));
            append(&mut all.colors, mesh.colors);
        }
        Ok(all)
    }
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

/// Gives all meshes colours of one kind.
fn unify(meshes: &mut [Mesh]) {
    let alike = |pair: &[Mesh]| match (&pair[0].colors, &pair[1].colors) {
        (Colors::Uniform(one), Colors::Uniform(other)) => one == other,
        (one, other) => discriminant(one) == discriminant(other),
    };
    if meshes.windows(2).all(alike) {
        return;
    }
    let by_vertex = meshes.iter().any(|mesh| matches!(mesh.colors, Colors::PerVertex(_)));
    for mesh in meshes {
        if by_vertex {
            to_vertices(mesh);
        } else {
            to_materials(mesh);
        }
    }
}

/// Makes colours that are not by vertex materials, a material for each colour.
fn to_materials(mesh: &mut Mesh) {
    let unnamed = |diffuse| Material::matt("", diffuse);
    let (materials, of_triangle) = match &mesh.colors {
        Colors::Uniform(color) => (vec![unnamed(*color)], vec![0; mesh.triangles.len()]),
        Colors::PerTriangle(colors) => {
            let mut numbers = HashMap::new();
            let mut materials = Vec::new();
            let number = |color: &[u8; 3]| {
                *numbers.entry(*color).or_insert_with(|| {
                    let [r, g, b] = color;
                    let name = format!("#{r:02x}{g:02x}{b:02x}");
                    materials.push(Material::matt(name, decode(*color)));
                    materials.len() as u32 - 1
                })
            };
            let of_triangle = colors.iter().map(number).collect();
            (materials, of_triangle)
        }
        Colors::PerVertex(_) | Colors::PerMaterial { .. } => return,
    };
    mesh.colors = Colors::PerMaterial { materials, of_triangle };
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
