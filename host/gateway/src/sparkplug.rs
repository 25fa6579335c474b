//! Sparkplug B messages (Eclipse Sparkplug 3.0, section 6.4): the few fields of its protocol buffer
//! that are needed here.

use prost::{Message, Oneof};
use rowtone::report::{MAX_PEAKS, Report};

use super::spool::record::Entry;
use rowtone_report::band_velocity;

/// `org.eclipse.tahu.protobuf.Payload`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Payload {
    #[prost(uint64, optional, tag = "1")]
    pub(super) timestamp: Option<u64>,
    #[prost(message, repeated, tag = "2")]
    pub(super) metrics: Vec<Metric>,
    #[prost(uint64, optional, tag = "3")]
    pub(super) seq: Option<u64>,
}

/// `Payload.Metric`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Metric {
    #[prost(string, optional, tag = "1")]
    pub(super) name: Option<String>,
    #[prost(uint64, optional, tag = "3")]
    pub(super) timestamp: Option<u64>,
    #[prost(uint32, optional, tag = "4")]
    pub(super) datatype: Option<u32>,
    #[prost(bool, optional, tag = "5")]
    pub(super) is_historical: Option<bool>,
    #[prost(bool, optional, tag = "7")]
    pub(super) is_null: Option<bool>,
    #[prost(oneof = "Value", tags = "10, 11, 12, 14")]
    pub(super) value: Option<Value>,
}

/// The value of a metric.
#[derive(Clone, PartialEq, Oneof)]
pub(super) enum Value {
    #[prost(uint32, tag = "10")]
    Int(u32),
    #[prost(uint64, tag = "11")]
    Long(u64),
    #[prost(float, tag = "12")]
    Float(f32),
    #[prost(bool, tag = "14")]
    Boolean(bool),
}

const INT64: u32 = 4;
const UINT32: u32 = 7;
const FLOAT: u32 = 9;
const BOOLEAN: u32 = 11;

/// The metric that a host writes to ask for all births again.
pub(super) const REBIRTH: &str = "Node Control/Rebirth";

fn metric(name: impl Into<String>, datatype: u32, value: Option<Value>) -> Metric {
    Metric {
        name: Some(name.into()),
        timestamp: None,
        datatype: Some(datatype),
        is_historical: None,
        is_null: value.is_none().then_some(true),
        value,
    }
}

/// What births and deaths of a node count, 0 to 255: the same in the birth and in the death that belongs to it.
pub(super) fn bd_seq(number: u64) -> Metric {
    metric("bdSeq", INT64, Some(Value::Long(number % 256)))
}

/// The node's death: the broker sends it when the gateway is gone.
pub(super) fn node_death(number: u64) -> Vec<u8> {
    Payload {
        timestamp: None,
        metrics: vec![bd_seq(number)],
        seq: None,
    }
    .encode_to_vec()
}

/// The node's birth, number 0 of its messages.
pub(super) fn node_birth(number: u64, unix_ms: u64) -> Vec<u8> {
    let rebirth = metric(REBIRTH, BOOLEAN, Some(Value::Boolean(false)));
    let metrics = vec![bd_seq(number), rebirth];
    Payload {
        timestamp: Some(unix_ms),
        metrics,
        seq: Some(0),
    }
    .encode_to_vec()
}

/// A board's birth or data. Births have the same metrics, so one form serves both; `seq` counts the
/// node's messages from 0 to 255.
pub(super) fn board_data(entry: &Entry, seq: u64, historical: bool) -> Vec<u8> {
    let mut metrics = metrics(&entry.report, entry.session);
    for metric in &mut metrics {
        metric.timestamp = Some(entry.unix_ms);
        metric.is_historical = historical.then_some(true);
    }
    Payload {
        timestamp: Some(entry.unix_ms),
        metrics,
        seq: Some(seq),
    }
    .encode_to_vec()
}

/// A board's death: its line has gone.
pub(super) fn board_death(seq: u64, unix_ms: u64) -> Vec<u8> {
    Payload {
        timestamp: Some(unix_ms),
        metrics: vec![],
        seq: Some(seq),
    }
    .encode_to_vec()
}

