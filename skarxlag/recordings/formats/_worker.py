"""The process that reads files of isolated formats; see `_isolation`.

It receives one line of JSON for each file, and sends lines of JSON. Samples follow the line that
states their shape, as bytes.
"""

import importlib.util
import json
import os
import signal
import sys
from pathlib import Path

_GIBIBYTE = 2**30


def main() -> None:
    """Read files until the parent ends."""
    # The parent handles Ctrl-C and ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    # Text that a library prints must not get between the replies.
    os.dup2(2, 1)
    formats = _import_formats()
    for line in sys.stdin.buffer:
        _reply(formats, json.loads(line), replies)


def _import_formats():
    """The package of formats without the package around it, which takes long to import."""
    folder = Path(__file__).parent
    spec = importlib.util.spec_from_file_location(
        "formats", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["formats"] = module
    spec.loader.exec_module(module)
    return module


def _reply(formats, request, replies):
    from formats._signals import describe_channels, signal_blocks

    path = Path(request["path"])
    module, contents = formats.find_format(path)
    try:
        _limit_memory(path)
        if request["n_samples"] == "describe":
            _send(replies, {"channels": describe_channels(contents(path)), "shape": [0]})
        else:
            for samples, rate in signal_blocks(
                contents(path), request["channel"], request["n_samples"]
            ):
                _send(replies, {"shape": samples.shape, "rate": rate}, samples)
        _send(replies, {"end": True})
    except Exception as error:
        reported = formats.error_of(path, error, module)
        _send(replies, {"error": type(reported).__name__, "message": str(reported)})


def _send(replies, head, samples=None):
    replies.write(json.dumps(head).encode() + b"\n")
    if samples is not None:
        replies.write(memoryview(samples).cast("B"))
    replies.flush()


def _limit_memory(path):
    """Limit the growth of this process to the needs of a file of this size, if possible."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        page = os.sysconf("SC_PAGE_SIZE")
        physical = os.sysconf("SC_PHYS_PAGES") * page
        allowed = min(4 * _GIBIBYTE + 200 * path.stat().st_size, physical)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = pages * page + allowed
        if hard != resource.RLIM_INFINITY:
            limit = min(limit, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    except (ImportError, OSError, ValueError):
        return


if __name__ == "__main__":
    main()
