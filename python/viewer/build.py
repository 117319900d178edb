#!/usr/bin/env python3
"""Builds the page, one HTML file that needs nothing else.

Inside are the core as WebAssembly (by zig), the scripts and libraries (by esbuild), and the
licences of all that. Usage: build.py FOLDER_FOR_WORK PAGE
"""

import base64
import hashlib
import html
import os
import re
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import ziglang

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ZIG = Path(ziglang.__file__).parent


# The page's materials have use for these of three.js's shaders. The others are for textures,
# shadows, environments and skins.
SHADERS = re.compile(
    "meshbasic|meshphong|begin|bsdfs|color|common|default|fog"
    "|lights_(fragment_(begin|end)|pars|phong)|normal_(fragment_begin|pars|vertex)"
    "|opaque|project_|specularmap_fragment|worldpos"
)

# What three.js's renderer makes at its start, or could, and the page has no use for, beside what is
# left of it: shadow maps (floor.js has shadows of its own), glasses, environments with the table by
# which metals reflect them, and effects behind the picture.
UNUSED = {
    "renderers/shaders/DFGLUTData.js": "export const getDFGLUT = () => null;",
    "renderers/webgl/WebGLShadowMap.js": "export class WebGLShadowMap { render() {} }",
    "renderers/webgl/WebGLOutput.js": "export class WebGLOutput {}",
    "renderers/webxr/WebXRManager.js": "export class WebXRManager {"
    "enabled = false; addEventListener() {} removeEventListener() {} setAnimationLoop() {} "
    "dispose() {} "
    "getEnvironmentBlendMode() {}}",
    "extras/PMREMGenerator.js": "export class PMREMGenerator {}",
}

LEFT_OUT = re.compile(r"kernel_(dd|tangents|bundles|kowalewski)|kowalewski\.c")


def core(wasm: Path) -> None:
    """Compile what core.js calls, compressed, for it travels as text.

    The operations and their order are those of every other build: nothing is fused. Small goes
    before fast. The kernels for 20 and 30 digits and for tangents, alone and in bundles, and the
    closed form of Kowalewski tops are left out, as wasm.c explains.
    """
    target = [
        "-target",
        "wasm32-wasi",
        "-mexec-model=reactor",
        "-msimd128",
        "-flto",
        "-std=c99",
        "-ffp-contract=off",
        "-s",
    ]
    small = ["-Os", "-Xclang", "-Oz", "-fno-vectorize", "-fno-slp-vectorize", "-fvisibility=hidden"]
    calls = sorted(
        set(re.findall(r"\bC\.([a-z]\w+)", (HERE / "core.js").read_text(encoding="utf-8")))
        - {"memory"}
    )
    exports = [f"-Wl,--export={name}" for name in calls]
    files = (
        file
        for file in (ROOT / "csrc").rglob("*.c")
        if file.parent.name not in ("gsl", "ensemble") and not LEFT_OUT.match(file.name)
    )
    compile = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        *target,
        *small,
        *exports,
        f"-I{ROOT / 'csrc'}",
    ]
    command = [*compile, *sorted(map(str, files))]
    caches = dict.fromkeys(
        ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(wasm.with_name("zig"))
    )
    subprocess.run([*command, "-o", str(wasm)], check=True, env=caches | os.environ)
    wasm.write_bytes(zlib.compress(wasm.read_bytes(), 9))


def libraries(work: Path) -> Path:
    """Fetch what package-lock.json names, without what of three.js nothing here uses.

    Nothing of it is run but esbuild.
    """
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copy(HERE / name, work / name)
    quiet = [
        "--ignore-scripts",
        "--no-update-notifier",
        "--no-audit",
        "--no-fund",
        "--loglevel=error",
    ]
    subprocess.run(["npm", "ci", *quiet], cwd=work, check=True, stdout=subprocess.DEVNULL)
    shaders = work / "node_modules/three/src/renderers/shaders"
    for file in shaders.glob("*/*.glsl.js"):
        if not SHADERS.match(file.name):
            file.write_text(
                'export default ""; export const vertex = "", fragment = "";', encoding="utf-8"
            )
    for name, text in UNUSED.items():
        (work / "node_modules/three/src" / name).write_text(text, encoding="utf-8")
    return work / "node_modules"


def bundle(modules: Path, wasm: Path, entry: Path, *options: str) -> str:
    command = [modules / ".bin/esbuild", entry, "--bundle", "--minify", "--legal-comments=none"]
    command += ["--alias:three/addons=three/examples/jsm", "--alias:three=three/src/Three.js"]
    command += [
        "--log-level=warning",
        f"--alias:kreisel.wasm={wasm}",
        "--loader:.wasm=binary",
        *options,
    ]
    paths = os.environ | {"NODE_PATH": str(modules)}
    return subprocess.run(command, check=True, capture_output=True, text=True, env=paths).stdout


def licences(modules: Path) -> str:
    parts = {
        "kreisel": ROOT / "LICENSE",
        "three.js": modules / "three/LICENSE",
        "uPlot": modules / "uplot/LICENSE",
        "lit-html": modules / "lit-html/LICENSE",
        "wasi-libc": ZIG / "lib/libc/wasi/LICENSE-MIT",
        "musl, inside wasi-libc": ZIG / "lib/libc/musl/COPYRIGHT",
        "Zig, functions of its own beside them": ZIG / "LICENSE",
    }
    return "\n\n".join(
        f"== {name}\n\n{file.read_text(encoding='utf-8').strip()}" for name, file in parts.items()
    )


def policy(script: str, style: str) -> str:
    """Return the content security policy of the page.

    It allows this script, the core, this style and pictures of the page's own. It allows no network
    access, whatever a scene's file or link contains.
    """

    def only(text: str) -> str:
        digest = hashlib.sha256(text.encode()).digest()
        return f"'sha256-{base64.b64encode(digest).decode()}'"

    return "; ".join(
        [
            "default-src 'none'",
            f"script-src {only(script)} 'wasm-unsafe-eval'",
            f"style-src-elem {only(style)}",
            "style-src-attr 'unsafe-inline'",  # the colours of the panel's rows
            "img-src data: blob:",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


def main(work: Path, page: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    wasm = (work / "kreisel.wasm").resolve()
    core(wasm)
    modules = libraries(work).resolve()
    script = bundle(modules, wasm, HERE / "main.js", "--format=esm", "--target=es2022")
    style = bundle(modules, wasm, HERE / "page.css")
    text = (HERE / "index.html").read_text(encoding="utf-8")
    notices = (
        f'<template id="licences">\n{html.escape(licences(modules), quote=False)}\n</template>'
    )
    text = text.replace('Policy" content=""', f'Policy" content="{policy(script, style)}"')
    text = text.replace("<style></style>", f"<style>{style}</style>")
    text = text.replace(
        '<script type="module"></script>', f'{notices}\n<script type="module">{script}</script>'
    )
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
