//! The integer sums of an image from which its moments are computed. Like those for the volume they are few, so a GPU transfers
//! them instead of the image.

use crate::parallel::*;

use super::{Ldi, Spans};
use crate::cancel::checkpoint;

/// Exact sums over the columns of an image: the volume integrals of the monomials up to degree two in column, row and depth.
/// Columns and rows count in half pixels from the corner of the image, depths in lattice steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MomentSums {
    /// ∫ 1: the length of all rays together.
    pub one: i128,
    /// ∫ column.
    pub column: i128,
    /// ∫ row.
    pub row: i128,
    /// 2 ∫ depth.
    pub twice_depth: i128,
    /// ∫ column².
    pub column_column: i128,
    /// ∫ row².
    pub row_row: i128,
    /// 3 ∫ depth².
    pub thrice_depth_depth: i128,
    /// ∫ column · row.
    pub column_row: i128,
    /// 2 ∫ column · depth.
    pub twice_column_depth: i128,
    /// 2 ∫ row · depth.
    pub twice_row_depth: i128,
    /// The number of samples at the depth of the sample before on their ray.
    pub coincident: u64,
}

impl MomentSums {
    /// Returns the sums over one row of columns.
    fn of_row(image: &Ldi, row: u32) -> MomentSums {
        checkpoint();
        let (columns, _) = image.size();
        let mut sums = MomentSums::default();
        for column in 0..columns {
            // On a ray of at most 2^30 steps Σ(end − start) ≤ 2^30 and Σ(end² − start²) ≤ 2^60.
            let (mut one, mut two, mut three) = (0i64, 0i64, 0i128);
            let samples = image.samples(row * columns + column);
            sums.coincident += samples.windows(2).filter(|pair| pair[0] == pair[1]).count() as u64;
            for (start, end) in Spans::new(samples) {
                let (start, end) = (i64::from(start), i64::from(end));
                one += end - start;
                two += (end - start) * (end + start);
                three += i128::from(end - start) * i128::from(end * end + end * start + start * start);
            }
            let column = i64::from(2 * column + 1);
            sums.one += i128::from(one);
            sums.column += i128::from(column * one);
            sums.twice_depth += i128::from(two);
            sums.column_column += i128::from(column * column) * i128::from(one);
            sums.thrice_depth_depth += three;
            sums.twice_column_depth += i128::from(column) * i128::from(two);
        }
        let row = i128::from(2 * row + 1);
        sums.row = row * sums.one;
        sums.row_row = row * row * sums.one;
        sums.column_row = row * sums.column;
        sums.twice_row_depth = row * sums.twice_depth;
        sums
    }

    /// Returns the sums over both.
    pub fn plus(self, other: MomentSums) -> MomentSums {
        MomentSums {
            one: self.one + other.one,
            column: self.column + other.column,
            row: self.row + other.row,
            twice_depth: self.twice_depth + other.twice_depth,
            column_column: self.column_column + other.column_column,
            row_row: self.row_row + other.row_row,
            thrice_depth_depth: self.thrice_depth_depth + other.thrice_depth_depth,
            column_row: self.column_row + other.column_row,
            twice_column_depth: self.twice_column_depth + other.twice_column_depth,
            twice_row_depth: self.twice_row_depth + other.twice_row_depth,
            coincident: self.coincident + other.coincident,
        }
    }
}

impl Ldi {
    /// Sums the image for its moments, in one pass.
    pub fn moment_sums(&self) -> MomentSums {
        let (_, rows) = self.size();
        let of_row = |row| MomentSums::of_row(self, row);
        (0..rows).into_par_iter().map(of_row).reduce(MomentSums::default, MomentSums::plus)
    }
}
