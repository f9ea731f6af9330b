"""The manifest: what ran, where, with what, and how far it came."""

import hashlib
import json
import os
import platform
import socket
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

FORMAT_VERSION = 1
RUNNING = "running"
"""State of a run that goes on, or was killed."""
STOPPED = "stopped"
"""State of a run that was asked to stop."""
FINISHED = "finished"
"""State of a run of which everything is there, figures and report too."""
_PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "zarr", "xarray", "pydantic")


def new_manifest(configuration_text: str, seed: int) -> dict[str, Any]:
    """Return the manifest of a run that is about to begin.

    Parameters
    ----------
    configuration_text
        The resolved configuration as it is stored.
    seed
        Seed of the run.
    """
    return {
        "format_version": FORMAT_VERSION,
        "state": RUNNING,
        "seed": seed,
        "configuration_sha256": digest(configuration_text),
        "versions": _versions(),
        "commit": _commit(),
        "machine": _machine(),
        "started": now(),
        "finished": None,
        "seconds": 0.0,
        "process": this_process(),
    }


def digest(text: str) -> str:
    """Return the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def now() -> str:
    """Return the time, with the zone, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def this_process() -> dict[str, Any]:
    """Return who runs: process id and host."""
    return {"pid": os.getpid(), "host": socket.gethostname()}


def manifest_rows(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    """Return names and values for a page, nested objects in one row each."""
    return [(name.replace("_", " "), _shown(value)) for name, value in manifest.items() if value is not None]


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {item}" for name, item in value.items() if item is not None)
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _versions() -> dict[str, str]:
    versions = {"turing-learning": version("turing-learning"), "python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions


def _commit() -> str | None:
    """Return the commit when the package runs from a checkout of its repository."""
    root = Path(__file__).resolve().parents[4]
    if not (root / ".git").exists() or not (root / "pyproject.toml").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip() or None


def _machine() -> dict[str, Any]:
    return {
        "system": platform.platform(),
        "architecture": platform.machine(),
        "processor": _processor(),
        "processors": os.cpu_count(),
    }


def _processor() -> str | None:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor() or None
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), None)


def parse_manifest(text: str) -> dict[str, Any] | None:
    """Return a manifest from its text, None if it is not one."""
    try:
        manifest = json.loads(text)
    except ValueError:
        return None
    return manifest if isinstance(manifest, dict) and type(manifest.get("format_version")) is int else None
