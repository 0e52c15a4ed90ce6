//! What a comparison found, in sentences with value and unit.

use super::result::{Block, Fitted, FreeRunSummary, Quantity, Shift, Verdict};
use crate::case::Case;
use crate::diagnose::noise::{Noise, trend};
use crate::diagnose::nuisance::FITTED_SIGMAS_MAX;
use crate::diagnose::software::Software;
use crate::recording::Grade;

/// A drift at rest is one from here on, in its own standard deviations.
const DRIFT_SIGMAS: f64 = 4.0;

/// The software block in a sentence, and what the recording lacks in another.
pub fn software(software: &Software) -> String {
    match &software.gaps {
        Some(gaps) if !gaps.is_enough() => gaps.words(),
        Some(gaps) => format!("{}; {}", on_what_is_there(software), gaps.words()),
        None => on_what_is_there(software),
    }
}

fn on_what_is_there(software: &Software) -> String {
    let Some(closure_m) = software.closure_m else {
        return "no contact with the loop closed: the software block says nothing here".into();
    };
    if software.closes() {
        let pose = software.other_pose().map_or(String::new(), |words| format!(", {words}"));
        let allowed = match software.rounding_m {
            rounding_m if rounding_m > 0.0 => format!(", and their rounding allows {rounding_m:.1e} m"),
            _ => String::new(),
        };
        return format!(
            "our software, recomputed from the recorded force, gives the recorded commands to {closure_m:.1e} m{allowed}{pose}"
        );
    }
    let mut named = Vec::new();
    if software.clock_offset_s != 0.0 {
        named.push(format!("the force stream stamped {:.3} ms late", software.clock_offset_s * 1e3));
    }
    if (software.mass_ratio - 1.0).abs() > 0.0 {
        named.push(format!("a mass {:.6} times the declared one", software.mass_ratio));
    }
    if software.bias_error_n != 0.0 {
        named.push(format!("a bias {:+.4} N beyond the declared one", software.bias_error_n));
    }
    if let Some(delay_s) = software.pose_delay_s.filter(|delay_s| *delay_s != 0.0) {
        named.push(format!("the controller's pose {:.2} ms later than declared", delay_s * 1e3));
    }
    let found_m = software.closure_found_m.unwrap_or(closure_m);
    let head =
        format!("our software, recomputed from the recorded force, misses the recorded commands by {closure_m:.1e} m");
    match (named.is_empty(), software.explained()) {
        (false, true) => format!("{head}; with {} it agrees to {found_m:.1e} m", named.join(" and ")),
        (false, false) => format!(
            "{head}; {} leaves {found_m:.1e} m, so clock, mass or compensator is wrong in another way",
            named.join(" and ")
        ),
        _ => format!("{head}; no clock, mass, bias or delay that was tried explains it"),
    }
}

/// How much a finding matters: what must be settled first comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// Our own software, or the clock, mass or compensator that it believes.
    Software,
    /// A block is above its noise.
    Block,
    /// A shift in time would explain it.
    Shift,
    /// The noise is not what it should be.
    Noise,
    /// A number of one recording is at its limit.
    Fitted,
    /// The loop as a whole.
    FreeRun,
    /// The file itself.
    File,
}

/// What to say of one recording.
pub struct Session<'a> {
    /// File name.
    pub file: &'a str,
    /// Integrity of the file.
    pub grade: Grade,
    /// Software block.
    pub software: &'a Software,
    /// The same in a sentence.
    pub software_sentence: &'a str,
    /// Blocks.
    pub blocks: &'a [Block],
    /// What was fitted.
    pub fitted: &'a [Fitted],
    /// Shift of force and of pose.
    pub shifts: [Option<&'a Shift>; 2],
    /// Quantities.
    pub quantities: &'a [Quantity],
    /// Free run.
    pub free_run: Option<&'a FreeRunSummary>,
}

