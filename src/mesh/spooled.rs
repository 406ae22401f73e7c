//! Meshes in files, for who cannot have them in memory.
//!
//! A PLY file is read from its beginning to its end, and what it holds goes to files on the way; checking it is
//! some passes over these. What comes out is the mesh that [`read`](super::read()) gives, triangle by triangle, without
//! texture coordinates and normals.

use super::check::{MAX_TRIANGLES, NonFinite, Unusable};
use super::lists::InFiles;
use super::ply::{self, Raw, Shades};
use super::read::map;
use super::{Colors, Material, Mesh, ReadReport};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use glam::Vec3;
use memmap2::Mmap;
use std::cell::Cell;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// A [`Mesh`] whose arrays lie in files.
#[derive(Debug)]
pub struct SpooledMesh {
    /// Vertex positions, all finite.
    pub positions: Spooled<Vec3>,
    /// Three vertices for each triangle.
    pub triangles: Spooled<[u32; 3]>,
    /// What colour the triangles have.
    pub colors: SpooledColors,
    /// The box around all vertices.
    pub bounds: Aabb,
}

/// [`Colors`] that lie in files.
#[derive(Debug)]
pub enum SpooledColors {
    /// One colour for everything.
    Uniform(Vec3),
    /// One sRGB-encoded colour a triangle.
    PerTriangle(Spooled<[u8; 3]>),
    /// One sRGB-encoded colour a vertex.
    PerVertex(Spooled<[u8; 3]>),
    /// Named materials, and for each triangle an index into them.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
        /// One index a triangle.
        of_triangle: Spooled<u32>,
    },
}

impl SpooledMesh {
    /// A copy of a mesh, in files in `folder`, which vanish with it.
    ///
    /// # Errors
    /// There is no room.
    pub fn of_mesh(mesh: &Mesh, folder: &Path) -> io::Result<Self> {
        let colors = match &mesh.colors {
            Colors::Uniform(color) => SpooledColors::Uniform(*color),
            Colors::PerTriangle(colors) => SpooledColors::PerTriangle(spooled(colors, folder)?),
            Colors::PerVertex(colors) => SpooledColors::PerVertex(spooled(colors, folder)?),
            Colors::PerMaterial { materials, of_triangle } => SpooledColors::PerMaterial {
                materials: materials.clone(),
                of_triangle: spooled(of_triangle, folder)?,
            },
        };
        let positions = spooled(&mesh.positions, folder)?;
        let triangles = spooled(&mesh.triangles, folder)?;
        Ok(Self { positions, triangles, colors, bounds: mesh.bounds() })
    }

    /// A copy in memory.
    ///
    /// # Errors
    /// The files cannot be read.
    pub fn to_mesh(&self) -> io::Result<Mesh> {
        let colors = match &self.colors {
            SpooledColors::Uniform(color) => Colors::Uniform(*color),
            SpooledColors::PerTriangle(colors) => Colors::PerTriangle(colors.to_vec()?),
            SpooledColors::PerVertex(colors) => Colors::PerVertex(colors.to_vec()?),
            SpooledColors::PerMaterial { materials, of_triangle } => {
                Colors::PerMaterial { materials: materials.clone(), of_triangle: of_triangle.to_vec()? }
            }
        };
        Ok(Mesh {
            positions: self.positions.to_vec()?,
            triangles: self.triangles.to_vec()?,
            colors,
            ..Mesh::default()
        })
    }
}

/// A list in a file.
fn spooled<T: Pod>(list: &[T], folder: &Path) -> io::Result<Spooled<T>> {
    let mut spool = Spool::new(folder)?;
    spool.extend_from_slice(list);
    spool.finish()
}

/// The numbers of vertices and triangles that a PLY file announces (a polygon counts as one triangle); `None`
/// for other files, which are read into memory only.
pub fn announced(path: &Path) -> Option<(u64, u64)> {
    /// Headers are shorter.
    const BEGINNING: u64 = 1 << 16;
    let is_ply = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"));
    let mut bytes = Vec::new();
    File::open(path).ok().filter(|_| is_ply)?.take(BEGINNING).read_to_end(&mut bytes).ok()?;
    ply::announced(&bytes)
}

