//! What a render has to show, layer by layer.

use crate::app::{HALF_A, coverage_channel};
use crate::develop::Plate;
use crate::film::{Film, FirstHits, Halves};
use crate::output::exr::Layers;
use crate::picture::Picture;
use crate::render::Method;

/// All layers of a render by `method`.
pub(in crate::app) fn layers(
    method: Method,
    plate: &Plate,
    picture: &Picture,
    hits: &FirstHits,
    film: &Film,
) -> Layers {
    let mut layers = Layers::default();
    layers.picture(&plate.linear());
    layers.channel(coverage_channel(plate.background), plate.coverage.to_vec());
    if let Some(error) = &picture.error {
        layers.colour("error", error);
    }
    // Both halves together, and half A: half B is the rest.
    for (prefix, halves) in [("", Halves::Both), (HALF_A, Halves::A)] {
        let e = film.estimate(halves);
        let mut colour = |name: &str, image| layers.colour(&format!("{prefix}{name}"), image);
        colour("primal", &e.primal);
        colour("primal_variance", &e.primal_variance);
        if method == Method::Gpt {
            colour("dx", &e.dx);
            colour("dy", &e.dy);
            colour("dx_variance", &e.dx_variance);
            colour("dy_variance", &e.dy_variance);
        }
        colour("direct", &film.direct(halves));
    }
    layers.colour("albedo", &hits.albedo);
    layers.vector("normal", &hits.normal);
    layers.channel("depth.Z", hits.depth.clone());
    layers.channel("samples.dropped", hits.dropped.clone());
    let total = (film.samples[0] + film.samples[1]) as f32;
    layers.channel(
        "samples.count",
        hits.dropped.iter().map(|d| total - d).collect(),
    );
    layers
}
