//! Plots of the tables as SVG.

use std::path::Path;

use plotters::prelude::*;

use crate::BenchError;

/// A line plot with logarithmic axes.
pub struct Plot {
    /// Part of the file's name.
    pub name: &'static str,
    /// The caption.
    pub title: &'static str,
    /// The quantity of the horizontal axis.
    pub x: &'static str,
    /// The quantity of the vertical axis.
    pub y: &'static str,
    /// The lines: names, and points of positive coordinates.
    pub series: Vec<(String, Vec<(f64, f64)>)>,
}

/// Colours of lines, told apart by most eyes (M. Okabe and K. Ito).
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];

/// Returns the digits of a tick.
fn tick(value: &f64) -> String {
    let digits = (-value.log10().floor()).max(0.0);
    format!("{value:.*}", digits as usize)
}

impl Plot {
    /// Writes the plot to a folder, which exists, as `tables-NAME.svg`.
    pub fn write(&self, folder: &Path) -> Result<(), BenchError> {
        let file = folder.join(format!("tables-{}.svg", self.name));
        self.draw(&file)
            .map_err(|error| BenchError::io(file.display().to_string())(std::io::Error::other(error.to_string())))
    }

    fn draw(&self, file: &Path) -> Result<(), Box<dyn std::error::Error>> {
        // From one power of the base to another, so that both axes have ticks.
        let range = |of: fn(&(f64, f64)) -> f64, base: f64| {
            let values = || self.series.iter().flat_map(|(_, points)| points).map(of);
            let (least, greatest) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
            base.powf(least.log(base).floor())..base.powf(greatest.log(base).ceil())
        };
        let (x, y) = (range(|point| point.0, 2.0), range(|point| point.1, 10.0));
        let root = SVGBackend::new(file, (760, 420)).into_drawing_area();
        root.fill(&WHITE)?;
        let (area, legend) = root.split_horizontally(560);
        let mut chart = ChartBuilder::on(&area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(x.log_scale().base(2.0), y.log_scale())?;
        let mut mesh = chart.configure_mesh();
        mesh.light_line_style(WHITE).x_desc(self.x).y_desc(self.y);
        mesh.x_label_formatter(&tick).y_label_formatter(&tick).draw()?;
        for (i, ((name, points), colour)) in self.series.iter().zip(COLOURS).enumerate() {
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, colour.filled())))?;
            let y = 60 + 20 * i as i32;
            legend.draw(&PathElement::new([(0, y), (16, y)], colour.stroke_width(2)))?;
            legend.draw(&Text::new(name.as_str(), (22, y - 6), ("sans-serif", 13)))?;
        }
        Ok(root.present()?)
    }
}
