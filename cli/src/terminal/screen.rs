//! Cells, and paragraphs on them.

use std::fmt;

use super::text::{Line, Style};

/// Part of a screen, in cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    /// Column of its left edge.
    pub(crate) x: u16,
    /// Row of its upper edge.
    pub(crate) y: u16,
    /// Columns.
    pub(crate) width: u16,
    /// Rows.
    pub(crate) height: u16,
}

/// Cuts `area` into as many parts below each other as there are heights. Whoever has none gets what the others leave;
/// where that is nothing, the lower ones go without.
pub(crate) fn rows<const N: usize>(area: Rect, heights: [Option<u16>; N]) -> [Rect; N] {
    let taken: u16 = heights
        .iter()
        .flatten()
        .fold(0, |sum, h| sum.saturating_add(*h));
    let free = area.height.saturating_sub(taken);
    let end = area.y + area.height;
    let mut y = area.y;
    heights.map(|height| {
        let height = height.unwrap_or(free).min(end - y);
        let part = Rect { y, height, ..area };
        y += height;
        part
    })
}

/// One character in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) character: char,
    pub(super) style: Style,
}

/// A screen of cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Screen {
    width: u16,
    cells: Vec<Cell>,
}

impl Screen {
    /// An empty one, at least a cell wide.
    pub(crate) fn new(width: u16, height: u16) -> Self {
        let empty = Cell {
            character: ' ',
            style: Style::default(),
        };
        let width = width.max(1);
        Self {
            width,
            cells: vec![empty; usize::from(width) * usize::from(height)],
        }
    }

    /// All of it.
    pub(crate) fn area(&self) -> Rect {
        Rect {
            x: 0,
            y: 0,
            width: self.width,
            height: (self.cells.len() / usize::from(self.width)) as u16,
        }
    }

    pub(super) fn row(&self, y: u16) -> &[Cell] {
        let width = usize::from(self.width);
        &self.cells[usize::from(y) * width..][..width]
    }

    /// Puts a paragraph into a part of it; what has no room is left out.
    pub(crate) fn render(&mut self, paragraph: &Paragraph<'_>, area: Rect) {
        let inside = match &paragraph.block {
            Some(block) => self.frame(block, area),
            None => area,
        };
        for (y, line) in (0..inside.height).zip(&paragraph.lines) {
            let mut x = 0;
            for span in &line.spans {
                for character in span.text.chars() {
                    if x < inside.width {
                        self.put(inside.x + x, inside.y + y, character, span.style);
                    }
                    x = x.saturating_add(1);
                }
            }
        }
    }

    /// Draws the border of a part; what it leaves inside.
    fn frame(&mut self, block: &Block, area: Rect) -> Rect {
        let Rect {
            x,
            y,
            width,
            height,
        } = area;
        if width > 0 && height > 0 {
            let style = Style::default();
            let (right, below) = (x + width - 1, y + height - 1);
            for along in x..=right {
                self.put(along, y, '─', style);
                self.put(along, below, '─', style);
            }
            for down in y..=below {
                self.put(x, down, '│', style);
                self.put(right, down, '│', style);
            }
            for (x, y, corner) in [
                (x, y, '┌'),
                (right, y, '┐'),
                (x, below, '└'),
                (right, below, '┘'),
            ] {
                self.put(x, y, corner, style);
            }
            for (x, character) in (x + 1..right).zip(block.title.chars()) {
                self.put(x, y, character, style);
            }
        }
        Rect {
            x: x + width.min(1),
            y: y + height.min(1),
            width: width.saturating_sub(2),
            height: height.saturating_sub(2),
        }
    }

    /// Writes a character; what would steer the terminal becomes a dot.
    fn put(&mut self, x: u16, y: u16, character: char, style: Style) {
        if x >= self.width {
            return;
        }
        let at = usize::from(y) * usize::from(self.width) + usize::from(x);
        if let Some(cell) = self.cells.get_mut(at) {
            let character = if character.is_control() {
                '·'
            } else {
                character
            };
            *cell = Cell { character, style };
        }
    }
}

impl fmt::Display for Screen {
    /// The characters, row by row.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in self.cells.chunks(usize::from(self.width)) {
            let text: String = row.iter().map(|cell| cell.character).collect();
            writeln!(f, "{text}")?;
        }
        Ok(())
    }
}

/// A border with a title.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    title: &'static str,
}

impl Block {
    /// A border with this title in its upper edge.
    pub(crate) const fn titled(title: &'static str) -> Self {
        Self { title }
    }
}

/// Lines below each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Paragraph<'a> {
    lines: Vec<Line<'a>>,
    block: Option<Block>,
}

impl<'a> Paragraph<'a> {
    /// These lines.
    pub(crate) fn new(lines: Vec<Line<'a>>) -> Self {
        Self { lines, block: None }
    }

    /// With a border around.
    #[must_use]
    pub(crate) fn block(self, block: Block) -> Self {
        Self {
            block: Some(block),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::text::Stylize;
    use super::*;

    #[test]
    fn a_paragraph_stands_in_its_border() {
        let mut screen = Screen::new(12, 5);
        let lines = vec![
            vec!["ab".bold(), "c\x1bd".into()].into(),
            "much too long for it".into(),
            "no room".into(),
        ];
        let paragraph = Paragraph::new(lines).block(Block::titled(" t "));
        let area = Rect {
            x: 1,
            y: 1,
            width: 9,
            height: 4,
        };
        screen.render(&paragraph, area);
        let expected = [
            "            ",
            " ┌ t ────┐  ",
            " │abc·d  │  ",
            " │much to│  ",
            " └───────┘  ",
            "",
        ];
        assert_eq!(screen.to_string(), expected.join("\n"));
        let bold: Vec<bool> = screen.row(2).iter().map(|cell| cell.style.bold).collect();
        assert_eq!(bold.iter().filter(|b| **b).count(), 2);
        assert!(bold[2] && bold[3]);
    }

    #[test]
    fn parts_share_what_there_is() {
        let heights = |height| {
            let area = Rect {
                x: 0,
                y: 3,
                width: 9,
                height,
            };
            let parts = rows(area, [Some(2), Some(4), None, Some(1)]);
            assert!(parts.windows(2).all(|p| p[0].y + p[0].height == p[1].y));
            parts.map(|part| part.height)
        };
        assert_eq!(heights(10), [2, 4, 3, 1]);
        assert_eq!(heights(7), [2, 4, 0, 1]);
        assert_eq!(heights(3), [2, 1, 0, 0]);
        assert_eq!(heights(0), [0, 0, 0, 0]);
    }

    #[test]
    fn nothing_is_drawn_outside() {
        for (width, height) in [(0, 0), (1, 1), (2, 2), (3, 1)] {
            let mut screen = Screen::new(width, height);
            let area = Rect {
                x: 0,
                y: 0,
                width: 40,
                height: 30,
            };
            let paragraph = Paragraph::new(vec!["text".into(); 9]).block(Block::titled("title"));
            screen.render(&paragraph, area);
            assert_eq!(screen.area().height, height);
        }
    }
}
