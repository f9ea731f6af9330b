"""The behavior of version 0.2.0, see check.py."""

import subprocess
import sys
from pathlib import Path


def test_all_numbers_are_those_of_version_0_2_0():
    check = Path(__file__).with_name("check.py")
    done = subprocess.run(
        [sys.executable, check], capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
