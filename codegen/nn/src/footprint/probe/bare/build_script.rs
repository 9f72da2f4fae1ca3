//! Keeps what `_start` calls, and nothing else.

fn main() {
    for option in ["--gc-sections", "-e_start"] {
        println!("cargo:rustc-link-arg-bins={option}");
    }
}
