//! Walks of particles on a GPU, dispatch by dispatch (docs/theory.md#particles-on-a-device).

use crate::adapter::Gpu;
use crate::layout::{Params, SLOT_BYTES, STATE_BYTES, batch_sums, labels, matter, slots};
use transport::device::{BatchSums, DeviceError, DeviceRay, DeviceVolume, DeviceWalk, WalkLimits};
use transport::stop::Stop;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BindGroup, Buffer, BufferUsages, ComputePipeline};

const SHADER: &str = include_str!("walk.wgsl");
const WORKGROUP: u32 = 64;
/// Threads of a dispatch: enough to hide the latency of memory, on a GPU and in software.
const THREADS: u32 = 1 << 17;
const SOFTWARE_THREADS: u32 = 1 << 12;
/// Segments of a thread in one dispatch: some milliseconds to a second, below the limits at which
/// systems reset a GPU, and below the 65,535 iterations at which lavapipe ends loops without a word.
const SEGMENTS: u32 = 1 << 10;
/// Dispatches that are submitted at once.
const IN_FLIGHT: usize = 2;
/// Particles that are copied to the device at once.
const MAX_RAYS: usize = 1 << 20;
/// Most memory for the sums of batches, in bytes.
const MAX_SUMS: u64 = 1 << 29;
/// Dispatches without the end of any particle after which the device is believed to hang.
const MAX_IDLE: usize = 20_000;

/// Volume on a GPU, with the buffers of its walks.
#[derive(Debug)]
pub(crate) struct GpuWalk {
    gpu: Gpu,
    pipeline: ComputePipeline,
    bindings: BindGroup,
    params: Params,
    uniform: Buffer,
    rays: Buffer,
    states: Buffer,
    sums: Buffer,
    counters: Buffer,
    /// Buffers that the processor reads.
    read_sums: Buffer,
    read_counters: Buffer,
    slots: usize,
    max_batches: usize,
}

impl GpuWalk {
    /// Copies a volume to the GPU.
    pub(crate) fn new(
        gpu: Gpu,
        volume: &DeviceVolume,
        limits: WalkLimits,
    ) -> Result<Self, DeviceError> {
        let threads = if gpu.is_software {
            SOFTWARE_THREADS
        } else {
            THREADS
        };
        let slots = slots(volume);
        let max_batches = max_batches(&gpu, slots)?;
        let device = &gpu.device;
        let init = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let empty = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let params = Params::new(volume, limits, [SEGMENTS, threads]);
        let uniform = init(
            bytemuck::bytes_of(&params),
            BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        );
        let spline = volume.index.as_ref();
        let spline = spline.map_or(&[0.0f32][..], |index| &index.spline.values);
        let work = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let sums_bytes = max_batches as u64 * slots as u64 * SLOT_BYTES;
        let labels = init(&labels(volume), BufferUsages::STORAGE);
        let matter = init(bytemuck::cast_slice(&matter(volume)), BufferUsages::STORAGE);
        let spline = init(bytemuck::cast_slice(spline), BufferUsages::STORAGE);
        let rays = empty((MAX_RAYS * size_of::<DeviceRay>()) as u64, work);
        let states = empty(u64::from(threads) * STATE_BYTES, work);
        let sums = empty(sums_bytes, work | BufferUsages::COPY_SRC);
        let counters = empty(SLOT_BYTES, work | BufferUsages::COPY_SRC);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let constants = [("CURVED", f64::from(u8::from(volume.index.is_some())))];
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("walk"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        });
        gpu.check()?;
        let buffers = [
            &uniform, &labels, &matter, &spline, &rays, &states, &sums, &counters,
        ];
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let walk = GpuWalk {
            read_sums: empty(sums_bytes, read),
            read_counters: empty(SLOT_BYTES, read),
            pipeline,
            bindings,
            params,
            uniform,
            rays,
            states,
            sums,
            counters,
            slots,
            max_batches,
            gpu,
        };
        walk.gpu.check()?;
        Ok(walk)
    }

    /// Walks particles that fit into the buffer to their ends. Adds to the sums.
    fn walk_some(&self, rays: &[DeviceRay], stop: &Stop) -> Result<(), DeviceError> {
        let queue = &self.gpu.queue;
        let params = self.params.with_rays(rays.len() as u32);
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&params));
        queue.write_buffer(&self.rays, 0, bytemuck::cast_slice(rays));
        self.submit(|encoder| {
            encoder.clear_buffer(&self.counters, 0, None);
            encoder.clear_buffer(&self.states, 0, None);
        });
        let (mut ended, mut idle) = (0, 0);
        while (ended as usize) < rays.len() && !stop.is_raised() {
            for _ in 0..IN_FLIGHT {
                self.dispatch();
            }
            let counters = self.read(&self.counters, &self.read_counters, SLOT_BYTES)?;
            let before = std::mem::replace(&mut ended, (counters[0] >> 32) as u32);
            idle = if ended > before { 0 } else { idle + IN_FLIGHT };
            if idle > MAX_IDLE {
                return Err(self.gpu.failed("its walks make no progress"));
            }
        }
        Ok(())
    }

    fn dispatch(&self) {
        self.submit(|encoder| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.dispatch_workgroups(self.params.threads.div_ceil(WORKGROUP), 1, 1);
        });
    }

    fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        record(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// Copies the start of a buffer to the processor.
    fn read(&self, from: &Buffer, to: &Buffer, bytes: u64) -> Result<Vec<u64>, DeviceError> {
        self.submit(|encoder| encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes));
        let slice = to.slice(..bytes);
        slice.map_async(wgpu::MapMode::Read, |_| ());
        let waited = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        waited.map_err(|e| self.gpu.failed(e))?;
        self.gpu.check()?;
        let mapped = slice.get_mapped_range().map_err(|e| self.gpu.failed(e))?;
        let words = bytemuck::pod_collect_to_vec(&mapped);
        drop(mapped);
        to.unmap();
        Ok(words)
    }
}

impl DeviceWalk for GpuWalk {
    fn max_batches(&self) -> usize {
        self.max_batches
    }

    fn walk(
        &self,
        rays: &[DeviceRay],
        batches: usize,
        stop: &Stop,
    ) -> Result<Vec<BatchSums>, DeviceError> {
        self.submit(|encoder| encoder.clear_buffer(&self.sums, 0, None));
        for rays in rays.chunks(MAX_RAYS) {
            self.walk_some(rays, stop)?;
        }
        let bytes = (batches * self.slots) as u64 * SLOT_BYTES;
        let words = self.read(&self.sums, &self.read_sums, bytes)?;
        Ok(words.chunks(self.slots).map(batch_sums).collect())
    }
}

/// Returns the number of batches whose sums fit into the memory of a GPU.
fn max_batches(gpu: &Gpu, slots: usize) -> Result<usize, DeviceError> {
    let limits = gpu.device.limits();
    let available = limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size);
    let needed = slots as u64 * SLOT_BYTES;
    match available.min(MAX_SUMS.max(needed)) / needed {
        0 => Err(gpu.too_large(needed, available)),
        batches => Ok(batches as usize),
    }
}
