//! Structs shared by the host and shaders.

/// Declares a struct of 32-bit numbers in Rust and, under the same name and with the same members, in WGSL.
macro_rules! shared_struct {
    (@wgsl $kind:ident) => { stringify!($kind) };
    (@wgsl $kind:ident atomic) => { concat!("atomic<", stringify!($kind), ">") };
    ($(#[$about:meta])* $visibility:vis struct $name:ident { $($(#[$doc:meta])* $field:ident: $kind:ident $($atomic:ident)?,)* }) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name {
            $($(#[$doc])* pub $field: $kind,)*
        }

        impl $name {
            /// The struct in WGSL.
            pub const WGSL: &'static str = concat!(
                "struct ", stringify!($name), " {\n",
                $("    ", stringify!($field), ": ", shared_struct!(@wgsl $kind $($atomic)?), ",\n",)*
                "}\n",
            );

            /// The members and their offsets in bytes.
            #[cfg(test)]
            pub const OFFSETS: [(&'static str, usize); [$(stringify!($field)),*].len()] =
                [$((stringify!($field), std::mem::offset_of!($name, $field))),*];
        }
    };
}

pub(crate) use shared_struct;
