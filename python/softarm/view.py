"""The arm in a browser, live or from a recorded run: started by `softarm view`.

Needs the package viser; everything is served from this machine.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field

import numpy as np

import softarm

POINTS_PER_SEGMENT = 12
PATH_POINTS = 400
PLOT_S = 10.0
FRAME_S = 1.0 / 30.0
PLOT_EVERY_S = 0.5
SILENT_S = 1.0
MEASURED, REFERENCE, TRUTH, TIP = (31, 119, 180), (44, 160, 44), (150, 150, 150), (235, 80, 10)
EMPTY, FULL = np.array([70, 110, 200]), np.array([220, 60, 40])


@dataclass
class Picture:
    """What one instant looks like; vectors are empty, or hold NaN, where unknown."""

    t_s: float
    mode: str
    reason: str
    u: np.ndarray
    u_ref: np.ndarray
    u_true: np.ndarray
    pressure_bar: np.ndarray
    e: np.ndarray = field(default_factory=lambda: np.empty(0))  # m, where segments stretch, as all below
    e_ref: np.ndarray = field(default_factory=lambda: np.empty(0))
    e_true: np.ndarray = field(default_factory=lambda: np.empty(0))

    def error_mrad(self):
        """Reference minus estimate, largest component; NaN where there is no reference."""
        if self.u_ref.size != self.u.size or self.u.size == 0 or not np.all(np.isfinite(self.u_ref)):
            return float("nan")
        return 1e3 * float(np.max(np.abs(self.u_ref - self.u)))


def with_elongation(u, e):
    """The state that softarm.Arm takes: (u_x, u_y, e) of every segment where there are e."""
    return u if e.size == 0 or u.size != 2 * e.size else np.column_stack([u.reshape(-1, 2), e]).ravel()


def live_pictures(client, step=None):
    """Pictures of a running arm every FRAME_S, of a simulated one also without a daemon; None where all is silent for a second.

    Meanwhile it calls `step`, if there is one, at least every 5 ms: whether the arm is simulated and no daemon reports.
    """
    start_us = None
    tick, heard, plant_us, moved = -1, time.monotonic(), -1, -1e9
    while True:
        end, new = time.monotonic() + FRAME_S, False
        while (left := end - time.monotonic()) > 0.0:
            client.update(min(left, 0.005) if step else left)
            if step:
                step(end - heard > SILENT_S and end - moved < SILENT_S)
        status, plant, now = client.status, client.plant, time.monotonic()
        if status is not None and status.tick != tick:
            tick, heard, new = status.tick, now, True
        if plant is not None and plant.time_us != plant_us:
            plant_us, moved = plant.time_us, now
        pressure = client.measured_bar
        true = plant.u if plant else np.empty(0)
        e_true = plant.elongation_m if plant else np.empty(0)
        if new:
            start_us = start_us or status.time_us
            bar = status.pressure_bar if pressure is None else pressure
            yield Picture((status.time_us - start_us) / 1e6, status.mode, status.reason, status.u, status.u_ref, true, bar,
                          status.elongation_m, status.elongation_ref_m, e_true)
        elif now - heard > SILENT_S and now - moved < SILENT_S:
            start_us = start_us or plant_us
            bar = plant.pressure_bar if pressure is None else pressure
            yield Picture((plant_us - start_us) / 1e6, "NO DAEMON", "none", client.seen_u, np.empty(0), true, bar,
                          e_true=e_true)
        elif now - heard > SILENT_S:
            yield None


def read_log(path, experiment, config):
    """The rows of a run's log.csv, of the folder that holds it, or of an LCM event log."""
    path = pathlib.Path(path)
    if path.is_dir():
        path = path / "log.csv"
    if path.suffix == ".csv":
        return read_csv(path, experiment)
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(__file__).resolve().parents[2] / "bin/softarm"
        report = [program if program.exists() else "softarm", "report", path, config, "--out", folder, "--no-plots"]
        if subprocess.run(report, stdout=subprocess.DEVNULL).returncode != 0:  # and printed why
            raise ValueError(f"{path}: expected a log that softarm report takes")
        return read_csv(pathlib.Path(folder) / "log.csv", experiment)


def read_csv(path, experiment):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    if not rows:
        raise ValueError(f"{path}: expected rows of a run, found none")

    def columns(names):
        return np.array([[float(row.get(name) or "nan") for name in names] for row in rows])

    def bends(prefix):
        return columns([f"{prefix}{i + 1}_{axis}_rad" for i in range(experiment.segments) for axis in "xy"])

    def lengths(prefix):  # not there where segments do not stretch
        return columns([name for i in range(experiment.segments) if (name := f"{prefix}{i + 1}_m") in rows[0]])

    u, u_ref, u_true = bends("u"), bends("ref"), bends("true")
    e, e_ref, e_true = lengths("e"), lengths("eref"), lengths("etrue")
    pressures = columns([name for name in rows[0] if name.startswith("pm") and name.endswith("_bar")])
    return [
        Picture(float(row["t_s"]), row["mode"], row["reason"], u[k], u_ref[k], u_true[k], pressures[k], e[k], e_ref[k], e_true[k])
        for k, row in enumerate(rows)
    ]


