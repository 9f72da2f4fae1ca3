//! Programs that a build needs are missed before anything is fitted or trained.

use crate::desk::Desk;

fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    desk.bring("rigs/mass-spring-damper.fit.csv");
    desk
}

const BUILD: &str =
    "build mass-spring-damper.toml --fit mass-spring-damper.fit.csv --out out --board";

/// Words of a build for `board` where only the programs in `path` exist.
fn refused(board: &str, path: &str, more: &[(&str, &str)]) -> String {
    let desk = desk();
    let mut command = desk.command(&format!("{BUILD} {board}"));
    command
        .env("PATH", path)
        .env_remove("SINEW_FIRMWARE_CARGO")
        .env_remove("SINEW_FIRMWARE_RUSTC")
        .env_remove("SINEW_FIRMWARE_BUILD_STD")
        .envs(more.iter().copied());
    let output = command.output().expect("the program starts");
    assert_ne!(output.status.code(), Some(0));
    assert!(
        !desk.path("out/rig.toml").exists(),
        "nothing is fitted before"
    );
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!words.contains("fit the rig"), "{words}");
    words
}

#[test]
fn cargo_is_missed_before_the_fit() {
    let words = refused("host", "/nonexistent", &[]);
    assert!(words.contains("cargo cannot be run"), "{words}");
    assert!(words.contains("install Rust"), "{words}");
}

/// A compiler that knows the target and has no library for it: `rustc` without the target.
#[test]
#[cfg(unix)]
fn the_target_is_missed_before_the_fit() {
    use std::os::unix::fs::PermissionsExt;
    let programs = Desk::new();
    let program = |name: &str, text: &str| {
        programs.write(name, &format!("#!/bin/sh\n{text}\n"));
        let path = programs.path(name);
        let all = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(&path, all).expect("the folder is this test's own");
        path
    };
    let cargo = program("cargo", "echo cargo 1.95.0");
    let rustc = program("rustc", "echo /nonexistent/lib");
    let path = cargo.parent().and_then(|folder| folder.to_str());
    let words = refused(
        "qemu",
        path.expect("the folder is there"),
        &[("SINEW_FIRMWARE_RUSTC", rustc.to_str().expect("a path"))],
    );
    assert!(words.contains("thumbv7em-none-eabihf"), "{words}");
    assert!(words.contains("rustup target add"), "{words}");
}
