//! Packages of Debian: installed without removing any.

use std::process::Command;

use anyhow::{Result, bail};

use crate::process::{self, answer, succeeds};

/// Arguments of apt-get: it removes nothing, and fails where it would have to.
pub(crate) fn install<'a>(packages: &[&'a str]) -> Vec<&'a str> {
    let mut line = vec![
        "install",
        "--yes",
        "--quiet",
        "--no-remove",
        "--no-install-recommends",
    ];
    line.extend(packages);
    line
}

/// `apt-get install`, with the package lists fetched first: on a bare machine they are empty.
pub(crate) fn apt(packages: &[&str]) -> Result<()> {
    let by_hand = || {
        format!(
            "sudo apt-get update && sudo apt-get install --no-remove --no-install-recommends {}",
            packages.join(" ")
        )
    };
    if !succeeds(Command::new("apt-get").arg("--version")) {
        bail!(
            "this machine has no apt-get; install by its own means: {}",
            packages.join(", ")
        );
    }
    let root = answer(Command::new("id").arg("-u")).as_deref() == Some("0");
    let sudo = !root && succeeds(Command::new("sudo").args(["--non-interactive", "true"]));
    if !root && !sudo {
        bail!("this needs an administrator; type\n  {}", by_hand());
    }
    let apt_get = |arguments: &[&str]| {
        let mut command = if sudo {
            // sudo drops the environment, so the variable goes behind it.
            let mut command = Command::new("sudo");
            command.args([
                "--non-interactive",
                "DEBIAN_FRONTEND=noninteractive",
                "apt-get",
            ]);
            command
        } else {
            let mut command = Command::new("apt-get");
            command.env("DEBIAN_FRONTEND", "noninteractive");
            command
        };
        command.args(arguments);
        process::run(&mut command)
    };
    // A repository that does not answer is no reason to stop: the others may have the package.
    let _ = apt_get(&["update", "--quiet"]);
    apt_get(&install(packages)).map_err(|error| error.context(format!("by hand:\n  {}", by_hand())))
}
