"""Commands of a page: each command, and the range of its numbers."""

from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StringConstraints,
    TypeAdapter,
    ValidationError,
)
from pydantic_core import ErrorDetails

from vergence.errors import InputError, echo

_Name = Annotated[str, StringConstraints(strict=True, max_length=100)]
_Place = Annotated[float, Field(ge=-1e5, le=1e5)]  # px, or normalized image coordinates
_MOST_PICKED = 64  # points
_Int = Annotated[StrictInt, Field(ge=-(10**9), le=10**9)]


class _Command(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class More(_Command):
    """Send what is new: the page has shown the last message."""

    do: Literal["more"]


class Pause(_Command):
    """Stop time."""

    do: Literal["pause"]


class Resume(_Command):
    """Let the run continue."""

    do: Literal["resume"]


class Step(_Command):
    """Run until the next image."""

    do: Literal["step"]


class Stop(_Command):
    """Brake the arm and end the run."""

    do: Literal["stop"]


class Reset(_Command):
    """Begin again; changes of the law stay."""

    do: Literal["reset"]


class SetSpeed(_Command):
    """Set the speed, in multiples of real time."""

    do: Literal["speed"]
    value: Annotated[float, Field(ge=0.01, le=1000)]


class Seek(_Command):
    """Go to a time of a recording, s."""

    do: Literal["seek"]
    value: Annotated[float, Field(ge=0, le=1e9)]


class Look(_Command):
    """Turn the view in three dimensions, and go nearer."""

    do: Literal["look"]
    azimuth_deg: Annotated[float, Field(ge=-180, le=180)]
    elevation_deg: Annotated[float, Field(ge=-180, le=180)]
    zoom: Annotated[float, Field(ge=0.1, le=10)]


class ChooseLaw(_Command):
    """Use another law."""

    do: Literal["law"]
    name: _Name


class ResetLaw(_Command):
    """Take back all changes of the law, in every task."""

    do: Literal["own law"]


class TurnKnob(_Command):
    """Change one number or choice of the law."""

    do: Literal["knob"]
    key: _Name
    value: StrictBool | _Int | StrictFloat | _Name


class TrackPoints(_Command):
    """Keep points of an image where they are in it, whatever the task was."""

    do: Literal["track"]
    time: Annotated[float, Field(ge=-1e9, le=1e9)]  # of the exposure they were picked in, s
    points: Annotated[list[tuple[_Place, _Place]], Field(min_length=1, max_length=_MOST_PICKED)]


class TakeGoal(_Command):
    """Keep an image as a goal to go back to, with what belongs to it."""

    do: Literal["goal"]


class Grab(_Command):
    """Take the target with the mouse."""

    do: Literal["grab"]
    view: _Name  # a camera; empty for the view in three dimensions
    u: _Place
    v: _Place


class Move(_Command):
    """Move the target with the mouse."""

    do: Literal["move"]
    view: _Name
    u: _Place
    v: _Place
    along: StrictBool  # the optical axis; or, turning, about it
    turn: StrictBool = False  # turn it instead


class Release(_Command):
    """Leave the target where the mouse has brought it."""

    do: Literal["release"]


class LetGo(_Command):
    """Let the target move by itself again."""

    do: Literal["let go"]


Command: TypeAlias = (
    More
    | Pause
    | Resume
    | Step
    | Stop
    | Reset
    | SetSpeed
    | Seek
    | Look
    | ChooseLaw
    | ResetLaw
    | TurnKnob
    | TrackPoints
    | TakeGoal
    | Grab
    | Move
    | Release
    | LetGo
)

_VERBS = [get_args(kind.model_fields["do"].annotation)[0] for kind in get_args(Command)]
_COMMANDS: TypeAdapter[Command] = TypeAdapter(Annotated[Command, Field(discriminator="do")])


def parse(message: str | bytes) -> Command:
    """Return the command that a message of a page is.

    Raises:
        InputError: if it is none; the text states the reason.
    """
    try:
        return _COMMANDS.validate_json(message)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise InputError("message", key, first["input"], _allowed(first)) from None


def _allowed(complaint: ErrorDetails) -> str:
    """Return what a message may say where it says something else."""
    match complaint["type"]:
        case "json_invalid":
            return "a command as JSON"
        case "union_tag_invalid" | "union_tag_not_found":
            return f"do: {', '.join(_VERBS)}"
    return echo(complaint["msg"].removeprefix("Input should be "))