/// Reads a PLY file to files in `folder`, which vanish with the mesh. `progress` is told now and then what part
/// (0 to 1) is behind. Takes a bit for each vertex, and some megabytes.
///
/// # Errors
/// As [`read`](super::read()), or there is no room in `folder`.
pub fn read(path: &Path, folder: &Path, progress: &dyn Fn(f32)) -> Result<(SpooledMesh, ReadReport)> {
    let malformed = |message: String| Error::malformed(path, message);
    let bytes = map(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let mut report = ReadReport::default();
    let behind = Behind { map: &bytes, released: Cell::new(0) };
    let told = |part: f32| {
        behind.release(part);
        progress(0.7 * part);
    };
    let raw = ply::parse_to(&InFiles(folder.into()), &bytes, &mut report, &told).map_err(malformed)?;
    drop(bytes);
    let no_room = |source: io::Error| Error::Write { path: folder.into(), source };
    let raw = finish(raw, folder).map_err(no_room)?;
    let (vertices, faces) = (raw.positions.len(), raw.triangles.len());
    let mesh =
        check(raw, folder, &mut report, &|part| progress(0.7 + 0.3 * part)).map_err(|fault| match fault {
            Fault::Io(error) => no_room(error),
            Fault::Unusable(unusable) => malformed(unusable.message(vertices, faces)),
        })?;
    Ok((mesh, report))
}

/// Lets go of what has been read of a mapped file, so that it is not in memory all at once.
struct Behind<'a> {
    map: &'a Mmap,
    released: Cell<usize>,
}

impl Behind<'_> {
    /// Bytes before the part that is read that are kept: `part` is rounded.
    const KEPT: usize = 1 << 20;

    #[cfg(unix)]
    fn release(&self, part: f32) {
        let end = ((self.map.len() as f64 * f64::from(part)) as usize).saturating_sub(Self::KEPT);
        let begin = self.released.get();
        if end > begin {
            // SAFETY: the map is of a file and only ever read: what is let go of is read from the file again if
            // it is touched again. That it cannot be done changes nothing.
            let _ = unsafe {
                self.map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, begin, end - begin)
            };
            self.released.set(end);
        }
    }

    #[cfg(not(unix))]
    fn release(&self, _part: f32) {}
}

/// What a file held, not checked yet.
struct Whole {
    positions: Spooled<Vec3>,
    triangles: Spooled<[u32; 3]>,
    colors: SpooledColors,
}

fn finish(raw: Raw<InFiles>, folder: &Path) -> io::Result<Whole> {
    let colors = match (bytes_of(raw.of_faces, folder)?, bytes_of(raw.of_vertices, folder)?) {
        (Some(of_faces), _) => SpooledColors::PerTriangle(of_faces),
        (None, Some(of_vertices)) => SpooledColors::PerVertex(of_vertices),
        (None, None) => {
            let Colors::Uniform(color) = Colors::default() else { unreachable!("it is one colour") };
            SpooledColors::Uniform(color)
        }
    };
    Ok(Whole { positions: raw.positions.finish()?, triangles: raw.triangles.finish()?, colors })
}

/// Colours as bytes; nothing if no element had any.
fn bytes_of(shades: Shades<InFiles>, folder: &Path) -> io::Result<Option<Spooled<[u8; 3]>>> {
    match shades {
        Shades::None => Ok(None),
        Shades::Bytes(colors) => colors.finish().map(Some),
        Shades::Floats(colors) => {
            let colors = colors.finish()?;
            let mut greatest = 0.0_f32;
            colors.each(|_, some| {
                greatest = some.iter().flatten().fold(greatest, |greatest, &c| greatest.max(c));
                Ok::<(), io::Error>(())
            })?;
            let mut bytes = Spool::new(folder)?;
            colors.each(|_, some| {
                bytes.extend_from_slice(&super::color::quantize_to(greatest, some));
                Ok::<(), io::Error>(())
            })?;
            bytes.finish().map(Some)
        }
    }
}

/// Why there is no mesh.
enum Fault {
    Io(io::Error),
    Unusable(Unusable),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// A bit for each of many things.
struct Bits(Vec<u64>);

impl Bits {
    fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    fn set(&mut self, place: usize) {
        self.0[place / 64] |= 1 << (place % 64);
    }

    fn get(&self, place: usize) -> bool {
        self.0[place / 64] >> (place % 64) & 1 == 1
    }

