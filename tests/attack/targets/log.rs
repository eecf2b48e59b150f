//! A log, by its file.

use std::cell::Cell;

use omni_log::read_log;

use super::message::check_message;

pub(super) fn run(data: &[u8]) -> usize {
    thread_local!(static NUMBER: Cell<u64> = const { Cell::new(0) });
    let number = NUMBER.replace(NUMBER.get() + 1);
    let thread = std::thread::current().id();
    let name = format!("omnistep-attack-{}-{thread:?}-{number}.mcap", std::process::id());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, data).expect("a folder for temporary files");
    let mut last = 0;
    let read = read_log(&path, |time_ns, _| {
        last = time_ns.max(last);
        Ok(())
    });
    // First of all: what follows may panic.
    std::fs::remove_file(&path).expect("the file is ours");
    match &read {
        Ok(log) => assert!(
            log.until_ns == last,
            "{} is not the last time, {last} is",
            log.until_ns
        ),
        Err(error) => check_message(error),
    }
    read.is_ok().into()
}
