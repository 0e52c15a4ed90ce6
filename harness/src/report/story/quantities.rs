//! Scores on test recordings, base values, scatter between recordings, and the recordings themselves.

use super::super::page::{Section, Table, Tone};
use super::maps::channel_of_key;
use super::table::{numbers, row, table, words};
use super::words::{Scale, counted, figures, joined, key, listed, number, value, value_with_sd};
use crate::diagnose::answer::{BaseParameter, Diagnosis, SessionNote};
use crate::diagnose::software::Software;
use crate::recording::Grade;

/// All tables of this section.
pub(super) fn tables(answer: &Diagnosis) -> Vec<Table> {
    [test(answer), base(answer), scatter(answer), sessions(answer)].into_iter().flatten().collect()
}

/// How many recordings were kept for the final score.
pub(super) fn test_count(answer: &Diagnosis) -> usize {
    answer.sessions.iter().filter(|session| session.role == "test").count()
}

fn test(answer: &Diagnosis) -> Option<Table> {
    let count = test_count(answer);
    if count == 0 {
        return None;
    }
    let rows = answer.test.iter().map(|(channel, score)| {
        let scale = Scale::of(score.unit, score.before.max(score.after));
        let with_unit = |value: f64| scale.figures(value, 3);
        let over = |a: f64, b: f64| if b > 0.0 { figures(a / b, 3) } else { "–".to_owned() };
        let floor = if score.noise_floor > 0.0 { with_unit(score.noise_floor) } else { "not known".to_owned() };
        let tone = if score.after > score.before { Some(Tone::Warning) } else { None };
        let excess = libm::sqrt((score.after * score.after - score.noise_floor * score.noise_floor).max(0.0));
        let cells = vec![
            channel_of_key(channel),
            with_unit(score.before),
            with_unit(score.after),
            floor,
            with_unit(excess),
            over(score.after, score.noise_floor),
            over(score.before, score.after),
        ];
        row(tone, cells)
    });
    let columns = vec![
        words("channel"),
        numbers("model as given"),
        numbers("with what was found"),
        numbers("noise floor"),
        numbers("left above noise"),
        numbers("after over noise floor"),
        numbers("before over after"),
    ];
    let note = format!(
        "Root mean square over {}, used for nothing else; only offset and stiffness, inside the declared repeatability, are \
         fitted for each. Left above noise: √(after² − floor²).",
        counted(count, "test recording")
    );
    table(Section::Quantities, "Error on the test recordings", note, columns, rows.collect())
}

fn base(answer: &Diagnosis) -> Option<Table> {
    let rows = answer.base_parameters.iter().map(|(name, base)| {
        let (name, unit) = key(name);
        let tone = if base.wrong { Some(Tone::Bad) } else { Some(Tone::Good) };
        let judged = if base.wrong { "wrong" } else { "agrees" };
        let cells = vec![
            name,
            value(base.nominal, unit),
            value_with_sd(base.fitted, base.sd, unit),
            difference(base, unit),
            judged.to_owned(),
        ];
        row(tone, cells)
    });
    let columns = vec![
        words("base value"),
        numbers("model"),
        numbers("recordings ± standard deviation"),
        numbers("difference"),
        words("judged"),
    ];
    let note = "Fitted together with what was found. Wrong: off by more than its uncertainty and the declared repeatability \
                together.";
    table(Section::Quantities, "Base values", note, columns, rows.collect())
}

/// The difference in its unit, as a share of the nominal value, and in standard deviations.
fn difference(base: &BaseParameter, unit: &str) -> String {
    let off = base.fitted - base.nominal;
    let scale = Scale::of(unit, off);
    let mut text = format!("{}{}", sign(off), scale.figures(off, 2));
    if base.nominal.abs() > 0.0 {
        text.push_str(&format!(", {}", percent(100.0 * off / base.nominal.abs(), true)));
    }
    if base.sd > 0.0 && base.sd.is_finite() {
        text.push_str(&format!(", {}", joined(&figures((off / base.sd).abs(), 2), "sd")));
    }
    text
}

/// Percent, of which two digits are vouched for.
fn percent(value: f64, with_sign: bool) -> String {
    let sign = if with_sign { sign(value) } else { "" };
    format!("{sign}{}", joined(&figures(value, 2), "%"))
}

fn sign(value: f64) -> &'static str {
    if value > 0.0 { "+" } else { "" }
}

