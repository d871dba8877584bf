//! The place of a triangle relative to a cell: a separating plane with more than the rounding error between the two is the proof
//! that they do not meet (Akenine-Möller, "Fast 3D triangle-box overlap testing", Journal of Graphics Tools 6, 2001).

use glam::DVec3;

use super::cell::Cell;

/// The place of a triangle relative to a cell and to the column below it, the part of space from which rays along +x run into
/// the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// It meets neither the inner points of the cell nor those of the column.
    Off,
    /// It does not meet the inner points of the cell, and every ray of the column crosses it: the winding number of the whole
    /// cell changes by this number.
    Across(i32),
    /// It does not meet the inner points of the cell, and may meet the column.
    Below,
    /// It may meet the cell.
    Inside,
}

/// Bounds of the rounding errors below, as shares of the square and of the cube of the largest coordinate. Coordinates relative
/// to the centre are rounded by a share 2⁻⁵³, differences of them by 2⁻⁵¹ of the largest coordinate m; a product of two has an
/// error below 2⁻⁴⁹ m², and a sum of four below 2⁻⁴⁷ m²; a sum of three products with a third coordinate below 2⁻⁴⁵ m³.
const SQUARE: f64 = 1.0 / (1u64 << 46) as f64;
const CUBE: f64 = 1.0 / (1u64 << 44) as f64;

/// Finds the place of a triangle; `may_meet` is false where it is known not to meet the inner points of the cell.
pub(super) fn place(corners: &[DVec3; 3], cell: &Cell, may_meet: bool) -> Place {
    let [a, b, c] = *corners;
    let (min, max) = (a.min(b).min(c), a.max(b).max(c));
    // Comparisons of the coordinates as given are exact.
    let is_beside = |axis: usize| max[axis] <= cell.min[axis] || min[axis] >= cell.max[axis];
    if is_beside(1) || is_beside(2) || min.x >= cell.max.x {
        return Place::Off;
    }
    let frame = Frame::new(corners, cell);
    let along_x = frame.shadow(0);
    if along_x.is_apart {
        return Place::Off;
    }
    let is_below = max.x <= cell.min.x;
    if may_meet && !is_below {
        match frame.side_of_plane(&along_x) {
            Side::Meets if !frame.shadow(1).is_apart && !frame.shadow(2).is_apart => return Place::Inside,
            Side::Beyond if along_x.covers != 0 => return Place::Off,
            Side::Below if along_x.covers != 0 => return Place::Across(-along_x.covers),
            _ => return Place::Below,
        }
    }
    match is_below && along_x.covers != 0 {
        true => Place::Across(-along_x.covers),
        false => Place::Below,
    }
}

/// A triangle relative to the centre of a cell.
struct Frame {
    corners: [DVec3; 3],
    /// Half the sides of the cell, rounded up.
    half: DVec3,
    /// The largest coordinate.
    reach: f64,
}

/// The shadows of triangle and cell along an axis.
struct Shadow {
    /// True if a line certainly separates the inner points of the shadows.
    is_apart: bool,
    /// The sign of the area of the triangle's shadow, if it certainly contains the shadow of the cell, else 0.
    covers: i32,
    /// Twice the area of the triangle's shadow, with its sign.
    area: f64,
}

/// The side of a triangle's plane on which a cell lies, along x.
enum Side {
    /// The plane may meet the cell.
    Meets,
    /// The plane lies below the cell.
    Below,
    /// The plane lies beyond the cell.
    Beyond,
}

impl Frame {
    fn new(corners: &[DVec3; 3], cell: &Cell) -> Frame {
        let centre = cell.min + 0.5 * (cell.max - cell.min);
        let corners = corners.map(|corner| corner - centre);
        let half = (centre - cell.min).max(cell.max - centre) * (1.0 + 4.0 * f64::EPSILON);
        let reach = corners.iter().fold(half, |reach, corner| reach.max(corner.abs())).max_element();
        Frame { corners, half, reach }
    }

    fn shadow(&self, axis: usize) -> Shadow {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let point = |corner: usize| [self.corners[corner][i], self.corners[corner][j]];
        let [a, b, c] = [point(0), point(1), point(2)];
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let error = SQUARE * self.reach * self.reach;
        let mut shadow = Shadow { is_apart: false, covers: if area > 0.0 { 1 } else { -1 }, area };
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let side = [to[0] - from[0], to[1] - from[1]];
            // Along the normal of the side, the triangle reaches from 0 to `area`, the cell from `middle` ∓ `radius`.
            let middle = side[1] * from[0] - side[0] * from[1];
            let radius = side[1].abs() * self.half[i] + side[0].abs() * self.half[j];
            shadow.is_apart |= middle - radius > area.max(0.0) + error || middle + radius < area.min(0.0) - error;
            if f64::from(shadow.covers) * middle <= radius + error {
                shadow.covers = 0;
            }
        }
        shadow
    }

    fn side_of_plane(&self, along_x: &Shadow) -> Side {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let distance = normal.dot(a);
        let radius = normal.abs().dot(self.half);
        match distance.abs() > radius + CUBE * self.reach * self.reach * self.reach {
            false => Side::Meets,
            true if (distance > 0.0) == (along_x.area > 0.0) => Side::Beyond,
            true => Side::Below,
        }
    }
}
