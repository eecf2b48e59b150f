//! Access control of connections: programs of this machine, and pages that are known viewers.
//!
//! A browser allows every page to connect to this machine. It says whose page it is (`Origin`) and which name was
//! looked up (`Host`, which a page of elsewhere can make resolve to this machine). A program that is no browser sends
//! no `Origin`, and could send any.

use tokio_tungstenite::tungstenite::http::uri::Authority;
use tokio_tungstenite::tungstenite::http::{HeaderMap, header};

/// Pages of known viewers: Foxglove's and Lichtblick's in a browser, and their desktop programs, whose pages are files.
const VIEWERS: [&str; 4] = [
    "https://app.foxglove.dev",
    "https://studio.foxglove.dev",
    "https://lichtblick-suite.github.io",
    "file://",
];
/// Names of this machine, as a browser writes them.
const THIS_MACHINE: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];
/// Shown length of a foreign header \[characters\].
const MOST_SHOWN: usize = 100;

/// Whose pages may connect.
pub(super) struct Guard {
    origins: Vec<String>,
    /// Of the pages of this machine the run's own alone.
    own_page: bool,
}

impl Guard {
    /// Known viewers, pages of this machine and the origins of `more`, or the one of these that is
    /// none; with `own_page` only the run's own page and the pages of `more`.
    pub(super) fn new(more: &[String], own_page: bool) -> Result<Self, String> {
        let known = VIEWERS
            .iter()
            .filter(|_| !own_page)
            .map(|&origin| origin.to_owned());
        let more = more.iter().map(|origin| {
            let origin = origin.to_ascii_lowercase();
            if is_origin(&origin) {
                Ok(origin)
            } else {
                Err(origin)
            }
        });
        let origins = known.map(Ok).chain(more);
        Ok(Self {
            origins: origins.collect::<Result<_, _>>()?,
            own_page,
        })
    }

    /// Nothing, or in one line why a request is rejected.
    pub(super) fn check(&self, headers: &HeaderMap) -> Result<(), String> {
        let host = only(headers, header::HOST)?.ok_or("no Host, allowed: localhost, 127.0.0.1 or [::1]")?;
        let Some(port) = here(host) else {
            let host = shown(host);
            return Err(format!("Host {host}, allowed: localhost, 127.0.0.1 or [::1]"));
        };
        let Some(origin) = only(headers, header::ORIGIN)? else {
            return Ok(());
        };
        let lower = origin.to_ascii_lowercase();
        let local = ["http://", "https://"]
            .iter()
            .find_map(|scheme| lower.strip_prefix(scheme));
        let is_own = |page: Option<u16>| !self.own_page || page == port;
        if local.and_then(here).is_some_and(is_own) || self.origins.contains(&lower) {
            return Ok(());
        }
        let origin = shown(origin);
        Err(format!(
            "a page from {origin}: allow it with --allow-origin {origin}"
        ))
    }
}

/// The value of a header that may be there once.
fn only(headers: &HeaderMap, name: header::HeaderName) -> Result<Option<&str>, String> {
    let mut values = headers.get_all(&name).iter();
    match (values.next(), values.next()) {
        (None, _) => Ok(None),
        (Some(value), None) => value
            .to_str()
            .map(Some)
            .map_err(|_| format!("{name} is not ASCII")),
        (Some(_), Some(_)) => Err(format!("{name} is given more than once")),
    }
}

/// The port, or none, of a name of this machine; nothing if it is another name, or more than name and port.
fn here(authority: &str) -> Option<Option<u16>> {
    let rest = THIS_MACHINE.iter().find_map(|name| {
        let (start, rest) = authority.split_at_checked(name.len())?;
        start.eq_ignore_ascii_case(name).then_some(rest)
    })?;
    if rest.is_empty() {
        return Some(None);
    }
    let digits = rest.strip_prefix(':')?;
    // A number for Rust may have a sign.
    let port = digits
        .bytes()
        .all(|byte| byte.is_ascii_digit())
        .then_some(digits)?;
    port.parse().ok().map(Some)
}

/// Is it what a browser may call a page's origin: a scheme, a name and perhaps a port, nothing after it?
fn is_origin(origin: &str) -> bool {
    let Some((scheme, rest)) = origin.split_once("://") else {
        return origin == "null";
    };
    !scheme.is_empty()
        && scheme
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
        && (scheme == "file" && rest.is_empty() || !rest.contains('@') && rest.parse::<Authority>().is_ok())
}

