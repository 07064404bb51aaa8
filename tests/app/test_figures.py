"""Charts name their units, draw what was recorded, and have room for every label."""

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from vergence.app.figures import (
    Chart,
    Curve,
    Panel,
    camera_chart,
    chart_svg,
    constraints_chart,
    error_chart,
    estimate_chart,
    event_lines,
    joints_chart,
    measures_chart,
    paths_chart,
    target_chart,
    twist_chart,
)
from vergence.app.figures.arm import normalized
from vergence.app.figures.axis import range_of, thinned, ticks
from vergence.app.figures.chart_svg import LEFT, RIGHT, WIDTH
from vergence.drawing import COLORS, DARK, LIMIT, figure, legend, logarithmic, svg
from vergence.geometry import se3_exp
from vergence.runtime import ArmInfo
from vergence.runtime.recording import Recording
from vergence.runtime.results import Event, TargetTrace
from vergence.studies.mezouar2001.path_panels import camera_paths, space

CHARTS = ["error", "paths", "joints", "twist", "measures", "camera", "target", "constraints"]


def chart(name: str, recording: Recording) -> Chart:
    camera, arm = recording.cameras["wrist"], recording.arms["puma"]
    made = {
        "error": lambda: error_chart(camera),
        "paths": lambda: paths_chart(recording.info.cameras["wrist"], camera),
        "joints": lambda: joints_chart(recording.info.arms["puma"], arm),
        "twist": lambda: twist_chart(arm),
        "measures": lambda: measures_chart(arm),
        "camera": lambda: camera_chart(camera),
        "target": lambda: target_chart(camera, recording.target),
        "constraints": lambda: constraints_chart(arm),
    }[name]()
    assert made is not None
    return made.until(6.0, event_lines(recording.events, 6.0))


def drawing(made: Chart) -> ET.Element:
    html = chart_svg(made, "a chart")
    return ET.fromstring(html[html.index('<svg class="chart"') :])


def curve_points(path: ET.Element) -> np.ndarray:
    numbers = re.findall(r"-?[\d.]+", path.attrib["d"])
    return np.array(numbers, dtype=float).reshape(-1, 2)


@pytest.mark.parametrize("name", CHARTS)
def test_every_axis_says_what_and_in_which_unit(name: str, recording: Recording) -> None:
    made = chart(name, recording)
    assert all("(" in panel.title or panel.rows for panel in made.panels)
    assert "(" in made.x_title


@pytest.mark.parametrize("name", CHARTS)
def test_no_label_is_cut_off(name: str, recording: Recording) -> None:
    svg = drawing(chart(name, recording))
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    for text in svg.iter("text"):
        x, y, kind = float(text.attrib["x"]), float(text.attrib["y"]), text.attrib["class"]
        length = 7.5 * len(text.text or "")  # more than any font at this size takes
        left = x - length * {"end": 1.0, "middle": 0.5}.get(kind, 0.0)
        assert left >= 0.0
        assert left + length <= width
        assert 9.0 <= y <= height - 2.0


@pytest.mark.parametrize("name", CHARTS)
def test_all_values_lie_between_the_axes(name: str, recording: Recording) -> None:
    svg = drawing(chart(name, recording))
    _, _, width, height = map(float, svg.attrib["viewBox"].split())
    curves = [one for one in svg.iter("path") if one.attrib["class"].startswith("curve")]
    assert curves or name == "constraints"
    for path in curves:
        x, y = curve_points(path).T
        assert x.min() >= LEFT
        assert x.max() <= width - RIGHT + 0.1
        assert y.min() >= 0.0
        assert y.max() <= height


def test_error_and_drift_are_drawn_in_pixels(recording: Recording) -> None:
    error, drift = chart("error", recording).panels
    trace = recording.cameras["wrist"]
    np.testing.assert_array_equal(error.curves[0].y, trace.error_px[:, 0])
    np.testing.assert_array_equal(drift.curves[3].y, trace.drift_px[:, 3])


