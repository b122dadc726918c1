//! Handover between threads: a queue of one. The producer never waits: a new value replaces one
//! that has not been fetched. Values are swapped, so nothing is allocated.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A queue of one value.
pub struct Handover<T> {
    slot: Mutex<HandoverSlot<T>>,
    changed: Condvar,
}

struct HandoverSlot<T> {
    value: T,
    full: bool,
    closed: bool,
    replaced: u64,
}

/// The outcome of waiting for a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fetched {
    /// A value was fetched.
    Value,
    /// No value came in time.
    Nothing,
    /// No more values will come.
    Closed,
}

impl<T> Handover<T> {
    /// An empty queue, with a spare value to exchange for the first one put in.
    pub fn new(spare: T) -> Handover<T> {
        let slot = HandoverSlot { value: spare, full: false, closed: false, replaced: 0 };
        Handover { slot: Mutex::new(slot), changed: Condvar::new() }
    }

    fn slot(&self) -> MutexGuard<'_, HandoverSlot<T>> {
        // Values are swapped whole, so a poisoned lock does no harm.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts in a value, in exchange for a spare of arbitrary content.
    pub fn put(&self, value: &mut T) {
        let mut slot = self.slot();
        std::mem::swap(&mut slot.value, value);
        slot.replaced += u64::from(slot.full);
        slot.full = true;
        drop(slot);
        self.changed.notify_one();
    }

    /// Fetches the value, in exchange for a spare.
    pub fn fetch(&self, value: &mut T, within: Duration) -> Fetched {
        let waits = |slot: &mut HandoverSlot<T>| !slot.full && !slot.closed;
        let waited = self.changed.wait_timeout_while(self.slot(), within, waits);
        let (mut slot, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if slot.full {
            std::mem::swap(&mut slot.value, value);
            slot.full = false;
            return Fetched::Value;
        }
        if slot.closed { Fetched::Closed } else { Fetched::Nothing }
    }

    /// Number of values replaced before they were fetched.
    pub fn replaced(&self) -> u64 {
        self.slot().replaced
    }

    /// Closes the queue: no more values will come.
    pub fn close(&self) {
        self.slot().closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_millis(1);

    #[test]
    fn the_newest_value_is_fetched() {
        let queue = Handover::new(0);
        let mut mine = 9;
        assert_eq!((queue.fetch(&mut mine, SOON), mine), (Fetched::Nothing, 9));
        for n in 1..=3 {
            queue.put(&mut n.clone());
        }
        assert_eq!((queue.fetch(&mut mine, SOON), mine), (Fetched::Value, 3));
        assert_eq!((queue.fetch(&mut mine, SOON), queue.replaced()), (Fetched::Nothing, 2));
        queue.put(&mut 4);
        queue.close();
        // A value still in the queue is fetched.
        assert_eq!((queue.fetch(&mut mine, SOON), mine), (Fetched::Value, 4));
        assert_eq!(queue.fetch(&mut mine, SOON), Fetched::Closed);
    }

    #[test]
    fn waiting_threads_are_woken() {
        let queue = Handover::new(0);
        std::thread::scope(|scope| {
            let waits = || queue.fetch(&mut 0, Duration::from_secs(60));
            let (first, second) = (scope.spawn(waits), scope.spawn(waits));
            queue.put(&mut 1);
            queue.close();
            let mut both = [first.join().unwrap(), second.join().unwrap()];
            both.sort_by_key(|fetched| *fetched as u8);
            assert_eq!(both, [Fetched::Value, Fetched::Closed]);
        });
    }
}
