"""What `vergence watch` is made of, each part by itself."""

import http.client
import json
import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from vergence.app.watch.camera_view import CameraView
from vergence.app.watch.commands import Command, Pause, parse
from vergence.app.watch.drag import Drag, TargetDrag
from vergence.app.watch.inbox import Inbox
from vergence.app.watch.knobs import knobs, law_choices
from vergence.app.watch.limits_now import LimitsNow
from vergence.app.watch.moved_target import MovedTarget
from vergence.app.watch.pace import Pace
from vergence.app.watch.plots import drawn_errors, live_plots
from vergence.app.watch.protocol import Request
from vergence.app.watch.rate_limit import RateLimit
from vergence.app.watch.server import Server, listen
from vergence.app.watch.view_state import Reader, ViewState
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.cell import built_in_cells, load_cell
from vergence.errors import InputError
from vergence.geometry import se3, so3_exp
from vergence.runtime import ArmInfo

TURNED = so3_exp(np.array([0.3, -0.2, 0.5]))


def own_motion(time: float) -> Any:
    return se3(np.eye(3), np.array([0.1 * time, 0.0, 0.2]))


class TestDrag:
    DRAG = Drag(
        se3(TURNED, np.array([1.0, 2.0, 3.0])),
        0.8,
        (0.1, -0.05),
        np.array([0.0, 0.1, 0]),
        np.array([0.2, 0.0, 0.0]),
    )

    def test_a_mouse_that_rests_moves_nothing(self) -> None:
        np.testing.assert_allclose(self.DRAG.shift(0.1, -0.05, False), [0.0, 0.1, 0.0])

    def test_the_thing_stays_under_the_mouse(self) -> None:
        shift = self.DRAG.shift(0.3, 0.1, False) - [0.0, 0.1, 0.0]
        before = 0.8 * np.array([0.1, -0.05, 1.0])
        after = before + TURNED.T @ shift
        np.testing.assert_allclose(after / after[2], [0.3, 0.1, 1.0])

    def test_along_the_axis_up_is_away(self) -> None:
        shift = self.DRAG.shift(0.3, -0.15, True) - [0.0, 0.1, 0.0]
        np.testing.assert_allclose(TURNED.T @ shift, [0.0, 0.0, 0.08], atol=1e-12)

    def test_turning_the_near_side_follows_the_mouse(self) -> None:
        np.testing.assert_allclose(self.DRAG.turn(0.1, -0.05, False), [0.2, 0.0, 0.0])
        before = so3_exp(np.array([0.2, 0.0, 0.0]))
        turned = so3_exp(self.DRAG.turn(0.12, -0.04, False)) @ before.T
        near = TURNED @ np.array([0.0, 0.0, -0.05])  # of the target's origin
        dx, dy, _ = TURNED.T @ (turned @ near - near)
        np.testing.assert_allclose([dx / dy, dx > 0.0], [2.0, 1.0], rtol=0.05)

    def test_turning_about_the_axis_keeps_it(self) -> None:
        before = so3_exp(np.array([0.2, 0.0, 0.0]))
        turned = so3_exp(self.DRAG.turn(0.3, 0.0, True)) @ before.T
        axis = TURNED[:, 2]
        np.testing.assert_allclose(turned @ axis, axis, atol=1e-12)


class TestTargetDrag:
    def test_a_key_pressed_in_the_middle_of_a_drag_moves_nothing_by_itself(self) -> None:
        target = MovedTarget(own_motion)
        world = SimpleNamespace(target_pose=lambda: own_motion(0.0))
        driver: Any = SimpleNamespace(target=target, world=world, cameras={})
        drag = TargetDrag(driver, ViewState())
        drag.grab("", 0.0, 0.0, ViewerCamera.around(np.zeros(3), 2.0, 90.0, -20.0, 45.0))
        drag.move("", 0.3, 0.1, False, False)
        shift = target.shift_m
        drag.move("", 0.3, 0.1, False, True)
        np.testing.assert_array_equal(target.turn_rad, np.zeros(3))
        drag.move("", 0.4, 0.1, False, True)
        turn = target.turn_rad
        assert np.linalg.norm(turn) == pytest.approx(0.3)
        drag.move("", 0.4, 0.1, False, False)
        np.testing.assert_allclose(target.shift_m, shift)
        assert drag.release() == f"by {1e3 * np.linalg.norm(shift):.0f} mm, by 17°"


