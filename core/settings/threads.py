"""Distribute work to threads, with results that do not depend on their number."""

import os
from concurrent.futures import ThreadPoolExecutor


def usable_threads(threads=None):
    """Number of threads: as requested, else all processors available to this process."""
    if threads is not None:
        return max(1, int(threads))
    affinity = getattr(os, "sched_getaffinity", None)  # not on Windows and macOS
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def map_in_order(function, tasks, threads):
    """Yield results of `function(task)` in task order, from several threads, with a
    bounded queue.
    """
    tasks = iter(tasks)
    with ThreadPoolExecutor(threads) as pool:
        waiting = [
            pool.submit(function, task) for _, task in zip(range(2 * threads), tasks, strict=False)
        ]
        try:
            while waiting:
                result = waiting.pop(0).result()
                waiting.extend(
                    pool.submit(function, task) for _, task in zip(range(1), tasks, strict=False)
                )
                yield result
        finally:
            for future in waiting:
                future.cancel()
