"""A user's planners, trackers and filters: found beside the cell, checked as all parts are."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from vergence.app.watch.knobs import knobs, law_choices
from vergence.assembly import plan, run_cell
from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.estimation import PoseFilter, RpyPoseFilter
from vergence.experiments import compare, law_table
from vergence.places import CELLS
from vergence.planning import OptimisedPlanner, PotentialFieldPlanner
from vergence.registry import BUILT_IN, find
from vergence.signals import OutcomeKind
from vergence.vision import SsdTracking

EXAMPLES = Path(__file__).parents[1] / "examples"
NEAR = {  # of the gantry's goal: a straight path stays in view
    "arms.gantry.start_deg": "[-0.216, 0.146, 0.012, 39.017, -1.363, 1.977]",
    "task.camera_speed_m_s": "1.0",
}
SHORT = {"duration_s": "0.2", "target.motion": '{ kind = "stationary" }'}


def own(folder: Path, cell: str, settings: dict[str, str]) -> Cell:
    """A shipped cell with the examples' parts beside it."""
    if not (folder / cell).exists():
        shutil.copytree(CELLS, folder, dirs_exist_ok=True)
        for example in EXAMPLES.glob("my_*.py"):
            shutil.copy(example, folder / cell)
    return load_cell(folder / cell, settings)


def test_a_planner_beside_the_cell_plans_and_runs(tmp_path: Path) -> None:
    settings = {"task.planner": '{ kind = "my_planner:Straight", waypoints = 50 }', **NEAR}
    cell = own(tmp_path, "gantry", settings)
    path = plan(cell, images=False)
    assert path
    assert (path.planner, len(path.q)) == ("straight", 50)
    np.testing.assert_allclose(path.q[25] - path.q[24], path.q[1] - path.q[0])  # it is straight
    assert run_cell(cell, images=False).outcome.succeeded
    far = plan(own(tmp_path, "gantry", {"task.planner": "my_planner:Straight"}), images=False)
    assert "leaves the image" in str(far)


def test_a_planner_is_named_on_the_command_line(tmp_path: Path, capsys, monkeypatch) -> None:
    from vergence.app.options import PlanOptions
    from vergence.app.plan import plan

    own(tmp_path, "gantry", {})
    monkeypatch.chdir(tmp_path / "gantry")  # a part is found in the current folder, too
    settings = [f"{key}={value}" for key, value in NEAR.items()]
    options = PlanOptions(
        cell="gantry",
        planner="my_planner:Straight",
        images=False,
        settings=settings,
        out=tmp_path / "out",
    )
    assert plan(options) == 0
    assert "found by the straight planner" in capsys.readouterr().out


def test_a_tracker_beside_the_cell_follows_rendered_images(tmp_path: Path) -> None:
    settings = {"task.tracker": '{ kind = "my_tracker:LucasKanade", noise_px = 0.7 }', **SHORT}
    run = run_cell(own(tmp_path, "puma560", settings))
    assert run.outcome.kind is OutcomeKind.COMPLETED
    seen = run.cameras["wrist"]
    assert seen.found.all()
    np.testing.assert_allclose(np.nanmax(np.abs(seen.points_px - seen.true_px)), 0.0, atol=0.5)


def test_a_filter_beside_the_cell_follows_the_target(tmp_path: Path) -> None:
    settings = {"perception.filter": '{ kind = "my_filter:Stationary", slow_m_s = 1.0 }', **SHORT}
    run = run_cell(own(tmp_path, "lippiello2005", settings), images=False)
    assert run.outcome.kind is OutcomeKind.COMPLETED
    assert not run.target.velocity[1:].any()  # the user's filter says that it is at rest


@pytest.mark.parametrize(
    ("cell", "key", "default", "kind"),
    [
        ("gantry", "planner", OptimisedPlanner, "potential_field"),
        ("puma560", "tracker", SsdTracking, "round_marks"),
        ("panda", "filter", PoseFilter, "rpy"),
    ],
)
def test_a_part_is_named_by_its_kind_and_written_as_it_is_read(
    cell: str, key: str, default: type, kind: str
) -> None:
    table = "perception" if key == "filter" else "task"
    loaded = load_cell(cell)
    assert getattr(getattr(loaded, table), key) == default()
    other = load_cell(cell, {f"{table}.{key}": kind})
    assert type(getattr(getattr(other, table), key)) is find(key, kind)
    assert getattr(other.replace(seed=3), table) == getattr(other, table)


