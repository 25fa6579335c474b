//! The line time as the sensor's driver has it: line length / pixel rate.
//!
//! `V4L2_CID_PIXEL_RATE` and `V4L2_CID_HBLANK` of the sensor's sub-device; a line is as long as the mode is wide
//! plus the horizontal blank (Linux: Documentation/driver-api/media/camera-sensor.rst).
#![allow(unsafe_code)]

use std::fs::File;
use std::os::fd::AsRawFd;
use std::path::Path;

use crate::sensor::mended_pixel_rate_hz;

const MENDED: &str = "the sensor's driver, its pixel rate of 55 MHz mended to 58.333 MHz";

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

/// Line time of the sensor whose driver's name is part of `camera_id`, in the mode that is `width` wide and set up, s,
/// and who says so. `None` where the driver does not say.
pub(super) fn line_time_s(camera_id: &str, width: u32) -> Option<(f64, &'static str)> {
    let folder = Path::new("/sys/class/video4linux");
    for entry in std::fs::read_dir(folder).ok()?.flatten() {
        let Ok(name) = std::fs::read_to_string(entry.path().join("name")) else {
            continue;
        };
        // "imx219 10-0010": the driver, bus and address.
        let driver = name.split_whitespace().next().unwrap_or_default();
        let node = std::fs::canonicalize(entry.path().join("device/of_node")).ok();
        if !is_of(camera_id, driver, node.as_deref()) {
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
            let clocks = f64::from(width) + blank as f64;
            return Some(match mended_pixel_rate_hz(driver, rate) {
                Some(rate) => (clocks / rate as f64, MENDED),
                None => (clocks / rate as f64, "the sensor's driver"),
            });
        }
    }
    None
}

/// The sub-device is the camera's: it has the camera's node in the device tree (two cameras may be of one kind), or,
/// where there is no device tree, its driver's name.
fn is_of(camera_id: &str, driver: &str, node: Option<&Path>) -> bool {
    !driver.is_empty()
        && camera_id.contains(driver)
        && node.is_none_or(|node| node.to_string_lossy().ends_with(camera_id))
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
    fn of_two_equal_cameras_the_right_one_is_asked() {
        let id = "/base/axi/pcie@120000/rp1/i2c@88000/imx219@10";
        let node = |bus: &str| {
            let base = "/sys/firmware/devicetree/base/axi/pcie@120000/rp1";
            Path::new(base).join(bus).join("imx219@10")
        };
        assert!(is_of(id, "imx219", Some(&node("i2c@88000"))));
        assert!(!is_of(id, "imx219", Some(&node("i2c@80000"))));
        assert!(is_of(id, "imx219", None) && !is_of(id, "imx477", None) && !is_of(id, "", None));
    }

    #[test]
    fn no_such_sensor_is_no_line_time() {
        assert_eq!(line_time_s("a camera that nobody has", 640), None);
    }
}
