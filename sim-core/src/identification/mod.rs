//! Identification of a position-controlled robot: what lies between a command and the pose.
//!
//! One axis is a lag of second order, a dead time, or both:
//!
//! ```text
//! G(s) = e^{-s T} ωₙ² / (s² + 2 ζ ωₙ s + ωₙ²),    equivalent delay at low frequency: T + 2 ζ / ωₙ
//! ```
//!
//! | symbol | meaning | unit | source |
//! |---|---|---|---|
//! | fₙ = ωₙ / 2π | natural frequency | Hz | fitted |
//! | ζ | damping ratio | 1 | fitted |
//! | T | dead time that the lag does not explain | s | fitted |
//!
//! A lag of 10 Hz and ζ = 0.5 delays as much as a dead time of 15.9 ms: a delay that a manufacturer states may *be* the lag. So
//! the three forms compete on the data ([`form`]), and a dead time beside a lag is kept only where both were fitted together and
//! the data cannot do without either. Two ways lead to the data: a step in the command ([`step`] for the classical reading,
//! [`response`] for the fit), and an excitation of any shape ([`following`] for the fit, [`excitation`] for gain and delay at its
//! frequencies). A step is held from its stamp on; under an excitation the command is drawn as straight lines between its stamps,
//! which is half a loop period earlier on average. Source: reference/PHYSICS.md, section 6.
//!
//! What is identified is the way from the command to the pose that was recorded: through a robot controller's own report it
//! includes the delay of that report.
//!
//! Not modelled: limits of speed and acceleration (steps must be small), friction, modes above the first.

pub mod excitation;
pub mod following;
pub mod form;
pub mod least_squares;
pub mod response;
pub mod step;

pub use excitation::{Line, Spectrum, frequencies, spectrum};
pub use following::follow;
pub use form::{Choice, Form, Lag, Way};
pub use response::fit_step;
pub use step::{Classical, StepTest, classical};

/// Robots whose truth is integrated here (Runge-Kutta of fourth order), not taken from the closed form under test.
#[cfg(test)]
mod tests {
    use super::excitation::Sampled;
    use super::*;
    use crate::rng::{Stream, Streams};
    use alloc::vec::Vec;

    const TAU: f64 = 2.0 * core::f64::consts::PI;
    /// Size of the step, and noise: 0.5 % of it.
    const STEP_M: f64 = 0.005;
    const NOISE: f64 = 0.005;
    /// The command changes here; 13 ms into a period of the slower tracker.
    const BEGIN_S: f64 = 0.201;

    /// The pose of a lag behind a held command that is late by the dead time, at these times; each period is cut into 50 µs.
    fn lagging(times: &[f64], fn_hz: f64, zeta: f64, dead_s: f64, command: &dyn Fn(f64) -> f64) -> Vec<f64> {
        let omega = TAU * fn_hz;
        let pull = |t: f64, x: f64, v: f64| omega * omega * (command(t - dead_s) - x) - 2.0 * zeta * omega * v;
        let (mut t, mut x, mut v) = (0.0, command(-1.0), 0.0);
        let mut poses = Vec::new();
        for time in times {
            let count = libm::ceil((time - t) / 5e-5).max(1.0);
            let h = (time - t) / count;
            for _ in 0..count as usize {
                let (k1x, k1v) = (v, pull(t, x, v));
                let (k2x, k2v) = (v + 0.5 * h * k1v, pull(t + 0.5 * h, x + 0.5 * h * k1x, v + 0.5 * h * k1v));
                let (k3x, k3v) = (v + 0.5 * h * k2v, pull(t + 0.5 * h, x + 0.5 * h * k2x, v + 0.5 * h * k2v));
                let (k4x, k4v) = (v + h * k3v, pull(t + h, x + h * k3x, v + h * k3v));
                x += h * (k1x + 2.0 * k2x + 2.0 * k3x + k4x) / 6.0;
                v += h * (k1v + 2.0 * k2v + 2.0 * k3v + k4v) / 6.0;
                t += h;
            }
            poses.push(x);
        }
        poses
    }

