//! When a sample was taken, from when it arrived: a device's counter against the host's clock.
//!
//! A device counts (IPOC in ms, a sensor in samples or µs) and the host notes when each packet arrives. With
//! `t` the counter times its nominal period and `h` the time of arrival, the offset `o = h - t` is
//!
//! ```text
//! o = constant + drift·t + delay,   delay ≥ 0
//! ```
//! Delays are one-sided, so the line lies at the lower edge of the points and not through their middle: of all lines below every
//! point, the one that is nearest to them on average. It is the edge of the lower convex hull at the mean of `t`
//! (Moon, Skelly, Towsley, INFOCOM 1999).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | drift | rate of the host's clock against the device's, minus 1 | 10⁻⁶ (ppm) |
//! | mean above | mean of `o` above the line: the mean delay, less its least | ns |
//! | spread | greatest `o` above the line | ns |
//!
//! Not covered: the least delay itself. One-way data do not separate it from the constant; a dead time of the cell (16 + 16 ms at
//! EPOS) stays in the data, as it must. A drift that wanders: one line is fitted to a session.

/// A line below all offsets, and how they lie above it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ClockLine {
    /// Device time at which the line was pinned: of the first sample.
    pub device_from_ns: i64,
    /// Host time minus device time there.
    pub offset_ns: i64,
    /// How much faster the host's clock runs.
    pub drift_ppm: f64,
    /// Mean of the samples above the line.
    pub mean_above_ns: f64,
    /// How many samples it rests on.
    pub samples: u64,
}

impl ClockLine {
    /// The host's time for a device's: when the packet would have arrived with the least delay.
    pub fn host_ns(&self, device_ns: i64) -> i64 {
        let since_ns = device_ns.saturating_sub(self.device_from_ns);
        let drifted_ns = libm::round(self.drift_ppm * 1e-6 * since_ns as f64) as i64;
        device_ns.saturating_add(self.offset_ns).saturating_add(drifted_ns)
    }
}

/// Below this the slope of the edge is the jitter's and not the clock's: 2 ms of jitter over 10 s are 200 ppm. Chosen.
const DRIFT_SPAN_NS_MIN: f64 = 10e9;
/// Corners that the hull keeps; beyond, the two nearest of them become one. Noise leaves some ten. Chosen.
const CORNERS_MAX: usize = 1024;

/// The lower envelope of the offsets seen so far.
#[derive(Debug, Clone, Default)]
pub struct Envelope {
    /// First device and host time: the origin of everything below, so that doubles keep the nanosecond.
    origin: Option<(i64, i64)>,
    /// Corners of the lower convex hull: device time and offset, both since the origin.
    hull: Vec<(f64, f64)>,
    samples: u64,
    sum_time: f64,
    sum_offset: f64,
}

impl Envelope {
    /// A sample. One whose device time does not lie after the last corner is left out: it came too late to be on time.
    pub fn push(&mut self, device_ns: i64, host_ns: i64) {
        let (device_from, host_from) = *self.origin.get_or_insert((device_ns, host_ns));
        let (time, host) = (device_ns.saturating_sub(device_from), host_ns.saturating_sub(host_from));
        let point = (time as f64, host.saturating_sub(time) as f64);
        if self.hull.last().is_some_and(|last| last.0 >= point.0) {
            return;
        }
        self.samples += 1;
        self.sum_time += point.0;
        self.sum_offset += point.1;
        while let [.., before, last] = self.hull[..] {
            // The last corner stays while the hull turns upwards in it.
            let rise = (last.1 - before.1) * (point.0 - last.0);
            if rise < (point.1 - last.1) * (last.0 - before.0) {
                break;
            }
            self.hull.pop();
        }
        if self.hull.len() == CORNERS_MAX {
            self.thin();
        }
        self.hull.push(point);
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// The line; `None` before the first sample. While the samples span less than 10 s its drift is 0.
    pub fn line(&self) -> Option<ClockLine> {
        let (device_from_ns, host_from_ns) = self.origin?;
        let span = self.hull.last()?.0;
        let drift = if span < DRIFT_SPAN_NS_MIN { 0.0 } else { self.edge() };
        let least = self.hull.iter().map(|(time, offset)| offset - drift * time).fold(f64::INFINITY, f64::min);
        let count = self.samples as f64;
        let mean_above_ns = (self.sum_offset - drift * self.sum_time) / count - least;
        // Whole nanoseconds: a double has no room for them beside fifty years.
        let offset_ns = host_from_ns.saturating_sub(device_from_ns).saturating_add(libm::round(least) as i64);
        Some(ClockLine { device_from_ns, offset_ns, drift_ppm: drift * 1e6, mean_above_ns, samples: self.samples })
    }

    /// Slope of the edge that spans the mean time.
    fn edge(&self) -> f64 {
        let mean = self.sum_time / self.samples as f64;
        let end = self.hull.partition_point(|corner| corner.0 < mean).clamp(1, self.hull.len().max(2) - 1);
        match (self.hull.get(end - 1), self.hull.get(end)) {
            (Some(from), Some(to)) => (to.1 - from.1) / (to.0 - from.0),
            _ => 0.0,
        }
    }

    /// Drops every second inner corner. The hull then lies above what it was, by less than its corners are apart.
    fn thin(&mut self) {
        let last = self.hull.len() - 1;
        let mut place = 0;
        self.hull.retain(|_| {
            place += 1;
            place == 1 || place > last || place % 2 == 0
        });
    }
}
