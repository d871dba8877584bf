//! Metrics from the adjacency of nodes: components, tunnels, cavities.

use super::record::Record;
use super::{SHELLS_MEET, Shells, Study};
use crate::metrics::Phase;
use crate::metrics::components::{Components, Connectivity};
use crate::metrics::euler::{SurfaceCharacteristic, Topology};

/// Records the topology.
pub fn measure(study: &Study, record: &mut Record) {
    let edges = study.settings.edges;
    let mesh = study.subject.solid.mesh();
    let surface = SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles);
    let of_mesh = match study.images.shells {
        Shells::Apart => surface.of_solid().ok_or("edges of the mesh have not two facets each"),
        Shells::Meeting => Err(SHELLS_MEET),
    };
    let entry = match of_mesh {
        Ok(characteristic) => record.put("euler.mesh", characteristic),
        Err(why) => record.lacks("euler.mesh", why),
    };
    entry.with("edges with other than two facets", surface.irregular_edges);
    let solid = Phase::Solid.nodes(&study.solid, study.region.nodes());
    let topology = Topology::of(&solid, study.region, edges);
    record.put("euler", topology.characteristic as f64).with("edges", edges.name());
    let betti = topology.betti;
    for (id, count) in [("betti.0", betti.pieces), ("betti.1", betti.tunnels), ("betti.2", betti.cavities)] {
        record.put(id, count as f64).with("edges", edges.name());
    }
    record.put("connectivity", topology.connectivity_density).with("Δχ", topology.contribution);
    let largest = Components::of(&solid, Connectivity::All, edges).largest_share();
    record.put_or("piece.largest", largest, "there is no solid in the region");
}
