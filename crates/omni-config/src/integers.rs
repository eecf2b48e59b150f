//! Whole numbers in files: a wrong type or size is an error with the range.

use serde::de::{Deserializer, Error, Visitor};

use crate::ranges::{self, Range};

/// Conversion of a whole number in a file.
pub(crate) trait Whole: Sized {
    /// None if it does not fit.
    fn of(number: i64) -> Option<Self>;
}

macro_rules! whole_types {
    ($($type:ty),*) => {$(
        impl Whole for $type {
            fn of(number: i64) -> Option<Self> {
                Self::try_from(number).ok()
            }
        }
    )*};
}
whole_types!(u16, u32, u64, usize);

impl<T: Whole> Whole for Option<T> {
    fn of(number: i64) -> Option<Self> {
        T::of(number).map(Some)
    }
}

/// A reader of whole numbers for each range, to be named by `deserialize_with`. Whether a number
/// that fits its type is in the range garde checks.
macro_rules! readers {
    ($($name:ident: $range:expr;)*) => {$(
        pub(crate) fn $name<'de, D: Deserializer<'de>, T: Whole>(from: D) -> Result<T, D::Error> {
            read(from, $range)
        }
    )*};
}
readers! {
    axis_count: ranges::AXIS_COUNT;
    count: ranges::COUNT;
    iterations: ranges::ITERATIONS;
    max_retries: ranges::MAX_RETRIES;
    periods: ranges::PERIODS;
    periods_from_0: ranges::PERIODS_FROM_0;
    periods_from_2: ranges::PERIODS_FROM_2;
    roller_count: ranges::ROLLER_COUNT;
    roller_rows: ranges::ROLLER_ROWS;
    seed_32: ranges::SEED;
    seed_64: ranges::SEED_64;
    substeps: ranges::SUBSTEPS;
    window_periods: ranges::WINDOW_PERIODS;
}

fn read<'de, D: Deserializer<'de>, T: Whole>(from: D, range: Range) -> Result<T, D::Error> {
    from.deserialize_any(Reader {
        range,
        as_type: T::of,
    })
}

struct Reader<T> {
    range: Range,
    as_type: fn(i64) -> Option<T>,
}

impl<T> Reader<T> {
    /// As messages show it.
    fn allowed(&self) -> String {
        format!("{} to {}", self.range.min as i64, self.range.max as i64)
    }

    fn none<E: Error>(&self, value: impl std::fmt::Display) -> Result<T, E> {
        let allowed = self.allowed();
        Err(E::custom(format!("{value}, allowed: a whole number, {allowed}")))
    }
}

impl<T> Visitor<'_> for Reader<T> {
    type Value = T;

    fn expecting(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(to, "a whole number, {}", self.allowed())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<T, E> {
        (self.as_type)(value).ok_or_else(|| E::custom(format!("{value}, allowed: {}", self.allowed())))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<T, E> {
        match i64::try_from(value) {
            Ok(value) => self.visit_i64(value),
            Err(_) => self.none(value),
        }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<T, E> {
        self.none(format_args!("{value:?}")) // with its point, or 8.0 would read as a whole number
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<T, E> {
        self.none(value)
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<T, E> {
        self.none(format_args!("{value:?}"))
    }
}

#[cfg(test)]
mod tests {
    use crate::{MotorBench, Override, Scenario, Source, Study};

    fn said(scenario: &str, keys: &[&str]) -> String {
        let keys: Vec<_> = keys
            .iter()
            .map(|key| Override::parse(key).expect("key=value"))
            .collect();
        Scenario::load(scenario, &keys).expect_err("refused").to_string()
    }

    #[test]
    fn what_does_not_fit_a_whole_number_is_answered_with_its_range() {
        for (key, value, allowed) in [
            ("control.max_retries", "-1", "0 to 100"),
            ("control.max_retries", "99999999999", "0 to 100"),
            ("control.max_retries", "2.5", "a whole number, 0 to 100"),
            ("control.max_retries", "8.0", "a whole number, 0 to 100"),
            ("control.max_retries", "true", "a whole number, 0 to 100"),
            ("control.max_retries", "\"many\"", "a whole number, 0 to 100"),
            ("physics.solver_iterations", "-1", "1 to 100"),
            ("physics.roller_substeps", "-1", "1 to 16"),
            ("seed", "-1", "0 to 9223372036854775807"),
            ("drive.unobservable_periods", "-1", "0 to 65534"),
            ("drive.slip.enter_periods", "-1", "1 to 65535"),
            ("drive.faults.stuck_periods", "-1", "2 to 65535"),
        ] {
            let text = said("step", &[&format!("{key}={value}")]);
            assert_eq!(text, format!("built-in step: {key}: {value}, allowed: {allowed}"));
        }
        let window = said(
            "step",
            &[
                "sensors.encoder_counts=360",
                "sensors.encoder_velocity={ kind = \"window\", periods = -1 }",
            ],
        );
        assert_eq!(
            window,
            "built-in step: sensors.encoder_velocity.periods: -1, allowed: 1 to 32"
        );
        let list = said("step", &["control.max_retries=[1]"]);
        assert!(
            list.ends_with("control.max_retries: invalid type: sequence, expected a whole number, 0 to 100"),
            "{list}"
        );
    }

    #[test]
    fn those_of_grounds_vehicles_experiments_and_studies_too() {
        assert_eq!(
            said("stairs", &["terrain.count=-1"]),
            "built-in stairs: terrain.count: -1, allowed: 1 to 100"
        );
        assert_eq!(
            said("rough", &["terrain.seed=-1"]),
            "built-in rough: terrain.seed: -1, allowed: 0 to 4294967295"
        );
        assert_eq!(
            said("step", &["vehicle.rollers.count=-1"]),
            "built-in chugo7: rollers.count: -1, allowed: 3 to 32"
        );
        assert_eq!(
            said("step", &["vehicle.rollers.rows=-1"]),
            "built-in chugo7: rollers.rows: -1, allowed: 1 to 2"
        );
        let period = [Override::new("period_s", -5)];
        let error = MotorBench::load("motor_bench", &period).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "built-in motor_bench: period_s: -5, allowed: 0.000001 to 0.1"
        );
        let study = "schema_version = 1\nname = 's'\nscenario = 'flat'\nseeds = 1\n\
                     [[axis]]\nkey = 'terrain.friction'\nfrom = 0.5\nto = 0.9\ncount = -3\n";
        let error = Study::from_source(&Source::text("s.toml", study)).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "s.toml: axis[0].count: -3, allowed: 2 to 10000"
        );
    }
}
