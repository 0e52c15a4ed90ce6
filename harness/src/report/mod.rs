//! The report: one view model, told twice, as an HTML page that needs no network and as plain text for a terminal.
//!
//! [`Page`] knows nothing of physics or of diagnosis: it holds sentences, numbers and labels with units, in the order
//! in which they are read. Whoever has a result fills a page; [`html`] and [`text`] only draw it. The same page gives
//! the same bytes.
//!
//! | section | what it shows | HTML | text |
//! |---|---|---|---|
//! | verdict | the answer, its reasons, the command that repeats it | yes | last line |
//! | where it fails | residual over noise, channel by phase | coloured table | table |
//! | signals | measured, model, residual, band | uPlot, and SVG without JavaScript | no |
//! | force over penetration | loops | SVG | no |
//! | where it is stable | domain of two parameters, operating point | SVG | no |
//! | what is missing | ranking, ties, deciding experiment | tables | tables |
//! | ladder | error per model with the noise floor | SVG | bars |
//! | quantities | quantities of interest, parameters, sessions | tables | tables |
//! | provenance | hashes, versions, seeds | list | list |

mod axis;
mod chart;
mod decimate;
mod heat;
mod ladder;
mod live;
mod loops;
mod pack;
mod page;
mod render;
mod still;
pub mod story;
mod text;
mod wrap;

pub use page::{
    Band, Chart, Column, Curve, Heat, HeatRow, Ladder, LadderChannel, LadderStep, Page, Panel, PlotGroup, Role, Row,
    Section, Table, Tone, XyCurve, XyPlot,
};
pub use render::{html, uplot_sha256};
pub use text::text;

/// Columns of a text report: what fits a terminal of a hundred.
pub const TEXT_WIDTH: usize = 100;
