//! What is wrong with a file or a request, where, and what to do next.
//!
//! A bad file is an [`Error`] and ends the command with exit code 2. A failed check is a verdict and a broken invariant
//! is a panic: the three never mix.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

/// A bad file or a bad request. It prints as `file: place: what`; the help stands beside it.
#[derive(Debug, Clone, thiserror::Error)]
pub struct Error {
    /// The file, as the user gave it.
    pub file: Option<PathBuf>,
    /// Where in the file: a byte, a line, a topic and a time.
    pub place: Option<String>,
    /// What is wrong: a lowercase fragment with value, limit and unit.
    pub what: String,
    /// What to do, or to type, next.
    pub help: Option<String>,
    /// The text that holds the mistake, when the file is one that the user writes. Boxed, so that a result stays small.
    pub source_text: Option<Box<SourceText>>,
}

/// A text and the part of it that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceText {
    /// The whole text.
    pub text: String,
    /// The wrong part, in bytes.
    pub span: Range<usize>,
}

impl Error {
    /// Starts from what is wrong.
    pub fn new(what: impl Into<String>) -> Self {
        Self { file: None, place: None, what: what.into(), help: None, source_text: None }
    }

    /// Adds the file, unless one is named already: the innermost knows best.
    #[must_use]
    pub fn file(mut self, file: impl Into<PathBuf>) -> Self {
        self.file.get_or_insert_with(|| file.into());
        self
    }

    /// Adds the place, unless one is named already.
    #[must_use]
    pub fn place(mut self, place: impl Into<String>) -> Self {
        self.place.get_or_insert_with(|| place.into());
        self
    }

    /// Adds what to do next, unless it is said already.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.get_or_insert_with(|| help.into());
        self
    }

    /// Adds the text that holds the mistake. The span is cut to the text, and the place becomes its line if none is named.
    #[must_use]
    pub fn span(mut self, text: &str, span: Range<usize>) -> Self {
        let start = floor_char_boundary(text, span.start);
        let end = floor_char_boundary(text, span.end.max(span.start));
        let line = text.get(..start).unwrap_or_default().matches('\n').count() + 1;
        self.source_text = Some(Box::new(SourceText { text: text.to_owned(), span: start..end }));
        self.place(format!("line {line}"))
    }
}

fn floor_char_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}: ", file.display())?;
        }
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.what)
    }
}

impl miette::Diagnostic for Error {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.source_text.as_ref().map(|source| &source.text as &dyn miette::SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = miette::LabeledSpan> + '_>> {
        let source = self.source_text.as_ref()?;
        let label = miette::LabeledSpan::new_with_span(Some("here".to_owned()), source.span.clone());
        Some(Box::new(std::iter::once(label)))
    }
}

#[cfg(test)]
mod tests {
    use super::Error;

    #[test]
    fn a_mistake_in_a_text_is_shown_at_its_place() {
        let error = Error::new("friction = 31 N is outside [0, 20]")
            .file("m.toml")
            .help("choose less")
            .span("a = 1\nfriction = 31\n", 6..14);
        assert_eq!(error.to_string(), "m.toml: line 2: friction = 31 N is outside [0, 20]");
        let mut shown = String::new();
        let theme = miette::GraphicalTheme::unicode_nocolor();
        miette::GraphicalReportHandler::new_themed(theme).render_report(&mut shown, &error).unwrap();
        assert!(
            shown.contains("friction = 31\n") && shown.contains("── here") && shown.contains("help: choose less"),
            "{shown}"
        );
    }

    #[test]
    fn a_span_beyond_the_text_or_inside_a_letter_is_cut() {
        let error = Error::new("x").span("é", 1..99);
        assert_eq!(error.source_text.unwrap().span, 0..2);
    }
}
