//! Text with colours.

use std::borrow::Cow;

/// A colour of the terminal's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Color {
    Blue,
    Cyan,
    DarkGray,
    Green,
    Magenta,
    Red,
    White,
    Yellow,
}

impl From<Color> for crossterm::style::Color {
    fn from(colour: Color) -> Self {
        // The darker ones of the sixteen, which every scheme keeps readable.
        match colour {
            Color::Blue => Self::DarkBlue,
            Color::Cyan => Self::DarkCyan,
            Color::DarkGray => Self::DarkGrey,
            Color::Green => Self::DarkGreen,
            Color::Magenta => Self::DarkMagenta,
            Color::Red => Self::DarkRed,
            Color::White => Self::White,
            Color::Yellow => Self::DarkYellow,
        }
    }
}

/// How a character looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Style {
    /// Its colour; the terminal's usual one where there is none.
    pub(crate) colour: Option<Color>,
    /// Whether it is bold.
    pub(crate) bold: bool,
}

/// Some text in one style.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span<'a> {
    /// The text; control characters in it are shown as dots.
    pub(crate) text: Cow<'a, str>,
    /// How it looks.
    pub(crate) style: Style,
}

/// A line of text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Line<'a> {
    /// Its parts, from the left.
    pub(crate) spans: Vec<Span<'a>>,
}

impl<'a> Span<'a> {
    /// Text as it is.
    pub(crate) fn raw(text: impl Into<Cow<'a, str>>) -> Self {
        Self::styled(text, Style::default())
    }

    /// Text in a style.
    pub(crate) fn styled(text: impl Into<Cow<'a, str>>, style: Style) -> Self {
        Self {
            text: text.into(),
            style,
        }
    }
}

impl<'a> From<&'a str> for Span<'a> {
    fn from(text: &'a str) -> Self {
        Self::raw(text)
    }
}

impl From<String> for Span<'_> {
    fn from(text: String) -> Self {
        Self::raw(text)
    }
}

impl<'a> From<Vec<Span<'a>>> for Line<'a> {
    fn from(spans: Vec<Span<'a>>) -> Self {
        Self { spans }
    }
}

impl<'a> From<&'a str> for Line<'a> {
    fn from(text: &'a str) -> Self {
        vec![text.into()].into()
    }
}

impl From<String> for Line<'_> {
    fn from(text: String) -> Self {
        vec![text.into()].into()
    }
}

/// What can be given a style.
pub(crate) trait Stylize: Sized {
    /// What it is then.
    type Styled;

    /// With its style changed.
    fn change(self, change: impl Fn(&mut Style)) -> Self::Styled;

    /// In this colour.
    fn fg(self, colour: Color) -> Self::Styled {
        self.change(|style| style.colour = Some(colour))
    }

    /// In bold.
    fn bold(self) -> Self::Styled {
        self.change(|style| style.bold = true)
    }

    /// In cyan.
    fn cyan(self) -> Self::Styled {
        self.fg(Color::Cyan)
    }

    /// In dark grey.
    fn dark_gray(self) -> Self::Styled {
        self.fg(Color::DarkGray)
    }

    /// In green.
    fn green(self) -> Self::Styled {
        self.fg(Color::Green)
    }

    /// In red.
    fn red(self) -> Self::Styled {
        self.fg(Color::Red)
    }

    /// In yellow.
    fn yellow(self) -> Self::Styled {
        self.fg(Color::Yellow)
    }
}

impl Stylize for Style {
    type Styled = Self;

    fn change(mut self, change: impl Fn(&mut Style)) -> Self {
        change(&mut self);
        self
    }
}

impl<'a> Stylize for Span<'a> {
    type Styled = Self;

    fn change(mut self, change: impl Fn(&mut Style)) -> Self {
        change(&mut self.style);
        self
    }
}

impl<'a> Stylize for &'a str {
    type Styled = Span<'a>;

    fn change(self, change: impl Fn(&mut Style)) -> Span<'a> {
        Span::from(self).change(change)
    }
}

impl Stylize for String {
    type Styled = Span<'static>;

    fn change(self, change: impl Fn(&mut Style)) -> Span<'static> {
        Span::from(self).change(change)
    }
}

impl<'a> Stylize for Line<'a> {
    type Styled = Self;

    fn change(mut self, change: impl Fn(&mut Style)) -> Self {
        self.spans
            .iter_mut()
            .for_each(|span| change(&mut span.style));
        self
    }
}
