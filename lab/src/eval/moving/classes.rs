//! The encoder's classes against those of SemanticKITTI.

use super::share;
use crate::labels::semantic_kitti::PointLabel;
use crate::report::{Cell, Table, TableRow};
use raywake_core::encoder::ColumnClass;
use std::collections::BTreeMap;

/// The encoder's classes, then none.
const COUNTS: usize = ColumnClass::ALL.len() + 1;

/// Returns of one class, by the encoder's class.
pub type EncodedCounts = [u64; COUNTS];

/// Where returns of a class are counted.
pub fn index(encoded: Option<ColumnClass>) -> usize {
    encoded.map_or(COUNTS - 1, |class| class as usize)
}

/// The classes given to returns, by their labels; `None` if no drive has labels or nothing was
/// encoded.
pub fn class_confusion<'a>(
    drives: impl Iterator<Item = &'a BTreeMap<u16, EncodedCounts>>,
) -> Option<Table> {
    let mut sums = BTreeMap::<u16, EncodedCounts>::new();
    for (&class, counts) in drives.flatten() {
        let sum = sums.entry(class).or_default();
        sum.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
    }
    let encoded = |counts: &EncodedCounts| counts[..COUNTS - 1].iter().sum::<u64>();
    sums.retain(|_, counts| encoded(counts) > 0);
    if sums.is_empty() {
        return None;
    }
    let row = |(&class, counts): (&u16, &EncodedCounts)| {
        let (name, of) = (PointLabel::of_class(class).describe(), encoded(counts));
        let shares = counts[..COUNTS - 1].iter().map(|n| Cell::Number(100.0 * share(*n, of), 1));
        TableRow::new([name.as_str().into(), Cell::Count(of)].into_iter().chain(shares))
    };
    let shares: Vec<_> = ColumnClass::ALL.map(|c| format!("{}, %", c.name())).into();
    let columns: Vec<_> =
        ["Class", "Returns"].into_iter().chain(shares.iter().map(String::as_str)).collect();
    let caption = "The encoder's class of the columns of returns, by SemanticKITTI's classes: \
                   returns in columns with a class.";
    let note = "The encoder classifies columns, by what stands in them: a return on the ground \
                below a tree, or beside a car in the same column, has the class of the tree or the \
                car.";
    let rows = sums.iter().map(row).collect();
    Some(Table::new("class-confusion", caption, &columns, rows).note(note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_returns_with_a_class() {
        let mut counts = EncodedCounts::default();
        let drive = |classes: &[(u16, EncodedCounts)]| classes.iter().copied().collect();
        counts[index(None)] = 5;
        assert!(class_confusion([drive(&[(10, counts)])].iter()).is_none());
        counts[index(Some(ColumnClass::Car))] = 3;
        let other = drive(&[(10, [1; COUNTS]), (40, [0; COUNTS])]);
        let table = class_confusion([drive(&[(10, counts)]), other].iter()).unwrap();
        assert_eq!((table.rows.len(), table.columns.len()), (1, COUNTS + 1));
        let text = format!("{:?}", table.rows[0]);
        // Of eleven returns with a class, four are cars.
        assert!(text.contains("Count(11)") && text.contains("Number(36.3"), "{text}");
    }
}