class TestMovedTarget:
    def test_by_itself_it_moves_as_the_cell_says(self) -> None:
        target = MovedTarget(own_motion)
        for time in (0.0, 0.5, 2.0):
            np.testing.assert_array_equal(target.pose(time), own_motion(time))

    def test_held_it_stands_and_let_go_it_moves_on_from_there(self) -> None:
        target = MovedTarget(own_motion)
        target.pose(1.0)
        target.held = True
        np.testing.assert_array_equal(target.pose(5.0), own_motion(1.0))
        target.held = False
        np.testing.assert_allclose(target.pose(6.0), own_motion(2.0))

    def test_it_reaches_the_mouse_no_faster_than_a_tracker_can_follow(self) -> None:
        target = MovedTarget(own_motion)
        target.held = True
        target.shift_m = np.array([0.0, 0.4, 0.3])
        places = np.array([target.pose(time)[:3, 3] for time in np.arange(0.0, 4.0, 0.002)])
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= 0.3 * 0.002 + 1e-12
        np.testing.assert_allclose(places[-1], [0.0, 0.4, 0.5], atol=1e-6)

    def test_it_turns_as_far_as_the_mouse_asks_and_stays_where_it_is(self) -> None:
        target = MovedTarget(own_motion)
        target.held = True
        target.turn_rad = np.array([0.0, 0.0, 0.5])
        poses = [target.pose(time) for time in np.arange(0.0, 2.0, 0.002)]
        np.testing.assert_allclose(poses[-1][:3, :3], so3_exp(target.turn_rad), atol=1e-6)
        np.testing.assert_array_equal(poses[-1][:3, 3], own_motion(0.0)[:3, 3])


class TestPace:
    def test_time_passes_as_on_the_wall(self) -> None:
        pace = Pace()
        assert pace.delay(0.0) == 0.0
        delay = pace.delay(10.0)
        assert delay is not None
        assert 9.0 < delay <= 10.0

    def test_a_speed_divides_the_wait(self) -> None:
        pace = Pace()
        pace.set_speed(100.0)
        assert pace.delay(0.0) == 0.0
        delay = pace.delay(1000.0)
        assert delay is not None
        assert 9.0 < delay <= 10.0

    def test_what_is_late_is_not_made_up_for(self) -> None:
        pace = Pace()
        pace.set_speed(1e6)
        assert pace.delay(0.0) == 0.0
        pace.set_speed(1.0)
        assert pace.delay(500.0) == 0.0

    def test_paused_it_waits_and_a_step_passes_once(self) -> None:
        pace = Pace()
        pace.pause()
        assert pace.delay(1.0) is None
        pace.step()
        assert pace.delay(1.0) == 0.0
        assert pace.delay(2.0) is None
        pace.resume()
        assert pace.delay(2.0) == 0.0


