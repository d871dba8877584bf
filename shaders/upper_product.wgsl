// Returns the upper word of the product of two words.
fn upper_product(a: u32, b: u32) -> u32 {
    let al = a & 0xffffu;
    let ah = a >> 16u;
    let bl = b & 0xffffu;
    let bh = b >> 16u;
    let across = ah * bl + ((al * bl) >> 16u);
    let other = al * bh + (across & 0xffffu);
    return ah * bh + (across >> 16u) + (other >> 16u);
}
