"""What ran when, where, and with what."""

import os
import platform
import socket
import subprocess
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "zarr", "xarray", "pydantic")


def provenance() -> dict[str, Any]:
    """Return the versions of the package and of what it is built on, its commit in a checkout, the machine, and the time."""
    lines = ["model name:" + (platform.processor() or "")]
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    machine: dict[str, Any] = {"system": platform.platform(), "architecture": platform.machine()}
    machine |= {"processor": next(filter(None, names), None), "processors": os.cpu_count()}
    root, commit = Path(__file__).resolve().parents[2], None
    if (root / ".git").exists() and (root / "pyproject.toml").exists():  # a checkout of the repository
        command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        with suppress(OSError, subprocess.SubprocessError):
            found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
            commit = found.stdout.strip() or None
    return {"versions": versions(), "commit": commit, "machine": machine, "started": now()}


def versions() -> dict[str, str]:
    """Return name -> version of the package, of Python, and of the libraries that results depend on."""
    found = {"turing-learning": version("turing-learning"), "python": platform.python_version()}
    for package in _PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def this_process() -> dict[str, Any]:
    """Return the number of this process, and the name of its machine."""
    return {"pid": os.getpid(), "host": socket.gethostname()}


def now() -> str:
    """Return the time, with the zone, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
