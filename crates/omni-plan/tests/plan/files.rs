//! Maps and charts from files: what is read, what is refused and how; costmaps read back.

use std::fs;
use std::path::{Path, PathBuf};

use super::common::{chart, chugo7, world};
use omni_plan::{Cell, Chart, Elevation, Footprint, Goal, Grid, Map, Options, PictureScale, Planner, Pose};
use proptest::prelude::*;
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

fn pgm(columns: usize, rows: usize, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = format!("P5\n# CREATOR: map_saver 0.050 m/pix\n{columns} {rows}\n255\n").into_bytes();
    bytes.extend_from_slice(pixels);
    bytes
}

fn png(columns: u32, rows: u32, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, columns, rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(pixels).expect("pixels");
    writer.finish().expect("an end");
    bytes
}

const YAML: &str = "image: map.pgm\nresolution: 0.5\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

#[test]
fn a_png_lies_as_the_simulation_lays_it() {
    let folder = folder();
    // Row 0 is the far end, column 0 the left side.
    let mut pixels = vec![0; 12];
    pixels[0] = 255;
    pixels[11] = 51;
    let path = write(folder.path(), "map.png", png(4, 3, &pixels));
    let mut scale = PictureScale::new(0.5, -0.1, 0.4);
    scale.start_x_m = 2.0;
    let map = Map::from_png(&path, &scale).expect("a map");
    let at = |x: f64, y: f64| map.height_m(map.grid().cell_of([x, y]).expect("a cell"));
    assert_eq!((map.grid().columns, map.grid().rows), (3, 4));
    assert!((at(3.0, 0.75) - 0.4).abs() < 1e-9);
    assert!((at(2.0, -0.75) - 0.0).abs() < 1e-9);
    assert!((at(2.0, 0.75) + 0.1).abs() < 1e-9);
}

#[test]
fn a_map_server_s_map_has_its_cells_and_the_heights_of_a_second_picture() {
    let folder = folder();
    let mut pixels = vec![254; 12];
    pixels[0] = 0; // the upper left corner
    pixels[11] = 205;
    write(folder.path(), "map.pgm", pgm(4, 3, &pixels));
    let yaml = write(folder.path(), "map.yaml", YAML);
    let mut heights = b"P5 4 3 65535\n".to_vec();
    for pixel in 0..12_u16 {
        heights.extend((pixel * 256 + 10).to_be_bytes());
    }
    let elevation = write(folder.path(), "heights.pgm", heights);
    let map = Map::from_map_server(&yaml, Some(&Elevation::new(elevation, 0.0, 65.535))).expect("a map");
    assert_eq!(map.grid().origin_m, [-1.0, 2.0]);
    assert_eq!(map.cell([0, 2]), Cell::Occupied);
    assert_eq!(map.cell([3, 0]), Cell::Unknown);
    assert_eq!(map.cell([1, 1]), Cell::Free);
    assert!((map.height_m([0, 2]) - 0.010).abs() < 1e-9);
    assert!((map.height_m([3, 0]) - 2.826).abs() < 1e-9);
}

#[test]
fn a_csv_s_first_line_is_the_upper_one() {
    let folder = folder();
    let path = write(folder.path(), "map.csv", "0, 0.1, 0.2\n1,1.1,1.2\n-2,2.1,2.5e0\n");
    let map = Map::from_csv(&path, 0.1, [0.0, 0.0]).expect("a map");
    assert_eq!(map.height_m([2, 2]), 0.2);
    assert_eq!(map.height_m([2, 0]), 2.5);
    assert_eq!(map.height_m([0, 0]), -2.0);
}

