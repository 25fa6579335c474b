//! How motion that differs from place to place is written on the command line.
//!
//! `HZ:X[:Y[:Y_PHASE]]`, where X and Y are polynomials of the place: `c` runs from −1 at the left edge
//! to 1 at the right one, `r` from −1 at the upper edge to 1 at the lower one. `83.3:0.3r` bends about
//! its middle, `97:-0.15r:0.2c` turns, `60:0.2:0.2:1.57` goes round. `@X,Y,W,H` behind it names the
//! part that moves so.

use host_sim::{FirstFrame, Mode, Rect, Shadow, Shape, Term, Wave};

use super::forms;

/// `HZ:X[:Y[:Y_PHASE]][@X,Y,W,H]`.
pub(super) fn mode(text: &str) -> Result<Mode, String> {
    let form = "want HZ:X, HZ:X:Y or HZ:X:Y:Y_PHASE, such as 83.3:0.2+0.1r:0.1c";
    let (rest, part) = split_part(text)?;
    let words: Vec<&str> = rest.split(':').collect();
    let (hz, shapes) = words.split_first().ok_or(form)?;
    let wave = Wave::Tone {
        hz: number(hz).ok_or(form)?,
    };
    moving(wave, shapes, part, form)
}

/// `HZ:START_S:DECAY_S:X[:Y[:Y_PHASE]][@X,Y,W,H]`.
pub(super) fn hit(text: &str) -> Result<Mode, String> {
    let form = "want HZ:START_S:DECAY_S:X, or with :Y:Y_PHASE, such as 143.3:0.25:0.1:0.5";
    let (rest, part) = split_part(text)?;
    let words: Vec<&str> = rest.split(':').collect();
    let [hz, start, decay, shapes @ ..] = words.as_slice() else {
        return Err(form.into());
    };
    let wave = Wave::Hit {
        hz: number(hz).ok_or(form)?,
        start_s: number(start).ok_or(form)?,
        decay_s: number(decay).ok_or(form)?,
    };
    moving(wave, shapes, part, form)
}

/// `LOW_HZ:HIGH_HZ:X[:Y][@X,Y,W,H]`, rms in px.
pub(super) fn random(text: &str) -> Result<Mode, String> {
    let form = "want LOW_HZ:HIGH_HZ:X or LOW_HZ:HIGH_HZ:X:Y (px rms), such as 20:400:0.1";
    let (rest, part) = split_part(text)?;
    let words: Vec<&str> = rest.split(':').collect();
    let [low, high, shapes @ ..] = words.as_slice() else {
        return Err(form.into());
    };
    let wave = Wave::Random {
        low_hz: number(low).ok_or(form)?,
        high_hz: number(high).ok_or(form)?,
        seed: 1,
    };
    moving(wave, shapes, part, form)
}

/// `START_S:SECONDS:WIDTH_PX:DEPTH`.
pub(super) fn shadow(text: &str) -> Result<Shadow, String> {
    let form = "want START_S:SECONDS:WIDTH_PX:DEPTH, such as 0:1:25:0.3";
    let numbers: Option<Vec<f64>> = text.split(':').map(number).collect();
    match numbers.as_deref() {
        Some(&[start_s, duration_s, width_px, depth]) => Ok(Shadow {
            start_s,
            duration_s,
            width_px,
            depth,
        }),
        _ => Err(form.into()),
    }
}

/// `N[:DEPTH]`.
pub(super) fn dust(text: &str) -> Result<(u32, f64), String> {
    let form = "want N or N:DEPTH, such as 20:0.4";
    let (count, depth) = text.split_once(':').unwrap_or((text, "0.4"));
    Ok((
        count.trim().parse().map_err(|_| form)?,
        number(depth).ok_or(form)?,
    ))
}

/// `black`, `dark`, `stale` or `random`.
pub(super) fn first_frame(text: &str) -> Result<FirstFrame, String> {
    Ok(match text {
        "black" => FirstFrame::Black,
        "dark" => FirstFrame::Dark,
        "stale" => FirstFrame::Stale,
        "random" => FirstFrame::Random,
        _ => return Err("want black, dark, stale or random".into()),
    })
}

