//! Fewer points without losing spikes: every group of samples keeps the rows that hold an extreme.
//!
//! Only whole rows are kept and none is made up, so a read-out shows values that belong to one instant.

/// Curves with more points than this are thinned.
pub(super) const ROWS_MAX: usize = 4000;

/// Indices of the rows to keep, increasing; at most `rows_max` of them, but at least those of one group.
///
/// Extremes of different curves often share a row, so groups are made smaller as long as the rows allow it.
pub(super) fn rows(length: usize, curves: &[&[Option<f64>]], rows_max: usize) -> Vec<usize> {
    if length <= rows_max {
        return (0..length).collect();
    }
    let mut groups = (rows_max.saturating_sub(1) / (3 * curves.len() + 1)).max(1);
    let mut keep = rows_of_groups(length, curves, groups);
    while groups < length {
        groups += groups / 4 + 1;
        let more = rows_of_groups(length, curves, groups);
        if more.len() > rows_max {
            break;
        }
        keep = more;
    }
    keep
}

/// Of every group the first row, and for each curve its minimum, its maximum and its first gap; and the last row.
fn rows_of_groups(length: usize, curves: &[&[Option<f64>]], groups: usize) -> Vec<usize> {
    let mut keep = Vec::new();
    for group in 0..groups {
        let begin = group * length / groups;
        let end = (group + 1) * length / groups;
        if begin == end {
            continue;
        }
        keep.push(begin);
        for curve in curves {
            keep.extend(extremes(curve, begin, end));
        }
    }
    keep.push(length - 1);
    keep.sort_unstable();
    keep.dedup();
    keep
}

/// Indices of the minimum, the maximum and the first gap of one group; the first of equals.
fn extremes(curve: &[Option<f64>], begin: usize, end: usize) -> impl Iterator<Item = usize> {
    let mut low: Option<(usize, f64)> = None;
    let mut high: Option<(usize, f64)> = None;
    let mut gap = None;
    for (index, value) in curve.iter().enumerate().take(end).skip(begin) {
        let Some(value) = value.filter(|value| value.is_finite()) else {
            gap = gap.or(Some(index));
            continue;
        };
        if low.is_none_or(|(_, least)| value < least) {
            low = Some((index, value));
        }
        if high.is_none_or(|(_, most)| value > most) {
            high = Some((index, value));
        }
    }
    [low.map(|found| found.0), high.map(|found| found.0), gap].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_spikes_and_gaps() {
        let mut curve: Vec<Option<f64>> = (0..50_000).map(|i| Some(f64::from(i % 7))).collect();
        curve[31_234] = Some(99.0);
        curve[17] = Some(-99.0);
        curve[40_001] = None;
        let flat = vec![Some(1.0); 50_000];
        let kept = rows(50_000, &[&curve, &flat], ROWS_MAX);
        assert!(kept.len() <= ROWS_MAX && kept.len() > ROWS_MAX / 2, "{} rows", kept.len());
        assert!(kept.is_sorted());
        for row in [0, 17, 31_234, 40_001, 49_999] {
            assert!(kept.binary_search(&row).is_ok(), "row {row} is lost");
        }
    }
}
