"""Measures perception on images that nobody rendered, beside ViSP and OpenCV.

    python benchmarks/footage.py [--json] [--markdown FILE] [--figure FILE] [KIND...]

The kinds are objects, points, tags, boards and pairs. The exit code is 1 when an aim does not hold,
and 2 where the images are not installed.
"""

import argparse
import importlib
import json
import sys
from pathlib import Path

from footage_figure import draw
from footage_rows import Row, markdown
from real_images import IMAGES, INSTALL

KINDS = {
    "objects": "Known objects",
    "points": "Tracked points",
    "tags": "AprilTags",
    "boards": "Calibration boards",
    "pairs": "Two views",
}


def measure(kinds: list[str]) -> dict[str, list[Row]]:
    """The rows of each kind."""
    found = {}
    for kind in kinds:
        print(f"{kind} …", file=sys.stderr)
        found[kind] = importlib.import_module(f"footage_{kind}").rows()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(KINDS)} (all)")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw the objects there")
    options = parser.parse_args()
    if unknown := sorted(set(options.kinds) - set(KINDS)):
        parser.error(f"no kind {', '.join(unknown)}; there are: {', '.join(KINDS)}")
    if not IMAGES.is_dir():
        print(INSTALL, file=sys.stderr)
        return 2
    found = measure(options.kinds or list(KINDS))
    text = "\n".join(f"## {KINDS[kind]}\n\n{markdown(rows)}\n" for kind, rows in found.items())
    if options.markdown:
        options.markdown.write_text(text)
    if options.figure and "objects" in found:
        draw(found["objects"], options.figure)
    if options.json:
        records = [row.record for rows in found.values() for row in rows]
        print(json.dumps({"footage": records}))
    else:
        print(text)
    return 1 if any(row.holds is False for rows in found.values() for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
