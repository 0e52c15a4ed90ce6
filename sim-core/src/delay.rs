//! A delay line over a slice of numbers: the memory of every part and effect that looks back.

/// How many slots a line of `delay_s` needs at a step of `step_s`: the slot index, the samples and one beyond.
pub fn slots(delay_s: f64, step_s: f64) -> usize {
    libm::ceil(delay_s.max(0.0) / step_s) as usize + 3
}

/// A delay in steps; one that is a whole number of them up to rounding is exactly that number.
pub fn steps(delay_s: f64, step_s: f64) -> f64 {
    let steps = delay_s / step_s;
    let nearest = libm::round(steps);
    if (steps - nearest).abs() < 1e-6 { nearest } else { steps }
}

/// Fills the line, so that it reads `past(age)` for a value that is `age` steps old.
pub fn fill(line: &mut [f64], past: impl Fn(usize) -> f64) {
    let samples = line.len() - 1;
    line[0] = 0.0;
    // The newest sample sits in the slot before the head.
    for age in 0..samples {
        line[1 + (samples - 1 - age)] = past(age);
    }
}

/// Puts the newest value in and reads what was put in `delay_steps` ago, on the straight line between two samples.
///
/// `delay_steps` must not exceed `line.len() - 3`.
pub fn push_and_read(line: &mut [f64], newest: f64, delay_steps: f64) -> f64 {
    let samples = line.len() - 1;
    let head = line[0] as usize;
    line[1 + head] = newest;
    line[0] = if head + 1 == samples { 0.0 } else { (head + 1) as f64 };
    let whole = libm::floor(delay_steps);
    let share = delay_steps - whole;
    let at = |age: usize| line[1 + if age <= head { head - age } else { head + samples - age }];
    let (young, old) = (at(whole as usize), at(whole as usize + 1));
    young + (old - young) * share
}
