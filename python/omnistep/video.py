"""Videos and pictures of logged runs."""

import contextlib
import importlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Log, read_mcap
from omnistep._output_files import check_output, replaced
from omnistep.errors import VideoError

#: Time limit for the viewer to start, and to end after a failure [s].
_START_S, _END_S = 60.0, 10.0
#: Opening of Rerun's eye, from below to above [rad], its view's width over its height, and room around what is seen.
_OPENING_RAD, _ASPECT, _ROOM = np.deg2rad(55.0), 1.7, 1.15
#: Messages of the viewer on a machine without usable graphics.
_NO_RENDERER = ("render context", "graphics adapter")
#: Rerun's name for the times of a log's messages.
_TIMELINE = "message_log_time"


def write(path: str | PathLike[str], out: str | PathLike[str], *, fps: float = 10.0, at_s: float | None = None) -> None:
    """Make a video or a picture of a logged run with Rerun, without a window.

    Rerun reads the log itself. On a machine without a graphics card it needs a software renderer of Vulkan (Debian's
    ``mesa-vulkan-drivers``), and then needs about half a second per picture. A picture shows the vehicle, a video its
    whole path.

    Args:
        path: an MCAP log.
        out: the video: mp4 or gif, or one picture: png.
        fps: pictures per second of the run, and of the video; up to 50, the rate of the poses in the log.
        at_s: the time of a png [s]; the middle of the run by default.

    Raises:
        LogError: the log cannot be read.
        ValueError: another file name extension, a rate outside 0 to 50, or a time outside the run.
        VideoError: the viewer did not start, or ended early.
        ImportError: Rerun is not installed; install the extra ``view``.
    """
    out = Path(out)
    if out.suffix not in (".mp4", ".gif", ".png"):
        raise ValueError(f"out = {out.name}, allowed: a name that ends with .mp4, .gif or .png")
    check_output(out, [Path(path)])
    if not 0.0 < fps <= 50.0:
        raise ValueError(f"fps = {fps}, allowed: more than 0, up to 50")
    log = read_mcap(path)
    times = log.frame_time_s
    if len(times) == 0:
        raise ValueError(f"{log.path}: no messages on /tf, allowed: a run with poses")
    if at_s is not None and not times[0] <= at_s <= times[-1]:
        raise ValueError(f"at_s = {at_s}, allowed: {times[0]:g} to {times[-1]:g} [s]")
    if out.suffix == ".png":
        moments = [float(times[len(times) // 2]) if at_s is None else at_s]
    else:
        moments = np.arange(times[0], times[-1], 1.0 / fps).tolist()
    with tempfile.TemporaryDirectory() as folder:
        pictures = list(_shots(log, moments, Path(folder)))
        with replaced(out, [Path(path)]) as aside:
            if out.suffix == ".png":
                aside.write_bytes(pictures[0].read_bytes())
            else:
                _joined(pictures, aside, fps)


def _shots(log: Log, moments: Sequence[float], folder: Path) -> Iterator[Path]:
    """Yield one picture for each time."""
    rr, rrb = _extra("rerun"), _extra("rerun.blueprint")
    position, target = _eye(log, moments)
    eye = rrb.EyeControls3D(position=position.tolist(), look_target=target.tolist(), eye_up=[0.0, 0.0, 1.0])
    view = rrb.Spatial3DView(
        origin="/",
        contents=["+ /**", "- /**/collision_geometries/**"],
        name="vehicle",
        eye_controls=eye,
        line_grid=rrb.LineGrid3D(visible=False),
    )
    # The viewer's own notices come up at the right: an empty view is there, and not on the picture.
    beside = rrb.TextDocumentView(origin="/nothing")
    layout = rrb.Blueprint(rrb.Horizontal(view, beside, column_shares=[4, 1.3]), collapse_panels=True)
    with _viewer() as client:
        recording = rr.RecordingStream("omnistep video")
        try:
            recording.connect_grpc(client.url)
            rr.send_blueprint(layout, recording=recording)
            recording.log_file_from_path(log.path)
            recording.flush()
            shown = _loaded(client, float(log.frame_time_s[-1]))
            for number, moment in enumerate(moments):
                picture = folder / f"{number:06}.png"
                client.set_time(_TIMELINE, timestamp=moment, play_state="paused")
                client.save_screenshot(str(picture), view_id=shown)
                yield picture
        finally:
            with contextlib.suppress(Exception):  # of a viewer that has gone
                recording.disconnect()


def _eye(log: Log, moments: Sequence[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the camera's position and target [m]: the vehicle at these times fills the picture."""
    times, reach = log.frame_time_s, float(log.trace.wheel_radius_m.max())
    rows = np.unique(np.clip(np.searchsorted(times, moments), 0, len(times) - 1))
    places = np.concatenate([poses[rows, :3] for poses in log.frames.values()])
    near, far = places.min(axis=0) - reach, places.max(axis=0) + reach
    # From the right and above: away from the scene, along the picture's lower edge, along its left edge.
    away = np.array([-0.25, -1.0, 0.5]) / np.linalg.norm([-0.25, -1.0, 0.5])
    across = np.cross([0.0, 0.0, 1.0], away) / np.linalg.norm(np.cross([0.0, 0.0, 1.0], away))
    up = np.cross(away, across)
    target = (near + far) / 2.0
    corners = np.array([[x, y, z] for x in (near[0], far[0]) for y in (near[1], far[1]) for z in (near[2], far[2])])
    corners -= target
    # A corner is in the picture if its distance from the middle is at most the opening's share of its depth.
    openings = (_ASPECT * np.tan(_OPENING_RAD / 2.0), np.tan(_OPENING_RAD / 2.0))
    needs = [
        corners @ away + np.abs(corners @ axis) / opening for axis, opening in zip((across, up), openings, strict=True)
    ]
    return target + _ROOM * float(np.max(needs)) * away, target


def _extra(module: str) -> Any:
    """Import a package of the extra ``view``."""
    # Rerun's own lines on standard error are about its connection; omnistep itself reports a failure, once. It reads
    # this when it is imported.
    own = "RUST_LOG" in os.environ
    os.environ.setdefault("RUST_LOG", "off")
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f'omnistep video needs {module}: pip install "omnistep[view]"') from error
    finally:
        if not own:
            del os.environ["RUST_LOG"]


def _loaded(client: Any, until_s: float) -> Any:
    """Wait until the viewer has the whole log, and return the name of its view of the vehicle."""
    late = time.monotonic() + _START_S
    while time.monotonic() < late:
        state = client.get_state()
        views = [view.view_id for view in state.views if view.view_class == "3D"]
        ends = [line.end for one in state.recordings for line in one.timelines if line.name == _TIMELINE]
        # The last logged message, not later than half a period of the poses before the end.
        if views and ends and max(ends) >= 1e9 * until_s - 2e7:
            return views[0]
        time.sleep(0.1)
    raise VideoError(f"Rerun's viewer did not read the log within {_START_S:g} s")


@contextmanager
def _viewer() -> Iterator[Any]:
    """Start Rerun's viewer without a window, on 127.0.0.1, and end it afterwards."""
    client_of = _extra("rerun.experimental").ViewerClient.connect
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    program = shutil.which(
        "rerun", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    )
    if program is None:
        raise ImportError('omnistep video needs Rerun\'s viewer: pip install "omnistep[view]"')
    command = [program, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    command += ["--window-size", "1700x760"]
    quiet = dict(os.environ, RERUN_ANALYTICS="0", DO_NOT_TRACK="1", RERUN_APP_ONLY="true")
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            command, env=quiet, stdout=subprocess.DEVNULL, stderr=said, text=True, start_new_session=True
        )
        try:
            yield _answering(process, client_of, f"rerun+http://127.0.0.1:{port}/proxy")
        except VideoError:
            raise
        except Exception as error:
            # Whichever error its client raises about a viewer that has ended: the reason is the viewer's end.
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_END_S)
            if process.poll() is None:
                raise VideoError(f"Rerun's viewer did not answer: {' '.join(str(error).split())[:200]}") from error
            raise VideoError(_why_ended(said)) from error
        finally:
            _end(process)


def _why_ended(said: Any) -> str:
    """Return the message for a viewer that has ended, from its output."""
    said.seek(0)
    text = said.read()
    if any(sign in text for sign in _NO_RENDERER):
        return (
            "Rerun's viewer cannot draw: it needs a graphics card with Vulkan, or a software renderer "
            "of Vulkan (Debian: apt install mesa-vulkan-drivers)"
        )
    reasons = [line.strip() for line in text.splitlines() if "panicked" in line or "rror" in line]
    reason = reasons[0] if reasons else "no reason given"
    return f"Rerun's viewer ended: {reason[:200]}"


def _answering(process: subprocess.Popen[str], client_of: Any, address: str) -> Any:
    """Return a client of the viewer as soon as it responds."""
    late = time.monotonic() + _START_S
    while True:
        if process.poll() is not None:
            raise RuntimeError("ended before it answered")
        try:
            client = client_of(address)
            client.get_state()
            return client
        except Exception as error:
            if time.monotonic() > late:
                raise VideoError(f"Rerun's viewer did not start within {_START_S:g} s: {error}") from error
            time.sleep(0.2)


def _end(process: subprocess.Popen[str]) -> None:
    """End the viewer: the program is a script that starts another one, so end both."""
    with contextlib.suppress(ProcessLookupError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGTERM)
        else:
            process.terminate()
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _joined(pictures: Sequence[Path], out: Path, fps: float) -> None:
    """Make a video of pictures."""
    iio = _extra("imageio.v3")
    frames = np.stack([iio.imread(picture)[:, :, :3] for picture in pictures])
    frames = frames[:, : frames.shape[1] // 2 * 2, : frames.shape[2] // 2 * 2]  # mp4 has pairs of rows and columns
    if out.suffix == ".gif":
        iio.imwrite(out, frames, duration=1000.0 / fps, loop=0)
    else:
        iio.imwrite(out, frames, fps=fps, codec="libx264", macro_block_size=2)
