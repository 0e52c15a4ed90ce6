//! A domain of two parameters: where in it the loop is stable.

use super::subject::Subject;
use super::{growth_per_s, is_stable};
use crate::error::Error;
use rayon::prelude::*;

/// Strips of the drawing, and how many heights are looked at in each before the edges are narrowed down.
const STRIPS: usize = 120;
const HEIGHTS: usize = 48;
/// Halvings of the interval that holds an edge: a thousandth of a height, which is less than a line's width.
const HALVINGS: usize = 10;
/// Points of a sweep along each side.
const SWEEP: usize = 41;

/// One side of the domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Name of the parameter.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// The operating value.
    pub here: f64,
}

impl Side {
    fn at(&self, share: f64) -> f64 {
        self.low + (self.high - self.low) * share
    }
}

/// A domain, and the stable part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    /// From left to right.
    pub x: Side,
    /// From bottom to top.
    pub y: Side,
    /// The stable intervals of y in each strip of x.
    pub strips: Vec<Vec<(f64, f64)>>,
    /// The intervals of y in each strip of x where it cannot be told.
    pub untold: Vec<Vec<(f64, f64)>>,
}

/// Reads `X[=LOW..HIGH],Y[=LOW..HIGH]`. Without a range a side reaches from 0 to twice the operating value.
pub fn sides(text: &str, subject: &Subject) -> Result<(Side, Side), Error> {
    let wrong = |what: String| {
        Error::new(what)
            .place(format!("--chart {text}"))
            .help("name two parameters, each with a range if you like: --chart X=LOW..HIGH,Y=LOW..HIGH")
    };
    let (x, y) = text.split_once(',').ok_or_else(|| wrong("is one parameter, expected two".into()))?;
    let (x, y) = (side(x, subject, &wrong)?, side(y, subject, &wrong)?);
    if x.name == y.name {
        return Err(wrong(format!("{} stands on both sides", x.name)));
    }
    Ok((x, y))
}

fn side(text: &str, subject: &Subject, wrong: &dyn Fn(String) -> Error) -> Result<Side, Error> {
    let (name, range) = text.split_once('=').map_or((text, None), |(name, range)| (name, Some(range)));
    let known = subject.parameters();
    let Some((name, unit)) = known.iter().find(|(known, _)| known == name.trim()).cloned() else {
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        return Err(wrong(format!("unknown parameter {name}; it is one of {}", names.join(", "))));
    };
    let here = subject.get(&name).unwrap_or(0.0);
    let (low, high) = match range {
        Some(range) => {
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            let ends = range.split_once("..").and_then(|(low, high)| Some((number(low)?, number(high)?)));
            ends.ok_or_else(|| wrong(format!("{range} is no range LOW..HIGH of {name} in {unit}")))?
        }
        None if here > 0.0 => (0.0, 2.0 * here),
        None => return Err(wrong(format!("{name} = {here} {unit}: no range follows from it"))),
    };
    if low < 0.0 && (unit == "kg" || unit == "s") {
        return Err(wrong(format!("the range of {name} begins at {low} {unit}, below 0, where it has no meaning")));
    }
    if low >= high {
        return Err(wrong(format!("the range of {name} ends at {high}, not above its begin {low}")));
    }
    Ok(Side { name, unit, low, high, here })
}

impl Domain {
    /// Looks at every strip.
    pub fn of(subject: &Subject, x: Side, y: Side) -> Self {
        let strip = |index: usize| {
            let here = subject.with(&x.name, x.at((index as f64 + 0.5) / STRIPS as f64));
            let told = |value: f64| is_stable(&here.with(&y.name, value));
            (intervals(&y, |value| told(value) == Some(true)), intervals(&y, |value| told(value).is_none()))
        };
        let (strips, untold) = (0..STRIPS).into_par_iter().map(strip).unzip();
        Domain { x, y, strips, untold }
    }

    /// The domain as comma-separated values: both parameters, the rate of growth, and whether it is stable; both are empty where
    /// it cannot be told.
    pub fn sweep(subject: &Subject, x: &Side, y: &Side) -> String {
        let share = |index: usize| index as f64 / (SWEEP - 1) as f64;
        let row = |index: usize| {
            let (a, b) = (x.at(share(index / SWEEP)), y.at(share(index % SWEEP)));
            let growth = growth_per_s(&subject.with(&x.name, a).with(&y.name, b));
            match growth {
                Some(growth) => format!("{a},{b},{growth},{}\n", u8::from(growth < 0.0)),
                None => format!("{a},{b},,\n"),
            }
        };
        let rows: Vec<String> = (0..SWEEP * SWEEP).into_par_iter().map(row).collect();
        format!("{},{},growth_per_s,stable\n{}", x.name, y.name, rows.concat())
    }
}

/// The intervals of a side in which a test holds; edges are narrowed down between two heights that differ.
fn intervals(side: &Side, holds: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let heights: Vec<f64> = (0..=HEIGHTS).map(|index| side.at(index as f64 / HEIGHTS as f64)).collect();
    let held: Vec<bool> = heights.iter().map(|height| holds(*height)).collect();
    let edge = |index: usize| {
        let (mut from, mut to) = (heights[index], heights[index + 1]);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            if holds(middle) == held[index] { from = middle } else { to = middle }
        }
        0.5 * (from + to)
    };
    let mut intervals = Vec::new();
    let mut begin = held[0].then_some(heights[0]);
    for index in 0..HEIGHTS {
        match (begin, held[index + 1]) {
            (None, true) => begin = Some(edge(index)),
            (Some(low), false) => {
                intervals.push((low, edge(index)));
                begin = None;
            }
            _ => {}
        }
    }
    intervals.extend(begin.map(|low| (low, side.high)));
    intervals
}

#[cfg(test)]
mod tests {
    use super::super::subject::OneDelay;
    use super::*;

    fn subject() -> Subject {
        let (mass_kg, stiffness_n_per_m, damping_n_s_per_m) = (63.2, 1066.0, 40.0);
        Subject::OneDelay(OneDelay { mass_kg, stiffness_n_per_m, damping_n_s_per_m, delay_s: Some(0.016) })
    }

    #[test]
    fn the_edge_of_the_domain_is_the_closed_form() {
        let subject = subject();
        let (x, y) = sides("delay_s=0.0158..0.0162,damping_n_s_per_m=0..100", &subject).unwrap();
        let domain = Domain::of(&subject, x, y);
        // The strips left and right of 16 ms; 17.081 N s/m is the published edge there.
        let low = 0.5 * (domain.strips[STRIPS / 2 - 1][0].0 + domain.strips[STRIPS / 2][0].0);
        let resolution = 100.0 / (HEIGHTS as f64 * 1024.0);
        assert!((low - 17.081).abs() < 5e-4 + resolution, "{low}");
        assert_eq!(domain.strips[0].len(), 1, "one interval, up to the top");
    }

    #[test]
    fn a_chart_that_means_nothing_is_refused() {
        for (text, word) in [
            ("delay_s", "expected two"),
            ("delay_s,delay_s", "both sides"),
            ("delay_s,dmaping", "unknown parameter dmaping"),
            ("delay_s=3..1,mass_kg", "not above its begin"),
            ("delay_s=a..1,mass_kg", "is no range"),
        ] {
            let error = sides(text, &subject()).unwrap_err();
            assert!(error.what.contains(word), "{text}: {}", error.what);
        }
    }
}
