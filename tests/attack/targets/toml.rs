//! A vehicle, scenario or study; the first byte says which, the rest is the text.

use omni_sim::config::{Scenario, Source, Study, Vehicle};

use super::message::check_message;

pub(super) fn run(data: &[u8]) -> usize {
    let Some((kind, text)) = data.split_first() else {
        return 0;
    };
    let Ok(text) = std::str::from_utf8(text) else {
        return 0;
    };
    let source = Source::text("file.toml", text);
    let refused = match kind % 3 {
        0 => match Vehicle::from_source(&source, &[]) {
            // What is accepted can be written, read again, and is the same.
            Ok(vehicle) => {
                let written = toml::to_string(&vehicle).expect("a vehicle can be written");
                let read = Vehicle::from_source(&Source::text("written", written), &[]);
                assert_eq!(read.expect("what was written is accepted"), vehicle);
                None
            }
            Err(error) => Some(error),
        },
        1 => match Scenario::from_source(&source, &[]) {
            Ok(scenario) => {
                // A seed beyond 2^63 has no place in a TOML file: said so.
                let Ok(written) = scenario.to_toml() else { return 1 };
                let read = Scenario::from_source(&Source::text("written", written), &[]);
                assert!(
                    read.expect("what was written is accepted") == scenario,
                    "it reads back as another"
                );
                None
            }
            Err(error) => Some(error),
        },
        // Of the runs one is enough: all others have the same keys.
        _ => Study::from_source(&source)
            .and_then(|study| study.each_value(&[])?.next().transpose())
            .err(),
    };
    if let Some(error) = &refused {
        check_message(error);
    }
    refused.is_none().into()
}
