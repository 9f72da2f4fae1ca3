//! Files made to harm, or with what is not supported (tests/frameworks/hostile.py): each is
//! refused, and the words are kept.

use std::fs;
use std::path::Path;

use sinew_nn::import;

#[test]
fn hostile_files_say_what_is_wrong() {
    let mut said = String::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frameworks/hostile");
    let entries = fs::read_dir(folder).expect("the folder is committed");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    files.sort();
    for path in files {
        let name = path
            .file_name()
            .expect("the path has a name")
            .to_string_lossy()
            .into_owned();
        let bytes = fs::read(&path).expect("the file can be read");
        let error = import::parse(&name, &bytes).expect_err(&name);
        said.push_str(&format!("{name}\n    {error}\n"));
    }
    insta::assert_snapshot!("hostile", said);
}
