"""YAML and XML as tables, from files that may be malicious.

OpenCV's own reader of such files is not used: on bad YAML it ends the process or never returns.
"""

from typing import Any
from xml.etree import ElementTree as ET

import yaml

_DEEPEST_XML = 16
_LONGEST_SCALAR = 2000
_MOST_NODES = 20_000  # takes about a second


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """PyYAML's safe loader, bounded, and able to read OpenCV's matrices.

    It refuses repeated keys, and merges: a few merges of aliases make a mapping of any size.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        self._nodes += 1
        if self._nodes > _MOST_NODES:
            raise yaml.MarkedYAMLError(problem=f"more than {_MOST_NODES} values")
        return super().compose_node(parent, index)

    def construct_scalar(self, node: yaml.ScalarNode) -> Any:
        if len(node.value) > _LONGEST_SCALAR:  # a number in base 60 takes quadratic time
            raise yaml.MarkedYAMLError(
                problem=f"a value of {len(node.value)} characters", problem_mark=node.start_mark
            )
        return super().construct_scalar(node)

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        seen = set()
        for key, _ in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                raise yaml.MarkedYAMLError(problem="a merge of tables (<<)")
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value} a second time", problem_mark=key.start_mark
                )
            if isinstance(key.value, str):
                seen.add(key.value)


for _kind in ("opencv-matrix", "opencv-nd-matrix"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_yaml_map)


def yaml_documents(text: str) -> list[Any]:
    """Return the documents of a YAML text that are not empty.

    Raises:
        ValueError: in one line, if it is no such text.
        RecursionError: if it is nested too deeply.
    """
    if text.startswith("%YAML:"):  # OpenCV's first line, which is no directive of YAML
        text = text.partition("\n")[2]
    try:
        return [document for document in yaml.load_all(text, _Loader) if document is not None]
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f" in line {mark.line + 1}" if mark is not None else ""
        raise ValueError(f"{error.problem or error.context}{where}") from None
    except yaml.YAMLError as error:
        raise ValueError(str(error)) from None


def xml_table(text: str) -> dict[str, Any]:
    """Return an XML text as a table: an element with others in it is a table, any other its text.

    What occurs several times becomes a list. Attributes are left out.

    Raises:
        ValueError: in one line, if it is no such text, or declares a document type.
        RecursionError: if it is nested too deeply.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("a document type or entity")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise ValueError(str(error)) from None
    return {root.tag: _element(root, 1)}


def _element(element: ET.Element, depth: int) -> Any:
    if depth > _DEEPEST_XML:
        raise RecursionError
    if not len(element):
        return (element.text or "").strip()
    table: dict[str, Any] = {}
    for child in element:
        value = _element(child, depth + 1)
        if child.tag not in table:
            table[child.tag] = value
        elif isinstance(table[child.tag], list):
            table[child.tag].append(value)
        else:
            table[child.tag] = [table[child.tag], value]
    return table
