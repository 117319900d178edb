"""Tests of the examples in README.md."""

import os
import re
import shlex
import sys
import tomllib
from pathlib import Path

from toolbox import ROOT, install_library, need, run, run_programs


def blocks(*languages):
    text = (ROOT / "README.md").read_text()
    pairs = re.findall(r"^```(\w+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
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


def test_each_python_block_runs_alone_and_the_first_prints_its_comment(tmp_path):
    programs = [tmp_path / f"block{i}.py" for i in range(len(blocks("python")))]
    for program, text in zip(programs, blocks("python"), strict=True):
        program.write_text(text)
    output = run_programs(*programs, cwd=tmp_path, MPLBACKEND="agg")
    assert output.splitlines()[0] == re.search(r"print\(.*  # (.+)", blocks("python")[0])[1]
    assert (tmp_path / "top.npz").exists()


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
    text = run(Path(sys.executable).parent / "kreisel", "--help")
    assert set(commands("kreisel")) <= set(re.findall(r"^  (\w+) ", text, re.MULTILINE))


def test_the_package_shows_the_readme():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project.get("readme") == "README.md"
