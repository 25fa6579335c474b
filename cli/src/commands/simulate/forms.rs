//! How tones, steps and the like are written on the command line: numbers between colons.

use host_sim::{Chirp, Flicker, Hand, Led, RateChange, Rect, Step, Tone};

/// Numbers between `separator`s: at least `N - optional.len()` of them, the rest as in `optional`.
fn numbers<const N: usize>(
    text: &str,
    separator: char,
    form: &str,
    optional: &[f64],
) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    let least = N - optional.len();
    out[least..].copy_from_slice(optional);
    let mut count = 0;
    for part in text.split(separator) {
        let value = part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let place = out.get_mut(count).ok_or_else(|| format!("want {form}"))?;
        *place = value.ok_or_else(|| format!("want {form}; '{part}' is not a number"))?;
        count += 1;
    }
    if count < least {
        Err(format!("want {form}"))
    } else {
        Ok(out)
    }
}

pub(super) fn tone(text: &str) -> Result<Tone, String> {
    let [hz, amplitude_px, phase_rad] = numbers(text, ':', "HZ:PX or HZ:PX:RAD", &[0.0])?;
    Ok(Tone {
        hz,
        amplitude_px,
        phase_rad,
    })
}

pub(super) fn chirp(text: &str) -> Result<Chirp, String> {
    let form = "FROM_HZ:TO_HZ:SECONDS:PX, or with :START_S at the end";
    let [from_hz, to_hz, duration_s, amplitude_px, start_s] = numbers(text, ':', form, &[0.0])?;
    Ok(Chirp {
        from_hz,
        to_hz,
        start_s,
        duration_s,
        amplitude_px,
    })
}

pub(super) fn step(text: &str) -> Result<Step, String> {
    let [t_s, value] = numbers(text, ':', "SECONDS:VALUE", &[])?;
    Ok(Step { t_s, value })
}

pub(super) fn rate(text: &str) -> Result<RateChange, String> {
    let [t_s, fps] = numbers(text, ':', "SECONDS:FPS", &[])?;
    Ok(RateChange { t_s, fps })
}

pub(super) fn flicker(text: &str) -> Result<Flicker, String> {
    let [depth, hz, phase_rad] = numbers(text, ':', "DEPTH:HZ or DEPTH:HZ:RAD", &[0.0])?;
    Ok(Flicker {
        depth,
        hz,
        phase_rad,
    })
}

pub(super) fn led(text: &str) -> Result<Led, String> {
    let form = "HZ, HZ:DUTY, HZ:DUTY:OFF_LEVEL or HZ:DUTY:OFF_LEVEL:PHASE (in periods)";
    let [hz, duty, off_level, phase] = numbers(text, ':', form, &[0.5, 0.0, 0.0])?;
    Ok(Led {
        hz,
        duty,
        phase,
        off_level,
        missing: 0.0,
    })
}

pub(super) fn gradient(text: &str) -> Result<Gradient, String> {
    numbers(text, ':', "ACROSS or ACROSS:DOWN", &[0.0]).map(Gradient)
}

/// How the light changes across and down the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gradient(pub(super) [f64; 2]);

pub(super) fn late(text: &str) -> Result<(f64, f64), String> {
    let [share, us] = numbers(text, ':', "SHARE:MICROSECONDS", &[])?;
    Ok((share, us))
}

pub(super) fn hand(text: &str) -> Result<Hand, String> {
    let [start_s, duration_s, width_px, level] = numbers(
        text,
        ':',
        "START_S:SECONDS:WIDTH_PX or START_S:SECONDS:WIDTH_PX:LEVEL",
        &[0.12],
    )?;
    Ok(Hand {
        start_s,
        duration_s,
        width_px,
        level,
    })
}

pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let form = "want WxH, for example 640x480";
    let (w, h) = text.split_once('x').ok_or(form)?;
    match (w.parse(), h.parse()) {
        (Ok(w), Ok(h)) => Ok((w, h)),
        _ => Err(form.into()),
    }
}

pub(super) fn rect(text: &str) -> Result<Rect, String> {
    let parts: Result<Vec<u32>, _> = text.split(',').map(|p| p.trim().parse()).collect();
    match parts.as_deref() {
        Ok(&[x, y, w, h]) => Ok(Rect { x, y, w, h }),
        _ => Err("want X,Y,W,H in whole pixels".into()),
    }
}

/// One number or a span of them, `12` or `100-119`, both ends included.
pub(super) fn span(text: &str) -> Result<Span, String> {
    let form = "want a number or a span such as 100-119";
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if first <= last && last < 1 << 24 => Ok(Span { first, last }),
        _ => Err(form.into()),
    }
}

/// Whole numbers from `first` to `last`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    first: u32,
    last: u32,
}

/// All numbers of all spans.
pub(super) fn all(spans: &[Span]) -> Vec<u32> {
    spans.iter().flat_map(|s| s.first..=s.last).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_read_with_their_defaults() {
        assert_eq!(
            tone("49.2:0.4"),
            Ok(Tone {
                hz: 49.2,
                amplitude_px: 0.4,
                phase_rad: 0.0
            })
        );
        assert_eq!(tone("49.2:0.4:-1").map(|t| t.phase_rad), Ok(-1.0));
        assert_eq!(led("1000").map(|l| (l.duty, l.off_level)), Ok((0.5, 0.0)));
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(
            rect("1,2,3,4"),
            Ok(Rect {
                x: 1,
                y: 2,
                w: 3,
                h: 4
            })
        );
        assert_eq!(
            all(&[span("3").unwrap(), span("7-9").unwrap()]),
            [3, 7, 8, 9]
        );
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert_eq!(tone("49.2").unwrap_err(), "want HZ:PX or HZ:PX:RAD");
        assert_eq!(
            tone("49.2:x").unwrap_err(),
            "want HZ:PX or HZ:PX:RAD; 'x' is not a number"
        );
        assert_eq!(tone("1:2:3:4").unwrap_err(), "want HZ:PX or HZ:PX:RAD");
        assert!(tone("nan:1").is_err() && tone("").is_err());
        assert!(size("640").is_err() && size("axb").is_err() && rect("1,2,3").is_err());
        assert!(span("9-7").is_err() && span("-3").is_err() && span("1-999999999").is_err());
    }
}
