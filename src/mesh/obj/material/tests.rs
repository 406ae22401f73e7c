use super::super::mtl;
use super::*;

/// The one material of a text, and the pictures that it names.
#[track_caller]
fn made(text: &str) -> (Material, Vec<String>) {
    let (definitions, bad_lines) = mtl::parse(format!("newmtl m\n{text}").as_bytes());
    assert_eq!((definitions.len(), bad_lines), (1, 0), "{text}");
    let mut names: Vec<String> = Vec::new();
    let mut image = |name: &str| {
        let place = names.iter().position(|known| known == name);
        place.unwrap_or_else(|| {
            names.push(name.into());
            names.len() - 1
        }) as u32
    };
    let material = material(&definitions[0], "m.mtl:1".into(), &mut image);
    assert_eq!(material.fault(), None, "{material:?}");
    (material, names)
}

#[track_caller]
fn of(text: &str) -> Material {
    made(text).0
}

#[test]
fn every_model_of_illumination_picks_what_counts() {
    let matt = Material { place: "m.mtl:1".into(), ..Material::matt("m", Vec3::splat(0.5)) };
    let shiny = Material { specular: Vec3::splat(0.25), roughness: (2.0_f32 / 50.0).sqrt(), ..matt.clone() };
    let seen = Material { reflects: true, ..shiny.clone() };
    let text = "Kd 0.5\nKs 0.25\nNs 48\nTf 0.5\nNi 2\nd 1\n";
    for (illum, expected) in [
        ("", shiny.clone()),
        ("illum 0", Material { unlit: true, roughness: shiny.roughness, ..matt.clone() }),
        ("illum 1", Material { roughness: shiny.roughness, ..matt.clone() }),
        ("illum 2", shiny.clone()),
        ("illum 3", seen.clone()),
        ("illum 4", Material { transmission: Vec3::splat(0.5), roughness: 0.0, ..seen.clone() }),
        ("illum 5", Material { fresnel: true, ..seen.clone() }),
        (
            "illum 6",
            Material { transmission: Vec3::splat(0.5_f32.sqrt()), roughness: 0.0, ior: 2.0, ..seen.clone() },
        ),
        ("illum 8", shiny.clone()),
        ("illum 9", Material { transmission: Vec3::splat(0.5), roughness: 0.0, ..shiny.clone() }),
        ("illum 10", shiny.clone()),
    ] {
        assert_eq!(of(&format!("{text}{illum}\n")), expected, "{illum}");
    }
    let seven = Material { fresnel: true, ..of(&format!("{text}illum 6\n")) };
    assert_eq!(of(&format!("{text}illum 7\n")), seven);
}

#[test]
fn glass_of_known_models_is_clear() {
    // The Cornell box's sphere, a wine glass, and an oven's black window.
    let sphere = of("Kd 0.01\nKs 0.3\nTf 0.1\nNs 200\nNi 2.5\nillum 7\n");
    assert_eq!((sphere.roughness, sphere.ior, sphere.fresnel), (0.0, 2.5, true));
    assert!(
        (sphere.transmission * sphere.transmission - 0.1).abs().max_element() < 1e-6,
        "through both sides"
    );
    assert_eq!(sphere.diffuse, Vec3::splat(0.01));
    let glass = of("Kd 0\nKs 1\nTf 1 1 1\nNi 1.5\nd 1\nillum 7\nNs 10000\n");
    assert_eq!((glass.transmission, glass.specular, glass.ior), (Vec3::ONE, Vec3::ONE, 1.5));
    let black = of("Kd 0\nKs 1\nTf 0 0 0\nNi 1.5\nd 1\nillum 7\nNs 10000\n");
    assert_eq!((black.transmission, black.ior, black.fresnel, black.roughness), (Vec3::ZERO, 1.0, true, 0.0));
    assert!((black.specular - 0.04).abs().max_element() < 1e-6, "{}", black.specular);
    // A car's window and a church's.
    let pane = of("Ns 1000\nNi 1\nd 1\nTf 0.4\nillum 4\nKd 0\nKs 0.1\n");
    assert_eq!((pane.transmission, pane.ior, pane.opacity), (Vec3::splat(0.4), 1.0, 1.0));
    let lamp = of("Tf 0.4\nillum 4\nKd 0.1373\nKs 0.8\n");
    assert!(
        (lamp.transmission - 0.2).abs().max_element() < 1e-6,
        "what is thrown back cannot go through as well"
    );
    let church = of("Ns 256\nNi 1\nTf 0.5\nillum 6\nKd 0\nKs 0.1\n");
    assert_eq!((church.ior, church.transmission), (1.0, Vec3::splat(0.5_f32.sqrt())));
}