/// The findings of one recording, with their rank.
pub fn session(session: &Session<'_>) -> Vec<(Rank, String)> {
    let file = session.file;
    let mut out = Vec::new();
    if !session.software.closes() {
        out.push((Rank::Software, format!("{file}: {}; settle this first", session.software_sentence)));
    } else if let Some(gaps) = &session.software.gaps {
        out.push((if gaps.is_enough() { Rank::File } else { Rank::Software }, format!("{file}: {}", gaps.words())));
    }
    let blocks = session.blocks.iter().filter(|block| block.verdict == Verdict::Outside);
    out.extend(blocks.map(|block| (Rank::Block, outside(file, block))));
    for (shift, channel) in session.shifts.iter().zip(["force", "reported pose"]) {
        let finding = shift.filter(|shift| shift.finding);
        out.extend(finding.map(|shift| (Rank::Shift, shifted(file, channel, shift))));
    }
    out.extend(session.fitted.iter().filter_map(|fitted| far(file, fitted)).map(|text| (Rank::Fitted, text)));
    if let Some(free_run) = session.free_run.filter(|free_run| free_run.diverged > 0) {
        let (diverged, samples) = (free_run.diverged, free_run.samples);
        let text = format!(
            "{file}: {diverged} of {samples} free runs left 1 m or became infinite: the model's loop is unstable there"
        );
        out.push((Rank::FreeRun, text));
    }
    out.extend(differ(file, session.quantities).map(|text| (Rank::FreeRun, text)));
    if session.grade != Grade::A {
        out.push((Rank::File, format!("{file}: grade {:?}, {}", session.grade, session.grade.about())));
    }
    out
}

fn outside(file: &str, block: &Block) -> String {
    let phases: Vec<&str> = block.phases_outside.iter().map(|phase| phase.name()).collect();
    let place = if phases.is_empty() { String::new() } else { format!(", in {}", phases.join(", ")) };
    format!(
        "{file}: {} is {:.1} times its noise (limit {:.2}){place}; rms {:.3e} {unit}, floor {:.3e} {unit}",
        block.block,
        block.misfit.unwrap_or(f64::NAN),
        block.misfit_limit,
        block.rms,
        block.noise_floor,
        unit = block.unit,
    )
}

fn shifted(file: &str, channel: &str, shift: &Shift) -> String {
    format!(
        "{file}: the {channel} would fit better {:.2} ± {:.2} ms {} than the model (chi² falls by {:.0}, {:.0} % of what is \
         above the noise); reported, not applied",
        shift.shift_ms.abs(),
        2.0 * shift.sd_ms,
        if shift.shift_ms > 0.0 { "later" } else { "earlier" },
        shift.gain,
        100.0 * shift.share_of_excess,
    )
}

fn far(file: &str, fitted: &Fitted) -> Option<String> {
    let declared = fitted.declared?;
    // At the limit up to rounding.
    (fitted.value.abs() > 0.999_999 * FITTED_SIGMAS_MAX * declared).then(|| {
        let unit = if fitted.unit == "1" { String::new() } else { format!(" {}", fitted.unit) };
        let (name, value) = (&fitted.name, fitted.value);
        format!(
            "{file}: the {name} is at {value:+.4}{unit}, the limit of {FITTED_SIGMAS_MAX} times the declared repeatability, and \
             would go further"
        )
    })
}

/// All quantities that differ, in one sentence.
fn differ(file: &str, quantities: &[Quantity]) -> Option<String> {
    let outside = quantities.iter().filter(|quantity| quantity.verdict == Verdict::Outside);
    let told: Vec<String> = outside.filter_map(difference).collect();
    (!told.is_empty()).then(|| {
        format!(
            "{file}: the free run differs by {}; one number in twenty does so by chance, and none decides without a limit",
            told.join(", ")
        )
    })
}

fn difference(quantity: &Quantity) -> Option<String> {
    let (difference, uncertainty) = (quantity.difference?, quantity.uncertainty?);
    let unit = if quantity.unit == "1" { String::new() } else { format!(" {}", quantity.unit) };
    Some(format!("{difference:+.4} ± {uncertainty:.4}{unit} in {}", quantity.name))
}

/// A trend of the force at rest.
pub fn drift(at_rest: &Case, noise: &Noise) -> Option<String> {
    let (count, slope, ..) = trend(&at_rest.sensed_n);
    // Long-run variance of ARMA(1,1): σ² (1 + θ)² / (1 - φ)²; variance of a slope: 12 of it over n³.
    let gain = (1.0 + noise.average) / (1.0 - noise.slow_memory).max(1e-6);
    let n = count as f64;
    let sd = noise.innovation_n * gain * libm::sqrt(12.0 / (n * n * n).max(1.0));
    let period_s = at_rest.rates.sensor_period.seconds();
    (slope.abs() > DRIFT_SIGMAS * sd).then(|| {
        let (rate, wide) = (slope / period_s, 2.0 * sd / period_s);
        format!(
            "{}: the force drifts at rest by {rate:+.4} ± {wide:.4} N/s; no drift is part of the noise",
            at_rest.name
        )
    })
}
