"""Work shared out to threads, with results that do not depend on their number."""

import os
from concurrent.futures import ThreadPoolExecutor

ROWS_PER_SLICE = 1 << 11  # of a hundred and some columns, so that a slice stays near the processor


def usable_threads(threads=None):
    """How many threads to use: what was asked for, else every processor this process may run on."""
    if threads is not None:
        return max(1, int(threads))
    affinity = getattr(os, "sched_getaffinity", None)  # not on Windows and macOS
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def map_in_order(function, tasks, threads):
    """Results of `function(task)` in the order of the tasks, from several threads, a few tasks ahead at most."""
    tasks = iter(tasks)
    with ThreadPoolExecutor(threads) as pool:
        waiting = [pool.submit(function, task) for _, task in zip(range(2 * threads), tasks, strict=False)]
        try:
            while waiting:
                result = waiting.pop(0).result()
                waiting.extend(pool.submit(function, task) for _, task in zip(range(1), tasks, strict=False))
                yield result
        finally:
            for future in waiting:
                future.cancel()


def work_in_slices(work, count, threads):
    """Results of `work(rows)` for slices of rows that make up `count`, in their order; the same for any threads."""
    starts = range(0, count, ROWS_PER_SLICE)
    return list(map_in_order(work, (slice(start, min(start + ROWS_PER_SLICE, count)) for start in starts), threads))