def test_numbers_of_a_part_are_keys_of_the_cell() -> None:
    cell = load_cell("gantry", {"task.planner.tree_samples": "0"})
    assert cell.task.planner == OptimisedPlanner(tree_samples=0)
    cell = load_cell("gantry", {"task.planner": "potential_field", "task.planner.step": "0.1"})
    assert cell.task.planner == PotentialFieldPlanner(step=0.1)
    cell = load_cell("panda", {"perception.filter.gate": "9"})  # of the usual kind
    assert cell.perception.filter == PoseFilter(gate=9)


@pytest.mark.parametrize("role", ["planner", "filter", "tracker"])
def test_a_wrong_number_gets_the_same_answer_in_python_and_in_a_cell(role: str) -> None:
    for kind in BUILT_IN[role]:
        cls = find(role, kind)
        for name, about in cls.__pydantic_fields__.items():
            with pytest.raises(InputError) as said:
                cls(**{name: float("nan")})
            assert said.value.key == name
            if any(hasattr(bound, "gt") or hasattr(bound, "ge") for bound in about.metadata):
                with pytest.raises(InputError) as said:
                    cls(**{name: -1})
                key, cell = {
                    "planner": ("task.planner", "gantry"),
                    "tracker": ("task.tracker", "puma560"),
                    "filter": ("perception.filter", "panda"),
                }[role]
                with pytest.raises(InputError) as in_cell:
                    load_cell(cell, {key: kind, f"{key}.{name}": "-1"})
                assert in_cell.value.allowed == said.value.allowed
                assert in_cell.value.key == f"{key}.{name}"


def test_the_densities_of_the_paper_are_the_rpy_filters() -> None:
    noise = RpyPoseFilter().noise
    np.testing.assert_allclose(noise, 1e-6 * np.repeat([0.0, 0.0, 5.0, 20.0], 3))


def test_a_whole_law_beside_the_cell_runs_and_is_compared(tmp_path: Path) -> None:
    square = "[[0.06, 0.06, 0.0], [-0.06, 0.06, 0.0], [-0.06, -0.06, 0.0], [0.06, -0.06, 0.0]]"
    settings = {**SHORT, "duration_s": "1", "task.desired": '"centred"', "target.features": square}
    cell = own(tmp_path, "puma560", settings | {"law": '{ kind = "my_law:Transpose" }'})
    x, y, z = cell.target.position_m
    cell = cell.replace(target={"position_m": (x + 0.08, y, z)})
    slow, fast = (run_cell(c, images=False) for c in (cell.replace(law={"gain": 0.1}), cell))
    errors = [np.nanmax(run.cameras["wrist"].error_px[-1]) for run in (slow, fast)]
    assert errors[1] < 0.5 * errors[0] < 0.5 * np.nanmax(slow.cameras["wrist"].error_px[0])
    assert cell.replace(seed=7).law == cell.law
    assert law_table(cell, "my_law:Transpose")["kind"] == "my_law:Transpose"
    assert law_table(cell, "image_based")["gain"] == 0.4  # numbers that both have are the cell's
    compared = compare(cell, ["own", "image_based"], starts=1, spread=0.05, duration_s=0.3)
    assert [score.law for score in compared.scores] == ["own", "image_based"]
    assert [knob["key"] for knob in knobs(cell.law)] == ["gain"]
    assert "my_law:Transpose (as in the cell)" in law_choices(cell)


def test_a_feature_beside_the_cell_is_brought_to_its_desired_value(tmp_path: Path) -> None:
    settings = {
        **SHORT,
        "duration_s": "2",
        "target.features": "[[0.05, -0.05, 0.0], [-0.05, -0.05, 0.0], [0.0, 0.06, 0.0]]",
        "task.feature_count": "3",
        "task.desired": "[[225, 160], [415, 160], [320, 330]]",  # a larger triangle
        "law": '{ kind = "image_based", feature = "my_feature:Area", gain = 3.0 }',
    }
    run = run_cell(own(tmp_path, "puma560", settings), images=False)
    errors = [abs(of["my_feature:Area"]) for of in run.arms["puma"].errors if of]
    assert errors[0] > 0.3
    assert errors[-1] < 0.03 * errors[0]


def test_a_law_of_ones_own_goes_on_with_the_points_that_are_found(tmp_path: Path) -> None:
    motion = '{ kind = "line", velocity_m_s = [1.0, 0.0, 0.0], distance_m = 3.0 }'
    settings = {"duration_s": "3", "task.feature_count": "4", "target.motion": motion}
    law = {"law": '{ kind = "my_law:Transpose" }'}
    run = run_cell(own(tmp_path, "puma560", settings | law), images=False)
    assert run.outcome.kind is OutcomeKind.TARGET_LOST
    assert set(run.cameras["wrist"].found.sum(axis=1)) == {4, 2, 0}  # two points leave first


