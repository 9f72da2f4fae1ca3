//! A version of an operator of TensorFlow Lite that is newer than what was looked at is refused by
//! its number.

use std::fs;
use std::path::Path;

use sinew_nn::import;

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
}

/// Offset of field `id` of the table at `table`; none where the file leaves it out.
fn field(bytes: &[u8], table: usize, id: usize) -> Option<usize> {
    // The offset to the list of fields has a sign.
    let back = word(bytes, table) as u32 as i32;
    let slots = (table as i64 - i64::from(back)) as usize;
    let end = slots + usize::from(u16::from_le_bytes([bytes[slots], bytes[slots + 1]]));
    let slot = slots + 4 + 2 * id;
    let offset = u16::from_le_bytes([bytes[slot], bytes[slot + 1]]);
    (slot < end && offset > 0).then(|| table + usize::from(offset))
}

/// Offsets of the versions of the operators' codes, where the file states them.
fn versions(bytes: &[u8]) -> Vec<usize> {
    let at = field(bytes, word(bytes, 0), 1).expect("the file has operators");
    let vector = at + word(bytes, at);
    let codes = (0..word(bytes, vector)).map(|i| vector + 4 + 4 * i);
    codes
        .filter_map(|slot| field(bytes, slot + word(bytes, slot), 2))
        .collect()
}

#[test]
fn a_newer_version_of_an_operator_is_refused_by_its_number() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frameworks/models");
    let mut tried = 0;
    for name in [
        "tflite-products.tflite",
        "tflite-int8.tflite",
        "tflite-conv2d.tflite",
    ] {
        let sound = fs::read(folder.join(name)).expect("the file is committed");
        import::parse(name, &sound).expect("the file itself is read");
        for at in versions(&sound) {
            for version in [99_i32, 0, -1] {
                let mut bytes = sound.clone();
                bytes[at..at + 4].copy_from_slice(&version.to_le_bytes());
                let error = import::parse(name, &bytes).expect_err("no such version");
                let said = error.to_string();
                assert!(said.contains(&format!("version {version} of ")), "{said}");
                assert!(said.contains("versions 1 to "), "{said}");
                tried += 1;
            }
        }
    }
    assert!(tried >= 6, "{tried} versions are stated in these files");
}
