#!/usr/bin/env python3
"""Build the interactive viewer as one HTML file without external resources.

The file contains the core as WebAssembly (compiled by zig), the scripts and libraries (bundled by
esbuild), and all licences.

    build.py WORK_FOLDER PAGE
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

# Shaders of three.js that the materials of the viewer include. All others are emptied.
USED_SHADERS = re.compile(
    "meshbasic|meshphong|begin|bsdfs|color|common|default|fog"
    "|lights_(fragment_(begin|end)|pars|phong)|normal_(fragment_begin|pars|vertex)"
    "|opaque|project_|specularmap_fragment|worldpos"
)

# Methods of classes of three.js that write or read its files, which the viewer does not do.
FILE_METHODS = re.compile(r"\n\t(?:static )?(?:toJSON|fromJSON)\([^\n]*\{\n[\s\S]*?\n\t\}(?=\n)")

# Names of features that no material of the viewer has: other lights and materials, textures, skins,
# instances, clipping planes.
UNUSED_FEATURES = re.compile(
    r"NUM_(POINT|SPOT|RECT_AREA)_\w+|\w*CLIPPING\w*|STANDARD|DITHERING|FLAT_SHADED"
    r"|USE_(\w*MAP\w*|SKINNING|MORPH\w*|BATCHING\w*|INSTANCING\w*|ALPHA\w*|TANGENT|SHEEN"
    r"|TRANSMISSION|LIGHT_PROBE\w*|CLEARCOAT|IRIDESCENCE|ANISOTROPY|RETROREFLECTION)"
)

# Modules of three.js that the renderer imports although the viewer does not need them: textures,
# shadow maps (floor.js draws its own shadows), environment maps, morphing, post-processing, WebXR.
REPLACED_MODULES = {
    "renderers/webgl/WebGLEnvironments.js": "export class WebGLEnvironments { "
    "get() { return null; } dispose() {} }",
    "renderers/webgl/WebGLMorphtargets.js": "export class WebGLMorphtargets {}",
    "renderers/webgl/WebGLTextures.js": "export class WebGLTextures { "
    "getTextureUnits() {} setTextureUnits() {} resetTextureUnits() {} }",
    "renderers/webgl/WebGLUniformsGroups.js": "export class WebGLUniformsGroups { dispose() {} }",
    "renderers/webgl/WebGLUtils.js": "export class WebGLUtils {}",
    "renderers/shaders/DFGLUTData.js": "export const getDFGLUT = () => null;",
    "renderers/webgl/WebGLShadowMap.js": "export class WebGLShadowMap { render() {} }",
    "renderers/webgl/WebGLOutput.js": "export class WebGLOutput {}",
    "renderers/webxr/WebXRManager.js": "export class WebXRManager {"
    "enabled = false; addEventListener() {} removeEventListener() {} setAnimationLoop() {} "
    "dispose() {} "
    "getEnvironmentBlendMode() {}}",
    "extras/PMREMGenerator.js": "export class PMREMGenerator {}",
}

# Kernels and closed forms that the viewer does not use.
SKIPPED_SOURCES = re.compile(
    r"kernel_(dd|tangent|kowalewski|goryachev_chaplygin)|tangents\.c"
    r"|(kowalewski|goryachev_chaplygin|torus)\.c"
)

TARGET = (
    "-target wasm32-wasi -mexec-model=reactor -msimd128 -flto -std=c99 -ffp-contract=off -s"
    " -DKR_NO_DIGITS -DKR_NO_TANGENTS -DKR_NO_TORUS"
)
SMALL = "-Os -Xclang -Oz -fno-vectorize -fno-slp-vectorize -fvisibility=hidden"


def compile_core(wasm: Path) -> None:
    """Compile the functions that core.js calls into the compressed file `wasm`.

    Floating-point operations are not fused, so the results of methods with the flag `algebraic` are
    bitwise equal to those of other builds. Size takes precedence over speed.
    """
    calls = sorted(
        set(re.findall(r"\bC\.([a-z]\w+)", (HERE / "core.js").read_text(encoding="utf-8")))
        - {"memory"}
    )
    exports = [f"-Wl,--export={name}" for name in calls]
    files = (
        file
        for file in (ROOT / "csrc").rglob("*.c")
        if file.parent.name not in ("gsl", "ensemble") and not SKIPPED_SOURCES.match(file.name)
    )
    compiler = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        *TARGET.split(),
        *SMALL.split(),
        *exports,
        f"-I{ROOT / 'csrc'}",
    ]
    command = [*compiler, *sorted(map(str, files))]
    # zig's global cache, which is the user's, keeps the C library, whose compilation takes longest.
    cache = {"ZIG_LOCAL_CACHE_DIR": str(wasm.with_name("zig"))}
    subprocess.run([*command, "-o", str(wasm)], check=True, env=cache | os.environ)
    wasm.write_bytes(zlib.compress(wasm.read_bytes(), 9))


def install_libraries(work: Path) -> Path:
    """Install the packages of package-lock.json and return their folder.

    Shaders of three.js are shortened, and its unused modules and methods left out. No scripts of
    packages run.
    """
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copy(HERE / name, work / name)
    options = [
        "--ignore-scripts",
        "--no-update-notifier",
        "--no-audit",
        "--no-fund",
        "--loglevel=error",
    ]
    subprocess.run(["npm", "ci", *options], cwd=work, check=True, stdout=subprocess.DEVNULL)
    shaders = work / "node_modules/three/src/renderers/shaders"
    for file in shaders.glob("*/*.glsl.js"):
        if not USED_SHADERS.match(file.name):
            text = 'export default ""; export const vertex = "", fragment = "";'
        else:
            text = shorten_shader(file.read_text(encoding="utf-8"))
        file.write_text(text, encoding="utf-8")
    for file in (work / "node_modules/three/src").rglob("*.js"):
        text = file.read_text(encoding="utf-8")
        if FILE_METHODS.search(text):
            file.write_text(FILE_METHODS.sub("", text), encoding="utf-8")
    for name, text in REPLACED_MODULES.items():
        (work / "node_modules/three/src" / name).write_text(text, encoding="utf-8")
    return work / "node_modules"


def is_unused(condition: str) -> bool:
    """Return True if a line of the preprocessor begins a block that no material compiles."""
    names = re.findall(r"\b[A-Z]\w{3,}", condition)
    test = all if "||" in condition else any
    return (
        re.match(r"#if(def)? ", condition) is not None
        and "!" not in condition
        and bool(names)
        and test(UNUSED_FEATURES.fullmatch(name) for name in names)
    )


def find_end(lines: list[str], first: int) -> int:
    """Return the line of the `#else`, `#elif` or `#endif` that belongs to the `#if` at `first`."""
    depth = 0
    for index in range(first + 1, len(lines)):
        if depth == 0 and lines[index].startswith(("#el", "#endif")):
            return index
        depth += lines[index].startswith("#if") - lines[index].startswith("#endif")
    return first


def shorten_shader(source: str) -> str:
    """Return a shader without comments, indentation, and blocks for features not used."""
    bare = re.sub(r"//.*|/\*[\s\S]*?\*/", "", source)
    lines = [line.strip() for line in bare.splitlines() if line.strip()]
    output, index = [], 0
    while index < len(lines):
        end = find_end(lines, index) if is_unused(lines[index]) else index
        if lines[end] == "#endif" and end > index:
            index = end + 1
            continue
        output.append(lines[index])
        index += 1
    return "\n".join(output)


def bundle(modules: Path, wasm: Path, entry: Path, *options: str) -> str:
    """Return the minified bundle of `entry` and its imports."""
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


def collect_licences(modules: Path) -> str:
    """Return the licences of kreisel and of all bundled libraries."""
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


def make_security_policy(script: str, style: str) -> str:
    """Return the Content Security Policy of the viewer.

    It allows this script, this style, WebAssembly, and generated pictures. It forbids all requests,
    whatever the file or link of a scene contains.
    """

    def hash_source(text: str) -> str:
        digest = hashlib.sha256(text.encode()).digest()
        return f"'sha256-{base64.b64encode(digest).decode()}'"

    return "; ".join(
        [
            "default-src 'none'",
            f"script-src {hash_source(script)} 'wasm-unsafe-eval'",
            f"style-src-elem {hash_source(style)}",
            "style-src-attr 'unsafe-inline'",  # the colours of the panel's rows
            "img-src data: blob:",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


def main(work: Path, page: Path) -> None:
    """Write the viewer; `work` keeps intermediate files."""
    work.mkdir(parents=True, exist_ok=True)
    wasm = (work / "kreisel.wasm").resolve()
    compile_core(wasm)
    modules = install_libraries(work).resolve()
    script = bundle(modules, wasm, HERE / "main.js", "--format=esm", "--target=es2022")
    style = bundle(modules, wasm, HERE / "page.css")
    text = (HERE / "index.html").read_text(encoding="utf-8")
    licences = html.escape(collect_licences(modules), quote=False)
    notices = f'<template id="licences">\n{licences}\n</template>'
    policy = make_security_policy(script, style)
    text = text.replace('Policy" content=""', f'Policy" content="{policy}"')
    text = text.replace("<style></style>", f"<style>{style}</style>")
    text = text.replace(
        '<script type="module"></script>', f'{notices}\n<script type="module">{script}</script>'
    )
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
