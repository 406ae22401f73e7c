use super::*;
use crate::mesh::ImageSource;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
use std::io::Cursor;

fn encoded(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.into().write_to(&mut bytes, format).expect("encoded");
    bytes.into_inner()
}

fn named(name: &str, bytes: &[u8]) -> Image {
    Image { name: name.into(), source: ImageSource::Bytes(bytes.into()) }
}

/// Opens one picture, that all channels are wanted of.
fn open(name: &str, bytes: &[u8]) -> (Textures, Vec<Problem>) {
    let maps = [Channel::Color, Channel::Data, Channel::Alpha].map(|channel| Map::whole(0, channel));
    Textures::open(&[named(name, bytes)], &maps)
}

/// Opens a picture that nothing is wrong with.
fn fine(picture: impl Into<DynamicImage>) -> Textures {
    let (textures, problems) = open("fine.png", &encoded(picture, ImageFormat::Png));
    assert_eq!(problems, []);
    textures
}

fn color(textures: &Textures, channel: Channel, uv: [f32; 2]) -> Vec3 {
    textures.color(&Map::whole(0, channel), uv.into(), 0.0)
}

/// Four colours, the first above left.
fn quarters() -> image::RgbaImage {
    let colors = [[255, 0, 0, 255], [0, 188, 0, 255], [0, 0, 255, 255], [51, 102, 204, 0]];
    ImageBuffer::from_fn(2, 2, |x, y| Rgba(colors[(y * 2 + x) as usize]))
}

#[test]
fn channels_are_what_they_are_called() {
    let textures = fine(quarters());
    assert_eq!(textures.size(0), Some([2, 2]));
    assert_eq!(color(&textures, Channel::Color, [0.25, 0.75]), Vec3::X);
    assert!((color(&textures, Channel::Color, [0.75, 0.75]).y - 0.5).abs() < 0.005, "sRGB is decoded");
    assert_eq!(color(&textures, Channel::Data, [0.75, 0.25]), Vec3::new(0.2, 0.4, 0.8));
    for (channel, expected) in [
        (Channel::Red, 0.2),
        (Channel::Green, 0.4),
        (Channel::Blue, 0.8),
        (Channel::Alpha, 0.0),
        (Channel::Grey, 1.4 / 3.0),
    ] {
        let found = color(&textures, channel, [0.75, 0.25]);
        assert!((found.x - expected).abs() < 1e-6 && found == Vec3::splat(found.x), "{channel:?}: {found}");
        assert_eq!(textures.value(&Map::whole(0, channel), Vec2::new(0.75, 0.25), 0.0), found.x);
    }
    assert_eq!(textures.sample(&Map::whole(0, Channel::Color), Vec2::new(0.5, 0.5), 0.0).w, 0.75);
}

#[test]
fn maps_place_their_pictures() {
    let textures = fine(quarters());
    let map = Map { scale: [0.5, -2.0], offset: [0.25, 0.5], ..Map::whole(0, Channel::Color) };
    // u: 0.5 * 1 + 0.25; v: -2 * 0.125 + 0.5.
    let placed = textures.color(&map, Vec2::new(1.0, 0.125), 0.0);
    assert_eq!(placed, color(&textures, Channel::Color, [0.75, 0.25]));
    // A footprint of half the picture's width, with four pictures to the unit: all of it.
    let map = Map { scale: [4.0, 4.0], ..Map::whole(0, Channel::Alpha) };
    assert_eq!(textures.value(&map, Vec2::ZERO, 0.25), 191.0 / 255.0);
}

#[test]
fn sizes_of_numbers_and_channels_agree() {
    let expected = Vec3::splat(128.0 / 255.0);
    let word = 128u16 * 257;
    let pictures: [DynamicImage; 8] = [
        ImageBuffer::from_pixel(3, 2, Luma([128u8])).into(),
        ImageBuffer::from_pixel(3, 2, image::LumaA([128u8, 7])).into(),
        ImageBuffer::from_pixel(3, 2, Rgb([128u8; 3])).into(),
        ImageBuffer::from_pixel(3, 2, Rgba([128u8; 4])).into(),
        ImageBuffer::from_pixel(3, 2, Luma([word])).into(),
        ImageBuffer::from_pixel(3, 2, image::LumaA([word, 7])).into(),
        ImageBuffer::from_pixel(3, 2, Rgb([word; 3])).into(),
        ImageBuffer::from_pixel(3, 2, Rgba([word; 4])).into(),
    ];
    for picture in pictures {
        let kind = picture.color();
        let textures = fine(picture);
        assert_eq!(color(&textures, Channel::Data, [0.3, 0.9]), expected, "{kind:?}");
        let light = color(&textures, Channel::Color, [0.3, 0.9]);
        assert!((light - Vec3::splat(0.2158605)).abs().max_element() < 1e-6, "{kind:?}: {light}");
        assert_eq!(textures.has_alpha(0), kind.has_alpha(), "{kind:?}");
    }
}

