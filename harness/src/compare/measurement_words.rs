//! What two measurements differ in, in sentences with value and unit. Offsets come first: nothing is shifted silently.

use super::measurements::{Difference, RunAgainst};
use super::result::Verdict;
use crate::recording::{Grade, Session};
use sim_core::criterion::Contact;

/// Masses that differ by less than this are the same. Chosen: a percent moves restitution by 0.001 at 0.8.
const MASS_RATIO_SAME: f64 = 0.01;

/// Sentences on one recording; `contacts` and `masses` are those of the reference and of this recording.
pub(super) fn findings(run: &RunAgainst, contacts: [&Contact; 2], masses: [Option<f64>; 2]) -> Vec<String> {
    let file = &run.file;
    let alignment = &run.alignment;
    let mut findings = vec![format!(
        "{file}: aligned at first contact, {:+.4} s after that of the reference in its own file ({}, from {:.3} N down)",
        alignment.time_shift_s, contacts[1].by, contacts[1].threshold_n
    )];
    findings.push(velocity(run));
    if let Some(offset_m) = alignment.position_offset_m {
        findings.push(format!(
            "{file}: contact begins {:+.3} mm from where it begins in the reference; plots show positions from there",
            offset_m * 1e3
        ));
    }
    if contacts[0].by != contacts[1].by {
        findings.push(format!(
            "{file}: contact is told by the {}, in the reference by the {}",
            contacts[1].by, contacts[0].by
        ));
    }
    match masses {
        [Some(reference), Some(here)] if (here / reference - 1.0).abs() > MASS_RATIO_SAME => findings.push(format!(
            "{file}: the mass is {here:.2} kg, in the reference {reference:.2} kg: duration and energy differ by that alone"
        )),
        [Some(_), Some(_)] => {}
        _ => findings.push(format!("{file}: not both records say reduced_mass_kg, so no energy is compared")),
    }
    if run.grade != Grade::A {
        findings.push(format!("{file}: grade {:?}, {}", run.grade, run.grade.about()));
    }
    findings.extend(run.quantities.iter().filter(|one| one.verdict == Verdict::CannotSay).map(|one| {
        format!(
            "{file}: {}: {}",
            one.name,
            if one.difference.is_some() { "its noise is not known" } else { &one.about }
        )
    }));
    findings
}

/// The velocity offset, and what it alone does.
fn velocity(run: &RunAgainst) -> String {
    let file = &run.file;
    let speed: Option<&Difference> = run.quantities.iter().find(|one| one.name == "approach_speed_m_per_s");
    let Some((speed, reference, offset)) = speed.and_then(|speed| Some((speed, speed.reference?, speed.difference?)))
    else {
        return format!("{file}: no approach speed, so the velocity offset is not known");
    };
    let ratio = offset / reference;
    let effect = format!(
        "that alone changes the peak force by {:+.1} % and the energy by {:+.1} %",
        100.0 * ratio,
        100.0 * ((1.0 + ratio) * (1.0 + ratio) - 1.0)
    );
    format!(
        "{file}: velocity offset {:+.3} mm/s ± {:.3} mm/s to the approach at {:.3} mm/s of the reference; nothing is scaled, and {effect}",
        offset * 1e3,
        speed.uncertainty.unwrap_or(f64::NAN) * 1e3,
        reference * 1e3
    )
}

/// A record without a bias: whatever the sensor reads at rest then counts as force.
pub(super) fn no_bias(session: &Session) -> Option<String> {
    let missing = session.sensed.is_some() && !session.believed.contains_key("ft_bias");
    missing.then(|| {
        format!("{}: the record says no ft_bias, so the reading is taken as free of bias", session.file.display())
    })
}
