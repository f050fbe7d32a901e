"""What a later run of ``skarxlag watch`` goes on from."""

from pathlib import Path
from typing import Any

from ..monitoring import load_monitor_state, save_monitor_state
from .errors import CommandError, printable
from .models import model_digest


class WatchState:
    """The file of ``--state``: the monitor, the place in its source, and what both belong to.

    Parameters
    ----------
    path : Path or None
        The file; None where nothing is kept.
    source : str
        As the user named it.
    models : list of Path
        Diagnoser and, where there is one, detector.
    """

    def __init__(self, path: Path | None, source: str, models: list[Path]) -> None:
        self.path = path
        self._facts = {
            "source": source if source == "-" else str(Path(source).resolve()),
            "models": [model_digest(each) for each in models],
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
                found = f"of source {facts[name]!r}, expected {own!r}"
                if name == "models":
                    found = "of another model or detector, although they may know the same"
                raise CommandError(
                    printable(f"{self.path}: a state {found}; name another --state or delete it")
                )
        place = facts.get("place")
        is_pair = isinstance(place, list) and len(place) == 2 and isinstance(place[0], int)
        if place is not None and not is_pair:
            raise CommandError(f"{printable(self.path)}: place {place!r}, expected two values")
        monitor.restore(state)
        return place

    def save(self, monitor: Any, place: Any) -> None:
        """Write the file, if one is kept."""
        if self.path is not None:
            save_monitor_state(monitor, self.path, place=place, **self._facts)
