use super::*;
use image::{ImageBuffer, Rgb};
use std::f32::consts::{FRAC_1_SQRT_2, PI};

/// A sky that is bright around one direction, black below, with a black hole in it.
fn sky() -> Environment {
    let (width, height) = (32, 16);
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        match (x, y) {
            (20, 3) => [900.0, 800.0, 500.0],
            (5..9, 0..8) => [0.0; 3],
            (_, 0..8) => [0.1, 0.2 + 0.05 * x as f32, 0.9],
            _ => [0.0; 3],
        }
    };
    Environment::new(width, height, (0..width * height).map(texel).collect())
}

/// Points that cover the unit square evenly.
fn grid(side: usize) -> impl Iterator<Item = [f32; 2]> {
    let middle = move |i: usize| (i as f32 + 0.5) / side as f32;
    (0..side * side).map(move |i| [middle(i % side), middle(i / side)])
}

/// The direction of a point of the unit square, uniform on the sphere.
fn direction([u, v]: [f32; 2]) -> Vec3 {
    let (cosine, phi) = (1.0 - 2.0 * v, 2.0 * PI * u);
    let sine = (1.0 - cosine * cosine).sqrt();
    Vec3::new(sine * phi.cos(), cosine, sine * phi.sin())
}

#[test]
fn directions_are_where_the_documentation_says() {
    let middle = |direction| {
        let [u, v] = place(direction);
        assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v));
        (u, v)
    };
    assert_eq!(middle(Vec3::NEG_Z), (0.5, 0.5));
    assert_eq!(middle(Vec3::X), (0.75, 0.5));
    assert_eq!(middle(Vec3::NEG_X), (0.25, 0.5));
    assert_eq!(middle(Vec3::Y).1, 0.0);
    assert_eq!(middle(Vec3::NEG_Y).1, 1.0);
    assert_eq!(middle(Vec3::new(0.0, FRAC_1_SQRT_2, -FRAC_1_SQRT_2)), (0.5, 0.25));
    let behind = [middle(Vec3::new(-1e-6, 0.0, 1.0)).0, middle(Vec3::new(1e-6, 0.0, 1.0)).0];
    assert!(behind[0] < 1e-6 && behind[1] > 1.0 - 1e-6, "{behind:?}");
}

#[test]
fn radiance_is_blended_around_the_world() {
    let texels = vec![[1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3], [1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3]];
    let environment = Environment::new(4, 2, texels);
    let at = |direction: Vec3| environment.radiance(direction.normalize()).x;
    assert!((at(Vec3::NEG_Z) - 2.5).abs() < 1e-6);
    assert!((at(Vec3::Z) - 2.5).abs() < 1e-6, "between the last column and the first");
    assert!((at(Vec3::new(1.0, 0.0, -1.0)) - 3.0).abs() < 1e-6);
    assert!((at(Vec3::new(1.0, 5.0, -1.0)) - 3.0).abs() < 1e-5, "above the first row's middle");
    for wild in [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY, Vec3::MAX] {
        assert!(environment.radiance(wild).is_finite(), "{wild}");
        assert!(environment.pdf(wild).is_finite(), "{wild}");
    }
}

#[test]
fn a_uniform_one_is_chosen_from_uniformly() {
    let color = Vec3::new(0.3, 0.7, 1.9);
    let environment = Environment::uniform(color);
    let expected = 1.0 / (4.0 * PI);
    let mut sum = Vec3::ZERO;
    for random in grid(32) {
        let sample = environment.sample(random);
        assert!((sample.pdf - expected).abs() < 1e-7 && sample.direction.is_normalized());
        assert_eq!(sample.radiance, color);
        assert_eq!(environment.pdf(sample.direction), sample.pdf);
        sum += sample.direction;
    }
    assert!(sum.length() < 1e-2, "{sum}");
}

#[test]
fn densities_integrate_to_one() {
    for environment in [sky(), Environment::uniform(Vec3::ONE), Environment::new(4, 2, vec![[0.0; 3]; 8])] {
        let side = 512;
        let sum: f64 = grid(side).map(|point| f64::from(environment.pdf(direction(point)))).sum();
        let integral = sum / (side * side) as f64 * f64::from(4.0 * PI);
        assert!((integral - 1.0).abs() < 0.01, "{integral}");
    }
}

#[test]
fn samples_have_the_density_that_is_asked_for() {
    let environment = sky();
    for random in grid(64) {
        let sample = environment.sample(random);
        let asked = environment.pdf(sample.direction);
        assert!((asked - sample.pdf).abs() <= 1e-4 * sample.pdf, "{random:?}: {} {asked}", sample.pdf);
    }
}

