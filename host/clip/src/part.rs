//! Parts of the picture, and turning it.

use std::str::FromStr;

/// A rectangle of the picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
}

impl Rect {
    /// The whole of a picture.
    pub const fn whole(width: usize, height: usize) -> Self {
        Self {
            x: 0,
            y: 0,
            width,
            height,
        }
    }

    /// All of it lies inside a picture of this size.
    pub fn fits(&self, width: usize, height: usize) -> bool {
        let inside = |from: usize, count: usize, all: usize| {
            from.checked_add(count).is_some_and(|e| e <= all)
        };
        inside(self.x, self.width, width) && inside(self.y, self.height, height)
    }

    /// The largest rectangle of a picture of this size that is left, right, above or below of this
    /// one, which must fit. `None` when nothing is left.
    pub fn largest_beside(&self, width: usize, height: usize) -> Option<Self> {
        let (right, below) = (self.x + self.width, self.y + self.height);
        let beside = |x, y, width, height| Self {
            x,
            y,
            width,
            height,
        };
        [
            beside(0, 0, self.x, height),
            beside(right, 0, width - right, height),
            beside(0, 0, width, self.y),
            beside(0, below, width, height - below),
        ]
        .into_iter()
        .filter(|part| part.width > 0 && part.height > 0)
        .max_by_key(|part| part.width * part.height)
    }
}

impl FromStr for Rect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "want X,Y,W,H in pixels, W and H at least 1".to_owned();
        let numbers: Vec<usize> = text
            .split(',')
            .map(|part| part.trim().parse().map_err(|_| wrong()))
            .collect::<Result<_, _>>()?;
        match numbers[..] {
            [x, y, width, height] if width > 0 && height > 0 => Ok(Self {
                x,
                y,
                width,
                height,
            }),
            _ => Err(wrong()),
        }
    }
}

/// Which part of the picture to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Roi {
    /// What the program finds best.
    #[default]
    Auto,
    /// The whole picture.
    Full,
    /// This part.
    Part(Rect),
}

impl FromStr for Roi {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "full" => Ok(Self::Full),
            part => part.parse().map(Self::Part),
        }
    }
}

/// By how much to turn the picture clockwise before anything else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Turn {
    /// As it is.
    #[default]
    No,
    /// 90 degrees: what was the left column becomes the top row.
    Quarter,
    /// 180 degrees.
    Half,
    /// 270 degrees: what was the right column becomes the top row.
    ThreeQuarters,
}

impl FromStr for Turn {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "0" => Ok(Self::No),
            "90" => Ok(Self::Quarter),
            "180" => Ok(Self::Half),
            "270" | "-90" => Ok(Self::ThreeQuarters),
            _ => Err("want 0, 90, 180 or 270 (degrees clockwise)".to_owned()),
        }
    }
}

impl Turn {
    /// This, and 180 degrees more.
    pub const fn upside_down(self) -> Self {
        match self {
            Self::No => Self::Half,
            Self::Quarter => Self::ThreeQuarters,
            Self::Half => Self::No,
            Self::ThreeQuarters => Self::Quarter,
        }
    }

    /// What undoes it.
    pub const fn back(self) -> Self {
        match self {
            Self::Quarter => Self::ThreeQuarters,
            Self::ThreeQuarters => Self::Quarter,
            same => same,
        }
    }

    /// Width and height after turning.
    pub const fn size(self, width: usize, height: usize) -> (usize, usize) {
        match self {
            Self::No | Self::Half => (width, height),
            Self::Quarter | Self::ThreeQuarters => (height, width),
        }
    }

    /// Where a part of a picture of `width` x `height` is after turning. The part must fit.
    pub const fn part(self, part: Rect, width: usize, height: usize) -> Rect {
        let right = width - (part.x + part.width);
        let below = height - (part.y + part.height);
        let (x, y) = match self {
            Self::No => (part.x, part.y),
            Self::Quarter => (below, part.x),
            Self::Half => (right, below),
            Self::ThreeQuarters => (part.y, right),
        };
        let (width, height) = self.size(part.width, part.height);
        Rect {
            x,
            y,
            width,
            height,
        }
    }

    /// Turns a plane of `width` x `height` values into `to`, which gets as many.
    pub fn plane<T: Copy>(self, from: &[T], width: usize, height: usize, to: &mut Vec<T>) {
        to.clear();
        let columns = |x: usize| from.iter().skip(x).step_by(width).take(height);
        match self {
            Self::No => to.extend_from_slice(from),
            Self::Quarter => (0..width).for_each(|x| to.extend(columns(x).rev())),
            Self::Half => to.extend(from.iter().rev()),
            Self::ThreeQuarters => (0..width).rev().for_each(|x| to.extend(columns(x))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_and_refused() {
        assert_eq!(
            "1,2,3,4".parse(),
            Ok(Rect {
                x: 1,
                y: 2,
                width: 3,
                height: 4
            })
        );
        for wrong in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "-1,2,3,4", "a,b,c,d"] {
            assert!(wrong.parse::<Rect>().is_err(), "{wrong}");
        }
        assert_eq!("auto".parse(), Ok(Roi::Auto));
        assert_eq!("full".parse(), Ok(Roi::Full));
    }

    #[test]
    fn a_part_beyond_the_edge_does_not_fit() {
        let part = |x, y, width, height| Rect {
            x,
            y,
            width,
            height,
        };
        assert!(part(2, 1, 3, 2).fits(5, 3));
        assert!(!part(3, 1, 3, 2).fits(5, 3));
        assert!(!part(0, 2, 3, 2).fits(5, 3));
        assert!(!part(usize::MAX, 0, 3, 2).fits(5, 3));
    }

    #[test]
    fn what_is_left_beside_a_part() {
        let part: Rect = "0,0,48,240".parse().unwrap();
        assert_eq!(part.largest_beside(160, 240), "48,0,112,240".parse().ok());
        assert_eq!(part.largest_beside(48, 240), None);
    }

    #[test]
    fn turning_a_plane_and_a_part_agree() {
        // 3 x 2: abc / def
        let plane: Vec<char> = "abcdef".chars().collect();
        let part = Rect {
            x: 1,
            y: 0,
            width: 2,
            height: 1,
        }; // bc
        for (turn, turned, cut) in [
            (Turn::No, "abcdef", "bc"),
            (Turn::Quarter, "daebfc", "bc"),
            (Turn::Half, "fedcba", "cb"),
            (Turn::ThreeQuarters, "cfbead", "cb"),
        ] {
            let mut to = Vec::new();
            turn.plane(&plane, 3, 2, &mut to);
            assert_eq!(to.iter().collect::<String>(), turned);
            let (width, height) = turn.size(3, 2);
            assert_eq!(turn.back().part(turn.part(part, 3, 2), width, height), part);
            let Rect {
                x,
                y,
                width: w,
                height: h,
            } = turn.part(part, 3, 2);
            let got: String = (y..y + h)
                .flat_map(|row| to[row * width + x..][..w].iter())
                .collect();
            assert_eq!(got, cut, "{turn:?}");
        }
    }
}
