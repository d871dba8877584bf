//! Frames: bars along the edges of a surface of polygons, with a window in every polygon.
//!
//! A surface and a copy of it slightly farther in are joined through their windows and along their rims. The result is
//! one closed 2-manifold, made without a grid, so that its bars may be arbitrarily thin:
//!
//! | part | triangles |
//! |---|---|
//! | window of n corners | 6 n: 2 n outside, 2 n inside, 2 n between |
//! | edge of a rim | 2 |

use glam::{DVec2, DVec3};

use super::{SolidError, check_length, check_range, check_triangles, geodesic, rounded};
use crate::mesh::TriangleMesh;

/// The range of `window`, in which bars neither touch nor vanish.
const LEAST_WINDOW: f64 = 0.01;
const MOST_WINDOW: f64 = 0.99;

/// A geodesic sphere of bars about the origin: a triangular window in every face of a [`geodesic()`] sphere.
///
/// With V the volume of the polyhedron, the frame's is V (1 − window²) (1 − (1 − depth / radius)³); `360 frequency²`
/// triangles, genus `20 frequency² − 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeodesicFrame {
    /// Distance of the outer corners from the origin.
    pub radius: f64,
    /// Number of parts of each edge of the icosahedron, 1 to 1000.
    pub frequency: u32,
    /// Side of a window as a fraction of the side of its face, 0.01 to 0.99.
    pub window: f64,
    /// Depth of the bars towards the origin, below the radius.
    pub depth: f64,
}

impl GeodesicFrame {
    /// Builds the closed surface of the frame.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_range("frequency", self.frequency.into(), 1.0, 1000.0)?;
        check_range("window", self.window, LEAST_WINDOW, MOST_WINDOW)?;
        check_length("depth", self.depth)?;
        check_triangles("frequency", self.frequency, 360 * u64::from(self.frequency).pow(2))?;
        let sphere = geodesic(self.radius, self.frequency)?;
        check_depth(self.depth, self.radius)?;
        let shrink = 1.0 - self.depth / self.radius;
        let inner = sphere.positions.iter().map(|&p| shrink * p).collect();
        let mut frame = Frame::new(sphere.positions, inner, self.window);
        sphere.triangles.into_iter().for_each(|face| frame.add_window(face));
        Ok(frame.mesh)
    }
}

/// A hyperboloid of one sheet about the z axis, built of straight bars: two families of equally many bars, which lean
/// to either side, with a window in every diamond between them and in every half diamond at the rims.
///
/// The bars cross on circles. With n bars a family and k crossings beyond the waist, the rims have the radius waist /
/// cos(πk / n). `48 n k + 16 n` triangles, genus `n (2 k + 1) + 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HyperboloidFrame {
    /// Radius of the middle of the bars where they are closest to the axis.
    pub waist: f64,
    /// Distance of the two rims.
    pub height: f64,
    /// Number of bars of each family, 3 to 10 000.
    pub bars: u32,
    /// Number of crossings of a bar with others on either side of the waist, at least 1 and below half the bars.
    pub crossings: u32,
    /// Diagonals of a window as a fraction of those of its diamond, 0.01 to 0.99.
    pub window: f64,
    /// Depth of the bars across the surface, below the radii of curvature at the waist.
    pub depth: f64,
}

impl HyperboloidFrame {
    /// Builds the closed surface of the frame.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        let HyperboloidFrame { waist, height, bars, crossings, window, depth } = *self;
        check_length("waist", waist)?;
        check_length("height", height)?;
        check_length("depth", depth)?;
        check_range("bars", bars.into(), 3.0, 10_000.0)?;
        check_range("crossings", crossings.into(), 1.0, f64::from((bars - 1) / 2))?;
        check_range("window", window, LEAST_WINDOW, MOST_WINDOW)?;
        check_triangles("bars", bars, u64::from(bars) * (48 * u64::from(crossings) + 16))?;

