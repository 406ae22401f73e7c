//! What a ray is inside of, and what is lost there.

use glam::Vec3;

/// The inside of a clear thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// The index of its material.
    pub material: u32,
    /// Its index of refraction; positive.
    pub ior: f32,
    /// Light that is lost, by unit of length: see [`Material::absorption`](crate::mesh::Material::absorption).
    pub absorption: Vec3,
}

/// How many things within one another a ray keeps in mind.
const CAPACITY: usize = 8;

/// The media that a ray is inside of, the innermost last: those that it entered and has not left.
///
/// Schmidt & Budge ("Simple nested dielectrics in ray traced images", 2002) let things overlap, so that a drink may
/// reach into its glass and needs no surface that is shared to the bit. They rank materials to say which one fills an
/// overlap; here it is the one that was entered last, so no model needs ranks. A surface inside of another medium
/// than its own is then no boundary at all: leaving a thing while a later one has not been left has an `eta` of 1.
///
/// Models are not always closed. Leaving what was never entered changes nothing. When more than eight are entered the
/// outermost is forgotten, and leaving that one, some day, changes nothing either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    inside: [Medium; CAPACITY],
    depth: usize,
}

impl Default for Media {
    fn default() -> Self {
        Self::OUTSIDE
    }
}

impl Media {
    /// Outside of everything.
    pub const OUTSIDE: Self =
        Self { inside: [Medium { material: 0, ior: 1.0, absorption: Vec3::ZERO }; CAPACITY], depth: 0 };

    /// Goes into a medium.
    pub fn enter(&mut self, medium: Medium) {
        if self.depth == CAPACITY {
            self.inside.copy_within(1.., 0);
            self.depth -= 1;
        }
        self.inside[self.depth] = medium;
        self.depth += 1;
    }

    /// Goes out of the medium of a material, the last one if it is in several.
    pub fn leave(&mut self, material: u32) {
        if let Some(place) = self.place(material) {
            self.inside.copy_within(place + 1..self.depth, place);
            self.depth -= 1;
        }
    }

    /// The medium around the ray; `None` outside of everything.
    #[inline]
    pub fn innermost(&self) -> Option<&Medium> {
        self.entered().last()
    }

    /// The index of refraction around the ray: 1 outside of everything.
    #[inline]
    pub fn ior(&self) -> f32 {
        self.innermost().map_or(1.0, |medium| medium.ior)
    }

    /// The index of refraction beyond the boundary divided by that before it, for a ray that is about to enter what
    /// has the index `ior`.
    #[inline]
    pub fn eta_entering(&self, ior: f32) -> f32 {
        ior / self.ior()
    }

    /// The same for a ray that is about to leave a material with the index `ior`.
    ///
    /// If it never entered it, it has been inside from the start, as if the eye were in water.
    #[inline]
    pub fn eta_leaving(&self, material: u32, ior: f32) -> f32 {
        match self.place(material) {
            None => self.ior() / ior,
            Some(place) if place + 1 < self.depth => 1.0,
            Some(place) => {
                let around = if place > 0 { self.inside[place - 1].ior } else { 1.0 };
                around / self.inside[place].ior
            }
        }
    }

    /// Whether light is lost in the medium around the ray.
    #[inline]
    pub fn absorbs(&self) -> bool {
        self.innermost().is_some_and(|medium| medium.absorption != Vec3::ZERO)
    }

    /// What is left of light that has come this far through the medium around the ray (Beer and Lambert): all of it
    /// outside of everything. `length` is not negative and may be infinite.
    #[inline]
    pub fn attenuation(&self, length: f32) -> Vec3 {
        let Some(medium) = self.innermost() else { return Vec3::ONE };
        // What absorbs nothing does so over infinite lengths too.
        let left = |a: f32| if a > 0.0 { libm::expf(-a * length) } else { 1.0 };
        Vec3::from_array(medium.absorption.to_array().map(left))
    }

