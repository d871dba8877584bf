//! Pictures that `render` draws.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use crate::{Folder, assert_near, cube, warning_codes};

/// The size and the pixels of a picture; a pixel has one byte per channel.
struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<Vec<u8>>,
}

fn picture(path: &Path) -> Picture {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let channels = info.color_type.samples();
    Picture {
        width: info.width,
        height: info.height,
        pixels: bytes.chunks_exact(channels).map(<[u8]>::to_vec).collect(),
    }
}

impl Picture {
    /// Returns the share of the pixels that meet a condition.
    fn share(&self, is: impl Fn(&[u8]) -> bool) -> f64 {
        self.pixels.iter().filter(|pixel| is(pixel)).count() as f64 / self.pixels.len() as f64
    }
}

const SMALL: [&str; 4] = ["--size", "160x120", "--unit", "mm"];

#[test]
fn pictures_have_the_requested_size_and_view() {
    let folder = Folder::with_two_cubes();
    let result = folder.json(&[&["render", "a.stl", "-o", "a.png", "--view", "z"], &SMALL[..]].concat());
    let found = picture(&folder.path("a.png"));
    assert_eq!((found.width, found.height, found.pixels[0].len()), (160, 120, 3));
    assert_eq!((&result["command"], &result["view"], &result["plane"]), (&"render".into(), &"z".into(), &().into()));
    assert_eq!((&result["output"]["path"], &result["output"]["width"]), (&"a.png".into(), &160.into()));
    assert_eq!((&result["output"]["unit"], &result["inputs"][0]["triangles"]), (&"mm".into(), &12.into()));
    // The covered share of the picture follows from the size of a pixel; notes cover little.
    let pixel = result["output"]["pixel"].as_f64().unwrap();
    let light = &found.pixels[160 * 60 + 2];
    let covered = found.share(|pixel| pixel != &light[..]);
    assert_near(covered, 4.0 / (pixel * pixel) / (160.0 * 120.0), 0.04);
    let bar = result["output"]["scale_bar"].as_f64().unwrap();
    assert!([0.2, 0.5, 1.0].contains(&bar), "{bar}");
    let text = folder.run(&[&["render", "a.stl", "-o", "a.png", "--view", "-30,20"], &SMALL[..]].concat()).code(0);
    assert!(text.stdout().starts_with("render      a.png: 160 × 120 pixels of 0."), "{}", text.stdout());
    assert!(text.stdout().contains(" mm, seen from -30,20\n"), "{}", text.stdout());
    assert_eq!(folder.names(), ["a.png", "a.stl", "b.stl"]);
}

#[test]
fn inputs_have_their_tints_and_expressions_select_what_is_drawn() {
    let folder = Folder::with_two_cubes();
    let blue = |p: &[u8]| i32::from(p[2]) > i32::from(p[0]) + 25;
    let orange = |p: &[u8]| i32::from(p[0]) > i32::from(p[2]) + 25;
    let shares = |arguments: &[&str]| {
        folder.run(&[&["render", "a.stl", "b.stl", "-o", "c.png"], arguments, &SMALL].concat()).code(0);
        let found = picture(&folder.path("c.png"));
        (found.share(blue), found.share(orange))
    };
    // From above, the upper faces of the common cube are those of the first, its lower ones those of the second.
    let (blue, orange) = shares(&["--view", "z"]);
    assert!(blue > 0.3 && orange < 0.05, "{blue} {orange}");
    let (blue, orange) = shares(&["--view", "-z"]);
    assert!(orange > 0.3 && blue < 0.05, "{blue} {orange}");
    let (blue, orange) = shares(&["--view", "z", "--csg", "b - a"]);
    assert!(orange > 0.3 && blue < 0.05, "{blue} {orange}");
    let (blue, orange) = shares(&["--view", "z", "--csg", "a | b"]);
    assert!(orange > 0.2 && blue > 0.1, "{blue} {orange}");
}

