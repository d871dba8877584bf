//! Stages of rooms that have few of them: entry points of WGSL files, compiled when they are first asked for.

use std::collections::HashMap;

use super::{Access, Device, DeviceError, Kernel};

/// A stage: one entry point with all that it stands on but what its room puts before every shader.
#[derive(Debug)]
pub(crate) struct Stage {
    /// Its name.
    pub name: &'static str,
    /// The entry point.
    pub entry: &'static str,
    /// WGSL, file by file.
    pub files: &'static [&'static str],
    /// How it sees its buffers.
    pub bindings: &'static [(u32, Access)],
}

impl Stage {
    /// The whole WGSL behind the given head.
    pub fn source(&self, head: &str) -> String {
        let mut text = head.to_owned();
        for file in self.files {
            text += "\n";
            text += file;
        }
        text
    }
}

/// The compiled stages of a room.
pub(crate) struct StageKernels {
    head: String,
    kernels: HashMap<&'static str, Kernel>,
}

impl StageKernels {
    /// None yet; each is to have the given head: constants, structs and what else all of them share.
    pub fn new(head: String) -> StageKernels {
        StageKernels { head, kernels: HashMap::new() }
    }

    /// The kernel of a stage.
    pub fn get(&mut self, device: &Device, stage: &'static Stage) -> Result<&Kernel, DeviceError> {
        if !self.kernels.contains_key(stage.name) {
            let kernel = Kernel::new(device, stage.name, &stage.source(&self.head), stage.entry, stage.bindings)?;
            self.kernels.insert(stage.name, kernel);
        }
        Ok(&self.kernels[stage.name])
    }
}