#[test]
fn where_it_is_open_whether_light_goes_through() {
    let opaque = |text: &str| {
        let material = of(text);
        material.transmission == Vec3::ZERO && material.opacity == 1.0
    };
    assert!(opaque("illum 4\nKd 0.5\nKa 0\nTf 1 1 1\nNi 1\n"), "as Maya writes every surface");
    assert!(opaque("illum 4\nTf 1 1 1\nKd 0\nmap_Kd a.jpg\n"), "its colour is a picture");
    assert!(opaque("illum 7\nKd 0.5\nd 1\nNi 1.5\n"));
    assert!(opaque("illum 2\nTf 0.5\nd 1\n"));
    assert_eq!(of("illum 4\nKd 0\n").transmission, Vec3::ONE);
    assert_eq!(of("illum 7\nKd 0\n").transmission, Vec3::ONE);
    assert_eq!(of("illum 7\nKd 0\n").ior, 1.5, "common glass");
    assert_eq!(of("illum 6\nKd 0\nNi 0\n").ior, 1.5, "0 is none");
    let dissolved = of("illum 6\nKd 0\nd 0.25\n");
    assert_eq!((dissolved.transmission, dissolved.opacity), (Vec3::splat(0.75), 1.0));
    for illum in [2, 4, 9] {
        let thin = of(&format!("illum {illum}\nKd 0.6\nd 0.25\n"));
        assert_eq!((thin.transmission, thin.opacity, thin.cutoff), (Vec3::ZERO, 0.25, None), "{illum}");
    }
    assert_eq!(of("illum 4\nd 0\nKd 0\n").opacity, 0.0);
}

#[test]
fn dissolve_goes_before_transparency() {
    for (text, opacity) in [
        ("Tr 0.25", 0.75),
        ("d 1\nTr 1", 1.0),
        ("Tr 1\nd 0.5", 0.5),
        ("Tr 1", 1.0),
        ("illum 4\nTr 1", 0.0),
        ("d -3", 0.0),
        ("d 7", 1.0),
        ("d -halo 0.5", 0.5),
    ] {
        assert_eq!(of(&format!("Kd 0.5\n{text}\n")).opacity, opacity, "{text}");
    }
}