        // After i crossings from the waist a bar is turned by πi / n, at the height c tan(πi / n).
        let turn = std::f64::consts::PI / f64::from(bars);
        let c = height / 2.0 / (turn * f64::from(crossings)).tan();
        // The curvature is greatest at the waist: this radius across the axis, and c² / waist along it.
        check_depth(depth, waist.min(c * c / waist))?;
        let rows = 2 * crossings + 1;
        let middle = (0..rows).flat_map(|row| {
            let up = turn * (f64::from(row) - f64::from(crossings));
            let place = move |i: u32| waist / up.cos() * DVec2::from_angle(turn * f64::from(2 * i + row % 2));
            (0..bars).map(move |i| DVec3::from((place(i), c * up.tan())))
        });
        // Along the gradient of x² / waist² + y² / waist² − z² / c² = 1.
        let half = |p: DVec3| depth / 2.0 * (p / DVec3::new(waist * waist, waist * waist, -c * c)).normalize();
        let (outer, inner): (Vec<_>, Vec<_>) = middle.map(|p| (p + half(p), p - half(p))).unzip();
        let mut frame = Frame::new(outer, inner, window);
        let at = |row: u32, i: u32| row * bars + i % bars;
        for row in 0..rows {
            for i in 0..bars {
                // Between two crossings of a circle lies one of each neighbouring circle.
                let (left, right, between) = (at(row, i), at(row, i + 1), i + row % 2);
                if row == 0 {
                    frame.add_window([left, right, at(row + 1, between)]);
                    frame.close_rim(left, right);
                } else if row == rows - 1 {
                    frame.add_window([right, left, at(row - 1, between)]);
                    frame.close_rim(right, left);
                } else {
                    frame.add_window([left, at(row - 1, between), right, at(row + 1, between)]);
                }
            }
        }
        Ok(frame.mesh)
    }
}

fn check_depth(depth: f64, limit: f64) -> Result<(), SolidError> {
    if depth < limit {
        return Ok(());
    }
    let allowed = format!("below {}, at which bars would meet behind a window", rounded(limit));
    Err(SolidError::OutOfRange { parameter: "depth", value: depth, allowed })
}

/// A frame that is built face by face.
struct Frame {
    mesh: TriangleMesh,
    /// The offset from an outer corner's index to the inner one's.
    inwards: u32,
    window: f64,
}

impl Frame {
    /// Returns a frame without faces, over as many inner corners as outer ones.
    fn new(outer: Vec<DVec3>, inner: Vec<DVec3>, window: f64) -> Frame {
        let inwards = outer.len() as u32;
        let positions = [outer, inner].concat();
        Frame { mesh: TriangleMesh { positions, triangles: Vec::new() }, inwards, window }
    }

    /// Adds the bars round the window of a face, whose outer corners are counter-clockwise from outside.
    fn add_window<const N: usize>(&mut self, outer: [u32; N]) {
        let inner = outer.map(|v| v + self.inwards);
        let [outer_window, inner_window] = [outer, inner].map(|corners| {
            let corners = corners.map(|v| self.mesh.positions[v as usize]);
            let centre = corners.iter().sum::<DVec3>() / N as f64;
            let first = self.mesh.positions.len() as u32;
            self.mesh.positions.extend(corners.map(|p| centre.lerp(p, self.window)));
            std::array::from_fn::<u32, N, _>(|i| first + i as u32)
        });
        for i in 0..N {
            let j = (i + 1) % N;
            self.add_quad([outer[i], outer[j], outer_window[j], outer_window[i]]);
            self.add_quad([outer_window[i], outer_window[j], inner_window[j], inner_window[i]]);
            self.add_quad([inner_window[i], inner_window[j], inner[j], inner[i]]);
        }
    }

    /// Closes the frame along the edge of a face that no other face shares, from outer corner `a` to `b` as in the
    /// face.
    fn close_rim(&mut self, a: u32, b: u32) {
        self.add_quad([b, a, a + self.inwards, b + self.inwards]);
    }

