//! Which sensor mode the user wants.

use std::str::FromStr;

/// The mode that the user wants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wish {
    /// The best one.
    #[default]
    Auto,
    /// This size.
    Size {
        /// Columns.
        width: u16,
        /// Rows.
        height: u16,
    },
}

impl FromStr for Wish {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let (width, height) = text.split_once('x').unwrap_or_default();
        match (width.parse(), height.parse()) {
            (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok(Self::Size { width, height }),
            _ => Err(format!("mode {text:?}: give auto, or a size as 1332x990")),
        }
    }
}
