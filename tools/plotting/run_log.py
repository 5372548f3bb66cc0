"""One run, read from its files: log.csv (columns by name, empty cells are NaN), summary.json and timing.json."""
import csv
import json
import pathlib
import re

import numpy as np

THETA_FOR_PHI_RAD = 0.05  # below it the bending plane, and phi with it, is undefined


def wrapped(angle_rad):
    return (angle_rad + np.pi) % (2 * np.pi) - np.pi


def _number(cell):
    return float(cell) if cell else np.nan


def _read_json(path):
    return json.loads(path.read_text(encoding="utf-8", errors="replace")) if path.exists() else {}


class RunLog:
    """Columns of a log, by kind; arrays are (rows,) or (rows, n, 2), and None where the log has no such column."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        # A name in another encoding (logs of earlier versions) is no reason to draw nothing.
        with open(self.directory / "log.csv", newline="", encoding="utf-8", errors="replace") as file:
            lines = file.read().splitlines()
        comments = [line.lstrip("# ") for line in lines if line.startswith("#")]
        rows = list(csv.reader(line for line in lines if line and not line.startswith("#")))
        if len(rows) < 2:
            raise ValueError(f"{self.directory / 'log.csv'}: expected a header and rows, got {len(rows)} lines")
        self.origin = " ".join(comments)
        self.names = rows[0]
        # A run that was killed may end within a line.
        cells = list(zip(*(row for row in rows[1:] if len(row) == len(self.names))))
        if not cells:
            raise ValueError(f"{self.directory / 'log.csv'}: no row has the header's {len(self.names)} cells")
        self._text = dict(zip(self.names, cells))
        self._cache = {}
        self.summary = _read_json(self.directory / "summary.json")
        self.timing = _read_json(self.directory / "timing.json")
        self.torques = "torque_nm" in self.summary  # commands are moments: what is named _bar counts N m

        self.t_s = self.column("t_s")
        self.mode = np.array(self._text.get("mode", ("",) * len(self.t_s)))
        self.reason = np.array(self._text.get("reason", ("",) * len(self.t_s)))
        self.segments = sum(re.fullmatch(r"u\d+_x_rad", name) is not None for name in self.names)
        self.u = self._pairs("u{}_{}_rad")
        self.velocity = self._pairs("v{}_{}_radps")
        self.reference = self._pairs("ref{}_{}_rad")
        self.true_u = self._pairs("true{}_{}_rad")
        self.twist_rad = self._per_segment("twist{}_rad")
        self.length_m = self._per_segment("length{}_m")
        # Of arms that stretch.
        self.elongation_m = self._per_segment("e{}_m")
        self.reference_elongation_m = self._per_segment("eref{}_m")
        self.true_elongation_m = self._per_segment("etrue{}_m")
        self.tip_m = self._point("tip_{}_m")
        self.tip_reference_m = self._point("tipref_{}_m")

    def column(self, name):
        """The column as numbers, or None where it is absent or empty."""
        if name not in self._cache:
            values = None
            if name in self._text:
                values = np.array([_number(cell) for cell in self._text[name]])
                if np.all(np.isnan(values)):
                    values = None
            self._cache[name] = values
        return self._cache[name]

    def _stack(self, names):
        columns = [self.column(name) for name in names]
        if all(column is None for column in columns):
            return None
        return np.stack([np.full(len(self.t_s), np.nan) if c is None else c for c in columns], axis=-1)

    def _pairs(self, pattern):
        stacked = self._stack([pattern.format(i, axis) for i in range(1, self.segments + 1) for axis in "xy"])
        return None if stacked is None else stacked.reshape(len(self.t_s), self.segments, 2)

    def _per_segment(self, pattern):
        return self._stack([pattern.format(i) for i in range(1, self.segments + 1)])

    def _point(self, pattern):
        return self._stack([pattern.format(axis) for axis in "xyz"])

    def pressures(self, prefix, segment):
        """Chamber pressures of a segment (counted from 1) in bar, prefix p (commanded) or pm (real or measured)."""
        chambers = [n for n in self.names if re.fullmatch(rf"{prefix}{segment}_\d+_bar", n)]
        return self._stack(chambers) if chambers else None

    @property
    def best_u(self):
        """u of the arm: the true one where the log has it, else the estimate."""
        return self.u if self.true_u is None else self.true_u

    def error(self):
        """Reference minus true u (or the estimate), (rows, n, 2) in rad; None without a reference."""
        return None if self.reference is None or self.best_u is None else self.reference - self.best_u

    def polar(self, u):
        """theta and phi of u, (rows, n); phi is NaN near the straight posture, where it does not exist."""
        theta = np.hypot(u[..., 0], u[..., 1])
        phi = np.where(theta > THETA_FOR_PHI_RAD, np.arctan2(u[..., 1], u[..., 0]), np.nan)
        return theta, phi

    def mode_spans(self):
        """(mode, reason, start_s, end_s) of every period of one mode."""
        changes = np.flatnonzero(self.mode[1:] != self.mode[:-1]) + 1
        starts = np.concatenate(([0], changes))
        ends = np.concatenate((changes, [len(self.t_s) - 1]))
        return [(self.mode[a], self.reason[a], self.t_s[a], self.t_s[b]) for a, b in zip(starts, ends)]

    def tracking_rows(self, from_s):
        """Rows that count for tracking errors: ACTIVE, from `from_s` after control first became ACTIVE."""
        active = self.mode == "ACTIVE"
        if not active.any():
            return active
        return active & (self.t_s >= self.t_s[np.argmax(active)] + from_s)

    def tracking(self, from_s):
        """Per segment, over the tracking rows: (u rms, u max, theta rms, phi rms) in rad; None without a reference."""
        error = self.error()
        rows = self.tracking_rows(from_s)
        if error is None or not rows.any():
            return None
        theta, phi = self.polar(self.best_u[rows])
        theta_reference, phi_reference = self.polar(self.reference[rows])

        def rms(values, axis):
            counts = np.sum(np.isfinite(values), axis=axis)
            return np.sqrt(np.nansum(values**2, axis=axis) / np.where(counts > 0, counts, np.nan))

        error = error[rows]
        largest = np.where(np.isnan(error), -np.inf, np.abs(error)).max(axis=(0, 2))
        return np.stack([rms(error, (0, 2)), np.where(np.isfinite(largest), largest, np.nan),
                         rms(theta_reference - theta, 0), rms(wrapped(phi_reference - phi), 0)], axis=-1)


class ShapeLog:
    """The simulated arm's shape, from shape.csv: bends (rows, parts, 2) in rad and points (rows, points, 3) in m."""

    _known = {}

    def __init__(self, path):
        with open(path, encoding="utf-8", errors="replace") as file:
            lines = [line for line in file.read().splitlines() if line and not line.startswith("#")]
        names = lines[0].split(",")
        rows = [line.split(",") for line in lines[1:]]
        values = np.array([[_number(cell) for cell in row] for row in rows if len(row) == len(names)])
        bends = [name.startswith("bend") for name in names]
        points = [name.startswith("point") for name in names]
        self.t_s = values[:, 0]
        self.bends = values[:, bends].reshape(len(values), -1, 2)
        self.points = values[:, points].reshape(len(values), -1, 3)
        self.parts = self.bends.shape[1]

    @classmethod
    def of(cls, log):
        """The shape beside a log, None where there is none."""
        path = log.directory / "shape.csv"
        if path not in cls._known:
            cls._known[path] = cls(path) if path.exists() and path.stat().st_size > 0 else None
        return cls._known[path]