class TestKnobs:
    def test_a_knob_has_unit_and_range(self) -> None:
        shown = {knob["key"]: knob for knob in knobs(load_cell("eye_to_hand").law)}
        assert shown["gain"]["unit"] == "1/s"
        assert (shown["gain"]["low"], shown["gain"]["high"]) == (0.0, 100.0)
        assert (shown["gain"]["low_open"], shown["gain"]["high_open"]) == (True, False)
        assert shown["interaction"]["choices"] == ["current", "desired", "mean"]

    def test_an_objective_that_only_supplements_others_is_no_law(self) -> None:
        choices = law_choices(load_cell("line"))
        assert "image_based" in choices
        assert not {"camera_velocity", "posture"} & set(choices)

    def test_only_what_acts_is_a_knob(self) -> None:
        keys = {knob["key"] for knob in knobs(load_cell("puma560").law)}
        assert {"Q", "S", "penalty_k", "solver.singular_below"} <= keys
        assert not keys & {"gain", "limits.joint_margin", "solver.S", "flow_smoothing_s"}

    def test_numbers_of_what_is_switched_off_are_no_knobs(self) -> None:
        def keys(**law: Any) -> set[str]:
            cell = load_cell("puma560").replace(law=law)
            return {knob["key"] for knob in knobs(cell.law)}

        of_avoidance = {"penalty", "measure", "penalty_k", "avoidance_speed_max_m_s"}
        assert keys() >= of_avoidance
        assert not keys(S=0.0) & of_avoidance
        assert "S" in keys(S=0.0)
        assert not keys(avoidance_axes=()) & {"S", *of_avoidance}
        program = {"kind": "quadratic_program", "S": 0.0}
        assert "solver.avoidance_rate_max" not in keys(solver=program)
        assert "solver.avoidance_rate_max" in keys(solver=program | {"S": 1.0})

    @pytest.mark.parametrize("name", built_in_cells())
    def test_every_knob_says_what_it_means(self, name: str) -> None:
        for law in load_cell(name).laws.values() or [load_cell(name).law]:
            assert all(knob["meaning"] for knob in knobs(law))

    def test_each_of_several_objectives_has_its_knobs_under_a_key_that_the_cell_file_takes(
        self,
    ) -> None:
        shown = {knob["key"]: knob for knob in knobs(load_cell("wrist_and_wall").law)}
        gain = shown["objectives.1.gain"]
        assert gain["label"] == "image based 1: gain"
        cell = load_cell("wrist_and_wall")
        changed = cell.replace(law={"objectives": {"1": {"gain": 0.5}}})
        assert changed.law == load_cell("wrist_and_wall", {"law.objectives.1.gain": "0.5"}).law
        now = {knob["key"]: knob["value"] for knob in knobs(changed.law)}
        assert now == {key: knob["value"] for key, knob in shown.items()} | {gain["key"]: 0.5}

    def test_a_weight_has_a_unit(self) -> None:
        cell = load_cell("puma560").replace(law={"solver": "quadratic_program"})
        units = {knob["key"]: knob["unit"] for knob in knobs(cell.law)}
        assert all(units[key] for key in ("Q", "R", "S", "solver.S"))

    @pytest.mark.parametrize("name", [n for n in built_in_cells() if n not in ("ur5", "panda")])
    def test_every_choice_is_a_law_that_the_cell_file_takes(self, name: str) -> None:
        cell = load_cell(name)
        for toml in law_choices(cell).values():
            changed = load_cell(name, {"law": toml})
            assert knobs(changed.law)
        first = next(iter(law_choices(cell).values()))
        assert load_cell(name, {"law": first}).law == cell.law


def test_with_two_cameras_each_plot_of_an_error_names_its_camera() -> None:
    cell = load_cell("wrist_and_wall")
    arm = ArmInfo(("joint1",), -np.ones(1), np.ones(1), np.ones(1))
    titles = [plot.title for plot in live_plots(cell, 2, arm)]
    assert titles[:2] == [f"error of the image points in {name}" for name in ("wrist", "wall")]


class TestViewState:
    def test_news_are_read_once(self) -> None:
        view_state, reader = ViewState(), Reader()
        view_state.begin({"cell": "c"})
        view_state.tick([0.0, [1.0]], [CameraView("wrist", 0.0, None)])
        view_state.event(0.0, "something", "happened")
        news = view_state.news(reader)
        assert news is not None
        assert news.about == {"cell": "c"}
        assert (len(news.rows), len(news.events), len(news.views)) == (1, 1, 1)
        assert view_state.news(reader) is None
        view_state.tick([0.1, [2.0]], [])
        news = view_state.news(reader)
        assert news is not None
        assert (news.about, news.rows, news.views) == (None, [[0.1, [2.0]]], [])

    def test_of_a_long_run_the_last_is_kept_and_told_once(self) -> None:
        view_state, reader = ViewState(), Reader()
        view_state.begin({"cell": "c"})
        told = []
        lost = []
        for number in range(9000):
            view_state.tick([number], [])
            view_state.event(number, "feature lost", "")
            if number % 100 == 99:
                news = view_state.news(reader)
                assert news is not None
                told += [row[0] for row in news.rows]
                lost += [event["time"] for event in news.events]
        assert told == lost == list(range(9000))
        late = view_state.news(Reader())
        assert late is not None
        assert 1800 <= len(late.rows) == len(late.events) <= 3600
        assert late.rows[-1] == [8999]

    def test_a_new_run_starts_afresh_for_everyone(self) -> None:
        view_state, reader = ViewState(), Reader()
        view_state.begin({"cell": "c"})
        view_state.tick([0.0, [1.0]], [])
        view_state.news(reader)
        view_state.begin({"cell": "c"})
        news = view_state.news(reader)
        assert news is not None
        assert (news.about, news.rows) == ({"cell": "c"}, [])


