//! Who takes part: each mode of each engine, with all its kernels.

use crate::error::Result;
use crate::geometry::Accuracy;
use crate::mesh::Mesh;
use crate::simd::Isa;
use crate::study::bench::engine::Engine;
use crate::study::bench::ours::Ours;
use crate::traverse::Accel;

/// An engine held to one accuracy mode.
pub struct Participant {
    /// The engine, with only such kernels and trees as are of this mode.
    pub engine: Box<dyn Engine>,
    /// `fast`, `watertight` or `exact` of ours; `fast` or `robust` of Embree's.
    pub mode: &'static str,
    /// Whether it is what raypack does unless told otherwise.
    pub is_default: bool,
}

/// raypack's modes, fastest first, over one tree.
pub fn ours(accel: &Accel, build_seconds: f64) -> Vec<Participant> {
    let participant = |mode: Accuracy| Participant {
        engine: Box::new(Ours::of_accel(accel.clone().with_accuracy(mode), build_seconds)),
        mode: mode.name(),
        is_default: mode == Accuracy::default(),
    };
    Accuracy::ALL.map(participant).into()
}

/// Embree's two modes: fast in its best of medium and high builds, and robust.
///
/// # Errors
/// Embree is not here, or fails.
#[cfg(feature = "peers")]
pub fn embree(mesh: &Mesh, isa: Option<Isa>) -> Result<Vec<Participant>> {
    use crate::study::bench::embree::Embree;
    use crate::study::peers::embree::Build;
    let participant = |mode, builds: &[Build]| {
        let engine = Box::new(Embree::new(mesh, isa, builds)?);
        Ok(Participant { engine, mode, is_default: false })
    };
    Ok(vec![
        participant("fast", &[Build::Medium, Build::High])?,
        participant("robust", &[Build::RobustHigh])?,
    ])
}

/// Without the feature there is no Embree.
#[cfg(not(feature = "peers"))]
pub fn embree(_mesh: &Mesh, _isa: Option<Isa>) -> Result<Vec<Participant>> {
    let remedy = "build raypack with the feature `peers`".into();
    Err(crate::error::Error::Missing { what: "Embree".into(), remedy })
}
