//! A chart as TOML, and the check whether it may be continued.

use omni_config::{Error as ConfigError, Vehicle};

use super::plan::vehicle_sha256;
use super::{Approach, CHART_SCHEMA_VERSION, Chart, ChartPlan};
use crate::Error;

impl Chart {
    /// The chart as its file holds it.
    ///
    /// # Errors
    /// [`omni_sim::Error::Config`] if it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String, Error> {
        toml::to_string(self).map_err(|error| refused("chart", "top level", &error.to_string()))
    }

    /// The chart of a file's text; messages name it `file`.
    ///
    /// # Errors
    /// Its first error, in one line.
    ///
    /// ```
    /// let error = omni_study::Chart::from_toml("a.toml", "schema_version = 2").unwrap_err();
    /// assert_eq!(error.to_string(), "a.toml: schema_version: 2, allowed: 1");
    /// ```
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Error> {
        let wrong = |error: toml::de::Error| {
            let line = error
                .span()
                .map_or(0, |span| text[..span.start.min(text.len())].lines().count());
            let message = error.message().lines().next().unwrap_or_default().to_owned();
            refused(file, &format!("line {line}"), &message)
        };
        let table: toml::Table = toml::from_str(text).map_err(wrong)?;
        let version = table.get("schema_version");
        if version.and_then(toml::Value::as_integer) != Some(i64::from(CHART_SCHEMA_VERSION)) {
            let found = version.map_or_else(|| "missing".into(), ToString::to_string);
            let message = format!("{found}, allowed: {CHART_SCHEMA_VERSION}");
            return Err(refused(file, "schema_version", &message));
        }
        let chart: Self = toml::from_str(text).map_err(wrong)?;
        for (number, cell) in chart.cell.iter().enumerate() {
            let sizes = [
                ("climbs_m", Some(cell.climbs_m)),
                ("limit_m", Some(cell.limit_m)),
                ("fails_m", cell.fails_m),
                ("clearance_m", cell.clearance_m),
                ("climb_limits_m", cell.climb_limits_m),
            ];
            let angles = [("side_deg", cell.side_deg), ("skew_deg", cell.skew_deg)];
            let sizes = sizes
                .into_iter()
                .filter_map(|(key, size)| Some((key, size?, 0.0, 100.0)));
            let angles = angles.into_iter().map(|(key, angle)| (key, angle, -180.0, 180.0));
            for (key, value, least, most) in sizes.chain(angles) {
                if !(least..=most).contains(&value) {
                    let message = format!("{value}, allowed: {least} to {most}");
                    return Err(refused(file, &format!("cell[{number}].{key}"), &message));
                }
            }
        }
        Ok(chart)
    }

    /// Whether it is a chart of this vehicle. Its gains are resolved, as in a scenario.
    ///
    /// # Errors
    /// If it is another's; messages name the chart `file`.
    pub fn check_vehicle(&self, file: &str, vehicle: &Vehicle) -> Result<(), Error> {
        let sha256 = vehicle_sha256(vehicle);
        if self.vehicle_sha256 == sha256 {
            return Ok(());
        }
        let message = format!(
            "that of another vehicle {}, allowed: {sha256}, that of {} as it is now; derived gains belong to it, and follow control.period_s",
            self.vehicle, vehicle.name
        );
        Err(refused(file, "vehicle_sha256", &message))
    }

    /// Is it a chart of the plan's runs, which may get more cells?
    pub(super) fn check_continues(&self, plan: &ChartPlan) -> Result<(), Error> {
        let (mut one, other) = (self.clone(), plan.empty());
        one.cell.clear();
        // What cells there are is another thing than how they are made.
        one.mirrored = other.mirrored;
        if one == other {
            return Ok(());
        }
        let keys = [
            ("omnistep", one.omnistep, other.omnistep),
            ("vehicle", one.vehicle, other.vehicle),
            ("vehicle_sha256", one.vehicle_sha256, other.vehicle_sha256),
            ("policy", one.policy, other.policy),
            ("engine", one.engine, other.engine),
            ("friction", one.friction.to_string(), other.friction.to_string()),
            (
                "speed_m_s",
                one.speed_m_s.to_string(),
                other.speed_m_s.to_string(),
            ),
            ("margin", one.margin.to_string(), other.margin.to_string()),
            ("starts", one.starts.to_string(), other.starts.to_string()),
            ("scenario_key", one.scenario_key, other.scenario_key),
        ];
        let differs = keys.into_iter().find(|(_, one, other)| one != other);
        let (key, found, allowed) =
            differs.unwrap_or(("start", "others".into(), "those of this version".into()));
        let message = format!("{found}, allowed: {allowed}, as the chart that it shall continue");
        Err(refused("chart", key, &message))
    }
}

impl ChartPlan {
    /// What of it a chart lacks.
    pub fn missing(&self, done: &Chart) -> impl Iterator<Item = Approach> {
        let there: Vec<Approach> = done.cell.iter().map(super::ChartCell::approach).collect();
        let missing = self
            .approaches()
            .iter()
            .filter(|approach| !there.contains(approach));
        missing.copied().collect::<Vec<_>>().into_iter()
    }
}

fn refused(file: &str, key: &str, message: &str) -> Error {
    Error::from(ConfigError::Key {
        file: file.into(),
        key: key.into(),
        message: message.into(),
    })
}
