//! Finds the C library, or compiles it, without other crates.
//!
//! KREISEL_DIR is a folder with `kreisel.c` and `kreisel.h` (compiled here by `cc`), or a folder
//! into which kreisel is installed. Without KREISEL_DIR, pkg-config finds an installed kreisel.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn run(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    String::from_utf8_lossy(&output.stdout).trim().to_string()
}

/// Compiles kreisel.c into a static library, and returns its folder.
fn compile(folder: &Path) -> PathBuf {
    let out = PathBuf::from(env::var("OUT_DIR").unwrap());
    let source = folder.join("kreisel.c");
    println!("cargo:rerun-if-changed={}", source.display());
    let object = out.join("kreisel.o");
    let cc = env::var("CC").unwrap_or_else(|_| "cc".into());
    run(Command::new(cc)
        .args(["-O2", "-std=c99", "-fPIC", "-ffunction-sections", "-c"])
        .arg(source)
        .arg("-o")
        .arg(&object));
    run(Command::new("ar")
        .arg("crs")
        .arg(out.join("libkreisel.a"))
        .arg(object));
    out
}

fn main() {
    println!("cargo:rerun-if-env-changed=KREISEL_DIR");
    let libraries = match env::var("KREISEL_DIR").map(PathBuf::from) {
        Ok(folder) if folder.join("kreisel.c").exists() => compile(&folder),
        Ok(folder) => folder.join("lib"),
        Err(_) => run(Command::new("pkg-config").args(["--variable=libdir", "kreisel"])).into(),
    };
    println!("cargo:rustc-link-search=native={}", libraries.display());
    println!("cargo:rustc-link-lib=static=kreisel");
    println!("cargo:rustc-link-lib=m");
}