fn scatter(answer: &Diagnosis) -> Option<Table> {
    let names = ["force offset", "stiffness", "damping"];
    let rows = names.into_iter().enumerate().zip(&answer.scatter).map(|((index, name), [declared, found])| {
        let text =
            |value: f64| if index == 0 { joined(&figures(value, 2), "N") } else { percent(100.0 * value, false) };
        let ratio = if *declared > 0.0 { figures(found / declared, 2) } else { "–".to_owned() };
        row(None, vec![name.to_owned(), text(*declared), text(*found), ratio])
    });
    let has_any = answer.scatter.iter().flatten().any(|value| value.abs() > 0.0);
    let columns = vec![words("quantity"), numbers("declared"), numbers("found"), numbers("found over declared")];
    let note = "Standard deviation from recording to recording.";
    table(Section::Quantities, "Repeatability", note, columns, rows.collect()).filter(|_| has_any)
}

fn sessions(answer: &Diagnosis) -> Option<Table> {
    let rows = answer.sessions.iter().map(|session| {
        let cells = vec![
            session.file.clone(),
            session.role.to_owned(),
            session.kind.id().to_owned(),
            format!("{:?}", session.grade),
            session.software.as_ref().map_or_else(|| "–".to_owned(), software),
            own(session),
            session.notes.join("; "),
        ];
        row(session.odd.then_some(Tone::Bad), cells)
    });
    let columns = vec![
        words("recording"),
        words("role"),
        words("kind"),
        words("grade"),
        words("software block"),
        words("own offset, stiffness, damping"),
        words("notes"),
    ];
    let note = format!(
        "Roles: learn, fitted and left out in turn; test, final score only; aux, noise and free motion. Grades: {}. A marked \
         recording differs from the others or is not what it says. Software block: recorded force in, command out; what closes \
         to rounding is our own software as the model describes it. Own: offset, and stiffness and damping against the shared ones.",
        grades(answer.sessions.iter().map(|session| session.grade))
    );
    table(Section::Quantities, "Recordings", note, columns, rows.collect())
}

/// What the grades that occur mean.
pub(super) fn grades(of: impl Iterator<Item = Grade>) -> String {
    let found: Vec<Grade> = of.collect();
    let all = [Grade::A, Grade::B, Grade::C, Grade::D].into_iter();
    let occurring = all.filter(|grade| found.contains(grade));
    listed(&occurring.map(|grade| format!("{grade:?}, {}", grade.about())).collect::<Vec<String>>(), "or")
}

/// What the software block says, in words.
fn software(software: &Software) -> String {
    let Some(closure_m) = software.closure_m else {
        let text = if software.is_judged() { "not closed by software" } else { "too much is missing to judge it" };
        return text.to_owned();
    };
    if software.closes() {
        return format!("closes ({})", short_length(closure_m));
    }
    let mut findings = Vec::new();
    if software.clock_offset_s.abs() > 0.0 {
        findings.push(format!("clock offset {}", value(software.clock_offset_s, "s")));
    }
    if (software.mass_ratio - 1.0).abs() > 0.0 {
        findings.push(format!("mass {} times the declared one", number(software.mass_ratio)));
    }
    if software.bias_error_n.abs() > 0.0 {
        findings.push(format!("bias off by {}", value(software.bias_error_n, "N")));
    }
    if let Some(delay_s) = software.pose_delay_s.filter(|delay_s| delay_s.abs() > 0.0) {
        findings.push(format!("pose delay {}", value(delay_s, "s")));
    }
    let open = format!("does not close: {}", short_length(closure_m));
    if findings.is_empty() {
        return open;
    }
    let after = match software.closure_found_m {
        Some(left_m) if software.explained() => format!(", closes with it ({})", short_length(left_m)),
        Some(left_m) => format!(", still open with it: {}", short_length(left_m)),
        None => String::new(),
    };
    format!("{open}; {}{after}", findings.join(", "))
}

/// A length that may be anything from rounding to millimetres.
fn short_length(length_m: f64) -> String {
    if length_m.abs() < 1e-9 {
        joined(&figures(length_m, 1), "m")
    } else {
        Scale::of("m", length_m).figures(length_m, 2)
    }
}

/// Offset, and stiffness and damping against the shared ones.
fn own(session: &SessionNote) -> String {
    let Some([offset_n, stiffness, damping]) = session.nuisance else {
        return "–".to_owned();
    };
    let share = |logarithm: f64| percent(100.0 * (libm::exp(logarithm) - 1.0), true);
    let offset = joined(&figures(offset_n, 2), "N");
    format!("{}{offset}, {}, {}", sign(offset_n), share(stiffness), share(damping))
}