#[test]
fn what_is_wrong_with_a_file_is_one_line_with_file_key_value_and_range() {
    let folder = folder();
    let refused = |yaml: &str| {
        write(folder.path(), "map.pgm", pgm(4, 3, &[254; 12]));
        let path = write(folder.path(), "map.yaml", yaml);
        let message = Map::from_map_server(path, None).expect_err("refused").to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.len() < 500, "{message}");
        message.replace(&folder.path().display().to_string(), "DIR")
    };
    let with = |from: &str, to: &str| refused(&YAML.replace(from, to));
    assert_eq!(
        with("resolution: 0.5", "resolution: 0"),
        "DIR/map.yaml: resolution: 0, allowed: 0.001 to 10"
    );
    assert_eq!(
        with("resolution: 0.5", "resolution: .nan"),
        "DIR/map.yaml: resolution: NaN, allowed: 0.001 to 10"
    );
    assert_eq!(
        with("2.0, 0.0]", "2.0, 0.3]"),
        "DIR/map.yaml: origin[2]: 0.3, allowed: 0, a map that is not rotated"
    );
    assert_eq!(
        with("negate: 0", "negate: 2"),
        "DIR/map.yaml: negate: 2, allowed: 0 to 1"
    );
    assert_eq!(
        with("free_thresh: 0.196", "free_thresh: 0.9"),
        "DIR/map.yaml: free_thresh: 0.9, allowed: 0 to 0.65"
    );
    assert!(with("origin", "mode: raw\norigin").contains("mode: \"raw\", allowed: trinary, scale"));
    assert!(with("[-1.0, 2.0, 0.0]", "[-1.0]").contains("origin: 1 numbers, allowed: x, y and yaw"));
    assert!(with("map.pgm", "none.pgm").contains("image: DIR/none.pgm: "));
    assert!(refused("image: [").starts_with("DIR/map.yaml: top level: "));
    assert!(refused("a: 1").contains("allowed: map_server's YAML"));

    // A picture that says it has 10^9 cells, and one that lacks its end.
    let large = write(folder.path(), "map.pgm", "P5 40000 25000 255\n1234");
    let path = write(folder.path(), "map.yaml", YAML);
    let message = Map::from_map_server(&path, None)
        .expect_err("refused")
        .to_string();
    assert!(
        message.contains("40000 x 25000 pixels, allowed: 4000000 pixels at most"),
        "{message}"
    );
    fs::write(large, pgm(4, 3, &[254; 5])).expect("a file");
    assert!(Map::from_map_server(&path, None).is_err());

    let csv = |text: &str| {
        let path = write(folder.path(), "map.csv", text);
        let message = Map::from_csv(path, 0.1, [0.0, 0.0])
            .expect_err("refused")
            .to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        message.replace(&folder.path().display().to_string(), "DIR")
    };
    assert_eq!(
        csv("1,2,3\n4,nan,6\n7,8,9\n"),
        "DIR/map.csv: line 2, column 2: \"nan\", allowed: heights from -10000 to 10000"
    );
    assert!(csv("1,2,3\n4,5\n").starts_with("DIR/map.csv: line 2: "));
    assert!(csv("").contains("cells = 0 x 0, allowed: 3 x 3 to 4000000 cells"));

    let error = Grid::new(40_000, 25_000, 0.05, [0.0, 0.0]).expect_err("refused");
    assert_eq!(
        error.to_string(),
        "cells = 40000 x 25000, allowed: 3 x 3 to 4000000 cells"
    );
    let grid = Grid::new(3, 3, 0.05, [0.0, 0.0]).expect("a grid");
    let mut heights = vec![0.0; 9];
    heights[4] = f64::NAN;
    let error = Map::from_heights(grid, heights).expect_err("refused");
    assert_eq!(error.to_string(), "heights_m = NaN, allowed: -10000 to 10000");
}

#[test]
fn a_real_chart_is_read_with_both_sides_and_a_broken_one_is_refused() {
    let chugo7 = chugo7();
    assert_eq!(chugo7.vehicle(), "chugo7");
    assert!((chugo7.step_m(0.0, 0.7, 0.8) - 0.0512).abs() < 1e-12);
    assert!((chugo7.step_m(-150.0, 0.7, 0.8) - 0.028).abs() < 1e-12);
    assert!((chugo7.drop_m(180.0, 0.9, 0.8) - 0.0752).abs() < 1e-12);
    assert!((chugo7.step_m(0.0, 0.7, 0.5) - 0.032).abs() < 1e-12);
    assert_eq!(chugo7.step_m(0.0, 0.6, 0.8), 0.0);
    let text = include_str!("../charts/chugo7.toml");
    let refused = |text: &str| Chart::from_toml("c.toml", text).expect_err("refused").to_string();
    assert_eq!(
        refused("schema_version = 2"),
        "c.toml: schema_version: 2, allowed: 1"
    );
    assert_eq!(
        refused(&text.replace("limit_m = 0.064\n", "limit_m = nan\n")),
        "c.toml: cell[0].limit_m: NaN, allowed: 0 to 100"
    );
    assert_eq!(
        refused(&text.replacen("side_deg = 0.0", "side_deg = 181.0", 1)),
        "c.toml: cell[0].side_deg: 181, allowed: -180 to 180"
    );
    assert!(
        refused(&text.replacen("edge = \"step\"", "edge = \"cliff\"", 1)).contains("cell[0].edge: \"cliff\"")
    );
    assert!(refused("schema_version = 1\nfriction = \"a\"").starts_with("c.toml: line 2: "));
    assert!(chugo7.clone().with(chugo7.clone()).is_err());
}

#[test]
fn options_and_footprints_out_of_range_are_refused() {
    let map = world([2.0, 2.0], 0.05, |_, _| 0.0);
    let footprint = Footprint::rectangle(0.3, 0.2).expect("a rectangle");
    let bad = [
        Options {
            margin: f64::NAN,
            ..Options::default()
        },
        Options {
            clearance_m: -0.1,
            ..Options::default()
        },
        Options {
            run_up_m: f64::INFINITY,
            ..Options::default()
        },
        Options {
            lattice_m: 0.0,
            ..Options::default()
        },
    ];
    for options in bad {
        assert!(Planner::new(&map, &chugo7(), &footprint, options).is_err());
    }
    assert!(Footprint::rectangle(f64::NAN, 1.0).is_err());
    let fine = world([0.01, 0.01], 0.001, |_, _| 0.0);
    let large = Footprint::rectangle(20.0, 20.0).expect("a rectangle");
    let error = Planner::new(&fine, &chugo7(), &large, Options::default()).expect_err("refused");
    assert!(error.to_string().starts_with("footprint in cells of the map = "));
    let keys: Options =
        toml::from_str("cost = \"energy\"\nmargin = 0.7\n[speeds]\nyaw_rad_s = 1.0").expect("options");
    assert_eq!(keys.margin, 0.7);
    assert!(toml::from_str::<Options>("margn = 0.7").is_err());
}