fn moving(wave: Wave, shapes: &[&str], part: Option<Rect>, form: &str) -> Result<Mode, String> {
    let (x, y, y_phase) = match *shapes {
        [x] => (x, "0", "0"),
        [x, y] => (x, y, "0"),
        [x, y, phase] => (x, y, phase),
        _ => return Err(form.into()),
    };
    Ok(Mode {
        wave,
        x: shape(x)?,
        y: shape(y)?,
        x_phase_rad: 0.0,
        y_phase_rad: number(y_phase).ok_or(form)?,
        part,
    })
}

fn split_part(text: &str) -> Result<(&str, Option<Rect>), String> {
    match text.split_once('@') {
        None => Ok((text, None)),
        Some((rest, part)) => Ok((rest, Some(forms::rect(part)?))),
    }
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|v| v.is_finite())
}

/// A polynomial such as `0.2+0.1r-0.3ccr`.
fn shape(text: &str) -> Result<Shape, String> {
    let mut terms = Vec::new();
    let mut rest = text.trim();
    if rest.is_empty() {
        return Err("want an amplitude in px, such as 0.2 or 0.2+0.1r".into());
    }
    while !rest.is_empty() {
        let end = rest
            .char_indices()
            .skip(1)
            .find(|&(i, ch)| matches!(ch, '+' | '-') && !rest[..i].ends_with(['e', 'E']))
            .map_or(rest.len(), |(i, _)| i);
        terms.push(term(&rest[..end])?);
        rest = &rest[end..];
    }
    Ok(Shape(terms))
}

/// One term: a number, then a `c` for each power of the column's place and an `r` of the row's.
fn term(text: &str) -> Result<Term, String> {
    let wrong = || format!("'{text}' is no term such as 0.2, 0.1r or -0.3ccr (c column, r row)");
    let digits = text.trim_end_matches(['c', 'r']);
    let powers = &text[digits.len()..];
    let px = match digits {
        "" | "+" if !powers.is_empty() => 1.0,
        "-" if !powers.is_empty() => -1.0,
        _ => number(digits).ok_or_else(wrong)?,
    };
    let count = |letter| powers.matches(letter).count();
    if powers.len() > 6 {
        return Err(wrong());
    }
    Ok(Term {
        px,
        columns: count('c') as u8,
        rows: count('r') as u8,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn polynomials_of_the_place_are_read() {
        let at = |text: &str, c, r| shape(text).expect(text).at(c, r);
        assert_eq!(at("0.2", 0.3, 0.7), 0.2);
        assert!((at("0.2+0.1r", 0.0, -1.0) - 0.1).abs() < 1e-12);
        assert!((at("-0.15r", 0.0, 0.5) + 0.075).abs() < 1e-12);
        assert!((at("1e-1cc-rr+.5cr", 2.0, 3.0) - (0.4 - 9.0 + 3.0)).abs() < 1e-12);
        for wrong in ["", "x", "0.2+", "--1", "0.1q", "ccccccc", "nan"] {
            assert!(shape(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn modes_hits_and_random_vibration_are_read() {
        let turn = mode("97:-0.15r:0.2c@1,2,30,40").expect("good");
        assert_eq!(turn.wave, Wave::Tone { hz: 97.0 });
        let part = turn.part.expect("named");
        assert_eq!((part.x, part.y, part.w, part.h), (1, 2, 30, 40));
        assert_eq!(mode("60:0.2:0.1:1.5").map(|m| m.y_phase_rad), Ok(1.5));
        let struck = hit("143.3:0.25:0.1:0.5").expect("good");
        assert_eq!(struck.x, Shape::even(0.5));
        assert!(random("20:400:0.1").is_ok() && shadow("0:1:25:0.3").is_ok());
        for wrong in ["", "97", "97:1:2:3:4", "x:1", "97:1@2"] {
            assert!(mode(wrong).is_err(), "{wrong}");
        }
        assert!(hit("1:2:3").is_err() && random("1:2").is_err() && shadow("1:2:3").is_err());
    }

    proptest! {
        #[test]
        fn any_text_is_a_shape_or_refused(text in "[0-9.+cre-]{0,12}") {
            let _ = shape(&text);
        }

        #[test]
        fn what_is_written_is_what_is_read(px in -9.0f64..9.0, c in 0u8..3, r in 0u8..3) {
            let text = format!("{px}{}{}", "c".repeat(c.into()), "r".repeat(r.into()));
            prop_assert_eq!(shape(&text), Ok(Shape(vec![Term { px, columns: c, rows: r }])));
        }
    }
}
