//! As much of MQTT 3.1.1 (OASIS, 29 October 2014) as a gateway needs: one connection that publishes
//! with QoS 1 and hears commands.
//!
//! `packet` is bytes alone; `connection` has the socket. Of its own because the gateway must
//! know of each message what became of it: which was refused, which is not acknowledged, and that a
//! message which is too long to read is no reason to end.

pub(super) mod connection;
pub mod packet;
