//! Where a cluster may have gone if nothing else shows it: tries every displacement within reach,
//! by whole voxels.

use super::cluster::Cluster;

/// The displacement that puts most of the cluster's returns on returns of the second sweep; places
/// that were occupied before count half. Among equally good ones, the first.
pub fn search(cluster: &Cluster) -> [f32; 2] {
    let scans = &cluster.scans;
    let target = &scans.targets[0];
    let reach = scans.scaled.search_reach(scans.span_s);
    let mut best = (0, [0.0; 2]);
    for du in -reach..=reach {
        for dv in -reach..=reach {
            let by = [du as f32, dv as f32];
            let mut score = 0;
            for s in &cluster.samples {
                let at = [s.at[0] + by[0], s.at[1] + by[1], s.at[2]];
                let there = core::array::from_fn(|a| at[a] + target.offset[a]);
                if scans.second().is_hit(there) {
                    score += 2 - scans.first.is_hit(at) as u32;
                }
            }
            if score > best.0 {
                best = (score, by);
            }
        }
    }
    best.1
}
