//! The bytes of a file as text, or an error that says what they are.

/// The text; else what the bytes are and what to do about it, for a message behind the file's name.
pub(crate) fn text(bytes: Vec<u8>, file: &str) -> Result<String, String> {
    let resave = "save it as UTF-8, in most editors under \"Save with encoding\"";
    let starts = |start: &[u8]| bytes.starts_with(start);
    if starts(b"\x89MCAP") {
        return Err(format!(
            "this is an MCAP log, not TOML; use: omnistep info {file}"
        ));
    }
    if starts(b"\x89PNG") {
        return Err("this is a PNG image, not TOML; set a scenario's terrain.image to its path".into());
    }
    if starts(b"\xff\xfe") || starts(b"\xfe\xff") || looks_like_utf_16(&bytes) {
        return Err(format!("this is text in UTF-16, allowed: UTF-8: {resave}"));
    }
    let bytes = match String::from_utf8(bytes) {
        Ok(text) => return Ok(text),
        Err(error) => error,
    };
    let valid = bytes.utf8_error().valid_up_to();
    let bytes = bytes.into_bytes();
    let line = 1 + bytes[..valid].iter().filter(|byte| **byte == b'\n').count();
    // Control characters are in no text; NUL is in most that is none.
    let binary = bytes
        .iter()
        .any(|byte| *byte < 0x20 && !b"\t\n\r\x0c".contains(byte));
    Err(if binary {
        "this is not text, allowed: TOML in UTF-8".into()
    } else {
        let byte = bytes[valid];
        format!(
            "line {line} has the byte 0x{byte:02x}, in Latin-1 {:?}: this is text in another encoding, such as Latin-1 or Windows-1252, allowed: UTF-8: {resave}",
            char::from(byte)
        )
    })
}

/// Every second byte of what is plain text in UTF-16 is zero, even without a mark at the start.
fn looks_like_utf_16(bytes: &[u8]) -> bool {
    let pairs = bytes.chunks_exact(2).take(64);
    let count = pairs.len();
    let zero = |k: usize| {
        bytes
            .chunks_exact(2)
            .take(64)
            .filter(|pair| pair[k] == 0 && pair[1 - k] != 0)
            .count()
    };
    count >= 4 && (zero(0) == count || zero(1) == count)
}

#[cfg(test)]
mod tests {
    use super::text;

    fn refused(bytes: &[u8]) -> String {
        text(bytes.to_vec(), "x.toml").expect_err("no UTF-8")
    }

    #[test]
    fn what_is_no_utf_8_is_named() {
        let utf_16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
        let big = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<_>>();
        for bytes in [
            [b"\xff\xfe".to_vec(), utf_16("name = \"x\"")].concat(),
            utf_16("name = \"x\""),
            big("name = \"x\""),
        ] {
            assert!(refused(&bytes).starts_with("this is text in UTF-16, allowed: UTF-8"));
        }
        let latin = refused(b"name = \"x\"\n# gr\xfcn");
        assert!(
            latin.starts_with("line 2 has the byte 0xfc, in Latin-1 'ü'"),
            "{latin}"
        );
        assert!(refused(b"\x00\x01\xff\xfe\x00").starts_with("this is not text"));
        assert_eq!(
            refused(b"\x89MCAP0\r\n"),
            "this is an MCAP log, not TOML; use: omnistep info x.toml"
        );
        assert_eq!(
            text(b"name = \"gr\xc3\xbcn\"".to_vec(), "x.toml").as_deref(),
            Ok("name = \"grün\"")
        );
    }
}
