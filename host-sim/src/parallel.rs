//! Frames in order, rendered on several threads.

use std::num::NonZeroUsize;
use std::sync::mpsc::sync_channel;
use std::thread;

use super::camera::Camera;
use super::frame::Frame;

/// Renders all arriving frames on `threads` threads and hands them to `sink` in order, a few ahead
/// at most. Stops at the sink's first error. The frames are the same whatever the number of threads.
///
/// # Errors
/// What the sink says.
pub fn for_each_frame<E>(
    camera: &Camera,
    threads: NonZeroUsize,
    mut sink: impl FnMut(Frame) -> Result<(), E>,
) -> Result<(), E> {
    let threads = threads.get();
    thread::scope(|scope| {
        let queues: Vec<_> = (0..threads)
            .map(|first| {
                let (send, receive) = sync_channel(2);
                scope.spawn(move || {
                    for slot in camera.arriving().skip(first).step_by(threads) {
                        if send.send(camera.frame(slot)).is_err() {
                            break; // the sink has had enough
                        }
                    }
                });
                receive
            })
            .collect();
        for queue in queues.iter().cycle() {
            match queue.recv() {
                Ok(frame) => sink(frame)?,
                Err(_) => break, // its turn, but it has no more: nor has any other
            }
        }
        Ok(())
    })
}

/// As many threads as the machine runs at once.
pub fn all_threads() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn order_and_bytes_do_not_depend_on_the_number_of_threads() {
        let mut config = Config {
            frames: 11,
            ..Config::default()
        };
        (config.sensor.rows, config.faults.lost) = (10, vec![2, 3]);
        let camera = Camera::new(config).expect("good");
        let alone: Vec<Frame> = camera.frames().collect();
        for threads in [1, 2, 5, 20] {
            let mut got = Vec::new();
            let threads = NonZeroUsize::new(threads).expect("above 0");
            for_each_frame(&camera, threads, |f| -> Result<(), ()> {
                got.push(f);
                Ok(())
            })
            .expect("the sink takes all");
            assert_eq!(got, alone);
        }
    }

    #[test]
    fn an_error_stops_it() {
        let camera = Camera::new(Config::default()).expect("good");
        let mut taken = 0;
        let two = NonZeroUsize::new(2).expect("above 0");
        let result = for_each_frame(&camera, two, |_| {
            taken += 1;
            if taken == 3 { Err("full") } else { Ok(()) }
        });
        assert_eq!((result, taken), (Err("full"), 3));
    }
}
