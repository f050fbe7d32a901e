"""Tasks for worker processes, in a module that they import quickly."""

import os
import signal
from pathlib import Path

#: On Windows any other signal ends a process like this.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


class Deadly:
    """Ends the process that runs it, each time or the first time only."""

    def __init__(self, flag=None):
        self.flag = flag

    def __call__(self):
        if self.flag is None or not Path(self.flag).exists():
            if self.flag is not None:
                Path(self.flag).touch()
            os.kill(os.getpid(), KILL)
        return "survived"


class Harmless:
    def __init__(self, value):
        self.value = value

    def __call__(self):
        return self.value


class DiesWhileSending:
    """Result that ends the process which writes it to the parent."""

    def __reduce__(self):
        if os.getpid() != self.home:
            os.kill(os.getpid(), KILL)
        return DiesWhileSending, (self.home,)

    def __init__(self, home):
        self.home = home
