//! Plain paths that are aimed at lights.

use super::super::aim::AimedX8;
use super::super::arrival::{Arrival, Left};
use super::super::chain::{self, Chains};
use super::super::{Context, light, trace_closest};
use super::{PlainBlock, PlainFlight, PlainPaths};
use crate::lanes::{LANES, lanes_of};
use crate::trace::RayKind;

/// Paths of a block on their way to lights.
pub(super) struct Aim {
    block: u32,
    aimed: AimedX8,
    ray: [u32; LANES],
}

impl PlainBlock {
    /// The lanes in which paths are aimed at lights.
    pub(super) fn aims(&self, chains: &Chains) -> u32 {
        chains.beyond(&self.chain, self.alive & self.vertices.spreading())
    }
}

impl PlainPaths {
    /// Aims paths at lights from the vertices x_k that are of class specular and spread light a little, and gathers what
    /// comes from there.
    pub(super) fn aim(&mut self, context: Context, k: u32) {
        self.bounce.clear();
        self.aims.clear();
        for (at, block) in (0..).zip(self.blocks.iter()) {
            let x = &block.vertices;
            let carries_light = block.throughput.is_not_zero().to_bitmask();
            let lanes = block.aims(&self.chains) & carries_light;
            if lanes == 0 {
                continue;
            }
            light::draw([&block.samplers], k, &mut self.numbers);
            let [u0, u1, u2, _] = self.numbers[0];
            let aimed = AimedX8::new(context, (x, k), lanes, [u0, u1, u2]);
            let rays = x.rays(aimed.scattering.wi);
            let mut ray = [0; LANES];
            for lane in lanes_of(aimed.scattering.valid) {
                ray[lane] = self.bounce.push(&rays.lane(lane));
            }
            self.aims.push(Aim {
                block: at,
                aimed,
                ray,
            });
        }
        trace_closest(context, &mut self.bounce, RayKind::Bounce, &mut self.counts);
        for Aim { block, aimed, ray } in &self.aims {
            let block = &self.blocks[*block as usize];
            let (x, scattering) = (&block.vertices, &aimed.scattering);
            let hits = self.bounce.hits_of(ray, scattering.valid, scattering.wi);
            let lanes = aimed.seen(context, &hits, scattering.valid);
            if lanes == 0 {
                continue;
            }
            let flight = PlainFlight {
                from: x.position,
                throughput: scattering.carry(block.throughput),
                pdf: scattering.pdf,
                lit: lanes,
                samplers: block.samplers,
                index: block.index,
                chain: [chain::NONE; LANES],
            };
            let left = Left {
                from: flight.from,
                pdf: flight.pdf,
                lit: flight.lit,
            };
            let arrival = Arrival::new(context, k, &hits, lanes, left);
            flight.reach_light(&arrival, arrival.ends & lanes, &mut self.gathered);
        }
    }
}
