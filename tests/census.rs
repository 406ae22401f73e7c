//! Errors of every mode against exact answers, on small scenes of different geometry, seen from inside.

#[path = "../benches/scenes/mod.rs"]
mod scenes;

use raypack::kdtree::BuildParams;
use raypack::scene::Camera;
use raypack::simd::Isa;
use raypack::study::accuracy::{Census, Errors, Options, census};
use raypack::study::rays::RayKind;

/// Rays of each kind, at least.
const RAYS: usize = 1 << 16;

/// Takes the census of one of the generated scenes, from an eye in the midst of it.
fn census_inside(name: &str) -> Census {
    let scene = scenes::generated().into_iter().find(|s| s.name == name).expect("a scene of that name");
    let bounds = scene.mesh.bounds();
    let eye = bounds.center() + bounds.extent() * glam::Vec3::new(0.21, -0.13, 0.17);
    let options = Options {
        camera: Some(Camera { fov: 75.0, ..Camera::new(eye, bounds.center()) }),
        kinds: RayKind::ALL.into(),
        rays: RAYS,
        seed: 1,
        isa: Isa::detect(),
        build: BuildParams::default(),
    };
    census(&scene.mesh, &options, &mut |_| {}).expect("the mesh is sound")
}

/// Checks an engine's errors kind by kind.
fn for_each_kind(census: &Census, engine: &str, mode: &str, check: impl Fn(&Errors, &str)) {
    let rows: Vec<_> = census.rows.iter().filter(|row| row.engine == engine && row.mode == mode).collect();
    assert_eq!(rows.len(), RayKind::ALL.len(), "{engine} {mode}");
    for row in rows {
        check(&row.errors, &format!("{row:?}"));
    }
}

/// What must hold in every scene.
fn sound(census: &Census) {
    for_each_kind(census, "raypack", "exact", |errors, row| {
        assert_eq!((errors.total(), errors.not_lowest), (0, 0), "{row}");
        if let Some(deviation) = &errors.deviation {
            assert!(deviation.max_ulps <= 1 && deviation.max_weight < 1e-7, "{row}");
        }
    });
    for mode in ["watertight", "fast"] {
        for_each_kind(census, "raypack", mode, |errors, row| {
            // Only rays that pass an edge within a rounding are decided wrongly.
            assert!(errors.per_million(errors.total()) < 100.0, "{row}");
            // Some ulps of the distance of a corner are a few more of a hit's that is nearer.
            if let Some(deviation) = &errors.deviation {
                assert!(deviation.p999_ulps < 64 && deviation.mean_ulps < 4.0, "{row}");
            }
        });
    }
    for row in &census.rows {
        let wanted = if row.rays == RayKind::Shadow { RAYS / 2 } else { RAYS };
        assert!(row.errors.count >= wanted as u64, "too few rays: {row:?}");
    }
}

/// Embree's modes are judged too, if it is here.
fn embree_is_judged(census: &Census) {
    if census.notes.is_empty() {
        for mode in ["fast", "robust"] {
            for_each_kind(census, "embree", mode, |errors, row| {
                assert!(errors.per_million(errors.total()) < 1000.0, "{row}");
                if let Some(deviation) = &errors.deviation {
                    assert!(deviation.mean_ulps < 4.0, "{row}");
                }
            });
        }
    } else {
        assert!(std::env::var_os("RAYPACK_REQUIRE_EMBREE").is_none_or(|v| v != "1"), "{:?}", census.notes);
        eprintln!("Embree is not judged: {}", census.notes[0]);
    }
}

#[test]
fn plant() {
    let census = census_inside("plant");
    sound(&census);
    embree_is_judged(&census);
}

#[test]
fn voxels() {
    let census = census_inside("voxels");
    sound(&census);
    embree_is_judged(&census);
}

#[test]
fn soup() {
    let census = census_inside("soup");
    sound(&census);
    embree_is_judged(&census);
}

#[test]
fn from_inside_a_closed_surface_every_ray_hits() {
    let census = census_inside("sphere");
    sound(&census);
    for mode in ["watertight", "exact"] {
        for_each_kind(&census, "raypack", mode, |errors, row| {
            assert_eq!((errors.missed, errors.false_hits, errors.elsewhere), (0, 0, 0), "{row}");
        });
    }
    for row in census.rows.iter().filter(|row| matches!(row.rays, RayKind::Camera | RayKind::Diffuse)) {
        assert_eq!(row.errors.hits, row.errors.count, "{row:?}");
    }
}