def test_the_viewer_camera_is_where_mujoco_has_its_camera() -> None:
    import mujoco

    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, 10)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance = (0.3, -0.2, 0.7), 2.5
    camera.azimuth, camera.elevation = 37.0, -21.0
    mujoco.mjv_updateScene(
        model, data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene
    )
    seen = [np.array(viewer_camera.pos) for viewer_camera in scene.camera]
    viewer_camera = ViewerCamera.around(camera.lookat, 2.5, 37.0, -21.0, 45.0)
    np.testing.assert_allclose(
        viewer_camera.T_world_camera[:3, 3], np.mean(seen, axis=0), atol=1e-6
    )
    np.testing.assert_allclose(
        viewer_camera.T_world_camera[:3, 2], scene.camera[0].forward, atol=1e-6
    )
    np.testing.assert_allclose(viewer_camera.T_world_camera[:3, 1], -scene.camera[0].up, atol=1e-6)


class TestCommands:
    @pytest.mark.parametrize(
        "message",
        [
            "not JSON",
            "[]",
            "{}",
            '{"do": "fly"}',
            '{"do": "speed", "value": 1e400}',
            '{"do": "speed", "value": NaN}',
            '{"do": "speed", "value": 0}',
            '{"do": "speed", "value": "1"}, {"do": "reset"}',
            '{"do": "seek", "value": -1}',
            '{"do": "seek", "value": ' + 4000 * "9" + "}",
            '{"do": "grab", "view": "wrist", "u": null, "v": 0}',
            '{"do": "move", "view": "", "u": 1e300, "v": 0, "along": false}',
            '{"do": "knob", "key": "gain", "value": [1]}',
            '{"do": "pause", "more": 1}',
            '{"do":' + 1000 * "[",
            b"\xff\xfe",
        ],
    )
    def test_what_is_no_command_is_refused_in_one_short_line(self, message: str | bytes) -> None:
        with pytest.raises(InputError) as refused:
            parse(message)
        assert len(str(refused.value)) < 600
        assert "\n" not in str(refused.value)

    def test_what_waits_is_bounded_and_the_rest_is_refused(self) -> None:
        inbox, answers = Inbox(), list[str]()
        for _ in range(1000):
            inbox.ask(Request(Pause(do="pause"), answers.append))
        assert 700 < len(answers) < 1000

    def test_what_fails_is_told_to_its_sender_and_no_further(self) -> None:
        def fail(command: Command) -> None:
            raise RuntimeError("no")

        inbox, answers = Inbox(), list[str]()
        inbox.ask(Request(Pause(do="pause"), answers.append))
        inbox.obey(fail, timeout_s=0.0)
        assert answers == ["This failed inside vergence (RuntimeError)."]

    def test_messages_faster_than_allowed_have_to_wait(self) -> None:
        now = 0.0
        limit = RateLimit(10.0, 5, lambda: now)
        assert [limit.take() for _ in range(7)] == pytest.approx([0, 0, 0, 0, 0, 0.1, 0.2])
        now = 100.0
        assert limit.take() == 0.0


