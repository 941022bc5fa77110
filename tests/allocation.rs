//! Nothing is allocated in the hot loop: once the buffers have grown, a tile is traced without.

mod common;

use common::{shipped, tracer};
use gdpt::film::{Counted, Film};
use gdpt::filter::Filter;
use gdpt::gradient::Weights;
use gdpt::path::{Manifold, PathSettings, PathTracer, Tile};
use gdpt::sampler::Points;
use gdpt::sums::TileSums;

fn allocations_of_a_tile<const N: usize>(name: &str) -> u64 {
    const SIDE: u32 = 24;
    let scene = shipped(name, SIDE, SIDE);
    let tracer = tracer(&scene);
    let settings = PathSettings {
        depth: 12,
        seed: 0,
        points: Points::Sobol,
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
