//! Stream compaction: the marked columns, in column order.

use crate::record::NONE;

/// Lists the indices of the non-zero `marks` in ascending order in `list`, and their positions in
/// `rank` (one element per mark, [`NONE`] elsewhere). What does not fit `list` is left out: the
/// highest indices. Returns how many are listed and how many were marked.
pub fn compact(marks: &[u32], rank: &mut [u32], list: &mut [u32]) -> (usize, usize) {
    assert!(rank.len() == marks.len());
    let mut marked = 0;
    for (index, (&mark, rank)) in marks.iter().zip(rank).enumerate() {
        *rank = NONE;
        if mark != 0 {
            if let Some(place) = list.get_mut(marked) {
                *place = index as u32;
                *rank = marked as u32;
            }
            marked += 1;
        }
    }
    (marked.min(list.len()), marked)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_counted() {
        let marks = [1, 0, 1, 1, 0, 1];
        let (mut rank, mut list) = ([0; 6], [9; 3]);
        assert_eq!(compact(&marks, &mut rank, &mut list), (3, 4));
        assert_eq!(list, [0, 2, 3]);
        assert_eq!(rank, [0, NONE, 1, 2, NONE, NONE]);
        assert_eq!(compact(&[], &mut [], &mut list), (0, 0));
    }
}
