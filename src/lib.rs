//! raypack is a packet-traversal ray engine for the CPU: an SAH kd-tree of 8-byte nodes, SIMD ray
//! packets that walk it, and a scheduler that renders frames tile by tile.
//!
//! ```
//! use raypack::Vec3;
//! use raypack::geometry::Ray;
//! use raypack::kdtree::BuildParams;
//! use raypack::mesh::Mesh;
//! use raypack::traverse::{Accel, RayPacket};
//!
//! // A mesh: positions, and three indices for each triangle. `raypack::mesh::read` makes one
//! // from a file.
//! let mesh = Mesh {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.0, 0.0, -1.0)],
//!     triangles: vec![[0, 1, 2], [3, 1, 2]],
//!     ..Mesh::default()
//! };
//!
//! // Made ready for tracing, with the best instruction set that this machine has.
//! let accel = Accel::build(&mesh, &BuildParams::default())?;
//!
//! // One ray: the closest hit, and whether there is any.
//! let ray = Ray::new(Vec3::new(0.25, 0.25, 2.0), Vec3::new(0.0, 0.0, -1.0));
//! let hit = accel.intersect(&ray);
//! assert_eq!((hit.primitive, hit.t, hit.u, hit.v), (0, 2.0, 0.25, 0.25));
//! assert_eq!(ray.at(hit.t), Vec3::new(0.25, 0.25, 0.0));
//! assert!(!accel.occluded(&Ray { tfar: 1.0, ..ray }));
//!
//! // Sixteen rays in SIMD lanes: the same hits, several times faster when they go the same way.
//! let packet = RayPacket::<16>::of_slice(&[ray; 16]);
//! let hits = accel.intersect_packet(&packet, 0xffff);
//! assert_eq!(hits.get(7), hit);
//! # Ok::<(), raypack::Error>(())
//! ```
//!
//! # Where things are
//!
//! | room | what is in it |
//! |---|---|
//! | [`mapped`] | files that are mapped, and which of them an address lies in |
//! | [`mod@column`] | arrays that are owned, or lie in a mapped file |
//! | [`mod@spool`] | lists that wait in files |
//! | [`simd`] | vectors of 4, 8 and 16 floats, and the choice of an instruction set at run time |
//! | [`geometry`] | ray, hit, box, the ray-triangle tests, clipping |
//! | [`mesh`] | triangle meshes, readers of model files, generators |
//! | [`kdtree`] | the tree: builder, statistics, validation |
//! | [`store`] | the `.rpk` scene file: written whole, mapped when it is read |
//! | [`cache`] | scenes of which a part is in memory: blocks that come from a scene file when they are needed |
//! | [`traverse`] | the kernels that take rays through a tree |
//! | [`scene`] | camera, camera paths, lights, textures, and the effects that a scene calls for |
//! | [`render`] | tiles, their scheduler, shading, pictures |
//! | [`batch`] | rays in bulk on all processors, and NumPy's files of them |
//! | [`profile`] | every tunable in one file |
//! | [`study`] | measurements: rays per second beside other engines, errors against exact answers |
//! | `cli` | the `raypack` command (feature `cli`) |
//!
//! A room uses only those above it.
//!
//! # Conventions
//!
//! Coordinates are right-handed `f32`, and Y is up where up matters. Intervals of a ray's
//! parameter are closed. Of several hits at the same distance the lowest primitive id wins.
//! Every kernel on every instruction set gives the same answer, to the bit.

pub mod batch;
pub mod cache;
pub mod column;
pub mod error;
pub mod files;
pub mod geometry;
mod huge;
pub mod kdtree;
pub mod mapped;
pub mod mesh;
mod morton;
pub mod profile;
pub mod render;
pub mod scene;
pub mod simd;
pub mod spool;
mod stage;
pub mod store;
pub mod study;
pub mod traverse;
#[cfg(test)]
mod weyl;

#[cfg(feature = "cli")]
pub mod cli;

pub use error::{Error, Result};
pub use glam::Vec3;
