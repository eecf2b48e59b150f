//! `omnistep drive`: the page's port, the terminal's keys, what it is called with.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Program, Stdio};
use std::time::{Duration, Instant};

use super::refused;

/// A run that clients may drive; it ends with this.
struct Driven {
    run: Child,
    port: u16,
}

impl Driven {
    fn start(args: &[&str]) -> Self {
        let mut run = Program::new(env!("CARGO_BIN_EXE_omnistep"))
            .args(["drive", "--port", "0", "--json"])
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(run.stderr.take().unwrap()).lines();
        let mut lines = Vec::new();
        let port = loop {
            let line = said
                .next()
                .unwrap_or_else(|| panic!("no port: {lines:?}"))
                .unwrap();
            if let Some((_, rest)) = line.split_once("open http://127.0.0.1:") {
                break rest.split(' ').next().unwrap().parse().unwrap();
            }
            lines.push(line);
        };
        // It goes on saying things.
        std::thread::spawn(move || said.map_while(Result::ok).for_each(drop));
        Self { run, port }
    }

    /// The status, the headers and the body of what a request is answered; status 0 for none.
    fn answer(&self, request: &str) -> (u16, String, String) {
        let mut socket = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        // Who is refused early may have gone before it has read all.
        let _ = socket.write_all(request.as_bytes());
        let mut bytes = Vec::new();
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = socket.read(&mut buffer) {
            bytes.extend_from_slice(&buffer[..count]);
            // Frames follow.
            if bytes.starts_with(b"HTTP/1.1 101") {
                break;
            }
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
        (status.unwrap_or(0), head.to_ascii_lowercase(), body.into())
    }

    /// The same with usual headers and more of them.
    fn ask(&self, line: &str, more: &str) -> (u16, String, String) {
        self.answer(&format!(
            "{line} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n{more}\r\n",
            self.port
        ))
    }
}

impl Drop for Driven {
    fn drop(&mut self) {
        let _ = self.run.kill();
        let _ = self.run.wait();
    }
}

const UPGRADE: &str = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
const PROTOCOL: &str = "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n";

#[test]
fn the_port_answers_with_one_page_that_asks_for_nothing_more() {
    let run = Driven::start(&["flat"]);
    let (status, head, page) = run.ask("GET /", "");
    assert_eq!(status, 200, "{head}");
    for line in [
        "content-type: text/html; charset=utf-8",
        "cache-control: no-store",
        "x-content-type-options: nosniff",
        "x-frame-options: deny",
        "cross-origin-resource-policy: same-origin",
        "connection: close",
        &format!("content-length: {}", page.len()),
    ] {
        assert!(head.lines().any(|own| own == line), "{line}: {head}");
    }
    let policy = head
        .lines()
        .find(|line| line.starts_with("content-security-policy: "))
        .unwrap();
    assert!(
        policy.contains("default-src 'none'; script-src 'sha256-"),
        "{policy}"
    );
    assert!(!policy.contains("unsafe") && !policy.contains("http"), "{policy}");
    assert!(page.starts_with("<!doctype html>") && page.contains("foxglove.sdk.v1"));
    assert!(
        !page.contains("{css}") && !page.contains("{js}"),
        "something is left out"
    );
    for elsewhere in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!page.contains(elsewhere), "{elsewhere}");
    }
    // Without the page itself, the same; where it came from does not matter.
    let (_, with_query, _) = run.ask("GET /?x=1", "");
    assert!(with_query.starts_with("http/1.1 200"), "{with_query}");
    let (status, of_head, nothing) = run.ask("HEAD /", "");
    assert_eq!((status, nothing.as_str()), (200, ""));
    assert!(
        of_head.contains(&format!("content-length: {}", page.len())),
        "{of_head}"
    );
}

