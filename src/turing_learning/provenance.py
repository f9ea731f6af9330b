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
    """Return the versions of the package and of its libraries, its commit in a checkout, the machine, and the time."""
    machine = {
        "system": platform.platform(),
        "architecture": platform.machine(),
        "processor": _processor(),
        "processors": os.cpu_count(),
    }
    return {"versions": versions(), "commit": _commit(), "machine": machine, "started": now()}


def _processor() -> str | None:
    """Return the name of the processor; None if the system does not say."""
    # Linux alone has this file; there, `platform.processor` is often empty
    with suppress(OSError):
        for line in (
            Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        ):
            name = line.partition(":")[2].strip()
            if line.startswith("model name") and name:
                return name
        return None
    return platform.processor().strip() or None


def _commit() -> str | None:
    """Return the commit of a checkout of the repository, with "-dirty" if files differ.

    None elsewhere.
    """
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists() or not (root / "pyproject.toml").exists():
        return None
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    how: dict[str, Any] = {"capture_output": True, "text": True, "timeout": 5, "check": True}
    try:
        process = subprocess.run(command, cwd=root, **how)
    except (OSError, subprocess.SubprocessError):
        return None
    return process.stdout.strip() or None


def versions() -> dict[str, str]:
    """Return name -> version of the package, of Python, and of the libraries that results depend on."""
    installed = {"turing-learning": version("turing-learning"), "python": platform.python_version()}
    for package in _PACKAGES:
        with suppress(PackageNotFoundError):
            installed[package] = version(package)
    return installed


def this_process() -> dict[str, Any]:
    """Return the number of this process, and the name of its machine."""
    return {"pid": os.getpid(), "host": socket.gethostname()}


def now() -> str:
    """Return the time, with the zone, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")
