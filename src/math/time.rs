//! Differences of times.

/// `later_ns − earlier_ns`, saturating. On a microcontroller it is called: 34 bytes in each of thirty places
/// are 1 KiB.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(crate) fn since(later_ns: i64, earlier_ns: i64) -> i64 {
    later_ns.saturating_sub(earlier_ns)
}