    fn entered(&self) -> &[Medium] {
        &self.inside[..self.depth]
    }

    fn place(&self, material: u32) -> Option<usize> {
        self.entered().iter().rposition(|medium| medium.material == material)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Medium = Medium { material: 3, ior: 1.5, absorption: Vec3::new(0.0, 0.5, 2.0) };
    const WATER: Medium = Medium { material: 7, ior: 1.33, absorption: Vec3::ZERO };

    #[test]
    fn light_fades_exponentially() {
        let mut media = Media::OUTSIDE;
        assert_eq!(media.attenuation(1e9), Vec3::ONE);
        media.enter(GLASS);
        let left = media.attenuation(2.0);
        assert!(left.distance(Vec3::new(1.0, (-1.0f32).exp(), (-4.0f32).exp())) < 1e-6, "{left}");
        // Two ways in a row lose what one of both lengths does.
        assert!((media.attenuation(0.7) * media.attenuation(1.3)).distance(left) < 1e-6);
        assert_eq!(media.attenuation(0.0), Vec3::ONE);
        assert_eq!(media.attenuation(f32::INFINITY), Vec3::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn through_one_thing() {
        let mut media = Media::OUTSIDE;
        assert_eq!(media.eta_entering(GLASS.ior), 1.5);
        media.enter(GLASS);
        assert_eq!((media.ior(), media.eta_leaving(3, 1.5)), (1.5, 1.0 / 1.5));
        media.leave(3);
        assert_eq!(media, Media { inside: media.inside, ..Media::OUTSIDE });
    }

    #[test]
    fn one_thing_within_another() {
        let mut media = Media::OUTSIDE;
        media.enter(WATER);
        assert_eq!(media.eta_entering(GLASS.ior), 1.5 / 1.33);
        media.enter(GLASS);
        assert_eq!(media.eta_leaving(3, 1.5), 1.33 / 1.5);
        media.leave(3);
        assert_eq!(media.innermost(), Some(&WATER));
    }

    #[test]
    fn a_drink_that_reaches_into_its_glass() {
        let mut media = Media::OUTSIDE;
        media.enter(GLASS);
        assert_eq!(media.eta_entering(WATER.ior), 1.33 / 1.5);
        media.enter(WATER);
        assert_eq!(media.eta_leaving(3, 1.5), 1.0, "the glass ends where there is water");
        media.leave(3);
        assert_eq!((media.ior(), media.eta_leaving(7, 1.33)), (1.33, 1.0 / 1.33));
        media.leave(7);
        assert_eq!(media.innermost(), None);
    }

    #[test]
    fn parts_of_one_material_that_overlap() {
        let mut media = Media::OUTSIDE;
        media.enter(GLASS);
        assert_eq!(media.eta_entering(GLASS.ior), 1.0);
        media.enter(GLASS);
        assert_eq!(media.eta_leaving(3, 1.5), 1.0);
        media.leave(3);
        assert_eq!(media.innermost(), Some(&GLASS));
    }

    #[test]
    fn leaving_what_was_not_entered_is_harmless() {
        let mut media = Media::OUTSIDE;
        assert_eq!(media.eta_leaving(7, 1.33), 1.0 / 1.33, "an eye under water");
        media.leave(7);
        assert_eq!(media, Media::OUTSIDE);
        media.enter(GLASS);
        media.leave(7);
        assert_eq!(media.innermost(), Some(&GLASS));
    }

    #[test]
    fn the_outermost_of_too_many_is_forgotten() {
        let mut media = Media::OUTSIDE;
        let shell = |material| Medium { material, ior: 1.0 + material as f32, absorption: Vec3::ZERO };
        (0..10).for_each(|material| media.enter(shell(material)));
        for material in (2..10).rev() {
            assert_eq!(media.innermost(), Some(&shell(material)));
            media.leave(material);
        }
        assert_eq!(media.innermost(), None);
        media.leave(1);
        media.leave(0);
        assert_eq!(media.innermost(), None);
    }
}