#[test]
fn bytes_stay_bytes() {
    let textures = fine(ImageBuffer::from_pixel(64, 64, Rgb([1u8, 2, 3])));
    let texels = 64 * 64 * 3;
    assert!(textures.bytes() >= texels && textures.bytes() < texels * 2, "{}", textures.bytes());
    let opaque = fine(ImageBuffer::from_pixel(64, 64, Rgba([1u8, 2, 3, 255])));
    assert_eq!(opaque.bytes(), textures.bytes(), "an alpha that says nothing is not kept");
}

#[test]
fn cut_outs_that_cut_nothing_are_found() {
    let opaque = |picture: DynamicImage, channel| fine(picture).is_opaque(&Map::whole(0, channel));
    let grey = |value: u8| DynamicImage::from(ImageBuffer::from_pixel(4, 4, Luma([value])));
    assert!(opaque(grey(255), Channel::Grey) && opaque(grey(255), Channel::Blue));
    assert!(!opaque(grey(254), Channel::Grey));
    assert!(opaque(grey(9), Channel::Alpha), "pictures without alpha are all there");
    let red = || DynamicImage::from(ImageBuffer::from_pixel(4, 4, Rgb([255u8, 0, 255])));
    assert!(opaque(red(), Channel::Red) && opaque(red(), Channel::Blue));
    assert!(!opaque(red(), Channel::Green) && !opaque(red(), Channel::Grey));
    assert!(!opaque(quarters().into(), Channel::Alpha));
}

#[test]
fn a_ramp_is_as_steep_everywhere() {
    // Heights grow by 1/64 a texel to the right, by twice as much upward.
    let height = |x: u32, y: u32| Luma([(x * 1024 + (31 - y) * 1024) as u16]);
    let textures = fine(ImageBuffer::from_fn(32, 32, height));
    let map = Map { clamp: true, ..Map::whole(0, Channel::Grey) };
    let steep = 32.0 * 1024.0 / 65535.0;
    for footprint in [0.0, 1.0 / 64.0, 1.0 / 16.0] {
        let gradient = textures.gradient(&map, Vec2::splat(0.5), footprint);
        assert!((gradient - Vec2::splat(steep)).abs().max_element() < 1e-3, "{footprint}: {gradient}");
    }
    let map = Map { scale: [2.0, -0.5], strength: 3.0, ..map };
    let gradient = textures.gradient(&map, Vec2::new(0.25, -1.0), 0.0);
    assert!((gradient - Vec2::new(6.0, -1.5) * steep).abs().max_element() < 1e-3, "{gradient}");
    for wild in [f32::NAN, f32::INFINITY, -1e30] {
        assert!(textures.gradient(&map, Vec2::splat(wild), wild).is_finite(), "{wild}");
    }
    assert_eq!(fine(ImageBuffer::from_pixel(1, 1, Luma([7u8]))).gradient(&map, Vec2::ONE, 0.3), Vec2::ZERO);
}

#[test]
fn normals_are_decoded() {
    let textures = fine(ImageBuffer::from_pixel(2, 2, Rgb([65535u16, 32768, 65535])));
    let map = Map::whole(0, Channel::Data);
    let normal = |strength| textures.normal(&Map { strength, ..map.clone() }, Vec2::ZERO, 0.0);
    let close = |a: Vec3, b: Vec3| a.distance(b.normalize()) < 1e-4;
    assert!(close(normal(1.0), Vec3::new(1.0, 0.0, 1.0)));
    assert!(close(normal(0.5), Vec3::new(0.5, 0.0, 1.0)));
    assert!(close(normal(0.0), Vec3::Z));
}

#[test]
fn only_what_maps_name_is_opened() {
    let good = encoded(quarters(), ImageFormat::Png);
    let images = [named("a.png", b"broken"), named("b.png", &good), named("c.png", b"broken")];
    let (textures, problems) =
        Textures::open(&images, [&Map::whole(1, Channel::Color), &Map::whole(9, Channel::Red)]);
    assert_eq!((textures.len(), problems.len()), (1, 0));
    assert_eq!((textures.size(0), textures.size(1)), (None, Some([2, 2])));
    let (textures, problems) = Textures::open(&images, []);
    assert!(textures.is_empty() && problems.is_empty());
}