def test_paths_lie_in_an_image_with_v_downwards(recording: Recording) -> None:
    svg = drawing(chart("paths", recording))
    [frame] = [one for one in svg.iter("rect") if one.attrib["class"] == "frame"]
    left, top, width, height = (float(frame.attrib[k]) for k in ("x", "y", "width", "height"))
    assert width / height == pytest.approx(320 / 240, rel=1e-3)
    first = next(one for one in svg.iter("path") if one.attrib["class"].startswith("curve"))
    u, v = recording.cameras["wrist"].points_px[0, 0]
    expected = left + (u + 0.5) / 320 * width, top + (v + 0.5) / 240 * height
    np.testing.assert_allclose(curve_points(first)[0], expected, atol=0.11)


def test_joint_limits_are_at_one() -> None:
    arm = ArmInfo(("a", "b", "c"), [-1.0, 2.0, -np.inf], [3.0, 4.0, np.inf], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(normalized(arm, arm.q_min)[:2], -1.0)
    np.testing.assert_allclose(normalized(arm, arm.q_max)[:2], 1.0)
    np.testing.assert_allclose(normalized(arm, np.array([1.0, 3.0, 9.0]))[:2], 0.0)
    assert np.isnan(normalized(arm, np.zeros(3))[2])


def test_a_joint_without_limits_is_drawn_past_half_a_turn(recording: Recording) -> None:
    info, trace = recording.info.arms["puma"], recording.arms["puma"]
    endless = ArmInfo(
        info.names,
        np.append(info.q_min[:5], -np.inf),
        np.append(info.q_max[:5], np.inf),
        info.rate_max,
    )
    q = trace.position.copy()
    turned = np.deg2rad(np.linspace(27.0, 387.0, len(q)))
    q[:, 5] = np.remainder(turned + np.pi, 2 * np.pi) - np.pi  # as an encoder of one turn has it
    made = joints_chart(endless, replace(trace, position=q))
    assert made is not None
    shares, degrees, _ = made.panels
    assert [curve.label for curve in shares.curves] == list(info.names[:5])
    [drawn] = degrees.curves
    assert drawn.label == "joint6"
    np.testing.assert_allclose(drawn.y, np.linspace(27.0, 387.0, len(q)))


def test_events_are_marked_in_every_panel(recording: Recording) -> None:
    svg = drawing(chart("twist", recording))
    lines = [one for one in svg.iter("path") if one.attrib["class"] == "event"]
    assert len(lines) == 2 * len(recording.events)
    scale = (WIDTH - LEFT - RIGHT) / 6.0
    assert lines[0].attrib["d"].startswith(f"M{LEFT + scale * recording.events[0].time:.1f} ")
    ones = [text for text in svg.iter("text") if text.text == "1"]
    first = min(ones, key=lambda text: float(text.attrib["y"]))
    assert float(first.attrib["x"]) == pytest.approx(LEFT + scale * 2.0, abs=0.1)
    tops = [float(line.attrib["d"].split()[1].split("V")[0]) for line in lines]
    assert float(first.attrib["y"]) < min(tops)


def test_a_filters_error_is_its_distance_from_the_truth(recording: Recording) -> None:
    camera = recording.cameras["wrist"]
    poses = camera.T_world_target.copy()
    poses[:, :3, 3] += [0.003, 0.0, 0.004]
    poses[:, :3, :3] = se3_exp(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1]))[:3, :3]
    count = len(camera.time)
    covariance = np.tile(1e-6 * np.eye(12), (count, 1, 1))
    sure = np.ones(count, dtype=bool)
    made = estimate_chart(
        camera,
        TargetTrace(camera.time, camera.received, poses, np.zeros((count, 6)), covariance, sure),
    )
    assert made is not None
    position, rotation = made.panels
    np.testing.assert_allclose(position.curves[0].y, 5.0)
    np.testing.assert_allclose(position.curves[1].y, np.sqrt(3.0))
    np.testing.assert_allclose(rotation.curves[0].y, np.degrees(0.1))


