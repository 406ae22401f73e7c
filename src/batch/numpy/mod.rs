//! Rays from NumPy's `.npy` files, hits to its `.npz` files.
//!
//! ```python
//! rays = np.empty((n, 8), np.float32)             # one row a ray
//! rays[:, 0:3], rays[:, 3] = origins, 0           # origin, tnear
//! rays[:, 4:7], rays[:, 7] = directions, np.inf   # direction, tfar
//! np.save("rays.npy", rays)
//! ```
//!
//! The `.npy` header is parsed here. `npyz` and `ndarray-npy`, the crates for it, take it for any Python
//! expression, by a grammar whose time doubles with every bracket that is left open: forty of them in
//! the file would keep a reader busy for years.

mod header;
mod read;
mod write;

pub use read::{RayFile, read_rays, read_rays_from};
pub use write::{write_hits, write_occluded};
