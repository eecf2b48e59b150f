//! Keys pressed in a terminal; the only module that names crossterm.
//!
//! A terminal reports a key that goes down, and again and again while it is held, but not when it comes up.
//! Therefore each press requests a velocity that lasts as long as any command, and the next one renews it.

use std::io::{IsTerminal, Write, stderr, stdin};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossterm::cursor::MoveToColumn;
use crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, poll, read};
use crossterm::style::Print;
use crossterm::terminal::{Clear, ClearType, disable_raw_mode, enable_raw_mode, size};
use crossterm::{ExecutableCommand, QueueableCommand};
use omni_config::shortened_line;
use omni_log::Pilot;
use omni_sim::Simulation;

use crate::output::say;

/// How long a press holds: as any command of a live run.
const HOLDS: Duration = Duration::from_millis(500);
/// Time between two looks at the keys, and between two status lines.
const LOOK: Duration = Duration::from_millis(10);
const STATUS: Duration = Duration::from_millis(100);
/// Keys that are taken in one look: a text that is pasted must not hold the run up.
const MOST_KEYS: usize = 64;
/// What one press of + or - makes of the speed, and how far it goes.
const FASTER: f64 = 1.25;
const PARTS: [f64; 2] = [0.1, 3.0];
/// What the keys do.
const HELP: &str =
    "arrows or W A S D drive, Q and E turn, space stops, + and - change the speed, Esc or Ctrl-C ends";

/// Is the terminal raw now, so that lines need a carriage return?
static RAW: AtomicBool = AtomicBool::new(false);

/// The terminal as programs have it that read key by key; as it was when this goes, by whatever way.
struct Raw;

impl Raw {
    fn new() -> std::io::Result<Self> {
        enable_raw_mode()?;
        RAW.store(true, Ordering::SeqCst);
        Ok(Self)
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        clear();
        RAW.store(false, Ordering::SeqCst);
        // The program that took the terminal away has it.
        let _ = disable_raw_mode();
    }
}

/// What was pressed on one axis, and when.
type Press = Option<(f64, Instant)>;

/// The keys of this terminal.
pub(super) struct Keys {
    _raw: Raw,
    pilot: Pilot,
    pace: [f64; 3],
    /// Part of the pace.
    part: f64,
    held: [Press; 3],
    asked: [f64; 3],
    looked: Option<Instant>,
    shown: Option<Instant>,
}

impl Keys {
    /// Begins to read them, and says which there are; or says that there are none, and why.
    pub(super) fn open(pace: [f64; 3], pilot: Pilot) -> Option<Self> {
        if !stdin().is_terminal() || !stderr().is_terminal() {
            say("keys are off: this is not a terminal");
            return None;
        }
        say(&format!("keys: {HELP}; each press acts for 0.5 s"));
        match Raw::new() {
            Ok(raw) => Some(Self {
                _raw: raw,
                pilot,
                pace,
                part: 1.0,
                held: [None; 3],
                asked: [0.0; 3],
                looked: None,
                shown: None,
            }),
            Err(error) => {
                say(&format!("keys are off: {error}"));
                None
            }
        }
    }

    /// Takes what was pressed and shows how it is, if it is time to. True if a key ends the run, or there is no
    /// terminal any more.
    pub(super) fn look(&mut self, simulation: &Simulation) -> bool {
        let now = Instant::now();
        if self.looked.is_some_and(|last| now - last < LOOK) {
            return false;
        }
        self.looked = Some(now);
        let mut pressed = false;
        for _ in 0..MOST_KEYS {
            if !poll(Duration::ZERO).unwrap_or(false) {
                break;
            }
            match read() {
                Ok(Event::Key(key)) if key.kind != KeyEventKind::Release => match self.press(key, now) {
                    Pressed::Ends => return true,
                    Pressed::Drives => pressed = true,
                    Pressed::Nothing => {}
                },
                Ok(_) => {}
                Err(_) => return true,
            }
        }
        let twist = self.twist(now);
        if pressed || twist != self.asked {
            self.asked = twist;
            self.pilot.ask(twist);
        }
        if self.shown.is_none_or(|last| now - last >= STATUS) {
            self.shown = Some(now);
            self.show(simulation);
        }
        false
    }

    fn press(&mut self, key: KeyEvent, now: Instant) -> Pressed {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        let code = match key.code {
            KeyCode::Char(letter) => KeyCode::Char(letter.to_ascii_lowercase()),
            other => other,
        };
        let (axis, way) = match code {
            KeyCode::Esc => return Pressed::Ends,
            KeyCode::Char('c') if control => return Pressed::Ends,
            _ if control => return Pressed::Nothing,
            KeyCode::Up | KeyCode::Char('w') => (0, 1.0),
            KeyCode::Down | KeyCode::Char('s') => (0, -1.0),
            KeyCode::Left | KeyCode::Char('a') => (1, 1.0),
            KeyCode::Right | KeyCode::Char('d') => (1, -1.0),
            KeyCode::Char('q') => (2, 1.0),
            KeyCode::Char('e') => (2, -1.0),
            KeyCode::Char(' ') => {
                self.held = [None; 3];
                return Pressed::Drives;
            }
            KeyCode::Char(sign @ ('+' | '=' | '-')) => {
                let factor = if sign == '-' { 1.0 / FASTER } else { FASTER };
                self.part = (self.part * factor).clamp(PARTS[0], PARTS[1]);
                return Pressed::Nothing;
            }
            _ => return Pressed::Nothing,
        };
        self.held[axis] = Some((way, now));
        Pressed::Drives
    }

    /// What is held, as a twist.
    fn twist(&mut self, now: Instant) -> [f64; 3] {
        [0, 1, 2].map(|axis| match self.held[axis] {
            Some((way, at)) if now - at < HOLDS => way * self.part * self.pace[axis],
            _ => {
                self.held[axis] = None;
                0.0
            }
        })
    }

    fn show(&self, simulation: &Simulation) {
        let seen = simulation.observation();
        let [x, y, _] = seen.pose.position_m;
        let line = format!(
            "{:.1} s | ahead {:+.2}, left {:+.2} m/s, turning {:+.2} rad/s | at ({x:.2}, {y:.2}) m | keys {:.2} m/s",
            simulation.time_ns() as f64 * 1e-9,
            seen.twist.vx_m_s,
            seen.twist.vy_m_s,
            seen.twist.wz_rad_s,
            self.part * self.pace[0],
        );
        let most = match size() {
            Ok((columns @ 2.., _)) => usize::from(columns) - 1,
            _ => 79, // not known
        };
        let line: String = line.chars().take(most).collect();
        let mut terminal = stderr();
        let queued = terminal
            .queue(MoveToColumn(0))
            .and_then(|terminal| terminal.queue(Clear(ClearType::CurrentLine)))
            .and_then(|terminal| terminal.queue(Print(line)))
            .map(|_| ());
        // A closed terminal is no reason to fail.
        let _ = queued.and_then(|()| terminal.flush());
    }
}

/// What a press means.
enum Pressed {
    Drives,
    Ends,
    Nothing,
}

/// Takes the status line away.
fn clear() {
    let mut terminal = stderr();
    let _ = terminal
        .execute(MoveToColumn(0))
        .and_then(|terminal| terminal.execute(Clear(ClearType::CurrentLine)));
}

/// A line on standard error, above the status line if there is one.
pub(super) fn say_between(line: &str) {
    if !RAW.load(Ordering::SeqCst) {
        return say(line);
    }
    clear();
    let _ = write!(stderr(), "{}\r\n", shortened_line(line));
}