    fn step_test(rate_hz: f64, fn_hz: f64, zeta: f64, dead_s: f64, stream: &mut Stream) -> StepTest {
        let time_s: Vec<f64> = (0..(2.2 * rate_hz) as usize).map(|nth| nth as f64 / rate_hz).collect();
        let held = |t: f64| if t >= BEGIN_S { STEP_M } else { 0.0 };
        let pose = lagging(&time_s, fn_hz, zeta, dead_s, &held);
        let pose = pose.iter().map(|pose| pose + NOISE * STEP_M * stream.normal()).collect();
        StepTest { changes: alloc::vec![(BEGIN_S, STEP_M)], time_s, pose }
    }

    /// Natural frequency within 2 % and damping within 0.02 at 0.5 % noise: the limits that were asked for.
    #[test]
    fn the_fit_of_a_whole_step_finds_frequency_and_damping() {
        for rate_hz in [250.0, 1000.0] {
            for fn_hz in [3.0, 6.0, 10.0, 15.0] {
                for zeta in [0.05, 0.2, 0.5, 0.8, 1.2] {
                    let mut stream = Streams::new((fn_hz * 100.0 + zeta * 10.0) as u64).named("step");
                    let test = step_test(rate_hz, fn_hz, zeta, 0.0, &mut stream);
                    let choice = fit_step(&test).unwrap();
                    let way = choice.way();
                    assert_eq!(way.form, Form::Lag, "{rate_hz} {fn_hz} {zeta}: {choice:?}");
                    let (lag, deviation) = way.lag.unwrap();
                    let off = lag.natural_frequency_hz / fn_hz - 1.0;
                    assert!(off.abs() < 0.02, "{rate_hz} {fn_hz} {zeta}: {lag:?} ± {deviation:?}");
                    assert!(
                        (lag.damping_ratio - zeta).abs() < 0.02,
                        "{rate_hz} {fn_hz} {zeta}: {lag:?} ± {deviation:?}"
                    );
                    // 5 standard deviations, 40 cases: the scatter that the fit states is the one it has.
                    assert!(
                        (lag.damping_ratio - zeta).abs() < 5.0 * deviation.damping_ratio,
                        "{lag:?} ± {deviation:?}"
                    );
                }
            }
        }
    }

    /// The classical reading, with the scatter that reference/PHYSICS.md, section 6 gives for it: fn ± 2-5 %, ζ low by up to 0.02 and
    /// ± 0.008.
    #[test]
    fn overshoot_decay_and_period_are_read_as_the_textbook_does() {
        for (fn_hz, zeta) in [(3.0, 0.1), (6.0, 0.3), (10.0, 0.05), (10.0, 0.5)] {
            let mut stream = Streams::new(7).named("classical");
            let read = classical(&step_test(1000.0, fn_hz, zeta, 0.0, &mut stream)).unwrap();
            let overshoot = libm::exp(-core::f64::consts::PI * zeta / libm::sqrt(1.0 - zeta * zeta));
            // The largest of some hundred samples lies up to three standard deviations of the noise above the peak.
            assert!((read.overshoot - overshoot).abs() < 0.02, "{fn_hz} {zeta}: {read:?}");
            assert!((read.damping_from_overshoot - zeta).abs() < 0.028, "{fn_hz} {zeta}: {read:?}");
            let off = read.natural_frequency_hz.unwrap() / fn_hz - 1.0;
            assert!(off.abs() < 0.05, "{fn_hz} {zeta}: {read:?}");
        }
        let mut stream = Streams::new(7).named("classical");
        assert_eq!(classical(&step_test(1000.0, 5.0, 1.0, 0.0, &mut stream)), None, "no overshoot, nothing to read");
    }

