//! Arguments of `render`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use ldi_ops::driver::render::{Plane, SlicePosition};
use ldi_ops::grid::Axis;
use ldi_ops::length::Length;
use ldi_ops::picture::View;

use super::{CommonArguments, DeviceArguments, FillArguments, ListPlacingArguments};

#[derive(Debug, Args)]
#[command(after_help = RENDER_EXAMPLES)]
pub struct RenderArguments {
    /// The solids
    #[arg(required = true, value_name = "FILE")]
    pub solids: Vec<PathBuf>,
    /// Output file, .png
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub picture: PictureArguments,
    #[command(flatten)]
    pub placing: ListPlacingArguments,
    #[command(flatten)]
    pub fill: FillArguments,
    #[command(flatten)]
    pub device: DeviceArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub struct PictureArguments {
    /// Viewpoint: iso, x, y, z, -x, -y, -z, or 'azimuth,elevation' in degrees, from +x towards +y and upwards [default: iso]
    #[arg(long, allow_hyphen_values = true)]
    pub view: Option<View>,
    /// Plane of a slice, at a coordinate or a share of the box: z=0.5, z=2mm or z=50%. Alone it gives a picture of the plane;
    /// with --view it cuts away the parts in front of it
    #[arg(long, value_name = "AXIS=AT")]
    pub slice: Option<SliceAt>,
    /// Boolean expression to show, over the solids a, b, c … in their order: 'a & b', 'a | b', 'a - b', 'a ^ b', with
    /// parentheses [default: the intersection]
    #[arg(long, value_name = "EXPR")]
    pub csg: Option<String>,
    /// Size of the picture, in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1200x900")]
    pub size: PictureSize,
    /// Rays along a side of a pixel, 1 to 8; a pixel is the mean over its square of rays
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub samples: u32,
    /// Background
    #[arg(long, value_enum, default_value_t = BackgroundChoice::Light)]
    pub background: BackgroundChoice,
    /// Shading of triangles: smoothed over edges below 40 degrees, flat, or flat with their sides drawn
    #[arg(long, value_enum, default_value_t = FacetChoice::Smooth)]
    pub facets: FacetChoice,
}

const RENDER_EXAMPLES: &str = "\
Examples:
  ldi-ops render part.stl --unit mm -o part.png
  ldi-ops render part.stl --view -60,25 --background transparent -o part.png
  ldi-ops render scaffold.stl bone.stl --unit mm -o common.png
  ldi-ops render block.stl drill.stl --csg 'a - b' --view iso --slice x=50% -o open.png
  ldi-ops render a.stl b.stl --slice z=50% -o slice.png
  ldi-ops render part.stl --facets sides -o triangles.png

The picture is made from a layered depth image along the line of sight, and shows a Boolean
without making a mesh of it. It is orthographic: the scale bar holds everywhere. Surfaces have
the tint of the input that they come from.";

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum BackgroundChoice {
    Light,
    White,
    Dark,
    Transparent,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum FacetChoice {
    Smooth,
    Flat,
    Sides,
}

/// Pixels from left to right and from top to bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureSize {
    pub width: u32,
    pub height: u32,
}

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<PictureSize, String> {
        let sides = text.split_once(['x', '×']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        let (width, height) = sides.ok_or("expected two numbers of pixels, as in 1200x900")?;
        Ok(PictureSize { width, height })
    }
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceAt(pub Plane);

impl FromStr for SliceAt {
    type Err = String;

    fn from_str(text: &str) -> Result<SliceAt, String> {
        let wrong = || "expected an axis and a position: z=0.5 in file units, z=2mm, or z=50% of the box".to_owned();
        let (axis, place) = text.split_once('=').ok_or_else(wrong)?;
        let axis = Axis::ALL.into_iter().find(|known| known.name() == axis.trim()).ok_or_else(wrong)?;
        let position = match place.trim().strip_suffix('%') {
            Some(share) => {
                let share = share.trim().parse::<f64>().ok().filter(|share| share.is_finite());
                SlicePosition::Share(share.ok_or_else(wrong)? / 100.0)
            }
            None => {
                let at = place.parse::<Length>().ok().filter(|length| length.value.is_finite());
                SlicePosition::Coordinate(at.ok_or_else(wrong)?)
            }
        };
        Ok(SliceAt(Plane { axis, position }))
    }
}

#[cfg(test)]
mod tests {
    use ldi_ops::mesh::LengthUnit;

    use super::*;

    #[test]
    fn sizes_and_slices_are_read() {
        assert_eq!("800x600".parse(), Ok(PictureSize { width: 800, height: 600 }));
        assert!("800".parse::<PictureSize>().is_err() && "ax9".parse::<PictureSize>().is_err());
        let coordinate = |value, unit| SlicePosition::Coordinate(Length { value, unit });
        assert_eq!("z=0.5".parse(), Ok(SliceAt(Plane { axis: Axis::Z, position: coordinate(0.5, None) })));
        let millimetres = Some(LengthUnit::Millimetre);
        assert_eq!("y=-2mm".parse(), Ok(SliceAt(Plane { axis: Axis::Y, position: coordinate(-2.0, millimetres) })));
        assert_eq!("x = 25 %".parse(), Ok(SliceAt(Plane { axis: Axis::X, position: SlicePosition::Share(0.25) })));
        for wrong in ["z", "w=1", "z=", "z=nan", "z=%"] {
            assert!(wrong.parse::<SliceAt>().is_err(), "{wrong}");
        }
    }
}
