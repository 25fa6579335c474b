//! The fields between `$` and `*`, one after the other.

use super::DecodeError;
use crate::wire::decimal;

/// Takes fields off the front of a text.
pub(super) struct Fields<'a> {
    rest: Option<&'a str>,
    separator: char,
}

impl<'a> Fields<'a> {
    pub(super) fn new(text: &'a str, separator: char) -> Self {
        Self {
            rest: Some(text),
            separator,
        }
    }

    /// The next field as it stands.
    pub(super) fn text(&mut self, name: &'static str) -> Result<&'a str, DecodeError> {
        let rest = self.rest.ok_or(DecodeError::Field(name))?;
        let (field, rest) = match rest.split_once(self.separator) {
            Some((field, rest)) => (field, Some(rest)),
            None => (rest, None),
        };
        self.rest = rest;
        Ok(field)
    }

    /// All that is left, separators included.
    pub(super) fn remainder(&mut self, name: &'static str) -> Result<&'a str, DecodeError> {
        self.rest.take().ok_or(DecodeError::Field(name))
    }

    /// A whole number without sign or leading zeros.
    pub(super) fn integer<T: TryFrom<u64>>(
        &mut self,
        name: &'static str,
    ) -> Result<T, DecodeError> {
        integer(self.text(name)?).ok_or(DecodeError::Field(name))
    }

    /// A real with exactly so many decimals.
    pub(super) fn real(&mut self, name: &'static str, decimals: u32) -> Result<f32, DecodeError> {
        decimal::parse(self.text(name)?, decimals).ok_or(DecodeError::Field(name))
    }

    /// A real, or nothing.
    pub(super) fn optional_real(
        &mut self,
        name: &'static str,
        decimals: u32,
    ) -> Result<Option<f32>, DecodeError> {
        match self.text(name)? {
            "" => Ok(None),
            field => decimal::parse(field, decimals)
                .map(Some)
                .ok_or(DecodeError::Field(name)),
        }
    }

    /// Fails where fields are left.
    pub(super) fn end(self) -> Result<(), DecodeError> {
        match self.rest {
            None => Ok(()),
            Some(_) => Err(DecodeError::Field("end")),
        }
    }
}

/// A whole number as [`core::fmt::Display`] writes it, nothing else.
pub(super) fn integer<T: TryFrom<u64>>(field: &str) -> Option<T> {
    let canonical = field == "0" || field.starts_with(|c: char| matches!(c, '1'..='9'));
    let value: u64 = if canonical {
        field.parse().ok()?
    } else {
        return None;
    };
    T::try_from(value).ok()
}

/// Upper-case hexadecimal of exactly `digits` digits.
pub(super) fn hexadecimal(field: &str, digits: usize) -> Option<u32> {
    if field.len() != digits {
        return None;
    }
    field.bytes().try_fold(0_u32, |value, byte| {
        let digit = match byte {
            b'0'..=b'9' => byte - b'0',
            b'A'..=b'F' => byte - b'A' + 10,
            _ => return None,
        };
        Some(value << 4 | u32::from(digit))
    })
}
