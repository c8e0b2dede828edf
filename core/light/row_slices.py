"""Long arrays worked on in slices of rows, on all threads."""

from .ray_scene import map_in_order

ROWS_PER_SLICE = 1 << 11  # of a hundred and some columns, so that a slice stays near the processor


def work_in_slices(work, count, threads):
    """Results of `work(rows)` for slices of rows that make up `count`, in their order; the same for any threads."""
    starts = range(0, count, ROWS_PER_SLICE)
    return list(map_in_order(work, (slice(start, min(start + ROWS_PER_SLICE, count)) for start in starts), threads))
