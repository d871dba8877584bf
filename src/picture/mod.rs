//! Pictures of solids from their images: shaded views and slices.
//!
//! A picture needs no rasteriser: it is an image already. The caller turns the solids by the rotation of a [`View`], so that
//! the line of sight is an axis, lets a [`Camera`] set up the grid whose rays are the picture's pixels, several per pixel,
//! samples that grid on any backend, and passes the image with plain arrays of the surfaces. So a picture is as exact as an
//! image, any Boolean can be shown without a mesh of it, and as images are bit-identical on every backend, so are pictures:
//! nothing here depends on the backend of the image or on the number of threads.
//!
//! - [`camera`]: views, and the raster behind a picture.
//! - [`scene`]: the visible scene; each ray shows the last sample, or the plane that cuts the solid open.
//! - `normals`, `fragments`, `ambient_occlusion`, `shade`: smooth normals; pieces of surface in a pixel; ambient occlusion and shadow from
//!   all layers of the image; their colour. [`shaded`] runs all of them.
//! - [`slice()`]: which inputs each ray is inside of at a plane.
//! - [`annotate`], `text`: scale bar, axes, captions. [`palette`]: colours. [`png`]: the file.

mod ambient_occlusion;
pub mod annotate;
pub mod camera;
mod canvas;
mod fragments;
mod normals;
pub mod palette;
pub mod png;
pub mod scene;
mod shade;
mod slice;
mod text;