class TestServer:
    asked: list[Request]

    def ask(self, request: Request) -> None:
        self.asked.append(request)

    @pytest.fixture
    def server(self) -> Iterator[Server]:
        view_state = ViewState()
        view_state.begin({"cell": "made-up"})
        self.asked = []
        server = Server(listen("127.0.0.1", 0), view_state, self.ask, None)
        yield server
        server.close()

    def get(self, server: Server, path: str, **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection("127.0.0.1", server.port)
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        answer.body = answer.read()  # type: ignore[attr-defined]
        connection.close()
        return answer

    def test_the_page_and_its_parts_are_served_and_nothing_else(self, server: Server) -> None:
        assert b"<title>vergence</title>" in self.get(server, "/").body  # type: ignore[attr-defined]
        assert (
            self.get(server, "/page/main.js").getheader("Content-Type", "").startswith("text/jav")
        )
        for path in ("/page/../command.py", "/page/none.js", "/etc/passwd", "/page/"):
            assert self.get(server, path).status == 404

    def test_pages_of_other_sites_are_turned_away(self, server: Server) -> None:
        assert self.get(server, "/", Origin="http://elsewhere.example").status == 403
        assert self.get(server, "/", Host="elsewhere.example").status == 403
        with (
            pytest.raises(InvalidStatus),
            connect(f"ws://127.0.0.1:{server.port}/live", origin="http://elsewhere.example"),
        ):
            pass

    @pytest.mark.parametrize(
        "host", ["localhost", "localhost:80", "127.0.0.1", "[::1]:1", "LocalHost"]
    )
    def test_this_machine_is_called_by_its_loopback_names(self, server: Server, host: str) -> None:
        assert self.get(server, "/", Host=host).status == 200
        assert self.get(server, "/", Host=host, Origin=f"http://{host}").status == 200

    @pytest.mark.parametrize("host", ["", "192.0.2.7", "localhost.evil.example", "evil.example:80"])
    def test_it_is_called_by_no_other(self, server: Server, host: str) -> None:
        assert self.get(server, "/", Host=host).status == 403
        assert self.get(server, "/", Host=host, Origin="null").status == 403

    def test_open_to_others_it_is_still_called_by_its_names_and_addresses_alone(self) -> None:
        server = Server(listen("0.0.0.0", 0), ViewState(), self.ask, None, "robot.example")
        try:
            for host in ("robot.example", "192.0.2.7:80", "[2001:db8::1]", socket.gethostname()):
                assert self.get(server, "/", Host=host).status == 200
            for host in ("evil.example", "192.0.2.7.evil.example"):
                assert self.get(server, "/", Host=host).status == 403
        finally:
            server.close()

    def test_a_page_is_told_and_may_ask(self, server: Server) -> None:
        origin = f"http://127.0.0.1:{server.port}"
        with connect(f"ws://127.0.0.1:{server.port}/live", origin=origin) as line:
            message = line.recv(10)
            length = int.from_bytes(message[:4], "little")
            assert json.loads(message[4 : 4 + length])["about"] == {"cell": "made-up"}
            line.send(json.dumps({"do": "pause"}))
            line.send(json.dumps({"do": "more"}))
            line.ping().wait(10)
        assert [request.command for request in self.asked] == [Pause(do="pause")]

    def test_it_listens_on_loopback_only(self, server: Server) -> None:
        assert server.address == f"http://localhost:{server.port}/"
        with pytest.raises(OSError, match=r"refused|timed out|unreachable"):
            socket.create_connection((_own_address(), server.port), timeout=2)

    def test_a_port_in_use_is_bad_input(self, server: Server) -> None:
        with pytest.raises(InputError, match="--port"):
            listen("127.0.0.1", server.port)
        assert server.only_here


@pytest.mark.parametrize("host", ["192.0.2.1", "no-such-host.invalid"])
def test_a_host_that_is_not_this_machine_is_bad_input(host: str) -> None:
    with pytest.raises(InputError, match="--host"):
        listen(host, 0)


def _own_address() -> str:
    """An address of this machine that is not loopback."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:  # no network: any address that is not ours is refused as well
            return "192.0.2.1"
        return str(probe.getsockname()[0])


def test_a_limit_is_named_while_it_acts_and_a_moment_longer() -> None:
    limits = LimitsNow()
    view = {"name": "view", "relaxed": False}
    assert limits.at(1.0, ("view",), {"view": 0.0}) == [view]
    both = [{"name": "joint margin", "relaxed": True}, view]
    assert limits.at(1.4, (), {"joint margin": 0.1}) == both
    assert limits.at(1.8, (), {}) == both[:1]
    assert limits.at(3.0, (), {}) == []
    limits.at(4.0, ("view",), {})
    assert limits.at(0.0, (), {}) == []  # begun again


def test_points_that_change_on_the_way_are_drawn_as_the_farthest_and_the_mean() -> None:
    arm = ArmInfo(("j",), np.array([-1.0]), np.array([1.0]), np.array([1.0]))
    error = live_plots(load_cell("photograph"), 0, arm)[0]
    assert (error.key, error.series) == ("error_px", ("farthest", "mean"))
    drawn = drawn_errors(np.array([1.0, np.nan, 4.0]), error)
    np.testing.assert_allclose(drawn, [4.0, 2.5])
    assert np.isnan(drawn_errors(np.array([np.nan]), error)).all()
    keys = [plot.key for plot in live_plots(load_cell("pick"), 4, arm)]
    assert keys == ["error_px", "pose_mm", "pose_deg", "target_mm", "joints", "manipulability"]
    assert live_plots(load_cell("leaf"), 48, arm)[0].series == error.series
    one = live_plots(load_cell("puma560"), 1, arm)[0]
    assert one.series == ("point 0",)
    np.testing.assert_allclose(drawn_errors(np.array([3.0]), one), [3.0])
