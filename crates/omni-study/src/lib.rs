#![doc = include_str!("../README.md")]
//!
//! # In this crate
//!
//! A [`Plan`] lists the runs of a [`Study`](omni_config::Study), each with its key. [`row`] computes the
//! row of one run, whatever happens in it; [`Store`] writes rows as parts and reads them back; [`compute`]
//! puts these together on all cores, and [`chart`] makes a [`Chart`] of what a vehicle climbs.
//! [`cells`] sums rows up, [`paired`] compares them seed by seed. A [`Batch`] is some runs on their
//! way to another process or machine, which writes their rows itself.

#![forbid(unsafe_code)]

mod batch;
mod cell;
mod chart;
mod checksum;
mod columns;
mod error;
mod key;
mod map;
mod merged_rows;
mod own_policy;
mod paired;
mod parquet_table;
mod part_names;
mod part_writer;
mod plan;
mod plan_notices;
mod row;
mod run;
mod statistics;
mod store;

pub use batch::Batch;
pub use cell::{Cell, Column, Columns, Kind};
pub use chart::{
    Approach, CHART_SCHEMA_VERSION, Chart, ChartCell, ChartPlan, ChartSetup, ChartStart, Edge, chart,
    clearance_m,
};
pub use error::Error;
pub use key::key;
pub use map::{MapCell, cells, cells_of};
pub use own_policy::OwnPolicy;
pub use paired::{PairedCell, PairedMetric, paired};
pub use plan::{Plan, Run};
pub use row::{Ended, Row, row, row_with, rows};
pub use run::{Computed, compute};
pub use statistics::{mean_interval, wilson};
pub use store::{Found, Store, damage};
