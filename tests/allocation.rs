//! Nothing is allocated in the hot loop: once the buffers have grown, a tile is traced without. Films are merged in the
//! memory of one.

mod common;

use common::{shipped, tracer};
use gdpt::checkpoint::{self, About, Header, Progress};
use gdpt::film::{Counted, Film};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::merge::Plan;
use gdpt::part::{Part, Samples, Share};
use gdpt::path::{Manifold, PathSettings, PathTracer, Tile};
use gdpt::sampler::SamplerKind;
use gdpt::sums::TileSums;

fn allocations_of_a_tile<const N: usize>(name: &str) -> u64 {
    const SIDE: u32 = 24;
    let scene = shipped(name, SIDE, SIDE);
    let tracer = tracer(&scene);
    let settings = PathSettings {
        depth: 12,
        seed: 0,
        sampler: SamplerKind::Sobol,
        weights: Weights::Mis,
        filter: Filter::Box,
        manifold: Manifold::Auto,
    };
    let tile = Tile {
        x: 0,
        y: 0,
        width: SIDE,
        height: SIDE,
    };
    let mut film = Film::new(SIDE, SIDE, SIDE);
    let mut paths = PathTracer::<N>::default();
    let mut sums = TileSums::default();
    let mut render = || {
        sums.reset((SIDE * SIDE) as usize);
        paths.render(&scene, &*tracer, &settings, tile, 0..4, &mut sums);
        film.tiles[0].add(&sums);
        film.end_pass(
            [Counted {
                samples: 2,
                weight: 2.0,
                square: 2.0,
            }; 2],
        );
    };
    // The first time the buffers grow.
    render();
    allocation_counter::measure(render).count_total
}

#[test]
fn tiles_are_traced_without_allocating() {
    for name in ["cornell", "glossy", "mirrors"] {
        assert_eq!(allocations_of_a_tile::<0>(name), 0, "{name}, path tracing");
        assert_eq!(allocations_of_a_tile::<4>(name), 0, "{name}, gradients");
    }
}

/// Many parts are merged in the memory of 1.2 films, whatever they hold.
#[test]
fn many_films_are_merged_in_the_memory_of_one() {
    const SIDE: u32 = 96;
    const PARTS: u32 = 400;
    let folder = tempfile::tempdir().unwrap();
    let film = {
        let scene = shipped("cornell", SIDE, SIDE);
        let tracer = tracer(&scene);
        common::Render {
            spp: 4,
            ..Default::default()
        }
        .film(&scene, &*tracer)
    };
    // Headers as long as those of renders.
    let setting = |n: u32| (format!("setting {n}"), "as it is by default".to_owned());
    let paths: Vec<_> = (1..=PARTS)
        .map(|n| folder.path().join(format!("{n}.gdpt")))
        .collect();
    for (path, number) in paths.iter().zip(1..) {
        let part = Part {
            number,
            parts: PARTS,
        };
        let samples = Samples::Some {
            part,
            all: 4 * u64::from(PARTS),
        };
        let names = samples.identity().into_iter();
        let names = names.map(|(name, value)| (name.to_owned(), value));
        let header = Header {
            identity: (0..15).map(setting).chain(names).collect(),
            share: Share {
                window: film.window,
                samples,
            },
            progress: Progress {
                finished: true,
                ..Progress::default()
            },
            about: About::default(),
        };
        checkpoint::save(path, &header, &film).unwrap();
    }
    let merge = || {
        let merged = Plan::new(&paths, false).unwrap().sum(&mut |_| ()).unwrap();
        assert_eq!(merged.samples, [2 * u64::from(PARTS); 2]);
    };
    let most = allocation_counter::measure(merge).bytes_max;
    let of_film = film.window.pixels() * gdpt::film::BYTES_PER_PIXEL;
    assert!(
        most as f64 <= 1.2 * of_film as f64,
        "{most} bytes, a film has {of_film}"
    );
}
