"""Good recordings of real rigs, and of a simulated bearing for up to ten minutes."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.recipe.rigs import Recording, Rig, real_rigs
from skarxlag.datasets import simulate_rig
from skarxlag.datasets.rig import DEFAULT_RIG
from skarxlag.datasets.transmission import DEFAULT_PATHS, TransmissionPaths

#: Snapshots at the start of a run to failure that are taken for good.
_N_EARLY = 20
#: Least speed, relative to the highest one, at which the machine of the acoustic
#: emission runs.
_RUNNING = 0.5
#: Rate of the simulated sensor in Hz, and seconds that are simulated in one piece.
SIMULATED_RATE = 25_600
_PIECE = 60
#: Factor by which its natural frequencies are lower than those of the default rig.
_LOWER = 10


def _mfpt(folder):
    recordings = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as content:
            samples = content["acceleration"].astype(float)
            rate = float(content["sampling_rate"])
            rpm = float(content["rpm"])
        recordings.append(Recording(samples, path.stem, rpm))
    return Rig("MFPT", rate, recordings)


def _paderborn(folder):
    recordings = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as content:
            rate = float(content["sampling_rate"])
            for samples, rpm in zip(content["signal"], content["rpm"], strict=True):
                recordings.append(
                    Recording(samples.astype(float), path.stem, float(rpm))
                )
    return Rig("Paderborn", rate, recordings)


def _femto(folder):
    recordings = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as content:
            rate = float(content["sampling_rate"])
            rpm = float(content["rpm"])
            for snapshot in content["acceleration_g"][:_N_EARLY]:
                recordings += [
                    Recording(each.astype(float), path.stem, rpm) for each in snapshot
                ]
    return Rig("FEMTO", rate, recordings)


def _vallen(folder):
    with np.load(next(folder.glob("*.npz"))) as content:
        rate = float(content["fs"])
        samples = content["ae_volt"].astype(float)
        seconds = content["rpm_channel_time_s"]
        speed = content["rpm_channel_mV"]
    running = seconds[speed >= _RUNNING * speed.max()]
    samples = samples[int(running[0] * rate) : int(running[-1] * rate)]
    # Its speed varies, so it is not stated.
    return Rig("Vallen AE", rate, [Recording(samples, "unlabelled", np.nan)])


_FURTHER = {
    "mfpt": _mfpt,
    "paderborn": _paderborn,
    "femto": _femto,
    "vallen_ae": _vallen,
}


def all_rigs(home=None):
    """Yield all real rigs in a folder, each with all its recordings in memory."""
    home = Path(home or os.environ["SKARXLAG_DATA"])
    yield from real_rigs(home=home)
    for folder, read in _FURTHER.items():
        if (home / folder).is_dir():
            yield read(home / folder)


def simulated_rig(seconds, rpm=1500.0):
    """Return a recording of a simulated bearing 6205 with an outer race fault, at 25.6 kHz."""
    # The modes of the default rig lie above half this rate.
    paths = {
        source: replace(path, frequencies=tuple(f / _LOWER for f in path.frequencies))
        for source, path in vars(DEFAULT_PATHS).items()
    }
    facts = {
        "sampling_rate": float(SIMULATED_RATE),
        "paths": TransmissionPaths(**paths),
    }
    parameters = replace(DEFAULT_RIG, **facts, torque_leak=())
    pieces = []
    for start in range(0, seconds, _PIECE):
        n_samples = SIMULATED_RATE * min(_PIECE, seconds - start)
        rig = simulate_rig(
            rpm=rpm,
            crack_mm=1,
            conditions="OR",
            n_samples=n_samples,
            window_length=n_samples,
            rig=parameters,
            random_state=start,
        )
        pieces.append(rig.data[0, 0].astype(np.float32))
    recordings = [Recording(np.concatenate(pieces), "OR", rpm)]
    return Rig(f"simulated, {seconds} s", float(SIMULATED_RATE), recordings)