#[test]
fn the_mean_of_the_samples_is_the_light() {
    let environment = sky();
    // A function of the direction, that what is sampled is weighed with: all of the sphere counts.
    let weight = |direction: Vec3| 1.0 + 0.5 * direction.x - 0.3 * direction.y + 0.2 * direction.z;
    let mean = |side: usize, value: &dyn Fn([f32; 2]) -> Vec3| {
        grid(side).map(|point| value(point).as_dvec3()).sum::<DVec3>() / (side * side) as f64
    };
    let expected =
        mean(1024, &|point| environment.radiance(direction(point)) * weight(direction(point)) * 4.0 * PI);
    let sampled = mean(256, &|random| {
        let sample = environment.sample(random);
        sample.radiance * weight(sample.direction) / sample.pdf
    });
    assert!(
        (sampled - expected).abs().max_element() < 0.005 * expected.max_element(),
        "{sampled} {expected}"
    );
}

#[test]
fn every_direction_that_light_comes_from_has_a_density() {
    let environment = sky();
    for direction in grid(200).map(direction) {
        let lit = environment.radiance(direction).max_element() > 1e-6;
        assert!(!lit || environment.pdf(direction) > 0.0, "{direction}");
    }
}

#[test]
fn no_random_number_is_out_of_range() {
    let wild = [0.0, 1.0, 1.0 - f32::EPSILON / 2.0, -1.0, f32::NAN, f32::INFINITY];
    for environment in [sky(), Environment::new(4, 2, vec![[0.0; 3]; 8])] {
        for u in wild {
            for v in wild {
                let sample = environment.sample([u, v]);
                assert!(sample.direction.is_normalized() && sample.pdf > 0.0 && sample.radiance.is_finite());
            }
        }
    }
}

#[test]
fn what_is_no_light_is_repaired_and_counted() {
    let mut texels = vec![[1.0; 3]; 8];
    texels[2] = [f32::NAN, -1.0, f32::INFINITY];
    texels[3] = [f32::NEG_INFINITY, f32::MAX, -0.0];
    let environment = Environment::new(4, 2, texels);
    assert_eq!(environment.repaired(), 5);
    assert_eq!(environment.texels[2], [0.0, 0.0, 65504.0]);
    for random in grid(16) {
        let sample = environment.sample(random);
        assert!(sample.radiance.is_finite() && sample.pdf > 0.0, "{sample:?}");
    }
}

#[test]
fn files_hold_light_or_srgb() {
    let folder = tempfile::tempdir().expect("a folder");
    let amounts = ImageBuffer::from_fn(4, 2, |x, y| Rgb([x as f32, y as f32, 8.0]));
    for name in ["sky.exr", "sky.hdr"] {
        let path = folder.path().join(name);
        amounts.save(&path).expect("written");
        let environment = Environment::open(&path).expect(name);
        assert_eq!((environment.width, environment.height, environment.repaired()), (4, 2, 0));
        for (i, texel) in environment.texels.iter().enumerate() {
            let expected = [(i % 4) as f32, (i / 4) as f32, 8.0];
            assert!(texel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.05), "{name}: {texel:?}");
        }
    }
    let path = folder.path().join("sky.png");
    ImageBuffer::from_pixel(4, 2, Rgb([188u8, 0, 255])).save(&path).expect("written");
    let texel = Environment::open(&path).expect("a picture").texels[5];
    assert!((texel[0] - 0.5).abs() < 0.005 && texel[1] == 0.0 && texel[2] == 1.0, "{texel:?}");
}

#[test]
fn unreadable_ones_are_errors_of_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    ImageBuffer::from_pixel(4, 4, Rgb([1u8, 2, 3])).save(folder.path().join("square.png")).expect("written");
    ImageBuffer::from_pixel(64, 32, Rgb([1.0f32, 2.0, 3.0]))
        .save(folder.path().join("whole.exr"))
        .expect("written");
    let whole = std::fs::read(folder.path().join("whole.exr")).expect("read");
    write("half.exr", &whole[..whole.len() / 2]);
    write("text.exr", b"not a picture\n");
    write("text.hdr", b"#?RADIANCE\nnonsense\n\n-Y 2 +X 4\n");
    write("sky.xyz", b"what?");
    for (name, expected) in [
        ("none.exr", "cannot read"),
        ("", "cannot read"),
        ("square.png", "has 4 x 4 texels"),
        ("half.exr", "broken picture"),
        ("text.exr", "broken picture"),
        ("text.hdr", "broken picture"),
        ("sky.xyz", "is no picture of a known kind"),
    ] {
        let message = Environment::open(folder.path().join(name)).expect_err(name).to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{name}: {message}");
        assert!(message.contains(name), "{message}");
    }
}
