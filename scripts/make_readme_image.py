"""Make the README's image from real runs of the Puma cell: the cell, its camera, its tracks."""

from pathlib import Path

from vergence.simulation import choose_renderer

choose_renderer()

import cv2  # noqa: E402
import matplotlib as mpl  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402

from vergence.assembly import run_cell  # noqa: E402
from vergence.cell import load_cell  # noqa: E402
from vergence.drawing import SETTINGS, curve  # noqa: E402
from vergence.studies.nelson1995_runs import STRATEGIES, moving  # noqa: E402

OUT = Path(__file__).parents[1] / "docs" / "images" / "puma560.png"
SHOWN_S = 16.0


class Snapshot:
    """Keeps the image of the task's camera and the joints nearest to an instant."""

    def __init__(self, time: float) -> None:
        self.time, self.record = time, None

    def begin(self, info): ...

    def tick(self, record):
        if record.time <= self.time and record.sample.frames:
            self.record = record

    def event(self, time, name, text): ...

    def close(self, outcome, summary): ...


def run(strategy):
    cell = moving(load_cell("puma560").replace(law=STRATEGIES[strategy]), -1)
    snapshot = Snapshot(SHOWN_S)
    done = run_cell(cell, [snapshot])
    return cell, done.cameras["wrist"], snapshot.record, done.outcome


def cell_view(cell, record):
    from vergence.simulation.world import World

    world = World(cell)
    frame = record.sample.frames[-1]
    world.data.qpos[:6] = frame.joints["puma"]
    world.move_target(frame.truth.T_world_target)
    world.update()
    renderer = mujoco.Renderer(world.model, 480, 640)
    view = mujoco.MjvCamera()
    view.lookat, view.distance, view.azimuth, view.elevation = [-0.55, -0.2, 0.62], 3.5, 62, -14
    renderer.update_scene(world.data, view)
    image = renderer.render().copy()
    sky = image.sum(axis=2) == 0
    image[sky] = (236, 240, 244)
    return image


def camera_view(record):
    frame, points = record.sample.frames[-1], record.observation.views[-1].points_px
    image = cv2.cvtColor(frame.image, cv2.COLOR_GRAY2RGB)
    for points_px, color, kind in (
        (record.reference.points_px, (230, 159, 0), cv2.MARKER_CROSS),
        (points, (0, 158, 115), cv2.MARKER_SQUARE),
    ):
        for u, v in points_px:
            cv2.drawMarker(image, (round(u), round(v)), (255, 255, 255), kind, 30, 5, cv2.LINE_AA)
            cv2.drawMarker(image, (round(u), round(v)), color, kind, 28, 2, cv2.LINE_AA)
    return image


def main() -> None:
    runs = {name: run(name) for name in STRATEGIES}
    cell, _, record, _ = runs["avoidance"]
    with mpl.rc_context(SETTINGS):
        figure = Figure(figsize=(12.6, 3.3), layout="constrained")
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
    for axes, image, title in (
        (left, cell_view(cell, record), "the cell in MuJoCo"),
        (middle, camera_view(record), "its wrist camera: tracked (square), desired (cross)"),
    ):
        axes.imshow(image)
        axes.set_axis_off()
        axes.set_title(title, fontsize=9)
    labels = {
        "two_axis": "two axes: joint 1 at its limit",
        "four_axis": "four axes: joint 1 at its limit",
        "avoidance": "four axes with avoidance",
    }
    for index, (name, (_, trace, _, outcome)) in enumerate(runs.items()):
        moved = trace.T_world_target[:, 0, 3]
        along = moved - moved[0]
        look = {**curve(index), "linewidth": 2.4, "zorder": 9 - index}
        right.plot(trace.time, along, label=labels[name], **look)
        if not outcome.succeeded:
            right.plot(trace.time[-1], along[-1], "X", color=look["color"], markersize=9, zorder=9)
    order = np.arange(len(runs))[::-1]
    handles, texts = right.get_legend_handles_labels()
    right.legend(
        [handles[i] for i in order], [texts[i] for i in order], frameon=False, fontsize=8.5
    )
    right.set_title("how far the object is tracked", fontsize=9)
    right.set_xlabel("time (s)")
    right.set_ylabel("object translation (m)")
    OUT.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(SETTINGS):
        figure.savefig(OUT, dpi=110)


if __name__ == "__main__":
    main()