fn shown(value: &str) -> String {
    match value.char_indices().nth(MOST_SHOWN) {
        Some((end, _)) => format!("{}...", &value[..end]),
        None => value.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(guard: &Guard, lines: &[(&'static str, &str)]) -> Result<(), String> {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(*name, value.parse().expect("a header"));
        }
        guard.check(&headers)
    }

    #[test]
    fn only_programs_of_this_machine_and_pages_of_known_viewers_connect() {
        let guard = Guard::new(&["https://Viewer.example:8080".into()], false).expect("an origin");
        for host in [
            "localhost",
            "LOCALHOST:8765",
            "127.0.0.1",
            "127.0.0.1:1",
            "[::1]",
            "[::1]:8765",
        ] {
            assert_eq!(check(&guard, &[("host", host)]), Ok(()), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "evil.example:8765",
            "localhost@evil.example",
            "evil@localhost",
            "[::2]",
            "127.0.0.2",
            "localhost:",
            "localhost:+80",
            "localhost:65536",
            "localhost:8765.evil.example",
            "127.0.0.1:8765/",
            "[::1]8765",
            "",
        ] {
            assert!(check(&guard, &[("host", host)]).is_err(), "{host}");
        }
        assert!(
            check(&guard, &[]).is_err()
                && check(&guard, &[("host", "localhost"), ("host", "localhost")]).is_err()
        );
        let from = |origin| check(&guard, &[("host", "127.0.0.1:8765"), ("origin", origin)]);
        for origin in [
            "http://localhost:8080",
            "http://127.0.0.1",
            "https://localhost",
            "http://[::1]:3000",
            "https://app.foxglove.dev",
            "https://viewer.example:8080",
            "file://",
        ] {
            assert_eq!(from(origin), Ok(()), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "http://app.foxglove.dev",
            "https://app.foxglove.dev.evil.example",
            "https://app.foxglove.dev:444",
            "https://viewer.example",
            "http://localhost.evil.example",
            "http://localhost@evil.example",
            "http://127.0.0.1:8765.evil.example",
            "http://localhost:8765:1",
            "http://localhost:8765/path",
            "localhost",
            "null",
            "",
        ] {
            assert!(from(origin).is_err(), "{origin}");
        }
        assert_eq!(
            from("https://evil.example"),
            Err("a page from https://evil.example: allow it with --allow-origin https://evil.example".into())
        );
        let both = [
            ("host", "localhost"),
            ("origin", "http://localhost"),
            ("origin", "https://evil.example"),
        ];
        assert!(check(&guard, &both).is_err());
    }

    #[test]
    fn what_is_no_origin_cannot_be_allowed() {
        for good in [
            "http://a",
            "https://a.example:1",
            "vscode-webview://abc",
            "null",
            "file://",
        ] {
            assert!(Guard::new(&[good.into()], false).is_ok(), "{good}");
        }
        for bad in [
            "a.example",
            "https://a.example/",
            "https://a.example/path",
            "https://",
            "://a",
            "*",
            "https://a@b",
            "",
        ] {
            assert_eq!(Guard::new(&[bad.into()], false).err().as_deref(), Some(bad));
        }
    }

    #[test]
    fn a_reason_is_short_however_long_the_header() {
        let guard = Guard::new(&[], false).expect("none");
        let long = format!("https://{}.example", "a".repeat(10_000));
        for lines in [
            vec![("host", long.as_str())],
            vec![("host", "localhost"), ("origin", long.as_str())],
        ] {
            assert!(check(&guard, &lines).expect_err("refused").len() <= 300);
        }
    }

    #[test]
    fn a_run_that_is_driven_lets_its_own_page_in_and_no_other_but_those_that_are_named() {
        let guard = Guard::new(&["https://viewer.example".into()], true).expect("an origin");
        let origin = |origin: &str| check(&guard, &[("host", "127.0.0.1:8765"), ("origin", origin)]);
        for own in [
            "http://127.0.0.1:8765",
            "http://localhost:8765",
            "https://viewer.example",
        ] {
            assert_eq!(origin(own), Ok(()), "{own}");
        }
        for other in [
            "http://127.0.0.1:3000",
            "http://localhost",
            "file://",
            "https://app.foxglove.dev",
            "null",
        ] {
            assert!(
                origin(other).is_err_and(|why| why.contains("--allow-origin")),
                "{other}"
            );
        }
        assert_eq!(check(&guard, &[("host", "127.0.0.1:8765")]), Ok(()), "a program");
    }
}
