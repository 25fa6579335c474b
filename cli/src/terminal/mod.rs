//! A screen of text for a live view: what is drawn, and the terminal that shows it.
//!
//! A view is drawn anew each time, on a [`Screen`] of cells; the [`Terminal`] writes the rows that have changed. It is
//! little beside a library for such views: no window, no input fields, characters one cell wide.

mod screen;
mod text;

use std::io::{self, Stdout, Write};
use std::sync::Once;

use crossterm::style::{Attribute, Print, ResetColor, SetAttribute, SetForegroundColor};
use crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use crossterm::{cursor, execute, queue};

pub(crate) use screen::{Block, Paragraph, Rect, Screen, rows};
pub(crate) use text::{Color, Line, Span, Style, Stylize};

/// The terminal of the process, taken for a live view until this is dropped.
#[derive(Debug)]
pub(crate) struct Terminal {
    to: Stdout,
    /// What it shows; `None` where that is not known.
    shown: Option<Screen>,
}

impl Terminal {
    /// Takes it: an empty screen beside what was there, keys as they are pressed. A panic gives it back first.
    ///
    /// # Errors
    /// What the operating system says.
    pub(crate) fn take() -> io::Result<Self> {
        static HOOK: Once = Once::new();
        HOOK.call_once(|| {
            let usual = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |panic| {
                give_back();
                usual(panic);
            }));
        });
        let mut terminal = Self {
            to: io::stdout(),
            shown: None,
        };
        terminal.enter()?;
        Ok(terminal)
    }

    fn enter(&mut self) -> io::Result<()> {
        enable_raw_mode()?;
        self.shown = None;
        execute!(self.to, EnterAlternateScreen, cursor::Hide)
    }

    /// Gives it back for as long as `meanwhile` takes.
    ///
    /// # Errors
    /// What the operating system says when it is to be taken again.
    pub(crate) fn without(&mut self, meanwhile: impl FnOnce()) -> io::Result<()> {
        give_back();
        meanwhile();
        self.enter()
    }

    /// Shows what `draw` draws.
    ///
    /// # Errors
    /// What writing to the terminal says.
    pub(crate) fn draw(&mut self, draw: impl FnOnce(&mut Screen)) -> io::Result<()> {
        let (width, height) = crossterm::terminal::size()?;
        let mut screen = Screen::new(width, height);
        draw(&mut screen);
        let shown = self
            .shown
            .take()
            .filter(|shown| shown.area() == screen.area());
        if shown.is_none() {
            queue!(self.to, ResetColor, Clear(ClearType::All))?;
        }
        for y in 0..height {
            if shown
                .as_ref()
                .is_none_or(|shown| shown.row(y) != screen.row(y))
            {
                queue!(self.to, cursor::MoveTo(0, y))?;
                self.write_row(&screen, y)?;
            }
        }
        self.to.flush()?;
        self.shown = Some(screen);
        Ok(())
    }

    fn write_row(&mut self, screen: &Screen, y: u16) -> io::Result<()> {
        for run in screen.row(y).chunk_by(|a, b| a.style == b.style) {
            let style = run[0].style;
            queue!(self.to, SetAttribute(Attribute::Reset))?;
            if style.bold {
                queue!(self.to, SetAttribute(Attribute::Bold))?;
            }
            if let Some(colour) = style.colour {
                queue!(self.to, SetForegroundColor(colour.into()))?;
            }
            let text: String = run.iter().map(|cell| cell.character).collect();
            queue!(self.to, Print(text))?;
        }
        queue!(self.to, SetAttribute(Attribute::Reset))
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        give_back();
    }
}

/// Leaves the screen as it was before; nothing can be done where that fails.
fn give_back() {
    let _ = disable_raw_mode();
    let _ = execute!(io::stdout(), ResetColor, LeaveAlternateScreen, cursor::Show);
}
