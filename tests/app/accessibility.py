"""What axe, the accessibility checker, finds on a page."""

import sys
from pathlib import Path
from typing import Any

import pytest
from browser import Browser

_AXE = Path(sys.prefix) / "axe" / "node_modules" / "axe-core" / "axe.min.js"


def complaints(browser: Browser, scheme: str) -> list[str]:
    """Return what axe complains of on a page as it is, in a colour scheme, "light" or "dark"."""
    if not _AXE.is_file():
        pytest.fail("axe-core is missing: scripts/ensure-browser .venv installs it")
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.call("Emulation.setEmulatedMedia", features=features)
    browser.value(_AXE.read_text(encoding="utf-8") + "; 0")
    found: list[dict[str, Any]] = browser.value(
        "axe.run(document, {iframes: false}).then((result) => result.violations.map((v) => "
        "({id: v.id, help: v.help, nodes: v.nodes.map((n) => n.html.slice(0, 160))})))"
    )
    return [f"{rule['id']}: {rule['help']}: {node}" for rule in found for node in rule["nodes"]]
