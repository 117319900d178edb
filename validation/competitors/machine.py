"""The conditions of a measurement: machine, compiler, commit and versions."""

import hashlib
import os
import platform
import re
import subprocess
from datetime import date
from importlib.metadata import version
from pathlib import Path

import kreisel as kr

GSL_MISSING = "not included in this build; gsl_rk8pd and gsl_bsimp are missing"


def processor_name():
    try:
        info = Path("/proc/cpuinfo").read_text()
    except OSError:
        info = ""
    fields = dict(re.findall(r"^(model name|cpu family|model)\s*:\s*(.+)$", info, re.M))
    name = fields.get("model name", "").strip()
    if name and not re.search(r"\d", name) and {"cpu family", "model"} <= set(fields):
        # a virtual machine may hide the number of the model
        return f"{name} (family {fields['cpu family']}, model {fields['model']})"
    return name or platform.processor() or platform.machine()


def describe_cores():
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{usable} core{'s' if usable != 1 else ''}"


def list_package_files():
    """Return the Python files and the compiled extension of kreisel."""
    folders, suffixes = map(Path, kr.__path__), {".py", ".so", ".pyd"}
    files = {file for folder in folders for file in folder.rglob("*") if file.suffix in suffixes}
    return sorted(files)


def compiler_version():
    """Return the names and versions of the compilers that built the extension."""
    code = b"".join(file.read_bytes() for file in list_package_files() if file.suffix != ".py")
    compilers = re.findall(rb"(GCC|clang version)(?:: \([^)\0]*\))? ([\d.]+)", code)
    names = {f"{name.split()[0].decode().lower()} {number.decode()}" for name, number in compilers}
    return ", ".join(sorted(names)) or "not known"


def commit_name():
    git = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "not known"


def fingerprint(*more):
    """Return a list of everything that can affect the measured run times and errors."""
    folder = Path(__file__).parents[1]
    own = sorted(file for suffix in ("py", "jsonl", "toml") for file in folder.rglob(f"*.{suffix}"))
    files = [*list_package_files(), *own]
    code = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    description = describe_machine()
    return [code, *(description[key] for key in ("machine", "commit", "versions")), *map(str, more)]


def describe_machine():
    packages = ", ".join(f"{name} {version(name)}" for name in ("heyoka", "numpy", "scipy"))
    today, gsl = date.today().isoformat(), describe_gsl()
    return {
        "date": today,
        "machine": f"{processor_name()}, {describe_cores()}, {platform.system()}",
        "compiler": compiler_version(),
        "commit": commit_name(),
        "versions": f"Python {platform.python_version()}, {packages}",
        "GSL": gsl,
        "peers": describe_peers(gsl, today),
    }


def describe_peers(gsl, today):
    """Return a figure caption with the versions of the other integrators and the date."""
    peers = [f"heyoka {version('heyoka')}", f"SciPy {version('scipy')}"]
    if "version" in gsl:
        peers.append(f"GSL {gsl.split()[-1]}")
    return f"{', '.join(peers)}; {today}"


def describe_gsl():
    """Return a string that says whether GSL is included and, if known, its version."""
    if not has_gsl():
        return GSL_MISSING
    command = ["pkg-config", "--modversion", "gsl"]
    try:
        result = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "included"
    return f"included, version {result.stdout.strip()}"


def is_of_gsl(name):
    """Return True if the method is an integrator of GSL."""
    return name.startswith("gsl_")


def has_gsl():
    return any(map(is_of_gsl, kr.methods))
