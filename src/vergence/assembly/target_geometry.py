"""The geometry of a cell's target: its tag, the features of the file, or its model's corners."""

from typing import TYPE_CHECKING

from vergence.cell import Cell
from vergence.cell.named_targets import target_body

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel
    from vergence.vision.known_object import ObjectModel


def target_shape(cell: Cell, model: "CellModel") -> "ObjectModel":
    """Return the target's geometry; its features are the file's, else what represents it."""
    from vergence.vision.known_object import ObjectModel, as_followed, object_model_of

    if cell.target.tag is not None:
        name, tag = f"tag {cell.target.tag.id}", cell.target.tag
        return ObjectModel.from_face(name, tag.corners)
    if cell.target.features:
        return ObjectModel.from_corners(str(cell.target.model), cell.target.features)
    return as_followed(object_model_of(model.model, target_body(cell.target_name)))
