//! The `.rpk` scene file: a mesh, its colours and its tree, made ready for tracing.
//!
//! [`write()`] makes one; [`File::open`] maps one. All arrays lie in it as they do in memory, so that opening a
//! scene costs no parsing and no building: [`File::tree`] gives the tree that was written, [`File::stored`] its
//! surfaces, [`File::mesh`] the mesh. Pictures that materials name are in it too, so that it stands alone. Every block of 4 KiB has a checksum; what is handed out has been checked,
//! and [`File::verify`] checks everything. `format.md` beside this file has every byte.
//!
//! | file | what it says |
//! |---|---|
//! | `header` | the first block: what the file is, how long, where its tables are |
//! | `section` | the section table: which arrays lie where |
//! | `checksum` | blocks and their checksums |
//! | `meta` | what is known about the scene, as JSON |
//! | `out` | sections to a file, one after the other |
//! | `writer` | a scene to a file |
//! | `large/` | a scene that memory does not hold to a file |
//! | `reader` | a file, mapped |
//! | `load` | a file's arrays as tree and mesh |
//! | `record` | what triangles' corners have beside their places |
//! | `pictures` | pictures' files inside of a scene file |
//! | `substance` | what triangles are made of |
//! | `stored` | a file's surfaces, for shading |

mod checksum;
mod header;
pub mod large;
mod load;
mod meta;
mod out;
mod pictures;
mod reader;
mod record;
mod section;
mod spooled;
mod stored;
mod substance;
mod writer;

pub use checksum::{BLOCK, of_block as block_checksum};
pub use header::VERSION;
pub use meta::{ColorMeta, ImageMeta, Meta, PoolsMeta};
pub use reader::File;
pub use record::SurfaceRecord;
pub use section::{Kind, Section};
pub use stored::{Paint, Stored};
pub use substance::Substances;
pub use writer::{Written, write};

use std::path::Path;

/// Whether a path's ending says that it is a scene file.
pub fn is_scene(path: impl AsRef<Path>) -> bool {
    path.as_ref().extension().is_some_and(|ending| ending.eq_ignore_ascii_case("rpk"))
}

#[cfg(test)]
mod tests;