pub use camera::{Camera, CameraError, Format, View, ViewBox};
pub use canvas::{Background, Canvas, Colour};
pub use normals::Facets;
pub use scene::{Cut, Scene, Skin};
pub use shade::shaded;
pub use slice::{Fills, INPUTS_MAX, outline_of, slice};

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::annotate::ScaleBar;
    use super::{
        Background, Camera, Canvas, Colour, Cut, Facets, Format, Scene, Skin, View, ViewBox, palette, png, shaded,
        slice,
    };
    use crate::boolean::{BooleanOperation, Expression, Operand, Plan};
    use crate::grid::Axis;
    use crate::ldi::Ldi;
    use crate::mesh::{ClosedMesh, TriangleMesh};
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{FillRule, Mode, Sampler};
    use crate::solids;

    const FORMAT: Format = Format { width: 120, height: 100, supersampling: 3 };

    fn cube() -> TriangleMesh {
        solids::cuboid(DVec3::ZERO, DVec3::splat(2.0)).unwrap()
    }

    fn ball() -> TriangleMesh {
        solids::geodesic(1.0, 12).unwrap()
    }

    fn bounds(mesh: &ClosedMesh) -> ViewBox {
        ViewBox { min: mesh.bounds().min, max: mesh.bounds().max }
    }

    fn turned(mut mesh: TriangleMesh, view: View) -> ClosedMesh {
        mesh.transform(&DAffine3::from_mat3(view.rotation()));
        ClosedMesh::check(mesh).unwrap()
    }

    /// Returns a camera on one solid, and its picture on a transparent background.
    fn picture(mesh: TriangleMesh, view: View, cut: Option<Cut>) -> (Camera, Canvas) {
        picture_with(mesh, view, cut, Facets::Smooth)
    }

    fn picture_with(mesh: TriangleMesh, view: View, cut: Option<Cut>, facets: Facets) -> (Camera, Canvas) {
        let mesh = turned(mesh, view);
        let camera = Camera::aim(FORMAT, bounds(&mesh), bounds(&mesh)).unwrap();
        let solid = camera.see(&camera.raster().quantise(&mesh).unwrap());
        let image = CpuSampler::default().sample_surface(&solid, Axis::Z, FillRule::EvenOdd).unwrap();
        let skins = [Skin { positions: solid.positions(), triangles: solid.triangles(), tint: palette::alone() }];
        let scene = Scene { camera: &camera, image: &image, skins: &skins, cut, cut_tint: palette::cut() };
        let canvas = shaded(&scene, facets, Background::Transparent);
        (camera, canvas)
    }

    /// Returns the pixel at a point of the view.
    fn pixel_at(camera: &Camera, canvas: &Canvas, point: DVec3) -> [f32; 4] {
        let [x, y] = camera.place(point);
        canvas.pixels()[y as usize * canvas.width() as usize + x as usize]
    }

    fn brightness(pixel: [f32; 4]) -> f32 {
        pixel[0] + pixel[1] + pixel[2]
    }

    #[test]
    fn a_cube_seen_along_an_axis_is_a_flat_square() {
        let (camera, canvas) = picture(cube(), View::From(Axis::Z), None);
        let side = 2.0 / camera.pixel();
        let covered: f32 = canvas.pixels().iter().map(|pixel| pixel[3]).sum();
        // Tolerance: one ray along either side.
        assert!((f64::from(covered) - side * side).abs() < 2.0 * side, "{covered} for {side}²");
        let middle = pixel_at(&camera, &canvas, DVec3::new(1.0, 1.0, 2.0));
        assert_eq!(middle[3], 1.0);
        for (x, y) in [(0.5, 0.5), (1.5, 0.4), (0.3, 1.7)] {
            let other = pixel_at(&camera, &canvas, DVec3::new(x, y, 2.0));
            assert!(other.iter().zip(&middle).all(|(a, b)| (a - b).abs() < 0.02), "{other:?} {middle:?}");
        }
    }

    #[test]
    fn sides_of_triangles_are_drawn_where_they_are() {
        let view = View::From(Axis::Z);
        let (camera, canvas) = picture_with(cube(), view, None, Facets::Sides);
        let (_, flat) = picture_with(cube(), view, None, Facets::Flat);
        let ratio = |x, y| {
            let point = DVec3::new(x, y, 2.0);
            brightness(pixel_at(&camera, &canvas, point)) / brightness(pixel_at(&camera, &flat, point))
        };
        // The square has one diagonal, which passes through the middle, and not both.
        let along = [ratio(0.5, 0.5), ratio(0.5, 1.5)];
        let (drawn, other) = (along[0].min(along[1]), along[0].max(along[1]));
        assert!(ratio(1.0, 1.0) < 0.8 && drawn < 0.8 && (other - 1.0).abs() < 0.01, "{along:?}");
        assert!((ratio(1.0, 0.4) - 1.0).abs() < 0.01);
    }

    #[test]
    fn light_comes_from_above_and_from_the_left() {
        let (camera, canvas) = picture(ball(), View::From(Axis::Y), None);
        let at = |x, y| brightness(pixel_at(&camera, &canvas, DVec3::new(x, y, 0.0)));
        assert!(at(0.0, 0.6) > 1.3 * at(0.0, -0.6) && at(-0.6, 0.0) > 1.1 * at(0.6, 0.0));
    }

    #[test]
    fn pits_are_darker_and_covered_surfaces_are_in_shadow() {
        let pit = |depth: f64| {
            let block = turned(solids::cuboid(DVec3::ZERO, DVec3::splat(4.0)).unwrap(), View::From(Axis::Z));
            let hole = turned(
                solids::cuboid(DVec3::new(1.5, 1.5, 4.0 - depth), DVec3::new(2.5, 2.5, 5.0)).unwrap(),
                View::From(Axis::Z),
            );
            let (all, subject) = (ViewBox { min: DVec3::ZERO, max: DVec3::splat(5.0) }, bounds(&block));
            let camera = Camera::aim(FORMAT, subject, all).unwrap();
            let lattice = [&block, &hole].map(|mesh| camera.see(&camera.raster().quantise(mesh).unwrap()));
            let images = lattice
                .each_ref()
                .map(|solid| CpuSampler::default().sample_surface(solid, Axis::Z, FillRule::EvenOdd).unwrap());
            let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Difference, 2), Mode::Exact);
            let operands = [
                Operand { image: &images[0], first_triangle: 0 },
                Operand { image: &images[1], first_triangle: lattice[0].triangles().len() as u32 },
            ];
            let result = plan.sweep(&operands).unwrap();
            let red = Colour::srgb(0xff0000);
            let tints = [palette::alone(), red];
            let skins: Vec<Skin> = lattice
                .iter()
                .zip(tints)
                .map(|(solid, tint)| Skin { positions: solid.positions(), triangles: solid.triangles(), tint })
                .collect();
            let scene = Scene { camera: &camera, image: &result, skins: &skins, cut: None, cut_tint: palette::cut() };
            let canvas = shaded(&scene, Facets::Flat, Background::White);
            pixel_at(&camera, &canvas, DVec3::new(2.0, 2.0, 3.0))
        };
        let (shallow, deep) = (pit(0.05), pit(2.0));
        // The bottom has the tint of the subtracted solid.
        assert!(shallow[0] > 5.0 * shallow[1] && deep[0] > 4.0 * deep[1], "{shallow:?} {deep:?}");
        assert!(deep[0] < 0.5 * shallow[0], "{shallow:?} {deep:?}");
    }

    #[test]
    fn cuts_tint_the_inside_and_remove_the_near_part() {
        let cut = Cut::facing_the_eye(DVec3::new(0.0, 0.0, -1.0), -0.5);
        let (camera, canvas) = picture(ball(), View::From(Axis::Z), Some(cut));
        let Colour(tint) = palette::cut();
        let middle = pixel_at(&camera, &canvas, DVec3::ZERO);
        assert!((middle[0] - tint.x).abs() < 1e-5 && (middle[1] - tint.y).abs() < 1e-5, "{middle:?}");
        // The ball is widest below the plane, and its skin is visible there.
        let rim = pixel_at(&camera, &canvas, DVec3::new(0.93, 0.0, 0.0));
        assert!(rim[3] > 0.9 && (rim[1] - tint.y).abs() > 0.02, "{rim:?}");
    }

    #[test]
    fn pictures_do_not_depend_on_the_thread_count() {
        let file = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let (_, canvas) = picture(solids::torus(3.0, 1.0, 40, 24).unwrap(), View::Isometric, None);
                let mut bytes = Vec::new();
                png::write(&canvas, &mut bytes).unwrap();
                bytes
            })
        };
        let one = file(1);
        assert!(one == file(3) && one.len() > 1000);
        let (_, other) = picture(solids::torus(3.0, 1.01, 40, 24).unwrap(), View::Isometric, None);
        let mut bytes = Vec::new();
        png::write(&other, &mut bytes).unwrap();
        assert!(one != bytes, "different solids have different pictures");
    }

    #[test]
    fn scale_bars_have_a_round_length_at_the_right_scale() {
        let (camera, canvas) = picture(cube(), View::From(Axis::Z), None);
        let bar = ScaleBar::of(&camera);
        assert!([0.1, 0.2, 0.5].contains(&bar.length), "{bar:?}");
        let row = |y: f64| camera.place(DVec3::new(0.0, y, 0.0))[1] as usize * canvas.width() as usize;
        let across: f32 = canvas.pixels()[row(1.0)..][..canvas.width() as usize].iter().map(|pixel| pixel[3]).sum();
        let expected = 2.0 / bar.length * bar.pixels;
        assert!((f64::from(across) - expected).abs() < 1.0, "{across} for {expected}");
        assert!(bar.pixels <= 0.2 * 120.0 && bar.pixels > 0.2 * 120.0 / 2.6);
    }

    #[test]
    fn slices_draw_inputs_in_different_colours() {
        let meshes = [cube(), solids::cuboid(DVec3::splat(1.0), DVec3::splat(3.0)).unwrap()];
        let meshes = meshes.map(|mesh| turned(mesh, View::From(Axis::Z)));
        let all = ViewBox { min: DVec3::ZERO, max: DVec3::splat(3.0) };
        let camera = Camera::aim(FORMAT, all, all).unwrap();
        let images = meshes.each_ref().map(|mesh| {
            let solid = camera.see(&camera.raster().quantise(mesh).unwrap());
            CpuSampler::default().sample_surface(&solid, Axis::Z, FillRule::EvenOdd).unwrap()
        });
        let images: Vec<&Ldi> = images.iter().collect();
        let fills = |inputs: u32| Colour::srgb([0, 0xff0000, 0x00ff00, 0x0000ff][inputs as usize]);
        let at = |depth: f64, x: f64, y: f64| {
            let canvas = slice(&camera, &images, depth, &fills, Colour::srgb(0), Background::Transparent);
            pixel_at(&camera, &canvas, DVec3::new(x, y, 0.0))
        };
        assert_eq!(at(1.5, 0.5, 0.5), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(at(1.5, 2.5, 2.5), [0.0, 1.0, 0.0, 1.0]);
        assert_eq!(at(1.5, 1.5, 1.5), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(at(1.5, 2.5, 0.5), [0.0; 4]);
        // Below the second, and on an outline.
        assert_eq!(at(0.5, 1.5, 1.5), [1.0, 0.0, 0.0, 1.0]);
        let edge = at(1.5, 1.0, 1.5);
        assert!(edge[3] == 1.0 && brightness(edge) < 0.5, "{edge:?}");
    }
}
