//! A trace as Python pickles it.

use omni_sim::Trace;

pub(super) fn run(data: &[u8]) -> usize {
    let read = postcard::from_bytes::<Trace>(data);
    if let Ok(trace) = &read {
        // What is asked of every trace: its columns, by name and by wheel.
        for name in trace.names() {
            let column = trace.column(name).expect("a column of that name");
            assert_eq!(column.len(), trace.rows(), "{name}");
        }
        for (wheel, signal) in trace
            .wheel_names()
            .iter()
            .enumerate()
            .flat_map(|(wheel, _)| trace.wheel_signals().iter().map(move |signal| (wheel, signal)))
        {
            let column = trace.wheel(signal, wheel).expect("a column of that signal");
            assert_eq!(column.len(), trace.rows(), "{signal} of wheel {wheel}");
        }
    }
    read.is_ok().into()
}
