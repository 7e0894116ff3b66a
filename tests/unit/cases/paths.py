# SPDX-License-Identifier: MIT
"""Where the modules under test lie: import this first."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
CASES = ROOT / "cases"
sys.path[:0] = [str(CASES), str(CASES / "elastic-gate"), str(ROOT / "tests/support")]


def case(name):
    """The folder of a case, whose modules can be imported from then on."""
    folder = CASES / name
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    return folder
