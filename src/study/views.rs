//! The standard views: models and cameras that figures are compared by from one day to the next.

use crate::error::Result;
use crate::mesh::{self, Mesh};
use crate::scene::Camera;
use std::path::Path;

/// A model seen from a fixed place, in a square picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StandardView {
    /// The view's name: the model's, and where from if there are several of it.
    pub name: &'static str,
    /// The model's file in a folder of models, each of which has a folder of its own.
    pub file: &'static str,
    /// The camera, as [`Camera::parse`] reads it.
    pub camera: &'static str,
}

/// All of them.
pub const STANDARD: [StandardView; 14] = [
    view("obvhs-kitchen", "obvhs-kitchen/kitchen.obj", "eye=3,1.6,1.9;at=0,0.7,-0.8;fov=65"),
    view("sibenik", "sibenik/sibenik.obj", "eye=-16,-9,0.3;at=0,-8,0;fov=75"),
    view("bunny", "bunny/bun_zipper.ply", "eye=-0.05,0.2,0.3;at=-0.017,0.11,0;fov=35"),
    view("teapot", "teapot/teapot-full.obj", "eye=23.17,15.71,-0.17;at=0,2.8,0;fov=20"),
    view("lost-empire", "lost-empire/lost_empire.obj", "eye=20,30,40;at=-5,18,-5;fov=70"),
    view("coffee", "coffee/coffee.obj", "eye=-0.003,0.198,0.828;at=-0.002,0.194,0.728;fov=25"),
    view("sponza", "sponza/sponza.obj", "eye=1150,180,-40;at=0,330,10;fov=70"),
    view("sports-car", "sports-car/sportsCar.obj", "eye=2.6,1.3,4.2;at=0,0.4,0;fov=35"),
    view("conference", "conference/conference.obj", "eye=1100,250,-250;at=300,120,150;fov=75"),
    view("armadillo", "armadillo/Armadillo.ply", "eye=0,30,-260;at=0,20,0;fov=45"),
    view("atlas", "atlas/atlas.ply", "eye=22,14,34;at=0,0,0;fov=50"),
    view("kitchen", "kitchen/kitchen.obj", "eye=1.2110,1.8047,3.8524;at=0.7729,1.7631,2.9544;fov=60"),
    view(
        "powerplant-outside",
        "powerplant/powerplant.ply",
        "eye=110000,40000,160000;at=10000,40000,50000;fov=60",
    ),
    view(
        "powerplant-inside",
        "powerplant/powerplant.ply",
        "eye=15000,12000,80000;at=-20000,30000,20000;fov=70",
    ),
];

const fn view(name: &'static str, file: &'static str, camera: &'static str) -> StandardView {
    StandardView { name, file, camera }
}

impl StandardView {
    /// The camera.
    pub fn camera(&self) -> Camera {
        Camera::parse(self.camera).expect("the standard views are well-formed")
    }

    /// Whether the model lies in `folder`.
    pub fn is_in(&self, folder: &Path) -> bool {
        folder.join(self.file).is_file()
    }

    /// Reads the model from `folder`.
    ///
    /// # Errors
    /// As [`mesh::read()`].
    pub fn read(&self, folder: &Path) -> Result<Mesh> {
        Ok(mesh::read(folder.join(self.file))?.mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn every_view_has_a_name_of_its_own_and_a_camera() {
        let names: HashSet<&str> = STANDARD.iter().map(|view| view.name).collect();
        assert_eq!(names.len(), STANDARD.len());
        for view in STANDARD {
            let camera = view.camera();
            assert!(camera.eye != camera.at && camera.fov > 0.0, "{}", view.name);
        }
    }
}
