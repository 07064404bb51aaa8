"""What is said of a field: the comment on its line or above it, as the code has it."""

import ast
import inspect
import io
import textwrap
import tokenize


def field_comments(cls: type) -> dict[str, str]:
    """Return the comments beside or above the annotated fields of a class itself, by field.

    A comment of several lines is joined. One above a field is a sentence in the code, and comes out
    as the phrase that the others are. Nothing is known of a class whose code is nowhere to be read.
    """
    try:
        source = textwrap.dedent(inspect.getsource(cls))
    except (OSError, TypeError):
        return {}
    comments = {
        token.start[0]: token.string.lstrip("#").strip()
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    alone = {n for n, line in enumerate(source.splitlines(), 1) if line.lstrip().startswith("#")}
    body = ast.parse(source).body[0]
    assert isinstance(body, ast.ClassDef)
    said = {}
    for node in body.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
            beside = " ".join(comments[line] for line in lines if line in comments)
            said[node.target.id] = beside or _phrase(_above(node.lineno, comments, alone))
    return said


def _above(line: int, comments: dict[int, str], alone: set[int]) -> str:
    """Return the comment that ends on the line before."""
    first = line
    while first - 1 in alone:
        first -= 1
    return " ".join(comments[each] for each in range(first, line))


def _phrase(sentence: str) -> str:
    """Return a sentence without its capital and its full stop; names such as R keep theirs."""
    if sentence[1:2].islower():
        sentence = sentence[0].lower() + sentence[1:]
    return sentence.removesuffix(".")
