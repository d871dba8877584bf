//! Structs shared by the host and shaders.

/// Declares a struct of 32-bit numbers, and of an array of such structs at its end, in Rust and, under the same name and with
/// the same members, in WGSL.
macro_rules! shared_struct {
    (@wgsl $kind:ident) => { stringify!($kind) };
    (@wgsl $kind:ident atomic) => { concat!("atomic<", stringify!($kind), ">") };
    ($(#[$about:meta])* $visibility:vis struct $name:ident {
        $($(#[$doc:meta])* $field:ident: $kind:ident $($atomic:ident)?,)*
        $(; $(#[$of:meta])* $array:ident: [$element:ident; $length:literal])?
    }) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name {
            $($(#[$doc])* pub $field: $kind,)*
            $($(#[$of])* pub $array: [$element; $length],)?
        }

        impl $name {
            /// The struct in WGSL.
            pub const WGSL: &'static str = concat!(
                "struct ", stringify!($name), " {\n",
                $("    ", stringify!($field), ": ", shared_struct!(@wgsl $kind $($atomic)?), ",\n",)*
                $("    ", stringify!($array), ": array<", stringify!($element), ", ", stringify!($length), ">,\n",)?
                "}\n",
            );

            /// The struct in WGSL without atomics, for stages that only read it; its name ends in `Read`.
            #[allow(dead_code, reason = "few structs have such stages")]
            pub const READ_WGSL: &'static str = concat!(
                "struct ", stringify!($name), "Read {\n",
                $("    ", stringify!($field), ": ", stringify!($kind), ",\n",)*
                "}\n",
            );

            /// The members and their offsets in bytes.
            #[cfg(test)]
            pub const OFFSETS: &'static [(&'static str, usize)] = &[
                $((stringify!($field), std::mem::offset_of!($name, $field)),)*
                $((stringify!($array), std::mem::offset_of!($name, $array)),)?
            ];
        }
    };
}

pub(crate) use shared_struct;