    /// For each word, how many bits are set before it.
    fn before(&self) -> Vec<u32> {
        let mut sum = 0;
        let count = |word: &u64| {
            sum += word.count_ones();
            sum - word.count_ones()
        };
        self.0.iter().map(count).collect()
    }
}

/// The policy of [`check`](super::check), pass by pass.
fn check(
    raw: Whole,
    folder: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<SpooledMesh, Fault> {
    let Whole { mut positions, mut triangles, mut colors } = raw;

    // Which triangles name a vertex twice, and which vertices do the others use?
    let sound = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let mut used = Bits::new(positions.len());
    let mut kept = 0;
    triangles.each(|_, some| {
        for corners in some.iter().filter(|corners| sound(corners)) {
            kept += 1;
            corners.iter().for_each(|&vertex| used.set(vertex as usize));
        }
        Ok::<(), io::Error>(())
    })?;
    progress(0.3);
    report.degenerate_triangles = (triangles.len() - kept) as u64;
    match kept {
        0 => return Err(Fault::Unusable(Unusable::NoTriangles)),
        n if n > MAX_TRIANGLES => return Err(Fault::Unusable(Unusable::TooManyTriangles(n))),
        _ => {}
    }

    // Are all that are used finite, and where are they?
    let (mut bounds, mut bad, mut unused, mut unused_non_finite) = (Aabb::EMPTY, None::<NonFinite>, 0, 0);
    positions.each(|first, some| {
        for (vertex, position) in (first..).zip(some) {
            match (used.get(vertex), position.is_finite()) {
                (true, true) => bounds = bounds.grown(*position),
                (true, false) => {
                    let first = bad.as_ref().map_or(vertex as u32, |bad| bad.first);
                    let count = bad.as_ref().map_or(0, |bad| bad.count) + 1;
                    bad = Some(NonFinite { first, count });
                }
                (false, finite) => {
                    unused += 1;
                    unused_non_finite += u64::from(!finite);
                }
            }
        }
        Ok::<(), io::Error>(())
    })?;
    progress(0.5);
    if let Some(bad) = bad {
        return Err(Fault::Unusable(Unusable::NonFinite(bad)));
    }
    report.unused_vertices += unused;
    report.unused_non_finite += unused_non_finite;

    // Copies without what is dropped.
    if report.degenerate_triangles > 0 {
        colors = match colors {
            SpooledColors::PerTriangle(colors) => {
                SpooledColors::PerTriangle(where_sound(&colors, &triangles, folder, sound)?)
            }
            other => other,
        };
        triangles = where_sound(&triangles, &triangles, folder, sound)?;
    }
    progress(0.7);
    if unused > 0 {
        let before = used.before();
        let renamed = |vertex: u32| {
            let (word, bit) = (vertex as usize / 64, vertex % 64);
            before[word] + (used.0[word] & ((1 << bit) - 1)).count_ones()
        };
        let mut list = Spool::new(folder)?;
        triangles.each(|_, some| {
            some.iter().for_each(|corners| list.push(corners.map(renamed)));
            Ok::<(), io::Error>(())
        })?;
        triangles = list.finish()?;
        let is_used = |vertex: usize| used.get(vertex);
        positions = where_kept(&positions, folder, is_used)?;
        if let SpooledColors::PerVertex(of_vertices) = &colors {
            colors = SpooledColors::PerVertex(where_kept(of_vertices, folder, is_used)?);
        }
    }
    progress(1.0);
    report.triangles = triangles.len() as u64;
    report.vertices = positions.len() as u64;
    Ok(SpooledMesh { positions, triangles, colors, bounds })
}

/// The values of a list at the places that `keep` accepts.
fn where_kept<T: Pod>(
    list: &Spooled<T>,
    folder: &Path,
    keep: impl Fn(usize) -> bool,
) -> io::Result<Spooled<T>> {
    let mut kept = Spool::new(folder)?;
    list.each(|first, some| {
        for (_, &value) in (first..).zip(some).filter(|(place, _)| keep(*place)) {
            kept.push(value);
        }
        Ok::<(), io::Error>(())
    })?;
    kept.finish()
}

/// The values of a list at the places of the triangles that `sound` accepts.
fn where_sound<T: Pod>(
    list: &Spooled<T>,
    triangles: &Spooled<[u32; 3]>,
    folder: &Path,
    sound: impl Fn(&[u32; 3]) -> bool,
) -> io::Result<Spooled<T>> {
    let mut kept = Spool::new(folder)?;
    let mut values = Vec::new();
    triangles.each(|first, some| {
        values.resize(some.len(), T::zeroed());
        list.read(first, &mut values)?;
        for (_, &value) in some.iter().zip(&values).filter(|(corners, _)| sound(corners)) {
            kept.push(value);
        }
        Ok::<(), io::Error>(())
    })?;
    kept.finish()
}
