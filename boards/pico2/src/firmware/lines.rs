//! Each line through the tracker, on core 0.

use super::shared::{
    CAMERA, DROPPED_SAMPLES, FRAMES, LINE_LOSSES, M, MEASURING, PLAN, PLAN_ANEW, SETTINGS,
};
use super::{Picture, compute};
use core::sync::atomic::Ordering;
use rowtone::pipeline::{LineSide, Reading};
use rowtone::tracker::Stage;
use rowtone_board::plan::Plan;
use rowtone_pico2::handover::{LineBuffer, Taker, count};
use rowtone_pico2::plan;

/// Plans, learns and measures, until a new plan is due; for ever.
#[embassy_executor::task]
pub(crate) async fn work(mut taker: Taker<'static, M>, picture: &'static mut Picture) {
    let Some(mut readings) = compute::readings() else {
        return;
    };
    loop {
        MEASURING.store(false, Ordering::Relaxed);
        PLAN_ANEW.store(false, Ordering::Relaxed);
        let plan = await_plan(&mut taker).await;
        let Ok(mut lines) = LineSide::new(plan.tracker(), plan.group, picture.lend()) else {
            defmt::error!("the tracker refuses the plan");
            continue;
        };
        defmt::info!("measuring lines of {} ps", plan.cut.timing.line_time_ps());
        PLAN.signal(plan);
        while !PLAN_ANEW.load(Ordering::Relaxed) {
            if let Some(reading) = taker.work(|line| measure(line, &plan, &mut lines)).await {
                match readings.enqueue(reading) {
                    Ok(()) => compute::COME.signal(()),
                    Err(reading) => {
                        lines.drop_reading(&reading);
                        count(&DROPPED_SAMPLES);
                    }
                }
            }
            let measuring = lines.tracker().stage() == Stage::Tracking;
            MEASURING.store(measuring, Ordering::Relaxed);
        }
    }
}

/// Waits until the camera's rhythm is known and the settings are there.
async fn await_plan(taker: &mut Taker<'static, M>) -> Plan {
    loop {
        taker.work(|_| ()).await;
        let Some(settings) = SETTINGS.lock(|s| *s.borrow()) else {
            continue;
        };
        let plan = FRAMES.lock(|frames| {
            let frames = frames.borrow();
            let clock = frames.clock();
            clock
                .is_settled()
                .then(|| plan::plan(&settings, &CAMERA, clock))
                .flatten()
        });
        if let Some(plan) = plan {
            return plan;
        }
    }
}

fn measure(buffer: &LineBuffer, plan: &Plan, lines: &mut LineSide<'_>) -> Option<Reading> {
    let Ok(pixels) = buffer.pixels() else {
        count(&LINE_LOSSES.short);
        return None;
    };
    let place = buffer.place;
    let line = plan
        .cut
        .line(place.frame, place.frame_start_ns, place.row, pixels)?;
    lines.push(&line).copied()
}
