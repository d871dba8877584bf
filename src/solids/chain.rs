//! A chain of interlocked rings that do not touch: many shells, none of which overlaps another.

use glam::DVec3;

use super::{SolidError, check_range, check_triangles, torus};
use crate::mesh::TriangleMesh;

/// The gap between neighbouring links, in radii of their section.
const GAP: f64 = 0.5;

/// Returns a chain along the x axis, centred on the origin: rings with the radii of a [`torus`], alternately flat in xy
/// and in xz, each through the next with a gap of half the `minor` radius; `2 links around across` triangles.
///
/// # Errors
/// Fails for everything that [`torus`] refuses; a `minor` radius of more than 2/7.5 of the `major` one, at which every
/// second link would meet; no link or too many triangles.
pub fn chain(links: u32, major: f64, minor: f64, around: u32, across: u32) -> Result<TriangleMesh, SolidError> {
    check_range("links", links.into(), 1.0, 1e7)?;
    let per_link = 2 * u64::from(around).saturating_mul(across.into()).min(u64::MAX / 2);
    check_triangles("links", links, per_link.saturating_mul(links.into()))?;
    let link = torus(major, minor, around, across)?;
    // Links two apart lie in one plane; their outer rims keep at least the same gap when minor ≤ major · 2 / 7.5.
    let most = major * 2.0 / (3.0 + 2.0 + 2.0 + GAP);
    check_range("minor", minor, 0.0, most)?;
    let pitch = 2.0 * major - (2.0 + GAP) * minor;
    let mut mesh = TriangleMesh {
        positions: Vec::with_capacity(links as usize * link.positions.len()),
        triangles: Vec::with_capacity(links as usize * link.triangles.len()),
    };
    for i in 0..links {
        let first = mesh.positions.len() as u32;
        let centre = pitch * (f64::from(i) - f64::from(links - 1) / 2.0) * DVec3::X;
        // A quarter turn about x takes xy to xz and keeps triangles facing outwards.
        let turned = |p: &DVec3| if i % 2 == 0 { *p } else { DVec3::new(p.x, -p.z, p.y) };
        mesh.positions.extend(link.positions.iter().map(|p| centre + turned(p)));
        mesh.triangles.extend(link.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, volume};

    #[test]
    fn links_are_tori_that_keep_their_gap() {
        let (major, minor) = (7.5, 2.0);
        let mesh = chain(3, major, minor, 48, 24).unwrap();
        assert_solid(&mesh);
        assert_eq!(euler_characteristic(&mesh), 0);
        let one = torus(major, minor, 48, 24).unwrap();
        assert!((volume(&mesh) / (3.0 * volume(&one)) - 1.0).abs() < 1e-12);
        let links: Vec<&[DVec3]> = mesh.positions.chunks(48 * 24).collect();
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            let gap = links[a].iter().flat_map(|p| links[b].iter().map(move |q| p.distance(*q)));
            let gap = gap.fold(f64::MAX, f64::min);
            assert!(gap > 0.99 * GAP * minor && gap < 1.1 * GAP * minor, "{a} {b}: {gap}");
        }
    }

    #[test]
    fn wrong_parameters_are_refused() {
        assert!(chain(0, 5.0, 1.0, 8, 8).is_err());
        let error = chain(2, 7.5, 2.1, 8, 8).unwrap_err();
        assert_eq!(error.to_string(), "minor is 2.1, but must be from 0 to 2");
        let error = chain(1_000_000, 5.0, 1.0, 8, 8).unwrap_err();
        assert_eq!(error.to_string(), "links = 1000000 gives 128000000 triangles, but at most 50000000 are allowed");
    }
}
