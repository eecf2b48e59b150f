//! The functions that a page calls. Numbers go in and out; texts and bytes lie in the memory.
//!
//! What returns a length says how many bytes lie at [`text`] until the next call. A negative number
//! is an error: its absolute value is the length of one line of text there. Whatever a page gives,
//! a function returns. No name is one of C's library: those would stand in its place.

use std::cell::{Cell, RefCell};

use crate::offer::offer;
use crate::session::Session;

/// Runs at a time.
const MOST_SESSIONS: usize = 8;
/// Control periods of one call: a page that asks for more would hang.
const MOST_PERIODS: u32 = 60_000;
/// Largest request \[bytes\]: the scenario, with a table of commands inside.
const MOST_INPUT: u32 = 1 << 24;

thread_local! {
    static SESSIONS: RefCell<[Option<Session>; MOST_SESSIONS]> = const { RefCell::new([const { None }; MOST_SESSIONS]) };
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static SAID: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static READY: Cell<bool> = const { Cell::new(false) };
}

/// Keeps what was said, for [`text`].
fn say(said: Result<Vec<u8>, String>) -> i32 {
    let (bytes, sign) = match said {
        Ok(bytes) => (bytes, 1),
        Err(line) => (line.into_bytes(), -1),
    };
    SAID.with_borrow_mut(|kept| {
        *kept = bytes;
        sign * i32::try_from(kept.len()).unwrap_or(i32::MAX)
    })
}

/// A number, or the error.
fn number(number: Result<i32, String>) -> i32 {
    number.unwrap_or_else(|line| say(Err(line)))
}

/// Does something with a session.
fn with<T>(handle: i32, what: impl FnOnce(&mut Session) -> Result<T, String>) -> Result<T, String> {
    SESSIONS.with_borrow_mut(|sessions| {
        let place = usize::try_from(handle).ok().and_then(|k| sessions.get_mut(k));
        let session = place.and_then(Option::as_mut);
        session.map_or_else(|| Err(format!("no run has the number {handle}")), what)
    })
}

/// Where what was said last begins.
#[unsafe(no_mangle)]
pub extern "C" fn text() -> *const u8 {
    SAID.with_borrow(|kept| kept.as_ptr())
}

/// The [`report`](crate::report) of so many seconds.
#[unsafe(no_mangle)]
pub extern "C" fn report(duration_s: f64) -> i32 {
    say(crate::report(duration_s).map(String::into_bytes))
}

/// Scenarios, vehicles, policies: JSON.
#[unsafe(no_mangle)]
pub extern "C" fn offered() -> i32 {
    say(offer().map(String::into_bytes))
}

/// Room for a request of so many bytes; null where it is too long.
#[unsafe(no_mangle)]
pub extern "C" fn request_room(length: u32) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        input.clear();
        READY.set(length <= MOST_INPUT);
        if length > MOST_INPUT {
            return std::ptr::null_mut();
        }
        input.resize(length as usize, 0);
        input.as_mut_ptr()
    })
}

/// Starts the run of the request in [`request_room`], and returns its number.
#[unsafe(no_mangle)]
pub extern "C" fn run_open() -> i32 {
    let request = INPUT.take();
    if !READY.replace(false) {
        return say(Err(format!("request: allowed: up to {MOST_INPUT} bytes")));
    }
    number(SESSIONS.with_borrow_mut(|sessions| {
        let free = sessions.iter().position(Option::is_none);
        let free = free.ok_or_else(|| format!("{MOST_SESSIONS} runs are open, and no more are allowed"))?;
        sessions[free] = Some(Session::open(&request)?);
        Ok(free as i32)
    }))
}

/// Ends a run, if there is one of that number.
#[unsafe(no_mangle)]
pub extern "C" fn run_close(handle: i32) {
    let _ = SESSIONS.with_borrow_mut(|sessions| {
        let place = usize::try_from(handle).ok().and_then(|k| sessions.get_mut(k));
        place.and_then(Option::take)
    });
}

/// Goes on for some control periods with the scenario's own command, and returns how many it went.
#[unsafe(no_mangle)]
pub extern "C" fn run_follow(handle: i32, periods: u32) -> i32 {
    advance(handle, periods, None)
}

/// The same with a command: forward, left \[m/s\], counter-clockwise \[rad/s\].
#[unsafe(no_mangle)]
pub extern "C" fn run_drive(handle: i32, periods: u32, vx_m_s: f64, vy_m_s: f64, wz_rad_s: f64) -> i32 {
    advance(handle, periods, Some([vx_m_s, vy_m_s, wz_rad_s]))
}

fn advance(handle: i32, periods: u32, command: Option<[f64; 3]>) -> i32 {
    let periods = periods.min(MOST_PERIODS);
    number(with(handle, |session| session.advance(periods, command)).map(|done| done as i32))
}

/// What there is to see: JSON.
#[unsafe(no_mangle)]
pub extern "C" fn run_scene(handle: i32) -> i32 {
    say(with(handle, |session| Ok(session.scene().into_bytes())))
}

/// How it is now: JSON.
#[unsafe(no_mangle)]
pub extern "C" fn run_state(handle: i32) -> i32 {
    say(with(handle, |session| Ok(session.state().into_bytes())))
}

/// The metrics until now: JSON.
#[unsafe(no_mangle)]
pub extern "C" fn run_outcome(handle: i32) -> i32 {
    say(with(handle, |session| Ok(session.outcome().into_bytes())))
}

/// The commands so far: CSV.
#[unsafe(no_mangle)]
pub extern "C" fn run_commands(handle: i32) -> i32 {
    say(with(handle, |session| Ok(session.commands().into_bytes())))
}

/// What has been written of the log since the last time.
#[unsafe(no_mangle)]
pub extern "C" fn run_log(handle: i32) -> i32 {
    say(with(handle, Session::log))
}

/// The last piece of the log.
#[unsafe(no_mangle)]
pub extern "C" fn run_finish_log(handle: i32) -> i32 {
    say(with(handle, Session::finish_log))
}
