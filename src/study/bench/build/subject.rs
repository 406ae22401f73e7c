//! An engine in one quality, and how it builds.

use super::super::engine::Engine;
use super::super::ours::Ours;
use super::super::{EngineName, Options};
use super::settings;
#[cfg(not(feature = "peers"))]
use crate::error::Error;
use crate::error::Result;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::Mesh;
use crate::study::resident::Resident;
use crate::traverse::Accel;

#[cfg(feature = "peers")]
use crate::study::{
    bench::{embree::Embree, obvhs::Obvhs},
    peers::{
        embree::{Build, Device, Scene},
        obvhs::{self, Layout, Preset},
    },
};
#[cfg(feature = "peers")]
use std::sync::Arc;

/// What is built.
pub enum Subject {
    /// raypack, by the name of its settings.
    Ours(&'static str, BuildParams),
    /// Embree.
    #[cfg(feature = "peers")]
    Embree(Arc<Device>, Build),
    /// obvhs.
    #[cfg(feature = "peers")]
    Obvhs(Layout, Preset),
}

/// A tree, and what was measured while it was built, in this round and before.
pub struct Built {
    pub engine: Box<dyn Engine>,
    pub mode: String,
    pub figures: Figures,
    /// Bytes of the tree with its triangles.
    pub bytes: u64,
    /// What raypack announced for the build, in bytes.
    pub announced: Option<u64>,
    /// What raypack counted.
    pub counted: Option<u64>,
    pub stats: Option<TreeStats>,
    pub accel: Option<Accel>,
}

/// What a round measures.
#[derive(Default)]
pub struct Figures {
    /// Of each round.
    pub seconds: Vec<f64>,
    /// By how much the process's memory rose, in the round in which it rose the most.
    pub peak: Option<u64>,
}

impl Subject {
    /// Every quality of an engine.
    ///
    /// # Errors
    /// The engine is not here.
    pub fn all(name: EngineName, options: &Options) -> Result<Vec<Self>> {
        if name.is_ours() {
            return Ok(settings(options)
                .into_iter()
                .map(|(name, params)| Self::Ours(name, params))
                .collect());
        }
        Self::rivals(name, options)
    }

    #[cfg(feature = "peers")]
    fn rivals(name: EngineName, options: &Options) -> Result<Vec<Self>> {
        if name == EngineName::Obvhs {
            return Ok(obvhs::ALL.map(|(layout, preset)| Self::Obvhs(layout, preset)).into());
        }
        let device = Device::new(0, options.hold_peers_to_isa.then_some(options.isa))?;
        Ok(Build::QUALITIES.map(|build| Self::Embree(Arc::clone(&device), build)).into())
    }

    #[cfg(not(feature = "peers"))]
    fn rivals(name: EngineName, _options: &Options) -> Result<Vec<Self>> {
        let remedy = "build raypack with the feature `peers`".into();
        Err(Error::Missing { what: name.name().into(), remedy })
    }

    /// The engine's name.
    pub fn engine(&self) -> &'static str {
        match self {
            Self::Ours(..) => "raypack",
            #[cfg(feature = "peers")]
            Self::Embree(..) => "embree",
            #[cfg(feature = "peers")]
            Self::Obvhs(..) => "obvhs",
        }
    }

    /// The quality's name.
    pub fn mode(&self) -> String {
        match self {
            Self::Ours(name, _) => (*name).into(),
            #[cfg(feature = "peers")]
            Self::Embree(_, build) => build.name().into(),
            #[cfg(feature = "peers")]
            Self::Obvhs(layout, preset) => format!("{} {}", layout.name(), preset.name()),
        }
    }

    /// Builds once more, after `earlier` rounds.
    ///
    /// # Errors
    /// Nothing can be built from the mesh.
    pub fn build(&self, mesh: &Mesh, options: &Options, earlier: Option<Figures>) -> Result<Built> {
        let resident = Resident::start();
        let mut built = match self {
            Self::Ours(_, params) => {
                let ours = Ours::new(mesh, params, options.isa, options.accuracy)?;
                let accel = ours.accel().clone();
                Built {
                    announced: Some(params.peak_bytes(mesh.triangles.len()) as u64),
                    counted: Some(accel.tree().build_peak() as u64),
                    stats: Some(ours.stats().clone()),
                    accel: Some(accel),
                    ..Built::new(self, ours.build_seconds(), ours.bytes(), Box::new(ours))
                }
            }
            #[cfg(feature = "peers")]
            Self::Embree(device, build) => {
                let scene = Scene::new(device, mesh, *build)?;
                let (seconds, bytes) = (scene.build_seconds(), scene.bytes());
                Built::new(self, seconds, bytes, Box::new(Embree::of_scene(Arc::clone(device), scene)))
            }
            #[cfg(feature = "peers")]
            Self::Obvhs(layout, preset) => {
                let scene = obvhs::Scene::new(mesh, *layout, *preset);
                let (seconds, bytes) = (scene.build_seconds(), scene.bytes());
                Built::new(self, seconds, bytes, Box::new(Obvhs::of_scene(*layout, *preset, scene)))
            }
        };
        built.figures.peak = resident.and_then(Resident::rise);
        if let Some(earlier) = earlier {
            built.figures.seconds.extend(earlier.seconds);
            built.figures.peak = built.figures.peak.max(earlier.peak);
        }
        Ok(built)
    }
}

impl Built {
    fn new(subject: &Subject, seconds: f64, bytes: u64, engine: Box<dyn Engine>) -> Self {
        Self {
            engine,
            mode: subject.mode(),
            figures: Figures { seconds: vec![seconds], peak: None },
            bytes,
            announced: None,
            counted: None,
            stats: None,
            accel: None,
        }
    }

    /// Drops the tree.
    pub fn into_figures(self) -> Figures {
        self.figures
    }
}
