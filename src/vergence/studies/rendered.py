"""Studies that look through simulated cameras, and cameras as bad as real ones for them."""

from typing import TYPE_CHECKING, get_args

from vergence.errors import InputError, nearest

if TYPE_CHECKING:
    from vergence.cell import Cell

# Those whose images are rendered, and whether they are with `quick` as well.
RENDERED = {
    "nelson1995": False,
    "lippiello2005": False,
    "mezouar2001": False,
    "photograph": True,
    "region": True,
}


def check_imaging(paper: str, imaging: str, quick: bool) -> None:
    """Refuse imaging where there are no images.

    Raises:
        InputError: if there is no such imaging, or the study renders no images.
    """
    from vergence.cell.schema import ImagingTable

    known = get_args(ImagingTable.model_fields["kind"].annotation)
    if imaging not in known:
        raise InputError("imaging", "", imaging, nearest(imaging, known))
    if paper not in RENDERED:
        allowed = f"only studies that render images: {', '.join(RENDERED)}"
        raise InputError("imaging", "", f"{imaging} for {paper}", allowed)
    if quick and not RENDERED[paper]:
        raise InputError("imaging", "", f"{imaging} with quick", "not both: quick has no images")


def with_imaging(cell: "Cell", imaging: str | None) -> "Cell":
    """Return a cell all of whose cameras have an imaging; the cell itself for None."""
    if imaging is None:
        return cell
    return cell.replace(cameras={name: {"imaging": imaging} for name in cell.cameras})
