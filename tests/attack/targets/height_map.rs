//! A picture of heights.

use omni_sim::config::HeightMap;

use super::message::check_message;

pub(super) fn run(data: &[u8]) -> usize {
    match HeightMap::from_png(data) {
        Ok(map) => {
            assert!(
                map.rows() >= 2 && map.columns() >= 2,
                "{} x {}",
                map.rows(),
                map.columns()
            );
            let (row, column) = (map.rows() - 1, map.columns() - 1);
            for level in [
                map.level(0, 0),
                map.level(row, 0),
                map.level(0, column),
                map.level(row, column),
            ] {
                assert!((0.0..=1.0).contains(&level), "level {level}");
            }
        }
        Err(reason) => check_message(&reason),
    }
    1
}
