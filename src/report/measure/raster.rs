//! The raster of a report, and the exact images on it.

use super::Shells;
use crate::Error;
use crate::boolean::{BooleanOperation, merge};
use crate::driver::input::Solid;
use crate::driver::job::Spacing;
use crate::driver::machine;
use crate::grid::{Axis, Grid, LOD_RANGE, LatticeBox, LatticeSolid};
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::Ldi;
use crate::metrics::surface_area::{Scale, SurfaceElements};
use crate::metrics::{BoundaryCondition, Facets, Region};
use crate::number::number;
use crate::sampler::{FillRule, Sampler};

/// Memory per node in bytes while most arrays are alive: a distance, its site, two maps, and smaller data.
const BYTES_OF_NODE: u64 = 20;

/// Rasters of fewer nodes are never the cause of running out of memory.
const FEW_NODES: u64 = 1 << 24;

/// Limit of the number of nodes: indices have 31 bits.
const NODES_MAX: u64 = 1 << 31;

/// A solid and its region of interest.
#[derive(Clone, Copy)]
pub struct Subject<'s> {
    pub solid: &'s Solid,
    /// The region of interest; the solid's box if `None`.
    pub roi: Option<&'s Solid>,
}

impl Subject<'_> {
    /// Returns a grid whose pitch follows from the region and which contains solid and region.
    pub fn grid(&self, spacing: Spacing, edges: BoundaryCondition) -> Result<Grid, Error> {
        let region = self.roi.unwrap_or(self.solid);
        let bounds = region.bounds();
        let refused = |error| Error::input(format!("{}: {error}", region.name()));
        let lod = *LOD_RANGE.start();
        let of_region = match spacing {
            Spacing::Resolution(rays) => Grid::with_resolution(bounds, rays, lod),
            Spacing::Pitch(pitch) => Grid::with_pitch(bounds, pitch, lod),
            Spacing::Tolerance(_) => unreachable!("reports have no tolerance"),
        };
        let of_region = of_region.map_err(refused)?;
        if edges == BoundaryCondition::Periodic {
            self.whole(&of_region)?;
        }
        let grid = match self.roi {
            None => of_region,
            Some(_) => self.grid_of_pitch(of_region.pitch())?,
        };
        self.admit(&grid)?;
        Ok(grid)
    }

    /// Rejects rasters whose fields would not fit into memory, before the system kills the process.
    fn admit(&self, grid: &Grid) -> Result<(), Error> {
        let nodes: u64 = grid.rays().into_iter().map(u64::from).product();
        let needed = nodes * BYTES_OF_NODE;
        let free = machine::free_memory().unwrap_or(u64::MAX);
        if nodes < NODES_MAX && (needed < free || nodes < FEW_NODES) {
            return Ok(());
        }
        let [x, y, z] = grid.rays();
        let fits = (free.min(NODES_MAX * BYTES_OF_NODE) as f64 / needed as f64).cbrt();
        let region = self.roi.unwrap_or(self.solid);
        let longest = region.bounds().extent().max_element() / grid.pitch();
        let sizes = self.roi.map(|roi| {
            let [solid, roi] = [self.solid, roi].map(|solid| number(solid.bounds().extent().max_element()));
            format!("; the solid is {solid} long and the region of interest {roi}: are both in one unit?")
        });
        Err(Error::machine(format!(
            "{}: {x} × {y} × {z} nodes need about {} GB, and {} GB are free; about --resolution {} fits{}",
            self.solid.name(),
            number((needed as f64 / 1e8).round() / 10.0),
            number((free as f64 / 1e8).round() / 10.0),
            (0.95 * fits * longest).floor().max(1.0),
            sizes.unwrap_or_default(),
        )))
    }

    /// Returns a grid of another pitch that contains solid and region.
    pub fn grid_of_pitch(&self, pitch: f64) -> Result<Grid, Error> {
        let bounds = self.roi.map_or(self.solid.bounds(), |roi| roi.bounds().union(self.solid.bounds()));
        Grid::with_pitch(bounds, pitch, *LOD_RANGE.start())
            .map_err(|error| Error::input(format!("{}: {error}", self.solid.name())))
    }

    /// Rejects a periodic cell whose sides are not whole numbers of pitches.
    fn whole(&self, grid: &Grid) -> Result<(), Error> {
        let extent = self.solid.bounds().extent();
        for axis in Axis::ALL {
            let pitches = extent[axis.depth()] / grid.pitch();
            if (pitches - pitches.round()).abs() > 1e-6 {
                return Err(Error::input(format!(
                    "{}: --edges periodic needs sides of whole numbers of pitches, and along {} the side of {} is {pitches:.4} \
                     pitches of {}; choose --resolution or --pitch so that all three are",
                    self.solid.name(),
                    axis.name(),
                    number(extent[axis.depth()]),
                    number(grid.pitch()),
                )));
            }
        }
        Ok(())
    }

    /// Samples the solid and its region.
    pub fn sample<'s>(&'s self, grid: &Grid, fill: FillRule, sampler: &dyn Sampler) -> Result<Images<'s>, Error> {
        let lattice = self.solid.quantise(grid)?;
        let solid = along_axes(|axis| Ok(sampler.sample_surface(&lattice, axis, fill)?))?;
        let within = match self.roi {
            None => None,
            Some(roi) => {
                let (roi_lattice, volume) = (roi.quantise(grid)?, roi.volume);
                let roi = along_axes(|axis| Ok(sampler.sample_surface(&roi_lattice, axis, fill)?))?;
                let common = along_axes(|axis| {
                    let axis = axis.depth();
                    Ok(merge(BooleanOperation::Intersection, &solid[axis], &roi[axis])?)
                })?;
                Some(Within { lattice: roi_lattice, volume, roi, common })
            }
        };
        let shells = match fill {
            FillRule::EvenOdd => Shells::of(&solid),
            // The non-zero rule drops crossings within the solid.
            FillRule::NonZero => {
                Shells::of(&along_axes(|axis| Ok(sampler.sample_surface(&lattice, axis, FillRule::EvenOdd)?))?)
            }
        };
        Ok(Images { bounds: *lattice.bounds(), lattice, solid, shells, within })
    }
}

