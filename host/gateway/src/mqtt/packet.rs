//! Packets: how they are written, and found in what comes.

use std::fmt;

/// Longest message that is read; longer ones are passed over.
pub const MAX_MESSAGE: usize = 256 * 1024;
/// Longest string, bytes (section 1.5.3).
pub const MAX_STRING: usize = 65_535;
/// Longest packet behind its first byte and its length (section 2.2.3).
const MAX_LENGTH: usize = 268_435_455;

/// One message to publish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Where to.
    pub topic: String,
    /// What it says.
    pub payload: Vec<u8>,
    /// The broker keeps it for whoever comes later.
    pub retain: bool,
}

/// Who connects, and what is to be said when he is gone.
#[derive(Clone, Debug)]
pub struct Hello<'a> {
    /// Unlike that of any other client.
    pub client_id: &'a str,
    /// Where the broker wants one.
    pub user: Option<&'a str>,
    /// The user's.
    pub password: Option<&'a str>,
    /// The broker gives up after one and a half times this without a word, s.
    pub keep_alive_s: u16,
    /// Published by the broker when the connection is lost.
    pub will: &'a Message,
}

/// Why a message cannot be published at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The topic is empty, too long, or has a wildcard or a character that no topic may have.
    Topic,
    /// Longer than a packet can be.
    TooLong,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Topic => "no topic can be called so",
            Self::TooLong => "too long for a message",
        })
    }
}

/// What came.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Packet {
    /// The broker accepts the connection.
    Accepted,
    /// It does not; the return code of section 3.2.2.3.
    Refused(u8),
    /// It has taken responsibility for the message of this number.
    Acknowledged(u16),
    /// A message, its number where it wants an answer.
    Message(Message, Option<u16>),
    /// A message longer than [`MAX_MESSAGE`], its length and its number.
    Oversized(usize, Option<u16>),
    /// The answer to a ping.
    Pong,
    /// One that says nothing of interest.
    Other,
}

/// What came is no MQTT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoMqtt;

/// Whether a topic may be called so (section 4.7).
pub fn is_topic(topic: &str) -> bool {
    (1..=MAX_STRING).contains(&topic.len())
        && !topic.contains(|c: char| matches!(c, '#' | '+') || c.is_control())
}

fn packet(first: u8, parts: &[&[u8]]) -> Result<Vec<u8>, Refused> {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    if length > MAX_LENGTH {
        return Err(Refused::TooLong);
    }
    let mut bytes = vec![first];
    let mut rest = length;
    loop {
        let more = if rest > 127 { 0x80 } else { 0 };
        bytes.push((rest % 128) as u8 | more);
        rest /= 128;
        if rest == 0 {
            break;
        }
    }
    bytes.extend(parts.iter().copied().flatten());
    Ok(bytes)
}

/// A string with its length before it; one that is too long is cut.
fn string(text: &[u8]) -> Vec<u8> {
    let length = text.len().min(MAX_STRING);
    let mut bytes = (length as u16).to_be_bytes().to_vec();
    bytes.extend(&text[..length]);
    bytes
}

/// CONNECT, with a clean session.
///
/// # Errors
/// The will cannot be published.
pub fn connect(hello: &Hello<'_>) -> Result<Vec<u8>, Refused> {
    let will = hello.will;
    if !is_topic(&will.topic) {
        return Err(Refused::Topic);
    }
    let mut flags = 0x02 | 0x04 | 0x08; // clean session; a will, with QoS 1
    flags |= if will.retain { 0x20 } else { 0 };
    flags |= if hello.user.is_some() { 0x80 } else { 0 };
    flags |= if hello.password.is_some() { 0x40 } else { 0 };
    let mut body = string(b"MQTT");
    body.extend([4, flags]);
    body.extend(hello.keep_alive_s.to_be_bytes());
    body.extend(string(hello.client_id.as_bytes()));
    body.extend(string(will.topic.as_bytes()));
    body.extend(string(&will.payload));
    for text in [hello.user, hello.password].into_iter().flatten() {
        body.extend(string(text.as_bytes()));
    }
    packet(0x10, &[&body])
}

