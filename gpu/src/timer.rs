//! Where a program's time goes: a timestamp before its first step and one after each step.

use crate::GpuError;
use crate::owner::Gpu;
use ash::vk;

/// The timestamps of one program; none if the queue does not support them.
pub(crate) struct Timer {
    pub pool: Option<vk::QueryPool>,
    names: Vec<&'static str>,
    /// Ticks and availability of the last run that finished.
    ticks: Vec<[u64; 2]>,
    /// Room to inspect a run that did not finish.
    probe: Vec<[u64; 2]>,
}

impl Timer {
    pub fn new(gpu: &mut Gpu, names: Vec<&'static str>) -> Result<Self, GpuError> {
        let queries = names.len() + 1;
        let pool = match gpu.info().limits.timestamp_bits {
            0 => None,
            _ => Some(gpu.query_pool(queries as u32)?),
        };
        Ok(Self { pool, names, ticks: vec![[0; 2]; queries], probe: vec![[0; 2]; queries] })
    }

    /// Fetches the timestamps of a run that has finished.
    pub fn read(&mut self, gpu: &Gpu) {
        if let Some(pool) = self.pool {
            gpu.timestamps(pool, &mut self.ticks);
        }
    }

    /// Name and milliseconds of each step.
    pub fn times(&self, gpu: &Gpu) -> impl Iterator<Item = (&'static str, f64)> {
        let limits = gpu.info().limits;
        let spans = self.ticks.windows(2).zip(&self.names);
        spans.filter_map(move |(ticks, &name)| {
            let [[start, begun], [end, ended]] = [ticks[0], ticks[1]];
            let ticks = elapsed(start, end, limits.timestamp_bits);
            let ms = ticks as f64 * f64::from(limits.timestamp_ns) * 1e-6;
            (begun != 0 && ended != 0).then_some((name, ms))
        })
    }

    /// The last step known to have finished in a run that is still in progress or was lost.
    pub fn last_finished(&mut self, gpu: &Gpu) -> Option<(usize, &'static str)> {
        gpu.timestamps(self.pool?, &mut self.probe);
        // A timestamp equal to the previous run's was not written in this one: the reset at the
        // start of the command buffer may not have been reached.
        let news = self.probe.iter().zip(&self.ticks).skip(1);
        let fresh = |(now, before): (&[u64; 2], &[u64; 2])| now[1] != 0 && now != before;
        let last = news.take_while(|&pair| fresh(pair)).count().checked_sub(1)?;
        Some((last, self.names[last]))
    }
}

/// Ticks from `start` to `end` on a counter of `bits` bits, which may have wrapped once.
fn elapsed(start: u64, end: u64, bits: u32) -> u64 {
    let mask = u64::MAX.checked_shr(64 - bits.min(64)).unwrap_or(0);
    end.wrapping_sub(start) & mask
}

#[cfg(test)]
mod tests {
    use super::elapsed;

    #[test]
    fn counters_wrap_at_their_width() {
        assert_eq!(elapsed(10, 25, 64), 15);
        assert_eq!(elapsed(u64::MAX - 4, 5, 64), 10);
        assert_eq!(elapsed((1 << 36) - 4, 5, 36), 9);
        assert_eq!(elapsed(1, 2, 0), 0);
    }
}
