//! Stages of modules that have few of them: entry points of WGSL files, compiled when they are first needed.

use std::collections::HashMap;

use super::{Access, Device, DeviceError, Kernel};

/// A stage: one entry point with all the files that it needs, except the head that its module puts before every shader.
#[derive(Debug)]
pub(crate) struct Stage {
    /// Its name.
    pub name: &'static str,
    /// The entry point.
    pub entry: &'static str,
    /// The WGSL files.
    pub files: &'static [&'static str],
    /// The access to its buffers.
    pub bindings: &'static [(u32, Access)],
}

impl Stage {
    /// Returns the whole WGSL after the given head.
    pub fn source(&self, head: &str) -> String {
        let mut text = head.to_owned();
        for file in self.files {
            text += "\n";
            text += file;
        }
        text
    }
}

/// The compiled stages of a module.
pub(crate) struct StageKernels {
    head: String,
    kernels: HashMap<&'static str, Kernel>,
}

impl StageKernels {
    /// Returns an empty set; each stage will have the given head: constants, structs and everything else that all
    /// share.
    pub fn new(head: String) -> StageKernels {
        StageKernels { head, kernels: HashMap::new() }
    }

    /// Returns the kernel of a stage.
    pub fn get(&mut self, device: &Device, stage: &'static Stage) -> Result<&Kernel, DeviceError> {
        if !self.kernels.contains_key(stage.name) {
            let kernel = Kernel::new(device, stage.name, &stage.source(&self.head), stage.entry, stage.bindings)?;
            self.kernels.insert(stage.name, kernel);
        }
        Ok(&self.kernels[stage.name])
    }
}
