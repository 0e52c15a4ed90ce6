//! The view model of the report: plain values, in reading order, units in the labels.
//!
//! A label ends in its unit after ` in `, as in `force x in N`; the read-out under the cursor takes the unit from there.

use serde::Serialize;

/// Everything that one report shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Page {
    /// What was compared, e.g. `model M2 against run 017`.
    pub title: String,
    /// How the verdict is to be read.
    pub tone: Tone,
    /// The verdict in a few words, e.g. `explained: stiffness-hardening`.
    pub verdict: String,
    /// The reasons, most important first; one sentence each.
    pub sentences: Vec<String>,
    /// One line that makes this report again.
    pub command: String,
    /// Where the model fails: channel by phase.
    pub heat: Vec<Heat>,
    /// Signals over time.
    pub plots: Vec<PlotGroup>,
    /// Force over penetration.
    pub loops: Vec<XyPlot>,
    /// Where a loop is stable, over two of its parameters.
    pub charts: Vec<Chart>,
    /// All tables; each names the section in which it is shown.
    pub tables: Vec<Table>,
    /// The error of each model, down to the noise floor.
    pub ladder: Option<Ladder>,
    /// Key and value, e.g. `recording` and its SHA-256; shown in this order.
    pub provenance: Vec<(String, String)>,
}

/// How a verdict or a row is to be read. Never told by colour alone: each tone has a mark.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
pub enum Tone {
    /// Nothing to do.
    Good,
    /// Look at it: undecided, or at a limit.
    Warning,
    /// A requirement failed or the model is wrong.
    Bad,
}

/// The sections of the report, in their order.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd, Serialize)]
pub enum Section {
    /// The answer.
    Verdict,
    /// Heat maps.
    WhereItFails,
    /// Signals over time.
    Signals,
    /// Force over penetration.
    Loops,
    /// Stable domains.
    Charts,
    /// Ranking, ties, deciding experiments.
    Missing,
    /// The error ladder.
    Ladder,
    /// Quantities of interest, parameters, sessions.
    Quantities,
    /// Hashes, versions, seeds.
    Provenance,
}

/// One heat map: rows are channels, columns are phases.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Heat {
    /// Title, e.g. `before` or `after stiffness-hardening`.
    pub title: String,
    /// What a cell holds, e.g. `95th percentile of |residual| over noise`.
    pub note: String,
    /// Names of the phases.
    pub columns: Vec<String>,
    /// One row per channel.
    pub rows: Vec<HeatRow>,
    /// Unit of the cells. The colour steps are made for `times noise`, where 1 is the noise itself.
    pub unit: String,
}

/// One channel of a heat map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeatRow {
    /// Name of the channel.
    pub label: String,
    /// One value per column; `None` where the phase did not occur.
    pub cells: Vec<Option<f64>>,
}

/// Panels over one common abscissa; cursors and zoom move in step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlotGroup {
    /// Name that is unique in the page; letters, digits and dashes.
    pub id: String,
    /// Title, e.g. the name of the session.
    pub title: String,
    /// What to look at.
    pub note: String,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
    /// Begin and end of contact on the abscissa; shaded, and the target of the button `contact only`.
    pub contact: Option<(f64, f64)>,
}

/// One panel of a group.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Panel {
    /// Label with unit, e.g. `force x in N`.
    pub y_label: String,
    /// Label with unit, e.g. `time in s`.
    pub x_label: String,
    /// Height of the panel, in CSS pixels.
    pub height_px: u32,
    /// Abscissa, finite and not decreasing.
    pub x: Vec<f64>,
    /// Curves over `x`.
    pub curves: Vec<Curve>,
    /// Band behind the curves.
    pub band: Option<Band>,
}

/// What a curve stands for; it decides the colour.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
pub enum Role {
    /// From the rig. Blue.
    Measured,
    /// From the model under test. Vermillion.
    Model,
    /// From a model before the last change. Purple.
    Earlier,
    /// Measured minus model. Grey.
    Residual,
    /// A limit. Thin, in the colour of the text.
    Limit,
}

/// One curve of a panel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Name in the legend, without unit.
    pub label: String,
    /// What the curve stands for.
    pub role: Role,
    /// One value per abscissa; `None` is a gap. A value that is not finite is a gap, too.
    pub y: Vec<Option<f64>>,
    /// Draw dashed, so that the curves differ without colour.
    pub dashed: bool,
}

/// A band such as plus and minus two sigma.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Band {
    /// Lower edge, one value per abscissa.
    pub low: Vec<f64>,
    /// Upper edge, one value per abscissa.
    pub high: Vec<f64>,
    /// Name in the legend, e.g. `±2σ`.
    pub label: String,
}

