//! Names of the spool's files: `BOARD.FIRST.spool`, with the number of the first record.

/// Digits of the number in a name.
const DIGITS: usize = 16;
/// Numbers in names end here, so that those that follow have no more digits either.
const MOST: u64 = 1_000_000_000_000_000;

/// The name of a file; whatever is no letter, digit, hyphen or underline stands as `%` and two
/// hexadecimal digits.
pub(super) fn of(board: &str, first: u64) -> String {
    let mut name = String::new();
    for byte in board.bytes() {
        if byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_') {
            name.push(char::from(byte));
        } else {
            name += &format!("%{byte:02X}");
        }
    }
    format!("{name}.{first:0DIGITS$}.spool")
}

/// Board and number of a name that [`of`] could have made; none for any other.
pub(super) fn parse(name: &str) -> Option<(String, u64)> {
    let (board, number) = name.strip_suffix(".spool")?.split_once('.')?;
    let first = number
        .parse()
        .ok()
        .filter(|first| (1..MOST).contains(first))?;
    let mut bytes = vec![];
    let mut rest = board.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            byte => byte,
        });
    }
    let board = String::from_utf8(bytes).ok()?;
    (!board.is_empty() && of(&board, first) == name).then_some((board, first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_our_own() {
        for stray in [
            "7.spool",
            "+5.spool",
            "b0.+000000000000005.spool",
            "b0.18446744073709551615.spool",
            "b0.9999999999999999.spool",
            "b0.0000000000000000.spool",
            ".0000000000000001.spool",
            "b 0.0000000000000001.spool",
            "b%30.0000000000000001.spool",
            "000000000001.spool",
            "state.0",
        ] {
            assert_eq!(parse(stray), None, "{stray}");
        }
    }

    proptest! {
        /// A name is one of a single file of the directory, and comes back.
        #[test]
        fn there_and_back(board in "[^\0]{1,64}", first in 1..MOST) {
            let name = of(&board, first);
            prop_assert!(!name.contains(['/', '\\', '\n']) && !name.starts_with('.'));
            prop_assert_eq!(parse(&name), Some((board, first)));
        }

        #[test]
        fn any_name(name in ".{0,40}") {
            if let Some((board, first)) = parse(&name) {
                prop_assert_eq!(of(&board, first), name);
            }
        }
    }
}
