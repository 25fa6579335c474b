//! The list of wires.

use serde::{Deserialize, Serialize};

/// How a board's messages are written on its serial line.
///
/// ```
/// use rowtone::wire::Format;
/// assert_eq!(Format::named("modbus"), Some(Format::Modbus));
/// for format in Format::ALL {
///     assert_eq!(Format::named(format.name()), Some(format));
///     assert_eq!(Format::of_register(format.register()), Some(format));
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// [`crate::wire::text`]
    Text,
    /// [`crate::wire::binary`]
    Binary,
    /// [`crate::wire::modbus`]
    Modbus,
}

impl Format {
    /// All that there are, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Text, Self::Binary, Self::Modbus];

    /// What settings and configuration files call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Binary => "binary",
            Self::Modbus => "modbus",
        }
    }

    /// The wire of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Its number in a Modbus register and in saved settings.
    pub const fn register(self) -> u16 {
        self as u16
    }

    /// The wire of this number.
    pub fn of_register(number: u16) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// Whether this build speaks it (features `binary` and `modbus`).
    pub(crate) const fn is_built_in(self) -> bool {
        match self {
            Self::Text => true,
            Self::Binary => cfg!(feature = "binary"),
            Self::Modbus => cfg!(feature = "modbus"),
        }
    }
}
