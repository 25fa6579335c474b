//! Things from one thread to another in blocks, and back to be used again.
//!
//! A block is handed over when it is full, so two threads that both have work wake each other once a
//! block, not once a thing; and what comes back is filled again, so nothing is allocated for long. The
//! sender waits when all blocks are under way, the receiver when none has come. Blocks come back by the half of
//! all: a sender that is ahead is woken rarely, and has much to do then.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// What goes over the channel.
enum Message<T, E> {
    Block(Vec<T>),
    End(E),
}

/// The sending end.
#[derive(Debug)]
pub struct Outlet<T, E> {
    to: SyncSender<Message<T, E>>,
    used: Receiver<Vec<T>>,
    spare: Vec<T>,
    filled: Vec<T>,
    block: usize,
}

/// The receiving end.
#[derive(Debug)]
pub struct Inlet<T, E> {
    from: Receiver<Message<T, E>>,
    back: SyncSender<Vec<T>>,
    current: VecDeque<T>,
    done: Vec<T>,
    /// Things that have come and are not given back yet, at most, and when so many are, all are.
    owed: usize,
    batch: usize,
}

/// What came.
#[derive(Debug)]
pub enum Next<T, E> {
    /// The next thing.
    Item(T),
    /// The last word.
    End(E),
    /// The sender is gone, or has said its last word before.
    Gone,
}

/// A ring of `blocks` blocks of `block` things.
pub fn ring<T: Default, E>(blocks: usize, block: usize) -> (Outlet<T, E>, Inlet<T, E>) {
    let block = block.max(1);
    let (to, from) = sync_channel(blocks + 1);
    let (back, used) = sync_channel(blocks + 1);
    for _ in 0..blocks {
        // There is room for all of them.
        let _ = back.try_send(std::iter::repeat_with(T::default).take(block).collect());
    }
    let outlet = Outlet {
        to,
        used,
        spare: Vec::new(),
        filled: Vec::new(),
        block,
    };
    let inlet = Inlet {
        from,
        back,
        current: VecDeque::new(),
        done: Vec::new(),
        owed: 0,
        batch: blocks.div_ceil(2) * block,
    };
    (outlet, inlet)
}

impl<T, E> Outlet<T, E> {
    /// A thing to fill; waits for one to come back. `None` when nobody listens any more.
    pub fn spare(&mut self) -> Option<T> {
        while self.spare.is_empty() {
            self.spare = self.used.recv().ok()?;
        }
        self.spare.pop()
    }

    /// Hands a thing over, with its block. `false` when nobody listens any more.
    pub fn put(&mut self, thing: T) -> bool {
        self.filled.push(thing);
        self.filled.len() < self.block || self.flush()
    }

    /// Hands over what there is, and the last word.
    pub fn end(mut self, word: E) {
        if self.flush() {
            let _ = self.to.send(Message::End(word));
        }
    }

    fn flush(&mut self) -> bool {
        let filled = std::mem::replace(&mut self.filled, Vec::with_capacity(self.block));
        filled.is_empty() || self.to.send(Message::Block(filled)).is_ok()
    }
}

impl<T: Default, E> Inlet<T, E> {
    /// What comes next; waits for it.
    pub fn receive(&mut self) -> Next<T, E> {
        loop {
            if let Some(thing) = self.current.pop_front() {
                return Next::Item(thing);
            }
            match self.from.recv() {
                Ok(Message::Block(block)) => self.take(block),
                Ok(Message::End(word)) => return Next::End(word),
                Err(_) => return Next::Gone,
            }
        }
    }

    /// What comes next, if it comes within this time.
    pub fn receive_within(&mut self, patience: Duration) -> Option<Next<T, E>> {
        loop {
            if let Some(thing) = self.current.pop_front() {
                return Some(Next::Item(thing));
            }
            match self.from.recv_timeout(patience) {
                Ok(Message::Block(block)) => self.take(block),
                Ok(Message::End(word)) => return Some(Next::End(word)),
                Err(RecvTimeoutError::Disconnected) => return Some(Next::Gone),
                Err(RecvTimeoutError::Timeout) => return None,
            }
        }
    }

    /// Takes a thing back, to be filled again. What is kept instead is replaced by something new.
    pub fn recycle(&mut self, thing: T) {
        if self.done.len() < self.batch {
            self.done.push(thing);
        }
    }

    /// A block has come: as many things as it had may be filled again, soon.
    fn take(&mut self, block: Vec<T>) {
        self.owed += block.len();
        self.current = block.into();
        if self.owed >= self.batch {
            let mut done = std::mem::replace(&mut self.done, Vec::with_capacity(self.batch));
            done.resize_with(self.owed, T::default);
            self.owed = 0;
            let _ = self.back.try_send(done);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_arrives_in_order_then_the_last_word() {
        for (blocks, block) in [(1, 1), (2, 1), (2, 3), (3, 1), (5, 7), (6, 10)] {
            let (mut outlet, mut inlet) = ring::<Vec<u32>, &str>(blocks, block);
            let sender = std::thread::spawn(move || {
                for i in 0..100 {
                    let mut thing = outlet.spare().unwrap();
                    thing.clear();
                    thing.push(i);
                    assert!(outlet.put(thing));
                }
                outlet.end("done");
            });
            let mut kept = Vec::new();
            for i in 0..100 {
                let Next::Item(thing) = inlet.receive() else {
                    panic!("{i} did not come");
                };
                assert_eq!(thing, [i]);
                if i % 5 == 0 {
                    kept.push(thing);
                } else {
                    inlet.recycle(thing);
                }
            }
            assert!(matches!(inlet.receive(), Next::End("done")));
            assert!(matches!(inlet.receive(), Next::Gone));
            sender.join().unwrap();
        }
    }

    #[test]
    fn things_come_back_by_the_half_of_all() {
        let (mut outlet, mut inlet) = ring::<u32, ()>(4, 3);
        let mut send = |count: u32| (0..count).all(|i| outlet.spare().is_some() && outlet.put(i));
        assert!(send(12));
        for i in 0..6 {
            assert!(matches!(inlet.receive(), Next::Item(_)));
            inlet.recycle(i);
        }
        assert!(send(6));
    }

    #[test]
    fn a_sender_notices_that_nobody_listens() {
        let (mut outlet, inlet) = ring::<u8, ()>(1, 1);
        drop(inlet);
        assert!(!outlet.put(1));
        while outlet.spare().is_some() {}
    }
}