    /// An axis that still rings when the record ends: 0.94 / s of decay leave 28 % of the amplitude at its last tail. The overshoot
    /// is due to 91 %; the mean of the tail is wrong by the side lobes of its window, 3 % of those 28 %, and noise adds 2 %.
    #[test]
    fn a_barely_damped_axis_overshoots() {
        for rate_hz in [250.0, 1000.0] {
            let mut stream = Streams::new(11).named("ringing");
            let mut test = step_test(rate_hz, 5.0, 0.03, 0.0, &mut stream);
            let kept = (1.6 * rate_hz) as usize;
            test.time_s.truncate(kept);
            test.pose.truncate(kept);
            let read = classical(&test).unwrap();
            assert!((read.overshoot - 0.910).abs() < 0.03, "{read:?}");
            let damping = read.damping_from_decay.unwrap();
            assert!((damping - 0.03).abs() < 0.02, "{read:?}");
            assert!((read.natural_frequency_hz.unwrap() / 5.0 - 1.0).abs() < 0.05, "{read:?}");
        }
    }

    /// A dead time is taken beside a lag only where the data need it; a dead time alone is no lag.
    #[test]
    fn a_dead_time_and_a_lag_are_told_apart() {
        let mut stream = Streams::new(3).named("forms");
        let test = step_test(1000.0, 8.0, 0.4, 0.016, &mut stream);
        let choice = fit_step(&test).unwrap();
        let way = choice.way();
        assert_eq!(way.form, Form::Both, "{choice:?}");
        let (lag, _) = way.lag.unwrap();
        assert!(
            (lag.natural_frequency_hz / 8.0 - 1.0).abs() < 0.02 && (lag.damping_ratio - 0.4).abs() < 0.02,
            "{lag:?}"
        );
        assert!((way.dead_time_s.0 - 0.016).abs() < 5.0 * way.dead_time_s.1, "{way:?}");
        // The lag of 10 Hz and 0.5 is worth 15.9 ms (reference/PHYSICS.md, section 6), and stays the only delay.
        let alone = fit_step(&step_test(1000.0, 10.0, 0.5, 0.0, &mut stream)).unwrap();
        assert_eq!(alone.way().form, Form::Lag);
        assert!((alone.way().equivalent_delay_s() - 0.0159).abs() < 0.0003, "{alone:?}");
        // A rigid robot that only comes late.
        let time_s: Vec<f64> = (0..500).map(|nth| f64::from(nth) * 0.004).collect();
        let late = |t: &f64| if *t >= BEGIN_S + 0.032 { STEP_M } else { 0.0 };
        let pose = time_s.iter().map(|t| late(t) + NOISE * STEP_M * stream.normal()).collect();
        let rigid = fit_step(&StepTest { changes: alloc::vec![(BEGIN_S, STEP_M)], time_s, pose }).unwrap();
        assert_eq!(rigid.way().form, Form::DeadTime, "{rigid:?}");
        assert!((rigid.way().dead_time_s.0 - 0.032).abs() <= 0.004, "one sample period: {rigid:?}");
    }

