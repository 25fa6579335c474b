//! Both axes' spectra: the tones, and what is left of each axis without them.

use plotters::prelude::*;
use rowtone_report::text::digits;

use super::draw::{Area, Drawn, GRID, INK, Scene, TONE, X_AXIS, Y_AXIS, amplitude_range, font};
use super::tones::mark;

/// Width of a letter and height of a line of a label, in the drawing's unit.
const LETTER: i32 = 7;
const LINE: i32 = 15;

/// Left, top, right, bottom.
type Box4 = [i32; 4];

pub(super) fn spectrum<B>(area: &Area<B>, scene: &Scene<'_>) -> Drawn
where
    B: DrawingBackend,
    B::ErrorType: 'static,
{
    let um = scene.report.um_per_px.map(f64::from);
    let (scale, unit) = um.map_or((1.0, "px"), |um| (um, "µm"));
    let px = amplitude_range(scene);
    let range = px.start * scale..px.end * scale;
    let band = scene.band_hz;
    let mut chart = ChartBuilder::on(area)
        .caption("Spectrum of the last window over its noise floor", font(16))
        .margin(12)
        .margin_right(28)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .build_cartesian_2d(band.0..band.1, range.clone().log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(font(14))
        .axis_desc_style(font(15))
        .x_desc("frequency, Hz")
        .y_desc(format!("amplitude, {unit}"))
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| digits(*y, 1))
        .draw()?;
    for (k, (floor, colour)) in [(scene.floor_y, Y_AXIS), (scene.floor, X_AXIS)]
        .into_iter()
        .enumerate()
    {
        let points = || {
            floor
                .iter()
                .map(|&(hz, px)| (hz, (px * scale).max(range.start)))
        };
        if k == 1 {
            let area = AreaSeries::new(points(), range.start, colour.mix(0.12));
            chart.draw_series(area)?;
        }
        chart.draw_series(LineSeries::new(points(), colour.mix(0.6)))?;
    }
    let mut taken: Vec<Box4> = Vec::new();
    let mut places = Vec::new();
    for peak in &scene.report.peaks {
        let (hz, top) = (f64::from(peak.hz), f64::from(peak.amplitude_px) * scale);
        let top = top.clamp(range.start, range.end);
        let stem = PathElement::new(vec![(hz, range.start), (hz, top)], TONE.stroke_width(2));
        chart.draw_series([stem])?;
        let at = chart.backend_coord(&(hz, top));
        let foot = chart.backend_coord(&(hz, range.start));
        taken.push([at.0 - 3, at.1 - 5, at.0 + 3, foot.1]);
        let parts = peak.motion.as_ref().map(|m| [m.x_px, m.y_px]);
        for (part, colour) in parts.into_iter().flatten().zip([X_AXIS, Y_AXIS]) {
            let level = part.map(|px| f64::from(px) * scale);
            if let Some(level) = level.filter(|v| *v > range.start) {
                let (x, y) = chart.backend_coord(&(hz, level.min(range.end)));
                places.push(((x, y), colour));
            }
        }
    }
    let origin = area.get_pixel_range();
    let own = |(x, y): (i32, i32)| (x - origin.0.start, y - origin.1.start);
    for (at, colour) in places {
        let (x, y) = own(at);
        let dash = vec![(x - 8, y), (x + 8, y)];
        area.draw(&PathElement::new(dash, colour.stroke_width(3)))?;
    }
    let [right, above] = [
        chart.backend_coord(&(band.1, range.start)).0,
        chart.backend_coord(&(band.1, range.end)).1,
    ];
    for peak in &scene.report.peaks {
        let top = (f64::from(peak.amplitude_px) * scale).clamp(range.start, range.end);
        let at = chart.backend_coord(&(peak.hz.into(), top));
        mark(area, own(at), peak)?;
        let mut label = format!("{:.2} Hz, {} {unit}", peak.hz, digits(top, 3));
        if let Some(n) = peak.harmonic.filter(|n| *n > 1) {
            label += &format!(" ({n}x)");
        }
        if peak.ambiguous {
            label += " ?";
        }
        let wide = LETTER * label.chars().count() as i32;
        // To the right, to the left, above: the first place where it covers nothing; else the list has it.
        let places = [(13, -8), (-13 - wide, -8), (-wide / 2, -26)];
        let free = places.into_iter().find_map(|(dx, dy)| {
            let (x, y) = (at.0 + dx, at.1 + dy);
            let room = [x - 2, y, x + wide, y + LINE];
            let apart =
                |b: &Box4| b[0] > room[2] || b[2] < room[0] || b[1] > room[3] || b[3] < room[1];
            let own_stem = [at.0 - 3, at.1 - 5];
            let clear = taken
                .iter()
                .all(|b| [b[0], b[1]] == own_stem && dy > -20 || apart(b));
            let inside = room[0] > origin.0.start + 80 && room[2] < right && room[1] > above;
            (clear && inside).then_some((x, y, room))
        });
        if let Some((x, y, room)) = free {
            taken.push(room);
            area.draw(&Text::new(label, own((x, y)), font(14)))?;
        }
    }
    Ok(())
}
