"""Tests of third-party software.

The licences, versions and hashes of installed packages are checked.
"""

import importlib.metadata
import json
import re
import runpy
import shutil
import subprocess

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from toolbox import ROOT


@pytest.fixture
def requirements(monkeypatch):
    monkeypatch.chdir(ROOT)
    return runpy.run_path(".ci/requirements")


def test_packages_of_pip_have_versions_and_hashes(requirements):
    """Check that each package has a fixed version and a hash.

    If this test fails, run `.ci/lock`.
    """
    text = (ROOT / ".ci/locked.txt").read_text()
    assert "//" not in text and "index" not in text
    versions = {}
    for block in requirements["locked"]():
        name, version = re.match(r"([\w.-]+)==([\w.]+)", block).groups()
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", block), name
        versions.setdefault(canonicalize_name(name), []).append(version)
    for line in requirements["asked"]():
        requirement = Requirement(line)
        available = versions.get(canonicalize_name(requirement.name), [])
        assert any(requirement.specifier.contains(version) for version in available), line


def test_locked_txt_agrees_with_the_requirements(requirements):
    lines = [line for line in (ROOT / ".ci/locked.txt").read_text().splitlines() if line[0] != "#"]
    assert "".join(requirements["locked"]()).splitlines() == lines


def test_users_install_no_development_tools(requirements):
    names = requirements["of_users"]()
    assert {"numpy", "click", "rich"} <= names and not names & {"pytest", "heyoka", "mypy"}
    blocks = {block.split("==")[0] for block in requirements["locked"](names)}
    assert blocks == names


def test_the_wheel_contains_the_licence_of_pybind11():
    files = importlib.metadata.files("pybind11")
    (notice,) = [file for file in files if file.match("licenses/LICENSE")]
    assert (ROOT / "python/licences/pybind11.txt").read_text() == notice.read_text()
    licences = importlib.metadata.metadata("kreisel").get_all("License-File")
    assert "python/licences/pybind11.txt" in licences and "LICENSE" in licences


def test_the_bill_of_materials_has_the_bundled_versions(requirements):
    bill = json.loads((ROOT / "python/materials.json.in").read_text())
    parts = {part["name"]: part["version"] for part in bill["components"]}
    assert parts.pop("pybind11") == "@pybind11_VERSION@"  # CMake fills in the version
    (zig,) = requirements["locked"](["ziglang"])
    lock = json.loads((ROOT / "python/viewer/package-lock.json").read_text())["packages"]
    built_in = {
        name.removeprefix("node_modules/"): package["version"]
        for name, package in lock.items()
        if name and not package.get("dev")
    }
    versions = {name: built_in[name] for name in lock[""]["dependencies"]}
    assert parts == versions | {"ziglang": re.match(r"ziglang==(\S+)", zig)[1]}
    for part in bill["components"][1:]:
        assert part["purl"].endswith(f"/{part['name']}@{part['version']}")


@pytest.fixture
def checkout(tmp_path):
    """Copy the scripts in .ci, and create a .venv that belongs to another checkout."""
    shutil.copytree(ROOT / ".ci", tmp_path / ".ci")
    (tmp_path / ".venv/bin").mkdir(parents=True)
    (tmp_path / ".venv/bin/activate").write_text("VIRTUAL_ENV=/somewhere/else/.venv\n")
    (tmp_path / ".venv/own").write_text("precious")
    return tmp_path


def need(checkout):
    """Run .ci/need with only basic shell tools and a python3 that fails."""
    tools = checkout / "tools"
    tools.mkdir()
    for name in ("sh", "dirname", "grep", "ls", "rm", "cat", "mkdir"):
        (tools / name).symlink_to(shutil.which(name))
    (tools / "python3").write_text("#!/bin/sh\nexit 1\n")
    (tools / "python3").chmod(0o755)
    command = ["sh", ".ci/need", "build"]
    return subprocess.run(
        command, cwd=checkout, env={"PATH": str(tools)}, capture_output=True, text=True
    )


def test_a_foreign_environment_is_not_touched(checkout):
    result = need(checkout)
    assert result.returncode == 1 and "move it elsewhere" in result.stderr
    assert (checkout / ".venv/own").read_text() == "precious"


def test_a_moved_environment_is_recreated_with_a_message(checkout):
    (checkout / ".venv/requirements.txt").write_text("numpy\n")
    result = need(checkout)
    assert "recreating .venv and build" in result.stdout and not (checkout / ".venv").exists()