#[test]
fn values_are_clamped_to_what_surfaces_do() {
    let wild = of("Kd 7 -1 0.5\nKs 2 0.5 -3\nKe 5 -1 0\nNs -100\nillum 3\nTf -1\nNi 1e30\n");
    assert_eq!(wild.diffuse, Vec3::new(1.0, 0.0, 0.5));
    assert_eq!(wild.specular, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(wild.emission, Vec3::new(5.0, 0.0, 0.0));
    assert_eq!(wild.roughness, 1.0);
    assert!(of("illum 7\nKd 0\nNi 1e-30\n").ior >= 1e-3);
}

#[test]
fn roughness_comes_from_the_exponent_or_is_given() {
    let roughness = |text: &str| of(&format!("Ks 0.5\n{text}\n")).roughness;
    assert_eq!(roughness("Ns 0"), 1.0);
    assert_eq!(roughness("Ns 1000"), (2.0_f32 / 1002.0).sqrt(), "highlights stay visible");
    assert_eq!(roughness("Ns 1000\nillum 3"), 0.0);
    assert_eq!(roughness("illum 3"), 0.0);
    assert_eq!(roughness("Ns 198\nillum 3"), 0.1);
    assert_eq!(roughness("Ns 198\nillum 3\nPr 0.5"), 0.25);
    assert_eq!(roughness("Ns 198\nmap_Pr a.png"), 1.0);
    assert!(!of("illum 3\nNs 7\n").reflects, "nothing is thrown back");
}

#[test]
fn metal_is_colored_in_its_reflection() {
    let metal = of("Kd 0.5 0.25 1\nPm 1\nPr 0.5\n");
    assert_eq!((metal.diffuse, metal.specular), (Vec3::ZERO, Vec3::new(0.5, 0.25, 1.0)));
    assert!(metal.reflects && metal.fresnel);
    let (painted, names) = made("map_Kd a.jpg\nPm 1\n");
    assert_eq!(painted.maps.specular, Some(Map::whole(0, Channel::Color)));
    assert_eq!(names, ["a.jpg"]);
    let plastic = of("Kd 0.5\nPm 0\nPr 0.5\n");
    assert_eq!((plastic.diffuse, plastic.specular), (Vec3::splat(0.5), Vec3::splat(0.04)));
    assert!(!plastic.reflects && of("Kd 0.5\nPm 0\nPr 0.1\n").reflects);
}

#[test]
fn cut_outs_are_known_by_their_pictures() {
    let mask = of("map_Kd leaf.jpg\nmap_d mask.jpg\nd 1\n");
    assert_eq!(mask.maps.opacity, Some(Map::whole(1, Channel::Grey)));
    assert_eq!((mask.cutoff, mask.opacity), (Some(0.5), 1.0));
    let same = of("map_Kd leaf.png\nmap_d leaf.png\n");
    assert_eq!(same.maps.opacity, Some(Map::whole(0, Channel::Alpha)));
    let named = of("map_d -imfchan g leaf.png\n");
    assert_eq!(named.maps.opacity, Some(Map::whole(0, Channel::Green)));
    let alpha = of("map_Kd -s 2 2 leaf.PNG\n");
    assert_eq!(alpha.maps.opacity, Some(Map { scale: [2.0; 2], ..Map::whole(0, Channel::Alpha) }));
    assert_eq!(alpha.cutoff, Some(0.5));
    for whole in ["map_Kd leaf.png\nd 1\n", "map_Kd leaf.png\nTr 0\n", "map_Kd leaf.jpg\n"] {
        let whole = of(whole);
        assert_eq!((whole.maps.opacity, whole.cutoff), (None, None));
    }
    // Water that is there in part, and what is half there as a whole.
    for share in ["illum 4\nKd 0.2 0.4 1\nTf 0.9 0.8 0.5\nmap_d a.png\n", "d 0.5\nmap_d a.png\n"] {
        let share = of(share);
        assert_eq!((share.cutoff, share.transmission), (None, Vec3::ZERO));
        assert!(share.maps.opacity.is_some());
    }
    assert_eq!(of("d 0\nmap_d a.png\n").opacity, 1.0, "else the picture would be for nothing");
}

#[test]
fn pictures_come_with_a_value_to_be_multiplied_with() {
    let (material, names) = made(
        "Kd 0\nmap_Kd a.jpg\nKe 0\nmap_Ke b.jpg\nmap_Ks c.jpg\nmap_Ka d.jpg\nnorm e.jpg\nbump -bm 2 f.jpg\n",
    );
    assert_eq!((material.diffuse, material.emission, material.specular), (Vec3::ONE, Vec3::ONE, Vec3::ONE));
    let Maps { diffuse, specular, emission, normal, bump, .. } = material.maps;
    let place = |name: &str| names.iter().position(|known| known == name).expect(name) as u32;
    for (map, name) in [(diffuse, "a.jpg"), (emission, "b.jpg"), (specular, "c.jpg")] {
        assert_eq!(map, Some(Map::whole(place(name), Channel::Color)));
    }
    assert_eq!(normal, Some(Map::whole(place("e.jpg"), Channel::Data)));
    let bump = bump.expect("heights");
    assert_eq!((bump.image, bump.channel, bump.strength), (place("f.jpg"), Channel::Grey, 0.02));
    assert_eq!(names.len(), 5, "what has no part is not looked for: {names:?}");
    assert_eq!(of("Kd 0.25\nmap_Kd a.jpg\n").diffuse, Vec3::splat(0.25));
    let normal = of("map_Bump -bm 1 Wall_Normal.jpg\n").maps;
    assert_eq!((normal.normal, normal.bump), (Some(Map::whole(0, Channel::Data)), None));
}
