//! Small scenes, and pictures of them.

use raypack::Vec3;
use raypack::kdtree::BuildParams;
use raypack::mesh::{Attributes, Colors, Image, Material, Mesh};
use raypack::render::{Frame, FrameStats, Limits, RenderSettings, Renderer, Size, Staged, Wishes};
use raypack::scene::effects::Effect;
use raypack::scene::{Camera, Environment, Lighting, Surface};
use raypack::traverse::Accel;
use std::sync::atomic::AtomicUsize;

/// A scene that is put together from squares.
#[derive(Default)]
pub struct Builder {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    of_triangle: Vec<u32>,
    attributes: Vec<Attributes>,
    materials: Vec<Material>,
    images: Vec<Image>,
}

impl Builder {
    /// A scene whose maps may name one picture, number 0.
    pub fn with_image(image: Image) -> Self {
        Self { images: vec![image], ..Self::default() }
    }

    /// Adds a material and gives its number.
    pub fn material(&mut self, material: Material) -> u32 {
        self.materials.push(material);
        self.materials.len() as u32 - 1
    }

    /// A parallelogram with the corner `at` and the edges `u` and `v`, whose front is where `u x v` points; texture
    /// coordinates run from 0 to 1 along the edges.
    pub fn square(&mut self, material: u32, at: Vec3, u: Vec3, v: Vec3) -> &mut Self {
        let first = self.positions.len() as u32;
        self.positions.extend([at, at + u, at + u + v, at + v]);
        for [a, b] in [[1, 2], [2, 3]] {
            self.triangles.push([first, first + a, first + b]);
            self.of_triangle.push(material);
            let uv = |corner: u32| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][corner as usize];
            self.attributes.push(Attributes { uv: [uv(0), uv(a), uv(b)], ..Attributes::NONE });
        }
        self
    }

    /// The six walls of a box, with their fronts outside.
    pub fn cube(&mut self, material: u32, low: Vec3, high: Vec3) -> &mut Self {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * (high - low));
        self.square(material, low, y, x).square(material, low, z, y).square(material, low, x, z);
        self.square(material, high, -x, -y).square(material, high, -y, -z).square(material, high, -z, -x)
    }

    pub fn mesh(self) -> Mesh {
        let Self { positions, triangles, of_triangle, attributes, materials, images } = self;
        Mesh {
            positions,
            triangles,
            colors: Colors::PerMaterial { materials, of_triangle },
            attributes,
            images,
        }
    }
}

/// What a picture is to be like.
pub struct Shot {
    pub camera: Camera,
    pub size: u32,
    pub effects: &'static str,
    pub samples: Option<u32>,
    pub bounces: u32,
    pub shadow_samples: u32,
    pub environment: Option<Vec3>,
    pub lighting: Lighting,
}

impl Shot {
    pub fn new(eye: Vec3, at: Vec3) -> Self {
        Self {
            camera: Camera::new(eye, at),
            size: 16,
            effects: "auto",
            samples: None,
            bounces: 32,
            shadow_samples: 1,
            environment: None,
            lighting: Lighting::outdoors(Vec3::Y, Vec3::Y),
        }
    }

    pub fn staged(&self, accel: &Accel, surface: &impl Surface) -> Staged {
        let wishes = Wishes {
            request: self.effects.parse().expect(self.effects),
            lighting: self.lighting,
            environment: self.environment.map(|light| (Environment::uniform(light), "uniform")),
            samples: self.samples,
            limits: Limits {
                bounces: self.bounces,
                shadow_samples: self.shadow_samples,
                ..Limits::default()
            },
            error: self.samples.map(|_| 0.0),
        };
        Staged::new(accel, surface, &self.camera, wishes)
    }

    pub fn settings(&self) -> RenderSettings {
        RenderSettings::new(Size { width: self.size, height: self.size })
    }

    /// The rays or uses of an effect, pixel by pixel.
    pub fn heat(&self, accel: &Accel, mesh: &Mesh, effect: Effect) -> Vec<f32> {
        let staged = self.staged(accel, mesh);
        let settings = RenderSettings { samples: staged.samples, ..self.settings() };
        let mut renderer = Renderer::new(accel, mesh, settings).expect("sound settings");
        if let Some(appearance) = &staged.appearance {
            renderer = renderer.with_appearance(appearance).expect("sound limits");
        }
        renderer
            .counts_of(effect, &self.camera, &self.lighting, &AtomicUsize::new(0))
            .expect("it is in memory")
    }

    /// Renders with changed settings.
    pub fn with(
        &self,
        accel: &Accel,
        surface: &impl Surface,
        change: impl FnOnce(&mut RenderSettings),
    ) -> (Frame, FrameStats) {
        let staged = self.staged(accel, surface);
        let mut settings = self.settings();
        settings.samples = staged.samples;
        settings.shadows = staged.analysis.set().has(Effect::Shadows);
        change(&mut settings);
        let mut renderer = Renderer::new(accel, surface, settings).expect("sound settings");
        if let Some(appearance) = &staged.appearance {
            renderer = renderer.with_appearance(appearance).expect("sound limits");
        }
        renderer.frame(&self.camera, &self.lighting)
    }

    pub fn of(&self, mesh: &Mesh) -> (Frame, FrameStats) {
        let accel = Accel::build(mesh, &BuildParams::default()).expect("builds");
        self.with(&accel, mesh, |_| {})
    }

    /// The average of all pixels.
    pub fn mean(&self, mesh: &Mesh) -> Vec3 {
        mean(&self.of(mesh).0)
    }
}

/// The effects that ran, and how many rays or uses each had.
pub fn counts(stats: &FrameStats) -> Vec<(Effect, u64)> {
    stats.costs.iter().map(|(effect, cost)| (effect, cost.count())).collect()
}

pub fn mean(frame: &Frame) -> Vec3 {
    frame.color.iter().map(|&c| Vec3::from(c)).sum::<Vec3>() / frame.color.len() as f32
}

/// Asserts that light is what it should be, within a part of it.
#[track_caller]
pub fn assert_light(light: Vec3, expected: Vec3, part: f32) {
    let off = (light - expected).abs().max_element();
    assert!(off <= part * expected.max_element(), "{light} is not {expected}");
}
