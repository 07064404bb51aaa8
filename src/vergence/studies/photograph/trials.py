"""Random photographs and starts: rendered, run through the real loop, held against the truth."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.assembly import run_driver, with_goal
from vergence.camera.photograph import write_photograph
from vergence.cell import Cell, load_cell
from vergence.geometry import se3_inverse, so3_angle, transform_points
from vergence.signals import Outcome, OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.studies.photograph.methods import Method, without_plan
from vergence.studies.rendered import with_imaging

SCENES = {"clutter": "table.xml", "plane": "../puma560/board.xml", "parcel": "box.xml"}
ARM, CAMERA = "ur5", "wrist"
SPREADS_DEG = (4.0, 8.0, 12.0)  # of the joints between goal and start
OVERLAP, TILT_DEG = 0.3, 40.0  # what goal and start share, and how they differ, to be feasible
HIDDEN = 0.2  # of the photograph
_ABOVE_DEG = (0.0, -100.0, 100.0, -90.0, -90.0, 0.0)
_OTHER_CAMERA = {"resolution": (960, 720), "focal_px": (850.0, 850.0), "focal_mm": None}


class Trial(NamedTuple):
    """What a photograph was taken of, from where, and where the arm begins."""

    number: int
    scene: str
    goal_deg: FloatArray  # (6,)
    start_deg: FloatArray  # (6,)
    light: float  # of the run, over that of the photograph
    hidden: bool  # whether a part of the photograph is covered
    other_camera: bool  # whether another camera took it

    @classmethod
    def drawn(cls, seed: int, number: int) -> "Trial":
        """Draw a trial; half of the photographs are used for two starts each."""
        photograph = np.random.default_rng([seed, 11, number // 2])
        goal = np.array(_ABOVE_DEG) + photograph.uniform(-6.0, 6.0, 6)
        goal[5] = photograph.uniform(-90.0, 90.0)
        hidden, other = photograph.random(2) < (0.5, 0.25)
        rng = np.random.default_rng([seed, 12, number])
        spread = SPREADS_DEG[number % len(SPREADS_DEG)]
        start = goal + rng.uniform(-spread, spread, 6)
        start[5] = goal[5] + rng.uniform(-150.0, 150.0)
        scene = tuple(SCENES)[(number // 2) % len(SCENES)]
        light = float(rng.uniform(0.6, 1.3))
        return cls(number, scene, goal, start, light, bool(hidden), bool(other))


class TrialResult(NamedTuple):
    """How a trial went."""

    trial: Trial
    outcome: OutcomeKind
    reason: str
    feasible: bool  # whether start and goal share enough to be recognised
    moved: bool
    start_m: float  # distance of the camera from its goal at the start
    start_deg: float
    final_m: float  # and at the end, truly
    final_deg: float
    time_s: float


def run_trial(seed: int, method: Method, number: int, imaging: str | None = None) -> TrialResult:
    """Take a photograph, run the loop from a start, and compare where the camera ends."""
    planner = "potential_field" if method is Method.POTENTIAL_FIELD else "optimised"
    trial = Trial.drawn(seed, number)
    start = {"start_deg": trial.start_deg.tolist()}
    cell = load_cell("photograph", seed=number).replace(
        arms={ARM: start},
        scene={"light": trial.light},
        target={"model": SCENES[trial.scene]},
        task={"planner": planner},
    )
    cell = with_imaging(cell, imaging)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "goal.png"
        take_photograph(cell, trial, path)
        driver = SimulatedDriver(with_goal(cell, path))
        try:
            return _run(driver, trial, method)
        finally:
            driver.close()


def _run(driver: SimulatedDriver, trial: Trial, method: Method) -> TrialResult:
    goal = driver.frame_at(CAMERA, ARM, np.deg2rad(trial.goal_deg)).truth
    assert goal is not None
    T_goal, T_start = goal.T_world_camera, driver.world.camera_pose(CAMERA)
    feasible = _feasible(driver, trial, T_goal, T_start)
    outcome = _outcome(driver, method)
    T_end = driver.world.camera_pose(CAMERA)
    begun, ended = apart(T_start, T_goal), apart(T_end, T_goal)
    kind, reason, time = outcome.kind, outcome.reason, outcome.time
    return TrialResult(trial, kind, reason, feasible, time > 0.0, *begun, *ended, time)


def _outcome(driver: SimulatedDriver, method: Method) -> Outcome:
    cell = without_plan(driver.cell, driver) if method is Method.WITHOUT_PLAN else driver.cell
    if isinstance(cell, Outcome):
        return cell
    return run_driver(cell, driver, (), images=True).outcome


def take_photograph(cell: Cell, trial: Trial, path: Path) -> None:
    """Render the photograph in its own light, by its own camera, a part of it covered."""
    changes = {CAMERA: {**_OTHER_CAMERA, "pixel_um": None}} if trial.other_camera else {}
    driver = SimulatedDriver(cell.replace(cameras=changes, scene={"light": 1.0}))
    try:
        frame = driver.frame_at(CAMERA, ARM, np.deg2rad(trial.goal_deg))
        camera = driver.cameras[CAMERA]
    finally:
        driver.close()
    assert frame.image is not None
    image = _covered(frame.image, trial) if trial.hidden else frame.image
    write_photograph(path, image, camera, {})


def _covered(image: ImageArray, trial: Trial) -> ImageArray:
    """Cover a part of an image by a rectangle of stripes."""
    rng = np.random.default_rng([13, trial.number // 2])
    rows, columns = image.shape
    height, width = (round(np.sqrt(HIDDEN) * side) for side in image.shape)
    top, left = rng.integers(0, rows - height), rng.integers(0, columns - width)
    covered = image.copy()
    v, u = np.indices((height, width))
    covered[top : top + height, left : left + width] = np.where((u + 2 * v) // 12 % 2, 60, 170)
    return covered


def _feasible(
    driver: SimulatedDriver, trial: Trial, T_goal: FloatArray, T_start: FloatArray
) -> bool:
    """Return whether the start sees enough of what the goal sees, from not too far aside."""
    cosine = float(T_goal[:3, 2] @ T_start[:3, 2])
    if cosine < np.cos(np.deg2rad(TILT_DEG)):
        return False
    camera, world = driver.cameras[CAMERA], driver.world
    v, u = np.meshgrid(np.arange(20, camera.height, 40), np.arange(20, camera.width, 40))
    grid = np.column_stack((u.ravel(), v.ravel())).astype(np.float64)
    q = world.joint_position(ARM)
    world.place_arm(ARM, np.deg2rad(trial.goal_deg))
    points = world.anchor(CAMERA, grid)
    world.place_arm(ARM, q)
    points = transform_points(world.target_pose(), points[np.isfinite(points).all(axis=1)])
    if not len(points):
        return False
    seen = camera.in_view(transform_points(se3_inverse(T_start), points))
    seen[seen] &= world.sees(CAMERA, points[seen])
    return bool(seen.sum() >= OVERLAP * len(grid))


def apart(T: FloatArray, T_goal: FloatArray) -> tuple[float, float]:
    """Return the distance, m, and the angle, degrees, between two poses."""
    E = se3_inverse(T_goal) @ T
    return float(np.linalg.norm(E[:3, 3])), float(np.rad2deg(so3_angle(E)))
