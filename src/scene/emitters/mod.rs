//! Triangles that give off light, and how to choose a point on one of them.

mod alias;
#[cfg(test)]
mod tests;
mod tree;

use crate::geometry::Aabb;
use alias::AliasTable;
use glam::{DVec3, Vec3};
use tree::LightTree;

/// All the triangles of a scene that give off light: the same radiance in all directions, on both sides.
///
/// Of many lights, [`sample`](Self::sample) chooses one as often as its power is of all power, in a time that does not
/// depend on their number, wherever the light is to fall: one distant and strong light more often than a near and weak
/// one. [`sample_for`](Self::sample_for) also weighs how far they are from a point, in a time that grows with the
/// logarithm of their number. Corners are kept here, so that a choice reads nothing of the scene: 82 to 96 bytes a
/// light.
#[derive(Clone, Debug)]
pub struct Emitters {
    /// In the order of the tree.
    lights: Box<[Emitter]>,
    /// Their primitive ids in ascending order, and their places in `lights`.
    places: Box<[[u32; 2]]>,
    table: AliasTable,
    tree: LightTree,
    /// The sum of area by luminance.
    weight: f64,
    bounds: Aabb,
}

#[derive(Clone, Copy, Debug)]
struct Emitter {
    primitive: u32,
    corners: [Vec3; 3],
    radiance: Vec3,
}

/// A point that gives off light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterSample {
    /// The triangle that it is on.
    pub primitive: u32,
    /// The point's barycentric weights of the triangle's second and third corner.
    pub uv: [f32; 2],
    /// Where it is.
    pub position: Vec3,
    /// The triangle's unit normal: from where its corners are in anticlockwise order.
    pub normal: Vec3,
    /// What it gives off, to both sides; pictures of emission left out.
    pub radiance: Vec3,
    /// The density by area with which this point was chosen, of all points of all lights. Positive; infinite if no
    /// `f32` is large enough.
    pub pdf_area: f32,
}

