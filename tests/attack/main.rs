//! Attacks that need no other program: random bits and the corpus of `fuzz/`, through the six targets of the fuzzer.
//!
//! ```sh
//! cargo test --test attack                              # the quick campaign
//! cargo test --test attack -- --times 20 --seed 7       # twenty times as many steps, other random bits
//! cargo test --test attack -- corpus log                # the corpus of one target; `random` for the rest
//! cargo test --test attack -- drive out/attack/x.bin    # an input that failed, again
//! cargo test --test attack -- --seed 7 random drive 5 8 # random inputs 5 and 8 of a seed, one by one
//! ```
//!
//! Started as `qemu-system-arm` it is a firmware with false answers. The last lines are a table;
//! where anything failed the exit code is 1, and each failure names the file that fails again.
#![expect(clippy::unwrap_used, reason = "a campaign that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "it is a program of its own")]

mod firmware;
mod targets;

use std::collections::BTreeSet;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore as _, SeedableRng as _};
use targets::{TARGETS, Target};

/// Bytes of one random input: some 300 steps, or 700 frames.
const BYTES: usize = 30_000;
/// Steps, and frames, of the quick campaign.
const QUICK: usize = 1_000_000;
/// Inputs of the corpus that must be read to their end: behind a refused scenario the fuzzer finds nothing.
const WHOLE: [&str; 6] = [
    "scenario",
    "scenario-bumps",
    "study",
    "vehicle",
    "vehicle-hinges",
    "whole",
];
/// After so many failures of one campaign enough is known.
const ENOUGH: usize = 5;

/// What became of a campaign.
struct Row {
    campaign: String,
    tried: usize,
    /// What one of `tried` is.
    unit: &'static str,
    failures: Vec<Failure>,
}

struct Failure {
    input: PathBuf,
    why: String,
}

fn main() -> ExitCode {
    let name = std::env::args_os().next().map(PathBuf::from);
    if name.is_some_and(|name| name.ends_with("qemu-system-arm")) {
        firmware::serve(&std::env::var("OMNISTEP_LIE").unwrap_or_default());
        return ExitCode::SUCCESS;
    }
    assert!(
        cfg!(debug_assertions),
        "built without overflow checks: an overflow would pass unseen"
    );
    let mut arguments = std::env::args().skip(1).peekable();
    let (mut times, mut seed, mut table, mut again) = (1, 1, None, Vec::new());
    while let Some(argument) = arguments.next() {
        let mut number = || {
            arguments
                .next()
                .and_then(|text| text.parse().ok())
                .expect("a number")
        };
        match argument.as_str() {
            "--times" => times = number() as usize,
            "--seed" => seed = number(),
            "--table" => table = arguments.next(),
            _ => again.push(argument),
        }
    }
    let words: Vec<_> = again.iter().map(String::as_str).collect();
    let rows = match words.as_slice() {
        [] => TARGETS
            .map(corpus)
            .into_iter()
            .chain(randoms(times, seed))
            .collect(),
        ["random"] => randoms(times, seed).into(),
        ["random", target, inputs @ ..] => {
            let inputs = inputs.iter().map(|input| input.parse().expect("a number"));
            let files = inputs.map(|input| keep_random(target, seed, input, &random_bytes(seed, input)));
            vec![of_files(
                &format!("{target} again"),
                named(target),
                files.collect(),
            )]
        }
        ["corpus", target] => vec![corpus(named(target))],
        [target, files @ ..] => {
            let files = files.iter().map(PathBuf::from).collect();
            vec![of_files(&format!("{target} again"), named(target), files)]
        }
    };
    report(&rows, table.as_deref());
    ExitCode::from(u8::from(rows.iter().any(|row| !row.failures.is_empty())))
}

fn named(target: &str) -> Target {
    let known = TARGETS.map(|(name, _)| name).join(", ");
    let found = TARGETS.into_iter().find(|(name, _)| *name == target);
    found.unwrap_or_else(|| panic!("{target}, allowed: {known}"))
}

/// The campaigns of random bits.
fn randoms(times: usize, seed: u64) -> [Row; 2] {
    let enough = times * QUICK;
    [
        random("core: Drive::step, random bits", "drive", "steps", enough, seed),
        random(
            "link: random, damaged and lying frames",
            "link",
            "frames",
            enough,
            seed,
        ),
    ]
}

fn top() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the target; why it panicked, if it did.
fn attempt((_, target): Target, data: &[u8]) -> Result<usize, String> {
    catch_unwind(AssertUnwindSafe(|| target(data))).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("a panic without words")
            .into()
    })
}

/// Every file of the target's corpus.
fn corpus(target: Target) -> Row {
    let folder = top().join("fuzz/corpus").join(target.0);
    let files = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<_> = files.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    of_files(&format!("corpus: {}", target.0), target, files)
}

