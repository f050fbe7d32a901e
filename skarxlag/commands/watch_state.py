"""What a later run of ``skarxlag watch`` goes on from."""

import hashlib
from pathlib import Path
from typing import Any

from ..monitoring import load_monitor_state, save_monitor_state
from .messages import CommandError, printable
from .models import model_digest

#: Bytes at the beginning of a growing file by which it is recognised.
_HEAD = 4096


class WatchState:
    """The file of ``--state``: the monitor, the place in its source, and what both belong to.

    Parameters
    ----------
    path : Path or None
        The file; None where nothing is kept.
    source : str
        As the user named it.
    model : Path
        The model.
    reading : dict
        How the source is read: channel, type of samples, column of times, sampling rate.
    """

    def __init__(
        self, path: Path | None, source: str, model: Path, reading: dict[str, Any]
    ) -> None:
        self.path = path
        self._file = Path(source) if source != "-" and Path(source).is_file() else None
        self._facts = reading | {
            "source": source if source == "-" else str(Path(source).resolve()),
            "model": model_digest(model),
        }

    def restore(self, monitor: Any) -> Any:
        """Let a monitor go on where it was, if the file is there.

        Parameters
        ----------
        monitor : ConditionMonitor
            The monitor.

        Returns
        -------
        object
            The place in the source; None for its beginning.

        Raises
        ------
        CommandError
            If the file is of another source or another model.
        ValueError
            If it holds no such state.
        """
        if self.path is None or not self.path.exists():
            return None
        state, facts = load_monitor_state(self.path)
        for name, own in self._facts.items():
            if facts.get(name, own) != own:
                found = f"of {name} {facts[name]!r}, expected {own!r}"
                if name == "model":
                    found = "of another model, although both may know the same conditions"
                raise CommandError(
                    printable(f"{self.path}: a state {found}; name another --state or delete it")
                )
        place = facts.get("place")
        is_pair = isinstance(place, list) and len(place) == 2 and isinstance(place[0], int)
        if place is not None and not is_pair:
            raise CommandError(f"{printable(self.path)}: place {place!r}, expected two values")
        monitor.restore(state)
        head = facts.get("head")
        if place is not None and self._file is not None and head != self._head(place):
            # Another file under the same name is read from its beginning.
            return [place[0], -1]
        return place

    def _head(self, place):
        """Digest of the beginning of the file, which is there before `place`."""
        with self._file.open("rb") as file:
            return hashlib.sha256(file.read(min(place[0], _HEAD))).hexdigest()

    def save(self, monitor: Any, place: Any) -> None:
        """Write the file, if one is kept."""
        if self.path is None:
            return
        facts = {"place": place}
        if self._file is not None and place is not None:
            try:
                facts["head"] = self._head(place)
            except OSError:
                # The file may be gone at the end; a later run then reads a new one.
                facts["head"] = None
        save_monitor_state(monitor, self.path, **facts, **self._facts)
