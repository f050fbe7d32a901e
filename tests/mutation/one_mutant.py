"""The tests of one module, run in a process of their own with an error in it."""

import importlib.abc
import importlib.util
import json
import os
import signal
import sys
import time
from collections import Counter

import pytest

#: A test without an error may take this many seconds of processor time.
_SLOWEST = 4.0
#: With an error it may take this many seconds, and this many times its usual time.
_SECONDS, _TIMES = 4.0, 8.0
#: All tests of a module together may take this many seconds.
_LONGEST = 1200.0


class _Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module with the error."""

    def __init__(self, name, program, path):
        self.name, self.program, self.path = name, program, path

    def find_spec(self, fullname, path=None, target=None):
        if fullname == self.name:
            return importlib.util.spec_from_file_location(
                fullname, self.path, loader=self
            )
        return None

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        exec(compile(self.program, self.path, "exec"), module.__dict__)


class _Course:
    """The tests in the order in which an error is found soonest, each with a limit of time."""

    def __init__(self, usual, kills):
        self.usual, self.kills = usual, kills
        self.seconds, self.failed = {}, []

    def pytest_collection_modifyitems(self, items):
        if self.usual is not None:
            items[:] = [item for item in items if item.nodeid in self.usual]
            items.sort(
                key=lambda each: (-self.kills[each.nodeid], self.usual[each.nodeid])
            )

    def pytest_runtest_setup(self, item):
        self.running = item.nodeid
        limit = (
            _SLOWEST
            if self.usual is None
            else _SECONDS + _TIMES * self.usual[item.nodeid]
        )
        signal.signal(signal.SIGPROF, self.out_of_time)
        signal.setitimer(signal.ITIMER_PROF, limit)

    def pytest_runtest_teardown(self):
        signal.setitimer(signal.ITIMER_PROF, 0)

    def pytest_runtest_logreport(self, report):
        seconds = self.seconds.get(report.nodeid, 0.0) + report.duration
        self.seconds[report.nodeid] = seconds
        if report.failed:
            self.failed.append(report.nodeid)
            if self.usual is not None:
                self.end()

    def out_of_time(self, *_):
        if self.usual is None:
            raise TimeoutError
        self.failed.append(self.running)
        self.end()

    def pytest_sessionfinish(self):
        self.end()

    def end(self):
        """Tell what was seen, without pytest's own long farewell."""
        if not self.seconds and not self.failed:
            self.failed.append("import")
        os.write(self.pipe, json.dumps([self.seconds, self.failed]).encode())
        os._exit(0)


def run_tests(name, path, program, tests, usual=None, kills=None):
    """Run tests with another program in the place of one module.

    Parameters
    ----------
    name, path : str
        The module and its file.
    program : ast.Module or None
        The module with an error; None for the module as it is.
    tests : list of str
        Files for pytest.
    usual : dict of str to float, optional
        Seconds that each test takes without an error; other tests are left out. By
        default all tests run, whatever fails; a test that takes long fails.
    kills : Counter, optional
        How often each test has found an error. These run first, then the fast ones.

    Returns
    -------
    passed : dict of str to float
        Seconds of each test that passed.
    failed : list of str
        The tests that failed or took too long: with `usual`, the first one. It is
        ``["import"]`` if pytest did not get that far.
    """
    report, write = os.pipe()
    child = os.fork()
    if child == 0:
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        course = _Course(usual, Counter() if kills is None else kills)
        course.pipe = write
        if program is not None:
            sys.meta_path.insert(0, _Mutated(name, program, path))
        options = [
            "-qq",
            "-p",
            "no:cacheprovider",
            "--import-mode=append",
            "--doctest-modules",
        ]
        # pytest would import a file that it is given on the command line past every
        # other importer.
        options += ["--assert=plain"]
        # Numbers that are no arrays warn in plain Python, and do not in a compiled
        # loop.
        options += ["-o", "addopts=", "-W", "ignore::RuntimeWarning"]
        options += ["-W", "ignore:NUMBA_DISABLE_JIT is set"]
        # What an error lets grow without end must not take the machine's memory.
        _bound_memory()
        pytest.main([*options, *tests], plugins=[course])
        os._exit(0)
    os.close(write)
    end = time.monotonic() + _LONGEST
    while not os.waitpid(child, os.WNOHANG)[0]:
        if time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.01)
    with os.fdopen(report) as file:
        reply = file.read()
    if not reply:
        return {}, ["import"]
    seconds, failed = json.loads(reply)
    return {test: took for test, took in seconds.items() if test not in failed}, failed


def _bound_memory(n_bytes=3 * 2**30):
    import resource

    with open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + n_bytes, mapped + n_bytes))
