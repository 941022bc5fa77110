//! All sums of films and all counts, as they were when this was written, path by path: whoever changes how paths are traced
//! sees here whether bits have changed.
//!
//! The bits depend on the code alone where the BVH traces: Rust neither fuses nor reorders sums of floats.
//! Only the functions of the system's mathematical library may round otherwise on another system; there these
//! hashes mean nothing, which [`library`] tells. Embree's kernels differ by processor.

use crate::common::{Render, SCENES, shipped};
use crate::mixed::mixed;
use gdpt::path::Counts;
use gdpt::render::Method;
use gdpt::scene::Scene;
use gdpt::shift::Death;
use gdpt::trace::Backend;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// Of the library's functions on the machine on which the others were made.
const LIBRARY: u64 = 0x3d4a_ce6c_a93f_55d1;
/// Path tracing and gradients of each of [`SCENES`].
const SHIPPED: [[u64; 2]; SCENES.len()] = [
    [0x8e69_d186_b223_86b6, 0x45d0_0d89_763e_7bbd],
    [0xcdc9_56d7_2ef5_20d5, 0xfd9a_1bee_74b8_19eb],
    [0x2b77_d26f_4ba3_44e9, 0x507d_2c86_76c0_2f86],
    [0x45ee_d01a_f737_621d, 0x06fe_38bc_1dfb_7572],
    [0x4e6f_8eb8_e333_979f, 0x4bc4_3edc_b282_22b4],
    [0x66e9_a747_0ae0_0e19, 0x46dc_7e1c_18de_fd84],
    [0x5a8d_5747_c728_0186, 0xfe85_0aba_35c2_fa34],
    [0x2d73_c5de_2a98_f937, 0xa16c_89b9_3071_7ed5],
];
/// Each of as many random scenes as [`GROUP`].
const MIXED: [u64; 10] = [
    0x7cb6_f12f_f2cf_df03,
    0x64e4_fde3_29bc_5996,
    0x397b_773b_a770_9918,
    0x5da1_c5fe_26e9_26f6,
    0xf6d5_bdc9_6b50_bb63,
    0xe466_9e0a_a4eb_eb14,
    0x9661_3d6c_5592_b37b,
    0x40c9_79bf_7e50_5461,
    0x55e7_9e33_bba8_c06f,
    0x38cf_51c6_c7b8_2230,
];
const GROUP: u64 = 30;

/// The functions that scenes and films are made with, at many places.
fn library() -> u64 {
    let mut hash = Xxh3::new();
    for n in 1..4000 {
        let x = n as f32 / 1000.0;
        for y in [
            x.sin(),
            x.cos(),
            x.tan(),
            x.powf(2.4),
            x.atan2(1.5),
            x.hypot(0.7),
        ] {
            hash.update(&y.to_bits().to_le_bytes());
        }
        let x = f64::from(x);
        for y in [(0.25 * x).acos(), x.cos(), x.ln(), x.exp()] {
            hash.update(&y.to_bits().to_le_bytes());
        }
    }
    hash.digest()
}

fn hash_into(hash: &mut Xxh3, scene: &Scene, render: &Render) -> Counts {
    let tracer = Backend::Bvh.build(&scene.mesh, 1).unwrap();
    let (film, counts) = render.film_and_counts(scene, &*tracer);
    let mut bytes = Vec::new();
    film.write_to(&mut bytes).unwrap();
    hash.update(&bytes);
    hash.update(&serde_json::to_vec(&counts).unwrap());
    counts
}

#[test]
fn sums_and_counts_are_what_they_were() {
    if library() != LIBRARY {
        eprintln!(
            "the library here has the hash {:#x}: nothing to compare with",
            library()
        );
        return;
    }
    let shipped = SCENES.map(|name| {
        [Method::Pt, Method::Gpt].map(|method| {
            let mut hash = Xxh3::new();
            let render = Render {
                method,
                spp: 3,
                seed: 5,
                ..Render::default()
            };
            hash_into(&mut hash, &shipped(name, 36, 24), &render);
            hash.digest()
        })
    });
    let mut total = Counts::default();
    let mut groups = [0; MIXED.len()];
    for (group, digest) in groups.iter_mut().enumerate() {
        let mut hash = Xxh3::new();
        for n in 0..GROUP {
            let (scene, render) = mixed(xxh3_64(&(group as u64 * GROUP + n).to_le_bytes()));
            total.add(&hash_into(&mut hash, &scene, &render));
        }
        *digest = hash.digest();
    }
    assert!(
        (shipped, groups) == (SHIPPED, MIXED),
        "bits have changed: shipped scenes {shipped:#x?}, random scenes {groups:#x?}"
    );
    // All that may happen to a path has happened; shifts that are not finite would be too rare.
    assert!(total.rays.iter().all(|&n| n > 0), "{:?}", total.rays);
    let others = Death::ALL.into_iter().filter(|&d| d != Death::NotFinite);
    for death in others {
        assert!(total.deaths[death as usize] > 0, "none died of {death:?}");
    }
}

/// The hashes above are those of the general loop; here it is asked itself, whatever library there is.
#[test]
fn mixed_scenes_have_the_bits_of_the_general_loop() {
    for n in 0..100u64 {
        let (mut scene, render) = mixed(n);
        let hash = |scene: &Scene| {
            let mut hash = Xxh3::new();
            let counts = hash_into(&mut hash, scene, &render);
            (hash.digest(), counts)
        };
        assert!(scene.in_lanes() && !scene.is_diffuse());
        let in_lanes = hash(&scene);
        scene.leave_lanes();
        assert_eq!(in_lanes, hash(&scene), "scene {n}");
    }
}
