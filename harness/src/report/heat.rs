//! Heat maps: colour steps of a residual over its noise, and the worst cell.

use super::page::Heat;

/// Upper edges of the colour steps, in times the noise. Up to 1 the residual is noise; the rest are round numbers, about
/// evenly spaced on a logarithmic scale. Chosen, not measured.
pub(super) const STEP_EDGES: [f64; 5] = [1.0, 2.0, 3.0, 5.0, 10.0];

/// The colour step of a cell: 0 within the noise, 5 above the last edge.
pub(super) fn step(value: f64) -> usize {
    STEP_EDGES.iter().take_while(|edge| value.abs() > **edge).count()
}

/// Names of the colour steps.
pub(super) fn step_names() -> Vec<String> {
    let first = format!("up to {} (noise)", STEP_EDGES[0]);
    let between = STEP_EDGES.windows(2).map(|pair| format!("to {}", pair[1]));
    let last = format!("above {}", STEP_EDGES[STEP_EDGES.len() - 1]);
    std::iter::once(first).chain(between).chain(std::iter::once(last)).collect()
}

/// The text of a cell: two significant digits are all that such a ratio bears, one decimal below ten.
pub(super) fn cell(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if !value.is_finite() => "not finite".to_owned(),
        Some(value) if value.abs() < 99.95 => super::axis::fixed(value, 1),
        Some(value) => super::axis::fixed(value, 0),
    }
}

/// Row and column of the greatest cell, if it is above the noise; the first of equals.
pub(super) fn worst(heat: &Heat) -> Option<(usize, usize)> {
    let mut worst = None;
    let mut most = STEP_EDGES[0];
    for (row_index, row) in heat.rows.iter().enumerate() {
        for (column_index, cell) in row.cells.iter().enumerate() {
            if let Some(size) = cell.map(f64::abs).filter(|size| *size > most) {
                most = size;
                worst = Some((row_index, column_index));
            }
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_cover_all_values() {
        for (value, expected) in [(0.0, 0), (1.0, 0), (1.1, 1), (-4.0, 3), (10.0, 4), (1e9, 5)] {
            assert_eq!(step(value), expected, "{value}");
        }
        assert_eq!(step_names(), ["up to 1 (noise)", "to 2", "to 3", "to 5", "to 10", "above 10"]);
    }
}
