//! All sums of films and all counts, as they were when this was written, path by path: whoever changes how paths are traced
//! sees here whether bits have changed.
//!
//! The bits depend on the code alone where the BVH traces: Rust neither fuses nor reorders sums of floats.
//! Only the functions of the system's mathematical library, and those of angles in lanes where a processor does not fuse
//! multiplication and addition, may round otherwise on another machine; there these hashes mean nothing, which
//! [`library`] tells. Embree's kernels differ by processor.

use super::mixed::mixed;
use crate::common::{Render, SCENES, shipped};
use gdpt::path::{Counts, Manifold};
use gdpt::render::Method;
use gdpt::scene::Scene;
use gdpt::shift::Death;
use gdpt::trace::{Backend, RayKind};
use wide::f32x8;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// Of these functions on the machine on which the others were made.
const LIBRARY: u64 = 0x96d7_6437_ceb7_b5d5;
/// Path tracing and gradients of each of [`SCENES`].
const SHIPPED: [[u64; 2]; SCENES.len()] = [
    [0x2197_5b50_f4bc_9cb4, 0x45de_5c54_dedb_b171],
    [0x8bdb_07f1_f67e_ac20, 0x945a_c349_2a85_02c3],
    [0xfb5a_ff51_b0c5_090e, 0x2e79_f887_3bf2_dca0],
    [0x7d14_6174_5429_51c2, 0xcf6b_240f_5f79_27a7],
    [0xf83f_41ad_22c4_f59f, 0x1ed8_9e9d_43c1_11bb],
    [0x636f_f754_7503_f8bf, 0x34bd_9fb1_34b0_a9dc],
    [0x1afb_c9e8_8a29_e973, 0xa003_75aa_2c38_ebc9],
    [0x7c66_69d5_daee_36ba, 0x1344_de79_16be_8cfd],
    [0x8985_4bb5_ffb7_d958, 0xda16_c2cb_4700_4712],
    [0x33fb_665f_5996_7de4, 0xd03e_4e92_55b0_0d7b],
];
/// Each of as many random scenes as [`GROUP`].
const MIXED: [u64; 10] = [
    0xf702_a6bf_8150_883e,
    0x6068_0124_e03f_f459,
    0x4e65_d326_50b3_59e4,
    0x6d46_b376_9191_0806,
    0xd20c_f790_2816_5376,
    0x3031_ad4a_49ba_c50d,
    0x9704_3b71_65d0_f056,
    0x738c_2756_1635_d2c6,
    0xec36_096e_8ec7_92b1,
    0xd29c_3314_c602_3418,
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
        let lanes = f32x8::splat(x);
        let (sin, cos) = lanes.sin_cos();
        for y in [
            sin,
            cos,
            lanes.atan2(f32x8::splat(1.5)),
            (lanes * 0.25).asin(),
        ] {
            hash.update(&y.as_array()[0].to_bits().to_le_bytes());
        }
        let x = f64::from(x);
        for y in [(0.25 * x).acos(), x.cos(), x.ln(), x.exp()] {
            hash.update(&y.to_bits().to_le_bytes());
        }
    }
    hash.digest()
}

/// Counts as they were written when there were no walks.
fn without_walks(counts: &Counts) -> Vec<u8> {
    assert_eq!(counts.rays[RayKind::Walk.index()], 0);
    assert_eq!(counts.deaths[Death::Walk as usize], 0);
    #[derive(serde::Serialize)]
    struct Before<'a> {
        rays: &'a [u64],
        deaths: &'a [u64],
        dropped: u64,
        first_dropped: [Option<(u32, u32, u64)>; 4],
    }
    serde_json::to_vec(&Before {
        rays: &counts.rays[..RayKind::Walk.index()],
        deaths: &counts.deaths[..Death::Walk as usize],
        dropped: counts.dropped,
        first_dropped: counts.first_dropped,
    })
    .unwrap()
}

fn hash_into(hash: &mut Xxh3, scene: &Scene, render: &Render) -> Counts {
    let tracer = Backend::Bvh.build(&scene.mesh, 1).unwrap();
    let (film, counts) = render.film_and_counts(scene, &*tracer);
    let mut bytes = Vec::new();
    film.write_to(&mut bytes).unwrap();
    hash.update(&bytes);
    hash.update(&without_walks(&counts));
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
                manifold: Manifold::Off,
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
    let before_walks = &total.rays[..RayKind::Walk.index()];
    assert!(before_walks.iter().all(|&n| n > 0), "{:?}", total.rays);
    let rare = [Death::NotFinite, Death::Walk];
    let others = Death::ALL.into_iter().filter(|d| !rare.contains(d));
    for death in others {
        assert!(total.deaths[death as usize] > 0, "none died of {death:?}");
    }
}