    /// Seven lines that do not fit the record, faded in and out; a lag of 12 Hz behind a dead time, integrated here.
    #[test]
    fn an_excitation_gives_gain_and_delay_of_each_line() {
        let lines = [(0.5, 3e-3), (0.9, 2.4e-3), (1.7, 1.5e-3), (2.9, 1e-3), (4.3, 6e-4), (6.1, 4e-4), (7.9, 3e-4)];
        let command = |t: f64| {
            // The integration asks a little before the record; the fade is over 2 s at both ends.
            let fade = (0.5 * (6.0 - t.abs())).clamp(0.0, 1.0);
            fade * lines.iter().map(|(f, a)| a * libm::sin(TAU * f * t + f * 40.0)).sum::<f64>() - 0.15
        };
        let asked_s: Vec<f64> = (0..3000).map(|nth| f64::from(nth) * 0.004 - 6.0).collect();
        let asked: Vec<f64> = asked_s.iter().map(|t| command(*t)).collect();
        let command_samples = Sampled { time_s: &asked_s, value: &asked };
        let found = frequencies(&command_samples);
        assert_eq!(found.len(), lines.len(), "{found:?}");
        for (found, (truth, _)) in found.iter().zip(&lines) {
            // A tenth of the resolution of 1/12 Hz.
            assert!((found - truth).abs() < 0.008, "{found}");
        }
        // As a controller draws it: straight lines between the samples.
        let drawn = |t: f64| {
            let place = ((t + 6.0) / 0.004).clamp(0.0, 2998.999);
            let nth = libm::floor(place) as usize;
            asked[nth] + (asked[nth + 1] - asked[nth]) * (place - nth as f64)
        };
        let (fn_hz, zeta, dead_s) = (12.0, 0.4, 0.012);
        let pose_s: Vec<f64> = asked_s[125..].to_vec();
        let from_zero: Vec<f64> = pose_s.iter().map(|t| t + 6.0).collect();
        let sigma = 2e-5;
        let mut stream = Streams::new(5).named("spectrum");
        let mut answered = |fn_hz, zeta, dead_s| -> Vec<f64> {
            let quiet = lagging(&from_zero, fn_hz, zeta, dead_s, &|t| drawn(t - 6.0));
            quiet.iter().map(|pose| pose + sigma * stream.normal()).collect()
        };
        let value = answered(fn_hz, zeta, dead_s);
        let response = spectrum(&command_samples, &Sampled { time_s: &pose_s, value: &value }).unwrap();
        for (line, (f, _)) in response.lines.iter().zip(&lines) {
            let ratio = f / fn_hz;
            let gain = 1.0 / libm::hypot(1.0 - ratio * ratio, 2.0 * zeta * ratio);
            // Noise, and the fade: a line of 1/12 Hz width sees gain and delay of its neighbourhood, 2 ‰ and 0.1 ms of change.
            assert!((line.gain - gain).abs() < 5.0 * line.gain_deviation + 0.002, "{line:?} {gain}");
            let delay_s = dead_s + libm::atan2(2.0 * zeta * ratio, 1.0 - ratio * ratio) / (TAU * f);
            assert!((line.delay_s - delay_s).abs() < 5.0 * line.delay_deviation_s() + 1e-4, "{line:?} {delay_s}");
        }
        let way = *response.choice.way();
        assert_eq!(way.form, Form::Both, "{:?}", response.choice);
        let (lag, deviation) = way.lag.unwrap();
        assert!((lag.natural_frequency_hz - fn_hz).abs() < 5.0 * deviation.natural_frequency_hz, "{way:?}");
        assert!(
            (lag.natural_frequency_hz / fn_hz - 1.0).abs() < 0.02 && (lag.damping_ratio - zeta).abs() < 0.02,
            "{way:?}"
        );
        assert!((way.dead_time_s.0 - dead_s).abs() < 5.0 * way.dead_time_s.1, "{way:?}");
        // The lag alone, as slow as a robot may be.
        let value = answered(4.0, 0.7, 0.0);
        let alone = follow(&command_samples, &Sampled { time_s: &pose_s, value: &value }).unwrap();
        assert_eq!(alone.way().form, Form::Lag, "{alone:?}");
        let (lag, _) = alone.way().lag.unwrap();
        assert!(
            (lag.natural_frequency_hz / 4.0 - 1.0).abs() < 0.02 && (lag.damping_ratio - 0.7).abs() < 0.02,
            "{lag:?}"
        );
        let still = alloc::vec![0.0; 3000];
        let still = Sampled { time_s: &asked_s, value: &still };
        assert_eq!(spectrum(&still, &Sampled { time_s: &pose_s, value: &value }), None, "a command that does not move");
    }
}
