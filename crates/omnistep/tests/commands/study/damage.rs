//! Parts whose bytes are not those that were written.

use omni_study::damage;

use super::*;

/// A part of four rows and its bytes, in a folder with another part of two.
fn with_a_part(plan: &Plan, folder: &Path) -> (Store, PathBuf, Vec<u8>) {
    let store = Store::new(folder, plan).unwrap();
    let going = AtomicBool::new(false);
    store.write(&rows(&plan.runs()[4..6], &going)).unwrap();
    let path = store.write(&rows(&plan.runs()[..4], &going)).unwrap().unwrap();
    let bytes = fs::read(&path).unwrap();
    (store, path, bytes)
}

#[test]
fn a_flipped_bit_in_a_part_makes_its_runs_missing_again() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let (store, path, whole) = with_a_part(&plan, folder.path());
    assert_eq!(damage(&path).unwrap(), None);
    // Some hundred places, every byte of the beginning with the checksum, and of the end.
    let places = (0..whole.len()).step_by(whole.len() / 400 + 1);
    let mut places: BTreeSet<usize> = places
        .chain(0..100)
        .chain(whole.len() - 20..whole.len())
        .collect();
    places.insert(whole.len() / 2);
    assert!(places.len() > 300);
    for at in places {
        let mut bad = whole.clone();
        bad[at] ^= 1 << (at % 8);
        fs::write(&path, &bad).unwrap();
        let place = format!("byte {at} of {}", whole.len());
        // Of what is no Parquet any more this says nothing: its reader will.
        let no_parquet = at < 4 && damage(&path).unwrap().is_none();
        assert!(damage(&path).unwrap().is_some() || no_parquet, "{place}");
        let found = store.read().unwrap();
        assert_eq!(found.damaged.len(), 1, "{place}");
        assert_eq!(found.damaged[0].0, path, "{place}");
        assert_eq!((found.rows.len(), plan.missing(&found).len()), (2, 22), "{place}");
    }
    // Every bit of one byte of the checksum's name, its digits and a column.
    for at in [6, 40, 200] {
        for bit in 0..8 {
            let mut bad = whole.clone();
            bad[at] ^= 1 << bit;
            fs::write(&path, &bad).unwrap();
            assert_eq!(store.read().unwrap().damaged.len(), 1, "byte {at}, bit {bit}");
        }
    }
    fs::write(&path, &whole).unwrap();
    assert_eq!(store.read().unwrap().rows.len(), 6);
}

#[test]
fn the_same_rows_are_the_same_bytes_with_a_standard_checksum() {
    use sha2::{Digest, Sha256};
    let plan = plan_of(SMALL);
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (_, path, bytes) = with_a_part(&plan, one.path());
    let (_, same, again) = with_a_part(&plan, two.path());
    assert_eq!((path.file_name(), &bytes), (same.file_name(), &again));
    // As `tail -c +86 PART | sha256sum` shows it.
    let line = String::from_utf8(bytes[4..85].to_vec()).unwrap();
    let digest: String = Sha256::digest(&bytes[85..])
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    assert_eq!(line, format!("omnistep sha256 {digest}\n"));
}

#[test]
fn a_study_sets_a_part_with_a_flipped_bit_aside() {
    let folder = tempfile::tempdir().unwrap();
    let study = ["study", "small.toml", "--json"];
    let first = omnistep(folder.path(), SMALL, &study);
    assert!(first.status.success(), "{first:?}");
    let part = parts(&folder.path().join("out/small")).remove(0);
    let whole = fs::read(&part).unwrap();
    let mut bad = whole.clone();
    bad[whole.len() / 2] ^= 0x10;
    fs::write(&part, &bad).unwrap();
    let again = omnistep(folder.path(), SMALL, &[&study[..], &["--quiet"]].concat());
    let said = String::from_utf8(again.stderr).unwrap();
    let name = part.file_name().unwrap().to_str().unwrap();
    assert_eq!(
        said,
        format!(
            "out/small/{name}: cannot be read (its SHA-256 checksum is wrong); renamed to .damaged, its runs are repeated\n"
        )
    );
    assert_eq!(again.stdout, first.stdout);
    assert_eq!(
        fs::read(part.with_extension("parquet.damaged")).unwrap(),
        bad,
        "nothing is lost"
    );
}

#[test]
fn a_part_without_a_checksum_is_set_aside_with_the_reason() {
    let plan = plan_of(SMALL);
    let folder = tempfile::tempdir().unwrap();
    let (store, path, mut bytes) = with_a_part(&plan, folder.path());
    bytes[4..85].fill(0);
    fs::write(&path, &bytes).unwrap();
    let expected = "no checksum: damaged, or written by an earlier build";
    assert_eq!(damage(&path).unwrap(), Some(expected));
    let found = store.read().unwrap();
    assert_eq!(found.damaged, [(path, expected.to_owned())]);
    assert_eq!(found.rows.len(), 2);
}

#[test]
fn a_foreign_file_is_not_reported_as_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part-other.parquet");
    fs::write(&path, "no Parquet").unwrap();
    assert_eq!(damage(&path).unwrap(), None);
    assert!(
        damage(&folder.path().join("gone"))
            .unwrap_err()
            .to_string()
            .contains("gone")
    );
}