fn along_axes(image: impl Fn(Axis) -> Result<Ldi, Error>) -> Result<[Ldi; 3], Error> {
    Ok([image(Axis::X)?, image(Axis::Y)?, image(Axis::Z)?])
}

/// Exact images along x, y and z.
pub struct Images<'s> {
    pub lattice: LatticeSolid<'s>,
    bounds: LatticeBox,
    /// Images of the solid, within the region or not, with triangles.
    pub solid: [Ldi; 3],
    /// The relation between the shells of the solid.
    pub shells: Shells,
    within: Option<Within<'s>>,
}

/// The images of a region of interest.
struct Within<'s> {
    lattice: LatticeSolid<'s>,
    /// The volume of its mesh.
    volume: f64,
    roi: [Ldi; 3],
    /// The part of the solid within it.
    common: [Ldi; 3],
}

impl Within<'_> {
    /// Returns whether the region is an axis-parallel box up to the lattice: then all its rays have the same span, and its
    /// columns and rows are those of its bounds.
    fn is_box(&self) -> bool {
        let bounds = self.lattice.bounds();
        let step = self.roi[0].grid().step();
        let sides = [0, 1, 2].map(|axis| step * f64::from(bounds.max[axis] - bounds.min[axis]));
        let is_full = |image: &Ldi| {
            let axis = image.axis().depth();
            image.depths().chunks_exact(2).all(|span| span == [bounds.min[axis], bounds.max[axis]])
        };
        self.roi.iter().all(is_full) && (self.volume.abs() / sides.iter().product::<f64>() - 1.0).abs() < 1e-6
    }
}

impl<'s> Images<'s> {
    /// Returns the region of interest on the lattice, if any.
    pub fn roi(&self) -> Option<&LatticeSolid<'s>> {
        self.within.as_ref().map(|within| &within.lattice)
    }

    /// Returns the region; as a box if the region of interest is one.
    pub fn region(&self) -> Region<'_> {
        match &self.within {
            None => Region::of_box(self.solid[0].grid(), self.bounds),
            Some(within) if within.is_box() => Region::of_box(self.solid[0].grid(), *within.lattice.bounds()),
            Some(within) => Region::of_solid(&within.roi),
        }
    }

    /// Returns the images of the solid within the region.
    pub fn common(&self) -> &[Ldi; 3] {
        self.within.as_ref().map_or(&self.solid, |within| &within.common)
    }

    /// Returns the surface of the solid within the region.
    pub fn surface<'f>(&self, facets: &'f Facets<'f>, region: &Region) -> SurfaceElements<'f> {
        match self.shells {
            Shells::Apart => SurfaceElements::within(facets, &self.solid, region),
            Shells::Meeting => SurfaceElements::of_hits(facets, &self.solid, region, Scale::Counted),
        }
    }

    /// Returns the number of unclosed rays of the solid, along all axes.
    pub fn unclosed(&self) -> usize {
        self.solid.iter().map(|image| image.unclosed().len()).sum()
    }

    /// Returns the volume of the solid within the region, at most that of the region: with few rays the estimate may exceed it.
    pub fn volume(&self, region: &Region) -> VolumeEstimate {
        let estimate = VolumeEstimate::from_axes(&self.common().each_ref().map(AxisVolume::of));
        VolumeEstimate { value: estimate.value.clamp(0.0, region.volume()), ..estimate }
    }
}
