//! Columns as bit masks: all that the flow needs from the grid.

use crate::params::LOG_ODDS_SOLID;
use crate::record::{Column, SweepUniform};

/// Turns log-odds into masks: free if negative, occupied if positive (3.4, 3.5 with epsilon = 0),
/// solid from [`LOG_ODDS_SOLID`] on. `log_odds` must hold `levels` elements per column.
#[inline(always)]
pub fn columns(sweep: &SweepUniform, log_odds: &[i32], columns_now: &mut [Column]) {
    let levels = sweep.levels as usize;
    assert!(log_odds.len() >= columns_now.len() * levels);
    for (column, voxels) in columns_now.iter_mut().zip(log_odds.chunks_exact(levels)) {
        let (mut free, mut occupied, mut solid) = (0u32, 0u32, 0u32);
        for (k, &l) in voxels.iter().enumerate() {
            free |= ((l < 0) as u32) << k;
            occupied |= ((l > 0) as u32) << k;
            solid |= ((l >= LOG_ODDS_SOLID) as u32) << k;
        }
        *column = [free | occupied << 16, solid];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks() {
        let sweep = SweepUniform { side: 3, levels: 4, ..Default::default() };
        let mut log_odds = [0; 36];
        log_odds[8 * 4..].copy_from_slice(&[-1, 4, 5, 0]);
        let mut now = [[0; 2]; 9];
        columns(&sweep, &log_odds, &mut now);
        assert_eq!(now[8], [0b0001 | 0b0110 << 16, 0b0100]);
    }
}
