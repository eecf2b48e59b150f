//! Options of `omnistep drive`.

use clap::Args;

#[derive(Args)]
pub(crate) struct DriveArgs {
    /// A built-in vehicle or scenario, or a .toml file of one. A vehicle drives over the bumps of the scenario bumps,
    /// or on level ground if the bumps need rollers.
    #[arg(value_name = "VEHICLE|SCENARIO", default_value = "bumps")]
    pub(crate) name: String,
    /// A vehicle instead of the scenario's: a built-in one or a .toml file.
    #[arg(long)]
    pub(crate) vehicle: Option<String>,
    /// Replaces a key of the scenario or, with "vehicle." in front, of its vehicle, such as terrain.friction=0.5
    /// or vehicle.motor.stall_torque_n_m=1; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Initial coordination policy instead of the scenario's: independent, scale_torques,
    /// scale_references, shared_integral, traction_runup or traction.
    #[arg(long)]
    pub(crate) policy: Option<String>,
    /// Port on 127.0.0.1 of the page, and of Foxglove and Lichtblick; 0 for any free port.
    #[arg(long, default_value_t = 8765)]
    pub(crate) port: u16,
    /// Simulated seconds per second of real time; inf for as fast as possible.
    #[arg(long, default_value_t = 1.0)]
    pub(crate) real_time_factor: f64,
    /// Lets web pages from another origin connect and drive, such as https://viewer.example; may be
    /// repeated. Without it only the run's own page may connect.
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    pub(crate) origins: Vec<String>,
    /// Ignores keys in this terminal: only the page and other clients drive.
    #[arg(long)]
    pub(crate) no_keys: bool,
    /// Prints one JSON object at the end instead of the table.
    #[arg(long)]
    pub(crate) json: bool,
    /// Explains each metric below the table.
    #[arg(long, conflicts_with = "json")]
    pub(crate) explain: bool,
}
