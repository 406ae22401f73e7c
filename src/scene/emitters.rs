//! Triangles that give off light, and how to choose a point on one of them.

use super::alias::AliasTable;
use crate::geometry::Aabb;
use glam::{DVec3, Vec3};

/// All the triangles of a scene that give off light: the same radiance in all directions, on both sides.
///
/// Of many lights one is chosen as often as its power is of all power, wherever the light is to fall: one distant and
/// strong light is chosen more often than a near and weak one. A choice takes the same time for any number of
/// lights. Corners are kept here, so that a choice reads nothing of the scene: 60 bytes a light.
#[derive(Clone, Debug)]
pub struct Emitters {
    /// In the order of their primitive ids.
    lights: Box<[Emitter]>,
    table: AliasTable,
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
    /// The density by area with which this point was chosen, of all points of all lights. Positive.
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
        let weights: Vec<f64> = lights.iter().map(Emitter::weight).collect();
        Some(Self {
            table: AliasTable::new(&weights),
            weight: weights.iter().sum(),
            bounds: Aabb::of_points(lights.iter().flat_map(|light| light.corners)),
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
        let [p0, p1, p2] = light.corners;
        let [u, v] = uniform_triangle(uv);
        EmitterSample {
            primitive: light.primitive,
            uv: [u, v],
            // Along the edges, so that a small triangle far away is rounded once only.
            position: p0 + ((p1 - p0) * u + (p2 - p0) * v),
            normal: light.normal().normalize().as_vec3(),
            radiance: light.radiance,
            pdf_area: self.density(light),
        }
    }

    /// The density by area with which [`sample`](Self::sample) chooses each point of a triangle: 0 if that is no
    /// light. For a ray that hit a light by itself.
    #[inline]
    pub fn pdf_area(&self, primitive: u32) -> f32 {
        let place = self.lights.binary_search_by_key(&primitive, |light| light.primitive);
        place.map_or(0.0, |place| self.density(&self.lights[place]))
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
        size_of_val(&*self.lights) + self.table.bytes()
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
        self.normal().length() * 0.5 * luminance(self.radiance)
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A square around `center` in a plane at right angles to Y, of two triangles.
    fn square(first: u32, center: Vec3, side: f32, radiance: [Vec3; 2]) -> [(u32, [Vec3; 3], Vec3); 2] {
        let at = |x: f32, z: f32| center + Vec3::new(x, 0.0, z) * side;
        let [a, b, c, d] = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
        [(first, [a, b, c], radiance[0]), (first + 1, [a, c, d], radiance[1])]
    }

    /// The mean of `f` over `count` samples.
    fn mean(emitters: &Emitters, count: u32, f: impl Fn(&EmitterSample) -> f64) -> f64 {
        // An additive recurrence in four dimensions.
        let fraction = |i: u32, step: f64| (f64::from(i) * step).fract() as f32 * 0.999_999_9;
        let sum: f64 = (0..count)
            .map(|i| {
                let pick = [fraction(i, 0.856_674_883_854_502_9), fraction(i, 0.733_891_856_627_126)];
                let uv = [fraction(i, 0.628_706_721_307_471_9), fraction(i, 0.538_597_257_252_359_5)];
                f(&emitters.sample(pick, uv))
            })
            .sum();
        sum / f64::from(count)
    }

    /// The green light on a surface at the origin that faces +Y.
    fn irradiance(emitters: &Emitters, count: u32) -> f64 {
        mean(emitters, count, |s| {
            let way = s.position.as_dvec3();
            let toward = way.normalize();
            let cosines = toward.y.max(0.0) * toward.dot(s.normal.as_dvec3()).abs();
            f64::from(s.radiance.y) * cosines / way.length_squared() / f64::from(s.pdf_area)
        })
    }

    #[test]
    fn below_a_square_light() {
        // The form factor from a small surface to a parallel rectangle with a corner over it (Howell, "A catalog of
        // radiation heat transfer configuration factors", B-4), of which there are four.
        let form = |a: f64| {
            let slope = (1.0 + a * a).sqrt();
            4.0 / (2.0 * PI) * 2.0 * (a / slope * (a / slope).atan())
        };
        for (height, side) in [(1.0, 1.0), (2.0, 1.0), (0.5, 2.0)] {
            let light = square(4, Vec3::Y * height, side, [Vec3::splat(3.0); 2]);
            let emitters = Emitters::new(light).expect("a light");
            let expected = PI * 3.0 * form(f64::from(side / 2.0 / height));
            let found = irradiance(&emitters, 20_000);
            assert!((found / expected - 1.0).abs() < 5e-3, "{height} {side}: {found} {expected}");
        }
    }

    #[test]
    fn lights_of_different_strength_and_size_add_up() {
        let near = square(0, Vec3::Y, 1.0, [Vec3::ONE; 2]);
        let far = square(9, Vec3::new(1.0, 4.0, 0.5), 1.5, [Vec3::new(40.0, 20.0, 10.0); 2]);
        let apart = [near, far].map(|light| irradiance(&Emitters::new(light).expect("a light"), 20_000));
        let together = Emitters::new(near.into_iter().chain(far)).expect("lights");
        assert_eq!((together.count(), together.bytes()), (4, 4 * 60));
        let found = irradiance(&together, 200_000);
        assert!((found / (apart[0] + apart[1]) - 1.0).abs() < 1e-2, "{found} {apart:?}");
    }

    #[test]
    fn far_away_it_is_a_point() {
        for distance in [20.0f32, 40.0] {
            let light = square(0, Vec3::new(0.6, 0.8, 0.0) * distance, 0.5, [Vec3::splat(7.0); 2]);
            let emitters = Emitters::new(light).expect("a light");
            // Intensity is radiance by area by cosine; the surface's own cosine is the same.
            let expected = 7.0 * 0.25 * 0.8 * 0.8 / f64::from(distance * distance);
            let found = irradiance(&emitters, 2000);
            assert!((found / expected - 1.0).abs() < 1e-2, "{distance}: {found} {expected}");
        }
    }

    #[test]
    fn densities_are_of_all_points_of_all_lights() {
        let dim = square(10, Vec3::ZERO, 2.0, [Vec3::splat(0.5), Vec3::new(0.0, 0.0, 1.0)]);
        let bright = square(3, Vec3::X * 4.0, 0.125, [Vec3::splat(900.0), Vec3::splat(100.0)]);
        let emitters = Emitters::new(dim.into_iter().chain(bright)).expect("lights");
        // Over all areas they add up to 1.
        let areas = [(10, 2.0), (11, 2.0), (3, 0.007_812_5), (4, 0.007_812_5)];
        let sum: f32 = areas.iter().map(|&(primitive, area)| emitters.pdf_area(primitive) * area).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        for (primitive, area) in areas {
            let often = mean(&emitters, 50_000, |s| f64::from(u8::from(s.primitive == primitive)));
            let expected = f64::from(emitters.pdf_area(primitive) * area);
            assert!((often - expected).abs() < 1e-3, "{primitive}: {often} {expected}");
            mean(&emitters, 100, |s| {
                assert_eq!(s.pdf_area, emitters.pdf_area(s.primitive));
                0.0
            });
        }
        assert_eq!(
            (emitters.pdf_area(0), emitters.pdf_area(5), emitters.pdf_area(u32::MAX)),
            (0.0, 0.0, 0.0)
        );
        let power = (0.5 * 2.0 + 0.0722 * 2.0 + 1000.0 * 0.007_812_5) * 2.0 * PI;
        assert!((emitters.power() / power - 1.0).abs() < 1e-6, "{}", emitters.power());
        let bounds = emitters.bounds();
        assert_eq!((bounds.min, bounds.max), (Vec3::new(-1.0, 0.0, -1.0), Vec3::new(4.0625, 0.0, 1.0)));
    }

    #[test]
    fn what_gives_off_nothing_is_no_light() {
        let [(_, corners, _), _] = square(0, Vec3::ZERO, 1.0, [Vec3::ONE; 2]);
        let [a, b, _] = corners;
        let nothing = [
            (0, corners, Vec3::ZERO),
            (1, [a, b, a], Vec3::ONE),
            (2, [a, a.lerp(b, 0.5), b], Vec3::ONE),
            (3, [a, b, Vec3::NAN], Vec3::ONE),
            (4, [a, b, Vec3::INFINITY], Vec3::ONE),
            (5, corners, Vec3::NAN),
            (6, corners, Vec3::INFINITY),
            (7, corners, Vec3::NEG_ONE),
        ];
        assert!(Emitters::new(nothing).is_none());
        assert!(Emitters::new([]).is_none());
        let twice = [(9, corners, Vec3::ONE), (9, corners, Vec3::splat(2.0))];
        let emitters = Emitters::new(nothing.into_iter().chain(twice)).expect("a light");
        assert_eq!(emitters.count(), 1);
        assert_eq!(emitters.sample([0.0; 2], [0.5; 2]).radiance, Vec3::ONE);
        assert_eq!(emitters.pdf_area(3), 0.0);
    }

    #[test]
    fn lights_of_any_scale() {
        for scale in [1e-15f32, 1.0, 1e15] {
            let light = square(0, Vec3::Y * scale, scale, [Vec3::ONE; 2]);
            let emitters = Emitters::new(light).expect("a light");
            let s = emitters.sample([0.9, 0.1], [0.2, 0.7]);
            assert_eq!((s.primitive, s.normal), (1, Vec3::NEG_Y), "{scale}");
            assert!((s.pdf_area * scale * scale - 1.0).abs() < 1e-5, "{scale}: {}", s.pdf_area);
        }
    }

    #[test]
    fn a_hundred_thousand_lights() {
        let lights = (0..50_000u32).flat_map(|i| {
            let radiance = Vec3::splat((i % 100) as f32 + 1.0);
            square(2 * i, Vec3::new((i % 250) as f32, 5.0, (i / 250) as f32), 0.5, [radiance; 2])
        });
        let emitters = Emitters::new(lights).expect("lights");
        assert_eq!(emitters.count(), 100_000);
        // A light of strength s is chosen as often as s: the mean strength is that of squares by that of firsts, 67.
        let strength = mean(&emitters, 100_000, |s| f64::from(s.radiance.x));
        assert!((strength - 67.0).abs() < 0.3, "{strength}");
    }

    #[test]
    fn triangles_are_filled_evenly() {
        const N: u32 = 128;
        let points =
            (0..N * N).map(|i| uniform_triangle([i % N, i / N].map(|k| (k as f32 + 0.5) / N as f32)));
        let (mut first, mut squares, mut quarters) = (0.0, 0.0, [0; 4]);
        for [u, v] in points {
            let w = 1.0 - u - v;
            assert!(u >= 0.0 && v >= 0.0 && w >= -1e-6);
            first += f64::from(u);
            squares += f64::from(u * v);
            quarters[[u, v, w].iter().position(|&x| x > 0.5).unwrap_or(3)] += 1;
        }
        let count = f64::from(N * N);
        assert!((first / count - 1.0 / 3.0).abs() < 1e-3 && (squares / count - 1.0 / 12.0).abs() < 1e-3);
        // The triangles that the middles of the sides make of it are of the same size.
        assert!(quarters.iter().all(|&n| (f64::from(n) / count - 0.25).abs() < 0.01), "{quarters:?}");
        for corner in [[0.0, 0.0], [0.999_999_94, 0.0], [0.0, 0.999_999_94], [0.999_999_94; 2]] {
            let [u, v] = uniform_triangle(corner);
            assert!(u + v <= 1.0, "{corner:?}");
        }
    }
}
