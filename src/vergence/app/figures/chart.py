"""What a chart of a report shows, as data: panels above each other over one axis."""

from dataclasses import dataclass, replace
from typing import Literal, Self

from vergence.app.figures.events import numbers_at
from vergence.arrays import FloatArray

Dash = Literal["", "dashed", "dotted"]
Shape = Literal["start", "end", "desired"]
COLORS = 7  # curves of a panel with a colour of their own; dashes tell the further ones apart
_DASHES: tuple[Dash, ...] = ("", "dashed", "dotted")


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A line through points; it is broken where a value is not known."""

    label: str  # in the legend
    x: FloatArray  # (N,) in the unit of the chart's axis
    y: FloatArray  # (N,) in the unit of the panel, NaN where not known
    color: int = 0  # its place in the page's palette
    dash: Dash = ""

    @classmethod
    def numbered(cls, index: int, label: str, x: FloatArray, y: FloatArray) -> Self:
        """Return the n-th curve of a panel, distinguished from all others."""
        return cls(label, x, y, index % COLORS, _DASHES[index // COLORS % len(_DASHES)])


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """Places that are marked one by one."""

    label: str  # in the legend
    points: FloatArray  # (N, 2)
    shape: Shape


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """What lies between two lines; it is broken where they are not known."""

    label: str  # in the legend
    x: FloatArray  # (N,) in the unit of the chart's axis
    low: FloatArray  # (N,) in the unit of the panel, NaN where not known
    high: FloatArray  # (N,) likewise
    color: int = 0


@dataclass(frozen=True, slots=True)
class Shade:
    """A part of the horizontal axis, shaded in all panels."""

    label: str  # in the legend: what it means
    start: float  # in the unit of the chart's axis
    end: float
    words: str  # shown under the pointer
    color: int = 0
    number: int = 0  # written above it; nothing if 0


@dataclass(frozen=True, slots=True)
class Stretches:
    """When something held, as bars in the row of its name."""

    label: str  # in the legend: what a bar means
    row: int  # of the panel's rows
    spans: tuple[tuple[float, float], ...]  # start and length, in the unit of the chart's axis
    color: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One pair of axes."""

    title: str  # what is drawn, and in which unit
    curves: tuple[Curve, ...] = ()
    marks: tuple[Marks, ...] = ()
    stretches: tuple[Stretches, ...] = ()
    bands: tuple[Band, ...] = ()  # cut off at the ends of the axis
    rows: tuple[str, ...] = ()  # names of what has stretches; such a panel has no other axis
    low: float | None = None  # lower end of the axis; where None, the values decide
    high: float | None = None  # upper end; below `low` where the axis points downwards
    limits: tuple[float, float] | None = None  # drawn as lines, with what lies beyond shaded
    image: tuple[int, int] | None = None  # width and height, px, of an image whose frame is drawn


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Panels above each other that share their horizontal axis."""

    panels: tuple[Panel, ...]
    x_title: str = "time (s)"
    x_low: float = 0.0
    x_high: float = 1.0
    events: tuple[tuple[float, str], ...] = ()  # places of vertical lines, and their names
    shades: tuple[Shade, ...] = ()

    @property
    def names(self) -> tuple[tuple[float, str], ...]:
        """Names above the first panel: those of events, and the numbers of shades."""
        numbered = (shade for shade in self.shades if shade.number)
        places = ((one.number, 0.5 * (one.start + one.end)) for one in numbered)
        return self.events + numbers_at(places, self.x_high)

    @property
    def over_time(self) -> bool:
        """Whether the horizontal axis is the time of the run."""
        return self.panels[0].image is None

    def until(self, time: float, events: tuple[tuple[float, str], ...] = ()) -> Self:
        """Return the chart over a whole run, with the events of the run in it."""
        if not self.over_time:
            return self
        return replace(self, x_high=max(time, 1e-9), events=events)
