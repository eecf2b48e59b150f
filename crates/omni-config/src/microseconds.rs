//! Times that are whole numbers of microseconds; files state them in seconds.

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::Serializer;

use crate::ranges::{Bounded, DELAY_S, PERIOD_S, Range};

/// The period of a controller or the step of an engine.
pub(crate) fn period<'de, D: Deserializer<'de>>(from: D) -> Result<u64, D::Error> {
    read(from, PERIOD_S)
}

/// A delay.
pub(crate) fn delay<'de, D: Deserializer<'de>>(from: D) -> Result<u64, D::Error> {
    read(from, DELAY_S)
}

// serde's signature.
#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serialize_with passes a reference"
)]
pub(crate) fn write<S: Serializer>(us: &u64, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_f64(seconds(*us))
}

/// The same time \[s\], as a file has it.
pub(crate) fn seconds(us: u64) -> f64 {
    us as f64 / 1e6
}

fn read<'de, D: Deserializer<'de>>(from: D, range: Range) -> Result<u64, D::Error> {
    let seconds = f64::deserialize(from)?;
    let us = (1e6 * seconds).round();
    // 0.0003 * 1e6 is not quite 300.
    let is_whole = (1e6 * seconds - us).abs() <= 1e-9 * us;
    if is_whole && !seconds.outside(range) {
        return Ok(us as u64);
    }
    let whole = if seconds.outside(range) {
        ""
    } else {
        "a whole number of microseconds, "
    };
    Err(D::Error::custom(format!(
        "{}, allowed: {whole}{} to {}",
        seconds.shown(),
        range.min.shown(),
        range.max.shown()
    )))
}

#[cfg(test)]
mod tests {
    use crate::{Override, Scenario};

    #[test]
    fn every_whole_number_of_microseconds_is_read_and_written_without_loss() {
        for us in (1..=100_000).step_by(37) {
            let text = format!("{}", super::seconds(us));
            let read: toml::Value = format!("x = {text}").parse::<toml::Table>().expect("TOML")["x"].clone();
            assert_eq!(super::period(read).expect("in range"), us, "{text}");
        }
        let own = Scenario::load("flat", &[Override::new("physics.timestep_s", 0.00025)]).expect("a divisor");
        assert_eq!((own.physics.timestep_us, own.control.period_us), (250, 1000));
        assert!(own.to_toml().expect("written").contains("timestep_s = 0.00025"));
    }

    #[test]
    fn a_time_that_is_not_whole_or_out_of_range_is_refused_in_seconds() {
        for (key, value, said) in [
            (
                "physics.timestep_s",
                "0.0000015",
                "0.0000015, allowed: a whole number of microseconds, 0.000001 to 0.1",
            ),
            ("physics.timestep_s", "500", "500, allowed: 0.000001 to 0.1"),
            ("control.period_s", "-0.001", "-0.001, allowed: 0.000001 to 0.1"),
            (
                "sensors.delay_s",
                "0.00150001",
                "0.00150001, allowed: a whole number of microseconds, 0 to 0.1",
            ),
            ("sensors.delay_s", "nan", "NaN, allowed: 0 to 0.1"),
            (
                "sensors.delay_s",
                "true",
                "invalid type: boolean `true`, expected a number",
            ),
        ] {
            let key_value = Override::parse(&format!("{key}={value}")).expect("key=value");
            let error = Scenario::load("flat", &[key_value])
                .expect_err("refused")
                .to_string();
            assert!(
                error.starts_with(&format!("built-in flat: {key}: {said}")),
                "{error}"
            );
        }
    }
}
