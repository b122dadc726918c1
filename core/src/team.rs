//! Work that may be split over threads. Whose these are is not for core to know.

/// Does two things, perhaps at the same time.
pub trait Team: Sync {
    /// Returns when both are done.
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send);
}

/// One thread.
pub struct Alone;

impl Team for Alone {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        a();
        b();
    }
}

/// Fills slots with the values of their indices, which begin at `first`. Halves of halves, so that
/// whoever is done early takes over from the others.
pub(crate) fn fill<T: Send>(
    team: &impl Team,
    first: usize,
    slots: &mut [T],
    value: &(impl Fn(usize) -> T + Sync),
) {
    match slots {
        [] => {}
        [slot] => *slot = value(first),
        _ => {
            let half = slots.len() / 2;
            let (a, b) = slots.split_at_mut(half);
            team.join(|| fill(team, first, a, value), || fill(team, first + half, b, value));
        }
    }
}
