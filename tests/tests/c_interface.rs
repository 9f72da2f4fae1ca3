//! The control step's archive, linked into a C program on this computer: header, symbols, statuses, limits.

use std::process::Command;

use sinew_tests::{image, skip};

/// The symbols that a C library and a compiler's run time bring; the archive may ask for no other.
const RUN_TIME: [&str; 5] = ["memcpy", "memset", "memmove", "memcmp", "bcmp"];

#[test]
fn a_c_program_links_the_archive_and_drives_the_step() {
    let step = image::root().join("boards/step");
    let compiler = ["cc", "gcc", "clang"].into_iter().find(|name| {
        let answer = Command::new(name).arg("--version").output();
        answer.is_ok_and(|output| output.status.success())
    });
    let Some(compiler) = compiler else {
        return skip("no C compiler here (on Debian: apt-get install gcc)");
    };
    let host = host_triple();
    // Where the boards' images are built: their dependencies' macros are there already.
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let target = image::root().join(target).join("boards");
    let folder = tempfile::tempdir().expect("a folder for the program");
    let built = Command::new(env!("CARGO"))
        .current_dir(&step)
        .args([
            "rustc",
            "--quiet",
            "--release",
            "--locked",
            "--lib",
            "--features",
            "archive",
        ])
        .args([
            "--crate-type",
            "staticlib",
            "--target",
            &host,
            "--target-dir",
        ])
        .arg(&target)
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(
        built.status.success(),
        "the archive does not build:\n{said}"
    );
    let archive = target.join(&host).join("release/libsinew_step.a");

    let program = folder.path().join("step");
    let linked = Command::new(compiler)
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(step.join("include"))
        .arg("-o")
        .arg(&program)
        .arg(image::root().join("tests/c/step.c"))
        .arg(&archive)
        .arg("-lm")
        .output()
        .expect("the compiler starts");
    let said = String::from_utf8_lossy(&linked.stderr);
    assert!(linked.status.success(), "it does not link:\n{said}");

    let run = Command::new(&program).output().expect("the program starts");
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success() && said == "ok\n", "{said}");

    let wanted = wanted_symbols(&std::fs::read(&archive).expect("just built"));
    let odd: Vec<&String> = wanted
        .iter()
        .filter(|name| !RUN_TIME.contains(&name.as_str()))
        .collect();
    assert!(odd.is_empty(), "the archive asks for {odd:?}");
}

/// What this computer is called by its compiler.
fn host_triple() -> String {
    let answer = Command::new(option_env!("RUSTC").unwrap_or("rustc"))
        .arg("-vV")
        .output()
        .expect("rustc starts");
    let text = String::from_utf8_lossy(&answer.stdout).into_owned();
    let line = text.lines().find_map(|line| line.strip_prefix("host: "));
    line.expect("rustc says its host").to_string()
}

/// Undefined symbols of the archive's one object of our own; core's and the run time's members bring their own needs.
fn wanted_symbols(archive: &[u8]) -> Vec<String> {
    use object::read::archive::ArchiveFile;
    use object::{Object, ObjectSymbol};
    let file = ArchiveFile::parse(archive).expect("an archive");
    let mut wanted = Vec::new();
    let mut own = 0;
    for member in file.members() {
        let member = member.expect("a member");
        let name = String::from_utf8_lossy(member.name()).into_owned();
        if !name.starts_with("sinew_step") {
            continue;
        }
        own += 1;
        let object = object::File::parse(member.data(archive).expect("inside")).expect("an object");
        let undefined = object.symbols().filter(|symbol| symbol.is_undefined());
        wanted.extend(undefined.filter_map(|symbol| Some(symbol.name().ok()?.to_string())));
    }
    wanted.retain(|name| !name.is_empty());
    assert!(own > 0, "no object of ours in the archive");
    wanted
}
