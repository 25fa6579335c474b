//! What `run.sh` asks for: `KEY=VALUE` words, the clip's path last.
//!
//! Whole numbers only, in units small enough for it: the script converts, the firmware stays small.

/// The firmware's command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Args<'a> {
    /// Time from one row to the next, ps.
    pub line_time_ps: u32,
    /// Exposure of a row, ns.
    pub exposure_ns: u32,
    /// Frame rate, µHz; the clip's own without it.
    pub fps_uhz: Option<u64>,
    /// Length of a report's window, ms.
    pub window_ms: u32,
    /// Instructions are counted (QEMU runs with `-icount shift=7`).
    pub icount: bool,
    /// Motion is measured along rows and columns.
    pub both_axes: bool,
    /// Path of the clip on the host: everything after `clip=`, spaces too.
    pub clip: &'a str,
}

/// Why a command line was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArgsError<'a> {
    /// Not one of the known words.
    Unknown(&'a str),
    /// A value that is no whole number in range.
    Value(&'a str),
    /// A needed word is missing.
    Missing(&'static str),
}

impl core::fmt::Display for ArgsError<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unknown(word) => write!(f, "command line: unknown word '{word}'"),
            Self::Value(word) => write!(f, "command line: '{word}' is no whole number in range"),
            Self::Missing(word) => write!(f, "command line: {word} is missing"),
        }
    }
}

impl<'a> Args<'a> {
    /// Parse the whole command line; its first word is the program's name.
    ///
    /// # Errors
    /// The first word that is wrong, or missing.
    pub fn parse(line: &'a str) -> Result<Self, ArgsError<'a>> {
        let (words, clip) = line
            .split_once("clip=")
            .ok_or(ArgsError::Missing("clip="))?;
        let mut line_time_ps = None;
        let mut args = Self {
            line_time_ps: 0,
            exposure_ns: 0,
            fps_uhz: None,
            window_ms: 1000,
            icount: false,
            both_axes: false,
            clip: clip.trim_end(),
        };
        for word in words.split_ascii_whitespace().skip(1) {
            let (key, value) = word.split_once('=').ok_or(ArgsError::Unknown(word))?;
            let number: u64 = value.parse().map_err(|_| ArgsError::Value(word))?;
            let small = u32::try_from(number).map_err(|_| ArgsError::Value(word));
            match key {
                "line_time_ps" => line_time_ps = Some(small?),
                "exposure_ns" => args.exposure_ns = small?,
                "fps_uhz" if number > 0 => args.fps_uhz = Some(number),
                "window_ms" if number > 0 => args.window_ms = small?,
                "axes" if (1..=2).contains(&number) => args.both_axes = number == 2,
                "axes" | "fps_uhz" | "window_ms" => return Err(ArgsError::Value(word)),
                "icount" => args.icount = number != 0,
                _ => return Err(ArgsError::Unknown(word)),
            }
        }
        args.line_time_ps = line_time_ps.ok_or(ArgsError::Missing("line_time_ps="))?;
        Ok(args)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_command_line() {
        let line = "fw line_time_ps=40000000 exposure_ns=500000 fps_uhz=59940060 icount=1 axes=2 clip=/a b/motor.y4m";
        let args = Args::parse(line).unwrap();
        assert_eq!(args.line_time_ps, 40_000_000);
        assert_eq!(args.fps_uhz, Some(59_940_060));
        assert_eq!((args.window_ms, args.icount), (1000, true));
        assert!(args.both_axes);
        assert_eq!(args.clip, "/a b/motor.y4m");
    }

    #[test]
    fn wrong_words_are_named() {
        assert_eq!(Args::parse("fw"), Err(ArgsError::Missing("clip=")));
        assert_eq!(
            Args::parse("fw clip=a"),
            Err(ArgsError::Missing("line_time_ps="))
        );
        assert_eq!(Args::parse("fw x=1 clip=a"), Err(ArgsError::Unknown("x=1")));
        assert_eq!(
            Args::parse("fw window_ms=0 clip=a"),
            Err(ArgsError::Value("window_ms=0"))
        );
        assert_eq!(
            Args::parse("fw axes=3 clip=a"),
            Err(ArgsError::Value("axes=3"))
        );
        assert_eq!(
            Args::parse("fw line_time_ps=5000000000 clip=a"),
            Err(ArgsError::Value("line_time_ps=5000000000"))
        );
    }
}
