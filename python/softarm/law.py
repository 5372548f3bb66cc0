"""A control law of one's own, the same class in simulation and live.

    class OwnLaw:
        def __init__(self, experiment): ...
        def compute(self, state): return force    # (2n,), N m: generalized force in u

Where segments stretch the state is (u_x, u_y, e) of every segment and the force has 3n numbers, every third in N.
`state` is a softarm.LawState. A law may also have

    gives = "pressures"     # then compute returns set points of all chambers, (chambers,), bar
    validity_s = 0.05       # how long an answer may be held without a newer one
    def reset(self): ...    # the arm becomes ACTIVE

In simulation, in lock step and deterministic: `softarm run --law own_law.py:OwnLaw CONFIG`, or
softarm.run(experiment, duration_s, law=OwnLaw(experiment)). Live, beside a softarmd whose experiment has
`control: {law: external}`:

    softarm law own_law.py:OwnLaw CONFIG

The daemon keeps frames, safety and limits. Where the law falls silent or raises, it holds and then vents.
"""

import argparse
import importlib
import importlib.util
import pathlib
import socket
import sys
import time

import numpy as np

import softarm
from softarm import _core


class NoLaw(ValueError):
    """What was named or given is no law: a message for a person, without the place in the code."""


class Answers:
    """Asks a law and checks what it gives: state -> (values, whether these are pressures, validity in s)."""

    def __init__(self, law, experiment):
        self._law = law
        gives = getattr(law, "gives", "force")
        if gives not in ("force", "pressures"):
            raise NoLaw(f"gives: expected 'force' or 'pressures', got {gives!r}")
        self._pressures = gives == "pressures"
        self._chambers = sum(experiment.chambers)
        self._validity_s = float(getattr(law, "validity_s", 0.05))
        self._active = False

    def __call__(self, state):
        active = state.mode == "ACTIVE"
        if active and not self._active and hasattr(self._law, "reset"):
            self._law.reset()
        self._active = active
        values = np.asarray(self._law.compute(state), dtype=float)
        size = self._chambers if self._pressures else len(state.u)
        if values.shape != (size,):
            raise ValueError(f"compute: expected {size} numbers, got an array of shape {values.shape}")
        if not np.isfinite(values).all():
            raise ValueError(f"compute: expected finite numbers, got {values}")
        return values, self._pressures, self._validity_s


def load(name):
    """The class that MODULE:CLASS or FILE.py:CLASS names."""
    where, _, what = name.rpartition(":")
    if not where or not what:
        raise NoLaw(f"law: expected MODULE:CLASS or FILE.py:CLASS, got {name!r}")
    if where.endswith(".py"):
        path = pathlib.Path(where)
        if not path.exists():
            raise NoLaw(f"{where}: no such file")
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        spec.loader.exec_module(module)
    else:
        sys.path.insert(0, "")
        try:
            module = importlib.import_module(where)
        except ModuleNotFoundError as error:
            if error.name != where:  # the module itself is there
                raise
            raise NoLaw(f"{where}: no such module") from error
    if not hasattr(module, what):
        raise NoLaw(f"{where}: expected a class {what}, found none")
    return getattr(module, what)


def answer_socket(answers, connection):
    """In lock step: one answer to each state, until the other end closes."""
    while data := connection.recv(65536):
        state = _core._decode_law_state(data)
        answer = _core._encode_law_answer(state, *answers(state))
        try:
            connection.send(answer)
        except BrokenPipeError:
            return


def answer_daemon(answers, experiment, duration_s=None):
    """Answers a running softarmd until `duration_s` have passed, or for ever. Returns the statistics of ACTIVE: a dict."""
    client = softarm.ArmClient(experiment)
    end = None if duration_s is None else time.monotonic() + duration_s
    squares, count, silent, shown = 0.0, 0, False, None
    while end is None or time.monotonic() < end:
        state = client.wait_for_law_state(0.5)
        if state is None:
            if not silent:
                print("softarm law: no state to answer: is softarmd running, with control.law: external, and its frames?",
                      file=sys.stderr, flush=True)
            silent = True
            continue
        silent = False
        client.answer_law(state, *answers(state))
        now = client.status and (client.status.mode, client.status.reason)
        if now != shown:
            shown = now
            print(f"softarm law: {now[0]}" + ("" if now[1] == "none" else f" ({now[1]})"), file=sys.stderr, flush=True)
        if state.mode == "ACTIVE":
            squares += float(np.mean((state.u_ref - state.u) ** 2))
            count += 1
    status = client.status
    return {
        "answers": count,
        "error_rms_rad": (squares / count) ** 0.5 if count else float("nan"),
        "round_trip_s": status.law_round_trip_s if status else float("nan"),
    }


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="softarm law", description="A control law for a running softarmd")
    parser.add_argument("law", help="MODULE:CLASS or FILE.py:CLASS")
    parser.add_argument("config", help="experiment in YAML, with control.law: external")
    parser.add_argument("--duration", type=float, help="s; left out: until it is ended")
    parser.add_argument("--socket", type=int, help=argparse.SUPPRESS)  # of softarm run
    options = parser.parse_args(arguments)
    try:
        experiment = softarm.load_experiment(options.config)
        answers = Answers(load(options.law)(experiment), experiment)
        if options.socket is not None:
            answer_socket(answers, socket.socket(fileno=options.socket))
            return 0
        done = answer_daemon(answers, experiment, options.duration)
    except softarm.ConfigError as error:
        print(f"softarm law: {error}", file=sys.stderr)
        return 78
    except (NoLaw, softarm.TransportError) as error:
        print(f"softarm law: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0
    print(f"{done['answers']} answers while ACTIVE, error of u {1e3 * done['error_rms_rad']:.2f} mrad rms, "
          f"newest round trip {1e3 * done['round_trip_s']:.2f} ms")
    return 0


if __name__ == "__main__":
    sys.exit(main())
