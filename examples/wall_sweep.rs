//! A table of gyroid scaffolds over wall thickness. `cargo run --release --example wall_sweep`

#![allow(clippy::print_stdout)]

use ldi_ops::solids::Model;
use ldi_ops::{Report, Settings, Solid, Unit};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:>6} {:>14} {:>16} {:>18} {:>20}", "wall", "volume", "porosity", "pore width", "thickness");
    for wall in ["0.4", "0.6", "0.8", "1.0"] {
        let parameters = [("cells", "2"), ("cell-size", "5"), ("wall", wall), ("resolution", "24")];
        let mesh = Model::from_parameters("gyroid", &parameters)?.build()?;
        let scaffold = Solid::from_triangles(mesh.positions, mesh.triangles)?.unit(Unit::Millimetre);
        let settings = Settings::rays(96);
        let volume = scaffold.volume(&settings)?;
        let report = Report::of(&scaffold).measure(&settings)?;
        let [porosity, width, thickness] =
            ["porosity", "pore.thickness.mean", "solid.thickness.mean"].map(|id| &report[id]);
        println!("{wall:>6} {:>14.3} {porosity:>16} {width:>18} {thickness:>20}", volume.value);
    }
    Ok(())
}