#[test]
fn what_cannot_be_opened_leaves_the_material_as_it_is() {
    let missing = Image { name: "gone.png".into(), source: ImageSource::Missing("is not\nthere".into()) };
    let map = Map::whole(0, Channel::Color);
    let (textures, problems) = Textures::open(&[missing], [&map]);
    assert_eq!(problems, [Problem { image: "gone.png".into(), message: "is not there".into() }]);
    assert_eq!(problems[0].to_string(), "texture gone.png is not there; a plain colour takes its place");
    assert_eq!(textures.sample(&map, Vec2::ONE, 1.0), Vec4::ONE);
    assert_eq!(textures.normal(&map, Vec2::ONE, 1.0), Vec3::Z);
    assert_eq!(textures.gradient(&map, Vec2::ONE, 1.0), Vec2::ZERO);
    assert!(textures.is_opaque(&map) && !textures.has_alpha(0) && !textures.has_alpha(77));
}

#[test]
fn every_kind_of_file_is_read() {
    let picture = ImageBuffer::from_pixel(16, 16, Rgb([0u8, 255, 0]));
    for (format, ending) in [
        (ImageFormat::Png, "png"),
        (ImageFormat::Jpeg, "jpg"),
        (ImageFormat::Tga, "TGA"),
        (ImageFormat::Bmp, "bmp"),
        (ImageFormat::Gif, "gif"),
        (ImageFormat::Tiff, "tif"),
        (ImageFormat::WebP, "webp"),
    ] {
        let (textures, problems) = open(&format!("green.{ending}"), &encoded(picture.clone(), format));
        assert_eq!(problems, [], "{ending}");
        let green = color(&textures, Channel::Color, [0.4, 0.6]);
        assert!(green.distance(Vec3::Y) < 0.02, "{ending}: {green}");
    }
    let lamp = ImageBuffer::from_pixel(16, 16, Rgb([0.25f32, 8.0, 0.0]));
    for (format, ending) in [(ImageFormat::OpenExr, "exr"), (ImageFormat::Hdr, "hdr")] {
        let (textures, problems) = open(&format!("lamp.{ending}"), &encoded(lamp.clone(), format));
        assert_eq!(problems, [], "{ending}");
        let light = color(&textures, Channel::Color, [0.4, 0.6]);
        assert!(light.distance(Vec3::new(0.25, 8.0, 0.0)) < 0.05, "{ending}: {light}");
    }
}

#[test]
fn names_that_lie_about_the_kind_do_no_harm() {
    let (textures, problems) = open("really-a.jpg", &encoded(quarters(), ImageFormat::Png));
    assert_eq!(problems, []);
    assert_eq!(textures.len(), 1);
}

#[test]
fn of_an_animation_the_first_picture_counts() {
    let frame = |color: [u8; 4]| image::Frame::new(ImageBuffer::from_pixel(8, 8, Rgba(color)));
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::gif::GifEncoder::new(&mut bytes);
    encoder.encode_frames([frame([255, 0, 0, 255]), frame([0, 255, 0, 255])]).expect("encoded");
    drop(encoder);
    let (textures, problems) = open("moving.gif", &bytes);
    assert_eq!(problems, []);
    assert_eq!(color(&textures, Channel::Color, [0.5, 0.5]), Vec3::X);
}

#[test]
fn floats_that_are_no_light_are_repaired() {
    let texel = Rgb([f32::NAN, -3.0, f32::INFINITY]);
    let (textures, problems) =
        open("odd.exr", &encoded(ImageBuffer::from_pixel(2, 2, texel), ImageFormat::OpenExr));
    assert_eq!(problems, []);
    assert_eq!(color(&textures, Channel::Color, [0.5, 0.5]), Vec3::new(0.0, 0.0, 65504.0));
}