    fn add_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, volume};

    const DOME: GeodesicFrame = GeodesicFrame { radius: 10.0, frequency: 3, window: 0.7, depth: 0.5 };
    const TOWER: HyperboloidFrame =
        HyperboloidFrame { waist: 5.0, height: 20.0, bars: 24, crossings: 8, window: 0.7, depth: 0.3 };

    #[test]
    fn geodesic_frames_have_their_genus_and_volume() {
        for frequency in [1, 2, 5] {
            let frame = GeodesicFrame { frequency, ..DOME };
            let mesh = frame.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(components(&mesh), 1);
            let faces = 20 * i64::from(frequency).pow(2);
            assert_eq!(mesh.triangles.len() as i64, 18 * faces);
            assert_eq!(euler_characteristic(&mesh), 2 - 2 * (faces - 1));
            let polyhedron = volume(&geodesic(10.0, frequency).unwrap());
            let exact = polyhedron * (1.0 - 0.7_f64.powi(2)) * (1.0 - 0.95_f64.powi(3));
            assert!((volume(&mesh) / exact - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn hyperboloid_frames_have_their_genus_and_reach() {
        for (bars, crossings) in [(3, 1), (8, 3), (24, 8)] {
            let mesh = HyperboloidFrame { bars, crossings, ..TOWER }.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(components(&mesh), 1);
            let (n, k) = (i64::from(bars), i64::from(crossings));
            assert_eq!(mesh.triangles.len() as i64, 48 * n * k + 16 * n);
            assert_eq!(euler_characteristic(&mesh), 2 - 2 * (n * (2 * k + 1) + 1));
        }
        let mesh = TOWER.build().unwrap();
        let (most, least) = mesh.positions.iter().fold((0.0_f64, f64::MAX), |(most, least), p| {
            let radius = p.truncate().length();
            (most.max(radius), least.min(radius))
        });
        // Eight crossings of 24 bars turn the rims by 60°, to twice the waist.
        assert!((most - 10.0).abs() < 0.15 && (least - 4.85).abs() < 0.02, "{most} {least}");
        let top = mesh.positions.iter().map(|p| p.z).fold(f64::MIN, f64::max);
        assert!(top > 10.0 && top < 10.15, "{top}");
    }

    #[test]
    fn bars_are_straight_and_have_the_volume_that_windows_leave() {
        let mesh = TOWER.build().unwrap();
        let middle = |row: u32, i: u32| {
            let at = (row * 24 + i % 24) as usize;
            (mesh.positions[at] + mesh.positions[at + 17 * 24]) / 2.0
        };
        // A bar moves half a place to the right in every row, and places of odd rows lie half a place to the right.
        let (foot, head) = (middle(0, 0), middle(16, 8));
        for row in 1..16 {
            let p = middle(row, row / 2);
            let along = (p - foot).dot(head - foot) / (head - foot).length_squared();
            assert!(p.distance(foot.lerp(head, along)) < 1e-12);
        }
        let (w, c) = (5.0_f64, 10.0 / 3.0_f64.sqrt());
        let steps = 10_000;
        let strip = |i: u32| {
            let z = 10.0 * (f64::from(i) + 0.5) / f64::from(steps);
            (w * w + (w * w / (c * c) + 1.0) * (w * z / c).powi(2)).sqrt() * 10.0 / f64::from(steps)
        };
        let area = 2.0 * std::f64::consts::TAU * (0..steps).map(strip).sum::<f64>();
        let expected = area * 0.3 * (1.0 - 0.7 * 0.7);
        assert!((volume(&mesh) / expected - 1.0).abs() < 0.03, "{} {expected}", volume(&mesh));
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |frame: GeodesicFrame| frame.build().unwrap_err().to_string();
        assert_eq!(text(GeodesicFrame { window: 1.0, ..DOME }), "window is 1, but must be from 0.01 to 0.99");
        assert!(text(GeodesicFrame { depth: 10.0, ..DOME }).starts_with("depth is 10, but must be below 10, at"));
        assert!(text(GeodesicFrame { frequency: 0, ..DOME }).starts_with("frequency is 0, but"));
        let text = |frame: HyperboloidFrame| frame.build().unwrap_err().to_string();
        assert_eq!(text(HyperboloidFrame { crossings: 12, ..TOWER }), "crossings is 12, but must be from 1 to 11");
        assert!(text(HyperboloidFrame { bars: 2, ..TOWER }).starts_with("bars is 2, but"));
        assert!(text(HyperboloidFrame { depth: 5.0, ..TOWER }).starts_with("depth is 5, but must be below 5, at"));
        let many = HyperboloidFrame { bars: 5000, crossings: 2000, ..TOWER };
        assert_eq!(
            many.build().unwrap_err().to_string(),
            "bars = 5000 gives 480080000 triangles, but at most 50000000 are allowed"
        );
    }
}
