//! Services of the run's node: a pause, and another start.

use std::sync::Arc;

use byteorder::LittleEndian;
use ros2_client::{Name, Node, Server, ServiceMapping, ServiceTypeName};
use serde::Serialize;

use super::listener::{Listener, MOST};
use super::payload::{Cdr, reliable};
use crate::live::controls::Controls;

/// Length of the header that Cyclone's middleware puts before requests and responses \[bytes\]: half of
/// the client's identity, and the request's number. That of Fast DDS is outside the message.
const CYCLONE_HEADER: usize = 16;

/// Longest request, padding included \[bytes\].
const LONGEST_BODY: usize = 8;

/// Response of `std_srvs/srv/SetBool`.
#[derive(Serialize)]
struct Set {
    success: bool,
    message: String,
}

/// `omnistep/pause`, and `omnistep/reset` if the run can start again; answered until the listener is dropped.
pub(super) fn offer(
    node: &mut Node,
    namespace: &str,
    (controls, can_start_again): (Arc<Controls>, bool),
) -> Result<Listener, String> {
    let mut server = |name: &str, kind: &str| -> Result<Server<Cdr, Cdr>, String> {
        let full = format!("{}/omnistep/{name}", namespace.trim_end_matches('/'));
        let full = Name::parse(&full).map_err(|error| error.to_string())?;
        let kind = ServiceTypeName::new("std_srvs", kind);
        node.create_server(ServiceMapping::Enhanced, &full, &kind, reliable(), reliable())
            .map_err(|error| error.to_string())
    };
    let pause = server("pause", "SetBool")?;
    let reset = can_start_again.then(|| server("reset", "Empty")).transpose()?;
    Listener::start("ros2 services", move || {
        answer(&pause, |request| set_paused(&controls, request));
        if let Some(reset) = &reset {
            answer(reset, |request| {
                request.first()?;
                controls.start_again();
                Some(vec![0]) // a response without fields has one byte
            });
        }
    })
}

/// Answers what came; a request that is none has no answer.
fn answer(server: &Server<Cdr, Cdr>, mut done: impl FnMut(&[u8]) -> Option<Vec<u8>>) {
    for _ in 0..MOST {
        match server.receive_request() {
            Ok(Some((id, request))) => {
                let (header, body) = parts(&request.0);
                if let Some(response) = done(body) {
                    // A client that has gone misses its answer.
                    let _ = server.send_response(id, Cdr([header, &response].concat()));
                }
            }
            Ok(None) => break,
            Err(_) => {}
        }
    }
}

/// The header of Cyclone's middleware, which its client wants back, and the request: a single byte, which
/// may have padding behind it. Of what is neither nothing is left.
fn parts(request: &[u8]) -> (&[u8], &[u8]) {
    match request.split_at_checked(CYCLONE_HEADER) {
        Some((header, body)) if !body.is_empty() => (header, body),
        None if request.len() <= LONGEST_BODY => (&[], request),
        _ => (&[], &[]),
    }
}

fn set_paused(controls: &Controls, request: &[u8]) -> Option<Vec<u8>> {
    let paused = match request.first()? {
        0 => false,
        1 => true,
        _ => return None,
    };
    controls.pause(paused);
    let message = if paused { "paused" } else { "running" };
    let set = Set {
        success: true,
        message: message.into(),
    };
    cdr_encoding::to_vec::<_, LittleEndian>(&set).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_of_either_middleware_pauses_and_what_is_none_does_nothing() {
        let controls = Controls::default();
        for (request, paused) in [(&[1][..], true), (&[0, 0, 0, 0], false), (&[1, 0, 0, 0], true)] {
            let (header, body) = parts(request);
            assert!(header.is_empty());
            let response = set_paused(&controls, body).expect("an answer");
            assert_eq!(controls.is_paused(), paused);
            // success, padding to the length of the text, which counts the final zero
            let text: &[u8] = if paused { b"paused\0" } else { b"running\0" };
            let length = u8::try_from(text.len()).expect("short");
            assert_eq!(response, [&[1, 0, 0, 0, length, 0, 0, 0], text].concat());
        }
        let header: Vec<u8> = (1..=16).collect();
        let request = [&header[..], &[0]].concat();
        assert_eq!(parts(&request), (&header[..], &[0][..]));
        for request in [&[][..], &[2], &header] {
            assert_eq!(set_paused(&controls, parts(request).1), None, "{request:?}");
        }
        assert!(controls.is_paused(), "as it was");
    }
}
