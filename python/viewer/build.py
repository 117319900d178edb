#!/usr/bin/env python3
"""Builds the page, one HTML file that needs nothing else: the core as WebAssembly (zig), the scripts and libraries
(esbuild), the licences of all that is inside. Usage: build.py FOLDER_FOR_WORK PAGE"""
import html
import os
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import ziglang

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ZIG = Path(ziglang.__file__).parent


def core(wasm: Path) -> None:
    """The same operations in the same order as everywhere: nothing fused. Compressed, for it travels as text."""
    target = ["-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O2", "-ffp-contract=off", "-s"]
    exports = ["-fvisibility=hidden", "-Wl,--export-dynamic", "-Wl,--export=malloc", "-Wl,--export=free"]
    sources = sorted(str(file) for file in (ROOT / "csrc").rglob("*.c") if file.parent.name != "gsl")
    command = [sys.executable, "-m", "ziglang", "cc", *target, *exports, *sources, "-o", str(wasm)]
    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(wasm.with_name("zig")))
    subprocess.run(command, check=True, env=os.environ | caches)
    wasm.write_bytes(zlib.compress(wasm.read_bytes(), 9))


def libraries(work: Path) -> Path:
    """What package-lock.json names; nothing of it is run but esbuild."""
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copy(HERE / name, work / name)
    quiet = ["--ignore-scripts", "--no-update-notifier", "--no-audit", "--no-fund", "--loglevel=error"]
    subprocess.run(["npm", "ci", *quiet], cwd=work, check=True, stdout=subprocess.DEVNULL)
    return work / "node_modules"


def bundle(modules: Path, wasm: Path, entry: Path, *options: str) -> str:
    command = [modules / ".bin/esbuild", entry, "--bundle", "--minify", "--legal-comments=none"]
    command += ["--log-level=warning", f"--alias:kreisel.wasm={wasm}", "--loader:.wasm=binary", *options]
    paths = os.environ | {"NODE_PATH": str(modules)}
    return subprocess.run(command, check=True, capture_output=True, text=True, env=paths).stdout


def licences(modules: Path) -> str:
    parts = {
        "kreisel": ROOT / "LICENSE",
        "three.js": modules / "three/LICENSE",
        "uPlot": modules / "uplot/LICENSE",
        "wasi-libc": ZIG / "lib/libc/wasi/LICENSE-MIT",
        "musl, inside wasi-libc": ZIG / "lib/libc/musl/COPYRIGHT",
    }
    return "\n\n".join(f"== {name}\n\n{file.read_text(encoding='utf-8').strip()}" for name, file in parts.items())


def main(work: Path, page: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    wasm = (work / "kreisel.wasm").resolve()
    core(wasm)
    modules = libraries(work).resolve()
    script = bundle(modules, wasm, HERE / "main.js", "--format=esm", "--target=es2022")
    style = bundle(modules, wasm, HERE / "style.css")
    text = (HERE / "index.html").read_text(encoding="utf-8")
    notices = f'<template id="licences">\n{html.escape(licences(modules), quote=False)}\n</template>'
    text = text.replace("<style></style>", f"<style>{style}</style>")
    text = text.replace('<script type="module"></script>', f'{notices}\n<script type="module">{script}</script>')
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
