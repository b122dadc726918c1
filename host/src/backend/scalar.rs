//! The twins of the kernels as a backend: one thread, the same buffers, the same bits.

use raywake_core::flow::Em;
use raywake_core::layout::{BUFFERS, Buffer, Heap};
use raywake_core::params::Profile;
use raywake_core::pipeline::{Perceived, Storage, perceive};
use raywake_core::record::{Ray, Step};

use super::Tables;
use crate::laps::Laps;

/// One vector per device buffer of the layout, allocated once.
pub struct Scalar {
    buffers: Vec<Vec<u32>>,
    tables: Tables,
}

/// Whether the scalar backend needs a buffer: the device's own and what it reads directly.
fn needed(index: usize) -> bool {
    let spare = [Buffer::Filter, Buffer::Weights, Buffer::Costs, Buffer::Counters, Buffer::Tiles];
    BUFFERS[index].heap == Heap::Device && spare.iter().all(|b| *b as usize != index)
}

impl Scalar {
    /// Allocates for a profile.
    pub fn new(profile: &Profile, tables: Tables) -> Scalar {
        let words =
            |index: usize| if needed(index) { BUFFERS[index].bytes(profile) / 4 } else { 0 };
        Scalar { buffers: (0..BUFFERS.len()).map(|n| vec![0; words(n)]).collect(), tables }
    }

    /// Bytes it allocates for a profile.
    pub fn bytes(profile: &Profile) -> usize {
        (0..BUFFERS.len()).filter(|n| needed(*n)).map(|n| BUFFERS[n].bytes(profile)).sum()
    }

    /// Where the next sweep goes.
    pub fn input(&mut self) -> (&mut [Ray], &mut [[i32; 4]]) {
        let [rays, origins] = self
            .buffers
            .get_disjoint_mut([Buffer::Rays as usize, Buffer::Origins as usize])
            .expect("distinct rows");
        (bytemuck::cast_slice_mut(rays), bytemuck::cast_slice_mut(origins))
    }

    /// From rays to flow.
    pub fn perceive(&mut self, step: &Step, rounds: u32, laps: &mut Laps) -> Perceived<'_> {
        use Buffer::*;
        let order = [
            Rays,
            Origins,
            Slots,
            Distinct,
            LogOdds,
            Now,
            Before,
            Marks,
            Rank,
            Foreground,
            Cost,
            Matching,
            State,
            TargetEnergy,
            TargetRank,
            Proposal,
            Least,
        ];
        let [
            rays,
            origins,
            slots,
            distinct,
            log_odds,
            now,
            before,
            marks,
            rank,
            foreground,
            cost,
            matching,
            state,
            target_energy,
            target_rank,
            proposal,
            least,
        ] = self.buffers.get_disjoint_mut(order.map(|b| b as usize)).expect("distinct rows");
        let storage = Storage {
            filter_table: &self.tables.filter,
            constancy_weights: &self.tables.constancy,
            constancy_costs: &self.tables.costs,
            slots: bytemuck::cast_slice_mut(slots),
            distinct,
            log_odds: bytemuck::cast_slice_mut(log_odds),
            now: bytemuck::cast_slice_mut(now),
            before: bytemuck::cast_slice_mut(before),
            marks,
            rank,
            foreground,
            cost: bytemuck::cast_slice_mut(cost),
            matching: bytemuck::cast_slice_mut(matching),
            em: Em {
                state,
                target_energy,
                target_rank,
                proposal: bytemuck::cast_slice_mut(proposal),
                least: bytemuck::cast_slice_mut(least),
            },
        };
        let rays: &[Ray] = bytemuck::cast_slice(rays);
        perceive(
            storage,
            step,
            rounds,
            &rays[..step.rays as usize],
            bytemuck::cast_slice(origins),
            &mut |name| laps.lap(name),
        )
    }
}
