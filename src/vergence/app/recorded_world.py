"""The cell that a recording was made in, to be shown in the poses of the recording."""

from collections.abc import Mapping
from typing import Self

from vergence.arrays import FloatArray
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import RunInfo
from vergence.simulation import choose_renderer
from vergence.simulation.world import World

_SETTING = "# set: "  # before what was set on the command line, in the text of a cell


class RecordedWorld:
    """A world without physics.

    Args:
        world: of the cell.
    """

    def __init__(self, world: World) -> None:
        self.world = world

    @classmethod
    def of(cls, info: RunInfo) -> Self | str:
        """Return the world of a recorded run, or why it cannot be shown."""
        if not info.text:
            return "The recording names no cell."
        for source in (info.path, info.cell):
            try:
                cell = load_cell(source, _settings(info.text), info.seed)
            except InputError:
                continue
            if _plain(cell.text) != _plain(info.text):
                return f"{source} has changed since the recording was made."
            choose_renderer(needed=False)
            try:
                return cls(World(cell))
            except InputError as error:
                return str(error)
        return "The cell file that was run is not on this machine."

    def place(
        self, joints: Mapping[str, FloatArray], targets: Mapping[str, FloatArray]
    ) -> FloatArray:
        """Put arms and targets somewhere, by name; return the state.

        Targets that are not among them stay where they are.
        """
        for name in targets.keys() & self.world.target_bodies.keys():
            self.world.move_target(targets[name], name)
        self.world.place(joints)
        return self.world.state()


def _settings(text: str) -> dict[str, str]:
    """Return what was set on the command line, but for the seed."""
    lines = (line.removeprefix(_SETTING) for line in text.splitlines() if line.startswith(_SETTING))
    pairs = (line.partition(" = ") for line in lines)
    return {key: value for key, _, value in pairs if key != "seed"}


def _plain(text: str) -> list[str]:
    """Return the lines of a cell file, without blank ones and what was set on the command line."""
    return [line for line in text.splitlines() if line and not line.startswith(_SETTING)]