/// Whether a command to the node asks for births.
pub(super) fn asks_rebirth(payload: &[u8]) -> bool {
    let Ok(payload) = Payload::decode(payload) else {
        return false;
    };
    payload.metrics.iter().any(|metric| {
        metric.name.as_deref() == Some(REBIRTH) && metric.value == Some(Value::Boolean(true))
    })
}

fn metrics(report: &Report, session: u32) -> Vec<Metric> {
    let whole = |name: &str, value: u32| metric(name, UINT32, Some(Value::Int(value)));
    let real = |name: String, value: Option<f32>| metric(name, FLOAT, value.map(Value::Float));
    let mut metrics = vec![
        whole("session", session),
        whole("seq", report.seq),
        metric("time_ms", INT64, Some(Value::Long(report.time_ms))),
        real("window_s".to_owned(), Some(report.window_s)),
        real("fps".to_owned(), Some(report.fps)),
        whole("lines", report.lines),
        whole("lost_frames", report.lost_frames.into()),
        real("noise_px".to_owned(), Some(report.noise_px)),
        whole("warnings", report.warnings.bits()),
        real("um_per_px".to_owned(), report.um_per_px),
        real(
            "velocity_mm_s_rms".to_owned(),
            band_velocity(report).map(|v| v as f32),
        ),
        whole("peaks", report.peaks.len() as u32),
    ];
    for number in 0..MAX_PEAKS {
        let peak = report.peaks.get(number);
        let name = |what: &str| format!("peak {}/{what}", number + 1);
        metrics.push(real(name("hz"), peak.map(|peak| peak.hz)));
        metrics.push(real(
            name("amplitude_px"),
            peak.map(|peak| peak.amplitude_px),
        ));
        metrics.push(real(name("snr_db"), peak.map(|peak| peak.snr_db)));
        let ambiguous = peak.map(|peak| Value::Boolean(peak.ambiguous));
        metrics.push(metric(name("ambiguous"), BOOLEAN, ambiguous));
    }
    metrics
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes, field by field, as the protocol buffer's definition says.
    #[test]
    fn a_death_byte_by_byte() {
        // metrics: name "bdSeq", datatype 4, long_value 2
        let metric = [&[0x0a, 5][..], b"bdSeq", &[0x20, 4, 0x58, 2]].concat();
        let payload = [&[0x12, metric.len() as u8][..], &metric].concat();
        assert_eq!(node_death(258), payload);
    }

    #[test]
    fn births_and_data_have_the_same_metrics() {
        let report = rowtone_report::example(None);
        let mut entry = Entry {
            unix_ms: 7,
            board: "b".to_owned(),
            session: 1,
            report,
        };
        let first = Payload::decode(&board_data(&entry, 3, false)[..]).unwrap();
        entry.report.peaks.clear();
        let second = Payload::decode(&board_data(&entry, 4, true)[..]).unwrap();
        let names = |payload: &Payload| {
            payload
                .metrics
                .iter()
                .map(|m| m.name.clone())
                .collect::<Vec<_>>()
        };
        assert_eq!(names(&first), names(&second));
        assert_eq!((first.seq, second.seq), (Some(3), Some(4)));
        assert!(
            second
                .metrics
                .iter()
                .all(|metric| metric.is_historical == Some(true))
        );
        assert!(
            first
                .metrics
                .iter()
                .all(|m| m.value.is_some() != (m.is_null == Some(true)))
        );
    }

    #[test]
    fn a_host_asks_for_births() {
        let rebirth = metric(REBIRTH, BOOLEAN, Some(Value::Boolean(true)));
        let asked = Payload {
            timestamp: None,
            metrics: vec![rebirth],
            seq: None,
        }
        .encode_to_vec();
        assert!(asks_rebirth(&asked));
        assert!(!asks_rebirth(&node_birth(1, 2)));
        assert!(!asks_rebirth(b"noise"));
    }
}
