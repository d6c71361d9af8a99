//! Choice of the device that walks the particles of a run: the CPU, or a GPU.

use crate::run::{Refusal, Run};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use transport::device::{Device, DeviceRun, check_device};

/// Fewest particles for which [`DeviceChoice::Auto`] chooses a GPU: starting it takes a second.
const MIN_PARTICLES: u64 = 100_000;

/// Device that a user asks for: `cpu`, `gpu`, `gpu:1`, or `auto`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum DeviceChoice {
    /// The CPU.
    #[default]
    Cpu,
    /// The GPU with this number.
    Gpu(usize),
    /// The first GPU, if it is hardware and suits the run; the CPU otherwise.
    Auto,
}

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().map(DeviceChoice::Gpu);
        let choice = match text.split_once(':') {
            Some(("gpu", text)) => number(text),
            None if text == "cpu" => Some(DeviceChoice::Cpu),
            None if text == "gpu" => Some(DeviceChoice::Gpu(0)),
            None if text == "auto" => Some(DeviceChoice::Auto),
            _ => None,
        };
        choice.ok_or_else(|| "write cpu, gpu, gpu:NUMBER or auto".into())
    }
}

impl fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            DeviceChoice::Cpu => f.write_str("cpu"),
            DeviceChoice::Gpu(number) => write!(f, "gpu:{number}"),
            DeviceChoice::Auto => f.write_str("auto"),
        }
    }
}

/// A GPU of this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct GpuDescription {
    /// Name.
    pub name: String,
    /// Kind: `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Largest buffer in bytes.
    pub memory: u64,
}

/// Returns true if this build can use GPUs.
pub fn has_gpu_support() -> bool {
    cfg!(feature = "gpu")
}

/// Lists the GPUs of this machine; none without [support](has_gpu_support).
pub fn gpus() -> Vec<GpuDescription> {
    gpu::list()
}

impl Run<'_> {
    /// Chooses the device of the run; its total must be known. Returns the reason for the choice if
    /// it was open.
    ///
    /// # Errors
    /// If there is no such GPU, or it cannot run the scene.
    pub fn choose_device(&mut self, choice: DeviceChoice) -> Result<Option<String>, Refusal> {
        match choice {
            DeviceChoice::Cpu => Ok(None),
            DeviceChoice::Gpu(number) => {
                self.check_device()?;
                self.use_device(gpu::open(number)?);
                Ok(None)
            }
            DeviceChoice::Auto => Ok(Some(self.choose_automatically())),
        }
    }

    /// Checks that a GPU can run the scene.
    ///
    /// # Errors
    /// Says what the scene has that GPUs do not support.
    pub fn check_device(&self) -> Result<(), Refusal> {
        if !self.has_meters() {
            let message = "a GPU walks particles to a fluencemeter, and this scene has a camera";
            return Err(Refusal::Device(message.into()));
        }
        let meters = self.loaded.meters();
        check_device(&self.loaded.groups, &meters).map_err(|e| Refusal::Device(e.to_string()))
    }

    /// Returns the name of the device: `cpu`, or the name of a GPU; `gpu` for merged parts.
    pub fn device_name(&self) -> &str {
        match (&self.device, self.batch) {
            (Some(device), _) => device.name(),
            (None, Some(_)) => "gpu",
            (None, None) => "cpu",
        }
    }

    /// Returns the device with the size of its batches.
    pub(crate) fn device_run(&self) -> Option<DeviceRun> {
        let device = self.device.clone()?;
        let batch = self.batch?;
        Some(DeviceRun { device, batch })
    }

    fn use_device(&mut self, device: Arc<dyn Device>) {
        let run = DeviceRun::new(device, self.total);
        (self.device, self.batch) = (Some(run.device), Some(run.batch));
    }

    fn choose_automatically(&mut self) -> String {
        let on_cpu = |why: &str| format!("on the CPU: {why}");
        if self.total.is_some_and(|total| total < MIN_PARTICLES) {
            return on_cpu(&format!("a GPU pays off from {MIN_PARTICLES} particles on"));
        }
        if let Err(refusal) = self.check_device() {
            return on_cpu(&refusal.to_string());
        }
        if gpu::list().first().is_none_or(|gpu| gpu.kind == "software") {
            return on_cpu("no GPU was found");
        }
        match gpu::open(0) {
            Ok(device) => {
                let reason = format!("on {}", device.name());
                self.use_device(device);
                reason
            }
            Err(refusal) => on_cpu(&refusal.to_string()),
        }
    }
}

#[cfg(feature = "gpu")]
mod gpu {
    use super::{Arc, Device, GpuDescription, Refusal};

    pub(super) fn list() -> Vec<GpuDescription> {
        let describe = |adapter: morgana_gpu::Adapter| GpuDescription {
            name: adapter.name,
            kind: adapter.kind.into(),
            driver: adapter.driver,
            memory: adapter.memory,
        };
        morgana_gpu::devices().into_iter().map(describe).collect()
    }

    pub(super) fn open(number: usize) -> Result<Arc<dyn Device>, Refusal> {
        match morgana_gpu::open(number) {
            Ok(gpu) => Ok(Arc::new(gpu)),
            Err(error) => Err(Refusal::Device(error.to_string())),
        }
    }
}

#[cfg(not(feature = "gpu"))]
mod gpu {
    use super::{Arc, Device, GpuDescription, Refusal};

    pub(super) fn list() -> Vec<GpuDescription> {
        Vec::new()
    }

    pub(super) fn open(_: usize) -> Result<Arc<dyn Device>, Refusal> {
        let message = "this build cannot use GPUs: build it with the feature gpu, or use the CPU";
        Err(Refusal::Device(message.into()))
    }
}
