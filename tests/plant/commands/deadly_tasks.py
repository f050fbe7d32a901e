"""Tasks that end their process, in a module that processes import quickly."""

import os
import signal

#: On Windows any other signal ends a process like this.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


def die(home, flag=None):
    """End the process, unless it is that of the tests or the flag exists."""
    if os.getpid() != home and not (flag and flag.exists()):
        if flag:
            flag.touch()
        os.kill(os.getpid(), KILL)
    return "survived"


class DiesWhileSending:
    """Result that ends the process which writes it to the parent."""

    def __init__(self, home):
        self.home = home

    def __reduce__(self):
        die(self.home)
        return DiesWhileSending, (self.home,)
