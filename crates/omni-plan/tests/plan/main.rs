//! Plans: laws of routes, random maps against an exhaustive search, and files.

mod brute_force;
mod common;
mod files;
mod laws;
