"""Kernels that came compiled with the wheel: whether this computer can run them.

A wheel carries the kernels that its commands use, compiled for a processor that most computers
have (``kernels.json`` says for which). Without them, as in a checkout, each kernel is compiled for
this computer's own processor when it is first used.
"""

import os
import sys
from pathlib import Path

SWITCH = "VERGENCE_KERNELS"  # "native": compile for this processor, whatever came with the wheel
_DESCRIBED = Path(__file__).parents[1] / "kernels.json"


def use_prebuilt_kernels() -> str:
    """Ask numba for code that the wheel's kernels are made of, before the first is used.

    The setting is the process's: other numba functions in it are compiled for the same processor.

    Returns:
        Why kernels that are there cannot be used; empty if they can, or if there are none.
    """
    if not _DESCRIBED.exists() or "NUMBA_CPU_NAME" in os.environ:
        return ""
    if os.environ.get(SWITCH) == "native":
        return f"{SWITCH}=native"
    import json  # at hand only where kernels were shipped: importing vergence takes milliseconds
    from importlib.metadata import version

    built = json.loads(_DESCRIBED.read_text(encoding="utf-8"))
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    for name, value in (("python", python), ("numba", version("numba"))):
        if value != built[name]:
            return f"kernels were compiled for {name} {built[name]}; this is {value}"
    missing = set(built["needs"]) - _processor_features()
    if missing:
        return f"kernels were compiled for processors with {', '.join(sorted(missing))}"
    _ask_for(built["processor"])
    return ""


def _ask_for(processor: str) -> None:
    os.environ["NUMBA_CPU_NAME"], os.environ["NUMBA_CPU_FEATURES"] = processor, ""
    if (numba := sys.modules.get("numba")) is not None:  # it has read the environment already
        numba.config.CPU_NAME, numba.config.CPU_FEATURES = processor, ""


def _processor_features() -> set[str]:
    """Return what the processor says that it can do, in Linux's words."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return set()
    return next((set(line.split()) for line in lines if line.startswith("flags")), set())