def test_events_at_one_time_share_a_number() -> None:
    events = [Event(time, "lost", "") for time in (1.0, 1.01, 1.02, 4.0, 9.0)]
    assert event_lines(events, 6.0) == ((1.0, "1–3"), (4.0, "4"))


def test_a_legend_names_every_curve_once_beside_the_drawing(recording: Recording) -> None:
    html = chart_svg(chart("joints", recording), "joints")
    legend = html[: html.index('<svg class="chart"')]
    for name in recording.info.arms["puma"].names:
        assert legend.count(f"</svg>{name}</span>") == 1


def test_names_cannot_break_a_chart() -> None:
    sly = "<script>alert(1)</script>"
    x = np.arange(3.0)
    made = Chart((Panel(sly, (Curve(sly, x, x),)),), x_title=sly, events=((1.0, sly),))
    assert sly not in chart_svg(made, sly)


def test_a_curve_is_broken_where_it_is_not_known() -> None:
    y = np.array([0.0, 1.0, np.nan, 1.0, 0.0])
    svg = drawing(Chart((Panel("y (m)", (Curve("", np.arange(5.0), y),)),), x_high=4.0))
    [path] = [one for one in svg.iter("path") if one.attrib["class"].startswith("curve")]
    assert path.attrib["d"].count("M") == 2
    assert path.attrib["d"].count("L") == 2


@pytest.mark.parametrize(
    ("low", "high", "names"),
    [
        (0.0, 2.0, ["0.0", "0.5", "1.0", "1.5", "2.0"]),
        (-0.011, 0.012, ["−0.010", "−0.005", "0.000", "0.005", "0.010"]),
        (0.0, 1.1, ["0.00", "0.25", "0.50", "0.75", "1.00"]),
        (980.0, 12_000.0, ["2500", "5000", "7500", "10000"]),
        (0.0, 3e-9, ["0", "1e−09", "2e−09", "3e−09"]),
    ],
)
def test_ticks_are_round_numbers(low: float, high: float, names: list[str]) -> None:
    places, shown = ticks(low, high, 5)
    assert shown == names
    assert places[0] >= low - 1e-12
    assert places[-1] <= high + 1e-12


@pytest.mark.parametrize("values", [[], [0.0], [3.0, 3.0], [np.nan], [-1e-9, 1e-9], [1e12, 2e12]])
def test_any_values_have_an_axis(values: list[float]) -> None:
    low, high = range_of(np.array(values))
    assert low < high
    assert all(low < value < high for value in values if np.isfinite(value))
    assert len(ticks(low, high, 5)[0])


def test_a_long_curve_keeps_its_peaks_and_gaps() -> None:
    x = np.linspace(0.0, 600.0, 18_000)
    y = np.sin(x)
    y[4321], y[10_000:10_500] = 5.0, np.nan
    few_x, few_y = thinned(x, y, 800)
    assert len(few_x) == len(few_y) <= 1600
    assert np.nanmax(few_y) == 5.0
    assert np.nanmin(few_y) == pytest.approx(-1.0, abs=1e-3)
    gap = (few_x > x[10_050]) & (few_x < x[10_450])
    assert np.isnan(few_y[gap]).all()


def test_nothing_known_gives_no_chart(recording: Recording) -> None:
    camera, arm = recording.cameras["wrist"], recording.arms["puma"]
    unknown = np.full_like(camera.points_px, np.nan)
    blind = replace(
        camera,
        found=np.zeros_like(camera.found),
        desired_px=unknown,
        true_px=unknown,
        T_world_camera=np.full_like(camera.T_world_camera, np.nan),
    )
    still = replace(
        arm,
        v_camera=np.full_like(arm.v_camera, np.nan),
        manipulability=np.full_like(arm.manipulability, np.nan),
        penalty=np.full_like(arm.penalty, np.nan),
    )
    assert error_chart(blind) is None
    assert paths_chart(recording.info.cameras["wrist"], blind) is None
    assert camera_chart(blind) is None
    assert target_chart(replace(blind, T_world_target=blind.T_world_camera), None) is None
    assert twist_chart(still) is None
    assert measures_chart(still) is None


