//! Where frames are written to, and the requests that carry them.
//!
//! On a Raspberry Pi buffers come from libcamera's allocator. Where there is no dma-heap they are made of ordinary
//! memory, which the virtual pipeline takes.

use std::io;

use libcamera::framebuffer::{AsFrameBuffer, FrameBufferPlane, OwnedFrameBuffer};
use libcamera::framebuffer_allocator::{FrameBuffer, FrameBufferAllocator};
use libcamera::framebuffer_map::MemoryMappedFrameBuffer;
use libcamera::request::Request;

use super::opened::{Opened, refused};
use crate::capture::CameraError;
use crate::system::memory_file;

/// Buffers that go round.
pub(super) const BUFFERS: u32 = 6;

/// From libcamera's allocator.
pub(super) type Allocated = MemoryMappedFrameBuffer<FrameBuffer>;
/// Of ordinary memory.
pub(super) type Owned = MemoryMappedFrameBuffer<OwnedFrameBuffer>;

/// One request a buffer.
pub(super) fn requests(opened: &mut Opened) -> Result<Vec<Request>, CameraError> {
    let mut allocator = FrameBufferAllocator::new(&opened.camera);
    let mut requests = Vec::new();
    match allocator.alloc(&opened.stream) {
        Ok(buffers) => {
            for buffer in buffers {
                requests.push(request(opened, buffer)?);
            }
        }
        Err(_) => {
            for _ in 0..BUFFERS {
                let buffer = own_buffer(opened).map_err(refused("no memory for frames"))?;
                requests.push(request(opened, buffer)?);
            }
        }
    }
    Ok(requests)
}

fn request<B: AsFrameBuffer + 'static>(
    opened: &mut Opened,
    buffer: B,
) -> Result<Request, CameraError> {
    let mapped = MemoryMappedFrameBuffer::new(buffer)
        .map_err(|e| CameraError::Refused(format!("a buffer cannot be mapped: {e}")))?;
    let mut request = opened
        .camera
        .create_request(None)
        .ok_or_else(|| CameraError::Refused("it makes no requests".to_owned()))?;
    let added = request.add_buffer(&opened.stream, mapped);
    added.map_err(refused("it takes no buffer"))?;
    Ok(request)
}

fn own_buffer(opened: &Opened) -> io::Result<OwnedFrameBuffer> {
    let shape = &opened.facts.shape;
    let luma = (shape.stride * usize::from(shape.height)) as u32;
    let all = opened.frame_bytes;
    let file = memory_file(all as usize)?;
    let mut planes = Vec::new();
    // Semi-planar formats have their colours in a second plane.
    if opened.format.starts_with("NV") && all > luma {
        planes.push(FrameBufferPlane {
            fd: file.try_clone()?,
            offset: 0,
            length: luma,
        });
        planes.push(FrameBufferPlane {
            fd: file,
            offset: luma,
            length: all - luma,
        });
    } else {
        planes.push(FrameBufferPlane {
            fd: file,
            offset: 0,
            length: all,
        });
    }
    OwnedFrameBuffer::new(planes, None)
}
