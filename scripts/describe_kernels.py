"""Writes which kernels there are, and for which Python, numba and processor: `kernels.json`."""

import json
import sys
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

NEEDS = ("abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe")  # x86-64-v3, Linux's words

described = Path(sys.argv[1])
folder = described.parent
sources = blake2b(digest_size=8)
for source in sorted(folder.rglob("*.py")):
    sources.update(source.read_bytes())
described.write_text(
    json.dumps(
        {
            "python": f"{sys.version_info.major}.{sys.version_info.minor}",
            "numba": version("numba"),
            "processor": "x86-64-v3",
            "needs": NEEDS,
            "sources": sources.hexdigest(),
            "kernels": sorted(
                str(kernel.relative_to(folder)) for kernel in folder.rglob("*.nb[ic]")
            ),
        }
    ),
    encoding="utf-8",
)
