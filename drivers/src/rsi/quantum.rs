//! How finely the controller prints what it measures.
//!
//! The ETHERNET object has a parameter Precision, and its default is one decimal: the feedback then moves in steps of 0.1 mm and
//! 0.1 degrees, which is the noise floor of everything that is made of it. Printed decimals show in the first frame. Zeros at the
//! end of every value show only when the values move: a controller that rounds before it prints.

use super::number::decimals;
use super::telegram::Element;

/// Changes of a value after which the digits that never showed are said.
const CHANGES: u32 = 64;

/// Decimals of one element.
#[derive(Debug, Clone, Default)]
pub(super) struct Quantum {
    printed: Option<usize>,
    significant: usize,
    changes: u32,
    last: String,
    said: bool,
}

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// So many decimals are printed, from now on.
    Printed(usize),
    /// Fewer than the printed ones ever differ from zero.
    Significant { printed: usize, significant: usize },
}

impl Quantum {
    /// Decimals that are printed.
    pub fn printed(&self) -> Option<usize> {
        self.printed
    }

    /// Takes the element of a frame.
    pub fn take(&mut self, element: &Element) -> Option<Found> {
        let values = || element.attributes.iter().map(|(_, value)| value.trim_ascii());
        let printed = values().map(decimals).max()?;
        if self.printed != Some(printed) {
            *self = Quantum { printed: Some(printed), ..Quantum::default() };
            self.look(values());
            return Some(Found::Printed(printed));
        }
        if self.said || !self.look(values()) || self.changes < CHANGES {
            return None;
        }
        self.said = true;
        let significant = self.significant;
        (significant < printed).then_some(Found::Significant { printed, significant })
    }

    /// Counts digits; whether the first value moved.
    fn look<'a>(&mut self, values: impl Iterator<Item = &'a str>) -> bool {
        let mut moved = false;
        for (i, value) in values.enumerate() {
            if i == 0 && self.last != value {
                // A value is at most as long as a document; what is kept is not.
                self.last = value.chars().take(64).collect();
                self.changes += u32::from(self.changes < CHANGES);
                moved = true;
            }
            let digits = if value.contains('.') { value.trim_end_matches('0') } else { value };
            self.significant = self.significant.max(decimals(digits));
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn element(x: &str, y: &str) -> Element {
        Element::attributes("RIst", [("X", x.to_owned()), ("Y", y.to_owned())])
    }

    #[test]
    fn printed_decimals_show_at_once_and_when_they_change() {
        let mut quantum = Quantum::default();
        assert_eq!(quantum.take(&element("93.9", "-347.9")), Some(Found::Printed(1)));
        assert_eq!(quantum.take(&element("94.0", "-347.9")), None);
        assert_eq!(quantum.take(&element("94.0000", "-347.9000")), Some(Found::Printed(4)));
        assert_eq!(quantum.printed(), Some(4));
        assert_eq!(quantum.take(&Element::text("RIst", "")), None);
    }

    #[test]
    fn zeros_that_never_move_are_no_digits() {
        let mut quantum = Quantum::default();
        let found: Vec<Found> =
            (0..200).filter_map(|i| quantum.take(&element(&format!("{i}.5000"), "0.2500"))).collect();
        assert_eq!(found, [Found::Printed(4), Found::Significant { printed: 4, significant: 2 }]);
    }

    #[test]
    fn a_robot_that_stands_says_nothing_about_digits() {
        let mut quantum = Quantum::default();
        let found: Vec<Found> = (0..200).filter_map(|_| quantum.take(&element("1.0000", "0.0000"))).collect();
        assert_eq!(found, [Found::Printed(4)]);
    }
}
