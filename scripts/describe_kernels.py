"""Writes for which Python, numba and processor kernels were compiled: `kernels.json`."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

NEEDS = ("abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe")  # x86-64-v3, Linux's words

Path(sys.argv[1]).write_text(
    json.dumps(
        {
            "python": f"{sys.version_info.major}.{sys.version_info.minor}",
            "numba": version("numba"),
            "processor": "x86-64-v3",
            "needs": NEEDS,
        }
    ),
    encoding="utf-8",
)