impl Emitters {
    /// Of triangles, each with its primitive id, its corners in the scene's coordinates and its radiance. Those that
    /// give off nothing, have no area or are not finite are left out; of several with one id the first counts. `None`
    /// if no light is left.
    ///
    /// If pictures are multiplied with the radiance, it is best given here for the mean of the picture, and must not
    /// be zero where the picture is not.
    pub fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3], Vec3)>) -> Option<Self> {
        let mut lights: Vec<Emitter> = triangles
            .into_iter()
            .map(|(primitive, corners, radiance)| Emitter { primitive, corners, radiance })
            .filter(|light| light.weight() > 0.0 && light.weight() < f64::INFINITY)
            .collect();
        lights.sort_by_key(|light| light.primitive);
        lights.dedup_by_key(|light| light.primitive);
        if lights.is_empty() {
            return None;
        }
        let weight = lights.iter().map(Emitter::weight).sum();
        let tree = LightTree::new(&mut lights, weight);
        let weights: Vec<f64> = lights.iter().map(Emitter::weight).collect();
        let mut places: Box<[[u32; 2]]> = (0..).zip(&lights).map(|(i, light)| [light.primitive, i]).collect();
        places.sort_unstable();
        Some(Self {
            table: AliasTable::new(&weights),
            tree,
            weight,
            bounds: Aabb::of_points(lights.iter().flat_map(|light| light.corners)),
            places,
            lights: lights.into(),
        })
    }

    /// A point on one of the lights: `pick` says on which, `uv` where on it; all of them in [0, 1). The same numbers
    /// give the same point.
    ///
    /// Of `pick` the second number says what the first has no digits for: with few lights it hardly matters.
    #[inline]
    pub fn sample(&self, pick: [f32; 2], uv: [f32; 2]) -> EmitterSample {
        let light = &self.lights[self.table.pick(pick)];
        light.point(uv, self.density(light))
    }

    /// The density by area with which [`sample`](Self::sample) chooses each point of a triangle: 0 if that is no
    /// light. For a ray that hit a light by itself.
    #[inline]
    pub fn pdf_area(&self, primitive: u32) -> f32 {
        self.place(primitive).map_or(0.0, |place| self.density(&self.lights[place]))
    }

    /// As [`sample`](Self::sample), but each light is chosen the more often, the more light of it may arrive at a point
    /// of the scene: power by the square of the distance. What is in between, and which way surfaces are turned, is not
    /// looked at.
    pub fn sample_for(&self, point: Vec3, pick: [f32; 2], uv: [f32; 2]) -> EmitterSample {
        let (place, probability) = self.tree.pick(&self.lights, point, alias::joined(pick));
        let light = &self.lights[place];
        light.point(uv, (probability / light.area()) as f32)
    }

    /// The density by area with which [`sample_for`](Self::sample_for) chooses each point of a triangle for `point`: 0
    /// if that is no light. For a ray from `point` that hit a light by itself.
    pub fn pdf_area_for(&self, point: Vec3, primitive: u32) -> f32 {
        self.place(primitive).map_or(0.0, |place| {
            let probability = self.tree.probability(&self.lights, point, place);
            (probability / self.lights[place].area()) as f32
        })
    }

    fn place(&self, primitive: u32) -> Option<usize> {
        let found = self.places.binary_search_by_key(&primitive, |&[id, _]| id).ok()?;
        Some(self.places[found][1] as usize)
    }

    /// The luminance of all that the lights give off, to both sides: radiance by area by pi, twice.
    pub fn power(&self) -> f64 {
        self.weight * std::f64::consts::TAU
    }

    /// How many lights there are: one at least.
    pub fn count(&self) -> usize {
        self.lights.len()
    }

    /// The least box around all lights.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bytes of memory that they take up.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.lights) + size_of_val(&*self.places) + self.table.bytes() + self.tree.bytes()
    }

    /// A light is chosen by area and luminance, a point on it by area: the area cancels.
    #[inline]
    fn density(&self, light: &Emitter) -> f32 {
        (luminance(light.radiance) / self.weight) as f32
    }
}

impl Emitter {
    /// What it is chosen by.
    fn weight(&self) -> f64 {
        self.area() * luminance(self.radiance)
    }

    #[inline]
    fn area(&self) -> f64 {
        self.normal().length() * 0.5
    }

    /// The point of it for a pair of numbers, chosen with a density by area.
    #[inline]
    fn point(&self, uv: [f32; 2], pdf_area: f32) -> EmitterSample {
        let [p0, p1, p2] = self.corners;
        let [u, v] = uniform_triangle(uv);
        EmitterSample {
            primitive: self.primitive,
            uv: [u, v],
            // Along the edges, so that a small triangle far away is rounded once only.
            position: p0 + ((p1 - p0) * u + (p2 - p0) * v),
            normal: self.normal().normalize().as_vec3(),
            radiance: self.radiance,
            pdf_area,
        }
    }

    /// As long as twice the area. In double precision, in which no triangle's squares overflow or vanish.
    #[inline]
    fn normal(&self) -> DVec3 {
        let [p0, p1, p2] = self.corners.map(|p| p.as_dvec3());
        (p1 - p0).cross(p2 - p0)
    }
}

/// How bright a linear RGB colour is (ITU-R BT.709).
#[inline]
fn luminance(color: Vec3) -> f64 {
    color.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// A point of a triangle, as barycentric weights of its second and third corner, for a pair of numbers in [0, 1):
/// evenly spread over its area if they are (Heitz, "A low-distortion map between triangle and square", 2019).
#[inline]
pub fn uniform_triangle([u, v]: [f32; 2]) -> [f32; 2] {
    // The square's diagonal is folded onto half of itself; what is near stays near.
    if v > u {
        let half = 0.5 * u;
        [half, v - half]
    } else {
        let half = 0.5 * v;
        [u - half, half]
    }
}
