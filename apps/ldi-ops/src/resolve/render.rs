//! Resolution of `render`.

use ldi_ops::Error;
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::driver::job::Openness;
use ldi_ops::driver::render::{RenderJob, Scenery};
use ldi_ops::picture::camera::{SIDES, SUPERSAMPLING};
use ldi_ops::picture::{Background, Facets, Format, INPUTS_MAX, View};

use super::{Command, Invocation, Job, fill, invocation, letters, parsed, placed, report, writable};
use crate::args::{BackgroundChoice, FacetChoice, ListPlacingArguments, PictureSize, RenderArguments, SliceAt};

pub fn resolve(arguments: RenderArguments) -> Result<Invocation, Error> {
    let RenderArguments { solids, output, picture, placing, fill: fill_choice, device, common } = arguments;
    let names: Vec<String> = (0..solids.len()).map(letters).collect();
    let expression = expression(&names, picture.csg.as_deref())?;
    let format = format(picture.size, picture.samples)?;
    let (backend, memory) = super::device(device)?;
    if output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
        return Err(Error::input(format!("{}: a picture needs the extension .png", output.display())));
    }
    writable(&output)?;
    let report = report(&common)?;
    let scenery = match (picture.view, picture.slice) {
        (None, Some(SliceAt(plane))) => Scenery::Slice(plane),
        (view, cut) => Scenery::Shaded { view: view.unwrap_or(View::Isometric), cut: cut.map(|SliceAt(plane)| plane) },
    };
    let ListPlacingArguments { reading, transforms } = placing;
    let inputs = placed(solids, transforms)?;
    let job = RenderJob {
        names,
        unit: reading.unit,
        openness: if reading.allow_open { Openness::Sampled } else { Openness::RefusedByDefault },
        fill: fill(fill_choice.fill),
        backend,
        expression,
        typed: picture.csg,
        scenery,
        format,
        background: match picture.background {
            BackgroundChoice::Light => Background::Light,
            BackgroundChoice::White => Background::White,
            BackgroundChoice::Dark => Background::Dark,
            BackgroundChoice::Transparent => Background::Transparent,
        },
        facets: match picture.facets {
            FacetChoice::Smooth => Facets::Smooth,
            FacetChoice::Flat => Facets::Flat,
            FacetChoice::Sides => Facets::Sides,
        },
        to: output,
        memory,
        hashes: report.has_json(),
    };
    Ok(invocation(Job::Render(Command { job, inputs, target: None, report }), &common))
}

/// Returns the expression to render; the intersection of the inputs if none is typed.
fn expression(names: &[String], typed: Option<&str>) -> Result<Expression, Error> {
    if names.len() > INPUTS_MAX {
        return Err(Error::input(format!("too many solids for a picture: {} (limit {INPUTS_MAX})", names.len())));
    }
    match typed {
        Some(typed) => parsed(typed, names),
        None => Ok(Expression::of_inputs(BooleanOperation::Intersection, names.len())),
    }
}

fn format(size: PictureSize, supersampling: u32) -> Result<Format, Error> {
    let PictureSize { width, height } = size;
    let (least, most) = (SIDES.start(), SIDES.end());
    if !(SIDES.contains(&width) && SIDES.contains(&height)) {
        return Err(Error::input(format!("--size {width}x{height} is outside {least} to {most} pixels a side")));
    }
    if !SUPERSAMPLING.contains(&supersampling) {
        let (least, most) = (SUPERSAMPLING.start(), SUPERSAMPLING.end());
        return Err(Error::input(format!("--samples {supersampling} is outside {least} to {most} rays")));
    }
    Ok(Format { width, height, supersampling })
}
