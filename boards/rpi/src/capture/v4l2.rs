//! The line time as the sensor's driver has it: line length / pixel rate.
//!
//! `V4L2_CID_PIXEL_RATE` and `V4L2_CID_HBLANK` of the sensor's sub-device; a line is as long as the mode is wide
//! plus the horizontal blank (Linux: Documentation/driver-api/media/camera-sensor.rst).
#![allow(unsafe_code)]

use std::fs::File;
use std::os::fd::AsRawFd;
use std::path::Path;

const CID_HBLANK: u32 = 0x009e_0902;
const CID_PIXEL_RATE: u32 = 0x009f_0902;

/// `struct v4l2_ext_control` (packed in the kernel's headers).
#[repr(C, packed)]
#[derive(Clone, Copy, Default)]
struct Control {
    id: u32,
    size: u32,
    reserved: u32,
    value: i64,
}

/// `struct v4l2_ext_controls`.
#[repr(C)]
struct Controls {
    which: u32,
    count: u32,
    error_index: u32,
    request_fd: i32,
    reserved: u32,
    controls: *mut Control,
}

/// `VIDIOC_G_EXT_CTRLS`: _IOWR('V', 71, struct v4l2_ext_controls).
const G_EXT_CTRLS: u64 = 3 << 30 | (size_of::<Controls>() as u64) << 16 | (b'V' as u64) << 8 | 71;

/// Line time of the sensor whose driver's name is part of `camera_id`, in the mode that is `width` wide, s.
/// `None` where the driver does not say.
pub(super) fn line_time_s(camera_id: &str, width: u32) -> Option<f64> {
    let folder = Path::new("/sys/class/video4linux");
    for entry in std::fs::read_dir(folder).ok()?.flatten() {
        let Ok(name) = std::fs::read_to_string(entry.path().join("name")) else {
            continue;
        };
        // "imx219 10-0010": the driver, bus and address.
        let driver = name.split_whitespace().next().unwrap_or_default();
        if driver.is_empty() || !camera_id.contains(driver) {
            continue;
        }
        let Ok(device) = File::open(Path::new("/dev").join(entry.file_name())) else {
            continue;
        };
        let (Some(rate), Some(blank)) = (read(&device, CID_PIXEL_RATE), read(&device, CID_HBLANK))
        else {
            continue;
        };
        if rate > 0 && blank >= 0 {
            return Some((f64::from(width) + blank as f64) / rate as f64);
        }
    }
    None
}

fn read(device: &File, id: u32) -> Option<i64> {
    let mut control = Control {
        id,
        ..Control::default()
    };
    let mut controls = Controls {
        which: 0, // the current value
        count: 1,
        error_index: 0,
        request_fd: 0,
        reserved: 0,
        controls: &mut control,
    };
    // SAFETY: the request carries the size of `Controls`, which has the layout of the kernel's struct; it points to
    // one control, which lives until the end of the call.
    let outcome = unsafe { libc::ioctl(device.as_raw_fd(), G_EXT_CTRLS as _, &mut controls) };
    let value = control.value;
    // A 32-bit control (the blank) fills the lower half only.
    let value = if id == CID_HBLANK {
        i64::from(value as i32)
    } else {
        value
    };
    (outcome == 0).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layouts_are_the_kernels() {
        assert_eq!(size_of::<Control>(), 20);
        #[cfg(target_pointer_width = "64")]
        assert_eq!(G_EXT_CTRLS, 0xc020_5647);
    }

    #[test]
    fn no_such_sensor_is_no_line_time() {
        assert_eq!(line_time_s("a camera that nobody has", 640), None);
    }
}
