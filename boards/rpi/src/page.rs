//! The page: what it shows of the camera, and settings changed on it.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use rowtone::link::settings::{Key, Limits, Settings};
use rowtone::report::{PeakShape, Report};
use rowtone::tracker::Axes;
use rowtone_page::control::{Access, BOARD_KEYS, Control, Keeper};
use rowtone_page::guard::Names;
use rowtone_page::live::{About, Live, Phase};
use rowtone_page::server::Server;
use rowtone_page::site::Site;
use rowtone_report::alarms::Said;
use rowtone_report::json::{self, Place};

use crate::capture::Facts;
use crate::config::Config;
use crate::setup::Setup;
use crate::shared::{PageWish, Shared};

/// How long the output thread may take to use other settings: it looks every 5 ms.
const PATIENCE: Duration = Duration::from_secs(2);

/// Says what is measured from now on; what was shown before belongs to other settings.
pub(crate) fn describe(live: &Live, facts: &Facts, setup: &Setup, config: &Config) {
    let timing = setup.group.timing();
    live.restart();
    live.describe(About {
        name: facts.id.clone(),
        picture: Some([setup.shape.width, setup.shape.height].map(usize::from)),
        part: Some(part(setup)),
        line_time_us: Some(f64::from(timing.line_time_ps()) * 1e-6),
        exposure_us: Some(config.exposure_us().into()),
        fps: facts.frame_period_ns.map(|ns| 1e9 / ns.max(1) as f64),
    });
    live.set_phase(Phase::Measuring, "");
}

fn part(setup: &Setup) -> [usize; 4] {
    let part = setup.part;
    [part.x, part.y, part.width, part.height].map(usize::from)
}

/// Shows a report.
pub(crate) fn report(
    live: &Live,
    mut report: Report,
    shapes: &[PeakShape],
    said: Option<&Said>,
    (setup, shared): (&Setup, &Shared),
) {
    // On the line the outbox numbers reports, also over the sessions of one start.
    report.seq = live.reports.position().1 as u32;
    let dropped = shared.dropped.load(Ordering::Relaxed);
    live.lost.reports.store(dropped, Ordering::Relaxed);
    let place = Place {
        roi: part(setup),
        axes: match setup.tracker.axes {
            Axes::X => "x",
            Axes::Xy => "xy",
        },
    };
    let object = json::measured(&report, shapes, place, None);
    let object = match said {
        Some(said) => said.added_to(object),
        None => object,
    };
    live.report(&report, object);
}

/// The device as the page sees it.
struct Desk {
    shared: Arc<Shared>,
}

impl Control for Desk {
    fn settings(&self) -> Settings {
        self.shared.settings()
    }

    fn limits(&self) -> Limits {
        let (width, height) = self.shared.picture().unwrap_or((8192, u16::MAX));
        Limits {
            width,
            height,
            min_width: 16,
            max_window_s: 60.0,
        }
    }

    fn keys(&self) -> &[Key] {
        &BOARD_KEYS
    }

    fn is_live(&self) -> bool {
        true
    }

    fn change(&self, settings: Settings) -> Result<(), String> {
        let (answer, answered) = sync_channel(1);
        let wish = PageWish { settings, answer };
        *self
            .shared
            .wish
            .lock()
            .unwrap_or_else(PoisonError::into_inner) = Some(wish);
        let silent = |_| "the device does not answer: its output thread is busy".to_owned();
        answered.recv_timeout(PATIENCE).map_err(silent)?
    }
}

/// What to type into a browser for an address: this machine's name in its network where that is any of its own.
pub fn name(address: SocketAddr) -> String {
    let own = std::fs::read_to_string("/proc/sys/kernel/hostname");
    match own {
        Ok(own) if address.ip().is_unspecified() => {
            format!("{}.local:{}", own.trim(), address.port())
        }
        _ => address.to_string(),
    }
}

/// Serves the page for as long as the server lives; `None` where the configuration wants none.
///
/// # Errors
/// Where nobody can listen at the address, or what is kept of the password cannot be read.
pub fn serve(config: &Config, shared: &Arc<Shared>) -> io::Result<Option<Server>> {
    let (Some(listen), Some(live)) = (config.page.listen, &shared.live) else {
        return Ok(None);
    };
    let keeper = match &config.page.password {
        Some(hash) => Keeper::fixed(hash.clone()),
        None => {
            // Beside the settings, and like them nowhere where those are not kept.
            let state = &config.service.state;
            let file =
                (!state.as_os_str().is_empty()).then(|| state.with_file_name("page-password"));
            Keeper::open(file).map_err(io::Error::other)?
        }
    };
    let desk = Arc::new(Desk {
        shared: Arc::clone(shared),
    });
    let names = Names::of_this_machine(config.page.names.iter().cloned());
    let site = Site::new(Arc::clone(live), desk, Access::Password(keeper), names);
    let watched = Arc::clone(shared);
    let alive = move || watched.pulses.page.beat(watched.started);
    Server::start_watched(listen, Arc::new(site), alive).map(Some)
}
