"""Tests of the examples in README.md."""

import os
import re
import shlex
import sys
import tomllib
from pathlib import Path

from toolbox import ROOT, install_library, need, run


def blocks(*languages):
    pairs = re.findall(
        r"^```(\w+)\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE
    )
    return [text for language, text in pairs if language in languages]


def commands(name):
    """Return the first argument of each call of the command `name` in README.md."""
    lines = re.split(r"\n|&&", "\n".join(blocks("sh", "bash", "console")))
    words = [shlex.split(line.strip().removeprefix("$ "), comments=True) for line in lines]
    return [
        w[1]
        for w in words
        if len(w) > 1 and Path(w[0]).name == name and re.fullmatch("[a-z]+", w[1])
    ]


def test_each_python_block_runs_alone(tmp_path):
    for i, text in enumerate(blocks("python")):
        program = tmp_path / f"block{i}.py"
        program.write_text(text)
        run(sys.executable, "-W", "error", program, cwd=tmp_path, MPLBACKEND="agg")
    assert blocks("python") and (tmp_path / "top.npz").exists()


def test_the_first_python_block_prints_its_comment(tmp_path):
    text = blocks("python")[0]
    program = tmp_path / "first.py"
    program.write_text(text)
    expected = re.search(r"print\(.*  # (.+)", text)[1]
    assert run(sys.executable, program, cwd=tmp_path).strip() == expected


def test_shell_blocks_run_beside_the_scenes(tmp_path):
    for text in blocks("toml"):
        (tmp_path / re.match(r"# (\w+\.toml)", text)[1]).write_text(text)
    lines = [text for text in blocks("sh") if text.startswith("kreisel ")]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    assert lines and list(tmp_path.iterdir())
    output = run("sh", "-ec", "\n".join(lines), cwd=tmp_path, PATH=path)
    assert "nutation [deg]" in output and '"m_z"' in output
    assert (tmp_path / "top.html").stat().st_size > 1 << 16


def test_the_c_program_compiles_by_the_command_and_runs(tmp_path):
    need("cmake", "gcc", "pkg-config")
    (text,) = blocks("c")
    (tmp_path / "top.c").write_text(text)
    (lines,) = (text for text in blocks("sh") if "pkg-config" in text)
    command = lines[lines.index("export PKG_CONFIG_PATH") :].replace("cc -std=c99", "gcc -std=c99")
    run("sh", "-ec", command, cwd=tmp_path, PREFIX=str(install_library()))
    assert "nutation" in run(tmp_path / "top")


def test_make_targets_exist():
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert commands("make") and set(commands("make")) <= set(targets)


def test_commands_exist():
    for command in set(commands("kreisel")):
        run(Path(sys.executable).parent / "kreisel", command, "--help")


def test_the_package_shows_the_readme():
    assert (
        tomllib.loads((ROOT / "pyproject.toml").read_text())["project"].get("readme") == "README.md"
    )
