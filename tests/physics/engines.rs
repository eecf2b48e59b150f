//! The same laws on both physics engines.

use std::cell::Cell;

use omni_sim::Verdict;
use omni_sim::config::{Engine, Error, Override, Scenario};

thread_local! {
    static ENGINE: Cell<Engine> = const { Cell::new(Engine::Rapier) };
}

/// The engine that this test is about.
pub(crate) fn engine() -> Engine {
    ENGINE.get()
}

/// Runs a test on an engine.
pub(crate) fn on(engine: Engine, test: fn()) {
    ENGINE.set(engine);
    test();
}

/// [`Scenario::load`] with the engine that the test is about.
pub(crate) fn load(name: &str, overrides: &[Override]) -> Result<Scenario, Error> {
    let engine = Override::new("physics.engine", engine().name());
    let all: Vec<_> = std::iter::once(engine).chain(overrides.iter().cloned()).collect();
    Scenario::load(name, &all)
}

/// How a run of a scenario ends where all goes well.
pub(crate) fn passed(scenario: &Scenario) -> Verdict {
    if scenario.terrain.obstacle().is_some() {
        Verdict::Climbed
    } else if scenario.command.path.is_some() {
        Verdict::Arrived
    } else {
        Verdict::Completed
    }
}

/// Makes of each function a test on each engine: where the physics is the subject.
macro_rules! on_both_engines {
    ($($test:ident,)+) => {
        crate::engines::on_each_engine! { [] $($test,)+ }
    };
}
pub(crate) use on_both_engines;

/// The same where control, sensors or motors are the subject, whose code is one for both: on
/// rapier, which takes ten times as long, in `make test-full` only.
macro_rules! on_the_fast_engine {
    ($($test:ident,)+) => {
        crate::engines::on_each_engine! {
            [ignore = "the engine is not the subject; make test-full runs it on rapier too"] $($test,)+
        }
    };
}
pub(crate) use on_the_fast_engine;

/// Tests on rapier, with an attribute or none, and on the articulated engine.
macro_rules! on_each_engine {
    ($of_rapier:tt $($test:ident,)+) => {
        mod rapier {
            $(crate::engines::on_each_engine! { @ Rapier $of_rapier $test })+
        }
        mod articulated {
            $(crate::engines::on_each_engine! { @ Articulated [] $test })+
        }
    };
    (@ $engine:ident [$($attribute:meta)?] $test:ident) => {
        #[test]
        $(#[$attribute])?
        fn $test() {
            crate::engines::on(omni_sim::config::Engine::$engine, super::$test);
        }
    };
}
pub(crate) use on_each_engine;
