//! Broad-band measures as JSON and as a line of text.

use rowtone::report::{BroadBand, FROM_HZ, Figure, Measures, Report};
use serde::Serialize;

use super::text::digits;

/// A figure, its standard deviation, and what it is at most.
#[derive(Serialize)]
struct FigureObject {
    value: f32,
    sd: f32,
    at_most: f32,
}

impl FigureObject {
    fn of(figure: Option<Figure>, scale: f32) -> Option<Self> {
        let Figure { value, sd, at_most } = figure?.scaled(scale);
        Some(Self { value, sd, at_most })
    }
}

/// Measures along one axis, or of both: `null` is what the camera cannot know.
#[derive(Serialize)]
struct MeasuresObject {
    velocity_px_s_rms: Option<FigureObject>,
    velocity_from_2_hz_px_s_rms: Option<FigureObject>,
    displacement_px_rms: Option<FigureObject>,
    peak_to_peak_px: Option<FigureObject>,
    acceleration_px_s2_rms: Option<FigureObject>,
    crest_factor: Option<FigureObject>,
    kurtosis: Option<FigureObject>,
    #[serde(flatten)]
    scaled: Option<ScaledObject>,
}

/// The same where there is a scale.
#[derive(Serialize)]
struct ScaledObject {
    velocity_mm_s_rms: Option<FigureObject>,
    velocity_from_2_hz_mm_s_rms: Option<FigureObject>,
    displacement_um_rms: Option<FigureObject>,
    peak_to_peak_um: Option<FigureObject>,
    acceleration_m_s2_rms: Option<FigureObject>,
}

impl MeasuresObject {
    fn new(measures: &Measures, um_per_px: Option<f32>) -> Self {
        let m = measures;
        let scaled = um_per_px.map(|um| ScaledObject {
            velocity_mm_s_rms: FigureObject::of(m.velocity_px_s, um * 1e-3),
            velocity_from_2_hz_mm_s_rms: FigureObject::of(m.velocity_from_2_hz_px_s, um * 1e-3),
            displacement_um_rms: FigureObject::of(m.displacement_px, um),
            peak_to_peak_um: FigureObject::of(m.peak_to_peak_px, um),
            acceleration_m_s2_rms: FigureObject::of(m.acceleration_px_s2, um * 1e-6),
        });
        Self {
            velocity_px_s_rms: FigureObject::of(m.velocity_px_s, 1.0),
            velocity_from_2_hz_px_s_rms: FigureObject::of(m.velocity_from_2_hz_px_s, 1.0),
            displacement_px_rms: FigureObject::of(m.displacement_px, 1.0),
            peak_to_peak_px: FigureObject::of(m.peak_to_peak_px, 1.0),
            acceleration_px_s2_rms: FigureObject::of(m.acceleration_px_s2, 1.0),
            crest_factor: FigureObject::of(m.crest_factor, 1.0),
            kurtosis: FigureObject::of(m.kurtosis, 1.0),
            scaled,
        }
    }
}

/// The broad-band measures of a report.
#[derive(Serialize)]
pub(super) struct BroadBandObject {
    from_hz: f32,
    known_to_hz: f32,
    x: Option<MeasuresObject>,
    y: Option<MeasuresObject>,
    sum: MeasuresObject,
}

impl BroadBandObject {
    pub(super) fn new(of: &BroadBand, um_per_px: Option<f32>) -> Self {
        let measures = |m: &Measures| MeasuresObject::new(m, um_per_px);
        Self {
            from_hz: FROM_HZ,
            known_to_hz: of.known_to_hz,
            x: of.x.as_ref().map(measures),
            y: of.y.as_ref().map(measures),
            sum: measures(&of.sum),
        }
    }
}

/// The velocity of all motion from 10 Hz on, mm/s RMS, where there is a scale and the camera knows it.
pub(super) fn velocity_mm_s(report: &Report) -> Option<Figure> {
    let px_s = report.broad_band.as_ref()?.sum.velocity_px_s?;
    Some(px_s.scaled(report.um_per_px? * 1e-3))
}

/// A figure for a person's eyes.
pub(super) fn words(figure: &Figure) -> String {
    let (value, sd) = (f64::from(figure.value), f64::from(figure.sd));
    if figure.is_limit() {
        return format!("at most {}", digits(figure.at_most.into(), 2));
    }
    // As many decimals as the deviation's first two digits ask for.
    let decimals = (1.0 - sd.max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$} ± {sd:.decimals$}")
}

/// The broad-band measures of both axes, on a line.
pub(super) fn line(of: &BroadBand) -> String {
    let sum = &of.sum;
    let each = [
        ("", sum.displacement_px, " px RMS"),
        ("", sum.peak_to_peak_px, " px peak to peak"),
        ("", sum.velocity_px_s, " px/s RMS"),
        ("crest factor ", sum.crest_factor, ""),
        ("kurtosis ", sum.kurtosis, ""),
    ];
    let told: Vec<String> = each
        .iter()
        .filter_map(|(name, figure, unit)| Some(format!("{name}{}{unit}", words(figure.as_ref()?))))
        .collect();
    let to = of.known_to_hz;
    format!("{FROM_HZ:.0}-{to:.0} Hz: {}", told.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(value: f32, sd: f32, at_most: f32) -> Option<Figure> {
        Some(Figure { value, sd, at_most })
    }

    #[test]
    fn a_line_says_what_is_known_and_what_is_only_a_limit() {
        let broad = BroadBand {
            known_to_hz: 690.0,
            sum: Measures {
                displacement_px: figure(0.10123, 0.0012, 0.104),
                velocity_px_s: figure(3.0, 1.0, 12.34),
                kurtosis: figure(2.96, 0.11, 3.2),
                ..Measures::default()
            },
            ..BroadBand::default()
        };
        assert_eq!(
            line(&broad),
            "10-690 Hz: 0.1012 ± 0.0012 px RMS, at most 12 px/s RMS, kurtosis 2.96 ± 0.11"
        );
    }

    #[test]
    fn a_scale_adds_its_units() {
        let broad = BroadBand {
            known_to_hz: 1000.0,
            sum: Measures {
                velocity_px_s: figure(150.0, 2.0, 154.0),
                acceleration_px_s2: figure(1e5, 1e4, 1.2e5),
                ..Measures::default()
            },
            ..BroadBand::default()
        };
        let plain = serde_json::to_value(BroadBandObject::new(&broad, None)).unwrap();
        assert!(plain["x"].is_null() && plain["sum"]["kurtosis"].is_null());
        assert!(plain["sum"].get("velocity_mm_s_rms").is_none());
        let scaled = serde_json::to_value(BroadBandObject::new(&broad, Some(20.0))).unwrap();
        let of = |key: &str| scaled["sum"][key]["value"].as_f64().unwrap();
        assert!((of("velocity_mm_s_rms") - 3.0).abs() < 1e-6);
        assert!((of("acceleration_m_s2_rms") - 2.0).abs() < 1e-6);
    }
}
