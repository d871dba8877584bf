//! Colour maps whose lightness rises evenly, so that they read the same with any colour vision and in grey.

/// The map for the thickness of the solid: cividis, made for readers with any colour vision (Nuñez, Anderton & Renslow 2018).
pub const SOLID: [[u8; 3]; 11] = [
    [0, 34, 78],
    [18, 53, 112],
    [59, 73, 108],
    [87, 93, 109],
    [112, 113, 115],
    [138, 134, 120],
    [165, 156, 116],
    [195, 179, 105],
    [225, 204, 85],
    [243, 221, 66],
    [254, 232, 56],
];

/// The map for the width of pores: viridis (Smith & van der Walt 2015).
pub const PORE: [[u8; 3]; 11] = [
    [68, 1, 84],
    [72, 36, 117],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [68, 191, 112],
    [122, 209, 81],
    [189, 223, 38],
    [253, 231, 37],
];

/// Returns the colour of a share from 0 to 1 along a map.
pub fn along(map: &[[u8; 3]; 11], share: f64) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (map.len() - 1) as f64;
    let i = (place as usize).min(map.len() - 2);
    let t = place - i as f64;
    std::array::from_fn(|c| {
        let [from, to] = [map[i][c], map[i + 1][c]].map(f64::from);
        (from + t * (to - from)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_rises_along_a_map() {
        for map in [SOLID, PORE] {
            let lightness = |share: f64| {
                let [r, g, b] = along(&map, share).map(f64::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            assert!((1..=50).all(|i| lightness(f64::from(i) / 50.0) > lightness(f64::from(i - 1) / 50.0)));
            assert_eq!((along(&map, -1.0), along(&map, 2.0)), (map[0], map[10]));
        }
    }
}
