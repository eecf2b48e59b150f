//! What a path is relative to: one in a file to that file's folder, one of `--set` to the current folder.

use std::fs;
use std::path::Path;

use super::{omnistep, refused, stdout};

const TERRAIN: &str = "[terrain]\nkind = \"height_map\"\nfriction = 0.7\nimage = \"hill.png\"\npixel_m = 0.1\nwhite_height_m = 0.01\nstart_x_m = 1.0\n";

/// `scenarios/cable.toml` with the vehicle `bot.toml`, the picture `hill.png` and the table `table.csv`
/// beside it; the same three in `own`, another vehicle and other bytes. The folder itself has none of them.
fn folders() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../omni-config/assets");
    for (place, vehicle, speed) in [("scenarios", "omni3", 0.1), ("own", "mecanum4", 0.2)] {
        let place = path.join(place);
        fs::create_dir(&place).unwrap();
        fs::copy(
            assets.join(format!("vehicles/{vehicle}.toml")),
            place.join("bot.toml"),
        )
        .unwrap();
        fs::copy(assets.join("pictures/hills.png"), place.join("hill.png")).unwrap();
        fs::write(
            place.join("table.csv"),
            format!("time_s,vx_m_s,vy_m_s,wz_rad_s\n0,{speed},0,0\n"),
        )
        .unwrap();
    }
    let cable = format!(
        "schema_version = 1\nname = \"cable\"\nvehicle = \"bot.toml\"\nduration_s = 0.02\n{TERRAIN}\
         [command]\nfile = \"table.csv\"\n[physics]\nengine = \"articulated\"\n"
    );
    fs::write(path.join("scenarios/cable.toml"), cable).unwrap();
    folder
}

#[test]
fn paths_of_set_are_relative_to_the_current_folder() {
    let folder = folders();
    let headline = |sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let args: Vec<_> = ["run", "scenarios/cable.toml", "--quiet"]
            .into_iter()
            .chain(sets)
            .collect();
        let output = omnistep(folder.path(), &args);
        assert!(
            output.status.success(),
            "{args:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        stdout(&output).lines().next().unwrap_or_default().to_owned()
    };
    assert!(headline(&[]).starts_with("omni3 "), "{}", headline(&[]));
    let own = headline(&["vehicle=own/bot.toml"]);
    assert!(own.starts_with("mecanum4 "), "{own}");
    headline(&["terrain.image=own/hill.png", "command.file=own/table.csv"]);
    headline(&["terrain.image=hills"]);
    // A table around the path is no other case.
    let file = "command={ file = \"own/table.csv\" }";
    headline(&[file]);
    // What is beside the file only is not here.
    for set in [
        "vehicle=bot.toml",
        "terrain.image=hill.png",
        "command.file=table.csv",
    ] {
        let said = refused(
            folder.path(),
            &["run", "scenarios/cable.toml", "--quiet", "--set", set],
        );
        let (key, name) = set.split_once('=').unwrap();
        assert!(said.contains(key) && said.contains(name), "{said}");
        assert!(
            said.contains("No such file") || said.contains("cannot find"),
            "{said}"
        );
        assert!(!said.contains("scenarios/bot"), "{said}");
    }
}

#[test]
fn a_path_of_a_study_is_relative_to_the_study() {
    let folder = folders();
    fs::write(
        folder.path().join("own/small.toml"),
        "schema_version = 1\nname = \"small\"\nscenario = \"../scenarios/cable.toml\"\nseeds = 1\n\
         [set]\n\"terrain.image\" = \"hill.png\"\n\
         [[axis]]\nkey = \"command\"\nvalues = [{ file = \"table.csv\" }, { vx_m_s = 0.1 }]\n\
         [[axis]]\nkey = \"vehicle\"\nvalues = [\"bot.toml\", \"omni3\"]\n",
    )
    .unwrap();
    // What the study names is in its folder alone.
    for name in ["hill.png", "table.csv"] {
        fs::remove_file(folder.path().join("scenarios").join(name)).unwrap();
    }
    let output = omnistep(folder.path(), &["check", "own/small.toml"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