/// PUBLISH with QoS 1.
///
/// # Errors
/// It cannot be published, see [`Refused`].
pub fn publish(number: u16, message: &Message) -> Result<Vec<u8>, Refused> {
    if !is_topic(&message.topic) {
        return Err(Refused::Topic);
    }
    let topic = string(message.topic.as_bytes());
    let number = number.to_be_bytes();
    let first = 0x32 | u8::from(message.retain);
    packet(first, &[&topic, &number, &message.payload])
}

/// SUBSCRIBE to one filter with QoS 1.
///
/// # Errors
/// Never, as filters are shorter than packets.
pub fn subscribe(number: u16, filter: &str) -> Result<Vec<u8>, Refused> {
    let filter = string(filter.as_bytes());
    packet(0x82, &[&number.to_be_bytes(), &filter, &[1]])
}

/// PUBACK
pub fn acknowledge(number: u16) -> Vec<u8> {
    let [upper, lower] = number.to_be_bytes();
    vec![0x40, 2, upper, lower]
}

/// PINGREQ
pub const PING: [u8; 2] = [0xc0, 0];
/// DISCONNECT
pub const DISCONNECT: [u8; 2] = [0xe0, 0];

/// Finds packets in bytes as they come.
#[derive(Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// Bytes of a message that is passed over which have yet to come.
    skip: usize,
}

impl Decoder {
    /// Takes what came.
    pub fn push(&mut self, mut bytes: &[u8]) {
        let skipped = self.skip.min(bytes.len());
        self.skip -= skipped;
        bytes = &bytes[skipped..];
        self.bytes.extend(bytes);
    }

    /// The next packet, once it is there.
    ///
    /// # Errors
    /// What came is none; nothing behind it can be understood either.
    pub fn take(&mut self) -> Result<Option<Packet>, NoMqtt> {
        let Some((head, length)) = length(&self.bytes)? else {
            return Ok(None);
        };
        let first = self.bytes[0];
        let there = &self.bytes[head..];
        if first >> 4 == 3 && length > MAX_MESSAGE {
            let Some((number, _)) = message(first, there) else {
                return Ok(None);
            };
            self.skip = length.saturating_sub(there.len());
            self.bytes.drain(..(head + length).min(self.bytes.len()));
            return Ok(Some(Packet::Oversized(length, number)));
        }
        if length > MAX_MESSAGE {
            return Err(NoMqtt);
        }
        let Some(body) = there.get(..length) else {
            return Ok(None);
        };
        let packet = parse(first, body)?;
        self.bytes.drain(..head + length);
        Ok(Some(packet))
    }
}

/// Where a packet's content begins, and its length.
fn length(bytes: &[u8]) -> Result<Option<(usize, usize)>, NoMqtt> {
    let mut length = 0;
    for at in 0..4 {
        let Some(&byte) = bytes.get(1 + at) else {
            return Ok(None);
        };
        length |= usize::from(byte & 0x7f) << (7 * at);
        if byte < 0x80 {
            return Ok(Some((2 + at, length)));
        }
    }
    Err(NoMqtt)
}

/// Number of a message, where it has one, and where its payload begins; none while they are not there.
fn message(first: u8, body: &[u8]) -> Option<(Option<u16>, usize)> {
    let (topic, rest) = body.split_first_chunk::<2>()?;
    let topic = usize::from(u16::from_be_bytes(*topic));
    let rest = rest.get(topic..)?;
    if first & 0x06 == 0 {
        return Some((None, 2 + topic));
    }
    let number = rest.first_chunk::<2>()?;
    Some((Some(u16::from_be_bytes(*number)), 4 + topic))
}

