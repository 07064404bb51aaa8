"""The cell in three dimensions: MuJoCo Studio's web viewer, shown the view state.

Only its renderer is used: the browser gets the compiled model once, then the world's state. It is
reached through the origin gate alone: it listens on a Unix socket.
"""

import logging
import threading
import time
import zlib
from collections import deque
from typing import Any

from vergence.app.first_view import first_view, points_in_view
from vergence.app.watch.commands import Look
from vergence.app.watch.own_process_socket import OwnProcessSocket
from vergence.app.watch.private_listener import PrivateListener
from vergence.app.watch.view_state import ViewState
from vergence.app.watch.viewer_camera import ViewerCamera
from vergence.simulation.build import under_a_sky
from vergence.simulation.world import World

_PERIOD_S = 1 / 30  # between two states, while no browser sets the pace
_STEEPEST_DEG = 89.0  # from above or below: straight down has no up
_FLAGS = [1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 1, 1]  # of MuJoCo's renderer: as its viewers begin


class Scene:
    """Serves the view on a Unix socket, in threads of its own, until it is closed.

    Args:
        world: of the cell, as it is at first.
        view_state: has the state to show from then on.

    Attributes:
        path: the socket on which it listens.
    """

    def __init__(self, world: World, view_state: ViewState) -> None:
        import mujoco
        from mujoco.studio import ux
        from mujoco.studio.web import client_camera, headless_ui, state_payload, web_server

        logging.getLogger("WebServer").setLevel(logging.WARNING)  # it writes to stdout
        logging.getLogger("asyncio").addFilter(_is_no_hang_up)
        model = under_a_sky(world.cell)
        self._model, self._view_state = model, view_state
        self._payload, self._mode = state_payload, ux.TUMBLE_CAMERA_IDX
        bundle = state_payload.serialize_model_bundle(model)
        self._crc = zlib.crc32(bundle)
        self._listener, behind = PrivateListener(), OwnProcessSocket.listening()
        self.path = self._listener.path
        self._server = web_server.WebServer(self._listener.socket, behind, mjb_data=bundle)
        # Without a user interface behind it, the viewer takes the browser for a mere spectator.
        self._interface = headless_ui.HeadlessUi("vergence", behind.getsockname()[1], "")
        self._camera = first_view(world, points_in_view(world))
        self._sync = client_camera.ClientCameraSync()
        self._looks = deque[Look]()  # asked for, to be done in the thread of the view
        self._rest: tuple[Any, ...] = (mujoco.MjvPerturb(), mujoco.MjvOption(), model, _FLAGS, [])
        self._signature = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        self._ending = threading.Event()
        # A browser that is shown nothing looks from where it likes, and soon gives the viewer up.
        view_state.state = world.state()
        self._thread = threading.Thread(target=self._show, name="scene", daemon=True)
        self._server.start()
        self._thread.start()

    @property
    def viewer_camera(self) -> ViewerCamera:
        """From where the browser looks."""
        camera = self._camera
        return ViewerCamera.around(
            camera.lookat,
            camera.distance,
            camera.azimuth,
            camera.elevation,
            float(self._model.vis.global_.fovy),
        )

    def look(self, command: Look) -> None:
        """Look from elsewhere, soon."""
        self._looks.append(command)

    def close(self) -> None:
        """Stop serving."""
        self._ending.set()
        self._server.stop()
        self._thread.join(timeout=2.0)
        self._listener.close()

    def _show(self) -> None:
        while not self._ending.is_set():
            framed = self._interface.new_frame()
            moved = self._server.take_client_camera()
            if moved is not None:
                self._sync.apply(self._camera, moved)
            while self._looks:
                self._turn(self._looks.popleft())
            self._publish()
            if framed:
                self._interface.end_frame()
            else:
                time.sleep(_PERIOD_S)

    def _turn(self, by: Look) -> None:
        camera = self._camera
        camera.azimuth += by.azimuth_deg
        elevation = camera.elevation + by.elevation_deg
        camera.elevation = min(max(elevation, -_STEEPEST_DEG), _STEEPEST_DEG)
        camera.distance /= by.zoom

    def _publish(self) -> None:
        state = self._view_state.state
        if state is None:
            return
        browser = self._payload.ViewerInputState(
            mouse_focus=True,
            camera_index=self._mode,
            keyboard_focus=False,
            camera_generation=self._sync.update_generation(self._camera),
        )
        payload = self._payload.serialize_state_payload(
            self._crc, self._signature, state.tobytes(), self._camera, *self._rest, browser
        )
        self._server.update_state(payload)


def _is_no_hang_up(record: logging.LogRecord) -> bool:
    """Whether a complaint is about anything but a browser that went away, which browsers do."""
    from websockets.exceptions import ConnectionClosed

    return record.exc_info is None or not isinstance(record.exc_info[1], ConnectionClosed)
