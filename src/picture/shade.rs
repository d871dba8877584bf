//! Lighting of fragments, and the pixels from them.
//!
//! All values are in linear light. There are a main light from the upper left with a soft shadow, a weak one from the right
//! without, and ambient light that is brighter from above than from below and attenuated by ambient
//! occlusion (`ambient_occlusion`); outlines are darkened.

use crate::parallel::*;
use glam::Vec3;

use super::ambient_occlusion::{Exposure, exposures};
use super::canvas::{Background, Canvas, Colour};
use super::fragments::{Fragment, fragments};
use super::normals::{Facets, Normals};
use super::scene::Scene;

/// The direction towards the main light.
const KEY: Vec3 = Vec3::new(-0.48, 0.56, 0.676);

/// The direction towards the light that brightens the parts in shadow of the main one.
const FILL: Vec3 = Vec3::new(0.74, -0.1, 0.665);

/// Intensity of each light, and of the ambient light from above and from below.
const KEY_LIGHT: f32 = 0.74;
const FILL_LIGHT: f32 = 0.14;
const AMBIENT_ABOVE: f32 = 0.56;
const AMBIENT_BELOW: f32 = 0.32;

/// Intensity of the specular reflection of the main light, and its exponent.
const GLOSS: f32 = 0.05;
const SHARPNESS: f32 = 28.0;

/// The share of the ambient light that reaches the deepest hollow by reflection between walls.
const REFLECTED: f32 = 0.14;

/// The share of the light that an outline removes.
const OUTLINE: f32 = 0.62;

/// Renders a shaded picture of a scene.
///
/// # Panics
/// If the image lies on another grid than the camera's, or has no triangles.
pub fn shaded(scene: &Scene, facets: Facets, background: Background) -> Canvas {
    assert!(scene.image.grid() == scene.camera.grid(), "the image lies on the camera's grid");
    let normals: Vec<Normals> = scene.skins.iter().map(|skin| Normals::new(*skin, facets)).collect();
    let fragments = fragments(scene, &normals);
    drop(normals);
    let exposures = exposures(scene, &fragments.all, KEY);
    let format = scene.camera.format();
    let mut canvas = Canvas::new(format.width, format.height, background);
    let rays = (format.supersampling * format.supersampling) as f32;
    let width = format.width as usize;
    canvas.rows_mut().enumerate().par_bridge().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let at = y * width + x;
            let range = fragments.first[at] as usize..fragments.first[at + 1] as usize;
            let (mut light, mut covered) = (Vec3::ZERO, 0.0);
            for i in range {
                let (fragment, exposure) = (&fragments.all[i], exposures[i]);
                let share = f32::from(fragment.rays) / rays;
                let Colour(c) = match fragment.skin {
                    Some(skin) => lit(scene.skins[usize::from(skin)].tint, fragment, exposure),
                    None => cut(scene.cut_tint, fragment),
                };
                light += c * share;
                covered += share;
            }
            let rest = 1.0 - covered;
            *pixel = [
                light.x + pixel[0] * rest,
                light.y + pixel[1] * rest,
                light.z + pixel[2] * rest,
                covered + pixel[3] * rest,
            ];
        }
    });
    canvas
}

/// Returns the light that a point of a skin reflects to the eye.
fn lit(Colour(tint): Colour, fragment: &Fragment, exposure: Exposure) -> Colour {
    let n = fragment.normal;
    let above = 0.5 + 0.5 * n.y;
    let open = REFLECTED + (1.0 - REFLECTED) * exposure.ambient_occlusion;
    let ambient = (AMBIENT_BELOW + (AMBIENT_ABOVE - AMBIENT_BELOW) * above) * open;
    let key = KEY_LIGHT * n.dot(KEY).max(0.0) * exposure.key;
    let fill = FILL_LIGHT * n.dot(FILL).max(0.0) * exposure.ambient_occlusion;
    let half = (KEY + Vec3::Z).normalize();
    let gloss = GLOSS * n.dot(half).max(0.0).powf(SHARPNESS) * exposure.key;
    let light = tint * (ambient + key + fill) + Vec3::splat(gloss);
    Colour(light * (1.0 - OUTLINE * fragment.line))
}

/// Returns the colour of the face of a cut: its tint, independent of the light, with its outline.
fn cut(Colour(tint): Colour, fragment: &Fragment) -> Colour {
    Colour(tint * (1.0 - OUTLINE * fragment.line))
}