#[test]
fn what_is_not_the_page_nor_a_viewer_is_refused_in_one_line() {
    let run = Driven::start(&["flat"]);
    let lines = |status: u16, why: &str| (status, format!("{why}\n"));
    let shown = |(status, head, body): (u16, String, String)| {
        assert!(head.contains("x-content-type-options: nosniff"), "{head}");
        (status, body)
    };
    let one_page = || lines(404, "the only page is /");
    assert_eq!(shown(run.ask("GET /favicon.ico", "")), one_page());
    assert_eq!(shown(run.ask("GET /../etc/passwd", "")), one_page());
    assert_eq!(shown(run.ask("GET //", "")), one_page());
    for line in ["POST /", "PUT /", "DELETE /x", "OPTIONS /"] {
        let (status, head, body) = run.ask(line, "Content-Length: 0\r\n");
        assert!(head.contains("\r\nallow: get, head"), "{head}");
        assert_eq!((status, body), lines(405, "allowed: GET and HEAD"), "{line}");
    }
    // A name that a page of elsewhere made resolve to this machine, and pages of elsewhere.
    let host = |host: &str| shown(run.answer(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n")));
    assert_eq!(
        host("evil.example"),
        lines(403, "Host evil.example, allowed: localhost, 127.0.0.1 or [::1]")
    );
    assert_eq!(host("localhost").0, 200);
    assert_eq!(
        shown(run.answer("GET / HTTP/1.0\r\n\r\n")),
        lines(403, "no Host, allowed: localhost, 127.0.0.1 or [::1]")
    );
    let evil = "Origin: https://evil.example\r\n";
    let foreign = || {
        lines(
            403,
            "a page from https://evil.example: allow it with --allow-origin https://evil.example",
        )
    };
    assert_eq!(shown(run.ask("GET /", evil)), foreign());
    assert_eq!(
        shown(run.ask("GET /", &[UPGRADE, PROTOCOL, evil].concat())),
        foreign()
    );
    // Its own page is a viewer, as programs are.
    for own in [
        String::new(),
        format!("Origin: http://127.0.0.1:{}\r\n", run.port),
        format!("Origin: http://localhost:{}\r\n", run.port),
    ] {
        let (status, head, _) = run.ask("GET /", &[UPGRADE, PROTOCOL, &own].concat());
        assert_eq!(status, 101, "{own}: {head}");
        // RFC 6455's own example of a key and its answer.
        assert!(
            head.contains("sec-websocket-accept: s3pplmbitxaq9kygzzhzrbk+xoo="),
            "{head}"
        );
        assert!(head.contains("sec-websocket-protocol: foxglove.sdk.v1"), "{head}");
    }
    // Who does not ask as it should.
    let (status, body) = shown(run.ask("GET /", UPGRADE));
    assert_eq!(
        (status, body),
        lines(400, "no known Sec-WebSocket-Protocol, allowed: foxglove.sdk.v1")
    );
    for wrong in [
        UPGRADE.replace("13", "12"),
        UPGRADE.replace("dGhl", "d"),
        UPGRADE.replace("websocket", "h2c"),
    ] {
        assert_eq!(run.ask("GET /", &(wrong + PROTOCOL)).0, 400);
    }
    assert_eq!(run.ask("POST /", &[UPGRADE, PROTOCOL].concat()).0, 400);
    // What is too large, or not HTTP.
    assert_eq!(
        run.ask("GET /", &format!("X: {}\r\n", "a".repeat(100_000))).0,
        431
    );
    assert_eq!(run.ask("GET /", &"X: a\r\n".repeat(1000)).0, 431);
    assert_eq!(run.answer("\0\u{1}\u{2}\r\n\r\n").0, 400);
    assert_eq!(run.ask("GET /", "").0, 200, "it still serves");
}

#[test]
fn one_request_a_connection_and_then_it_is_closed() {
    let run = Driven::start(&["flat"]);
    let twice = format!("GET /a HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", run.port).repeat(2);
    let (status, _, body) = run.answer(&twice);
    assert_eq!((status, body.as_str()), (404, "the only page is /\n"));
}

#[test]
fn ctrl_c_ends_a_drive_with_a_row_also_without_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let said = folder.path().join("said");
    let mut run = Program::new(env!("CARGO_BIN_EXE_omnistep"))
        .args(["drive", "omni3", "--port", "0"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(fs::File::create(&said).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !fs::read_to_string(&said)
        .unwrap()
        .contains("keys are off: this is not a terminal\n")
    {
        assert!(run.try_wait().unwrap().is_none() && begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(3));
    }
    let killed = Program::new("kill")
        .args(["-INT", &run.id().to_string()])
        .status();
    assert!(killed.unwrap().success());
    let output = run.wait_with_output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(0),
        "it has no end of its own: nothing was cut short"
    );
    let row = String::from_utf8(output.stdout).unwrap();
    let shown =
        "omni3 on flat ground, friction 0.7, driven by hand, torque limit 1 N.m, engine articulated\n";
    assert!(row.starts_with(shown), "{row}");
}

#[test]
fn drive_takes_vehicles_and_scenarios_only() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = |args: &[&str]| refused(folder.path(), &[&["drive", "--port", "0"], args].concat());
    for (name, meant) in [("chugo8", "chugo7"), ("bumbs", "bumps")] {
        let unknown = wrong(&[name]);
        assert!(
            unknown.contains(&format!("{name:?} (did you mean {meant:?}?), allowed: ")),
            "{unknown}"
        );
    }
    assert!(wrong(&["climb_map"]).contains("omnistep study climb_map"));
    assert!(wrong(&["flat", "--policy", "papier"]).contains("papier"));
    assert!(
        wrong(&["flat", "--set", "terrain.friction=-1"]).contains("terrain.friction: -1, allowed: 0 to 2")
    );
    assert!(wrong(&["flat", "--real-time-factor", "0"]).contains("--real-time-factor"));
    assert!(wrong(&["flat", "--allow-origin", "evil"]).contains("--allow-origin"));
}

/// Report and page are of the same colours: a crate and a Python package cannot share a file.
#[test]
fn the_page_looks_like_a_report() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let colours = |file: PathBuf| {
        let text = fs::read_to_string(root.join(file)).unwrap();
        let lines: Vec<_> = text.lines().take(2).map(String::from).collect();
        assert!(lines.iter().all(|line| line.contains("--ink: #")), "{lines:?}");
        lines
    };
    assert_eq!(
        colours("crates/omni-log/src/live/page/page.css".into()),
        colours("python/omnistep/assets/report.css".into())
    );
}

/// A terminal of its own, by util-linux's `script`: what is typed goes in, what is shown comes out.
#[test]
#[cfg(target_os = "linux")]
fn the_up_arrow_drives_and_ctrl_c_restores_the_terminal() {
    let (up, ctrl_c, escape) = ("\x1b[A", "\x03", "\x1b");
    for end in [ctrl_c, escape] {
        let folder = tempfile::tempdir().unwrap();
        let row = folder.path().join("row");
        let program = env!("CARGO_BIN_EXE_omnistep");
        let inside = format!(
            "stty -g; {program} drive flat --port 0 --json >{}; echo code $?; stty -g",
            row.display()
        );
        let mut terminal = Program::new("script")
            .args(["--quiet", "--return", "--command", &inside, "/dev/null"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut keys = terminal.stdin.take().unwrap();
        let (mut shown, mut screen) = (String::new(), terminal.stdout.take().unwrap());
        let mut until = |what: &str, keys: &mut dyn FnMut()| {
            let mut buffer = [0; 4096];
            while !shown.contains(what) {
                keys();
                let count = screen.read(&mut buffer).unwrap();
                assert!(count > 0, "ended before {what:?}: {shown}");
                shown.push_str(&String::from_utf8_lossy(&buffer[..count]));
            }
            shown.clone()
        };
        // A status line comes ten times a second, fewer on a busy machine. It stands until a key
        // comes; one that is held repeats itself.
        until("ahead +0.00", &mut || {});
        until("ahead +0.3", &mut || keys.write_all(up.as_bytes()).unwrap());
        keys.write_all(end.as_bytes()).unwrap();
        let shown = until("code 0", &mut || {});
        drop(keys);
        let mut rest = String::new();
        screen.read_to_string(&mut rest).unwrap();
        assert!(terminal.wait().unwrap().success());
        let settings = |line: &&str| line.matches(':').count() > 10 && !line.contains(' ');
        let all = shown + &rest;
        let shown: Vec<_> = all.lines().map(str::trim).filter(settings).collect();
        assert_eq!(shown.len(), 2, "{all}");
        assert_eq!(shown[0], shown[1], "the terminal is not as it was");
        let outcome: serde_json::Value = serde_json::from_str(&fs::read_to_string(row).unwrap()).unwrap();
        assert!(outcome["final_x_m"].as_f64().unwrap() > 1e-3, "{outcome}");
    }
}
