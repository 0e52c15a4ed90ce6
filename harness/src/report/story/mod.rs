//! From an answer to its page: which number goes where, in which unit, and in which words.
//!
//! The page itself knows no physics, and the answers know no layout; only these files know both. Every number leaves with its
//! unit, next to what it is measured against (its noise floor, its uncertainty), and with at most four significant digits.
//!
//! | file | what it tells |
//! |---|---|
//! | `diagnosis` | verdict, title, order of everything |
//! | `maps` | phase × channel, before and after |
//! | `signals` | curves over time, force over penetration |
//! | `missing` | what was found, what ties, how it was ranked, what could not be seen |
//! | `quantities` | scores, base values, scatter, recordings |
//! | `ladder` | the error ladder, also as a page of its own |
//! | `comparison` | the page of a comparison: limits, blocks, quantities |
//! | `compared` | curves of a comparison |
//! | `stability`, `stability_space` | the pages of `dockhil stability` |
//! | `measurements` | the page of two measurements |
//! | `words` | numbers, units and names as text |

mod compared;
mod comparison;
mod diagnosis;
mod ladder;
mod maps;
mod measurements;
mod missing;
mod quantities;
mod signals;
mod stability;
mod stability_space;
mod table;
pub mod words;

pub use comparison::comparison;
pub use diagnosis::diagnosis;
pub use ladder::ladder_page;
pub use measurements::measurements;
pub use stability::stability_page;
pub use stability_space::stability_space_page;