class ByHand:
    """Sliders for the chambers of a simulated arm that no daemon commands."""

    def __init__(self, gui, experiment, say):
        self._experiment, self._say, self._client = experiment, say, None
        highest_bar = experiment.pressure_limits_bar[1]
        with gui.add_folder("pressures by hand, in bar", visible=False) as self.folder:
            self.fill = gui.add_checkbox("fill the chambers", False)
            self.sliders = [
                gui.add_slider(f"{segment + 1}.{chamber + 1}", 0.0, highest_bar, highest_bar / 100.0, 0.0)
                for segment, count in enumerate(experiment.chambers)
                for chamber in range(count)
            ]

    def step(self, may_fill):
        """Sends the set points when they are due; call it more often than every 10 ms."""
        if self._client is None:
            if self.folder.visible != may_fill:
                self.folder.visible = may_fill
            if may_fill and self.fill.value:
                self._begin()
            return
        self._client.update()
        if may_fill and self.fill.value:
            self._client.command_chambers(np.array([slider.value for slider in self.sliders]))
        else:
            self.end()

    def _begin(self):
        try:
            client = softarm.ArmClient(self._experiment)
            client.lock_commands()
            self._client = client
        except RuntimeError as error:
            self.fill.value = False
            self._say(f"pressures by hand: {error}")

    def end(self):
        """Vents, and gives the command channel back."""
        if self._client is not None:
            self._client.vent_to_rest()
        self._client = None


