//! Graphics processors of a machine (docs/theory.md#particles-on-a-device).

use crate::walk::GpuWalk;
use std::sync::{Arc, Mutex, PoisonError};
use transport::device::{Device, DeviceError, DeviceVolume, DeviceWalk, WalkLimits};
use wgpu::{Backends, DeviceType};

/// Graphics processor of this machine.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// Name of the processor.
    pub name: String,
    /// Kind: discrete, integrated, virtual, or software.
    pub kind: &'static str,
    /// Name and version of the driver.
    pub driver: String,
    /// Largest buffer that a shader can use, in bytes.
    pub memory: u64,
    adapter: wgpu::Adapter,
}

impl Adapter {
    /// Returns true if the processor is a program that runs on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == SOFTWARE
    }
}

const SOFTWARE: &str = "software";

/// Lists the graphics processors of this machine, hardware first. Each is listed once.
pub fn devices() -> Vec<Adapter> {
    let backends = Backends::VULKAN | Backends::METAL | Backends::DX12;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let found = pollster::block_on(instance.enumerate_adapters(backends));
    let described = found.into_iter().map(|adapter| {
        let info = adapter.get_info();
        let kind = match info.device_type {
            DeviceType::DiscreteGpu => "discrete",
            DeviceType::IntegratedGpu => "integrated",
            DeviceType::VirtualGpu => "virtual",
            DeviceType::Cpu => SOFTWARE,
            DeviceType::Other => "other",
        };
        Adapter {
            name: info.name,
            kind,
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .to_owned(),
            memory: adapter.limits().max_storage_buffer_binding_size,
            adapter,
        }
    });
    let mut devices: Vec<Adapter> = described.collect();
    devices.sort_by_key(Adapter::is_software);
    devices
}

/// Reason why there is no graphics processor.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The machine has none.
    #[error("no GPU was found: install its Vulkan driver, or use the CPU")]
    None,
    /// The machine has fewer.
    #[error("there is no GPU {0}: morgana info --devices lists {1}, counted from 0")]
    Number(usize, usize),
    /// The driver refused.
    #[error("{0} cannot be used: {1}")]
    Refused(String, String),
}

/// Opens a graphics processor by its number in [`devices()`].
///
/// # Errors
/// If there is none with this number, or its driver refuses.
pub fn open(number: usize) -> Result<Gpu, OpenError> {
    let mut devices = devices();
    let count = devices.len();
    if count == 0 {
        return Err(OpenError::None);
    }
    if number >= count {
        return Err(OpenError::Number(number, count));
    }
    Gpu::new(devices.swap_remove(number))
}

/// Graphics processor in use.
#[derive(Clone, Debug)]
pub struct Gpu {
    name: Arc<str>,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) is_software: bool,
    /// First error that the driver reported.
    failure: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    fn new(adapter: Adapter) -> Result<Self, OpenError> {
        let refused =
            |e: wgpu::RequestDeviceError| OpenError::Refused(adapter.name.clone(), e.to_string());
        let (device, queue) =
            pollster::block_on(adapter.adapter.request_device(&wgpu::DeviceDescriptor {
                required_limits: adapter.adapter.limits(),
                ..Default::default()
            }))
            .map_err(refused)?;
        let failure = Arc::new(Mutex::new(None));
        let record = {
            let failure = failure.clone();
            move |problem: String| {
                let mut failure = failure.lock().unwrap_or_else(PoisonError::into_inner);
                failure.get_or_insert(problem);
            }
        };
        // Without a handler, wgpu panics.
        let on_error = record.clone();
        device.on_uncaptured_error(Arc::new(move |error| on_error(error.to_string())));
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                record(format!("the device was lost: {message}"));
            }
        });
        Ok(Gpu {
            name: adapter.name.as_str().into(),
            device,
            queue,
            is_software: adapter.is_software(),
            failure,
        })
    }

    /// Returns an error if the driver has reported one.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        match &*failure {
            None => Ok(()),
            Some(problem) => Err(self.failed(problem)),
        }
    }

    pub(crate) fn too_large(&self, needed: u64, available: u64) -> DeviceError {
        DeviceError::Memory {
            name: self.name.to_string(),
            needed,
            available,
        }
    }

    pub(crate) fn failed(&self, problem: impl ToString) -> DeviceError {
        DeviceError::Failed {
            name: self.name.to_string(),
            problem: problem.to_string(),
        }
    }
}

impl Device for Gpu {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(
        &self,
        volume: &DeviceVolume,
        limits: WalkLimits,
    ) -> Result<Box<dyn DeviceWalk>, DeviceError> {
        Ok(Box::new(GpuWalk::new(self.clone(), volume, limits)?))
    }
}
