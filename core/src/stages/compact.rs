//! Stream compaction: the marked columns, in column order.

use crate::record::NONE;
use crate::stages::{FOREGROUND_COUNT, FOREGROUND_MARKED};

/// Lists the marked columns in `foreground`, in ascending order, and turns `foreground_index`, the
/// prefix sum of the marks, into their positions there ([`NONE`] elsewhere). Those that do not fit,
/// with the highest indices, are left out. `counters` receives how many are listed and how many
/// were marked.
pub fn compact(
    foreground_marks: &[u32],
    foreground_index: &mut [u32],
    foreground: &mut [u32],
    counters: &mut [u32],
) {
    assert!(foreground_index.len() == foreground_marks.len());
    let mut marked = 0;
    for (column, (&mark, index)) in foreground_marks.iter().zip(foreground_index).enumerate() {
        let place = core::mem::replace(index, NONE);
        marked = place + mark;
        if let (1, Some(entry)) = (mark, foreground.get_mut(place as usize)) {
            *entry = column as u32;
            *index = place;
        }
    }
    counters[FOREGROUND_MARKED] = marked;
    counters[FOREGROUND_COUNT] = marked.min(foreground.len() as u32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::COUNTERS;

    #[test]
    fn overflow_is_counted() {
        let (mut index, mut list, mut counters) = ([0, 1, 1, 2, 3, 3], [9; 3], [7; COUNTERS]);
        compact(&[1, 0, 1, 1, 0, 1], &mut index, &mut list, &mut counters);
        assert_eq!((list, index), ([0, 2, 3], [0, NONE, 1, 2, NONE, NONE]));
        assert_eq!([counters[FOREGROUND_COUNT], counters[FOREGROUND_MARKED]], [3, 4]);
        assert_eq!(counters.iter().filter(|c| **c == 7).count(), COUNTERS - 2);
    }
}
