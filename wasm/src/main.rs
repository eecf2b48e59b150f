//! What the module says, from a native program: `omnistep-wasm SECONDS`.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let duration_s = std::env::args().nth(1).ok_or("how many seconds?")?.parse()?;
    print!("{}", omnistep_wasm::report(duration_s)?);
    Ok(())
}