fn of_files(campaign: &str, target: Target, files: Vec<PathBuf>) -> Row {
    quietly(|| {
        let failures = files.iter().filter_map(|input| {
            let data = std::fs::read(input).unwrap_or_else(|error| panic!("{}: {error}", input.display()));
            running(&input.display().to_string());
            let whole = input
                .file_name()
                .is_some_and(|name| WHOLE.iter().any(|whole| name == *whole));
            let why = match attempt(target, &data) {
                Ok(0) if whole => "it is refused: make it anew".into(),
                Ok(_) => return None,
                Err(why) => why,
            };
            Some(Failure {
                input: input.clone(),
                why,
            })
        });
        Row {
            campaign: campaign.into(),
            failures: failures.collect(),
            tried: files.len(),
            unit: "files",
        }
    })
}

/// Random inputs until so many steps are done, on every core. Input k of a seed is always the same.
fn random(campaign: &str, target: &str, unit: &'static str, enough: usize, seed: u64) -> Row {
    let target = named(target);
    let (next, done, failures) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(Vec::new()));
    // One of each core: an input that hangs stays in it while other cores go on.
    let at_work = Mutex::new(BTreeSet::new());
    let work = || {
        while done.load(Ordering::Relaxed) < enough && failures.lock().unwrap().len() < ENOUGH {
            let input = next.fetch_add(1, Ordering::Relaxed);
            let data = random_bytes(seed, input);
            {
                // Under the lock, so that no older list is written after a newer one.
                let mut at_work = at_work.lock().unwrap();
                at_work.insert(input);
                let inputs: Vec<_> = at_work.iter().map(usize::to_string).collect();
                let (target, inputs) = (target.0, inputs.join(" "));
                running(&format!(
                    "{campaign}: cargo test --test attack -- --seed {seed} random {target} {inputs}"
                ));
            }
            match attempt(target, &data) {
                Ok(steps) => {
                    done.fetch_add(steps, Ordering::Relaxed);
                }
                Err(why) => failures.lock().unwrap().push((input, data, why)),
            }
            at_work.lock().unwrap().remove(&input);
        }
    };
    quietly(|| {
        std::thread::scope(|scope| {
            for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
    });
    let mut failures = failures.into_inner().unwrap();
    failures.sort_by_key(|(input, ..)| *input);
    let kept = failures.into_iter().map(|(input, data, why)| Failure {
        input: keep_random(target.0, seed, input, &data),
        why,
    });
    Row {
        campaign: campaign.into(),
        failures: kept.collect(),
        tried: done.into_inner(),
        unit,
    }
}

/// Random input k of a seed.
fn random_bytes(seed: u64, input: usize) -> Vec<u8> {
    let mut data = vec![0; BYTES];
    ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1 << 32).wrapping_add(input as u64)).fill_bytes(&mut data);
    data
}

/// Without the panics' own words: they are in the table.
fn quietly<T>(work: impl FnOnce() -> T) -> T {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let result = catch_unwind(AssertUnwindSafe(work));
    std::panic::set_hook(hook);
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Says what is being run, where it can be read after a hang or when the whole process has ended; never half of it.
fn running(what: &str) {
    let new = keep("running.new", what.as_bytes());
    std::fs::rename(&new, new.with_extension("")).unwrap();
}

/// Writes a random input to where it can be run again.
fn keep_random(target: &str, seed: u64, input: usize, data: &[u8]) -> PathBuf {
    keep(&format!("{target}-{seed}-{input}.bin"), data)
}

/// Writes an input to where it can be run again.
fn keep(name: &str, data: &[u8]) -> PathBuf {
    let folder = top().join("out/attack");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, data).unwrap();
    path
}

/// The table, and for scripts the same as JSON lines in a file.
fn report(rows: &[Row], table: Option<&str>) {
    for row in rows {
        for Failure { input, why } in &row.failures {
            let input = input.strip_prefix(top()).unwrap_or(input).display();
            println!("{}: {input}: {why}", row.campaign);
        }
    }
    println!("{:<42} {:>12} {:>8}", "campaign", "tried", "failed");
    for row in rows {
        println!(
            "{:<42} {:>12} {:>8}",
            row.campaign,
            format!("{} {}", row.tried, row.unit),
            row.failures.len()
        );
    }
    let Some(table) = table else { return };
    let mut file = std::fs::File::create(table).unwrap();
    for row in rows {
        let line = serde_json::json!({
            "campaign": row.campaign, "tried": row.tried, "unit": row.unit, "failed": row.failures.len(),
        });
        writeln!(file, "{line}").unwrap();
    }
}
