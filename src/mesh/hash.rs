//! Hashes of positions, of 128 bits: equal positions have equal hashes.

use glam::DVec3;

/// Two lanes of 64 bits, computed independently.
pub type Hash = [u64; 2];

/// The first 1024 binary digits of the fraction of π: constants that leave no choice.
pub const PI: [u64; 16] = [
    0x243f_6a88_85a3_08d3,
    0x1319_8a2e_0370_7344,
    0xa409_3822_299f_31d0,
    0x082e_fa98_ec4e_6c89,
    0x4528_21e6_38d0_1377,
    0xbe54_66cf_34e9_0c6c,
    0xc0ac_29b7_c97c_50dd,
    0x3f84_d5b5_b547_0917,
    0x9216_d5d9_8979_fb1b,
    0xd131_0ba6_98df_b5ac,
    0x2ffd_72db_d01a_dfb7,
    0xb8e1_afed_6a26_7e96,
    0xba7c_9045_f12c_7f99,
    0x24a1_9947_b391_6cf7,
    0x0801_f2e2_858e_fc16,
    0x6369_20d8_7157_4e69,
];

/// Multiplies and XORs the two halves of the full product.
#[inline(always)]
pub fn mix(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}

/// Hashes a position; −0 and 0 are the same coordinate.
#[inline(always)]
pub fn position_hash(position: DVec3) -> Hash {
    // Adding +0 turns −0 into +0 and changes no other number.
    let [x, y, z] = position.to_array().map(|coordinate| (coordinate + 0.0).to_bits());
    [mix(mix(x ^ PI[0], y ^ PI[1]) ^ PI[2], z ^ PI[3]), mix(mix(y ^ PI[4], z ^ PI[5]) ^ PI[6], x ^ PI[7])]
}
