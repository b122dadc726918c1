//! Levels of the pyramid as rows of cells.

use crate::team::Team;

/// A square level, all channels of a cell together.
pub struct Plane<'a, const CHANNELS: usize> {
    /// Cells along an axis.
    pub side: usize,
    pub cells: &'a [u8],
}

impl<const CHANNELS: usize> Plane<'_, CHANNELS> {
    #[inline]
    pub fn at(&self, row: usize, at: usize) -> &[u8; CHANNELS] {
        let first = (row * self.side + at) * CHANNELS;
        self.cells[first..][..CHANNELS].as_array().expect("as many as are asked for")
    }
}

/// The 2 x 2 cells below one of the next level, one after another.
#[inline]
pub fn gathered<const CHANNELS: usize, const ALL: usize>(
    below: &Plane<CHANNELS>,
    row: usize,
    at: usize,
) -> [i16; ALL] {
    let mut all = [0; ALL];
    for (n, x) in all.as_chunks_mut::<CHANNELS>().0.iter_mut().enumerate() {
        *x = below.at(2 * row + n / 2, 2 * at + n % 2).map(i16::from);
    }
    all
}

/// Fills rows of `length`, perhaps several at a time.
pub fn each_row<T: Send>(
    team: &impl Team,
    out: &mut [T],
    length: usize,
    fill: &(impl Fn(usize, &mut [T]) + Sync),
) {
    from(team, 0, out, length, fill);
}

fn from<T: Send>(
    team: &impl Team,
    first: usize,
    out: &mut [T],
    length: usize,
    fill: &(impl Fn(usize, &mut [T]) + Sync),
) {
    let rows = out.len() / length;
    if rows <= 1 {
        return fill(first, out);
    }
    let (a, b) = out.split_at_mut(rows / 2 * length);
    team.join(
        || from(team, first, a, length, fill),
        || from(team, first + rows / 2, b, length, fill),
    );
}