class View:
    """The page: one arm in 3D, its pressures, and the last PLOT_S seconds as plots."""

    def __init__(self, experiment, host, port):
        import viser

        self._arm = softarm.Arm(experiment)
        self._highest_bar = max(experiment.pressure_limits_bar[1], 1e-9)
        self._chambers = experiment.chambers
        self.server = viser.ViserServer(host=host, port=port, label=f"softarm: {experiment.name}", verbose=False)
        reach = float(np.sum(self._arm.length_m))
        self._reach = reach
        straight = self._arm.centre_line(np.zeros(self._arm.dof), POINTS_PER_SEGMENT)
        middle = straight.mean(axis=0)
        scene = self.server.scene
        scene.set_up_direction("+z")
        # Shadows and the environment map take a third of the frames where a processor draws.
        scene.configure_default_lights(cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_ambient("/light", intensity=2.0)
        self.server.initial_camera.position = middle + np.array([1.2, 1.2, 0.5]) * reach
        self.server.initial_camera.look_at = middle
        scene.add_grid("/floor", 2 * reach, 2 * reach, cell_size=reach / 10, position=(0, 0, straight[:, 2].min() - 0.1 * reach))
        scene.add_frame("/base", axes_length=0.1 * reach, axes_radius=0.004 * reach, position=straight[0])
        self._lines = {
            name: scene.add_spline_catmull_rom(
                f"/{name}", straight, color=color, thickness=width, thickness_units="screen", visible=name == "measured"
            )
            for name, color, width in (("measured", MEASURED, 8), ("reference", REFERENCE, 4), ("truth", TRUTH, 4))
        }
        self._tip = scene.add_icosphere("/tip", radius=0.03 * reach, color=TIP, position=straight[-1])
        self._path = scene.add_point_cloud("/path", np.zeros((1, 3)), (120, 120, 120), point_size=0.004 * reach)
        self._tips = []
        gui = self.server.gui
        self._text = gui.add_markdown("waiting for the arm")
        self._pressures = gui.add_html("")
        self._plots = {
            name: gui.add_uplot(
                data=(np.zeros(1), np.zeros(1)),
                series=(viser.uplot.Series(label="t in s"), viser.uplot.Series(label=label, stroke="#1f77b4", width=1)),
                scales={"x": viser.uplot.Scale(time=False, auto=True)},
                aspect=2.0,
            )
            for name, label in (("error", "largest error of u in mrad"), ("pressure", "largest pressure in bar"))
        }
        self._history = []
        self._plot_at = 0.0

    def add_control(self, client):
        """Buttons for an operator's requests; each but the emergency stop asks once more."""
        gui = self.server.gui
        self._requests = []

        def ask(what):
            with gui.add_modal(f"{what} this arm?") as modal:
                yes, no = gui.add_button("yes"), gui.add_button("no")
            yes.on_click(lambda _: (self._requests.append(what), modal.close()))
            no.on_click(lambda _: modal.close())

        gui.add_button("emergency stop", color="red").on_click(lambda _: self._requests.append("emergency_stop"))
        gui.add_button("arm").on_click(lambda _: ask("arm"))
        gui.add_button("disarm").on_click(lambda _: ask("disarm"))

        def pending():
            while self._requests:
                yield self._requests.pop(0)

        return pending

    def add_hand(self, experiment):
        """Sliders for a simulated arm, shown where no daemon reports."""
        return ByHand(self.server.gui, experiment, self.say)

    def add_player(self):
        """Pause and speed of a recorded run."""
        gui = self.server.gui
        return gui.add_checkbox("pause", False), gui.add_slider("speed", 0.1, 4.0, 0.1, 1.0)

    def tip_m(self):
        """The tip as drawn, (3,), m."""
        return np.array(self._tip.position)

    def say(self, text):
        """Replaces the line of mode and reason."""
        self._text.content = text

    def show(self, picture):
        """Draws one instant."""
        with self.server.atomic():
            for name, bend, e in (
                ("measured", picture.u, picture.e),
                ("reference", picture.u_ref, picture.e_ref),
                ("truth", picture.u_true, picture.e_true),
            ):
                u = with_elongation(bend, e)
                known = u.size == self._arm.dof and bool(np.all(np.isfinite(u)))
                self._lines[name].visible = known
                if known:
                    line = self._arm.centre_line(u, POINTS_PER_SEGMENT)
                    self._lines[name].points = line
                    if name == "measured":
                        self._tip.position = line[-1]
                        self._tips = [*self._tips[1 - PATH_POINTS :], line[-1]]
                        self._path.points = np.array(self._tips, dtype=np.float32)
            reason = "" if picture.reason == "none" else f" ({picture.reason})"
            tip = ", ".join(f"{1e3 * value:.1f}" for value in self._tip.position)
            self.say(f"**{picture.mode}**{reason}, {picture.t_s:.1f} s, tip [{tip}] mm")
            self._pressures.content = self._bars(picture.pressure_bar)
        self._history.append((picture.t_s, picture.error_mrad(), np.max(picture.pressure_bar, initial=0.0)))
        if self._history[-1][0] < self._history[0][0]:
            self._history = self._history[-1:]
        while self._history[-1][0] - self._history[0][0] > PLOT_S:
            self._history.pop(0)
        if time.monotonic() >= self._plot_at:
            self._plot_at = time.monotonic() + PLOT_EVERY_S
            t, error, pressure = np.array(self._history).T
            self._plots["error"].data = (t, np.nan_to_num(error))
            self._plots["pressure"].data = (t, np.nan_to_num(pressure))

    def _bars(self, pressure_bar):
        cells = []
        first = 0
        for count in self._chambers:
            row = []
            for value in pressure_bar[first : first + count]:
                share = float(np.clip(value / self._highest_bar, 0.0, 1.0)) if np.isfinite(value) else 0.0
                r, g, b = (EMPTY + share * (FULL - EMPTY)).astype(int)
                row.append(f'<td style="background:rgb({r},{g},{b});color:white;padding:2px 6px">{value:.2f}</td>')
            cells.append("<tr>" + "".join(row) + "</tr>")
            first += count
        return '<table style="margin:0.5em"><caption>chambers in bar, base first</caption>' + "".join(cells) + "</table>"


def play(view, pictures):
    pause, speed = view.add_player()
    shown = None
    while True:
        t_s = pictures[0].t_s
        index = 0
        while index < len(pictures):
            if pictures[index] is not shown:  # a picture once, however long the pause
                shown = pictures[index]
                view.show(shown)
            time.sleep(FRAME_S)
            if not pause.value:
                t_s += FRAME_S * speed.value
                while index < len(pictures) and pictures[index].t_s < t_s:
                    index += 1


def main(config, log, host, port, control):
    """Serve the page until interrupted; `softarm view --help` has the options. Returns the exit code."""
    try:
        experiment = softarm.load_experiment(config)
        pictures = read_log(log, experiment, config) if log else None
        client = None if log else softarm.ArmClient(experiment)
        view = View(experiment, host, port)
    except ImportError as error:
        print(f"softarm view: {error}; tools/python_environment installs viser", file=sys.stderr)
        return 69
    except softarm.ConfigError as error:
        print(f"softarm view: {error}", file=sys.stderr)
        return 78
    except (OSError, ValueError, softarm.TransportError) as error:
        print(f"softarm view: {error}", file=sys.stderr)
        return 1
    print(f"softarm view: http://{host}:{view.server.get_port()} (Ctrl-C ends it)", flush=True)
    hand = None
    try:
        if pictures:
            play(view, pictures)
        pending = view.add_control(client) if control else tuple
        hand = view.add_hand(experiment) if control else None
        for picture in live_pictures(client, hand.step if hand else None):
            for request in pending():
                view.say(f"{request}: {client.request(request)}")
            if picture is None:
                view.say("no status: is softarmd running on this network?")
            else:
                view.show(picture)
    except KeyboardInterrupt:
        return 0
    finally:
        if hand:
            hand.end()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4], int(sys.argv[4]), sys.argv[5] == "control"))
