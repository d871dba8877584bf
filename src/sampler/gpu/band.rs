//! Bands of rays, as large as the device can hold.

use std::ops::Range;

use crate::grid::Axis;

/// Consecutive rays of an image: whole rows, or part of one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// The direction of the rays.
    pub axis: Axis,
    /// The first row.
    pub first_row: u32,
    /// The number of rows.
    pub rows: u32,
    first_column: u32,
    end_column: u32,
    /// The counted rows; those beside them serve only for comparison.
    first_counted: u32,
    end_counted: u32,
}

impl Band {
    /// Returns the band of the given rows of an image with this many columns.
    pub fn of_rows(axis: Axis, rows: Range<u32>, columns: u32) -> Band {
        Band::with_neighbours(axis, rows.clone(), rows, columns)
    }

    /// Returns the band of the given rows, of which only some are counted.
    pub fn with_neighbours(axis: Axis, rows: Range<u32>, counted: Range<u32>, columns: u32) -> Band {
        Band {
            axis,
            first_row: rows.start,
            rows: rows.end - rows.start,
            first_column: 0,
            end_column: columns,
            first_counted: counted.start,
            end_counted: counted.end,
        }
    }

    /// Returns the counted rays, relative to the first of the band.
    pub fn counted(&self) -> Range<u32> {
        let columns = self.end_column - self.first_column;
        (self.first_counted - self.first_row) * columns..(self.end_counted - self.first_row) * columns
    }

    /// Returns the range of columns.
    pub fn columns(&self) -> Range<u32> {
        self.first_column..self.end_column
    }

    /// Returns the number of rays.
    pub fn rays(&self) -> u32 {
        self.rows * (self.end_column - self.first_column)
    }

    /// Returns the counted rows.
    pub fn counted_rows(&self) -> Range<u32> {
        self.first_counted..self.end_counted
    }

    /// Returns both halves of a band whose rows are all counted, in the order of their rays, or `None` for a single
    /// ray.
    pub fn halves(&self) -> Option<[Band; 2]> {
        let columns = self.end_column - self.first_column;
        if self.rows > 1 {
            let rows = self.first_row..self.first_row + self.rows;
            let middle = self.first_row + self.rows / 2;
            return Some([rows.start..middle, middle..rows.end].map(|rows| Band::of_rows(self.axis, rows, columns)));
        }
        let middle = self.first_column + columns / 2;
        (columns > 1).then_some([Band { end_column: middle, ..*self }, Band { first_column: middle, ..*self }])
    }
}

/// Divides rows into bands of at most `most_rays` rays, in the order of their rays.
pub fn cut(axis: Axis, rows: Range<u32>, columns: u32, most_rays: u32) -> Vec<Band> {
    let most_rays = most_rays.max(1);
    let rows_at_once = most_rays / columns;
    let starts = |range: Range<u32>, step: u32| range.step_by(step as usize);
    if rows_at_once > 0 {
        let band = |first: u32| Band::of_rows(axis, first..rows.end.min(first.saturating_add(rows_at_once)), columns);
        return starts(rows.clone(), rows_at_once).map(band).collect();
    }
    let part = |row: u32, first: u32| Band {
        first_column: first,
        end_column: columns.min(first.saturating_add(most_rays)),
        ..Band::of_rows(axis, row..row + 1, columns)
    };
    rows.flat_map(|row| starts(0..columns, most_rays).map(move |first| part(row, first))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rays_in_order(bands: &[Band], columns: u32) -> Vec<u32> {
        let rays = |band: &Band| {
            let band = *band;
            (0..band.rows)
                .flat_map(move |row| band.columns().map(move |column| (band.first_row + row) * columns + column))
        };
        bands.iter().flat_map(rays).collect()
    }

    #[test]
    fn bands_hold_every_ray_once_and_in_order() {
        for (rows, columns, most) in
            [(0..7, 5, 100), (2..9, 5, 11), (0..3, 17, 4), (1..2, 1, 1), (0..4, 4, 0), (3..3, 8, 8)]
        {
            let bands = cut(Axis::Y, rows.clone(), columns, most);
            let expected: Vec<u32> = (rows.start * columns..rows.end * columns).collect();
            assert_eq!(rays_in_order(&bands, columns), expected, "{rows:?}, {columns}, {most}");
            assert!(bands.iter().all(|band| band.rays() <= most.max(1) && band.rays() > 0));
        }
    }

    #[test]
    fn halves_hold_the_same_rays() {
        let mut bands = vec![Band::of_rows(Axis::X, 1..6, 7)];
        while let Some(place) = bands.iter().position(|band| band.rays() > 1) {
            let halves = bands[place].halves().unwrap();
            bands.splice(place..=place, halves);
        }
        assert_eq!(rays_in_order(&bands, 7), (7..42).collect::<Vec<u32>>());
        assert_eq!(bands[0].halves(), None);
    }
}