#[test]
fn slices_and_cuts_are_drawn() {
    let folder = Folder::with_two_cubes();
    let result = folder.json(&[&["render", "a.stl", "b.stl", "--slice", "z=50%", "-o", "s.png"], &SMALL[..]].concat());
    assert_eq!((&result["plane"]["axis"], &result["plane"]["at"]), (&"z".into(), &1.5.into()));
    let dark = |p: &[u8]| p.iter().all(|&channel| channel < 0x70);
    // The common square of side 1, and lines; the pixels give its area.
    let pixel = result["output"]["pixel"].as_f64().unwrap();
    let expected = 1.0 / (pixel * pixel) / (160.0 * 120.0);
    let found = picture(&folder.path("s.png")).share(dark);
    assert!(found > expected && found < expected + 0.12, "{found} for {expected}");
    let cut = ["render", "a.stl", "--view", "x", "--slice", "x=1", "--background", "transparent", "-o", "cut.png"];
    folder.run(&[&cut, &SMALL[..]].concat()).code(0);
    let found = picture(&folder.path("cut.png"));
    assert_eq!(found.pixels[0], [0; 4]);
    assert!(found.share(|p| p[0] > p[1] + 60 && p[3] == 255) > 0.3);
}

#[test]
fn pictures_do_not_depend_on_the_thread_count() {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "1", "-o", "a.stl"]).code(0);
    for (name, threads) in [("one.png", "1"), ("three.png", "3")] {
        folder.run(&[&["render", "a.stl", "-o", name, "--threads", threads], &SMALL[..]].concat()).code(0);
    }
    assert!(fs::read(folder.path("one.png")).unwrap() == fs::read(folder.path("three.png")).unwrap());
}

#[test]
fn impossible_pictures_are_refused() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    let refused = |arguments: &[&str], words: &[&str]| {
        folder.run(&[&["render"], arguments].concat()).code(2).says(words);
    };
    refused(&["missing.stl", "-o", "a.jpg"], &["a.jpg", ".png"]);
    refused(&["missing.stl", "-o", "nowhere/a.png"], &["the folder nowhere does not exist"]);
    refused(&["missing.stl", "-o", "a.png"], &["missing.stl"]);
    refused(&["missing.stl", "-o", "a.png", "--json", "a.png"], &["same file"]);
    refused(&["missing.stl", "-o", "a.png", "--size", "9x900"], &["--size 9x900", "16 to 16384"]);
    refused(&["missing.stl", "-o", "a.png", "--samples", "9"], &["--samples 9", "1 to 8"]);
    refused(&["missing.stl", "-o", "a.png", "--view", "w"], &["`w` is not a view", "azimuth"]);
    refused(&["missing.stl", "-o", "a.png", "--slice", "w=1"], &["z=0.5"]);
    refused(&["missing.stl", "-o", "a.png", "--transform-b", "scale(2)"], &["--transform-b"]);
    refused(&["a.stl", "b.stl", "-o", "a.png", "--csg", "a & c"], &["character 5", "c"]);
    refused(&["a.stl", "-o", "a.png", "--slice", "z=3"], &["--slice z=3", "from 0 to 2 along z"]);
    refused(&["open.stl", "-o", "a.png"], &["open.stl", "not closed", "--allow-open"]);
    assert!(!folder.path("a.png").exists());
    let result = folder.json(&[&["render", "open.stl", "-o", "a.png", "--allow-open"], &SMALL[..]].concat());
    assert_eq!(warning_codes(&result), ["open"]);
    assert!(result["unclosed_rays"].as_u64().unwrap() > 0);
}

#[test]
fn empty_pictures_give_a_warning() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(5.0, 1.0));
    let result = folder.json(&[&["render", "a.stl", "b.stl", "-o", "a.png"], &SMALL[..]].concat());
    assert_eq!(warning_codes(&result), ["nothing-seen"]);
}
