//! How a picture is cut into tiles.

use core::fmt;

/// Smallest and largest side of a tile, px: what is smaller has hardly a slope of its own, what is larger is no place.
pub const MIN_TILE: u16 = 4;
/// See [`MIN_TILE`].
pub const MAX_TILE: u16 = 256;

/// Square tiles that cover a picture from its upper left corner on; one that would be cut off at the right or lower edge is
/// left out.
///
/// ```
/// use rowtone::shape::Grid;
/// let grid = Grid::new(640, 360, 16)?;
/// assert_eq!((grid.columns(), grid.rows(), grid.tiles()), (40, 22, 880));
/// # Ok::<(), rowtone::shape::GridError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    width: u16,
    height: u16,
    tile: u16,
}

impl Grid {
    /// Tiles of `tile` px, from [`MIN_TILE`] to [`MAX_TILE`], on a picture of this size, px.
    ///
    /// # Errors
    /// [`GridError`] for tiles of another size, and for a picture that holds none.
    pub const fn new(width: u16, height: u16, tile: u16) -> Result<Self, GridError> {
        if tile < MIN_TILE || tile > MAX_TILE {
            return Err(GridError::Tile(tile));
        }
        if width < tile || height < tile {
            return Err(GridError::Picture {
                width,
                height,
                tile,
            });
        }
        Ok(Self {
            width,
            height,
            tile,
        })
    }

    /// Side of a tile, px.
    pub const fn tile_px(&self) -> usize {
        self.tile as usize
    }

    /// Width of the picture, px.
    pub const fn width(&self) -> usize {
        self.width as usize
    }

    /// Height of the picture, px.
    pub const fn height(&self) -> usize {
        self.height as usize
    }

    /// Tiles side by side.
    pub const fn columns(&self) -> usize {
        (self.width / self.tile) as usize
    }

    /// Tiles one above the other.
    pub const fn rows(&self) -> usize {
        (self.height / self.tile) as usize
    }

    /// Tiles in all. They are numbered row by row.
    pub const fn tiles(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Columns of pixels that belong to a tile.
    pub const fn covered_columns(&self) -> usize {
        self.columns() * self.tile as usize
    }

    /// Rows of pixels that belong to a tile.
    pub const fn covered_rows(&self) -> usize {
        self.rows() * self.tile as usize
    }

    /// Pixels that belong to a tile.
    pub const fn covered(&self) -> usize {
        self.covered_columns() * self.covered_rows()
    }

    /// Rows of pixels of all tiles, each counted for itself: what stands in one row of one tile.
    pub const fn segments(&self) -> usize {
        self.columns() * self.covered_rows()
    }
}

/// Why a [`Grid`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridError {
    /// No tile has this side, px.
    Tile(u16),
    /// The picture is smaller than a tile.
    Picture {
        /// Its width, px.
        width: u16,
        /// Its height, px.
        height: u16,
        /// Side of a tile, px.
        tile: u16,
    },
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tile(tile) => write!(f, "a tile of {tile} px: want {MIN_TILE} to {MAX_TILE}"),
            Self::Picture {
                width,
                height,
                tile,
            } => write!(
                f,
                "the picture of {width}x{height} px does not hold a tile of {tile} px"
            ),
        }
    }
}

impl core::error::Error for GridError {}
