"""How much memory this process may still take, and one line where a step needs more, before it is
gone.
"""

import re
import sys
from pathlib import Path

from .errors import InputError

GB = 1e9  # [bytes]


def free_memory():
    """Memory that this process may still take [bytes]: by the machine, its container, and its own
    limits.

    Returns
    -------
    int or None
        None where the system does not tell.
    """
    if sys.platform == "win32":
        return _free_on_windows()
    return min([*_free_on_linux(), *_free_by_limits()], default=None)


def check_memory(source, step, needed, cure):
    """Refuse a step that needs more memory than there is.

    Parameters
    ----------
    source : str or path-like
        The file that asks for it.
    step : str
        What is to be done, as "tracing 3 patches".
    needed : float [bytes]
    cure : str

    Raises
    ------
    InputError
    """
    free = free_memory()
    if free is not None and needed > free:
        raise InputError(
            source,
            f"{step} needs {needed / GB:.1f} GB of memory, and {max(free, 0) / GB:.1f} GB are free",
            cure,
        )


def _read(path):
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:  # not on this system, or not shown to this process
        return ""


def _free_on_linux():
    """What the machine has left, and what each control group around this process has:
    yields bytes.
    """
    if found := re.search(r"^MemAvailable:\s*(\d+) kB", _read("/proc/meminfo"), re.MULTILINE):
        yield 1024 * int(found[1])
    for line in _read("/proc/self/cgroup").splitlines():
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            top, names = "/sys/fs/cgroup", ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            top = "/sys/fs/cgroup/memory"
            names = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
        else:
            continue
        # Inside a container the path may belong to the machine around it, so that only its top is
        # there.
        groups = [Path(top + path), *Path(top + path).parents]
        for group in [one for one in groups if one.is_relative_to(top)]:
            most, used = (_read(group / name).strip() for name in names[:2])
            # A limit above 2⁶⁰ bytes, more than any machine has, is none.
            if most.isdigit() and used.isdigit() and int(most) < 1 << 60:
                # Pages of files count as used, and give way.
                cache = re.search(rf"^{names[2]} (\d+)", _read(group / "memory.stat"), re.MULTILINE)
                yield int(most) - int(used) + (int(cache[1]) if cache else 0)


def _free_by_limits():
    """What limits of this process leave (`ulimit -v`, `ulimit -d`): yields bytes."""
    import resource

    status = _read("/proc/self/status")
    for limit, name in ((resource.RLIMIT_AS, "VmSize"), (resource.RLIMIT_DATA, "VmData")):
        most, _ = resource.getrlimit(limit)
        used = re.search(rf"^{name}:\s*(\d+) kB", status, re.MULTILINE)
        if used and most != resource.RLIM_INFINITY:
            # Libraries that are not loaded yet take addresses that they never fill.
            reserved = 0 if "numba" in sys.modules or limit != resource.RLIMIT_AS else 5e8
            yield int(most - 1024 * int(used[1]) - reserved)


def _free_on_windows():
    """Physical memory that is available [bytes]."""
    import ctypes

    class Status(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_ulong),
            ("load", ctypes.c_ulong),
            *(
                (name, ctypes.c_ulonglong)
                for name in ("total", "available", "a", "b", "c", "d", "e")
            ),
        )

    status = Status(length=ctypes.sizeof(Status))
    return (
        status.available
        if ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
        else None
    )
