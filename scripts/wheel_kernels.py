"""Puts kernels that are compiled already into the wheel, if `kernels.json` says that they are."""

import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class WheelKernels(BuildHookInterface):  # type: ignore[misc,type-arg]
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        sources = Path(self.root, "src")
        described = sources / "vergence" / "kernels.json"
        if not described.exists():
            return
        kernels = [described, *sources.rglob("*.nbi"), *sources.rglob("*.nbc")]
        build_data["force_include"] |= {str(f): str(f.relative_to(sources)) for f in kernels}
        build_data["pure_python"] = False
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["tag"] = f"cp{sys.version_info[0]}{sys.version_info[1]}-none-{platform}"
