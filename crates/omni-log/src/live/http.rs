//! Answers to a browser: the page, a viewer's WebSocket, or an error.

use std::convert::Infallible;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{
    ALLOW, CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue,
    REFERRER_POLICY, SEC_WEBSOCKET_PROTOCOL, UPGRADE, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::upgrade::{OnUpgrade, Upgraded};
use hyper::{HeaderMap, Method, Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use sha2::{Digest, Sha256};
use tokio::net::TcpStream;
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::timeout;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};

use super::hub::{Hub, MOST_VIEWERS};

/// Time limit for a client to send its request, and to read a page.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Longest request \[bytes\], and the most headers in it.
const LONGEST_REQUEST: usize = 16 << 10;
const MOST_HEADERS: usize = 64;
/// Longest message of a client \[bytes\]: what it subscribes to, a few numbers, a twist.
const LONGEST_MESSAGE: usize = 64 << 10;
/// Protocol of viewers.
const PROTOCOL: &str = "foxglove.sdk.v1";
const TEXT: HeaderValue = HeaderValue::from_static("text/plain; charset=utf-8");
const HTML: HeaderValue = HeaderValue::from_static("text/html; charset=utf-8");

/// A viewer's connection.
pub(super) type Socket = WebSocketStream<TokioIo<Upgraded>>;
type Answer = Response<Full<Bytes>>;

/// One file, in which everything is: no request follows but for the run itself.
struct Page {
    html: Bytes,
    /// Permissions of the page: its own script and style, and connections to its origin.
    may: HeaderValue,
}

static PAGE: LazyLock<Page> = LazyLock::new(|| {
    // A browser has no carriage returns in what it hashes, however the file came onto this disk.
    let text = |file: &str| file.replace("\r\n", "\n");
    let css = text(include_str!("page/page.css"));
    let js = text(include_str!("page/palette.js"))
        + &text(include_str!("page/draw.js"))
        + &text(include_str!("page/controls.js"))
        + &text(include_str!("page/page.js"));
    let hash = |text: &str| STANDARD.encode(Sha256::digest(text));
    let may = format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; connect-src 'self'; img-src data:; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
        hash(&js),
        hash(&css)
    );
    let html = text(include_str!("page/page.html"));
    let html = html.replace("{css}", &css).replace("{js}", &js);
    Page {
        html: html.into(),
        // Base64 and the words above are what a header may hold.
        may: HeaderValue::try_from(may).unwrap_or(HeaderValue::from_static("default-src 'none'")),
    }
});

/// Reads what a connection wants and answers it once. A viewer, with its place, where it wants to be one and may.
pub(super) async fn answer(stream: TcpStream, hub: &Hub) -> Option<(Socket, OwnedSemaphorePermit)> {
    let viewer = Arc::new(Mutex::new(None));
    let service = service_fn(|mut request: Request<Incoming>| {
        let answer = match answered(&mut request, hub) {
            Ok((answer, becomes)) => {
                *viewer.lock().unwrap_or_else(PoisonError::into_inner) = becomes;
                answer
            }
            Err(refusal) => *refusal,
        };
        std::future::ready(Ok::<_, Infallible>(answer))
    });
    let connection = http1::Builder::new()
        .keep_alive(false)
        .max_buf_size(LONGEST_REQUEST)
        .max_headers(MOST_HEADERS)
        .header_read_timeout(None) // all of it has a time
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades();
    timeout(HANDSHAKE, connection).await.ok()?.ok()?;
    let (upgrade, place) = viewer.lock().unwrap_or_else(PoisonError::into_inner).take()?;
    let limits = WebSocketConfig::default()
        .max_message_size(Some(LONGEST_MESSAGE))
        .max_frame_size(Some(LONGEST_MESSAGE));
    let stream = TokioIo::new(upgrade.await.ok()?);
    let socket = WebSocketStream::from_raw_socket(stream, Role::Server, Some(limits)).await;
    Some((socket, place))
}

/// What becomes a viewer once it has read its answer.
type Becomes = Option<(OnUpgrade, OwnedSemaphorePermit)>;

/// The answer, or an error of one line.
fn answered(request: &mut Request<Incoming>, hub: &Hub) -> Result<(Answer, Becomes), Box<Answer>> {
    hub.guard.check(request.headers()).map_err(|why| {
        hub.warn(&format!("rejected {why}"));
        refusal(StatusCode::FORBIDDEN, &why)
    })?;
    if request.headers().contains_key(UPGRADE) {
        let response = create_response_with_body(request, Full::default)
            .map_err(|error| refusal(StatusCode::BAD_REQUEST, &error.to_string()))?;
        return upgraded(request, response, hub);
    }
    if ![Method::GET, Method::HEAD].contains(request.method()) {
        let mut answer = refusal(StatusCode::METHOD_NOT_ALLOWED, "allowed: GET and HEAD");
        answer
            .headers_mut()
            .insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
        return Err(answer);
    }
    if request.uri().path() != "/" {
        return Err(refusal(StatusCode::NOT_FOUND, "the only page is /"));
    }
    let mut answer = of_ours(StatusCode::OK, PAGE.html.clone(), HTML);
    answer
        .headers_mut()
        .insert(CONTENT_SECURITY_POLICY, PAGE.may.clone());
    Ok((answer, None))
}

/// The answer to who wants to be a viewer and has asked as it should.
fn upgraded(
    request: &mut Request<Incoming>,
    mut response: Answer,
    hub: &Hub,
) -> Result<(Answer, Becomes), Box<Answer>> {
    if !offers(request.headers()) {
        let why = format!("no known Sec-WebSocket-Protocol, allowed: {PROTOCOL}");
        return Err(refusal(StatusCode::BAD_REQUEST, &why));
    }
    let place = hub.places.clone().try_acquire_owned().map_err(|_| {
        let why = format!("{MOST_VIEWERS} viewers are connected, the largest number allowed");
        hub.warn(&format!("rejected a viewer: {why}"));
        refusal(StatusCode::SERVICE_UNAVAILABLE, &why)
    })?;
    response
        .headers_mut()
        .insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(PROTOCOL));
    Ok((response, Some((hyper::upgrade::on(request), place))))
}

/// Does a client speak what viewers must?
fn offers(headers: &HeaderMap) -> bool {
    let offered = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter();
    let offered = offered.filter_map(|value| value.to_str().ok());
    offered
        .flat_map(|value| value.split(','))
        .any(|name| name.trim() == PROTOCOL)
}

/// An answer of one line.
fn refusal(status: StatusCode, why: &str) -> Box<Answer> {
    let mut answer = of_ours(status, format!("{why}\n").into(), TEXT);
    answer
        .headers_mut()
        .insert(CONNECTION, HeaderValue::from_static("close"));
    Box::new(answer)
}

/// An answer that a browser neither keeps, nor guesses the kind of, nor shows inside or to another page.
fn of_ours(status: StatusCode, body: Bytes, kind: HeaderValue) -> Answer {
    let mut answer = Response::new(Full::new(body));
    *answer.status_mut() = status;
    let headers = answer.headers_mut();
    headers.insert(CONTENT_TYPE, kind);
    for (name, value) in [
        (CACHE_CONTROL, "no-store"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (REFERRER_POLICY, "no-referrer"),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    answer
}
