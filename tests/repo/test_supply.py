"""Tests of the versions and licences of third-party software."""

import importlib.metadata
import json
import re
import shutil
import subprocess
import tomllib

import pytest
from packaging.requirements import Requirement
from toolbox import ROOT

LOCKED = dict(re.findall(r"^([\w.-]+)==([\w.]+)", (ROOT / ".ci/locked.txt").read_text(), re.M))


def test_the_locked_versions_satisfy_pyproject_toml():
    """Check the versions in .ci/locked.txt. If this test fails, run `.ci/lock`."""
    config = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = config["project"]["optional-dependencies"] | config["dependency-groups"]
    lines = config["build-system"]["requires"] + config["project"]["dependencies"]
    for requirement in map(Requirement, sum(extras.values(), lines)):
        assert requirement.specifier.contains(LOCKED[requirement.name]), requirement


def test_the_wheel_contains_the_licence_of_pybind11():
    files = importlib.metadata.files("pybind11")
    (notice,) = [file for file in files if file.match("licenses/LICENSE")]
    assert (ROOT / "python/licences/pybind11.txt").read_text() == notice.read_text()
    licences = importlib.metadata.metadata("kreisel").get_all("License-File")
    assert "python/licences/pybind11.txt" in licences and "LICENSE" in licences


def test_the_bill_of_materials_has_the_bundled_versions():
    bill = json.loads((ROOT / "python/materials.json.in").read_text())
    parts = {part["name"]: part["version"] for part in bill["components"]}
    assert parts.pop("pybind11") == "@pybind11_VERSION@"  # CMake fills in the version
    lock = json.loads((ROOT / "python/viewer/package-lock.json").read_text())["packages"]
    built_in = {
        name.removeprefix("node_modules/"): package["version"]
        for name, package in lock.items()
        if name and not package.get("dev")
    }
    versions = {name: built_in[name] for name in lock[""]["dependencies"]}
    assert parts == versions | {"ziglang": LOCKED["ziglang"]}
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