#[test]
fn costmaps_are_maps_of_map_server_and_say_from_which_side() {
    let folder = folder();
    // Up by 30 mm along x; the front climbs it, the left side does not.
    let map = world([4.0, 3.0], 0.05, |x, _| if x > 2.0 { 0.03 } else { 0.0 });
    let chart = chart(&[
        (0.0, 0.05, 0.05),
        (90.0, 0.01, 0.01),
        (180.0, 0.05, 0.05),
        (-90.0, 0.01, 0.01),
    ]);
    let footprint = Footprint::rectangle(0.6, 0.4).expect("a rectangle");
    let planner = Planner::new(&map, &chart, &footprint, Options::default()).expect("a planner");
    let written = planner.write_costmaps(folder.path(), "hall").expect("files");
    assert_eq!(written.len(), 18);
    let level = |name: &str, column: usize| {
        let bytes = fs::read(folder.path().join(name)).expect("a picture");
        bytes[bytes.len() - 80 * 60 + 10 * 80 + column]
    };
    // 30 of 40 mm allowed: 98 * 0.75 = 73.5 %, rounded up.
    assert_eq!(level("hall.pgm", 39), 255 - 189);
    assert_eq!(level("hall.pgm", 10), 255);
    assert_eq!(level("hall-heading-00.pgm", 40), 255 - 189);
    assert_eq!(level("hall-heading-04.pgm", 40), 0);
    assert_eq!(level("hall-heading-08.pgm", 40), 255 - 189);
    // 0.3 of 0.4 m/s.
    assert_eq!(level("hall-speed.pgm", 45), 255 - 191);
    assert_eq!(level("hall-speed.pgm", 70), 255);
    let again = Map::from_map_server(folder.path().join("hall-heading-04.yaml"), None).expect("a map");
    assert_eq!(again.cell([40, 10]), Cell::Occupied);
    assert_eq!(again.cell([10, 10]), Cell::Free);
    assert!(planner.costmap("a/b").is_err() && planner.heading_costmap(16, "a").is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_bytes_make_a_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), cut in 0_usize..200) {
        let folder = folder();
        let mut damaged = pgm(4, 3, &[254; 12]);
        damaged.truncate(cut);
        for picture in [bytes.clone(), damaged, [b"P5 ".to_vec(), bytes.clone()].concat()] {
            write(folder.path(), "map.pgm", picture);
            let yaml = write(folder.path(), "map.yaml", YAML);
            if let Err(error) = Map::from_map_server(yaml, None) {
                prop_assert_eq!(error.to_string().lines().count(), 1);
            }
        }
        let path = write(folder.path(), "any", &bytes);
        let errors = [
            Map::from_png(&path, &PictureScale::new(0.05, 0.0, 1.0)).err(),
            Map::from_map_server(&path, None).err(),
            Map::from_csv(&path, 0.05, [0.0, 0.0]).err(),
            Chart::read(&path).err(),
        ];
        for error in errors.into_iter().flatten() {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }

    #[test]
    fn no_heights_make_the_planner_panic(
        heights_mm in prop::collection::vec(prop_oneof![4 => Just(0_i32), 3 => -90..90_i32, 1 => Just(5000)], 400),
        closed in 0_usize..20,
        x in -0.1..1.1_f64,
        yaw in -10.0..10.0_f64,
    ) {
        let grid = Grid::new(20, 20, 0.05, [0.0, 0.0]).expect("a grid");
        let heights = heights_mm.iter().map(|height| f64::from(*height) / 1000.0).collect();
        let area = omni_plan::Area::rectangle([0.0, 0.05 * closed as f64], [0.9, 1.0]).expect("an area");
        let map = Map::from_heights(grid, heights).expect("a map").with_keep_out(area);
        let footprint = Footprint::rectangle(0.12, 0.1).expect("a rectangle");
        let options = Options { clearance_m: 0.0, ignore_m: 0.01, ..Options::default() };
        let planner = Planner::new(&map, &chugo7(), &footprint, options).expect("a planner");
        match planner.plan(&Pose::new(x, 0.3, yaw), &Goal::place(0.7, 0.7)) {
            Ok(route) => prop_assert!(route.points.len() > 1),
            Err(reason) => prop_assert_eq!(reason.to_string().lines().count(), 1),
        }
        prop_assert!(planner.costmap("a").is_ok());
    }
}
