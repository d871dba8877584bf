//! Metrics from the adjacency of nodes: components, tunnels, cavities.

use super::record::Record;
use super::{SHELLS_MEET, Shells, Study};
use crate::metrics::Phase;
use crate::metrics::components::{Components, Connectivity};
use crate::metrics::euler::{SurfaceCharacteristic, Topology};
use crate::report::id;

/// Records the topology.
pub fn measure(study: &Study, record: &mut Record) {
    let edges = study.settings.edges;
    let mesh = study.subject.solid.mesh();
    let surface = SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles);
    let of_mesh = match study.images.shells {
        Shells::Apart => surface.of_solid().ok_or("some edges of the mesh do not have two facets; repair the mesh"),
        Shells::Meeting => Err(SHELLS_MEET),
    };
    let entry = match of_mesh {
        Ok(characteristic) => record.put(id::EULER_MESH, characteristic),
        Err(why) => record.lacks(id::EULER_MESH, why),
    };
    entry.with("edges with other than two facets", surface.irregular_edges);
    let solid = Phase::Solid.nodes(&study.solid, study.region.nodes());
    let topology = Topology::of(&solid, study.region, edges);
    record.put(id::EULER, topology.characteristic as f64).with("edges", edges.name());
    let betti = topology.betti;
    for (id, count) in [(id::BETTI_0, betti.pieces), (id::BETTI_1, betti.tunnels), (id::BETTI_2, betti.cavities)] {
        record.put(id, count as f64).with("edges", edges.name());
    }
    record.put(id::CONNECTIVITY, topology.connectivity_density).with("Δχ", topology.contribution);
    let largest = Components::of(&solid, Connectivity::All, edges).largest_share();
    record.put_or(id::PIECE_LARGEST, largest, "the region contains no solid");
}