/// A PNG of one row of four texels with a palette.
fn palette() -> Vec<u8> {
    let pixels = [0b00_01_10_11u8];
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    bytes.extend(chunk(b"IHDR", &[0, 0, 0, 4, 0, 0, 0, 1, 2, 3, 0, 0, 0]));
    bytes.extend(chunk(b"PLTE", &[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255]));
    bytes.extend(chunk(b"tRNS", &[255, 0]));
    // One stored block of deflate: the row's filter and its texels.
    let row = [0, pixels[0]];
    let mut data = vec![0x78, 0x01, 0x01, 2, 0, 0xfd, 0xff];
    data.extend(row);
    let (a, b) = row.iter().fold((1u32, 0u32), |(a, b), &x| (a + u32::from(x), b + a + u32::from(x)));
    data.extend((b << 16 | a).to_be_bytes());
    bytes.extend(chunk(b"IDAT", &data));
    bytes.extend(chunk(b"IEND", &[]));
    bytes
}

/// A chunk of a PNG file with its checksum.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    let crc = body.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ (0xedb8_8320 & 0u32.wrapping_sub(crc & 1)))
    });
    [&(data.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
}

#[test]
fn palettes_are_looked_up() {
    let (textures, problems) = open("palette.png", &palette());
    assert_eq!(problems, []);
    let map = Map::whole(0, Channel::Color);
    let at = |x: f32| textures.sample(&map, Vec2::new(x, 0.5), 0.0);
    assert_eq!(at(0.125), Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(at(0.375), Vec4::new(0.0, 1.0, 0.0, 0.0));
    assert_eq!(at(0.875), Vec4::ONE);
}

#[test]
fn hostile_pictures_are_problems_of_one_line() {
    let noise =
        ImageBuffer::from_fn(64, 64, |x, y| Rgb([x * 37 % 251, y * 91 % 253, x * y % 255].map(|c| c as u8)));
    let header = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        let sides = [width.to_be_bytes(), height.to_be_bytes()].concat();
        bytes.extend(chunk(b"IHDR", &[&sides[..], &[8, 6, 0, 0, 0]].concat()));
        bytes.extend(chunk(b"IDAT", &[0x78, 0x01]));
        bytes
    };
    // A BMP of no texels: a header of the first kind, then one of 40 bytes with zero sides.
    let mut flat = encoded(noise.clone(), ImageFormat::Bmp);
    flat[18..26].fill(0);
    let mut cases = vec![
        ("text.png".to_owned(), b"not a picture".to_vec(), "broken picture"),
        ("text.txt".to_owned(), b"not a picture".to_vec(), "no picture of a known kind"),
        ("nothing.png".to_owned(), Vec::new(), "broken picture"),
        ("wide.png".to_owned(), header(65535, 65535), "larger than 32768"),
        ("vast.png".to_owned(), header(32768, 32768), "or 1024 MiB"),
        ("beyond.png".to_owned(), header(u32::MAX, u32::MAX), ""),
        ("zero.png".to_owned(), header(0, 4), ""),
        ("lie.png".to_owned(), header(512, 512), "broken picture"),
        ("zero.bmp".to_owned(), flat, ""),
    ];
    for (format, ending) in [
        (ImageFormat::Png, "png"),
        (ImageFormat::Jpeg, "jpg"),
        (ImageFormat::Tga, "tga"),
        (ImageFormat::Bmp, "bmp"),
        (ImageFormat::Gif, "gif"),
        (ImageFormat::Tiff, "tif"),
        (ImageFormat::WebP, "webp"),
    ] {
        let whole = encoded(noise.clone(), format);
        cases.push((format!("half.{ending}"), whole[..whole.len() / 2].to_vec(), "broken picture"));
    }
    for (name, bytes, expected) in cases {
        let (textures, problems) = open(&name, &bytes);
        assert_eq!((textures.len(), problems.len()), (0, 1), "{name}");
        let problem = problems[0].to_string();
        assert!(problem.contains(&name) && problem.contains(expected), "{name}: {problem}");
        assert!(!problem.contains('\n'), "{problem:?}");
    }
}

#[test]
fn files_that_cannot_be_read_are_problems_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| Image { name: name.into(), source: ImageSource::File(folder.path().join(name)) };
    quarters().save(folder.path().join("here.png")).expect("written");
    let images = [file("here.png"), file("gone.png"), file(".")];
    let maps = [0, 1, 2].map(|image| Map::whole(image, Channel::Color));
    let (textures, problems) = Textures::open(&images, &maps);
    assert_eq!(textures.len(), 1);
    let names: Vec<_> = problems.iter().map(|problem| &problem.image[..]).collect();
    assert_eq!(names, ["gone.png", "."]);
    assert!(problems.iter().all(|problem| problem.message.starts_with("cannot be read: ")), "{problems:?}");
}