/// One plot of a quantity over another, such as force over penetration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct XyPlot {
    /// Title.
    pub title: String,
    /// Label with unit, e.g. `penetration in mm`.
    pub x_label: String,
    /// Label with unit, e.g. `force in N`.
    pub y_label: String,
    /// Curves; the first point of each is marked.
    pub curves: Vec<XyCurve>,
}

/// One curve of an [`XyPlot`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct XyCurve {
    /// Name in the legend.
    pub label: String,
    /// What the curve stands for.
    pub role: Role,
    /// Abscissa; need not be sorted. A point that is not finite is a gap.
    pub x: Vec<f64>,
    /// Ordinate.
    pub y: Vec<f64>,
}

/// A domain of two parameters: which part of it is stable, and where the operating point lies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Label with unit, e.g. `dead time in ms`.
    pub x_label: String,
    /// Label with unit, e.g. `damping in N s/m`.
    pub y_label: String,
    /// Lowest and highest abscissa.
    pub x_range: (f64, f64),
    /// Lowest and highest ordinate.
    pub y_range: (f64, f64),
    /// Strips of equal width from left to right: the stable intervals of the ordinate in each.
    pub strips: Vec<Vec<(f64, f64)>>,
    /// The intervals of the ordinate in each strip where it cannot be told.
    pub untold: Vec<Vec<(f64, f64)>>,
    /// The operating point.
    pub point: (f64, f64),
    /// Curves over the domain, such as the closed form.
    pub curves: Vec<XyCurve>,
}

/// One table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Title.
    pub title: String,
    /// What to look at; empty for none.
    pub note: String,
    /// Columns from left to right.
    pub columns: Vec<Column>,
    /// Rows from top to bottom.
    pub rows: Vec<Row>,
    /// Where the table is shown.
    pub section: Section,
}

/// One column of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// Heading, with unit.
    pub label: String,
    /// Numbers are right-aligned.
    pub align_right: bool,
}

/// One row of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// One text per column.
    pub cells: Vec<String>,
    /// Marks the row.
    pub tone: Option<Tone>,
}

/// The error of model after model, with the noise floor that no model gets below honestly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ladder {
    /// What the values are, e.g. `RMSE on the test recordings`.
    pub note: String,
    /// One ladder per channel.
    pub channels: Vec<LadderChannel>,
}

/// The ladder of one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderChannel {
    /// Name of the channel.
    pub label: String,
    /// Unit of all values.
    pub unit: String,
    /// Standard deviation of the noise, in `unit`.
    pub noise_floor: f64,
    /// Models in the order in which they were made.
    pub steps: Vec<LadderStep>,
}

/// One model on a ladder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderStep {
    /// Name, e.g. `M1 + stiffness hardening`.
    pub label: String,
    /// Error over all test sessions, in the unit of the channel.
    pub value: f64,
    /// Error in each test session, in the unit of the channel.
    pub per_session: Vec<f64>,
}

impl Tone {
    /// The mark that tells the tone without colour.
    pub fn mark(self) -> &'static str {
        match self {
            Self::Good => "✓",
            Self::Warning => "!",
            Self::Bad => "✗",
        }
    }
}

impl Section {
    /// All sections, in their order.
    pub const ALL: [Self; 9] = [
        Self::Verdict,
        Self::WhereItFails,
        Self::Signals,
        Self::Loops,
        Self::Charts,
        Self::Missing,
        Self::Ladder,
        Self::Quantities,
        Self::Provenance,
    ];

    /// The heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::Verdict => "Verdict",
            Self::WhereItFails => "Where it fails",
            Self::Signals => "Signals",
            Self::Loops => "Force over penetration",
            Self::Charts => "Where it is stable",
            Self::Missing => "What is missing",
            Self::Ladder => "Error ladder",
            Self::Quantities => "Quantities",
            Self::Provenance => "Provenance",
        }
    }
}

impl Page {
    /// The tables of one section, in their order.
    pub fn tables_in(&self, section: Section) -> impl Iterator<Item = &Table> {
        self.tables.iter().filter(move |table| table.section == section)
    }

    /// Whether a section has anything to show. The verdict always has.
    pub fn has(&self, section: Section) -> bool {
        let own = match section {
            Section::Verdict => true,
            Section::WhereItFails => !self.heat.is_empty(),
            Section::Signals => !self.plots.is_empty(),
            Section::Loops => !self.loops.is_empty(),
            Section::Charts => !self.charts.is_empty(),
            Section::Missing | Section::Quantities => false,
            Section::Ladder => self.ladder.is_some(),
            Section::Provenance => !self.provenance.is_empty(),
        };
        own || self.tables_in(section).next().is_some()
    }
}
