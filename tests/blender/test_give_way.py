"""Steps in the background give way to the window, all but updates: on Linux by their threads' priority, elsewhere by
their number.
"""

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from citypv.core.settings.threads import usable_threads
from citypv.operators.city.job import LARGEST, NICENESS, threads_beside_window
from citypv.operators.city.run_step import Job
from citypv.operators.run.trace_city import TraceCity
from citypv.operators.run.update_city import UpdateCity


@pytest.mark.skipif(
    sys.platform != "linux", reason="threads have priorities of their own on Linux only"
)
@pytest.mark.parametrize(("step", "lower"), [(TraceCity, NICENESS), (UpdateCity, 0)])
def test_a_job_and_its_threads_run_at_a_lower_priority_than_the_window(step, lower):
    """But an update does not, which the user waits for."""

    def niceness():
        return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())

    def work(progress):
        with ThreadPoolExecutor(1) as pool:
            return niceness(), pool.submit(niceness).result()

    before, job = niceness(), Job(step.bl_label, work, niceness=step.niceness)
    job.start()
    job.join()
    assert job.error is None
    expected = min(before + lower, LARGEST)
    assert job.result == (expected, expected)
    assert niceness() == before


def test_where_threads_have_no_priority_a_core_is_left_to_the_window():
    fewer = max(1, usable_threads() - 1)
    assert threads_beside_window(True, "win32") == threads_beside_window(True, "darwin") == fewer
    assert threads_beside_window(True, "linux") is None
    assert threads_beside_window(False, "win32") is None