def test_many_features_are_summed_up(recording: Recording) -> None:
    camera = recording.cameras["wrist"]
    crowd = replace(
        camera,
        points_px=np.tile(camera.points_px, (1, 5, 1)),
        desired_px=np.tile(camera.desired_px, (1, 5, 1)),
        true_px=np.tile(camera.true_px, (1, 5, 1)),
        found=np.tile(camera.found, (1, 5)),
    )
    made = error_chart(crowd)
    assert made is not None
    assert [curve.label for curve in made.panels[0].curves] == ["largest of 20", "median"]


def test_every_colour_of_a_figure_has_a_counterpart_on_a_dark_system() -> None:
    drawn, axes = figure(4.0, 3.0)
    for index, color in enumerate(COLORS):
        axes[0].plot([0.0, 1.0], [0.0, index], color=color, label=str(index))
    axes[0].axhspan(2.0, 3.0, color=LIMIT, alpha=0.1)
    legend(axes[0])
    drawing = svg(drawn).decode()
    used = set(re.findall(r"(?:fill|stroke): (#[0-9a-f]{6})", drawing.partition("</style>")[2]))
    assert len(used) > len(COLORS)
    assert used <= set(DARK)
    for light in used:
        assert f'[style*="fill: {light}"]{{fill:{DARK[light]}!important}}' in drawing


def test_a_legend_names_what_only_one_of_several_axes_draws_and_everything_once() -> None:
    _, (upper, lower) = figure(4.0, 3.0, rows=2)
    for axes, label in ((upper, "arrived"), (upper, "lost"), (lower, "arrived")):
        axes.plot([0.0, 1.0], [0.0, 1.0], label=label)
    legend(lower, upper)
    shown = lower.get_legend()
    assert shown is not None
    assert [text.get_text() for text in shown.get_texts()] == ["arrived", "lost"]


@pytest.mark.parametrize("span", [(0.4, 3.0), (11.0, 47.0), (1e-3, 90.0)])
def test_a_logarithmic_axis_names_more_than_one_of_its_values(span: tuple[float, float]) -> None:
    drawn, (axes,) = figure(7.0, 2.0)
    logarithmic(axes, "x")
    axes.plot(span, (0.0, 1.0))
    drawn.draw_without_rendering()
    low, high = axes.get_xlim()
    ticks = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
    named = [label.get_text() for place, label in ticks if low <= place <= high]
    assert len(named) > 1
    assert all(named)


@pytest.mark.parametrize("size_m", [(1.2, 0.8, 1.2), (0.2, 0.2, 0.4), (0.1, 0.1, 1.0), (1, 1, 0.1)])
def test_a_path_in_space_lies_in_its_figure_with_all_names(
    size_m: tuple[float, float, float],
) -> None:
    width, depth, height = size_m
    T = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (10, 1, 1))
    T[:, :3, 3] = np.linspace((0.0, 0.0, height), (width / 2, depth / 2, 0.8 * height), 10)
    object_m = np.array([[0.0, 0, 0], [width, 0, 0], [width, depth, 0], [0, depth, 0]])
    drawn, axes = space(8.6, 5.4)
    camera_paths(axes, [("camera", T)], object_m)
    axes.view_init(elev=22, azim=-60)
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    renderer = canvas.get_renderer()
    boxes = [axis.get_tightbbox(renderer) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    assert all(box is not None for box in boxes)
    assert all(drawn.bbox.contains(*corner) for box in boxes for corner in box.corners())