BAD = '''
import numpy as np
import vergence as vg
from vergence.planning import Path
from vergence.vision import Tracks


@vg.part("planner")
class Raises:
    def plan(self, problem):
        return 1 / 0


@vg.part("planner")
class Nothing:
    def plan(self, problem):
        return None


@vg.part("planner")
class Elsewhere:
    def plan(self, problem):
        return Path.through(problem, np.tile(problem.q_start + 0.1, (3, 1)), "elsewhere")


@vg.part("planner")
class Infinite:
    def plan(self, problem):
        path = Path.through(problem, np.tile(problem.q_start, (3, 1)), "infinite")
        q = path.q.copy()
        q[1] = np.nan
        object.__setattr__(path, "q", q)
        return path


@vg.part("tracker")
class NoTracker:
    def start(self, image, points_px):
        return "a tracker"


@vg.part("tracker")
class Late:
    """Works until its first image of the run."""

    def start(self, image, points_px):
        return self

    def track(self, image, predicted_px=None):
        raise ValueError("a lens cap")


@vg.part("tracker")
class TooFew:
    def start(self, image, points_px):
        return self

    def track(self, image, predicted_px=None):
        return Tracks(np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0, bool), ())


@vg.part("tracker")
class NotFinite:
    def start(self, image, points_px):
        self.__dict__["count"] = len(points_px)
        return self

    def track(self, image, predicted_px=None):
        count = self.count
        nothing, size = np.full((count, 2), np.nan), (count, 1, 1)
        return Tracks(nothing, np.tile(np.eye(2), size), np.ones(count, bool), ("",) * count)


@vg.part("law")
class NoBind:
    def command(self, observation, reference, joints): ...


@vg.part("law")
class NoCommand:
    def bind(self, setting):
        return self


@vg.part("law")
class Unbound:
    def bind(self, setting):
        raise KeyError("no such arm")


@vg.part("filter")
class Halves:
    def start(self, time, T_world_target, velocity=None, covariance=None):
        raise TypeError("no start")
    def predict(self, belief, time): ...
'''


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the cells, each beside parts that do not work."""
    folder = tmp_path_factory.mktemp("bad")
    shutil.copytree(CELLS, folder, dirs_exist_ok=True)
    for cell in ("gantry", "puma560", "lippiello2005"):
        (folder / cell / "bad.py").write_text(BAD)
    return folder


@pytest.mark.parametrize(
    ("cell", "key", "kind", "said"),
    [
        ("gantry", "task.planner", "bad:Raises", "raised ZeroDivisionError: division by zero"),
        ("gantry", "task.planner", "bad:Nothing", "whose plan returned NoneType"),
        ("gantry", "task.planner", "bad:Elsewhere", "a path that begins elsewhere"),
        ("gantry", "task.planner", "bad:Infinite", "waypoints that are not finite"),
        ("gantry", "task.planner", "bad:NoTracker", "declared as tracker"),
        ("gantry", "task.planner", "optimized", "did you mean optimised"),
        ("puma560", "task.tracker", "bad:NoTracker", "whose start returned str"),
        ("puma560", "task.tracker", "sdd", "did you mean ssd"),
        ("puma560", "task.planner", "optimised", "does not have; allowed"),
        ("lippiello2005", "perception.filter", "bad:Halves", "methods start, predict and update"),
        ("lippiello2005", "perception.filter", "kalman", "pose, rpy, or module:Class"),
    ],
)
def test_a_part_that_does_not_work_is_named_before_anything_moves(
    bad: Path, cell: str, key: str, kind: str, said: str
) -> None:
    with pytest.raises(InputError) as caught:
        run_cell(load_cell(bad / cell, {key: kind, **SHORT}), images=cell == "puma560")
    assert said in str(caught.value)
    assert caught.value.source == str(bad / cell / "cell.toml")
    assert caught.value.key.startswith(key)


@pytest.mark.parametrize("kind", ["bad:Late", "bad:TooFew", "bad:NotFinite"])
def test_a_tracker_that_fails_in_a_run_ends_it_with_a_named_outcome(bad: Path, kind: str) -> None:
    run = run_cell(load_cell(bad / "puma560", {"task.tracker": kind, **SHORT}))
    assert run.outcome.kind is OutcomeKind.PART_RAISED
    assert "perception" in run.outcome.reason