fn parse(first: u8, body: &[u8]) -> Result<Packet, NoMqtt> {
    Ok(match (first >> 4, body) {
        (2, [_, 0]) => Packet::Accepted,
        (2, [_, code]) => Packet::Refused(*code),
        (4, [upper, lower]) => Packet::Acknowledged(u16::from_be_bytes([*upper, *lower])),
        (3, body) => {
            let (number, start) = message(first, body).ok_or(NoMqtt)?;
            let topic_end = start - if number.is_some() { 2 } else { 0 };
            let message = Message {
                topic: String::from_utf8_lossy(&body[2..topic_end]).into_owned(),
                payload: body[start..].to_vec(),
                retain: first & 0x01 != 0,
            };
            Packet::Message(message, number)
        }
        (13, []) => Packet::Pong,
        // SUBACK, and what belongs to QoS 2, which nobody asked for.
        (5..=7 | 9 | 11, _) => Packet::Other,
        _ => return Err(NoMqtt),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn decoded(bytes: &[u8], step: usize) -> Vec<Packet> {
        let (mut decoder, mut packets) = (Decoder::default(), vec![]);
        for part in bytes.chunks(step) {
            decoder.push(part);
            while let Some(packet) = decoder.take().unwrap() {
                packets.push(packet);
            }
        }
        assert!(decoder.bytes.is_empty() && decoder.skip == 0);
        packets
    }

    /// Byte by byte, as the standard says.
    #[test]
    fn connect_and_publish() {
        let will = Message {
            topic: "t".to_owned(),
            payload: b"gone".to_vec(),
            retain: true,
        };
        let hello = Hello {
            client_id: "c",
            user: Some("u"),
            password: Some("p"),
            keep_alive_s: 15,
            will: &will,
        };
        let body = b"\0\x04MQTT\x04\xee\0\x0f\0\x01c\0\x01t\0\x04gone\0\x01u\0\x01p";
        let expected = [&[0x10, body.len() as u8], &body[..]].concat();
        assert_eq!(connect(&hello).unwrap(), expected);
        assert_eq!(publish(258, &will).unwrap(), b"\x33\x09\0\x01t\x01\x02gone");
        let long = Message {
            payload: vec![0; 200],
            ..will.clone()
        };
        // 205 = 77 + 1·128
        assert_eq!(publish(1, &long).unwrap()[..3], [0x33, 0xcd, 1]);
        assert_eq!(subscribe(7, "a/#").unwrap(), b"\x82\x08\0\x07\0\x03a/#\x01");
    }

    #[test]
    fn what_no_topic_can_be() {
        let message = |topic: &str| Message {
            topic: topic.to_owned(),
            payload: vec![],
            retain: false,
        };
        for topic in ["", "a#", "a/+/b", "a\nb", "a\0", &"x".repeat(65_536)] {
            assert_eq!(
                publish(1, &message(topic)),
                Err(Refused::Topic),
                "{topic:.9}"
            );
        }
        assert!(publish(1, &message(&"x".repeat(65_535))).is_ok());
        let mut long = message("t");
        long.payload = vec![0; MAX_LENGTH];
        assert_eq!(publish(1, &long), Err(Refused::TooLong));
    }

    #[test]
    fn a_message_that_is_too_long_is_passed_over() {
        let message = |length| Message {
            topic: "command".to_owned(),
            payload: vec![7; length],
            retain: false,
        };
        let mut bytes = vec![0x20, 2, 0, 0];
        bytes.extend(publish(9, &message(MAX_MESSAGE + 1)).unwrap());
        bytes.extend([0x40, 2, 1, 2, 0xd0, 0]);
        bytes.extend(publish(10, &message(3)).unwrap());
        let expected = [
            Packet::Accepted,
            Packet::Oversized(MAX_MESSAGE + 12, Some(9)),
            Packet::Acknowledged(258),
            Packet::Pong,
            Packet::Message(message(3), Some(10)),
        ];
        for step in [1, 3, 1000, 65_536, bytes.len()] {
            assert_eq!(decoded(&bytes, step), expected, "{step} at once");
        }
    }

    proptest! {
        /// Whatever comes: no panic, and no more is kept than a message is long.
        #[test]
        fn any_bytes(parts in proptest::collection::vec(
            proptest::collection::vec(any::<u8>(), 0..200), 0..40)) {
            let mut decoder = Decoder::default();
            for part in parts {
                decoder.push(&part);
                loop {
                    match decoder.take() {
                        Ok(Some(_)) => {}
                        Ok(None) => break,
                        Err(NoMqtt) => return Ok(()),
                    }
                }
                prop_assert!(decoder.bytes.len() <= MAX_MESSAGE + 5);
            }
        }
    }
}
